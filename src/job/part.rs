//! A share of a picture as a file: its pixels, and all that they belong to.
//!
//! An EXR whose display window is the whole picture and whose data window is the share; the metadata say whose share it is.

use std::path::{Path, PathBuf};

use halflight_image::{Picture, PicturePart, Precision, ToneCurve};

use super::{JobError, Order, Share, Size};

/// Keys of the metadata of parts, beside those of every picture.
pub(super) const SHARE: &str = "tile";
pub(super) const ASKED: &str = "tile_samples";
pub(super) const PRECISION: &str = "tile_precision";
pub(super) const EXPOSURE: &str = "tile_exposure";
pub(super) const TONE: &str = "tile_tone";
pub(super) const OWN: [&str; 5] = [SHARE, ASKED, PRECISION, EXPOSURE, TONE];

/// How the whole picture is going to be shown, which its parts carry along.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Showing {
    /// Stops; `None` if what the picture shows decides.
    pub exposure_ev: Option<f32>,
    /// How a PNG shows what is brighter than white.
    pub tone: ToneCurve,
}

/// Writes the picture of an order's share.
///
/// # Errors
/// If the order has no share, or trouble with the disk.
pub fn save_part(
    path: &Path,
    picture: Picture,
    order: &Order,
    showing: Showing,
    half: bool,
) -> Result<(), JobError> {
    let share = order.share.ok_or_else(|| JobError::failed("this is a whole picture, not a tile"))?;
    save_share(path, picture, share, order.size, order.budget.samples, showing, half)
}

/// Writes a share of a picture of that size, for which so many samples were asked.
///
/// # Errors
/// A picture that does not have the pixels of the share, or trouble with the disk.
pub fn save_share(
    path: &Path,
    mut picture: Picture,
    share: Share,
    whole: Size,
    samples: Option<u32>,
    showing: Showing,
    half: bool,
) -> Result<(), JobError> {
    let region = share.region(whole.width, whole.height).map_err(JobError::usage)?;
    if [picture.width, picture.height] != [region.width, region.height] {
        return Err(JobError::usage(format!(
            "tile {share} of {}×{} pixels has {}×{}, and this picture {}×{}",
            whole.width, whole.height, region.width, region.height, picture.width, picture.height
        )));
    }
    let exposure = showing.exposure_ev.map_or("automatic".into(), |ev| ev.to_string());
    let asked = samples.map_or("as many as the technique takes".into(), |n| format!("{n} a pixel"));
    let entries = [
        (SHARE, share.to_string()),
        (ASKED, asked),
        (PRECISION, if half { "half" } else { "float" }.into()),
        (EXPOSURE, exposure),
        (TONE, tone_name(showing.tone).into()),
    ];
    picture.metadata.extend(entries.map(|(key, value)| (key.to_string(), value)));
    let part = PicturePart { picture, origin: [region.x, region.y], whole: [whole.width, whole.height] };
    part.save_exr(path, if half { Precision::Half } else { Precision::Float })?;
    Ok(())
}

pub(super) fn tone_name(tone: ToneCurve) -> &'static str {
    match tone {
        ToneCurve::Srgb => "srgb",
        ToneCurve::Filmic => "filmic",
    }
}

pub(super) fn tone_of(name: &str) -> Option<ToneCurve> {
    [ToneCurve::Srgb, ToneCurve::Filmic].into_iter().find(|&tone| tone_name(tone) == name)
}

/// The name of a share's file: share 2 of 16 of `out.exr` is `out.tile02of16.exr`.
pub fn part_name(output: &Path, share: Share) -> PathBuf {
    let name = output.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let digits = share.count.to_string().len();
    let tile = format!("tile{:0digits$}of{}", share.index, share.count);
    output.with_file_name(match name.rsplit_once('.') {
        Some((stem, extension)) if !stem.is_empty() => format!("{stem}.{tile}.{extension}"),
        _ => format!("{name}.{tile}"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_file_of_a_share_is_named_after_the_picture_and_the_share() {
        let name = |share: Share| part_name(Path::new("a/out.0007.exr"), share).display().to_string();
        assert_eq!(name(Share { index: 2, count: 16 }), "a/out.0007.tile02of16.exr");
        assert_eq!(name(Share { index: 3, count: 3 }), "a/out.0007.tile3of3.exr");
    }
}
