//! The filters of FLIP, each a product of one for rows and one for columns.
//!
//! The contrast sensitivity functions are sums of Gaussians in space, g(r) = Σ aᵢ √(π/bᵢ) exp(−π² r² / bᵢ) with r in
//! degrees; each Gaussian is a product of two, and only the blue–yellow one has more than one term. The detectors of
//! edges and points are the first and second derivatives of a Gaussian across, times the Gaussian along.

use std::f64::consts::PI;

/// A filter for one direction, of odd length; its middle tap stands on the pixel.
pub(super) struct Kernel(Vec<f32>);

/// All filters, for one number of pixels per degree.
pub(super) struct Filters {
    /// Of lightness.
    pub(super) achromatic: Kernel,
    /// Of Cx.
    pub(super) red_green: Kernel,
    /// Of Cz: two, whose results are added.
    pub(super) blue_yellow: [Kernel; 2],
    /// Along an edge or beside a point.
    pub(super) along: Kernel,
    /// Across an edge.
    pub(super) edge: Kernel,
    /// Across a point.
    pub(super) point: Kernel,
}

/// Amplitude and width (degrees²) of a Gaussian of a contrast sensitivity function (table 1 of the paper).
type Gaussian = (f64, f64);
const ACHROMATIC: [Gaussian; 1] = [(1.0, 0.0047)];
const RED_GREEN: [Gaussian; 1] = [(1.0, 0.0053)];
const BLUE_YELLOW: [Gaussian; 2] = [(34.1, 0.04), (13.5, 0.025)];

/// Width of the edges that are looked for, in degrees (§4.2 of the paper).
const FEATURE_DEGREES: f64 = 0.082;

/// Taps below this fraction of the largest are cut off: less than `f32` holds of a sum.
const NEGLIGIBLE: f64 = 1e-7;

impl Filters {
    pub(super) fn new(pixels_per_degree: f32) -> Self {
        let per_degree = f64::from(pixels_per_degree);
        // Three standard deviations of the widest Gaussian, the same for all.
        let radius = (3.0 * (BLUE_YELLOW[0].1 / (2.0 * PI * PI)).sqrt() * per_degree).ceil() as i64;
        let [achromatic] = sensitivity(&ACHROMATIC, radius, per_degree);
        let [red_green] = sensitivity(&RED_GREEN, radius, per_degree);
        let blue_yellow = sensitivity(&BLUE_YELLOW, radius, per_degree);

        let deviation = 0.5 * FEATURE_DEGREES * per_degree;
        let radius = (3.0 * deviation).ceil() as i64;
        let across = |value: fn(f64) -> f64| {
            let taps = (-radius..=radius).map(|i| {
                let t = i as f64 / deviation;
                value(t) * (-0.5 * t * t).exp()
            });
            balanced(taps.collect())
        };
        Self {
            achromatic,
            red_green,
            blue_yellow,
            along: across(|_| 1.0),
            edge: across(|t| -t),
            point: across(|t| t * t - 1.0),
        }
    }

    /// The reach of the widest filter along a row, in pixels.
    pub(super) fn radius(&self) -> usize {
        let [wide, narrow] = &self.blue_yellow;
        [&self.achromatic, &self.red_green, wide, narrow, &self.along, &self.edge, &self.point]
            .map(Kernel::radius)
            .into_iter()
            .fold(0, usize::max)
    }
}

impl Kernel {
    /// Pixels to either side.
    pub(super) fn radius(&self) -> usize {
        self.0.len() / 2
    }

    /// Filters one row; `padded` has `pad` more values to the left and to the right than `out`.
    pub(super) fn along_row(&self, padded: &[f32], pad: usize, out: &mut [f32]) {
        out.fill(0.0);
        self.add_along_row(padded, pad, out);
    }

    fn add_along_row(&self, padded: &[f32], pad: usize, out: &mut [f32]) {
        let first = pad - self.radius();
        // Correlation and convolution differ in sign for the edge filter only, and its sign is squared away.
        for (k, &tap) in self.0.iter().enumerate() {
            for (sum, value) in out.iter_mut().zip(&padded[first + k..]) {
                *sum += tap * value;
            }
        }
    }

    /// Adds to `out` row `y` of the filtered plane, whose rows `row_of` gives; rows beyond the border repeat the last.
    pub(super) fn add_down_column<'a>(
        &self,
        row_of: impl Fn(usize) -> &'a [f32],
        height: usize,
        y: usize,
        out: &mut [f32],
    ) {
        for (k, &tap) in self.0.iter().enumerate() {
            let row = row_of((y + k).saturating_sub(self.radius()).min(height - 1));
            for (sum, value) in out.iter_mut().zip(row) {
                *sum += tap * value;
            }
        }
    }
}

/// The filters of one direction for a sum of Gaussians, such that the sum over the plane is one.
fn sensitivity<const N: usize>(gaussians: &[Gaussian; N], radius: i64, per_degree: f64) -> [Kernel; N] {
    let taps = gaussians.map(|(_, width)| {
        let tap = |i: i64| (-(PI * i as f64 / per_degree).powi(2) / width).exp();
        (-radius..=radius).map(tap).collect::<Vec<_>>()
    });
    let weight = |(amplitude, width): Gaussian| amplitude * (PI / width).sqrt();
    let total: f64 =
        gaussians.iter().zip(&taps).map(|(&g, taps)| weight(g) * taps.iter().sum::<f64>().powi(2)).sum();
    let mut n = 0;
    taps.map(|taps| {
        // The square root, since the filter is applied in both directions.
        let scale = (weight(gaussians[n]) / total).sqrt();
        n += 1;
        Kernel::trimmed(taps.into_iter().map(|tap| tap * scale).collect())
    })
}

/// The taps scaled so that the positive ones sum to one and the negative ones to minus one.
fn balanced(taps: Vec<f64>) -> Kernel {
    let positive: f64 = taps.iter().filter(|tap| **tap > 0.0).sum();
    let negative: f64 = taps.iter().filter(|tap| **tap < 0.0).sum();
    let scale = |tap: f64| {
        if tap > 0.0 {
            tap / positive
        } else if tap < 0.0 {
            -tap / negative
        } else {
            0.0
        }
    };
    Kernel::trimmed(taps.into_iter().map(scale).collect())
}

impl Kernel {
    fn trimmed(taps: Vec<f64>) -> Self {
        let largest = taps.iter().fold(0.0, |m: f64, tap| m.max(tap.abs()));
        let negligible = taps.iter().take_while(|tap| tap.abs() < NEGLIGIBLE * largest).count();
        let cut = negligible.min(taps.len() / 2);
        Self(taps[cut..taps.len() - cut].iter().map(|&tap| tap as f32).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smoothing_keeps_a_flat_picture_and_detectors_answer_it_with_zero() {
        let filters = Filters::new(67.0);
        let sum = |kernel: &Kernel| kernel.0.iter().sum::<f32>();
        assert!((sum(&filters.achromatic).powi(2) - 1.0).abs() < 1e-5);
        assert!((sum(&filters.red_green).powi(2) - 1.0).abs() < 1e-5);
        let [wide, narrow] = &filters.blue_yellow;
        assert!((sum(wide).powi(2) + sum(narrow).powi(2) - 1.0).abs() < 1e-5);
        assert!((sum(&filters.along) - 1.0).abs() < 1e-5);
        assert!(sum(&filters.edge).abs() < 1e-6 && sum(&filters.point).abs() < 1e-6);
    }

    #[test]
    fn rows_split_filters_are_the_filter_of_the_plane() {
        // The blue–yellow filter by its definition in the plane, at one offset.
        let per_degree = 67.020_64;
        let value = |x: i32, y: i32| {
            let r2 = f64::from(x * x + y * y) / (per_degree * per_degree);
            BLUE_YELLOW.iter().map(|(a, b)| a * (PI / b).sqrt() * (-PI * PI * r2 / b).exp()).sum::<f64>()
        };
        let total: f64 = (-10..=10).flat_map(|y| (-10..=10).map(move |x| value(x, y))).sum();
        let filters = Filters::new(per_degree as f32);
        let (dx, dy) = (3, -2);
        let split: f32 = filters
            .blue_yellow
            .iter()
            .map(|k| k.0[(k.radius() as i32 + dx) as usize] * k.0[(k.radius() as i32 + dy) as usize])
            .sum();
        assert!((f64::from(split) - value(dx, dy) / total).abs() < 1e-8);
    }
}
