//! OBJ; what follows the first NUL byte is its material file.

#![no_main]

use std::path::Path;

use halflight_shape::{Resolver, decode_obj};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let (mesh, materials) =
        bytes.iter().position(|b| *b == 0).map_or((bytes, &[][..]), |at| bytes.split_at(at));
    let companions = Resolver::memory().with("a.mtl", materials.to_vec()).with("a.png", vec![0]);
    if let Ok(model) = decode_obj(mesh, Path::new("fuzz.obj"), &companions) {
        for posed in model.pose(0.4) {
            posed.mesh.validate().expect("a loaded mesh is valid");
            assert!(posed.transform.is_finite());
        }
    }
});
