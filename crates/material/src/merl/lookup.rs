//! The two ways to read the table.
//!
//! `Nearest` is the database's own reader, cell for cell. `Interpolated` is linear between the centres of cells in
//! √θ_h, θ_d, φ_d; φ_d goes round, the other two end at the outermost centres.

use std::str::FromStr;

use glam::{Vec3, Vec4};

use super::coordinates::Coordinates;
use super::grid::{CELLS, PHI_D, THETA_D, THETA_H, cell};

/// How a value between the centres of cells is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lookup {
    /// The cell that the pair falls in, as the database's reader does: `nearest`.
    Nearest,
    /// Linear in √θ_h, θ_d and φ_d: `interpolated`.
    #[default]
    Interpolated,
}

impl FromStr for Lookup {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        match name {
            "nearest" => Ok(Lookup::Nearest),
            "interpolated" => Ok(Lookup::Interpolated),
            other => Err(format!("the look-up is nearest or interpolated, not {other}")),
        }
    }
}

/// The reflectances per steradian, colours of a cell side by side, and a cell of nothing behind them, so that each can
/// be read as four numbers.
#[derive(Debug)]
pub(crate) struct Table {
    cells: Vec<[f32; 3]>,
    lookup: Lookup,
}

impl Table {
    pub(crate) fn new(mut cells: Vec<[f32; 3]>, lookup: Lookup) -> Self {
        debug_assert_eq!(cells.len(), CELLS);
        cells.push([0.0; 3]);
        Self { cells, lookup }
    }

    pub(crate) fn values(&self) -> &[[f32; 3]] {
        &self.cells
    }

    pub(crate) fn lookup(&self) -> Lookup {
        self.lookup
    }

    pub(crate) fn cells(&self) -> &[[f32; 3]] {
        &self.cells[..CELLS]
    }

    #[inline]
    pub(crate) fn at(&self, at: &Coordinates, wo: Vec3, wi: Vec3) -> Vec3 {
        match self.lookup {
            Lookup::Nearest => Vec3::from_array(self.cells[at.cell(wo, wi)]),
            Lookup::Interpolated => self.interpolated(at),
        }
    }

    #[inline]
    fn interpolated(&self, at: &Coordinates) -> Vec3 {
        let (h0, h1, fh) = between(at.theta_h, THETA_H);
        let (d0, d1, fd) = between(at.theta_d, THETA_D);
        let position = at.phi_d - 0.5;
        // The first cell comes after the last one, by reciprocity.
        let next = ((position + 1.0) as usize).min(PHI_D);
        let p0 = if next == 0 { PHI_D - 1 } else { next - 1 };
        let p1 = if next == PHI_D { 0 } else { next };
        let fp = position - (next as f32 - 1.0);
        let numbers = self.cells.as_flattened();
        let row = |h: usize, d: usize| {
            let start = cell(h, d, 0);
            let [first, second] = [p0, p1].map(|p| Vec4::from_slice(&numbers[3 * (start + p)..]));
            first.lerp(second, fp)
        };
        row(h0, d0).lerp(row(h0, d1), fd).lerp(row(h1, d0).lerp(row(h1, d1), fd), fh).truncate()
    }
}

/// The two cells whose centres enclose a coordinate, and how far it lies towards the second.
#[inline]
fn between(coordinate: f32, count: usize) -> (usize, usize, f32) {
    let position = (coordinate - 0.5).clamp(0.0, (count - 1) as f32);
    let first = position as usize;
    (first, (first + 1).min(count - 1), position - first as f32)
}
