//! Where pictures go: checks before the work starts, and the writing after it.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::ValueEnum;
pub(crate) use halflight::job::{Encoding, Format};
use halflight_image::{Picture, ToneCurve};

use super::failure::Failure;

/// How radiance becomes what a PNG holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Tone {
    /// Clamped to 0..1 and encoded as sRGB
    Srgb,
    /// With a shoulder that keeps highlights and a toe that deepens shadows
    Filmic,
}

impl From<Tone> for ToneCurve {
    fn from(tone: Tone) -> Self {
        match tone {
            Tone::Srgb => Self::Srgb,
            Tone::Filmic => Self::Filmic,
        }
    }
}

/// Writes the picture whole, in the format of its name.
pub(crate) fn save(path: &Path, picture: &Picture, encoding: &Encoding) -> Result<(), Failure> {
    Ok(halflight::job::save(path, picture, encoding)?)
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
