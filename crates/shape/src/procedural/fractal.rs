//! Terrain as a sum of octaves of noise.
//!
//! y = amplitude · Σ_o roughness^o n(lacunarity^o p / wavelength + shift_o) / Σ_o roughness^o, with gradient noise
//! n scaled to about ±1 (fBm; Musgrave in Ebert et al., *Texturing and Modeling*, ch. 16). `ridges` blends towards
//! the ridged form, where |n| folds crests up and an octave is weighted by the octave before it, so that valleys
//! stay smooth. Every octave is turned against the one before, which hides the lattice.

use glam::Vec2;

use super::noise::{hash, noise2};
use super::{Grid, require, require_finite, require_positive};
use crate::HeightFieldError;

/// Mountains from noise; deterministic in `seed`.
#[derive(Clone, Debug, PartialEq)]
pub struct FractalTerrain {
    /// Which landscape.
    pub seed: u32,
    /// Octaves, 1 to 24.
    pub octaves: u32,
    /// Size of the largest features, in metres.
    pub wavelength: f32,
    /// Frequency of an octave relative to the one before; about 2.
    pub lacunarity: f32,
    /// Amplitude of an octave relative to the one before: 0.5 is natural, less is smoother.
    pub roughness: f32,
    /// About the greatest height above or below `base`, in metres.
    pub amplitude: f32,
    /// Height added everywhere, in metres.
    pub base: f32,
    /// 0 for rolling hills, 1 for ridges.
    pub ridges: f32,
}

impl Default for FractalTerrain {
    fn default() -> Self {
        Self {
            seed: 0,
            octaves: 8,
            wavelength: 8.0,
            lacunarity: 2.03,
            roughness: 0.48,
            amplitude: 1.5,
            base: 0.0,
            ridges: 0.6,
        }
    }
}

/// Gradient noise hardly leaves ±0.6; this makes it fill ±1.
const NOISE_SCALE: f32 = 1.6;

impl FractalTerrain {
    /// The height at one place.
    pub fn height(&self, x: f64, z: f64) -> f32 {
        let mut point =
            Vec2::new((x / f64::from(self.wavelength)) as f32, (z / f64::from(self.wavelength)) as f32);
        // Turned by an angle whose tangent is 3/4, which leaves no common directions for long.
        let turn = Vec2::new(0.8, 0.6);
        let (mut smooth, mut ridged, mut total) = (0.0, 0.0, 0.0);
        let (mut weight, mut crest) = (1.0f32, 1.0f32);
        for octave in 0..self.octaves {
            let h = hash(octave as i32, 17, 0, self.seed);
            let shift = Vec2::new((h & 0xffff) as f32, (h >> 16) as f32) * (1.0 / 256.0);
            let value =
                (NOISE_SCALE * noise2(point + shift, self.seed.wrapping_add(octave))).clamp(-1.0, 1.0);
            let fold = 1.0 - value.abs();
            let fold = fold * fold * crest;
            crest = (2.0 * fold).min(1.0);
            smooth += weight * value;
            ridged += weight * (2.0 * fold - 0.7);
            total += weight;
            weight *= self.roughness;
            point = turn.rotate(point) * self.lacunarity;
        }
        self.base + self.amplitude * (smooth + self.ridges * (ridged - smooth)) / total
    }

    pub(super) fn validate(&self) -> Result<(), HeightFieldError> {
        let octaves = f64::from(self.octaves);
        require("octaves", octaves, "between 1 and 24", (1..=24).contains(&self.octaves))?;
        require_positive("wavelength", self.wavelength)?;
        require_positive("lacunarity", self.lacunarity)?;
        let roughness = f64::from(self.roughness);
        require("roughness", roughness, "between 0 and 1", (0.0..=1.0).contains(&roughness))?;
        require_finite("amplitude", self.amplitude)?;
        require_finite("base", self.base)?;
        require("ridges", f64::from(self.ridges), "between 0 and 1", (0.0..=1.0).contains(&self.ridges))
    }

    pub(super) fn fill(&self, grid: &Grid, heights: &mut [f32]) {
        let columns: Vec<f64> = (0..grid.columns).map(|column| grid.x(column)).collect();
        grid.rows_mut(heights, |_, z, line| {
            for (height, &x) in line.iter_mut().zip(&columns) {
                *height = self.height(x, z);
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::procedural::ProceduralHeight;

    fn field(terrain: FractalTerrain) -> Vec<f32> {
        let extent = (Vec2::splat(-20.0), Vec2::splat(20.0));
        ProceduralHeight::FractalTerrain(terrain).evaluate(96, 96, extent.0, extent.1, 0.0).unwrap().heights
    }

    #[test]
    fn terrain_depends_on_the_seed_alone_and_stays_in_its_range() {
        let heights = field(FractalTerrain::default());
        assert_eq!(heights, field(FractalTerrain::default()));
        assert_ne!(heights, field(FractalTerrain { seed: 1, ..FractalTerrain::default() }));
        let (low, high) = heights.iter().fold((0.0f32, 0.0f32), |(a, b), &h| (a.min(h), b.max(h)));
        assert!(low > -2.0 && high < 2.0 && high - low > 0.5, "{low} {high}");
    }

    #[test]
    fn less_roughness_means_smaller_steps_between_posts() {
        let steps = |roughness| {
            let heights = field(FractalTerrain { roughness, ..FractalTerrain::default() });
            heights.windows(2).map(|w| (w[1] - w[0]).abs()).sum::<f32>()
        };
        assert!(steps(0.3) < steps(0.6));
    }
}
