//! Pictures as files: formats by extension.

use std::path::Path;

use halflight_image::{Picture, Precision, RgbImage, ToneCurve, ToneMapping, save_hdr, save_png};

use super::JobError;

/// The formats that can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// OpenEXR: radiance, layers, metadata.
    Exr,
    /// Radiance HDR: radiance.
    Hdr,
    /// PNG: what a screen shows.
    Png,
}

impl Format {
    /// The format that the extension of a file's name asks for.
    ///
    /// # Errors
    /// Any other extension.
    pub fn of(path: &Path) -> Result<Self, JobError> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("exr") => Ok(Self::Exr),
            Some("hdr") => Ok(Self::Hdr),
            Some("png") => Ok(Self::Png),
            Some(other) => Err(JobError::usage(format!(
                "cannot write {}: pictures are written as .exr, .hdr or .png, not .{other}",
                path.display()
            ))),
            None => Err(JobError::usage(format!(
                "cannot write {}: the name needs an extension, .exr, .hdr or .png",
                path.display()
            ))),
        }
    }
}

/// How a picture is to be written.
#[derive(Clone, Copy, Debug)]
pub struct Encoding {
    /// Stops.
    pub exposure_ev: f32,
    /// How a PNG shows what is brighter than white.
    pub tone: ToneCurve,
    /// Whether an EXR is stored in half precision.
    pub half: bool,
}

/// Writes the picture whole, in the format of its name.
///
/// # Errors
/// An unknown format, or trouble with the disk.
pub fn save(path: &Path, picture: &Picture, encoding: &Encoding) -> Result<(), JobError> {
    match Format::of(path)? {
        Format::Exr => {
            let precision = if encoding.half { Precision::Half } else { Precision::Float };
            picture.save_exr(path, precision)?;
        }
        Format::Hdr => save_hdr(path, &color(picture))?,
        Format::Png => save_png(path, &color(picture), &tone_mapping(encoding))?,
    }
    Ok(())
}

fn color(picture: &Picture) -> RgbImage {
    picture.rgb().unwrap_or_else(|| RgbImage::new(picture.width, picture.height))
}

fn tone_mapping(encoding: &Encoding) -> ToneMapping {
    ToneMapping { exposure_ev: encoding.exposure_ev, curve: encoding.tone }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_extension_tells_the_format_in_either_case() {
        assert_eq!(Format::of(Path::new("a/B.EXR")).ok(), Some(Format::Exr));
        assert!(Format::of(Path::new("a.jpg")).is_err());
        assert!(Format::of(Path::new("exr")).is_err());
    }
}
