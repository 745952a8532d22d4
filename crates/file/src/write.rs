use std::ffi::OsString;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::SaveError;

/// A picture is written in seconds; a temporary file that has not grown for so long has no writer.
const ABANDONED_AFTER: Duration = Duration::from_secs(600);

/// Writes a file that is whole or absent: into a temporary file beside it, synced and then renamed over it.
/// `asked` is a noun for the error: `EXR picture`.
///
/// # Errors
/// Whatever the writer or the file system says; the temporary file is removed, and what stood under the name
/// before still stands.
///
/// A process that is killed in the middle leaves its temporary file behind: the
/// next write under the same name removes those of processes that are no more.
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
    remove_left_behind(path);
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
            io::ErrorKind::FileTooLarge => Some("raise the limit on the size of files (`ulimit -f`)"),
            io::ErrorKind::QuotaExceeded => Some("free some of your share of the disk, or choose another"),
            io::ErrorKind::StorageFull => Some("free some space, or choose another disk"),
            _ => None,
        };
        error(e.to_string(), hint)
    })
}

/// Removes the temporary files that dead processes left beside `path`. Where the system does not tell which processes
/// live (elsewhere than on Linux) all are left alone, and so is what was written to lately: on a shared disk it
/// may belong to another machine. What cannot be removed is no reason not to write.
fn remove_left_behind(path: &Path) {
    if !Path::new("/proc/self").exists() {
        return;
    }
    let Some(name) = path.file_name().map(|name| format!(".{}.", name.to_string_lossy())) else { return };
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let candidate = entry.file_name();
        let process = candidate
            .to_str()
            .and_then(|text| text.strip_prefix(&name)?.strip_suffix(".partial")?.parse::<u32>().ok());
        let is_old = || {
            let age =
                entry.metadata().and_then(|m| m.modified()).map(|time| time.elapsed().unwrap_or_default());
            age.is_ok_and(|age| age > ABANDONED_AFTER)
        };
        if process.is_some_and(|id| !Path::new(&format!("/proc/{id}")).exists()) && is_old() {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// A name in the same folder, so that the rename stays on one file system, unlike any other process's.
fn temporary_name(path: &Path) -> PathBuf {
    let mut name = OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(format!(".{}.partial", std::process::id()));
    path.with_file_name(name)
}
