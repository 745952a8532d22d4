//! Wind waves on deep water by Fourier synthesis.
//!
//! h(x, t) = Σ_k h̃(k, t) e^{ik·x} over the wave vectors k = 2π (n, m) / patch_size, with
//! h̃(k, t) = h̃₀(k) e^{−iωt} + h̃₀*(−k) e^{iωt} and ω = √(g k) (Tessendorf 2001, *Simulating Ocean Water*, eq. 19
//! and 26; here the sign makes a wave travel along its k). h̃₀ is complex Gaussian with
//! E|h̃₀|² = ½ Ψ(k) Δk², so that the variance of h is ∫Ψ dk in m². Spectra:
//!
//! * Phillips: Ψ = (α/π) k⁻⁴ cos²θ e^{−1/(kL)²}, α = 0.0081, L = U²/g, waves along the wind only.
//! * JONSWAP (Hasselmann 1973): α g² ω⁻⁵ e^{−1.25 (ω_p/ω)⁴} γ^r in frequency, with α = 0.076 (U²/Fg)^0.22,
//!   ω_p = 22 (g²/UF)^⅓, γ = 3.3, spread by cos²θ.
//!
//! The field repeats with `patch_size`. Random numbers come from a hash of (n, m, seed): a higher resolution adds
//! short waves and leaves the long ones where they are. Heights between grid points are Catmull–Rom interpolated,
//! and exact where posts fall on the grid (a patch over `resolution + 1` posts).

use std::f64::consts::{PI, TAU};
use std::fmt;
use std::sync::Arc;

use glam::Vec2;
use rayon::prelude::*;
use rustfft::{Fft, FftPlanner, num_complex::Complex};

use super::noise::hash;
use super::{Grid, require, require_finite, require_positive};
use crate::HeightFieldError;

const GRAVITY: f64 = 9.81;

/// How the energy of the waves is distributed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum OceanSpectrum {
    /// Fully developed sea.
    Phillips,
    /// A sea that the wind has worked on over a distance.
    Jonswap {
        /// That distance, in metres.
        fetch: f32,
    },
}

/// What an [`Ocean`] is made from.
#[derive(Clone, Debug, PartialEq)]
pub struct OceanSettings {
    /// The sea repeats after this many metres.
    pub patch_size: f32,
    /// Grid points along a side of the patch: a power of two from 8 to 4096.
    pub resolution: usize,
    /// Wind at ten metres above the water, in metres per second.
    pub wind_speed: f32,
    /// Where the wind blows to: angle from +x towards +z, in radians.
    pub wind_direction: f32,
    /// Factor on all heights; 1 is physical.
    pub amplitude: f32,
    /// Waves shorter than this are faded out, in metres; 0 keeps all.
    pub shortest_wave: f32,
    /// How the energy is distributed.
    pub spectrum: OceanSpectrum,
    /// If given, the motion repeats after so many seconds: frequencies are rounded to multiples of one turn.
    pub loop_seconds: Option<f32>,
    /// Which sea.
    pub seed: u32,
}

impl Default for OceanSettings {
    fn default() -> Self {
        Self {
            patch_size: 60.0,
            resolution: 512,
            wind_speed: 8.0,
            wind_direction: 0.6,
            amplitude: 1.0,
            shortest_wave: 0.15,
            spectrum: OceanSpectrum::Jonswap { fetch: 20_000.0 },
            loop_seconds: None,
            seed: 0,
        }
    }
}

/// One wave vector and its mirror image.
#[derive(Clone, Copy)]
struct Wave {
    /// h̃₀(k).
    along: Complex<f32>,
    /// Conjugate of h̃₀(−k).
    against: Complex<f32>,
    /// ω in radians per second.
    angular_speed: f32,
}

/// Wind waves, prepared: amplitudes and transforms. See the settings for what it is.
#[derive(Clone)]
pub struct Ocean {
    settings: OceanSettings,
    /// For n = 0 … resolution/2 (x), then m in the order of the transform (z): `waves[n * resolution + m]`.
    waves: Vec<Wave>,
    fft: Arc<dyn Fft<f32>>,
}

impl fmt::Debug for Ocean {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Ocean").field("settings", &self.settings).finish_non_exhaustive()
    }
}

impl Ocean {
    /// Draws the amplitudes and plans the transforms.
    ///
    /// # Errors
    /// If a setting is impossible.
    pub fn new(settings: OceanSettings) -> Result<Self, HeightFieldError> {
        let OceanSettings { resolution, shortest_wave, .. } = settings;
        let usable = resolution.is_power_of_two() && (8..=4096).contains(&resolution);
        require("resolution", resolution as f64, "a power of two from 8 to 4096", usable)?;
        require_positive("patch_size", settings.patch_size)?;
        require_positive("wind_speed", settings.wind_speed)?;
        require_finite("wind_direction", settings.wind_direction)?;
        require_finite("amplitude", settings.amplitude)?;
        let shortest = f64::from(shortest_wave);
        require("shortest_wave", shortest, "finite and not negative", (0.0..f64::MAX).contains(&shortest))?;
        if let OceanSpectrum::Jonswap { fetch } = settings.spectrum {
            require_positive("fetch", fetch)?;
        }
        if let Some(seconds) = settings.loop_seconds {
            require_positive("loop_seconds", seconds)?;
        }
        let waves = (0..(resolution / 2 + 1) * resolution)
            .into_par_iter()
            .map(|i| settings.wave((i / resolution) as i32, signed(i % resolution, resolution)))
            .collect();
        let fft = FftPlanner::new().plan_fft_inverse(resolution);
        Ok(Self { settings, waves, fft })
    }

    /// What it was made from.
    pub fn settings(&self) -> &OceanSettings {
        &self.settings
    }

    /// The heights on the grid of the patch at a time: `resolution²` values, rows along x, repeating.
    pub fn patch(&self, time_seconds: f64) -> Vec<f32> {
        let n = self.settings.resolution;
        // Transform along z, column by column, of the half spectrum (the other half is its conjugate).
        let mut half = vec![Complex::default(); self.waves.len()];
        half.par_chunks_mut(n).zip(self.waves.par_chunks(n)).for_each(|(column, waves)| {
            for (value, wave) in column.iter_mut().zip(waves) {
                let angle = (f64::from(wave.angular_speed) * time_seconds).rem_euclid(TAU) as f32;
                let (sin, cos) = angle.sin_cos();
                let turn = Complex::new(cos, -sin);
                *value = wave.along * turn + wave.against * turn.conj();
            }
            self.fft.process(column);
        });
        // Along x, two rows at once: the transform of A + iB is a + ib if a and b are real.
        let mut patch = vec![0.0; n * n];
        patch.par_chunks_mut(2 * n).enumerate().for_each(|(pair, rows)| {
            let mut line = vec![Complex::default(); n];
            let i = Complex::new(0.0f32, 1.0);
            for k in 0..=n / 2 {
                let (a, b) = (half[k * n + 2 * pair], half[k * n + 2 * pair + 1]);
                line[k] = a + i * b;
                if k > 0 && k < n / 2 {
                    line[n - k] = a.conj() + i * b.conj();
                }
            }
            // What has no partner (mean and Nyquist) is its own conjugate: real.
            for k in [0, n / 2] {
                let (a, b) = (half[k * n + 2 * pair].re, half[k * n + 2 * pair + 1].re);
                line[k] = Complex::new(a, b);
            }
            self.fft.process(&mut line);
            let (first, second) = rows.split_at_mut(n);
            for (value, (a, b)) in line.iter().zip(first.iter_mut().zip(second)) {
                (*a, *b) = (value.re, value.im);
            }
        });
        patch
    }

    pub(super) fn fill(&self, grid: &Grid, time_seconds: f64, heights: &mut [f32]) {
        let n = self.settings.resolution;
        let patch = self.patch(time_seconds);
        let size = f64::from(self.settings.patch_size);
        let along_x: Vec<_> =
            (0..grid.columns).map(|column| Stencil::new(grid.x(column) / size, n)).collect();
        grid.rows_mut(heights, |_, z, line| {
            let stencil = Stencil::new(z / size, n);
            let mut blended = vec![0.0f32; n];
            for (weight, row) in stencil.weights.iter().zip(stencil.at) {
                for (sum, value) in blended.iter_mut().zip(&patch[row * n..]) {
                    *sum += weight * value;
                }
            }
            for (height, stencil) in line.iter_mut().zip(&along_x) {
                *height = (0..4).map(|tap| stencil.weights[tap] * blended[stencil.at[tap]]).sum();
            }
        });
    }
}

/// Four grid points around a place on the repeating grid, and their Catmull–Rom weights.
struct Stencil {
    at: [usize; 4],
    weights: [f32; 4],
}

impl Stencil {
    /// `place` in patches; 1 is the same as 0.
    fn new(place: f64, n: usize) -> Self {
        let position = (place - place.floor()) * n as f64;
        // A place that is a grid point but for rounding is that grid point.
        let nearest = position.round();
        let position = if (position - nearest).abs() < 1e-9 * n as f64 { nearest } else { position };
        let t = (position - position.floor()) as f32;
        let base = position as usize + n;
        let weights = [
            ((2.0 - t) * t - 1.0) * t * 0.5,
            ((3.0 * t - 5.0) * t * t + 2.0) * 0.5,
            ((4.0 - 3.0 * t) * t + 1.0) * t * 0.5,
            (t - 1.0) * t * t * 0.5,
        ];
        Self { at: [base - 1, base, base + 1, base + 2].map(|i| i % n), weights }
    }
}

/// Index of the transform → signed frequency; the Nyquist frequency counts as negative.
fn signed(index: usize, n: usize) -> i32 {
    if index < n / 2 { index as i32 } else { index as i32 - n as i32 }
}

impl OceanSettings {
    fn wave(&self, n: i32, m: i32) -> Wave {
        let half = (self.resolution / 2) as i32;
        let mut wave = Wave { along: Complex::default(), against: Complex::default(), angular_speed: 0.0 };
        // The mean is 0, and Nyquist frequencies have no partner: they would not be real.
        if (n, m) == (0, 0) || n.abs() == half || m.abs() == half {
            return wave;
        }
        let k = TAU / f64::from(self.patch_size) * f64::from(n).hypot(f64::from(m));
        let mut angular_speed = (GRAVITY * k).sqrt();
        if let Some(seconds) = self.loop_seconds {
            let base = TAU / f64::from(seconds);
            angular_speed = (angular_speed / base).round() * base;
        }
        wave.angular_speed = angular_speed as f32;
        wave.along = self.amplitude_at(n, m);
        wave.against = self.amplitude_at(-n, -m).conj();
        wave
    }

    /// h̃₀(k).
    fn amplitude_at(&self, n: i32, m: i32) -> Complex<f32> {
        let step = TAU / f64::from(self.patch_size);
        let density = self.density(step * f64::from(n), step * f64::from(m));
        let sigma = (0.25 * density).sqrt() * step * f64::from(self.amplitude);
        let uniform = |salt: i32| (f64::from(hash(n, m, salt, self.seed)) + 0.5) / 4_294_967_296.0;
        let radius = sigma * (-2.0 * uniform(1).ln()).sqrt();
        let (sin, cos) = (TAU * uniform(2)).sin_cos();
        Complex::new((radius * cos) as f32, (radius * sin) as f32)
    }

    /// Ψ(k) in m⁴: variance of the height per area of wave vectors.
    fn density(&self, kx: f64, kz: f64) -> f64 {
        let k = kx.hypot(kz);
        let (sin, cos) = f64::from(self.wind_direction).sin_cos();
        let cos_theta = (kx * cos + kz * sin) / k;
        if cos_theta <= 0.0 {
            return 0.0;
        }
        let speed = f64::from(self.wind_speed);
        // Omnidirectional spectrum in k: variance per rad/m.
        let along_k = match self.spectrum {
            OceanSpectrum::Phillips => {
                let longest = speed * speed / GRAVITY;
                0.5 * 0.0081 * k.powi(-3) * (-(k * longest).powi(-2)).exp()
            }
            OceanSpectrum::Jonswap { fetch } => {
                let fetch = f64::from(fetch);
                let alpha = 0.076 * (speed * speed / (fetch * GRAVITY)).powf(0.22);
                let peak = 22.0 * (GRAVITY * GRAVITY / (speed * fetch)).cbrt();
                let omega = (GRAVITY * k).sqrt();
                let width = if omega <= peak { 0.07 } else { 0.09 };
                let r = (-((omega - peak) / (width * peak)).powi(2) / 2.0).exp();
                let in_omega = alpha
                    * GRAVITY
                    * GRAVITY
                    * omega.powi(-5)
                    * (-1.25 * (peak / omega).powi(4)).exp()
                    * 3.3f64.powf(r);
                in_omega * 0.5 * (GRAVITY / k).sqrt()
            }
        };
        let shortest = f64::from(self.shortest_wave) / TAU;
        let fade = (-(k * shortest).powi(2)).exp();
        // Spread: ∫ (2/π) cos²θ dθ over the half circle is 1; dk = k dk dθ.
        along_k / k * (2.0 / PI) * cos_theta * cos_theta * fade
    }

    /// Extent of one whole patch about the origin, for as many posts as `resolution + 1` exact on the grid.
    pub fn extent(&self) -> (Vec2, Vec2) {
        (Vec2::splat(-0.5 * self.patch_size), Vec2::splat(0.5 * self.patch_size))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::procedural::ProceduralHeight;

    fn settings() -> OceanSettings {
        OceanSettings { resolution: 32, patch_size: 50.0, ..OceanSettings::default() }
    }

    #[test]
    fn the_transform_is_the_sum_of_waves() {
        let ocean = Ocean::new(settings()).unwrap();
        let time = 3.7;
        let patch = ocean.patch(time);
        let n = 32;
        for (x, z) in [(0usize, 0usize), (5, 9), (31, 2), (16, 17)] {
            let mut sum = 0.0;
            for p in -15i32..=15 {
                for q in -15i32..=15 {
                    if (p, q) == (0, 0) {
                        continue;
                    }
                    let h = ocean.settings.amplitude_at(p, q);
                    let k = TAU / 50.0 * f64::from(p).hypot(f64::from(q));
                    let phase = TAU * (f64::from(p) * x as f64 + f64::from(q) * z as f64) / n as f64
                        - (GRAVITY * k).sqrt() * time;
                    sum += 2.0 * (f64::from(h.re) * phase.cos() - f64::from(h.im) * phase.sin());
                }
            }
            assert!((f64::from(patch[z * n + x]) - sum).abs() < 1e-4, "{} {sum}", patch[z * n + x]);
        }
    }

    #[test]
    fn the_sea_tiles_and_loops() {
        let ocean = Ocean::new(OceanSettings { loop_seconds: Some(10.0), ..settings() }).unwrap();
        let height = ProceduralHeight::Ocean(Arc::new(ocean));
        let at = |min: f32, time| {
            height.evaluate(33, 33, Vec2::splat(min), Vec2::splat(min + 50.0), time).unwrap().heights
        };
        let close = |a: &[f32], b: &[f32]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 2e-4);
        let sea = at(-25.0, 2.0);
        assert!(close(&sea, &at(25.0, 2.0)));
        assert!(close(&sea, &at(-25.0, 12.0)));
        assert!(!close(&sea, &at(-25.0, 2.5)));
        assert!((0..33).all(|i| (sea[i * 33] - sea[i * 33 + 32]).abs() < 1e-4));
    }

    #[test]
    fn the_variance_of_a_sea_is_the_integral_of_its_frequency_spectrum() {
        let settings = OceanSettings {
            patch_size: 400.0,
            resolution: 256,
            wind_speed: 8.0,
            spectrum: OceanSpectrum::Jonswap { fetch: 20_000.0 },
            shortest_wave: 0.0,
            ..OceanSettings::default()
        };
        let mut variance = 0.0;
        for seed in 0..4 {
            let patch = Ocean::new(OceanSettings { seed, ..settings.clone() }).unwrap().patch(0.0);
            variance += patch.iter().map(|&h| f64::from(h).powi(2)).sum::<f64>() / patch.len() as f64 / 4.0;
        }
        // The JONSWAP spectrum as published, in ω, for U = 8 m/s and F = 20 km, up to the shortest wave of the grid.
        let alpha = 0.076 * (64.0f64 / (20_000.0 * GRAVITY)).powf(0.22);
        let peak = 22.0 * (GRAVITY * GRAVITY / (8.0 * 20_000.0)).cbrt();
        let density = |omega: f64| {
            let width = if omega <= peak { 0.07 } else { 0.09 };
            let enhancement = (-(omega - peak).powi(2) / (2.0 * width * width * peak * peak)).exp();
            alpha * GRAVITY.powi(2) / omega.powi(5)
                * (-1.25 * (peak / omega).powi(4)).exp()
                * 3.3f64.powf(enhancement)
        };
        let highest = (GRAVITY * TAU / 400.0 * 127.0).sqrt();
        let expected: f64 =
            (1..=4000).map(|i| density(highest * f64::from(i) / 4000.0) * highest / 4000.0).sum();
        assert!((variance / expected - 1.0).abs() < 0.15, "{variance} {expected}");
    }

    #[test]
    fn impossible_seas_are_errors() {
        assert!(Ocean::new(OceanSettings { resolution: 100, ..settings() }).is_err());
        assert!(Ocean::new(OceanSettings { patch_size: 0.0, ..settings() }).is_err());
        assert!(Ocean::new(OceanSettings { wind_speed: f32::NAN, ..settings() }).is_err());
    }
}
