//! Do directions come as often as the density says?

use std::fmt;

use glam::{Vec2, Vec3};

use super::partition::Partition;
use super::statistics::{Random, chi_square_p_value, sidak_threshold};
use crate::bsdf::Bsdf;

/// How [`chi_square`] tests.
#[derive(Clone, Copy, Debug)]
pub struct ChiSquare {
    /// Samples that are counted. More see smaller errors.
    pub samples: usize,
    /// The bins of each hemisphere are 2 to this power.
    pub depth: usize,
    /// How many tests share the significance (Šidák's correction).
    pub tests: usize,
    /// The probability that any of them fails by chance.
    pub significance: f64,
    /// Where randomness comes from.
    pub seed: u64,
}

impl Default for ChiSquare {
    fn default() -> Self {
        Self { samples: 40_000, depth: 6, tests: 1, significance: 0.01, seed: 1 }
    }
}

/// What [`chi_square`] found.
#[derive(Clone, Copy, Debug)]
pub struct ChiSquareReport {
    /// Σ (count − expected)² / expected over bins.
    pub statistic: f64,
    /// Degrees of freedom.
    pub degrees: usize,
    /// The probability of a statistic this large were sampler and density in agreement.
    pub p_value: f64,
    /// What `p_value` has to exceed.
    pub threshold: f64,
    /// The integral of the density over the sphere: at most one; what is missing goes to delta lobes or is lost.
    pub integral: f64,
    /// The largest relative difference between the density or value a sample carries and the one evaluated for its
    /// direction, leaving out the thousandth of the samples for which it is largest (roundings at borders).
    pub mismatch: f64,
    /// How much mismatch is allowed: what the rounding of f32 directions does to narrow lobes.
    pub allowed_mismatch: f64,
}

impl ChiSquareReport {
    /// Whether the sampler, its density and its values agree.
    pub fn passes(&self) -> bool {
        self.p_value > self.threshold && self.integral < 1.005 && self.mismatch < self.allowed_mismatch
    }
}

impl fmt::Display for ChiSquareReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "chi-square {:.1} with {} degrees of freedom: p = {:.3e} (has to exceed {:.3e}); the density integrates \
             to {:.5}; samples and density differ by a part of {:.2e} (allowed {:.2e})",
            self.statistic,
            self.degrees,
            self.p_value,
            self.threshold,
            self.integral,
            self.mismatch,
            self.allowed_mismatch
        )
    }
}

/// Counts samples over the sphere against the integrated density, and compares each sample's density and weight
/// with what is evaluated for its direction. Delta lobes are counted as one bin, with samples that are lost.
pub fn chi_square(bsdf: &Bsdf<'_>, wo: Vec3, settings: &ChiSquare) -> ChiSquareReport {
    let mut mismatches = Vec::new();
    let mut largest = 0f32;
    let sampler = |u_lobe: f32, u: Vec2| {
        let sample = bsdf.sample(wo, u_lobe, u).filter(|sample| !sample.delta)?;
        let (value, pdf) = bsdf.eval_pdf(wo, sample.wi);
        let relative = |a: f32, b: f32| f64::from((a - b).abs() / a.abs().max(b.abs()).max(1e-6));
        let carried = sample.weight.max_element() * sample.pdf;
        mismatches.push(relative(sample.pdf, pdf).max(relative(carried, value.max_element())));
        largest = largest.max(pdf);
        Some(sample.wi)
    };
    let mut report = chi_square_of(sampler, |wi| bsdf.pdf(wo, wi), settings);
    mismatches.sort_unstable_by(f64::total_cmp);
    let trimmed = mismatches.len().saturating_sub(1 + mismatches.len() / 1000);
    report.mismatch = mismatches.get(trimmed).copied().unwrap_or(0.0);
    // The rounding of a direction (6e-8), through the half vector, changes the density of a lobe of width w by a
    // part of some 6e-8/w; a density of p has w ≈ p^-½.
    report.allowed_mismatch = 2e-3 + 1e-5 * f64::from(largest).sqrt();
    report
}

/// The same for any sampler of directions and its density per solid angle: lights, lenses, your own.
///
/// `sampler` takes three uniform numbers and gives a direction, or nothing; `density` has to integrate to the
/// probability that it gives one.
pub fn chi_square_of(
    mut sampler: impl FnMut(f32, Vec2) -> Option<Vec3>,
    density: impl Fn(Vec3) -> f32,
    settings: &ChiSquare,
) -> ChiSquareReport {
    let mut random = Random::new(settings.seed);
    let mut draw = || sampler(random.unit(), random.square());
    let draws = TRAINING_PER_BIN << settings.depth;
    let training: Vec<Vec3> = (0..draws).filter_map(|_| draw()).collect();
    let partition = Partition::new(&training, settings.depth);
    let mut counts = vec![0usize; partition.bins.len()];
    let mut lost = 0usize;
    for _ in 0..settings.samples {
        match draw() {
            Some(wi) => counts[partition.find(wi)] += 1,
            None => lost += 1,
        }
    }
    // An error of a thirtieth of a standard deviation in the expectation of a bin changes nothing.
    let total = settings.samples as f64;
    let tolerance = 0.03 / (partition.bins.len() as f64 * total).sqrt();
    let density = |wi: Vec3| f64::from(density(wi));
    let masses: Vec<(f64, f64)> =
        partition.bins.iter().map(|bin| bin.integrate(&density, tolerance)).collect();
    let integral: f64 = masses.iter().map(|(mass, _)| mass).sum();
    let uncertain: f64 = masses.iter().map(|(_, error)| error).sum();
    let mut pairs: Vec<(f64, f64)> =
        masses.iter().zip(&counts).map(|(&(mass, _), &count)| (mass * total, count as f64)).collect();
    // What is lost has no noise of its own when it is rare: it may be anything that the integrals leave open.
    let (least, most) = ((1.0 - integral - uncertain) * total, (1.0 - integral + uncertain) * total);
    pairs.push(((lost as f64).clamp(least, most).max(0.0), lost as f64));
    let (statistic, degrees) = pooled_statistic(pairs);
    ChiSquareReport {
        statistic,
        degrees,
        p_value: chi_square_p_value(statistic, degrees),
        threshold: sidak_threshold(settings.significance, settings.tests),
        integral,
        mismatch: 0.0,
        allowed_mismatch: 1.0,
    }
}

/// Samples that shape a bin and watch over its integral.
const TRAINING_PER_BIN: usize = 400;

/// Pools bins until each expects five, the usual condition for the distribution to hold.
fn pooled_statistic(mut pairs: Vec<(f64, f64)>) -> (f64, usize) {
    pairs.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let (mut statistic, mut bins) = (0.0, 0usize);
    let mut pool = (0.0, 0.0);
    for (expected, count) in pairs {
        pool = (pool.0 + expected, pool.1 + count);
        if pool.0 >= 5.0 {
            statistic += (pool.1 - pool.0) * (pool.1 - pool.0) / pool.0;
            bins += 1;
            pool = (0.0, 0.0);
        }
    }
    // Samples where none can be: a rounding or two is forgiven by the half, more is not.
    if pool.1 > 0.0 {
        statistic += (pool.1 - pool.0) * (pool.1 - pool.0) / pool.0.max(0.5);
        bins += 1;
    }
    (statistic, bins.saturating_sub(1).max(1))
}
