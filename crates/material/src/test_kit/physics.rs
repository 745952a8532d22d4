//! Energy, reciprocity, and answers that are numbers.

use glam::{DVec3, Vec2, Vec3};

use super::statistics::Random;
use crate::bsdf::Bsdf;

/// What [`furnace`] found.
#[derive(Clone, Copy, Debug)]
pub struct Furnace {
    /// The part of a uniform light that is returned towards the view.
    pub albedo: Vec3,
    /// The standard error of `albedo`.
    pub standard_error: Vec3,
}

/// A view inside a furnace that shines uniformly: nothing can return more than one.
///
/// Inside media the uniform quantity is radiance over n²; `ior` is the index of the inside over the outside (one
/// for what is not a border of media), and light that has crossed is weighted by it.
pub fn furnace(bsdf: &Bsdf<'_>, wo: Vec3, ior: f32, samples: usize, seed: u64) -> Furnace {
    let mut random = Random::new(seed);
    let far_over_near = if wo.z >= 0.0 { ior } else { 1.0 / ior };
    let (mut sum, mut squares) = (DVec3::ZERO, DVec3::ZERO);
    for _ in 0..samples {
        let weight = bsdf.sample(wo, random.unit(), random.square()).map_or(Vec3::ZERO, |sample| {
            sample.weight * if sample.transmitted { far_over_near * far_over_near } else { 1.0 }
        });
        let weight = weight.as_dvec3();
        sum += weight;
        squares += weight * weight;
    }
    let n = samples.max(1) as f64;
    let mean = sum / n;
    let variance = (squares / n - mean * mean).max(DVec3::ZERO);
    let error = DVec3::new(variance.x.sqrt(), variance.y.sqrt(), variance.z.sqrt()) / n.sqrt();
    Furnace { albedo: mean.as_vec3(), standard_error: error.as_vec3() }
}

/// The largest relative difference between light going one way and the other, over random pairs of directions:
/// f(ω_i → ω_o) / n_o² = f(ω_o → ω_i) / n_i², n the index on each direction's side.
pub fn reciprocity_error(bsdf: &Bsdf<'_>, ior: f32, pairs: usize, seed: u64) -> f64 {
    let mut random = Random::new(seed);
    let index2 = |v: Vec3| if v.z > 0.0 { 1.0 } else { f64::from(ior).powi(2) };
    let mut largest = 0.0f64;
    for pair in 0..pairs {
        let wo = random.direction();
        // Half of the pairs go where the sampler looks: into the lobe.
        let wi = match bsdf.sample(wo, random.unit(), random.square()) {
            Some(sample) if pair % 2 == 0 => sample.wi,
            _ => random.direction(),
        };
        // Grazing pairs are dominated by the rounding of their cosines.
        if wo.z.abs() < 0.02 || wi.z.abs() < 0.02 {
            continue;
        }
        let one = bsdf.eval(wo, wi).as_dvec3() / (f64::from(wi.z.abs()) * index2(wo));
        let other = bsdf.eval(wi, wo).as_dvec3() / (f64::from(wo.z.abs()) * index2(wi));
        let scale = one.abs().max(other.abs()).max_element().max(1e-4);
        largest = largest.max((one - other).abs().max_element() / scale);
    }
    largest
}

/// Asks for random directions and random numbers, and for degenerate ones: in the surface, along the normal, from
/// behind, equal and opposite, at the ends of the unit interval.
///
/// # Errors
/// The first answer that is not finite, is negative, is no unit vector, or has no density.
pub fn never_breaks(bsdf: &Bsdf<'_>, rounds: usize, seed: u64) -> Result<(), String> {
    let mut random = Random::new(seed);
    let almost_one = 1.0 - f32::EPSILON / 2.0;
    let ends = [0.0, almost_one, 0.5, 1e-7];
    for round in 0..rounds {
        let wo = awkward(&mut random, Vec3::Z);
        let wi = awkward(&mut random, wo);
        let (value, pdf) = bsdf.eval_pdf(wo, wi);
        let alone = bsdf.eval(wo, wi);
        let good = |v: Vec3| v.is_finite() && v.min_element() >= 0.0;
        if !good(value) || !good(alone) || !pdf.is_finite() || pdf < 0.0 {
            return Err(format!("wo {wo}, wi {wi}: value {value} or {alone}, density {pdf}"));
        }
        let mut number = |i: usize| if round % 4 == 0 { ends[(round / 4 + i) % 4] } else { random.unit() };
        let (u_lobe, u) = (number(round / 16), Vec2::new(number(round / 64), number(round / 256)));
        if let Some(sample) = bsdf.sample(wo, u_lobe, u) {
            let unit = (sample.wi.length() - 1.0).abs() < 1e-3;
            if !good(sample.weight) || !sample.pdf.is_finite() || sample.pdf <= 0.0 || !unit {
                return Err(format!("wo {wo}, u {u_lobe} {u}: {sample:?}"));
            }
            if sample.transmitted != (sample.wi.z * wo.z < 0.0) {
                return Err(format!("wo {wo}, u {u_lobe} {u}: the sample is on the wrong side: {sample:?}"));
            }
        }
    }
    Ok(())
}

/// A direction, often a degenerate one.
fn awkward(random: &mut Random, other: Vec3) -> Vec3 {
    let direction = random.direction();
    let grazing = |z: f32| direction.truncate().normalize_or(Vec2::X).extend(z);
    match random.bits() % 12 {
        0 => Vec3::Z,
        1 => -Vec3::Z,
        2 => grazing(0.0),
        3 => grazing(1e-7),
        4 => grazing(-1e-20),
        5 => grazing(1e-30),
        6 => other,
        7 => -other,
        8 => Vec3::new(-other.x, -other.y, other.z),
        9 => (other + direction * 1e-4).normalize_or(Vec3::Z),
        _ => direction,
    }
}
