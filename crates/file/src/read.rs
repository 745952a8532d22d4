use std::io::{Cursor, ErrorKind, Read};
use std::path::Path;

use crate::{LoadError, nearest_name};

/// The most that [`read`] takes into memory, packed or unpacked: larger than any asset halflight is meant for,
/// and small enough that a file made to unpack without end stops.
pub const MAX_FILE_BYTES: u64 = 8 << 30;

/// How many times larger than its packing a file may be, beyond [`FREE_BYTES`]. xz packs a run of one byte almost
/// seven thousand times smaller; the meshes and tables that are worth packing stay below a hundred.
const MOST_RATIO: u64 = 1000;

/// What a packed file may unpack to whatever its ratio: twice a table of measured reflectances, which may well be
/// of one colour.
const FREE_BYTES: u64 = 64 << 20;

/// How much memory the xz dictionary may take, in KiB; the strongest preset (`xz -9`) asks for 64 MiB.
const XZ_MEMORY_KIB: u32 = 256 << 10;

/// Reads a whole file; if its name ends in `.xz` it is unpacked. `asked` is a noun for the error: `PLY mesh`.
///
/// # Errors
/// A missing file (with the nearest name in its folder), a folder, no permission, damaged packing, or more
/// than [`MAX_FILE_BYTES`].
pub fn read(path: &Path, asked: &str) -> Result<Vec<u8>, LoadError> {
    let error = |found: String| LoadError::new(asked, path, found);
    let metadata = std::fs::metadata(path).map_err(|e| match e.kind() {
        ErrorKind::NotFound => missing(path, asked),
        _ => error(e.to_string()),
    })?;
    if metadata.is_dir() {
        return Err(error("this is a folder, not a file".into()).hint("name a file inside it"));
    }
    // A pipe or a device has no end that can be trusted.
    if !metadata.is_file() {
        return Err(error("this is not an ordinary file".into()));
    }
    if metadata.len() > MAX_FILE_BYTES {
        return Err(error(format!("{} bytes, more than the limit of {MAX_FILE_BYTES}", metadata.len())));
    }
    let bytes = std::fs::read(path).map_err(|e| error(e.to_string()))?;
    if has_extension(path, "xz") { unpack_xz(&bytes, path, asked) } else { Ok(bytes) }
}

/// Unpacks an xz stream that was read from `path`.
///
/// # Errors
/// Damaged or truncated packing, a dictionary larger than any preset uses, more than [`MAX_FILE_BYTES`], or a file
/// that is made to grow: of more than 64 MiB and two hundred times its packing.
pub fn unpack_xz(packed: &[u8], path: &Path, asked: &str) -> Result<Vec<u8>, LoadError> {
    let error = |found: String| LoadError::new(asked, path, found).hint("check the file with `xz --test`");
    let reader = lzma_rust2::XzReader::new_mem_limit(Cursor::new(packed), true, XZ_MEMORY_KIB);
    let limit = MAX_FILE_BYTES.min(FREE_BYTES + MOST_RATIO * packed.len() as u64);
    let mut bytes = Vec::new();
    reader
        .take(limit + 1)
        .read_to_end(&mut bytes)
        .map_err(|e| error(format!("the xz packing is damaged or cut short: {e}")))?;
    if bytes.len() as u64 > limit {
        let found = format!("its {} bytes unpack to more than the limit of {limit}", packed.len());
        return Err(LoadError::new(asked, path, found).hint("unpack it with `xz -d` if it is meant to be so"));
    }
    Ok(bytes)
}

/// The lower-case extension that tells the format: of `bunny.PLY.xz` it is `ply`.
pub fn extension(path: &Path) -> String {
    let stem = if has_extension(path, "xz") { path.with_extension("") } else { path.to_path_buf() };
    stem.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}

fn has_extension(path: &Path, wanted: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(wanted))
}

fn missing(path: &Path, asked: &str) -> LoadError {
    let error = LoadError::new(asked, path, "there is no such file");
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let Ok(entries) = std::fs::read_dir(folder) else {
        return error.hint(format!("there is no folder {} either", folder.display()));
    };
    let names: Vec<String> =
        entries.flatten().map(|e| e.file_name().to_string_lossy().into_owned()).collect();
    let wanted = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    match nearest_name(&wanted, names.iter().map(String::as_str)) {
        Some(name) => error.hint(format!("did you mean {}?", folder.join(name).display())),
        None => error,
    }
}
