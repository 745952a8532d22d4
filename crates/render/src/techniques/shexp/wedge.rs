//! What lies below a horizon that is known in sixteen azimuths, in spherical harmonics.
//!
//! With elevations σ_k in azimuths φ_k and linear interpolation between them (Δ = 2π/N), what is hidden, from straight down to
//! the horizon, is
//!
//! ```text
//! f_lm = Δ sinc²(mΔ/2) Σ_k J_l|m|(σ_k) t_m(φ_k),   J_lm(σ) = ∫_{−π/2}^{σ} y_lm(elevation, azimuth 0) cos dσ
//! ```
//!
//! with t_m = cos mφ, 1, sin |m|φ. J is tabulated over sin σ. Frame: the harmonics' polar axis is up; azimuth 0 is +z, a
//! quarter turn is +x. Cost: some 20 ns a horizon at order 4.
//! Source: Snyder & Nowrouzezahrai 2008, with the corrections of verified mathematics §3.

use std::f32::consts::TAU;

use glam::{Mat3, Vec2, Vec3};
use halflight_sh::{Kernel, Lane, Sh, Simd, reference};

/// N: azimuths.
pub(super) const AZIMUTHS: usize = 16;
/// Entries of the table of J over sin σ from −1 to 1.
const ENTRIES: usize = 513;
/// A row of the table is filled up to a multiple of the widest vector.
const WIDEST: usize = 16;

/// J and the azimuths, once for an order.
pub(super) struct WedgeTable<const ORDER: usize> {
    /// Floats in a row of either table.
    width: usize,
    /// Row by row for each sin σ: J_l|m| Δ sinc² of each coefficient.
    heights: Vec<f32>,
    /// Row by row for each azimuth: t_m(φ_k) of each coefficient.
    azimuths: Vec<f32>,
}

impl<const ORDER: usize> WedgeTable<ORDER> {
    pub(super) fn new() -> Self {
        let width = (ORDER * ORDER).next_multiple_of(WIDEST);
        let delta = std::f64::consts::TAU / AZIMUTHS as f64;
        let scale = |m: i32| {
            let x = f64::from(m) * delta / 2.0;
            delta * if m == 0 { 1.0 } else { (x.sin() / x).powi(2) }
        };
        let mut heights = vec![0.0; ENTRIES * width];
        let mut azimuths = vec![0.0; AZIMUTHS * width];
        for (entry, integrals) in integrals::<ORDER>().into_iter().enumerate() {
            for (i, (l, m)) in degrees::<ORDER>().enumerate() {
                let integral = integrals[l * l + l + m.unsigned_abs() as usize];
                heights[entry * width + i] = (integral * scale(m)) as f32;
            }
        }
        for azimuth in 0..AZIMUTHS {
            for (i, (_, m)) in degrees::<ORDER>().enumerate() {
                let angle = m as f32 * TAU * azimuth as f32 / AZIMUTHS as f32;
                azimuths[azimuth * width + i] = if m < 0 { (-angle).sin() } else { angle.cos() };
            }
        }
        Self { width, heights, azimuths }
    }

    /// What is hidden below sixteen horizons, given as sin σ.
    pub(super) fn hidden(&self, simd: Simd, sines: &[f32; AZIMUTHS]) -> Sh<ORDER> {
        simd.run(Hidden { table: self, sines })
    }

    /// [`WedgeTable::hidden`] for kernels.
    #[inline(always)]
    pub(super) fn hidden_inlined<V: Lane>(&self, sines: &[f32; AZIMUTHS]) -> Sh<ORDER> {
        let mut places = [(0, 0.0); AZIMUTHS];
        for (place, sine) in places.iter_mut().zip(sines) {
            let at = (0.5 * sine.clamp(-1.0, 1.0) + 0.5) * (ENTRIES - 1) as f32;
            let below = (at as usize).min(ENTRIES - 2);
            *place = (below * self.width, at - below as f32);
        }
        let mut hidden = [0.0f32; 64];
        for first in (0..ORDER * ORDER).step_by(V::N) {
            let mut sum = V::splat(0.0);
            for (azimuth, &(row, t)) in places.iter().enumerate() {
                let below = V::load(&self.heights[row + first..]);
                let above = V::load(&self.heights[row + self.width + first..]);
                let integral = (above - below).mul_add(V::splat(t), below);
                sum = integral.mul_add(V::load(&self.azimuths[azimuth * self.width + first..]), sum);
            }
            sum.store(&mut hidden[first..]);
        }
        let mut sh = Sh::zero();
        sh.coefficients_mut().copy_from_slice(&hidden[..ORDER * ORDER]);
        sh
    }
}

struct Hidden<'a, const ORDER: usize> {
    table: &'a WedgeTable<ORDER>,
    sines: &'a [f32; AZIMUTHS],
}

impl<const ORDER: usize> Kernel for Hidden<'_, ORDER> {
    type Output = Sh<ORDER>;
    #[inline(always)]
    fn run<V: Lane>(self) -> Sh<ORDER> {
        self.table.hidden_inlined::<V>(self.sines)
    }
}

/// (l, m) in the order of the coefficients.
fn degrees<const ORDER: usize>() -> impl Iterator<Item = (usize, i32)> {
    (0..ORDER).flat_map(|l| (-(l as i32)..=l as i32).map(move |m| (l, m)))
}

/// J_lm at each entry, at the place of the coefficient (l, m ≥ 0).
fn integrals<const ORDER: usize>() -> Vec<Vec<f64>> {
    /// Steps of Gauss's rule with two points between entries; the integrand is smooth in σ.
    const STEPS: usize = 8;
    let elevation = |entry: usize| (2.0 * entry as f64 / (ENTRIES - 1) as f64 - 1.0).asin();
    let mut sum = vec![0.0; ORDER * ORDER];
    let mut table = vec![sum.clone()];
    for entry in 1..ENTRIES {
        let (from, to) = (elevation(entry - 1), elevation(entry));
        let width = (to - from) / STEPS as f64;
        for step in 0..STEPS {
            let middle = from + (step as f64 + 0.5) * width;
            for node in [-1.0, 1.0] {
                let at: f64 = middle + node * width * 0.5 / 3.0f64.sqrt();
                let y = reference::basis(ORDER, glam::DVec3::new(at.cos(), 0.0, at.sin()));
                sum.iter_mut().zip(y).for_each(|(sum, y)| *sum += 0.5 * width * y * at.cos());
            }
        }
        table.push(sum.clone());
    }
    table
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

/// How far it is along a direction to the border of a rectangle; 0 where the ray does not go over it.
pub(super) fn border(min: Vec2, max: Vec2, from: Vec2, direction: Vec2) -> f32 {
    let (mut near, mut far) = (f32::NEG_INFINITY, f32::INFINITY);
    for axis in 0..2 {
        if direction[axis] != 0.0 {
            let a = (min[axis] - from[axis]) / direction[axis];
            let b = (max[axis] - from[axis]) / direction[axis];
            (near, far) = (near.max(a.min(b)), far.min(a.max(b)));
        } else if from[axis] < min[axis] || from[axis] > max[axis] {
            return 0.0;
        }
    }
    if near <= far { far.max(0.0) } else { 0.0 }
}

/// A rotation of the world as one of the frame of the harmonics, whose (x, y, z) are the world's (z, x, y).
pub(super) fn in_harmonics(turn: Mat3) -> Mat3 {
    let permute = |v: Vec3| Vec3::new(v.z, v.x, v.y);
    Mat3::from_cols(permute(turn.z_axis), permute(turn.x_axis), permute(turn.y_axis))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flat_horizon_hides_the_lower_half_and_a_level_one_a_cap() {
        let table = WedgeTable::<4>::new();
        for sine in [-0.6f32, 0.0, 0.3, 0.8, 0.97] {
            let hidden = table.hidden(Simd::detect(), &[sine; AZIMUTHS]);
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
        let hidden = table.hidden(Simd::detect(), &sines);
        // J interpolated linearly between azimuths: mixes of two entries, integrated over azimuth numerically.
        let table = integrals::<4>();
        let mut expected = [0.0f64; 16];
        let fine = 64;
        let weight = std::f64::consts::TAU / AZIMUTHS as f64 / fine as f64;
        let integral = |k: usize, i: usize| {
            let place = (0.5 * f64::from(sines[k % AZIMUTHS]) + 0.5) * (ENTRIES - 1) as f64;
            let (below, t) = (place as usize, place.fract());
            table[below][i] * (1.0 - t) + table[below + 1][i] * t
        };
        for k in 0..AZIMUTHS {
            for s in 0..fine {
                let t = (s as f64 + 0.5) / fine as f64;
                let azimuth = (k as f64 + t) * std::f64::consts::TAU / AZIMUTHS as f64;
                for (i, (l, m)) in degrees::<4>().enumerate() {
                    let entry = l * l + l + m.unsigned_abs() as usize;
                    let value = integral(k, entry) * (1.0 - t) + integral(k + 1, entry) * t;
                    let angle = f64::from(m) * azimuth;
                    expected[i] += value * weight * if m < 0 { (-angle).sin() } else { angle.cos() };
                }
            }
        }
        for i in 0..16 {
            assert!((f64::from(hidden[i]) - expected[i]).abs() < 2e-4, "{i}: {} {}", hidden[i], expected[i]);
        }
    }
}
