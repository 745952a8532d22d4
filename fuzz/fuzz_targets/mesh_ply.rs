//! PLY, in text and in either order of bytes.

#![no_main]

use std::path::Path;

use halflight_shape::decode_ply;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(model) = decode_ply(bytes, Path::new("fuzz.ply")) {
        for posed in model.pose(0.4) {
            posed.mesh.validate().expect("a loaded mesh is valid");
            assert!(posed.transform.is_finite());
        }
    }
});
