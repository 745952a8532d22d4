//! Any material, written in the layout of the MERL database.
//!
//! Each cell takes the reflectance at its centre, the mean of both directions of light (for what is reciprocal they
//! are equal), divided by the scale of its colour; cells whose centre lies below the horizon take −1. Reading the
//! file back gives the material within the variation over a cell. A GGX metal takes 0.6 s on two busy cores.

use std::io::Write;
use std::path::Path;

use glam::Vec3;
use halflight_file::SaveError;
use rayon::prelude::*;

use super::grid::{CELLS, FILE_BYTES, PHI_D, SCALES, THETA_D, THETA_H, cell_centre};
use crate::bsdf::Bsdf;

const ASKED: &str = "MERL reflectance";

/// The bytes of a MERL file of the reflectance per steradian (without the cosine) that `reflectance(wo, wi)` gives
/// for directions above the surface. Negative and non-finite values are written as −1, "not measured".
pub fn merl_bytes(reflectance: impl Fn(Vec3, Vec3) -> Vec3 + Sync) -> Vec<u8> {
    let rows: Vec<Vec<[f64; 3]>> = (0..THETA_H * THETA_D)
        .into_par_iter()
        .map(|row| (0..PHI_D).map(|k| stored(&reflectance, row / THETA_D, row % THETA_D, k)).collect())
        .collect();
    let mut bytes = Vec::with_capacity(FILE_BYTES);
    for dimension in [THETA_H, THETA_D, PHI_D] {
        bytes.extend_from_slice(&(dimension as i32).to_le_bytes());
    }
    for channel in 0..3 {
        for value in rows.iter().flatten() {
            bytes.extend_from_slice(&value[channel].to_le_bytes());
        }
    }
    debug_assert_eq!(rows.len() * PHI_D, CELLS);
    bytes
}

/// Writes what a surface reflects as a MERL file. What goes through it, and light from behind, is left out.
///
/// The surface has to be isotropic to be told by such a file; of an anisotropic one the section along x is written.
///
/// # Errors
/// A surface that a table cannot hold (mirrors, clear glass), and whatever the file system says.
pub fn write_merl(bsdf: &Bsdf<'_>, path: &Path) -> Result<(), SaveError> {
    if bsdf.is_delta_only() {
        return Err(SaveError {
            asked: ASKED.into(),
            path: path.into(),
            found: "the material scatters into single directions only, which a table cannot hold".into(),
            hint: Some("give it a roughness of 0.05 or more".into()),
        });
    }
    let bytes = merl_bytes(|wo, wi| bsdf.eval(wo, wi) / wi.z);
    halflight_file::write_whole(path, ASKED, |writer| writer.write_all(&bytes))
}

fn stored(
    reflectance: &impl Fn(Vec3, Vec3) -> Vec3,
    theta_h: usize,
    theta_d: usize,
    phi_d: usize,
) -> [f64; 3] {
    let (wo, wi) = cell_centre(theta_h, theta_d, phi_d);
    if wo.z <= 0.0 || wi.z <= 0.0 {
        return [-1.0; 3];
    }
    let mean = 0.5 * (reflectance(wo, wi).as_dvec3() + reflectance(wi, wo).as_dvec3());
    if !mean.is_finite() || mean.min_element() < 0.0 {
        return [-1.0; 3];
    }
    std::array::from_fn(|channel| mean[channel] / SCALES[channel])
}
