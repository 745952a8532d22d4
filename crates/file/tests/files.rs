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

/// `count` zeros, packed.
fn packed_zeros(count: usize) -> Vec<u8> {
    let options = lzma_rust2::XzOptions::with_preset(0);
    let mut writer = lzma_rust2::XzWriter::new(Vec::new(), options).expect("memory takes what is written");
    writer.write_all(&vec![0; count]).expect("memory takes what is written");
    writer.finish().expect("memory takes what is written")
}

#[test]
fn what_unpacks_to_hundreds_of_times_its_size_is_refused_unless_it_is_small() {
    let path = Path::new("x.ply.xz");
    // A table of measured reflectances that is of one colour.
    let table = 34_992_012;
    assert_eq!(unpack_xz(&packed_zeros(table), path, "PLY mesh").unwrap().len(), table);
    let bomb = packed_zeros(160 << 20);
    let error = unpack_xz(&bomb, path, "PLY mesh").unwrap_err().to_string();
    assert!(error.contains(&format!("its {} bytes unpack to more than the limit", bomb.len())), "{error}");
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

#[cfg(target_os = "linux")]
#[test]
fn what_a_killed_process_left_behind_goes_with_the_next_write_and_what_a_living_one_writes_stays() {
    let folder = tempfile::tempdir().unwrap();
    let name = |text: &str| folder.path().join(text);
    // No process has this number: Linux ends at 2^22.
    let (dead, other) = (".a.exr.4194999.partial", ".b.exr.4194999.partial");
    let (living, lately) = (".a.exr.1.partial", ".a.exr.4194998.partial");
    for file in [dead, other, living, lately, ".a.exr.x.partial"] {
        std::fs::write(name(file), "half").unwrap();
        if file != lately {
            let hour_ago = std::time::SystemTime::now() - std::time::Duration::from_secs(3600);
            std::fs::File::options().write(true).open(name(file)).unwrap().set_modified(hour_ago).unwrap();
        }
    }
    write_whole(&name("a.exr"), "EXR picture", |writer| writer.write_all(b"whole")).unwrap();
    let mut left: Vec<String> = std::fs::read_dir(folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    left.sort();
    assert_eq!(left, [living, lately, ".a.exr.x.partial", other, "a.exr"]);
}

#[test]
fn the_seeds_of_the_fuzz_target_unpack_and_damage_to_them_is_no_panic() {
    let corpus = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../fuzz/corpus/packed_xz"));
    let Ok(entries) = std::fs::read_dir(corpus) else {
        eprintln!("skipped: there is no {}", corpus.display());
        return;
    };
    for entry in entries.flatten() {
        let (path, bytes) = (entry.path(), std::fs::read(entry.path()).unwrap());
        assert!(!unpack_xz(&bytes, &path, "asset").unwrap().is_empty(), "{}", path.display());
        for place in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[place] ^= 0x5A;
            let _ = unpack_xz(&damaged, &path, "asset");
            let _ = unpack_xz(&bytes[..place], &path, "asset");
        }
    }
}
