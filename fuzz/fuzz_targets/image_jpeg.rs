//! JPEG: colours, textures and heights.

#![no_main]

use std::path::Path;

use halflight_image::{ColorSpace, decode_height, decode_rgb, decode_texture};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let name = Path::new("fuzz.jpeg");
    let _ = decode_texture(bytes, name, ColorSpace::Srgb);
    if let Ok(image) = decode_rgb(bytes, name) {
        assert!(image.pixels.as_flattened().iter().all(|v| v.is_finite()));
    }
    if let Ok(height) = decode_height(bytes, name) {
        assert!(height.plane.values.iter().all(|v| v.is_finite()));
    }
});
