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
//! a polynomial in f32 (error below 5e-7 rad, tested), four side by side, the fourth being the angle of h from the
//! plane of the view, which sampling asks for. A cell's index taken from these could only differ from the
//! definition's within 2e-4 of a cell's border: there, once in a thousand pairs, [`grid::angles`] decides.

use std::f32::consts::{FRAC_2_PI, FRAC_PI_2, PI, TAU};

use glam::{DVec3, Vec2, Vec3, Vec4, Vec4Swizzles};

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
    /// |wi + wo|.
    pub(crate) length: f32,
    /// How far h stands from the plane of the view, in turns, [0, 1].
    pub(crate) turn: f32,
    /// Whether `phi_d` is well defined at f32 precision.
    sharp: bool,
}

/// How near to a cell's border the fast coordinates are not trusted, in cells: five times the error of φ_d.
const GUARD: f32 = 2e-4;

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
        let half = sum.as_vec3();
        let axis = view_axis(wo.truncate().as_vec2());
        let ahead = axis.x * half.x + axis.y * half.y;
        let aside = axis.x * half.y - axis.y * half.x;
        let arcs = arcs(
            Vec4::new(flat, apart, side, aside),
            Vec4::new(half.z, length, -(difference.z as f32) * length, ahead),
        );
        // Half a turn further is the same for φ_d, a whole turn for the fourth.
        let full = Vec2::new(PI, TAU);
        let around = arcs.zw();
        let around = Vec2::select(around.cmplt(Vec2::ZERO), around + full, around);
        Self {
            theta_h: (arcs.x * FRAC_2_PI).max(0.0).sqrt() * THETA_H as f32,
            theta_d: arcs.y * (FRAC_2_PI * THETA_D as f32),
            phi_d: around.x * (PHI_D as f32 / PI),
            length,
            turn: around.y * (1.0 / TAU),
            sharp: (flat2 > 1e-12) & (difference2 > 1e-12) & (sum2 > 1e-12),
        }
    }

    /// The cell, exactly as the definition in double precision gives it.
    #[inline]
    pub(crate) fn cell(&self, wo: Vec3, wi: Vec3) -> usize {
        let (h, d, p) = (self.theta_h as i32, self.theta_d as i32, self.phi_d as i32);
        let inside = |x: f32, whole: i32| {
            let part = x - whole as f32;
            (part > GUARD) & (part < 1.0 - GUARD)
        };
        if self.sharp & inside(self.theta_h, h) & inside(self.theta_d, d) & inside(self.phi_d, p) {
            let index = |whole: i32, count: usize| (whole as usize).min(count - 1);
            grid::cell(index(h, THETA_H), index(d, THETA_D), index(p, PHI_D))
        } else {
            cell_by_definition(wo, wi)
        }
    }
}

#[cold]
fn cell_by_definition(wo: Vec3, wi: Vec3) -> usize {
    grid::cell_of(&grid::angles(wo, wi))
}

/// The direction of the view in the plane of the surface, of any length.
#[inline]
fn view_axis(flat: Vec2) -> Vec2 {
    if flat.length_squared() > 0.0 { flat } else { Vec2::X }
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

/// Four times `y.atan2(x)` by a polynomial, without a branch: error below 5e-7 rad, relative error below 5e-7 near
/// zero. 0 for (0, 0).
#[inline]
fn arcs(y: Vec4, x: Vec4) -> Vec4 {
    let (ay, ax) = (y.abs(), x.abs());
    let t = ay.min(ax) / ay.max(ax).max(Vec4::splat(f32::MIN_POSITIVE));
    let t2 = t * t;
    let (t4, term) = (t2 * t2, |i: usize| Vec4::splat(ARC[i]) + Vec4::splat(ARC[i + 1]) * t2);
    let t8 = t4 * t4;
    let p = (term(0) + term(2) * t4) + (term(4) + term(6) * t4 + Vec4::splat(ARC[8]) * t8) * t8;
    let angle = p * t;
    let angle = Vec4::select(ay.cmpgt(ax), FRAC_PI_2 - angle, angle);
    let angle = Vec4::select(x.cmplt(Vec4::ZERO), PI - angle, angle);
    Vec4::select(y.cmplt(Vec4::ZERO), -angle, angle)
}

/// One of [`arcs`].
#[inline]
pub(crate) fn arc(y: f32, x: f32) -> f32 {
    arcs(Vec4::splat(y), Vec4::splat(x)).x
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
