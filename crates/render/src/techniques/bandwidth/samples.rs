//! Importance samples of a material, made beforehand, and the loop that reflects many of them at once.
//!
//! A sample is kept as its half vector h: for the view ω the direction is 2 (ω·h) h − ω with the density p_h/(4 ω·h); what is
//! stored for density has that factor in it. A lobe turns twice as fast as the view, a half vector hardly at all, so a table
//! of views 2.8° apart serves mirrors' neighbours too. The reflectance of each part of the material over the density is that
//! of the table's view; what a view between two of the table reflects in all is interpolated ([`HalfSamples::albedo`]).
//!
//! Source: `[001]` §3.3 (vectors of precomputed samples; half vectors are ours). Cost: 2 ns a sample in lanes.

use std::f32::consts::{FRAC_2_PI, FRAC_PI_2};

use glam::Vec3;
use halflight_frequency::bandwidth::lobe::phong_exponent;
use halflight_frequency::importance::{ImportanceTable, TableSize};
use halflight_frequency::reflectance::ReflectanceBandwidth;
use halflight_trace::Kernel;
use rayon::prelude::*;

use super::parts::{Parts, Shares};

/// Elevations of the view.
pub(super) const ELEVATIONS: usize = 32;
/// Samples of a view, of which runs of any length are taken.
pub(super) const MOST_SAMPLES: usize = 4096;
const VECTORS: usize = 4;
/// Runs among which places choose: few enough that those of short runs stay in the cache.
const RUNS: usize = 8;
/// Samples that are looked at together.
pub(super) const LANES: usize = 64;
/// By how much the exponent of what light is convolved with is at least larger than that of the material's own lobe.
const NARROWER: f32 = 2.0;
/// Samples by which runs grow.
pub(super) const GROUP: usize = 16;

/// The samples of all views of one material, each for a view in the xz-plane.
pub(super) struct HalfSamples {
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
    /// Density of the direction times the cosine between half vector and view, per steradian.
    density: Vec<f32>,
    /// The exponent of the Phong lobe that varies as the reflectance does there.
    exponent: Vec<f32>,
    /// Reflectance over density, without the cosine, at the view of the table; by part.
    weights: [Vec<[f32; 4]>; 2],
    /// What each view of the table reflects of light that is the same from everywhere; by part.
    albedo: Vec<Shares>,
}

/// Samples next to each other in a table.
#[derive(Clone, Copy)]
pub(super) struct Run {
    pub(super) start: usize,
    pub(super) number: usize,
}

/// The middle of an elevation of the tables.
pub(super) fn table_view(elevation: usize) -> Vec3 {
    let theta = (elevation as f32 + 0.5) / ELEVATIONS as f32 * FRAC_PI_2;
    Vec3::new(theta.sin(), 0.0, theta.cos())
}

/// The elevation of the tables that a view in the local frame belongs to.
#[inline]
pub(super) fn elevation(cosine: f32) -> usize {
    let share = cosine.clamp(0.0, 1.0).acos() * FRAC_2_PI;
    ((share * ELEVATIONS as f32) as usize).min(ELEVATIONS - 1)
}

/// The elevation of the tables below a view and how far it lies towards the one above.
#[inline]
pub(super) fn elevations(cosine: f32) -> (usize, f32) {
    let at = (cosine.clamp(0.0, 1.0).acos() * FRAC_2_PI * ELEVATIONS as f32 - 0.5)
        .clamp(0.0, (ELEVATIONS - 1) as f32);
    let below = (at as usize).min(ELEVATIONS - 2);
    (below, at - below as f32)
}

/// `number` samples for a view at this elevation; `which` chooses among runs of them. A run begins at a multiple of the power
/// of two that holds it, so that it is as well distributed as the sequence allows.
#[inline]
pub(super) fn run(elevation: usize, number: usize, which: u32) -> Run {
    let number = number.clamp(1, MOST_SAMPLES);
    let block = number.next_power_of_two();
    let start = elevation * MOST_SAMPLES + (which as usize % RUNS.min(MOST_SAMPLES / block)) * block;
    Run { start, number }
}

impl HalfSamples {
    /// Samples that follow `density(view, light)`, the reflectance with the colours that it has in the mean, say; the weights
    /// are those of its parts.
    pub(super) fn new(
        density: impl Fn(Vec3, Vec3) -> f32 + Sync,
        parts: &Parts,
        bandwidth: &ReflectanceBandwidth,
    ) -> Self {
        let size = TableSize {
            elevations: ELEVATIONS,
            azimuths: 1,
            vectors: VECTORS,
            samples: MOST_SAMPLES / VECTORS,
            ..TableSize::default()
        };
        let table = ImportanceTable::new(density, size);
        let number = ELEVATIONS * MOST_SAMPLES;
        let scattering = parts.bsdfs();
        let finite = |w: Vec3| if w.is_finite() { w.extend(0.0).to_array() } else { [0.0; 4] };
        let of_view = |e: usize| {
            let view = table_view(e);
            let mut sum = [Vec3::ZERO; 2];
            let mut found = Vec::with_capacity(MOST_SAMPLES);
            for vector in 0..VECTORS {
                for sample in table.vector(view, vector).samples {
                    let half = (sample.direction + view).normalize_or(Vec3::Z);
                    let along = half.dot(view);
                    let density = sample.pdf * along;
                    let cosine = sample.direction.z;
                    let values = scattering.eval(view, sample.direction);
                    let weights = values.map(|value| finite(value / (cosine * density)));
                    for (sum, weight) in sum.iter_mut().zip(weights) {
                        *sum += Vec3::new(weight[0], weight[1], weight[2]) * (along * cosine);
                    }
                    let exponent = phong_exponent(bandwidth.at(sample.direction, view));
                    found.push((half, density, exponent, weights));
                }
            }
            (found, sum.map(|s| s / MOST_SAMPLES as f32))
        };
        let views: Vec<_> = (0..ELEVATIONS).into_par_iter().map(of_view).collect();
        // Loops in lanes read beyond the end of a run.
        let room = || Vec::with_capacity(number + LANES);
        let mut all = Self {
            x: room(),
            y: room(),
            z: room(),
            density: room(),
            exponent: room(),
            weights: [Vec::with_capacity(number), Vec::new()],
            albedo: Vec::with_capacity(ELEVATIONS),
        };
        for (samples, albedo) in views {
            for (half, density, exponent, weights) in samples {
                all.x.push(half.x);
                all.y.push(half.y);
                all.z.push(half.z);
                all.density.push(density);
                all.exponent.push(exponent);
                all.weights[0].push(weights[0]);
                if parts.is_double() {
                    all.weights[1].push(weights[1]);
                }
            }
            all.albedo.push(albedo);
        }
        for list in [&mut all.x, &mut all.y, &mut all.z, &mut all.density, &mut all.exponent] {
            list.resize(number + LANES, 1.0);
        }
        all
    }

    /// All numbers, of a single part: x, y, z, density and exponent of the samples, then the weights, then the albedos.
    pub(super) fn numbers(&self) -> Vec<f32> {
        let number = ELEVATIONS * MOST_SAMPLES;
        let lists = [&self.x, &self.y, &self.z, &self.density, &self.exponent];
        let mut numbers = Vec::with_capacity(Self::NUMBERS);
        lists.iter().for_each(|list| numbers.extend(&list[..number]));
        numbers.extend(self.weights[0].iter().flatten());
        numbers.extend(self.albedo.iter().flat_map(|shares| shares[0].to_array()));
        numbers
    }

    /// How many numbers there are.
    pub(super) const NUMBERS: usize = ELEVATIONS * (9 * MOST_SAMPLES + 3);

    /// Samples of these numbers; `None` if there are more or fewer, or one of them cannot be.
    pub(super) fn from_numbers(numbers: &[f32]) -> Option<Self> {
        if numbers.len() != Self::NUMBERS || !numbers.iter().all(|x| x.is_finite()) {
            return None;
        }
        let number = ELEVATIONS * MOST_SAMPLES;
        let list = |i: usize| {
            let mut list = Vec::with_capacity(number + LANES);
            list.extend_from_slice(&numbers[i * number..(i + 1) * number]);
            list.resize(number + LANES, 1.0);
            list
        };
        let (weights, albedo) = numbers[5 * number..].split_at(4 * number);
        let albedo = albedo.chunks_exact(3).map(|a| [Vec3::from_slice(a), Vec3::ZERO]).collect();
        let weights: Vec<[f32; 4]> = weights.chunks_exact(4).map(|w| [w[0], w[1], w[2], w[3]]).collect();
        let samples = Self {
            x: list(0),
            y: list(1),
            z: list(2),
            density: list(3),
            exponent: list(4),
            weights: [weights, Vec::new()],
            albedo,
        };
        let is_sound = |i: usize| {
            let (half, density) = samples.half(i);
            (half.length_squared() - 1.0).abs() < 1e-3 && density > 0.0 && samples.exponent[i] >= 0.0
        };
        (0..number).all(is_sound).then_some(samples)
    }

    /// Half vector and density times its cosine of sample `i`.
    pub(super) fn half(&self, i: usize) -> (Vec3, f32) {
        (Vec3::new(self.x[i], self.y[i], self.z[i]), self.density[i])
    }

    /// What a view between the elevation `below` and the next reflects, over what the table's view `used` does; by part.
    #[inline]
    pub(super) fn albedo(&self, below: usize, share: f32, used: usize) -> Shares {
        let ratio = |part: usize| {
            let between = self.albedo[below][part].lerp(self.albedo[below + 1][part], share);
            let ratio = between / self.albedo[used][part];
            // Nothing reflects, or what a part adds changes its sign: as it is.
            let usual = |r: f32| if r > 0.25 && r < 4.0 { r } else { 1.0 };
            Vec3::new(usual(ratio.x), usual(ratio.y), usual(ratio.z))
        };
        [ratio(0), ratio(1)]
    }

    /// The weights of the samples from `start` on, by part; none for a part that there is not.
    #[inline]
    pub(super) fn weights(&self, start: usize, number: usize) -> [&[[f32; 4]]; 2] {
        let [first, second] = &self.weights;
        let second: &[[f32; 4]] = if second.is_empty() { second } else { &second[start..start + number] };
        [&first[start..start + number], second]
    }

    /// Bytes that it occupies.
    pub(super) fn memory_bytes(&self) -> usize {
        5 * size_of_val(self.x.as_slice())
            + self.weights.iter().map(|w| size_of_val(w.as_slice())).sum::<usize>()
    }
}

/// Directions by reflection at samples, up to [`LANES`] of them.
#[derive(Clone, Debug)]
pub(super) struct Reflected {
    /// Unit directions in the space of the axes.
    pub(super) x: [f32; LANES],
    pub(super) y: [f32; LANES],
    pub(super) z: [f32; LANES],
    /// What the weights of a sample are multiplied by; zero where it leaves by the wrong side.
    pub(super) scale: [f32; LANES],
    /// The exponent of the lobe by which light is convolved.
    pub(super) exponent: [f32; LANES],
}

impl Default for Reflected {
    fn default() -> Self {
        let none = [0.0; LANES];
        Self { x: none, y: none, z: none, scale: none, exponent: none }
    }
}

/// Reflects a view at the samples from `start` on, `number` of them.
pub(super) struct Reflect<'a> {
    pub(super) samples: &'a HalfSamples,
    pub(super) start: usize,
    pub(super) number: usize,
    /// Sine and cosine of the view's elevation.
    pub(super) view: [f32; 2],
    /// The axes of the surface with the view in the plane of the first and third, and the normal of the geometry; all in the
    /// space in which directions are wanted.
    pub(super) axes: [Vec3; 3],
    pub(super) front: Vec3,
    /// 4π N/overlap: the exponent of a lobe as wide as a gap, by the density.
    pub(super) gap: f32,
    pub(super) out: &'a mut Reflected,
}

impl Kernel for Reflect<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self { samples, start, number, view: [vx, vz], axes: [ax, ay, az], front, gap, out } = self;
        let number = number.next_multiple_of(GROUP).min(LANES);
        let (hx, hy, hz) = (
            &samples.x[start..start + number],
            &samples.y[start..start + number],
            &samples.z[start..start + number],
        );
        let density = &samples.density[start..start + number];
        let exponent = &samples.exponent[start..start + number];
        let (ox, oy, oz) = (&mut out.x[..number], &mut out.y[..number], &mut out.z[..number]);
        let (scale, blurred) = (&mut out.scale[..number], &mut out.exponent[..number]);
        for i in 0..number {
            let along = vx * hx[i] + vz * hz[i];
            let twice = 2.0 * along;
            let (lx, ly, lz) = (twice * hx[i] - vx, twice * hy[i], twice * hz[i] - vz);
            let x = lx * ax.x + ly * ay.x + lz * az.x;
            let y = lx * ax.y + ly * ay.y + lz * az.y;
            let z = lx * ax.z + ly * ay.z + lz * az.z;
            let leaves = x * front.x + y * front.y + z * front.z;
            let is_out = (along > 0.0) & (lz > 0.0) & (leaves > 0.0);
            (ox[i], oy[i], oz[i]) = (x, y, z);
            scale[i] = if is_out { along * lz } else { 0.0 };
            blurred[i] = (gap * density[i] / along).max(NARROWER * exponent[i]);
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec2;
    use halflight_material::{Material, SurfaceInput};
    use halflight_scene::lights::luminance;
    use halflight_trace::Simd;

    use super::super::parts::Split;
    use super::*;

    #[test]
    fn many_samples_are_reflected_as_one_is() {
        let material = Material::phong(Vec3::splat(0.2), Vec3::splat(0.6), 200.0);
        let bsdf = material.bsdf(&SurfaceInput::default());
        let parts = Split::new(&material, &material).parts;
        let density = |view, light| luminance(bsdf.eval(view, light));
        let samples = HalfSamples::new(density, &parts, &ReflectanceBandwidth::constant(2.0));
        let (theta, number) = (0.6f32, 51);
        let view = Vec3::new(theta.sin(), 0.0, theta.cos());
        let (x, y) = Vec3::new(0.1, 0.9, -0.3).normalize().any_orthonormal_pair();
        let axes = [x, y, x.cross(y)];
        let front = (axes[2] + 0.3 * axes[0]).normalize();
        let gap = 10.0;
        let (below, share) = elevations(view.z);
        assert!(below < ELEVATIONS && (0.0..=1.0).contains(&share));
        let run = run(below, number, 5);
        for simd in [Simd::Baseline, Simd::Avx2, Simd::Avx512] {
            let mut out = Reflected::default();
            simd.run(Reflect {
                samples: &samples,
                start: run.start,
                number: run.number,
                view: [view.x, view.z],
                axes,
                front,
                gap,
                out: &mut out,
            });
            for i in 0..number {
                let (half, density) = samples.half(run.start + i);
                let along = half.dot(view);
                let local = 2.0 * along * half - view;
                let world = local.x * axes[0] + local.y * axes[1] + local.z * axes[2];
                let found = Vec3::new(out.x[i], out.y[i], out.z[i]);
                assert!(found.distance(world) < 1e-5, "{simd:?} {i}: {found} {world}");
                let open = along > 0.0 && local.z > 0.0 && front.dot(world) > 0.0;
                assert_eq!(out.scale[i] > 0.0, open, "{simd:?} {i}");
                if open {
                    // The weights are those of the reflectance over the density, at about this view.
                    let [weights, _] = samples.weights(run.start + i, 1);
                    let exact = bsdf.eval(
                        table_view(below),
                        2.0 * half.dot(table_view(below)) * half - table_view(below),
                    );
                    let z = (2.0 * half.dot(table_view(below)) * half - table_view(below)).z;
                    let whole = weights[0][0] * 0.2 + samples.weights(run.start + i, 1)[1][0][0] * 0.6;
                    assert!((whole * z * density - exact.x).abs() <= 1e-3 * exact.x.max(1e-3), "{i}");
                }
            }
        }
        // Under light that is the same from everywhere a view between two of the table reflects what lies between.
        let [lower, upper] = [below, below + 1].map(|e| samples.albedo(below, share, e)[0].x);
        assert!((0.5..2.0).contains(&lower) && (0.5..2.0).contains(&upper), "{lower} {upper}");
        assert_eq!(Vec2::new(samples.albedo(below, 0.0, below)[0].x, 1.0), Vec2::ONE);
    }
}
