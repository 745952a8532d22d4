//! Reading a MERL file, with everything in it checked.

use std::path::Path;

use halflight_file::{LoadError, Place};

use super::grid::{CELLS, FILE_BYTES, HEADER_BYTES, PHI_D, SCALES, THETA_D, THETA_H};
use super::lookup::{Lookup, Table};
use super::{MeasuredBrdf, grid};

const ASKED: &str = "MERL reflectance";

/// The largest reflectance per steradian that is believed. A perfect mirror spread over the finest cell of the grid
/// (1e-7 sr) would have 1e7; beyond 1e9 a file is damaged, and sums would leave the range of f32.
const MAX_REFLECTANCE: f64 = 1e9;

impl MeasuredBrdf {
    /// Loads a MERL `.binary` file, also packed as `.binary.xz`.
    ///
    /// # Errors
    /// What [`halflight_file::read`] and [`MeasuredBrdf::decode`] say.
    pub fn load(path: &Path, lookup: Lookup) -> Result<Self, LoadError> {
        let brdf = Self::decode(&halflight_file::read(path, ASKED)?, path, lookup)?;
        Ok(Self { file: Some(path.to_path_buf()), ..brdf })
    }

    /// The same from the unpacked bytes of a file; `name` is for errors and for [`MeasuredBrdf::name`].
    ///
    /// # Errors
    /// Dimensions other than 90 × 90 × 180, a length other than 34,992,012 bytes, values that are not finite or
    /// larger than any reflectance.
    pub fn decode(bytes: &[u8], name: &Path, lookup: Lookup) -> Result<Self, LoadError> {
        let error = |found: String| LoadError::new(ASKED, name, found);
        let Some((header, values)) = bytes.split_at_checked(HEADER_BYTES) else {
            return Err(error(format!("{} bytes, fewer than the header of {HEADER_BYTES} has", bytes.len())));
        };
        let dimensions: [i32; 3] = std::array::from_fn(|i| little_endian_i32(&header[4 * i..]));
        let expected = [THETA_H, THETA_D, PHI_D].map(|n| n as i32);
        if dimensions != expected {
            return Err(wrong_dimensions(dimensions, expected, error));
        }
        if bytes.len() != FILE_BYTES {
            let what = if bytes.len() < FILE_BYTES { "cut short" } else { "too long" };
            return Err(error(format!(
                "{} bytes, {what}: a table of 90 × 90 × 180 has {FILE_BYTES}",
                bytes.len()
            )));
        }
        let mut cells = vec![[0f32; 3]; CELLS];
        let mut measured = vec![true; CELLS];
        for (channel, plane) in values.chunks_exact(8 * CELLS).enumerate() {
            for (index, stored) in plane.chunks_exact(8).enumerate() {
                let stored = little_endian_f64(stored);
                let value = stored * SCALES[channel];
                // A negative infinity is damage too, not a mark.
                if !stored.is_finite() || value > MAX_REFLECTANCE {
                    let byte = HEADER_BYTES + 8 * (channel * CELLS + index);
                    let color = ["red", "green", "blue"][channel];
                    return Err(error(format!("the {color} value of {} is {stored}", cell_name(index)))
                        .at(Place::Byte(byte as u64))
                        .hint(format!(
                            "every value of a MERL file is a finite number that scales to at most {MAX_REFLECTANCE:e} per \
                             steradian; the file is damaged"
                        )));
                }
                if stored < 0.0 {
                    measured[index] = false;
                } else {
                    cells[index][channel] = value as f32;
                }
            }
        }
        let invalid = measured.iter().filter(|&&measured| !measured).count();
        if invalid == CELLS {
            return Err(error("every cell is marked as not measured".into()));
        }
        if lookup == Lookup::Interpolated {
            fill(&mut cells, &measured);
        }
        let name = name.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        Ok(Self::build(name, Table::new(cells, lookup), invalid))
    }
}

/// Gives cells that were not measured the value of the nearest one towards smaller θ_d, else smaller θ_h, so that
/// interpolation beside the horizon does not mix in black.
fn fill(cells: &mut [[f32; 3]], measured: &[bool]) {
    let mut known = measured.to_vec();
    for theta_h in 0..THETA_H {
        for theta_d in 0..THETA_D {
            for phi_d in 0..PHI_D {
                let index = grid::cell(theta_h, theta_d, phi_d);
                if known[index] {
                    continue;
                }
                let below = (theta_d > 0).then(|| grid::cell(theta_h, theta_d - 1, phi_d));
                let inner = (theta_h > 0).then(|| grid::cell(theta_h - 1, theta_d, phi_d));
                if let Some(source) = [below, inner].into_iter().flatten().find(|&source| known[source]) {
                    cells[index] = cells[source];
                    known[index] = true;
                }
            }
        }
    }
}

fn wrong_dimensions(found: [i32; 3], expected: [i32; 3], error: impl Fn(String) -> LoadError) -> LoadError {
    let [a, b, c] = found;
    let error = error(format!("dimensions {a} × {b} × {c}, expected 90 × 90 × 180")).at(Place::Byte(0));
    if found.map(i32::swap_bytes) == expected {
        error.hint("the bytes are in big-endian order; MERL files are little-endian")
    } else if found == [THETA_H as i32, THETA_D as i32, 2 * PHI_D as i32] {
        error.hint("a table of the whole of φ_d; only the half that reciprocity leaves is read")
    } else {
        error.hint("is this a MERL .binary file? other layouts are not read")
    }
}

/// A cell in words.
fn cell_name(index: usize) -> String {
    let (phi_d, rest) = (index % PHI_D, index / PHI_D);
    format!("cell ({}, {}, {phi_d})", rest / THETA_D, rest % THETA_D)
}

fn little_endian_i32(bytes: &[u8]) -> i32 {
    i32::from_le_bytes(std::array::from_fn(|i| bytes[i]))
}

fn little_endian_f64(bytes: &[u8]) -> f64 {
    f64::from_le_bytes(std::array::from_fn(|i| bytes[i]))
}
