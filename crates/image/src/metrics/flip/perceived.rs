//! A picture as the eye of FLIP takes it in, and the difference of two such.

use rayon::prelude::*;

use super::color::{hunt_lab, hyab, linear_from_opponent, opponent_from_linear};
use super::filters::{Filters, Kernel};
use crate::RgbImage;

/// Planes that the filters along rows give: lightness, Cx, Cz twice; lightness along, across edges, across points.
const PLANES: usize = 7;

/// A picture filtered along its rows. Filtering down the columns happens row by row, as the rows are compared.
pub(super) struct Perceived {
    width: usize,
    height: usize,
    /// For each row of the picture, [`PLANES`] rows of values.
    values: Vec<f32>,
}

/// One row, filtered both ways.
pub(super) struct Row {
    /// Lightness, Cx, Cz.
    opponent: [Vec<f32>; 3],
    /// Edges across and down.
    edge: [Vec<f32>; 2],
    /// Points across and down.
    point: [Vec<f32>; 2],
}

impl Perceived {
    pub(super) fn new(picture: &RgbImage, filters: &Filters, shown: &(impl Fn(f32) -> f32 + Sync)) -> Self {
        let (width, height) = (picture.width, picture.height);
        let pad = filters.radius();
        let mut values = vec![0.0; PLANES * width * height];
        values.par_chunks_mut(PLANES * width).zip(picture.pixels.par_chunks(width)).for_each_init(
            || [0, 1, 2].map(|_| vec![0.0_f32; width + 2 * pad]),
            |padded, (out, pixels)| {
                for (x, &pixel) in pixels.iter().enumerate() {
                    let finite = pixel.iter().all(|v| v.is_finite());
                    let opponent = opponent_from_linear(if finite { pixel.map(shown) } else { [0.0; 3] });
                    for c in 0..3 {
                        padded[c][pad + x] = opponent[c];
                    }
                }
                for row in padded.iter_mut() {
                    let (first, last) = (row[pad], row[pad + width - 1]);
                    row[..pad].fill(first);
                    row[pad + width..].fill(last);
                }
                let [luma, cx, cz] = padded;
                let [wide, narrow] = &filters.blue_yellow;
                let work: [(&Kernel, &[f32]); PLANES] = [
                    (&filters.achromatic, luma),
                    (&filters.red_green, cx),
                    (wide, cz),
                    (narrow, cz),
                    (&filters.along, luma),
                    (&filters.edge, luma),
                    (&filters.point, luma),
                ];
                for ((kernel, padded), out) in work.into_iter().zip(out.chunks_mut(width)) {
                    kernel.along_row(padded, pad, out);
                }
            },
        );
        Self { width, height, values }
    }

    pub(super) fn scratch(&self) -> Row {
        let row = || vec![0.0; self.width];
        Row { opponent: [row(), row(), row()], edge: [row(), row()], point: [row(), row()] }
    }

    /// Filters row `y` down the columns.
    pub(super) fn row(&self, y: usize, filters: &Filters, out: &mut Row) {
        let [wide, narrow] = &filters.blue_yellow;
        let [luma, cx, cz] = &mut out.opponent;
        let ([edge_x, edge_y], [point_x, point_y]) = (&mut out.edge, &mut out.point);
        for row in [&mut *luma, cx, cz, edge_x, edge_y, point_x, point_y] {
            row.fill(0.0);
        }
        let add = |kernel: &Kernel, plane: usize, out: &mut Vec<f32>| {
            let row_of = |y: usize| &self.values[(y * PLANES + plane) * self.width..][..self.width];
            kernel.add_down_column(row_of, self.height, y, out);
        };
        add(&filters.achromatic, 0, luma);
        add(&filters.red_green, 1, cx);
        add(wide, 2, cz);
        add(narrow, 3, cz);
        add(&filters.edge, 4, edge_y);
        add(&filters.point, 4, point_y);
        add(&filters.along, 5, edge_x);
        add(&filters.along, 6, point_x);
    }
}

/// Exponent that turns colour distances into errors (§4.1.3 of the paper).
const COLOR_EXPONENT: f32 = 0.7;
/// Distances below this fraction of the largest take this much of the range of errors (§4.1.3).
const KNEE: (f32, f32) = (0.4, 0.95);

/// FLIP of two rows in column `x`.
pub(super) fn difference(test: &Row, reference: &Row, x: usize) -> f32 {
    let color = |row: &Row| {
        let linear = linear_from_opponent([0, 1, 2].map(|c| row.opponent[c][x]));
        hunt_lab(linear.map(|v| v.clamp(0.0, 1.0)))
    };
    let color = redistribute(hyab(color(test), color(reference)).powf(COLOR_EXPONENT));
    // Lightness runs over 116 units, not one; features of the two are compared by how strong they are.
    let strength = |[across, down]: &[Vec<f32>; 2]| across[x].hypot(down[x]) / 116.0;
    let edge = (strength(&test.edge) - strength(&reference.edge)).abs();
    let point = (strength(&test.point) - strength(&reference.point)).abs();
    let feature = (edge.max(point) * std::f32::consts::FRAC_1_SQRT_2).sqrt().min(1.0);
    color.powf(1.0 - feature)
}

/// Maps the power of a colour distance to [0, 1], most of that for small distances.
fn redistribute(power: f32) -> f32 {
    let largest = largest_power();
    let knee = KNEE.0 * largest;
    let error = if power < knee {
        power * KNEE.1 / knee
    } else {
        KNEE.1 + (power - knee) / (largest - knee) * (1.0 - KNEE.1)
    };
    error.clamp(0.0, 1.0)
}

/// The power of the largest distance between colours of the screen: green and blue.
fn largest_power() -> f32 {
    use std::sync::LazyLock;
    static LARGEST: LazyLock<f32> =
        LazyLock::new(|| hyab(hunt_lab([0.0, 1.0, 0.0]), hunt_lab([0.0, 0.0, 1.0])).powf(COLOR_EXPONENT));
    *LARGEST
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_fill_the_unit_interval() {
        assert_eq!(redistribute(0.0), 0.0);
        assert!((redistribute(largest_power()) - 1.0).abs() < 1e-6);
        assert!((redistribute(0.4 * largest_power()) - 0.95).abs() < 1e-6);
    }
}
