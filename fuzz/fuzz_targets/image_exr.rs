//! OpenEXR: layers, colours and heights.

#![no_main]

use std::path::Path;

use halflight_image::{Picture, decode_height, decode_rgb};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let name = Path::new("fuzz.exr");
    let _ = Picture::decode_exr(bytes, name);
    if let Ok(image) = decode_rgb(bytes, name) {
        assert!(image.pixels.as_flattened().iter().all(|v| v.is_finite()));
    }
    if let Ok(height) = decode_height(bytes, name) {
        assert!(height.plane.values.iter().all(|v| v.is_finite()));
    }
});
