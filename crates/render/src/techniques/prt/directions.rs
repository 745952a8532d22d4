//! The directions in which every vertex looks, the same for all: neighbours then err alike, and rays of neighbours go
//! together.
//!
//! A Fibonacci lattice on the sphere: point i of n at height 1 − (2i + 1)/n, turned by i golden angles. Each stands for
//! 4π/n. Source: Swinbank & Purser 2006.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};
use halflight_sh::{Sh, Zh};

use crate::sh_light::axes;

/// The most bands.
pub(super) const MOST: usize = 6;

/// Directions and the harmonics there.
pub(super) struct Directions {
    pub(super) vectors: Vec<Vec3>,
    /// `n` harmonics for each direction.
    pub(super) basis: Vec<f32>,
    /// The solid angle that each stands for.
    pub(super) weight: f32,
}

impl Directions {
    /// So many directions with the first `n` harmonics. `turn` turns all of them about the vertical.
    pub(super) fn new(count: usize, n: usize, turn: f64) -> Self {
        let golden = PI * (3.0 - 5f64.sqrt());
        let vectors: Vec<Vec3> = (0..count)
            .map(|i| {
                let height = 1.0 - (2 * i + 1) as f64 / count as f64;
                let radius = (1.0 - height * height).max(0.0).sqrt();
                let angle = (i as f64 * golden + turn) % TAU;
                DVec3::new(radius * angle.sin(), height, radius * angle.cos()).as_vec3().normalize()
            })
            .collect();
        let basis = vectors.iter().flat_map(|&d| basis(d).coefficients()[..n].to_vec()).collect();
        Self { vectors, basis, weight: (4.0 * PI / count as f64) as f32 }
    }

    /// The harmonics of a direction.
    #[inline]
    pub(super) fn harmonics(&self, direction: usize) -> &[f32] {
        let n = self.basis.len() / self.vectors.len();
        &self.basis[direction * n..(direction + 1) * n]
    }
}

/// Harmonics of a direction of the world, in as many bands as any order has: those of fewer come first.
#[inline]
pub(super) fn basis(direction: Vec3) -> Sh<MOST> {
    Sh::basis(axes(direction))
}

/// The clamped cosine, max(n·ω, 0), about any normal: its convolution with light is unshadowed irradiance.
pub(super) struct Cosine([f32; MOST * MOST]);

impl Cosine {
    pub(super) fn new() -> Self {
        let zonal = Zh::<MOST, f64>::clamped_cosine();
        let mut factors = [0.0; MOST * MOST];
        for l in 0..MOST {
            let factor = (4.0 * PI / (2 * l + 1) as f64).sqrt() * zonal.0[l];
            factors[l * l..(l + 1) * (l + 1)].fill(factor as f32);
        }
        Self(factors)
    }

    /// Its harmonics about a normal.
    #[inline]
    pub(super) fn about(&self, normal: Vec3) -> Sh<MOST> {
        let basis = basis(normal);
        Sh::from_fn(|i| basis[i] * self.0[i])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lattice_integrates_the_harmonics_and_the_cosine() {
        let directions = Directions::new(1024, 36, 0.0);
        let cosine = Cosine::new();
        let normal = Vec3::new(0.3, -0.5, 0.8).normalize();
        let mut sums = [0.0f64; 36];
        let mut projected = [0.0f64; 36];
        for (d, &vector) in directions.vectors.iter().enumerate() {
            let w = f64::from(directions.weight);
            for (i, &y) in directions.harmonics(d).iter().enumerate() {
                sums[i] += w * f64::from(y);
                projected[i] += w * f64::from(y * vector.dot(normal).max(0.0));
            }
        }
        assert!((sums[0] - (4.0 * PI).sqrt()).abs() < 1e-5);
        assert!(sums[1..].iter().all(|sum| sum.abs() < 3e-3), "{sums:?}");
        let exact = cosine.about(normal);
        let worst = projected.iter().zip(exact.coefficients()).map(|(a, &b)| (a - f64::from(b)).abs());
        assert!(worst.clone().all(|e| e < 2e-3), "{}", worst.fold(0.0, f64::max));
    }
}
