//! Densities on a dense grid, and their file.
//!
//! A `.grid` file is three lines of text and then numbers, x fastest, then y, then z, each a little-endian f32:
//!
//! ```text
//! halflight grid 1
//! 64 32 64
//! f32
//! ```
//!
//! Values lie at the middles of the cells; between them the density is trilinear, beyond the outermost ones constant. All
//! must be finite and at least 0. `.grid.xz` is unpacked while it is read.

use std::path::Path;

use glam::Vec3;
use halflight_file::{LoadError, SaveError};

/// The first line of a file.
const SIGNATURE: &str = "halflight grid 1";
/// Most cells along a side.
const MOST_SIDE: usize = 4096;
/// Longest text before the numbers.
const MOST_HEADER: usize = 256;

/// Densities at the middles of cells.
#[derive(Clone, Debug, PartialEq)]
pub struct DensityGrid {
    size: [usize; 3],
    values: Vec<f32>,
    largest: f32,
}

impl DensityGrid {
    /// From values, x fastest; `None` if their number is not that of the cells, or one is negative or not finite.
    #[must_use]
    pub fn new(size: [usize; 3], values: Vec<f32>) -> Option<Self> {
        let count = size[0].checked_mul(size[1])?.checked_mul(size[2])?;
        let valid = values.iter().all(|v| v.is_finite() && *v >= 0.0);
        let largest = values.iter().copied().fold(0.0, f32::max);
        (count > 0 && count == values.len() && valid).then_some(Self { size, values, largest })
    }

    /// Cells along each axis.
    #[must_use]
    pub fn size(&self) -> [usize; 3] {
        self.size
    }

    /// The largest density.
    #[inline]
    #[must_use]
    pub fn largest(&self) -> f32 {
        self.largest
    }

    /// The density at a point of the unit cube.
    #[inline]
    #[must_use]
    pub fn at(&self, point: Vec3) -> f32 {
        let (mut first, mut second, mut part) = ([0; 3], [0; 3], [0.0; 3]);
        for axis in 0..3 {
            let last = self.size[axis] - 1;
            // In this order, as a NaN ends at 0.
            let place = (point[axis] * self.size[axis] as f32 - 0.5).max(0.0).min(last as f32);
            first[axis] = place as usize;
            second[axis] = (first[axis] + 1).min(last);
            part[axis] = place - first[axis] as f32;
        }
        let value = |x: usize, y: usize, z: usize| self.values[(z * self.size[1] + y) * self.size[0] + x];
        let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
        let line = |y: usize, z: usize| mix(value(first[0], y, z), value(second[0], y, z), part[0]);
        let plane = |z: usize| mix(line(first[1], z), line(second[1], z), part[1]);
        mix(plane(first[2]), plane(second[2]), part[2])
    }

    /// Reads a file; see the top of the module.
    ///
    /// # Errors
    /// A file that cannot be read, is none of these, is longer or shorter than it says, or has a density that is negative
    /// or not a number.
    pub fn load(path: &Path) -> Result<Self, LoadError> {
        let bytes = halflight_file::read(path, "grid of densities")?;
        Self::decode(&bytes).map_err(|found| {
            let error = LoadError::new("grid of densities", path, found);
            error.hint("the file is `halflight grid 1`, a line with three sizes, `f32`, and then the numbers")
        })
    }

    fn decode(bytes: &[u8]) -> Result<Self, String> {
        let mut rest = bytes;
        let mut line = |what: &str| {
            let end = rest.iter().take(MOST_HEADER).position(|&b| b == b'\n');
            let end = end.ok_or_else(|| format!("there is no line with {what}"))?;
            let text = std::str::from_utf8(&rest[..end]).map_err(|_| format!("{what} is not text"))?;
            rest = &rest[end + 1..];
            Ok::<String, String>(text.trim().to_string())
        };
        let signature = line("the words `halflight grid 1`")?;
        if signature != SIGNATURE {
            return Err(format!("it begins with {signature:?}, not with {SIGNATURE:?}"));
        }
        let sides = line("the sizes")?;
        let size: Vec<usize> = sides.split_whitespace().filter_map(|word| word.parse().ok()).collect();
        let size: [usize; 3] = match <[usize; 3]>::try_from(size) {
            Ok(size) if size.iter().all(|&n| (1..=MOST_SIDE).contains(&n)) => size,
            _ => return Err(format!("{sides:?} is not three sizes from 1 to {MOST_SIDE}")),
        };
        let kind = line("the kind of numbers")?;
        if kind != "f32" {
            return Err(format!("its numbers are {kind:?}, and only f32 is known"));
        }
        let count = size[0] * size[1] * size[2];
        if rest.len() != 4 * count {
            return Err(format!(
                "{} x {} x {} cells need {} bytes of numbers, there are {}",
                size[0],
                size[1],
                size[2],
                4 * count,
                rest.len()
            ));
        }
        let values: Vec<f32> =
            rest.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
        if let Some(at) = values.iter().position(|v| !(v.is_finite() && *v >= 0.0)) {
            let [x, y, z] = [at % size[0], at / size[0] % size[1], at / size[0] / size[1]];
            return Err(format!("the density of cell ({x}, {y}, {z}) is {}", values[at]));
        }
        Self::new(size, values).ok_or_else(|| "it has no cells".into())
    }

    /// Writes a file, whole or not at all.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn save(&self, path: &Path) -> Result<(), SaveError> {
        let [x, y, z] = self.size;
        halflight_file::write_whole(path, "grid of densities", |out| {
            use std::io::Write;
            write!(out, "{SIGNATURE}\n{x} {y} {z}\nf32\n")?;
            for value in &self.values {
                out.write_all(&value.to_le_bytes())?;
            }
            Ok(())
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn what_is_written_is_read_again_and_what_is_damaged_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("fog.grid");
        let grid = DensityGrid::new([3, 2, 2], (0..12).map(|i| i as f32 * 0.5).collect()).unwrap();
        grid.save(&path).unwrap();
        assert_eq!(DensityGrid::load(&path).unwrap(), grid);
        let bytes = std::fs::read(&path).unwrap();
        for damaged in [
            &bytes[..bytes.len() - 1],
            &bytes[..10],
            b"halflight grid 2\n1 1 1\nf32\n\0\0\0\0",
            b"halflight grid 1\n4096 4096 4096\nf32\n\0\0\0\0",
            b"halflight grid 1\n0 1 1\nf32\n",
            b"halflight grid 1\n1 1\nf32\n\0\0\0\0",
            b"halflight grid 1\n1 1 1\nf64\n\0\0\0\0\0\0\0\0",
            b"halflight grid 1\n1 1 1\nf32\n\0\0\x80\xbf",
            b"halflight grid 1\n1 1 1\nf32\n\0\0\xc0\x7f",
        ] {
            std::fs::write(&path, damaged).unwrap();
            assert!(DensityGrid::load(&path).is_err());
        }
    }

    #[test]
    fn densities_are_trilinear_between_the_middles_of_cells() {
        let grid = DensityGrid::new([2, 1, 1], vec![1.0, 3.0]).unwrap();
        for (x, value) in [(0.0, 1.0), (0.25, 1.0), (0.5, 2.0), (0.75, 3.0), (1.0, 3.0)] {
            assert!((grid.at(Vec3::new(x, 0.5, 0.2)) - value).abs() < 1e-6);
        }
        assert!(grid.at(Vec3::NAN).is_finite());
        assert!(DensityGrid::new([2, 1, 1], vec![1.0]).is_none());
    }
}
