//! Radiance HDR, with or without its signature.

#![no_main]

use std::path::Path;

use halflight_image::decode_rgb;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let name = Path::new("fuzz.hdr");
    if let Ok(image) = decode_rgb(bytes, name) {
        assert!(image.pixels.as_flattened().iter().all(|v| v.is_finite()));
    }
});
