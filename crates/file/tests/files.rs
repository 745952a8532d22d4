//! Files are read with a story when they cannot be, and written whole or not at all.

use std::io::Write;
use std::path::Path;

use halflight_file::{extension, read, unpack_xz, write_whole};

#[test]
fn a_missing_file_is_told_with_its_nearest_neighbour() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("bunny.ply"), "ply").unwrap();
    let error = read(&folder.path().join("buny.ply"), "PLY mesh").unwrap_err().to_string();
    assert!(error.contains("bunny.ply?"), "{error}");
}

#[test]
fn a_folder_is_not_a_file() {
    let folder = tempfile::tempdir().unwrap();
    assert!(read(folder.path(), "PLY mesh").unwrap_err().to_string().contains("folder"));
}

#[test]
fn damaged_packing_is_an_error_and_not_a_panic() {
    for bytes in [&b""[..], b"not xz at all", &[0xFD, b'7', b'z', b'X', b'Z', 0, 0, 4]] {
        assert!(unpack_xz(bytes, Path::new("x.ply.xz"), "PLY mesh").is_err());
    }
}

#[test]
fn the_extension_looks_through_the_packing() {
    assert_eq!(extension(Path::new("a/B.PLY.xz")), "ply");
    assert_eq!(extension(Path::new("a/b.hdr")), "hdr");
    assert_eq!(extension(Path::new("none")), "");
}

#[test]
fn a_failed_write_leaves_the_old_file_and_no_other() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.exr");
    write_whole(&path, "EXR picture", |w| w.write_all(b"old")).unwrap();
    let failed = write_whole(&path, "EXR picture", |w| {
        w.write_all(b"half of the new")?;
        Err(std::io::Error::other("out of ideas"))
    });
    assert!(failed.unwrap_err().to_string().contains("out of ideas"));
    assert_eq!(std::fs::read(&path).unwrap(), b"old");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}
