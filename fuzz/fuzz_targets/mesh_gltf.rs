//! glTF, text or binary, without companions.

#![no_main]

use std::path::Path;

use halflight_shape::{Resolver, decode_gltf};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(model) = decode_gltf(bytes, Path::new("fuzz.glb"), &Resolver::memory()) {
        for posed in model.pose(0.4) {
            posed.mesh.validate().expect("a loaded mesh is valid");
            assert!(posed.transform.is_finite());
        }
    }
});
