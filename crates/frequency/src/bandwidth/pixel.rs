//! From cycles per radian at the eye to pixels: how densely a picture has to be shaded.

use super::operators::{GRAZING, UNLIMITED, bounded};

/// Radians that a pixel of a pinhole camera spans along the line to the picture's centre: 2 tan(f/2)/W · cos² of the angle
/// off the axis. `[001]` eq. (6) prints f/W, which is 8 % less at the centre for f = 55°.
#[inline]
#[must_use]
pub fn pixel_angle(field_of_view: f32, pixels: f32, cos_off_axis: f32) -> f32 {
    2.0 * (0.5 * field_of_view).tan() / pixels.max(1.0) * cos_off_axis * cos_off_axis
}

/// The largest that a pixel spans in any direction: 2 tan(f/2)/W · cos of the angle off the axis.
#[inline]
#[must_use]
pub fn pixel_angle_bound(field_of_view: f32, pixels: f32, cos_off_axis: f32) -> f32 {
    2.0 * (0.5 * field_of_view).tan() / pixels.max(1.0) * cos_off_axis
}

/// b_p, cycles per pixel, from ν_a in cycles/rad and the pixel's angles in rad. `[001]` eq. (6).
#[inline]
#[must_use]
pub fn pixel_bandwidth(angular: f32, pixel_angle_x: f32, pixel_angle_y: f32) -> f32 {
    bounded(angular * pixel_angle_x.max(pixel_angle_y))
}

/// The pyramid level whose pixels are as wide as Nyquist's spacing allows: ⌊log₂(1/(2 b_p))⌋, in `finest..=coarsest`.
/// Level 0 is the picture, negative levels are supersampling. `[001]` eq. (11), corrected: the printed form leaves out
/// the 2 and is one level too coarse. NaN gives the finest.
#[inline]
#[must_use]
pub fn level(pixel_bandwidth: f32, finest: i32, coarsest: i32) -> i32 {
    let spacing = 0.5 / bounded(pixel_bandwidth);
    // The exponent field of a positive float is ⌊log₂⌋ + 127; of infinity (nothing varies) it is 255.
    let floor = (spacing.to_bits() >> 23) as i32 - 127;
    floor.min(coarsest).max(finest)
}

/// The coarsest useful level of a picture: ⌊min(log₂ W, log₂ H)⌋.
#[must_use]
pub fn coarsest_level(width: usize, height: usize) -> i32 {
    width.min(height).max(1).ilog2() as i32
}

/// The two axes of the upsampling kernel of `[001]` §3.2, corrected: (b along the projected normal, b across it). b_p is
/// already the larger one, as it contains 1/cos θ_x; across the tilt the truth lies between b_p cos² θ_x (curvature
/// dominates) and b_p cos θ_x (texture does), of which the larger is given.
#[inline]
#[must_use]
pub fn anisotropy(pixel_bandwidth: f32, cos_exit: f32) -> (f32, f32) {
    (pixel_bandwidth, pixel_bandwidth * cos_exit.clamp(GRAZING, 1.0))
}

/// What a picture can show at most, cycles per pixel, with `finest` as its finest level (0: none below the pixel).
#[inline]
#[must_use]
pub fn representable(finest: i32) -> f32 {
    (0.5 * (-finest as f32).exp2()).min(UNLIMITED)
}
