//! The sRGB transfer curve (IEC 61966-2-1).
//!
//! ```text
//! encode(x) = 12.92 x                    for x ≤ 0.0031308
//!           = 1.055 x^(1/2.4) − 0.055    above
//! ```
//!
//! `decode` is its inverse, with the break at 0.04045. Both are odd functions, so that slightly negative light
//! keeps its sign.

use std::sync::LazyLock;

/// Linear light of an sRGB-encoded value; 0 ↦ 0 and 1 ↦ 1.
///
/// ```
/// assert!((halflight_image::srgb_decode(0.5) - 0.214_041).abs() < 1e-6);
/// ```
pub fn srgb_decode(encoded: f32) -> f32 {
    let x = encoded.abs();
    let linear = if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) };
    linear.copysign(encoded)
}

/// sRGB-encoded value of linear light; 0 ↦ 0 and 1 ↦ 1.
///
/// ```
/// assert!((halflight_image::srgb_encode(0.18) - 0.461_356).abs() < 1e-5);
/// ```
pub fn srgb_encode(linear: f32) -> f32 {
    let x = linear.abs();
    // The difference in f64, where one comes out as one.
    let encoded =
        if x <= 0.003_130_8 { 12.92 * x } else { (1.055 * f64::from(x.powf(1.0 / 2.4)) - 0.055) as f32 };
    encoded.copysign(linear)
}

/// Linear light of an 8-bit sRGB value, from a table of 256.
#[inline]
pub fn srgb_decode_byte(encoded: u8) -> f32 {
    SRGB_TABLE[usize::from(encoded)]
}

static SRGB_TABLE: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|i| srgb_decode(i as f32 / 255.0)));

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_survives_decoding_and_encoding() {
        for byte in 0..=255_u8 {
            assert_eq!((srgb_encode(srgb_decode_byte(byte)) * 255.0).round() as u8, byte);
        }
    }

    #[test]
    fn the_two_branches_meet() {
        assert!((srgb_encode(0.003_130_8) - srgb_encode(0.003_130_9)).abs() < 2e-6);
        assert!((srgb_decode(0.04045) - srgb_decode(0.040_451)).abs() < 1e-6);
    }
}
