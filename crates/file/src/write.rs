use std::ffi::OsString;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::SaveError;

/// Writes a file that is whole or absent: into a temporary file beside it, synced and then renamed over it.
/// `asked` is a noun for the error: `EXR picture`.
///
/// # Errors
/// Whatever the writer or the file system says; the temporary file is removed, and what stood under the name
/// before still stands.
pub fn write_whole(
    path: &Path,
    asked: &str,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<(), SaveError> {
    let error = |found: String, hint: Option<&str>| SaveError {
        asked: asked.into(),
        path: path.to_path_buf(),
        found,
        hint: hint.map(Into::into),
    };
    if path.is_dir() {
        return Err(error("this is a folder".into(), Some("name a file inside it")));
    }
    let temporary = temporary_name(path);
    let result = File::create(&temporary).and_then(|file| {
        let mut writer = BufWriter::new(file);
        write(&mut writer)?;
        writer.flush()?;
        writer.get_ref().sync_all()?;
        std::fs::rename(&temporary, path)
    });
    result.map_err(|e| {
        // The error to report is the first one; a temporary file that cannot be removed adds nothing to it.
        let _ = std::fs::remove_file(&temporary);
        let hint = match e.kind() {
            io::ErrorKind::NotFound => Some("make the folder first"),
            io::ErrorKind::PermissionDenied => Some("choose a folder you may write to"),
            io::ErrorKind::StorageFull => Some("free some space, or choose another disk"),
            _ => None,
        };
        error(e.to_string(), hint)
    })
}

/// A name in the same folder, so that the rename stays on one file system, unlike any other process's.
fn temporary_name(path: &Path) -> PathBuf {
    let mut name = OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(format!(".{}.partial", std::process::id()));
    path.with_file_name(name)
}
