//! The material file of an OBJ that uses two of its materials.

#![no_main]

use std::path::Path;

use halflight_shape::{Resolver, decode_obj};
use libfuzzer_sys::fuzz_target;

const MESH: &[u8] = b"mtllib a.mtl
v 0 0 0
v 1 0 0
v 0 1 0
vt 0 0
usemtl red
f 1/1 2/1 3/1
usemtl blue
f 3/1 2/1 1/1
";

fuzz_target!(|bytes: &[u8]| {
    let companions = Resolver::memory().with("a.mtl", bytes.to_vec()).with("a.png", vec![0]);
    if let Ok(model) = decode_obj(MESH, Path::new("fuzz.obj"), &companions) {
        for posed in model.pose(0.0) {
            posed.mesh.validate().expect("a loaded mesh is valid");
        }
    }
});
