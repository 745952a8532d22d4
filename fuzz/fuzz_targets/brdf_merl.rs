//! MERL reflectance, read both ways.

#![no_main]

use std::path::Path;

use glam::Vec3;
use halflight_material::{Lookup, MeasuredBrdf};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    for lookup in [Lookup::Nearest, Lookup::Interpolated] {
        if let Ok(brdf) = MeasuredBrdf::decode(bytes, Path::new("fuzz.binary"), lookup) {
            let value = brdf.reflectance(Vec3::Z, Vec3::new(0.6, 0.0, 0.8));
            assert!(value.is_finite() && value.min_element() >= 0.0);
        }
    }
});
