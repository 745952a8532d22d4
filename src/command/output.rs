//! Where pictures go: formats by extension, checks before the work starts, and the writing after it.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use halflight_image::{Picture, Precision, RgbImage, ToneCurve, ToneMapping, save_hdr, save_png};

use super::failure::Failure;

/// The formats that can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    /// OpenEXR: radiance, layers, metadata.
    Exr,
    /// Radiance HDR: radiance.
    Hdr,
    /// PNG: what a screen shows.
    Png,
}

impl Format {
    /// The format that the extension of a file's name asks for.
    pub(crate) fn of(path: &Path) -> Result<Self, Failure> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("exr") => Ok(Self::Exr),
            Some("hdr") => Ok(Self::Hdr),
            Some("png") => Ok(Self::Png),
            Some(other) => Err(Failure::usage(format!(
                "cannot write {}: pictures are written as .exr, .hdr or .png, not .{other}",
                path.display()
            ))),
            None => Err(Failure::usage(format!(
                "cannot write {}: the name needs an extension, .exr, .hdr or .png",
                path.display()
            ))),
        }
    }
}

/// How radiance becomes what a PNG holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Tone {
    /// Clamped to 0..1 and encoded as sRGB
    Srgb,
    /// With a shoulder that keeps highlights and a toe that deepens shadows
    Filmic,
}

/// How a picture is to be written.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Encoding {
    pub(crate) exposure_ev: f32,
    pub(crate) tone: Tone,
    pub(crate) half: bool,
}

/// Writes the picture whole, in the format of its name.
pub(crate) fn save(path: &Path, picture: &Picture, encoding: &Encoding) -> Result<(), Failure> {
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
    let curve = match encoding.tone {
        Tone::Srgb => ToneCurve::Srgb,
        Tone::Filmic => ToneCurve::Filmic,
    };
    ToneMapping { exposure_ev: encoding.exposure_ev, curve }
}

/// Fails now rather than after hours of work: the folder must take new files, and is made if there is none; the name
/// must not be that of a folder or a device.
pub(crate) fn check_writable(path: &Path) -> Result<(), Failure> {
    let error = |found: String| Failure::Failed(format!("cannot write {}: {found}", path.display()));
    if let Ok(metadata) = std::fs::metadata(path) {
        if metadata.is_dir() {
            return Err(error("this is a folder (name a file inside it)".into()));
        }
        // The finished file is renamed over the name, which would replace the device.
        if !metadata.is_file() {
            return Err(error("this is not an ordinary file".into()));
        }
    }
    let folder = folder_of(path);
    std::fs::create_dir_all(&folder)
        .map_err(|e| error(format!("there is no folder {}, and it cannot be made: {e}", folder.display())))?;
    if !folder.is_dir() {
        return Err(error(format!("{} is not a folder", folder.display())));
    }
    let probe = probe_name(path);
    std::fs::File::create(&probe)
        .and_then(|_| std::fs::remove_file(&probe))
        .map_err(|e| error(format!("{e} (choose a folder you may write to)")))
}

/// The folder a file stands in.
pub(crate) fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_path_buf(),
        _ => PathBuf::from("."),
    }
}

/// Unlike any name that a render would use.
fn probe_name(path: &Path) -> PathBuf {
    let mut name = OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(format!(".{}.probe.partial", std::process::id()));
    path.with_file_name(name)
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

    #[test]
    fn what_cannot_be_written_is_known_before_the_work() {
        let folder = tempfile::tempdir().unwrap();
        assert!(check_writable(&folder.path().join("new.exr")).is_ok());
        assert!(check_writable(folder.path()).is_err());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
        std::fs::write(folder.path().join("file"), "").unwrap();
        assert!(check_writable(&folder.path().join("file/new.exr")).is_err());
        assert!(check_writable(&folder.path().join("a/b/new.exr")).is_ok());
        assert_eq!(std::fs::read_dir(folder.path().join("a/b")).unwrap().count(), 0);
    }
}
