//! The table by which directions are drawn: cells of equal size in azimuth and colatitude, each with its probability.
//!
//! The weight of a cell is the mean luminance of the *interpolated* map over it times its exact solid angle, so no
//! direction that shines has density zero. A row is drawn, then a cell of the row, then a direction uniform in
//! solid angle within the cell. Draws and look-ups are random accesses, so the table is no finer than it must be: the
//! coarsest one is taken whose estimate of the map's flux has a relative variance below [`COARSE_VARIANCE`]. A gradient
//! needs a few thousand cells, a small sun half a million.

use std::f32::consts::TAU;

use glam::Vec2;
use rayon::prelude::*;

use crate::sampling::{choose, cumulative};

/// Most columns; finer maps are drawn in blocks of texels.
const MAX_WIDTH: usize = 1024;
/// Most rows.
const MAX_HEIGHT: usize = 512;
/// Fewest columns and rows.
const MIN_SIZE: usize = 32;
/// Relative variance of L/p that a coarser table may have over the finest. Visibility and the cosine leave a relative variance near
/// one, beside which this does not show.
const COARSE_VARIANCE: f64 = 0.01;

#[derive(Debug)]
pub(super) struct Table {
    width: usize,
    height: usize,
    rows: Vec<f32>,
    row_guide: Vec<u32>,
    /// `height` runs of `width + 1`.
    cells: Vec<f32>,
    /// `height` runs of `width`.
    cell_guide: Vec<u32>,
    /// Density over solid angle in each cell.
    density: Vec<f32>,
    /// cos θ of the edges between the rows.
    row_cosines: Vec<f32>,
}

/// Means of the luminance and of its square over the cells of a grid.
struct Moments {
    width: usize,
    height: usize,
    mean: Vec<f32>,
    mean_square: Vec<f32>,
}

impl Table {
    /// A table for a map of `width` × `height` luminances.
    pub(super) fn new(luminances: &[f32], width: usize, height: usize) -> Self {
        let smooth = mean_of_interpolation(luminances, width, height);
        let (table_width, table_height) = (width.min(MAX_WIDTH), height.min(MAX_HEIGHT));
        let mean = block_means(&smooth, width, height, table_width, table_height);
        let mean_square = mean.iter().map(|l| l * l).collect();
        let mut moments = Moments { width: table_width, height: table_height, mean, mean_square };
        while let Some(coarser) = moments.coarser()
            && coarser.relative_variance() < COARSE_VARIANCE
        {
            moments = coarser;
        }
        Self::of(&moments)
    }

    fn of(moments: &Moments) -> Self {
        let (width, height) = (moments.width, moments.height);
        let cosines: Vec<f64> = row_cosines(height).collect();
        let areas: Vec<f64> = cosines.windows(2).map(|edge| edge[0] - edge[1]).collect();
        let sum = |row: &[f32]| row.iter().map(|&l| f64::from(l)).sum::<f64>();
        let weights: Vec<f64> =
            moments.mean.chunks(width).zip(&areas).map(|(row, area)| sum(row) * area).collect();
        let (mut rows, mut row_guide) = (vec![0.0; height + 1], vec![0; height]);
        cumulative(&weights, &mut rows, &mut row_guide);
        let (mut cells, mut cell_guide) = (vec![0.0; height * (width + 1)], vec![0; height * width]);
        cells
            .par_chunks_mut(width + 1)
            .zip(cell_guide.par_chunks_mut(width))
            .zip(moments.mean.par_chunks(width))
            .for_each(|((cells, guide), row)| {
                let weights: Vec<f64> = row.iter().map(|&l| f64::from(l)).collect();
                cumulative(&weights, cells, guide);
            });
        let density = (0..width * height).map(|i| {
            let (row, column) = (i / width, i % width);
            let cell = &cells[row * (width + 1) + column..][..2];
            let solid_angle = areas[row] as f32 * TAU / width as f32;
            (rows[row + 1] - rows[row]) * (cell[1] - cell[0]) / solid_angle
        });
        let density = density.collect();
        let row_cosines = cosines.iter().map(|&c| c as f32).collect();
        Self { width, height, rows, row_guide, cells, cell_guide, density, row_cosines }
    }

    /// A place in the map: u, the cosine of the colatitude, and the density over solid angle there.
    #[inline]
    pub(super) fn sample(&self, u: Vec2) -> (f32, f32, f32) {
        let (row, rest_v) = choose(&self.rows, &self.row_guide, u.y);
        let cells = &self.cells[row * (self.width + 1)..][..self.width + 1];
        let (column, rest_u) = choose(cells, &self.cell_guide[row * self.width..][..self.width], u.x);
        // A little away from the edges, so that looking the direction up again finds the same cell.
        let inside = |rest: f32| rest.clamp(1e-4, 1.0 - 1e-4);
        let (top, bottom) = (self.row_cosines[row], self.row_cosines[row + 1]);
        let cos_theta = top + inside(rest_v) * (bottom - top);
        (
            (column as f32 + inside(rest_u)) / self.width as f32,
            cos_theta,
            self.density[row * self.width + column],
        )
    }

    /// The density over solid angle at a place in the map.
    #[inline]
    pub(super) fn density(&self, uv: Vec2) -> f32 {
        let row = ((uv.y * self.height as f32) as usize).min(self.height - 1);
        let column = ((uv.x * self.width as f32) as usize).min(self.width - 1);
        self.density[row * self.width + column]
    }

    #[cfg(test)]
    pub(super) fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }
}

impl Moments {
    /// Cells of twice the size, if the grid can be halved.
    fn coarser(&self) -> Option<Self> {
        let (width, height) = (self.width / 2, self.height / 2);
        if !self.width.is_multiple_of(2) || !self.height.is_multiple_of(2) || width.min(height) < MIN_SIZE {
            return None;
        }
        let halve = |values: &[f32]| -> Vec<f32> {
            let areas: Vec<f32> = row_areas(self.height);
            (0..width * height)
                .map(|i| {
                    let (x, y) = (2 * (i % width), 2 * (i / width));
                    let pair = |row: usize| values[row * self.width + x] + values[row * self.width + x + 1];
                    let (top, bottom) = (areas[y], areas[y + 1]);
                    (pair(y) * top + pair(y + 1) * bottom) / (2.0 * (top + bottom))
                })
                .collect()
        };
        Some(Self { width, height, mean: halve(&self.mean), mean_square: halve(&self.mean_square) })
    }

    /// Variance of L/p over the squared flux: (∑ Ω E[L²] / E[L]) / (∑ Ω E[L]) − 1.
    fn relative_variance(&self) -> f64 {
        let (mut flux, mut second) = (0.0, 0.0);
        let rows =
            self.mean.chunks(self.width).zip(self.mean_square.chunks(self.width)).zip(row_areas(self.height));
        for ((mean, mean_square), area) in rows {
            for (&mean, &mean_square) in mean.iter().zip(mean_square) {
                if mean > 0.0 {
                    flux += f64::from(area) * f64::from(mean);
                    second += f64::from(area) * f64::from(mean_square) / f64::from(mean);
                }
            }
        }
        if flux > 0.0 { second / flux - 1.0 } else { 0.0 }
    }
}

fn row_cosines(height: usize) -> impl Iterator<Item = f64> {
    (0..=height).map(move |j| (std::f64::consts::PI * j as f64 / height as f64).cos())
}

fn row_areas(height: usize) -> Vec<f32> {
    let cosines: Vec<f64> = row_cosines(height).collect();
    cosines.windows(2).map(|edge| (edge[0] - edge[1]) as f32).collect()
}

/// Mean over each texel's own square of the bilinear interpolation: the kernel (1, 6, 1)/8 in both directions.
fn mean_of_interpolation(values: &[f32], width: usize, height: usize) -> Vec<f32> {
    let mut result = vec![0.0; values.len()];
    result.par_chunks_mut(width).enumerate().for_each(|(j, out)| {
        let rows = [j.saturating_sub(1), j, (j + 1).min(height - 1)].map(|r| &values[r * width..][..width]);
        let vertical = |i: usize| 0.125 * (rows[0][i] + 6.0 * rows[1][i] + rows[2][i]);
        for (i, out) in out.iter_mut().enumerate() {
            let (left, right) = ((i + width - 1) % width, (i + 1) % width);
            *out = 0.125 * (vertical(left) + 6.0 * vertical(i) + vertical(right));
        }
    });
    result
}

/// Means of `from_width` × `from_height` values over the cells of a coarser grid, by overlap of area.
fn block_means(
    values: &[f32],
    from_width: usize,
    from_height: usize,
    width: usize,
    height: usize,
) -> Vec<f32> {
    if (from_width, from_height) == (width, height) {
        return values.to_vec();
    }
    let mut result = vec![0.0; width * height];
    result.par_chunks_mut(width).enumerate().for_each(|(j, out)| {
        for (i, out) in out.iter_mut().enumerate() {
            let (mut sum, mut area) = (0.0, 0.0);
            for (y, share_y) in overlaps(j, height, from_height) {
                for (x, share_x) in overlaps(i, width, from_width) {
                    sum += values[y * from_width + x] * share_x * share_y;
                    area += share_x * share_y;
                }
            }
            *out = sum / area;
        }
    });
    result
}

/// The fine indices under coarse index `i`, each with the length of their overlap in fine units.
fn overlaps(i: usize, coarse: usize, fine: usize) -> impl Iterator<Item = (usize, f32)> {
    let scale = fine as f64 / coarse as f64;
    let (start, end) = (i as f64 * scale, (i + 1) as f64 * scale);
    (start as usize..(end.ceil() as usize).min(fine)).map(move |k| {
        let length = end.min((k + 1) as f64) - start.max(k as f64);
        (k, length.max(0.0) as f32)
    })
}
