//! The packing `.xz`, which any asset may come in.

#![no_main]

use std::path::Path;

use halflight_file::{MAX_FILE_BYTES, unpack_xz};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(unpacked) = unpack_xz(bytes, Path::new("fuzz.ply.xz"), "asset") {
        assert!(unpacked.len() as u64 <= MAX_FILE_BYTES);
    }
});
