//! Light from everywhere: a latitude–longitude map at infinity, sampled by luminance × solid angle.
//!
//! **Layout.** Texel (i, j) of a W × H map is centred at u = (i + ½)/W, v = (j + ½)/H. The direction of (u, v) is
//! (sin φ sin θ, cos θ, −cos φ sin θ) with φ = 2π(u − ½), θ = πv: the centre column looks along −z, +x is to its
//! right, the top row is +y. Radiance is interpolated bilinearly, periodic in u and clamped in v.
//!
//! **Sampling.** The sphere is cut into the cells of a table no larger than [`TABLE_WIDTH`] × [`TABLE_HEIGHT`]; the
//! weight of a cell is the mean luminance of the *interpolated* map over it times its exact solid angle, so no
//! direction that shines has density zero. A row is chosen, then a cell of the row, then a direction uniform in solid
//! angle within the cell. Cost: two guided table look-ups; the table holds about 8 bytes a cell.

use std::f32::consts::{PI, TAU};
use std::sync::Arc;

use glam::{Vec2, Vec3};
use halflight_image::RgbImage;
use rayon::prelude::*;

use crate::sampling::Choice;

/// Widest sampling table. Finer maps are sampled in blocks of texels: within a block the variance left is small, and a
/// table of this size stays in the cache.
pub const TABLE_WIDTH: usize = 1024;
/// Tallest sampling table.
pub const TABLE_HEIGHT: usize = 512;

/// A map and its sampling table, shared between frames.
#[derive(Debug)]
pub struct EnvironmentMap {
    image: RgbImage,
    rows: Choice,
    cells: Vec<Choice>,
    /// cos θ of the edges between the rows of the table.
    row_cosines: Vec<f32>,
    mean_radiance: Vec3,
}

impl EnvironmentMap {
    /// Builds the sampling table of a map of finite radiance in the layout above; negative texels are taken as black.
    ///
    /// # Panics
    /// If the map has no texels.
    pub fn new(mut image: RgbImage) -> Self {
        assert!(image.width > 0 && image.height > 0, "an environment map has texels");
        image.pixels.par_iter_mut().for_each(|p| *p = p.map(|c| if c > 0.0 { c } else { 0.0 }));
        let (width, height) = (image.width.min(TABLE_WIDTH), image.height.min(TABLE_HEIGHT));
        let row_cosines: Vec<f32> =
            (0..=height).map(|j| (std::f64::consts::PI * j as f64 / height as f64).cos() as f32).collect();
        let luminances: Vec<f32> = image.pixels.par_iter().map(|&p| luminance(Vec3::from(p))).collect();
        let smooth = mean_of_interpolation(&luminances, image.width, image.height);
        let table = block_means(&smooth, image.width, image.height, width, height);
        let cells: Vec<Choice> = table
            .par_chunks(width)
            .map(|row| Choice::new(row.iter().map(|&l| f64::from(l))).expect("a row has cells"))
            .collect();
        let row_weights = table.chunks(width).zip(row_cosines.windows(2)).map(|(row, edge)| {
            let sum: f64 = row.iter().map(|&l| f64::from(l)).sum();
            sum * f64::from(edge[0] - edge[1])
        });
        let row_weights: Vec<f64> = row_weights.collect();
        let rows = Choice::new(row_weights.into_iter()).expect("a map has rows");
        let mean_radiance = mean_over_sphere(&image);
        Self { image, rows, cells, row_cosines, mean_radiance }
    }

    /// The map itself.
    pub fn image(&self) -> &RgbImage {
        &self.image
    }

    /// Radiance averaged over the sphere.
    pub fn mean_radiance(&self) -> Vec3 {
        self.mean_radiance
    }

    /// Radiance at texture coordinates, interpolated bilinearly.
    fn radiance_at(&self, uv: Vec2) -> Vec3 {
        let (width, height) = (self.image.width, self.image.height);
        let x = uv.x * width as f32 - 0.5;
        let y = uv.y * height as f32 - 0.5;
        let (x_floor, y_floor) = (x.floor(), y.floor());
        let (fx, fy) = (x - x_floor, y - y_floor);
        let column = |offset: i32| (x_floor as i32 + offset).rem_euclid(width as i32) as usize;
        let row = |offset: i32| (y_floor as i32 + offset).clamp(0, height as i32 - 1) as usize * width;
        let (x0, x1, y0, y1) = (column(0), column(1), row(0), row(1));
        let texel = |row: usize, column: usize| Vec3::from(self.image.pixels[row + column]);
        let top = texel(y0, x0).lerp(texel(y0, x1), fx);
        top.lerp(texel(y1, x0).lerp(texel(y1, x1), fx), fy)
    }

    /// Density over solid angle of the cell (column, row) of the table.
    fn cell_density(&self, row_probability: f32, cell_probability: f32, row: usize) -> f32 {
        let solid_angle =
            (self.row_cosines[row] - self.row_cosines[row + 1]) * TAU / self.cells[row].len() as f32;
        row_probability * cell_probability / solid_angle
    }
}

/// A map with a rotation about +y and an intensity: what a frame sees at infinity.
#[derive(Clone, Debug)]
pub struct Environment {
    /// The map.
    pub map: Arc<EnvironmentMap>,
    /// Turns the map about +y, in radians: what was seen along −z is then seen along −z turned towards −x.
    pub rotation: f32,
    /// Multiplies the map.
    pub intensity: Vec3,
}

impl Environment {
    /// Radiance that arrives from `direction` (unit).
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        self.intensity * self.map.radiance_at(self.uv(direction))
    }

    /// Density over solid angle with which [`Self::sample`] chooses `direction`.
    pub fn pdf(&self, direction: Vec3) -> f32 {
        let map = &*self.map;
        let uv = self.uv(direction);
        let row = ((uv.y * map.cells.len() as f32) as usize).min(map.cells.len() - 1);
        let cells = &map.cells[row];
        let column = ((uv.x * cells.len() as f32) as usize).min(cells.len() - 1);
        map.cell_density(map.rows.probability(row), cells.probability(column), row)
    }

    /// A direction, its radiance and its density over solid angle.
    pub fn sample(&self, u: Vec2) -> (Vec3, Vec3, f32) {
        let map = &*self.map;
        let (row, row_probability, rest_v) = map.rows.sample(u.y);
        let cells = &map.cells[row];
        let (column, cell_probability, rest_u) = cells.sample(u.x);
        // Half a ulp from the edge, so that looking the direction up again finds the same cell.
        let inside = |rest: f32| rest.clamp(1e-5, 1.0 - 1e-5);
        let (top, bottom) = (map.row_cosines[row], map.row_cosines[row + 1]);
        let cos_theta = top + inside(rest_v) * (bottom - top);
        let map_u = (column as f32 + inside(rest_u)) / cells.len() as f32;
        let direction = self.direction(map_u, cos_theta);
        let map_v = fast_acos(cos_theta) / PI;
        let radiance = self.intensity * map.radiance_at(Vec2::new(map_u, map_v));
        (direction, radiance, map.cell_density(row_probability, cell_probability, row))
    }

    /// Mean radiance over the sphere, with the intensity.
    pub fn mean_radiance(&self) -> Vec3 {
        self.intensity * self.map.mean_radiance
    }

    fn uv(&self, direction: Vec3) -> Vec2 {
        let azimuth = fast_atan2(direction.x, -direction.z) + self.rotation;
        let u = 0.5 + azimuth / TAU;
        Vec2::new((u - u.floor()).min(1.0 - f32::EPSILON), fast_acos(direction.y) / PI)
    }

    fn direction(&self, u: f32, cos_theta: f32) -> Vec3 {
        let sin_theta = (1.0 - cos_theta * cos_theta).max(0.0).sqrt();
        let (sin, cos) = (TAU * (u - 0.5) - self.rotation).sin_cos();
        Vec3::new(sin * sin_theta, cos_theta, -cos * sin_theta)
    }
}

/// Rec. 709 luminance.
pub fn luminance(rgb: Vec3) -> f32 {
    rgb.dot(Vec3::new(0.212_671, 0.715_160, 0.072_169))
}

/// acos within 1e-6 of a turn, a third of the cost of the library's: π/2 − atan2 form of the same polynomial.
fn fast_acos(x: f32) -> f32 {
    let x = x.clamp(-1.0, 1.0);
    fast_atan2((1.0 - x * x).max(0.0).sqrt(), x)
}

/// atan2 with an absolute error below 2e-6 radians: the odd minimax polynomial of degree 15 for atan on [0, 1] and the
/// usual reductions. Texels are larger than 1e-3 radians.
fn fast_atan2(y: f32, x: f32) -> f32 {
    let (ax, ay) = (x.abs(), y.abs());
    let (low, high) = (ax.min(ay), ax.max(ay));
    if high == 0.0 {
        return 0.0;
    }
    let a = low / high;
    let s = a * a;
    // Coefficients: Abramowitz and Stegun 4.4.49 (error 2e-8).
    let p = s
        * (0.199_935_51
            + s * (-0.142_089
                + s * (0.106_562_64
                    + s * (-0.075_289_6 + s * (0.042_909_61 + s * (-0.016_165_737 + s * 0.002_866_226))))));
    let mut angle = a + a * s * (-0.333_331_45 + p);
    if ay > ax {
        angle = std::f32::consts::FRAC_PI_2 - angle;
    }
    if x < 0.0 {
        angle = PI - angle;
    }
    if y < 0.0 { -angle } else { angle }
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

fn mean_over_sphere(image: &RgbImage) -> Vec3 {
    let mut sum = glam::DVec3::ZERO;
    for (j, row) in image.pixels.chunks(image.width).enumerate() {
        let edge = |j: usize| (std::f64::consts::PI * j as f64 / image.height as f64).cos();
        let weight = (edge(j) - edge(j + 1)) / (2.0 * image.width as f64);
        sum += row.iter().map(|&p| Vec3::from(p).as_dvec3()).sum::<glam::DVec3>() * weight;
    }
    sum.as_vec3()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spotted(width: usize, height: usize) -> Environment {
        let image = RgbImage::from_fn(width, height, |x, y| {
            let base = 0.2 + 0.1 * ((x * 7 + y * 13) % 11) as f32;
            let sun = if x * 10 / width == 6 && y * 10 / height == 2 { 30.0 } else { 0.0 };
            [base + sun, base, base + 0.5 * sun]
        });
        Environment { map: Arc::new(EnvironmentMap::new(image)), rotation: 0.7, intensity: Vec3::ONE }
    }

    #[test]
    fn the_fast_arcs_stay_within_two_millionths_of_the_exact_ones() {
        for i in 0..20_000 {
            let angle = (i as f32 / 20_000.0 - 0.5) * TAU;
            let (sin, cos) = angle.sin_cos();
            let difference = (fast_atan2(sin, cos) - sin.atan2(cos)).abs();
            assert!(difference < 2e-6 || (difference - TAU).abs() < 2e-6, "{angle}");
            assert!(
                (fast_acos(cos) - cos.acos()).abs() < 5e-4 * (1.0 - cos.abs()).sqrt().max(1e-2),
                "{angle}"
            );
        }
    }

    #[test]
    fn a_sampled_direction_has_the_density_and_the_radiance_that_looking_it_up_gives() {
        for (width, height) in [(1, 1), (16, 8), (37, 19), (1500, 700)] {
            let environment = spotted(width, height);
            for i in 0..2000u32 {
                let u = Vec2::new((i as f32 * 0.618_034).fract(), (i as f32 + 0.5) / 2000.0);
                let (direction, radiance, pdf) = environment.sample(u);
                assert!((direction.length() - 1.0).abs() < 1e-5);
                let looked_up = environment.pdf(direction);
                assert!((pdf - looked_up).abs() <= 2e-3 * pdf, "{width}x{height} {u}: {pdf} {looked_up}");
                assert!(radiance.distance(environment.radiance(direction)) <= 2e-2 * radiance.length());
            }
        }
    }

    #[test]
    fn the_density_integrates_to_one_and_the_estimator_to_the_mean_radiance() {
        let environment = spotted(64, 32);
        let (n_v, n_u) = (512, 1024);
        let mut integral = 0.0f64;
        for j in 0..n_v {
            for i in 0..n_u {
                let cos_theta = 1.0 - 2.0 * (j as f32 + 0.5) / n_v as f32;
                let direction = environment.direction((i as f32 + 0.5) / n_u as f32, cos_theta);
                integral +=
                    f64::from(environment.pdf(direction)) * 4.0 * std::f64::consts::PI / (n_v * n_u) as f64;
            }
        }
        assert!((integral - 1.0).abs() < 2e-3, "{integral}");
        let mut estimate = Vec3::ZERO;
        let n = 1 << 14;
        for i in 0..n {
            let u = Vec2::new((i as f32 * 0.618_034).fract(), (i as f32 + 0.5) / n as f32);
            let (_, radiance, pdf) = environment.sample(u);
            estimate += radiance / pdf / n as f32;
        }
        let mean = environment.mean_radiance() * 4.0 * PI;
        assert!(estimate.distance(mean) < 0.02 * mean.length(), "{estimate} {mean}");
    }

    #[test]
    fn the_layout_has_minus_z_at_the_centre_and_x_to_its_right() {
        let environment = Environment { rotation: 0.0, ..spotted(8, 4) };
        for (direction, uv) in [
            (Vec3::NEG_Z, [0.5, 0.5]),
            (Vec3::X, [0.75, 0.5]),
            (Vec3::NEG_X, [0.25, 0.5]),
            (Vec3::Y, [0.5, 0.0]),
        ] {
            assert!(environment.uv(direction).distance(Vec2::from(uv)) < 1e-5, "{direction}");
        }
    }
}
