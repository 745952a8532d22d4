//! What a height field hides, in spherical harmonics: a pyramid of mean heights, marched in sixteen directions.
//!
//! For each azimuth φ_k the horizon is the largest elevation σ_k = max_τ atan((h(x + τ u_k) − z)/τ) up to the border of the
//! field, where a last step is taken: a point high above sees the sky below the horizontal, past the border. (The
//! seed's base plane goes on forever, so its σ_k are at least 0; a field of a scene ends.) Steps grow by half an octave, τ_i = τ₀ 2^(i/2), and read the pyramid at level
//! i/2 + log₂ κ, so a far step reads a mean over what it stands for. With κ = 1/8 all levels are multiples of ½, and the
//! pyramid keeps those halfway as well: one bilinear look-up for each step. What is hidden, from straight down to
//! the horizon, has with linear interpolation between azimuths (Δ = 2π/N)
//!
//! ```text
//! f_lm = Δ sinc²(mΔ/2) Σ_k J_l|m|(σ_k) t_m(φ_k),   J_lm(σ) = ∫_{−π/2}^{σ} y_lm(elevation, azimuth 0) cos dσ
//! ```
//!
//! with t_m = cos mφ, 1, sin |m|φ. J is tabulated over sin σ. Frame: the harmonics' polar axis is the field's up; azimuth
//! 0 is +z, a quarter turn is +x. Mean error of σ ½°, of the irradiance 0.8 % of the unoccluded, at order 4.
//! Source: seed \[000\] with the corrections of Snyder & Nowrouzezahrai 2008; marching schedule measured.

use std::f32::consts::TAU;

use glam::{Affine3A, Mat3, Vec2, Vec3};
use halflight_sh::{Rotation, Sh, reference};
use halflight_shape::HeightField;
use rayon::prelude::*;

/// N: azimuths, which are also the lanes of the march.
pub(super) const AZIMUTHS: usize = 16;
/// κ = 2^−3.
const KAPPA_OCTAVES: i32 = 3;
/// Entries of the table of J over sin σ from −1 to 1.
const ENTRIES: usize = 513;
/// The slope of straight down, for lanes where the field has not been met.
const DOWN: f32 = -1e6;

/// J and the azimuths, once for an order.
pub(super) struct WedgeTable<const ORDER: usize> {
    /// `entries[i][j]`: J of the pair (l, m ≥ 0) number j, times Δ sinc².
    entries: Vec<Vec<f32>>,
    /// t_m(φ_k) of each coefficient.
    azimuths: Vec<[f32; AZIMUTHS]>,
}

impl<const ORDER: usize> WedgeTable<ORDER> {
    pub(super) fn new() -> Self {
        // Two steps of Gauss's rule with two points between entries; the integrand is smooth in σ.
        let pairs = ORDER * (ORDER + 1) / 2;
        let integrand = |elevation: f64| -> Vec<f64> {
            let direction = glam::DVec3::new(elevation.cos(), 0.0, elevation.sin());
            let y = reference::basis(ORDER, direction);
            pairs_of::<ORDER>().map(|(l, m)| y[l * l + l + m] * elevation.cos()).collect()
        };
        let mut sum = vec![0.0; pairs];
        let mut add = |from: f64, to: f64, steps: usize| {
            for step in 0..steps {
                let width = (to - from) / steps as f64;
                let middle = from + (step as f64 + 0.5) * width;
                for node in [-1.0, 1.0] {
                    let values = integrand(middle + node * width * 0.5 / 3.0f64.sqrt());
                    sum.iter_mut().zip(values).for_each(|(s, v)| *s += 0.5 * width * v);
                }
            }
            sum.clone()
        };
        let mut table = vec![vec![0.0; pairs]];
        for i in 1..ENTRIES {
            let elevation = |i: usize| (2.0 * i as f64 / (ENTRIES - 1) as f64 - 1.0).asin();
            table.push(add(elevation(i - 1), elevation(i), 8));
        }
        let delta = std::f64::consts::TAU / AZIMUTHS as f64;
        let scale = |m: usize| {
            let x = m as f64 * delta / 2.0;
            delta * if m == 0 { 1.0 } else { (x.sin() / x).powi(2) }
        };
        let entries = table
            .iter()
            .map(|entry| {
                entry.iter().zip(pairs_of::<ORDER>()).map(|(j, (_, m))| (j * scale(m)) as f32).collect()
            })
            .collect();
        let azimuths = (0..ORDER * ORDER)
            .map(|i| {
                let l = (0..ORDER).rfind(|l| l * l <= i).unwrap_or(0);
                let m = i as i32 - (l * l + l) as i32;
                std::array::from_fn(|k| {
                    let angle = m as f32 * TAU * k as f32 / AZIMUTHS as f32;
                    if m < 0 { (-angle).sin() } else { angle.cos() }
                })
            })
            .collect();
        Self { entries, azimuths }
    }

    /// What is hidden below sixteen horizons, given as sin σ.
    pub(super) fn hidden(&self, sines: &[f32; AZIMUTHS]) -> Sh<ORDER> {
        let mut sums = [[0.0f32; AZIMUTHS]; 36];
        let pairs = ORDER * (ORDER + 1) / 2;
        for (k, &sine) in sines.iter().enumerate() {
            let place = (0.5 * sine.clamp(-1.0, 1.0) + 0.5) * (ENTRIES - 1) as f32;
            let below = (place as usize).min(ENTRIES - 2);
            let t = place - below as f32;
            let (a, b) = (&self.entries[below], &self.entries[below + 1]);
            for j in 0..pairs {
                sums[j][k] = a[j] + (b[j] - a[j]) * t;
            }
        }
        let mut hidden = Sh::zero();
        for l in 0..ORDER {
            for m in 0..=l {
                let j = l * (l + 1) / 2 + m;
                let along = |i: usize| -> f32 {
                    sums[j].iter().zip(&self.azimuths[i]).map(|(value, t)| value * t).sum()
                };
                hidden[l * l + l + m] = along(l * l + l + m);
                if m > 0 {
                    hidden[l * l + l - m] = along(l * l + l - m);
                }
            }
        }
        hidden
    }
}

/// The pairs (l, m ≥ 0) in the order l(l + 1)/2 + m.
fn pairs_of<const ORDER: usize>() -> impl Iterator<Item = (usize, usize)> {
    (0..ORDER).flat_map(|l| (0..=l).map(move |m| (l, m)))
}

/// One level of the pyramid.
struct Level {
    columns: usize,
    rows: usize,
    heights: Vec<f32>,
    /// Posts of the finest level in one of this, along an axis.
    scale: f32,
}

impl Level {
    /// Half as many posts along each axis, each the mean of four; of three or two at an odd border.
    fn coarser(&self) -> Self {
        let (columns, rows) = (self.columns.div_ceil(2), self.rows.div_ceil(2));
        let heights = (0..columns * rows)
            .into_par_iter()
            .with_min_len(4096)
            .map(|i| {
                let (x, y) = (2 * (i % columns), 2 * (i / columns));
                let (x1, y1) = ((x + 1).min(self.columns - 1), (y + 1).min(self.rows - 1));
                let at = |x: usize, y: usize| self.heights[y * self.columns + x];
                0.25 * (at(x, y) + at(x1, y) + at(x, y1) + at(x1, y1))
            })
            .collect();
        Self { columns, rows, heights, scale: 2.0 * self.scale }
    }

    /// This level and the next coarser one, mixed half and half, at the posts of this one.
    fn halfway(&self, coarser: &Level) -> Self {
        let heights = (0..self.heights.len())
            .into_par_iter()
            .with_min_len(4096)
            .map(|i| {
                let (x, y) = ((i % self.columns) as f32, (i / self.columns) as f32);
                let below = coarser.at(Vec2::new(0.5 * x - 0.25, 0.5 * y - 0.25));
                0.5 * (self.heights[i] + below)
            })
            .collect();
        Self { columns: self.columns, rows: self.rows, heights, scale: self.scale }
    }

    /// Bilinear, held at the border; `place` in posts of this level.
    #[inline]
    fn at(&self, place: Vec2) -> f32 {
        let x = place.x.clamp(0.0, (self.columns - 1) as f32);
        let y = place.y.clamp(0.0, (self.rows - 1) as f32);
        let (x0, y0) = (x as usize, y as usize);
        let (x1, y1) = ((x0 + 1).min(self.columns - 1), (y0 + 1).min(self.rows - 1));
        let (fx, fy) = (x - x0 as f32, y - y0 as f32);
        let (upper, lower) = (y0 * self.columns, y1 * self.columns);
        let mix =
            |row: usize| self.heights[row + x0] + (self.heights[row + x1] - self.heights[row + x0]) * fx;
        let (top, bottom) = (mix(upper), mix(lower));
        top + (bottom - top) * fy
    }
}

/// A height field of one frame, ready to be marched.
pub(super) struct FieldVisibility {
    /// At levels 0, ½, 1, 1½ … of the pyramid.
    levels: Vec<Level>,
    min: Vec2,
    max: Vec2,
    /// Metres between posts.
    spacing: Vec2,
    to_field: Affine3A,
    /// From the field's directions to the world's, where its axes are not the world's.
    turn: Option<Mat3>,
    highest: f32,
}

impl FieldVisibility {
    /// A field in the world; `None` if the transform cannot be undone.
    pub(super) fn new(field: &HeightField, place: &Affine3A) -> Option<Self> {
        let to_field = place.inverse();
        if !to_field.is_finite() {
            return None;
        }
        let mut current =
            Level { columns: field.columns, rows: field.rows, heights: field.heights.clone(), scale: 1.0 };
        let mut levels = Vec::new();
        while current.columns.max(current.rows) > 2 {
            let next = current.coarser();
            let between = current.halfway(&next);
            levels.push(current);
            levels.push(between);
            current = next;
        }
        levels.push(current);
        let linear = Mat3::from(place.matrix3);
        let columns = [linear.x_axis, linear.y_axis, linear.z_axis].map(Vec3::normalize_or_zero);
        let turn = Mat3::from_cols(columns[0], columns[1], columns[2]);
        let upright = turn.abs_diff_eq(Mat3::IDENTITY, 1e-6);
        Some(Self {
            levels,
            min: field.min,
            max: field.max,
            spacing: field.spacing(),
            to_field,
            turn: (!upright).then_some(turn),
            highest: field.height_range().1,
        })
    }

    /// What the field leaves visible from a point of the world, in the frame of the harmonics (polar axis up).
    pub(super) fn visible<const ORDER: usize>(&self, table: &WedgeTable<ORDER>, point: Vec3) -> Sh<ORDER> {
        let local = self.to_field.transform_point3(point);
        let visible = Sh::one() - table.hidden(&self.horizon(local));
        match self.turn {
            None => visible,
            Some(turn) => Rotation::from_matrix(&in_harmonics(turn)).apply(&visible),
        }
    }

    /// sin σ_k seen from a point in the space of the field.
    fn horizon(&self, point: Vec3) -> [f32; AZIMUTHS] {
        let mut slopes = [DOWN; AZIMUTHS];
        let middle = Vec2::new(point.x, point.z);
        let borders = AZIMUTH_DIRECTIONS.map(|direction| border(self.min, self.max, middle, direction));
        let far = borders.iter().fold(0.0f32, |a, &b| a.max(b));
        let above = self.highest - point.y;
        let mut distance = self.spacing.min_element();
        for i in 0.. {
            // Nothing farther away can rise above the horizons that are there already.
            let least = slopes.iter().fold(f32::INFINITY, |a, &b| a.min(b));
            let most = above / if above > 0.0 { distance } else { far };
            if distance > far || most <= least {
                break;
            }
            let level = (i - 2 * KAPPA_OCTAVES).max(0) as usize;
            let level = &self.levels[level.min(self.levels.len() - 1)];
            let (to_level, shift) = self.to_level(level);
            for k in 0..AZIMUTHS {
                // No place is higher than the highest.
                if distance <= borders[k] && above > slopes[k] * distance {
                    let place = middle + AZIMUTH_DIRECTIONS[k] * distance;
                    let height = level.at((place - self.min) * to_level + shift);
                    slopes[k] = slopes[k].max((height - point.y) / distance);
                }
            }
            distance *= std::f32::consts::SQRT_2;
        }
        for k in 0..AZIMUTHS {
            if borders[k] > 0.0 && above > slopes[k] * borders[k] {
                let texels = (borders[k] / self.spacing.min_element()).max(1.0);
                let level = (2.0 * texels.log2()) as i32 - 2 * KAPPA_OCTAVES;
                let level = &self.levels[(level.max(0) as usize).min(self.levels.len() - 1)];
                let (to_level, shift) = self.to_level(level);
                let place = middle + AZIMUTH_DIRECTIONS[k] * borders[k];
                let height = level.at((place - self.min) * to_level + shift);
                slopes[k] = slopes[k].max((height - point.y) / borders[k]);
            }
        }
        slopes.map(|slope| slope / (1.0 + slope * slope).sqrt())
    }

    /// Factor and shift from metres beyond the least corner to posts of a level.
    fn to_level(&self, level: &Level) -> (Vec2, f32) {
        (1.0 / (self.spacing * level.scale), 0.5 / level.scale - 0.5)
    }
}

/// How far it is along a direction to the border of a rectangle; 0 where the ray does not go over it.
pub(super) fn border(min: Vec2, max: Vec2, from: Vec2, direction: Vec2) -> f32 {
    let inverse = 1.0 / direction;
    let (a, b) = ((min - from) * inverse, (max - from) * inverse);
    // A direction along an axis divides by zero: there the bound is infinite, or NaN on the border itself.
    let bound = |x: f32, y: f32| if x.is_nan() || y.is_nan() { f32::INFINITY } else { x.max(y) };
    bound(a.x, b.x).min(bound(a.y, b.y)).max(0.0)
}

/// A rotation of the world as one of the frame of the harmonics, whose (x, y, z) are the world's (z, x, y).
pub(super) fn in_harmonics(turn: Mat3) -> Mat3 {
    let permute = |v: Vec3| Vec3::new(v.z, v.x, v.y);
    Mat3::from_cols(permute(turn.z_axis), permute(turn.x_axis), permute(turn.y_axis))
}

/// (x, z) of the azimuths: 0 is +z, a quarter turn +x.
pub(super) const AZIMUTH_DIRECTIONS: [Vec2; AZIMUTHS] = {
    /// sin of 0, 1/16, … 4/16 of a turn.
    const SINES: [f32; 5] = [0.0, 0.382_683_43, 0.707_106_77, 0.923_879_5, 1.0];
    let mut directions = [Vec2::ZERO; AZIMUTHS];
    let mut k = 0;
    while k < AZIMUTHS {
        let (quarter, rest) = (k / 4, k % 4);
        let (sin, cos) = (SINES[rest], SINES[4 - rest]);
        directions[k] = match quarter {
            0 => Vec2::new(sin, cos),
            1 => Vec2::new(cos, -sin),
            2 => Vec2::new(-sin, -cos),
            _ => Vec2::new(-cos, sin),
        };
        k += 1;
    }
    directions
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flat_horizon_hides_the_lower_half_and_a_level_one_a_cap() {
        let table = WedgeTable::<4>::new();
        for sine in [-0.6f32, 0.0, 0.3, 0.8, 0.97] {
            let hidden = table.hidden(&[sine; AZIMUTHS]);
            // What is visible is a cap about the pole.
            let open = halflight_sh::Zh::<4>::cap(f64::from(sine).acos()).to_sh();
            let difference = (Sh::one() - hidden - open).norm();
            assert!(difference < 2e-4, "{sine}: {difference}");
        }
    }

    #[test]
    fn the_wedge_sum_agrees_with_quadrature() {
        // Source: the wedge projection of verified mathematics §3, here for J as it is.
        let table = WedgeTable::<4>::new();
        let sines: [f32; AZIMUTHS] = std::array::from_fn(|k| 0.5 + 0.4 * (k as f32 * 1.3).sin());
        let hidden = table.hidden(&sines);
        // J interpolated linearly between azimuths: mixes of two table rows, integrated over azimuth numerically.
        let mut expected = [0.0f64; 16];
        let fine = 64;
        let delta = std::f64::consts::TAU / AZIMUTHS as f64;
        let unscaled = |k: usize, j: usize, m: usize| {
            let x = m as f64 * delta / 2.0;
            let scale = delta * if m == 0 { 1.0 } else { (x.sin() / x).powi(2) };
            let place = (0.5 * sines[k] + 0.5) * (ENTRIES - 1) as f32;
            let (below, t) = (place as usize, place.fract());
            let entry = table.entries[below][j] * (1.0 - t) + table.entries[below + 1][j] * t;
            f64::from(entry) / scale
        };
        for k in 0..AZIMUTHS {
            for s in 0..fine {
                let t = (s as f64 + 0.5) / fine as f64;
                let azimuth = (k as f64 + t) * delta;
                for (j, (l, m)) in pairs_of::<4>().enumerate() {
                    let value = unscaled(k, j, m) * (1.0 - t) + unscaled((k + 1) % AZIMUTHS, j, m) * t;
                    let weight = delta / fine as f64;
                    expected[l * l + l + m] += value * (m as f64 * azimuth).cos() * weight;
                    if m > 0 {
                        expected[l * l + l - m] += value * (m as f64 * azimuth).sin() * weight;
                    }
                }
            }
        }
        for i in 0..16 {
            assert!((f64::from(hidden[i]) - expected[i]).abs() < 2e-4, "{i}: {} {}", hidden[i], expected[i]);
        }
    }

    #[test]
    fn a_wall_is_seen_where_it_stands() {
        // A wall of height 1 along x at z = 2, seen from the origin.
        let n = 257;
        let heights: Vec<f32> =
            (0..n * n).map(|i| if (i / n) as f32 / 256.0 * 8.0 - 4.0 >= 2.0 { 1.0 } else { 0.0 }).collect();
        let field = HeightField::new(n, n, Vec2::splat(-4.0), Vec2::splat(4.0), heights).unwrap();
        let marched = FieldVisibility::new(&field, &Affine3A::IDENTITY).unwrap();
        let sines = marched.horizon(Vec3::ZERO);
        // Towards +z and beside it; sideways and behind nothing. A step may pass the foot of a sheer wall by half an octave.
        assert!((sines[0] - 1.0 / 5.0f32.sqrt()).abs() < 0.12, "{sines:?}");
        assert!(sines[8].abs() < 1e-6 && sines[4].abs() < 1e-6, "{sines:?}");
        assert!((sines[2] - (1.0 / (1.0 + 8.0f32)).sqrt()).abs() < 0.12, "{sines:?}");
    }

    #[test]
    fn from_above_the_sky_is_seen_past_the_border() {
        let field =
            HeightField::new(33, 33, Vec2::splat(-1.0), Vec2::splat(1.0), vec![0.0; 33 * 33]).unwrap();
        let marched = FieldVisibility::new(&field, &Affine3A::IDENTITY).unwrap();
        let sines = marched.horizon(Vec3::new(0.0, 1.0, 0.0));
        for (k, expected) in [(0, -0.5f32.sqrt()), (2, -1.0 / 3.0f32.sqrt()), (4, -0.5f32.sqrt())] {
            assert!((sines[k] - expected).abs() < 1e-3, "{k}: {sines:?}");
        }
        // From beside the field it is in the way in one direction only.
        let sines = marched.horizon(Vec3::new(0.0, 0.5, -3.0));
        assert!(sines[0] > -0.2 && sines[8] < -0.99, "{sines:?}");
    }
}
