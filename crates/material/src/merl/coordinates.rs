//! The grid coordinates of a pair of directions, quickly.
//!
//! With S = wi + wo and Δ = wi − wo (perpendicular for unit vectors) the angles need no rotation:
//!
//! - tan θ_h = |S_xy| / S_z
//! - tan θ_d = |Δ| / |S|
//! - tan φ_d = (Δ_y S_x − Δ_x S_y) / (−Δ_z |S|)
//!
//! because h = S/|S|, and of the frame (t, b, h) that the definition turns upright, b ∝ (−S_y, S_x, 0) and
//! Δ·t = −Δ_z / sin θ_h. Sums run in f64, so that a half vector near the normal keeps its angle; the arcs come from
//! a polynomial in f32 (error below 5e-7 rad, tested). A cell's index taken from these could only differ from the
//! definition's within 1e-3 of a cell's border: there, once in a few hundred pairs, [`grid::angles`] decides.

use std::f32::consts::{FRAC_2_PI, FRAC_PI_2, PI};

use glam::{DVec3, Vec3};

use super::grid::{self, PHI_D, THETA_D, THETA_H};

/// Where a pair lies on the grid, counted in cells.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Coordinates {
    /// √(θ_h / ½π) · 90, in [0, 90].
    pub(crate) theta_h: f32,
    /// θ_d / ½π · 90, in [0, 90].
    pub(crate) theta_d: f32,
    /// φ_d / π · 180, in [0, 180].
    pub(crate) phi_d: f32,
    /// wi + wo.
    pub(crate) sum: Vec3,
    /// Whether `phi_d` is well defined at f32 precision.
    sharp: bool,
}

/// How near to a cell's border the fast coordinates are not trusted, in cells.
const GUARD: f32 = 1e-3;

impl Coordinates {
    #[inline]
    pub(crate) fn of(wo: Vec3, wi: Vec3) -> Self {
        let (wo, wi) = (unit(wo), unit(wi));
        let (sum, difference) = (wi + wo, wi - wo);
        let sum2 = sum.length_squared();
        let flat2 = sum.x * sum.x + sum.y * sum.y;
        let difference2 = difference.length_squared();
        let (length, flat, apart) =
            ((sum2 as f32).sqrt(), (flat2 as f32).sqrt(), (difference2 as f32).sqrt());
        let side = (difference.y * sum.x - difference.x * sum.y) as f32;
        let phi = arc(side, -(difference.z as f32) * length);
        let phi = if phi < 0.0 { phi + PI } else { phi };
        Self {
            theta_h: (arc(flat, sum.z as f32) * FRAC_2_PI).max(0.0).sqrt() * THETA_H as f32,
            theta_d: arc(apart, length) * (FRAC_2_PI * THETA_D as f32),
            phi_d: phi * (PHI_D as f32 / PI),
            sum: sum.as_vec3(),
            sharp: flat2 > 1e-12 && difference2 > 1e-12 && sum2 > 1e-12,
        }
    }

    /// The cell, exactly as the definition in double precision gives it.
    #[inline]
    pub(crate) fn cell(&self, wo: Vec3, wi: Vec3) -> usize {
        let inside = |x: f32| (x - x.round()).abs() > GUARD;
        if self.sharp && inside(self.theta_h) && inside(self.theta_d) && inside(self.phi_d) {
            let index = |x: f32, count: usize| (x as usize).min(count - 1);
            grid::cell(index(self.theta_h, THETA_H), index(self.theta_d, THETA_D), index(self.phi_d, PHI_D))
        } else {
            grid::cell_of(&grid::angles(wo, wi))
        }
    }
}

/// `v` to unit length in f64: one Newton step is exact to 1e-13 for what is unit in f32.
#[inline]
fn unit(v: Vec3) -> DVec3 {
    let v = v.as_dvec3();
    let length2 = v.length_squared();
    if (length2 - 1.0).abs() < 1e-5 { v * (1.5 - 0.5 * length2) } else { v.normalize_or(DVec3::Z) }
}

/// The arc tangent on [0, 1] as t · P(t²): interpolated at the Chebyshev nodes of t², relative error 1.8e-8 before
/// rounding.
const ARC: [f32; 9] = [
    0.999_999_98,
    -0.333_330_37,
    0.199_918_72,
    -0.141_977_98,
    0.106_183_71,
    -0.074_568_55,
    0.042_137_62,
    -0.015_731_25,
    0.002_766_283_5,
];

/// `y.atan2(x)` by a polynomial: error below 5e-7 rad, relative error below 5e-7 near zero. 0 for (0, 0).
#[inline]
pub(crate) fn arc(y: f32, x: f32) -> f32 {
    let (ay, ax) = (y.abs(), x.abs());
    let (small, large) = if ay > ax { (ax, ay) } else { (ay, ax) };
    if large == 0.0 {
        return 0.0;
    }
    let t = small / large;
    let t2 = t * t;
    let mut p = ARC[ARC.len() - 1];
    for &c in ARC[..ARC.len() - 1].iter().rev() {
        p = p * t2 + c;
    }
    let mut angle = p * t;
    if ay > ax {
        angle = FRAC_PI_2 - angle;
    }
    if x < 0.0 {
        angle = PI - angle;
    }
    if y < 0.0 { -angle } else { angle }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_polynomial_arc_is_the_arc_tangent() {
        for i in -2000..=2000 {
            let exact = f64::from(i) * std::f64::consts::PI / 2001.0;
            let (y, x) = (exact.sin() as f32, exact.cos() as f32);
            let error = (f64::from(arc(y, x)) - f64::from(y).atan2(f64::from(x))).abs();
            assert!(error < 5e-7, "arc({y}, {x}) is off by {error}");
        }
        for exponent in 1..30 {
            let tiny = 0.5f32.powi(exponent);
            let error = f64::from(arc(tiny, 1.0)) / f64::from(tiny).atan() - 1.0;
            assert!(error.abs() < 5e-7, "arc({tiny}, 1) is off by a part of {error}");
        }
        assert_eq!(arc(0.0, 0.0), 0.0);
    }
}
