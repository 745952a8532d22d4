//! From display values to linear ones.

use glam::Vec3;

/// IEC 61966-2-1: the linear value in [0, 1] of an sRGB value in [0, 1]. Values above 1 go on along the curve.
pub(super) fn srgb_to_linear(value: f32) -> f32 {
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

/// The same for three channels.
pub(super) fn srgb_to_linear_color(color: Vec3) -> Vec3 {
    Vec3::from(color.to_array().map(srgb_to_linear))
}
