//! The table by which directions are drawn: cells of equal size in azimuth and colatitude, each with its probability.
//!
//! The weight of a cell is the mean luminance of the *interpolated* map over it, less a part of the mean of the whole
//! map, times its exact solid angle. What is taken away is light from everywhere, which sampling of the material finds
//! with less noise; the numbers are spent on what stands out (multiple importance sampling compensation, Karlík et al.
//! 2019). No direction that shines has density zero. A row is drawn, then a cell of the row, then a direction uniform in
//! solid angle within the cell. Draws and look-ups are random accesses, so the table is no finer than it must be: the
//! fewest rows are taken, and in each row the fewest cells, whose estimate of the flux has a relative variance below
//! [`COARSE_VARIANCE`]. A gradient needs a thousand cells; a small sun needs many only in the rows that it touches.

use std::f32::consts::TAU;

use glam::Vec2;
use rayon::prelude::*;

use super::prefetch::prefetch;
use crate::sampling::{choose, cumulative};

/// Most columns; finer maps are drawn in blocks of texels.
const MAX_WIDTH: usize = 1024;
/// Most rows.
const MAX_HEIGHT: usize = 512;
/// Fewest columns and rows.
const MIN_SIZE: usize = 32;
/// Relative variance of L/p that a coarser table may have over the finest. Visibility and the cosine leave a relative variance near
/// one, beside which this does not show.
const COARSE_VARIANCE: f64 = 0.003;
/// Share of the map's mean radiance that is left to sampling of the material. Measured on a sky with a sun and on a
/// smooth light, 64 samples a pixel: the squared error falls by 50 and 6 % at 0.75, by 48 and 9 % at 0.5, by 49 and 2 %
/// at 1.
const COMPENSATION: f32 = 0.75;
/// Least weight of a cell in its own radiance, so that light is found where materials seldom look.
const LEAST_SHARE: f32 = 0.03;

#[derive(Debug)]
pub(super) struct Table {
    /// Cumulative probabilities of the rows, and the guide to them.
    rows: Vec<f32>,
    row_guide: Vec<u32>,
    /// Where the cells of each row stand in the lists of cells.
    spans: Vec<Span>,
    /// Cumulative probabilities of the cells of each row, one more than it has cells.
    cells: Vec<f32>,
    cell_guide: Vec<u32>,
    /// Density over solid angle in each cell.
    density: Vec<f32>,
    /// cos θ of the edges between the rows.
    row_cosines: Vec<f32>,
}

/// The cells of one row.
#[derive(Clone, Copy, Debug)]
struct Span {
    start: u32,
    width: u32,
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
        let cosines: Vec<f64> = row_cosines(moments.height).collect();
        let areas: Vec<f64> = cosines.windows(2).map(|edge| edge[0] - edge[1]).collect();
        let left_to_materials = COMPENSATION * moments.mean_over_sphere();
        let rows: Vec<Vec<f64>> = (0..moments.height)
            .into_par_iter()
            .map(|row| {
                let row = moments.row(row).coarsest();
                row.mean.iter().map(|&l| f64::from((l - left_to_materials).max(LEAST_SHARE * l))).collect()
            })
            .collect();
        let mean = |row: &[f64]| row.iter().sum::<f64>() / row.len() as f64;
        let weights: Vec<f64> = rows.iter().zip(&areas).map(|(row, area)| mean(row) * area).collect();
        let mut table = Self {
            rows: vec![0.0; rows.len() + 1],
            row_guide: vec![0; rows.len()],
            spans: Vec::with_capacity(rows.len()),
            cells: Vec::new(),
            cell_guide: Vec::new(),
            density: Vec::new(),
            row_cosines: cosines.iter().map(|&c| c as f32).collect(),
        };
        cumulative(&weights, &mut table.rows, &mut table.row_guide);
        for (j, row) in rows.iter().enumerate() {
            let (start, width) = (table.density.len(), row.len());
            let (mut cells, mut guide) = (vec![0.0; width + 1], vec![0; width]);
            cumulative(row, &mut cells, &mut guide);
            let solid_angle = areas[j] as f32 * TAU / width as f32;
            let row_probability = table.rows[j + 1] - table.rows[j];
            table.density.extend(cells.windows(2).map(|c| row_probability * (c[1] - c[0]) / solid_angle));
            table.cells.extend(cells);
            table.cell_guide.extend(guide);
            table.spans.push(Span { start: start as u32, width: width as u32 });
        }
        table
    }

    /// A place in the map: u, the cosine of the colatitude, and the density over solid angle there.
    #[inline]
    pub(super) fn sample(&self, u: Vec2) -> (f32, f32, f32) {
        let (row, rest_v) = choose(&self.rows, &self.row_guide, u.y);
        let (start, width) = (self.spans[row].start as usize, self.spans[row].width as usize);
        // Every row before this one has one more cumulative probability than cells.
        let cells = &self.cells[start + row..][..width + 1];
        let (column, rest_u) = choose(cells, &self.cell_guide[start..][..width], u.x);
        // A little away from the edges, so that looking the direction up again finds the same cell.
        let inside = |rest: f32| rest.clamp(1e-4, 1.0 - 1e-4);
        let (top, bottom) = (self.row_cosines[row], self.row_cosines[row + 1]);
        let cos_theta = top + inside(rest_v) * (bottom - top);
        ((column as f32 + inside(rest_u)) / width as f32, cos_theta, self.density[start + column])
    }

    /// The density over solid angle at a place in the map.
    #[inline]
    pub(super) fn density(&self, uv: Vec2) -> f32 {
        self.density[self.cell(uv)]
    }

    /// Begins to bring what [`Self::density`] will read into the cache.
    #[inline]
    pub(super) fn prefetch(&self, uv: Vec2) {
        prefetch(&self.density, self.cell(uv));
    }

    #[inline]
    fn cell(&self, uv: Vec2) -> usize {
        let height = self.spans.len();
        let Span { start, width } = self.spans[((uv.y * height as f32) as usize).min(height - 1)];
        (start + ((uv.x * width as f32) as u32).min(width - 1)) as usize
    }

    #[cfg(test)]
    pub(super) fn rows_and_cells(&self) -> (usize, usize) {
        (self.spans.len(), self.density.len())
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

    /// One row, as if it were a map of its own.
    fn row(&self, row: usize) -> RowMoments {
        let of = |values: &[f32]| values[row * self.width..][..self.width].to_vec();
        RowMoments { mean: of(&self.mean), mean_square: of(&self.mean_square) }
    }

    fn mean_over_sphere(&self) -> f32 {
        let rows = self.mean.chunks(self.width).zip(row_areas(self.height));
        rows.map(|(row, area)| row.iter().sum::<f32>() / self.width as f32 * area).sum::<f32>() / 2.0
    }

    /// Variance of L/p over the squared flux.
    fn relative_variance(&self) -> f64 {
        let (mut flux, mut second) = (0.0, 0.0);
        let rows =
            self.mean.chunks(self.width).zip(self.mean_square.chunks(self.width)).zip(row_areas(self.height));
        for ((mean, mean_square), area) in rows {
            let [row_flux, row_second] = flux_and_second_moment(mean, mean_square);
            flux += f64::from(area) * row_flux;
            second += f64::from(area) * row_second;
        }
        if flux > 0.0 { second / flux - 1.0 } else { 0.0 }
    }
}

/// [`Moments`] of the cells of one row.
struct RowMoments {
    mean: Vec<f32>,
    mean_square: Vec<f32>,
}

impl RowMoments {
    /// With cells as wide as the variance allows.
    fn coarsest(mut self) -> Self {
        while self.mean.len().is_multiple_of(2) && self.mean.len() / 2 >= MIN_SIZE {
            let halve = |values: &[f32]| values.chunks(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
            let coarser = Self { mean: halve(&self.mean), mean_square: halve(&self.mean_square) };
            let [flux, second] = flux_and_second_moment(&coarser.mean, &coarser.mean_square);
            if second - flux >= COARSE_VARIANCE * flux && flux > 0.0 {
                break;
            }
            self = coarser;
        }
        self
    }
}

/// ∑ E[L] and ∑ E[L²] / E[L] over cells of equal size: their ratio less one is the relative variance of L/p, if p
/// follows E[L].
fn flux_and_second_moment(mean: &[f32], mean_square: &[f32]) -> [f64; 2] {
    let lit = mean.iter().zip(mean_square).filter(|&(&l, _)| l > 0.0);
    lit.fold([0.0, 0.0], |[flux, second], (&l, &square)| {
        [flux + f64::from(l), second + f64::from(square) / f64::from(l)]
    })
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
