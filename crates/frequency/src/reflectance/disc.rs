//! The hemisphere as an equidistant disc.

use std::f32::consts::{FRAC_2_PI, FRAC_PI_2};

use glam::{Vec2, Vec3};

use super::SIDE;

/// Just above the horizon, where reflectances are still defined.
const HORIZON: f32 = 0.998;

/// The direction at (x, y) of the disc: θ = π/2 · |(x, y)|, points outside are pulled to the horizon.
#[must_use]
pub fn disc_to_hemisphere(at: Vec2) -> Vec3 {
    let r = at.length();
    let (sin, cos) = (r.min(HORIZON) * FRAC_PI_2).sin_cos();
    let along = if r > 1e-6 { at / r } else { Vec2::X };
    Vec3::new(along.x * sin, along.y * sin, cos)
}

/// The inverse, for directions on or above the horizon; those below are lifted to it.
#[inline]
#[must_use]
pub fn hemisphere_to_disc(direction: Vec3) -> Vec2 {
    let r = direction.z.clamp(0.0, 1.0).acos() * FRAC_2_PI;
    let across = direction.truncate();
    let length = across.length();
    if length > 1e-6 { across * (r / length) } else { Vec2::ZERO }
}

/// The cell of a table of `SIDE`² that holds a direction.
#[inline]
pub(super) fn cell(direction: Vec3) -> usize {
    let at = hemisphere_to_disc(direction);
    // Converting saturates, NaN becomes 0.
    let index = |x: f32| (((x + 1.0) * (0.5 * SIDE as f32)) as usize).min(SIDE - 1);
    index(at.y) * SIDE + index(at.x)
}

/// Lengths on the sphere of a step in x and in y at (x, y), per unit of the disc.
pub(super) fn stretch(at: Vec2) -> Vec2 {
    let r = at.length();
    let around = if r > 1e-4 { (r.min(1.0) * FRAC_PI_2).sin() / r } else { FRAC_PI_2 };
    let along = if r > 1e-4 { at / r } else { Vec2::X };
    Vec2::new((FRAC_PI_2 * along.x).hypot(around * along.y), (FRAC_PI_2 * along.y).hypot(around * along.x))
}
