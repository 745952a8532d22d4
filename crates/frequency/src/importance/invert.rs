//! A lobe as cells with cumulative probabilities.

use std::f32::consts::{FRAC_PI_2, TAU};

use glam::{Vec2, Vec3};

use super::{ImportanceSample, UNIFORM};

/// The inverse of a cumulative distribution over cells of elevation and azimuth.
pub(super) struct Inverse {
    columns: usize,
    /// Cosines of the elevations between rows, from 1 down to 0.
    cosine: Vec<f32>,
    /// Probability of all rows before, one more than rows.
    rows: Vec<f64>,
    /// Probability of all cells before in their row, relative to the row, one more than columns each.
    cells: Vec<f64>,
}

impl Inverse {
    pub(super) fn new(lobe: impl Fn(Vec3) -> f32, rows: usize, columns: usize) -> Self {
        let cosine: Vec<f32> = (0..=rows)
            .map(|i| if i == rows { 0.0 } else { (i as f32 / rows as f32 * FRAC_PI_2).cos() })
            .collect();
        // Four directions in each cell: a lobe narrower than a cell is not lost between their middles.
        let mean = |row: usize, column: usize| {
            let mut sum = 0.0;
            for (dt, dp) in [(0.25, 0.25), (0.25, 0.75), (0.75, 0.25), (0.75, 0.75)] {
                let (sin, cos) = ((row as f32 + dt) / rows as f32 * FRAC_PI_2).sin_cos();
                let (sp, cp) = ((column as f32 + dp) / columns as f32 * TAU).sin_cos();
                let value = lobe(Vec3::new(sin * cp, sin * sp, cos));
                sum += if value.is_finite() { f64::from(value.max(0.0)) } else { 0.0 };
            }
            0.25 * sum
        };
        let solid = |row: usize| f64::from(cosine[row] - cosine[row + 1]) / columns as f64;
        let mut weight: Vec<f64> =
            (0..rows * columns).map(|i| mean(i / columns, i % columns) * solid(i / columns)).collect();
        let total: f64 = weight.iter().sum();
        let uniform = if total > 0.0 && total.is_finite() { f64::from(UNIFORM) } else { 1.0 };
        for (i, weight) in weight.iter_mut().enumerate() {
            let lobe = if uniform < 1.0 { (1.0 - uniform) * *weight / total } else { 0.0 };
            *weight = lobe + uniform * solid(i / columns);
        }
        let mut before = vec![0.0];
        let mut cells = Vec::with_capacity(rows * (columns + 1));
        for row in weight.chunks_exact(columns) {
            let sum: f64 = row.iter().sum();
            before.push(before[before.len() - 1] + sum);
            let mut passed = 0.0;
            cells.push(0.0);
            for weight in row {
                passed += weight / sum;
                cells.push(passed);
            }
        }
        Self { columns, cosine, rows: before, cells }
    }

    pub(super) fn sample(&self, at: Vec2) -> ImportanceSample {
        let (row, down) = find(&self.rows, f64::from(at.x));
        let cells = &self.cells[row * (self.columns + 1)..(row + 1) * (self.columns + 1)];
        let (column, across) = find(cells, f64::from(at.y));
        let (top, bottom) = (self.cosine[row], self.cosine[row + 1]);
        // Uniform in the cell: in the cosine and in the azimuth. The horizon itself is left out.
        let cos = (top + (bottom - top) * down).max(1e-6);
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        let (sp, cp) = ((column as f32 + across) / self.columns as f32 * TAU).sin_cos();
        let probability = (self.rows[row + 1] - self.rows[row]) * (cells[column + 1] - cells[column])
            / self.rows[self.rows.len() - 1];
        let solid = f64::from(top - bottom) * f64::from(TAU) / self.columns as f64;
        ImportanceSample { direction: Vec3::new(sin * cp, sin * sp, cos), pdf: (probability / solid) as f32 }
    }
}

/// The interval of a rising list that holds `at` of its whole, and where in the interval.
fn find(rising: &[f64], at: f64) -> (usize, f32) {
    let at = at * rising[rising.len() - 1];
    let index = rising.partition_point(|&v| v <= at).clamp(1, rising.len() - 1) - 1;
    let size = rising[index + 1] - rising[index];
    let within = if size > 0.0 { ((at - rising[index]) / size).clamp(0.0, 1.0) } else { 0.5 };
    (index, within as f32)
}
