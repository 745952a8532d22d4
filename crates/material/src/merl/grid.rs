//! The grid of the MERL database, and the half and difference angles it is laid out in.
//!
//! With h the half vector of `wi` and `wo`, θ_h is its angle from the normal; turned so that h stands on +z, `wi`
//! has the polar angle θ_d and the azimuth φ_d. Cell (i, j, k) covers
//!
//! - √(θ_h / ½π) in [i/90, (i+1)/90): fine where highlights are,
//! - θ_d / ½π in [j/90, (j+1)/90),
//! - φ_d / π in [k/180, (k+1)/180); by reciprocity φ_d and φ_d + π are the same,
//!
//! and stands at k + 180·(j + 90·i) of each colour's plane. Source: Matusik et al. 2003, "A data-driven reflectance
//! model", and the reader published with it.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DVec3, Vec3};

/// Cells along θ_h.
pub(crate) const THETA_H: usize = 90;
/// Cells along θ_d.
pub(crate) const THETA_D: usize = 90;
/// Cells along φ_d.
pub(crate) const PHI_D: usize = 180;
/// Cells of one colour.
pub(crate) const CELLS: usize = THETA_H * THETA_D * PHI_D;
/// Bytes of the three dimensions before the values.
pub(crate) const HEADER_BYTES: usize = 12;
/// Bytes of a file.
pub(crate) const FILE_BYTES: usize = HEADER_BYTES + 3 * 8 * CELLS;
/// A stored value times this is the reflectance per steradian, for red, green, blue.
pub(crate) const SCALES: [f64; 3] = [1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0];

/// The place of a cell in a colour's plane.
pub(crate) const fn cell(theta_h: usize, theta_d: usize, phi_d: usize) -> usize {
    phi_d + PHI_D * (theta_d + THETA_D * theta_h)
}

/// Half and difference angles, φ_d in [0, π].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Angles {
    pub(crate) theta_h: f64,
    pub(crate) theta_d: f64,
    pub(crate) phi_d: f64,
}

/// The angles of a pair by their definition, in double precision: the reference for everything faster.
pub(crate) fn angles(wo: Vec3, wi: Vec3) -> Angles {
    let (wo, wi) = (wo.as_dvec3().normalize_or(DVec3::Z), wi.as_dvec3().normalize_or(DVec3::Z));
    let h = (wo + wi).normalize_or(DVec3::Z);
    let theta_h = h.truncate().length().atan2(h.z);
    let (sin_phi, cos_phi) = h.y.atan2(h.x).sin_cos();
    let (sin_theta, cos_theta) = theta_h.sin_cos();
    // R_y(−θ_h) R_z(−φ_h) wi.
    let turned = DVec3::new(cos_phi * wi.x + sin_phi * wi.y, cos_phi * wi.y - sin_phi * wi.x, wi.z);
    let d = DVec3::new(
        cos_theta * turned.x - sin_theta * turned.z,
        turned.y,
        sin_theta * turned.x + cos_theta * turned.z,
    );
    let phi = d.y.atan2(d.x);
    Angles {
        theta_h,
        theta_d: d.truncate().length().atan2(d.z),
        phi_d: if phi < 0.0 { phi + PI } else { phi },
    }
}

/// The cell that holds the angles, as the database's reader finds it.
pub(crate) fn cell_of(angles: &Angles) -> usize {
    let index = |x: f64, count: usize| (x.max(0.0) as usize).min(count - 1);
    cell(
        index((angles.theta_h / FRAC_PI_2).max(0.0).sqrt() * THETA_H as f64, THETA_H),
        index(angles.theta_d / FRAC_PI_2 * THETA_D as f64, THETA_D),
        index(angles.phi_d / PI * PHI_D as f64, PHI_D),
    )
}

/// θ_h at a place along the square-root axis, `x` counted in cells.
pub(crate) fn theta_h_at(x: f64) -> f64 {
    let s = x / THETA_H as f64;
    s * s * FRAC_PI_2
}

/// `wo` and `wi` at the centre of a cell (the middle of each coordinate, for θ_h of its square root).
pub(crate) fn cell_centre(theta_h: usize, theta_d: usize, phi_d: usize) -> (Vec3, Vec3) {
    let theta = theta_h_at(theta_h as f64 + 0.5);
    let (sin_h, cos_h) = theta.sin_cos();
    let (sin_d, cos_d) = ((theta_d as f64 + 0.5) / THETA_D as f64 * FRAC_PI_2).sin_cos();
    let (sin_p, cos_p) = ((phi_d as f64 + 0.5) / PHI_D as f64 * PI).sin_cos();
    let turned =
        |x: f64, y: f64| DVec3::new(cos_h * x + sin_h * cos_d, y, cos_h * cos_d - sin_h * x).as_vec3();
    (turned(-sin_d * cos_p, -sin_d * sin_p), turned(sin_d * cos_p, sin_d * sin_p))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_centre_of_every_cell_lies_in_that_cell() {
        for i in 0..THETA_H {
            for j in (0..THETA_D).step_by(7) {
                for k in 0..PHI_D {
                    let (wo, wi) = cell_centre(i, j, k);
                    assert_eq!(cell_of(&angles(wo, wi)), cell(i, j, k), "cell {i} {j} {k}");
                    assert_eq!(
                        cell_of(&angles(wi, wo)),
                        cell(i, j, k),
                        "cell {i} {j} {k} seen the other way"
                    );
                }
            }
        }
    }
}
