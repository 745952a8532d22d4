//! Two materials on one surface, a mask telling how much of which: f = (1 − m) f₀ + m f₁.
//!
//! Sampled as a mixture: part i is chosen with q_i ∝ m_i (0.1 + luminance of its albedo), m_0 = 1 − m and m_1 = m, and draws
//! the direction; the density is Σ q_i p_i, so that no weight is more than 11 times what the parts' own would be. Parts may
//! be mixes themselves, and anything else: a mirror's direction stays a delta function, with its probability of being
//! chosen. What is asked of a mix asks the parts that have a share, which look their own pictures up.

use glam::{Vec2, Vec3};

use crate::bsdf::{Bsdf, BsdfSample};
use crate::input::SurfaceInput;
use crate::material::Material;
use crate::sampling::luminance;

/// The least that a part counts for when one is chosen, beside its albedo.
const LEAST: f32 = 0.1;

/// A place of a mix where both parts have a share.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mix<'a> {
    parts: &'a [Material; 2],
    input: SurfaceInput,
    /// The share of the second, strictly between 0 and 1.
    mask: f32,
}

impl<'a> Mix<'a> {
    pub(crate) fn new(parts: &'a [Material; 2], input: SurfaceInput, mask: f32) -> Self {
        Self { parts, input, mask }
    }

    /// Both parts with their shares; seen from behind only if the mix is, too.
    #[inline]
    pub(crate) fn parts(&self, two_sided: bool) -> [(f32, Bsdf<'a>); 2] {
        let part = |i: usize| self.parts[i].bsdf(&self.input).turned_away_unless(two_sided);
        [(1.0 - self.mask, part(0)), (self.mask, part(1))]
    }

    #[inline(never)]
    pub(crate) fn eval(&self, two_sided: bool, wo: Vec3, wi: Vec3) -> Vec3 {
        self.parts(two_sided).into_iter().map(|(share, part)| share * part.eval(wo, wi)).sum()
    }

    #[inline(never)]
    pub(crate) fn eval_pdf(&self, two_sided: bool, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        let parts = self.parts(two_sided);
        together(&parts, chances(&parts), wo, wi)
    }

    #[inline(never)]
    pub(crate) fn sample(&self, two_sided: bool, wo: Vec3, u_lobe: f32, u: Vec2) -> Option<BsdfSample> {
        let parts = self.parts(two_sided);
        let chances = chances(&parts);
        let below = 1.0 - f32::EPSILON;
        let (i, u_lobe) = if u_lobe < chances[0] {
            (0, (u_lobe / chances[0]).min(below))
        } else {
            (1, ((u_lobe - chances[0]) / chances[1]).clamp(0.0, below))
        };
        let (share, part) = &parts[i];
        let sample = part.sample(wo, u_lobe, u)?;
        if sample.delta {
            let weight = sample.weight * (share / chances[i]);
            return Some(BsdfSample { weight, pdf: sample.pdf * chances[i], ..sample });
        }
        let (value, pdf) = together(&parts, chances, wo, sample.wi);
        (pdf > 0.0).then(|| BsdfSample { weight: value / pdf, pdf, ..sample })
    }
}

/// With which probability each part is chosen.
#[inline]
fn chances(parts: &[(f32, Bsdf<'_>); 2]) -> [f32; 2] {
    let weight = |(share, part): &(f32, Bsdf<'_>)| share * (LEAST + luminance(part.albedo()).clamp(0.0, 1.0));
    let [first, second] = [weight(&parts[0]), weight(&parts[1])];
    let chance = first / (first + second);
    // Both sums are at least a tenth of the shares, which add to one.
    [chance, 1.0 - chance]
}

#[inline]
fn together(parts: &[(f32, Bsdf<'_>); 2], chances: [f32; 2], wo: Vec3, wi: Vec3) -> (Vec3, f32) {
    let mut sum = (Vec3::ZERO, 0.0);
    for ((share, part), chance) in parts.iter().zip(chances) {
        let (value, pdf) = part.eval_pdf(wo, wi);
        sum.0 += *share * value;
        sum.1 += chance * pdf;
    }
    sum
}
