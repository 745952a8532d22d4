//! Sampling a measured lobe by its numerically inverted cumulative distribution.
//!
//! For a view at θ_o the lobe f(ω_o, ω_i) cos θ_i is tabulated over the **half vector**, as a density that is
//! constant per solid angle within the cells of a grid of √θ_h (the 90 rings of the data itself, so that a highlight
//! a hundredth of a degree wide is as well resolved as a matt one) and φ_h from the plane of the view. With
//! p(h) = mass of the cell / its solid angle,
//!
//!   p(ω_i) = c · cos θ_i / π + (1 − c) · p(h) / (4 ω_o·h),   c = 0.1,
//!
//! which bounds every weight by 10 π f. Between two tabulated views the table is chosen at random in proportion to
//! nearness, and the density is the same mixture: what is sampled and what is said agree exactly. Half vectors that
//! would send light below the surface are lost (they carry density, but no light).
//!
//! Relative variance of the weights (green, view at 5° / 31° / 61° / 75°), this against cosine sampling, for the
//! published neural fits of five MERL materials, printed by `cargo test -p halflight-material --test
//! measured_sampling -- --nocapture`:
//!
//! | NBRDF fit of | this | cosine |
//! |---|---|---|
//! | blue-rubber | 0.002 / 0.005 / 0.017 / 0.027 | 0.005 / 0.03 / 0.9 / 10 |
//! | gold-paint | 0.008 / 0.012 / 0.019 / 0.024 | 0.5 / 0.6 / 1.7 / 8.5 |
//! | color-changing-paint3 | 0.026 / 0.043 / 0.069 / 0.079 | 18 / 23 / 190 / 830 |
//! | red-metallic-paint | 0.065 / 0.072 / 0.14 / 0.18 | 430 / 140 / 1200 / 1000 |
//! | chrome | 0.084 / 0.088 / 0.094 / 0.097 | 4300 / 2600 / 5700 / 7100 |
//!
//! No weight exceeded 1.5. The tables take 1.1 MB and a tenth of a second to build. The ring of a random number is
//! found from a guide (where to begin, for each 1/256 of the unit interval), the cell around from where it would be
//! were the lobe round: both then walk a step or two.
//!
//! Source: numerically inverted distributions of half vectors as in Lawrence, Rusinkiewicz & Ramamoorthi 2004,
//! tabulated instead of factored.

use std::f32::consts::{FRAC_2_PI, TAU};
use std::f64::consts::{FRAC_PI_2, TAU as TAU64};

use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;

use super::coordinates::{Coordinates, arc};
use super::grid::{THETA_H, theta_h_at};
use super::lookup::Table;
use crate::sampling::{cosine_hemisphere, cosine_pdf, reflect};

/// Views are tabulated at every second degree; half vectors see a lobe change slowly with the view.
const VIEWS: usize = 46;
/// Cells around: half vectors see the lobe nearly round, and what is left varies slowly.
const PHI_H: usize = 32;
/// Points per cell and axis at build time.
const POINTS: usize = 2;
/// The share of samples that follow the cosine.
const COSINE_SHARE: f32 = 0.1;
/// The last view stands a little above the horizon, where nothing is visible any more.
const LAST_VIEW: f64 = 89.5 / 90.0 * FRAC_PI_2;

/// Entries of a guide.
const GUIDE: usize = 256;

const CONDITIONALS: usize = PHI_H + 1;
const MARGINAL: usize = THETA_H + 1;
const VIEW_FLOATS: usize = MARGINAL + THETA_H * CONDITIONALS;

/// Cumulative distributions of half vectors, one for each tabulated view.
#[derive(Debug)]
pub(crate) struct LobeTable {
    /// For each view: the cumulative share of rings, then for each ring the cumulative share of its cells.
    /// A view that sees nothing has zeros only.
    cumulative: Vec<f32>,
    /// Half vectors per steradian: for each ring, cell around and view, so that two neighbouring views lie together.
    densities: Vec<f32>,
    /// Whether a view sees anything.
    seen: [bool; VIEWS],
    /// For each view: the first ring that a random number from i / GUIDE on can fall into.
    guides: Vec<[u8; GUIDE]>,
    /// 1 − cos θ_h at the borders of rings.
    versine: [f32; MARGINAL],
    albedo: [Vec3; VIEWS],
}

impl LobeTable {
    pub(crate) fn build(table: &Table) -> Self {
        let versine64: [f64; MARGINAL] = std::array::from_fn(|i| versine(theta_h_at(i as f64)));
        let cell = |ring: usize| (versine64[ring + 1] - versine64[ring]) * TAU64 / PHI_H as f64;
        let mut cumulative = vec![0f32; VIEWS * VIEW_FLOATS];
        let mut albedo = [Vec3::ZERO; VIEWS];
        cumulative.par_chunks_mut(VIEW_FLOATS).zip(&mut albedo[..]).enumerate().for_each(
            |(view, (out, albedo))| {
                let theta = (view as f64 / (VIEWS - 1) as f64 * FRAC_PI_2).min(LAST_VIEW);
                let wo = Vec3::new(theta.sin() as f32, 0.0, theta.cos() as f32);
                let mut mass = vec![0f64; THETA_H * PHI_H];
                let mut total = DVec3::ZERO;
                for ring in 0..THETA_H {
                    for around in 0..PHI_H {
                        let mean = mean_over_cell(table, wo, (versine64[ring], versine64[ring + 1]), around);
                        let part = mean * cell(ring);
                        mass[ring * PHI_H + around] = part.element_sum();
                        total += part;
                    }
                }
                *albedo = total.as_vec3();
                accumulate(&mass, out);
            },
        );
        let guides = cumulative.chunks_exact(VIEW_FLOATS).map(|view| guide(&view[..MARGINAL])).collect();
        Self {
            guides,
            seen: std::array::from_fn(|view| cumulative[view * VIEW_FLOATS + THETA_H] > 0.0),
            densities: densities(&cumulative, |ring| (1.0 / cell(ring)) as f32),
            cumulative,
            versine: versine64.map(|v| v as f32),
            albedo,
        }
    }

    pub(crate) fn directional_albedo(&self, theta: f32) -> Vec3 {
        let View { index, t } = View::at((theta * FRAC_2_PI).clamp(0.0, 1.0));
        self.albedo[index].lerp(self.albedo[index + 1], t)
    }

    /// A direction; `None` where it would lie below the surface. Its density is [`LobeTable::pdf`].
    #[inline]
    pub(crate) fn sample(&self, view: &View, wo: Vec3, u_lobe: f32, u: Vec2) -> Option<Vec3> {
        if u_lobe < COSINE_SHARE {
            return Some(cosine_hemisphere(u));
        }
        let u_view = (u_lobe - COSINE_SHARE) / (1.0 - COSINE_SHARE);
        let view = view.index + usize::from(u_view < view.t);
        let (marginal, conditionals) = self.view(view);
        if !self.seen[view] {
            return Some(cosine_hemisphere(u));
        }
        let first = self.guides[view][((u.x * GUIDE as f32) as usize).min(GUIDE - 1)];
        let (ring, across) = invert(marginal, u.x, usize::from(first));
        let row = &conditionals[ring * CONDITIONALS..][..CONDITIONALS];
        let (around, along) = invert(row, u.y, (u.y * PHI_H as f32) as usize);
        let v = self.versine[ring] + across * (self.versine[ring + 1] - self.versine[ring]);
        let r = (v * (2.0 - v)).max(0.0).sqrt();
        let (sin, cos) = ((around as f32 + along) * (TAU / PHI_H as f32)).sin_cos();
        let axis = view_axis(wo);
        let h = Vec3::new(r * (cos * axis.x - sin * axis.y), r * (cos * axis.y + sin * axis.x), 1.0 - v);
        let wi = reflect(wo, h);
        (wi.z > 0.0 && wo.dot(h) > 0.0).then(|| wi.normalize())
    }

    #[inline]
    pub(crate) fn pdf(&self, view: &View, wi: Vec3, at: &Coordinates) -> f32 {
        let &View { index, t } = view;
        let ring = (at.theta_h as usize).min(THETA_H - 1);
        let around = ((at.turn * PHI_H as f32) as usize).min(PHI_H - 1);
        // 4 ω_o·h = 2 |ω_o + ω_i|, never zero for two directions above the surface.
        let jacobian = 1.0 / (2.0 * at.length).max(1e-20);
        let cosine = cosine_pdf(wi.z);
        let densities = &self.densities[(ring * PHI_H + around) * VIEWS + index..][..2];
        let density = |view: usize| {
            if self.seen[index + view] { densities[view] * jacobian } else { cosine }
        };
        let lobe = (1.0 - t) * density(0) + t * density(1);
        COSINE_SHARE * cosine + (1.0 - COSINE_SHARE) * lobe
    }

    #[inline]
    fn view(&self, view: usize) -> (&[f32], &[f32]) {
        self.cumulative[view * VIEW_FLOATS..][..VIEW_FLOATS].split_at(MARGINAL)
    }
}

/// 1 − cos θ without cancellation.
fn versine(theta: f64) -> f64 {
    let s = (0.5 * theta).sin();
    2.0 * s * s
}

/// The tabulated view before θ_o and how far it lies towards the next.
pub(crate) struct View {
    index: usize,
    t: f32,
}

impl View {
    #[inline]
    pub(crate) fn of(wo: Vec3) -> Self {
        Self::at(arc(wo.truncate().length(), wo.z) * FRAC_2_PI)
    }

    #[inline]
    fn at(part: f32) -> Self {
        let position = part * (VIEWS - 1) as f32;
        let index = (position as usize).min(VIEWS - 2);
        Self { index, t: (position - index as f32).clamp(0.0, 1.0) }
    }
}

/// The direction of the view in the plane of the surface.
#[inline]
fn view_axis(wo: Vec3) -> Vec2 {
    wo.truncate().try_normalize().unwrap_or(Vec2::X)
}

/// The mean of f cos θ_i · 4 (ω_o·h) over a cell of half vectors: what sampling h in proportion to it asks for.
fn mean_over_cell(table: &Table, wo: Vec3, (inner, outer): (f64, f64), around: usize) -> DVec3 {
    let mut sum = DVec3::ZERO;
    for i in 0..POINTS {
        let v = inner + (outer - inner) * (i as f64 + 0.5) / POINTS as f64;
        let r = (v * (2.0 - v)).sqrt();
        for j in 0..POINTS {
            let turn = (around as f64 + (j as f64 + 0.5) / POINTS as f64) / PHI_H as f64;
            let (sin, cos) = (turn * TAU64).sin_cos();
            let h = DVec3::new(r * cos, r * sin, 1.0 - v).as_vec3();
            let cos_o_h = wo.dot(h);
            let wi = reflect(wo, h);
            if cos_o_h > 0.0 && wi.z > 0.0 {
                let value = table.at(&Coordinates::of(wo, wi), wo, wi) * (wi.z * 4.0 * cos_o_h);
                sum += value.as_dvec3();
            }
        }
    }
    sum / (POINTS * POINTS) as f64
}

/// Masses of cells to cumulative shares.
fn accumulate(mass: &[f64], out: &mut [f32]) {
    let total: f64 = mass.iter().sum();
    if total <= 0.0 {
        return;
    }
    let (marginal, conditionals) = out.split_at_mut(MARGINAL);
    let mut before = 0.0;
    for (ring, cells) in mass.chunks_exact(PHI_H).enumerate() {
        let ring_mass: f64 = cells.iter().sum();
        before += ring_mass;
        marginal[ring + 1] = if ring + 1 == THETA_H { 1.0 } else { (before / total).min(1.0) as f32 };
        let row = &mut conditionals[ring * CONDITIONALS..][..CONDITIONALS];
        let mut within = 0.0;
        for (around, part) in cells.iter().enumerate() {
            within += part;
            row[around + 1] = if ring_mass > 0.0 { (within / ring_mass).min(1.0) as f32 } else { 0.0 };
        }
        if ring_mass > 0.0 {
            row[PHI_H] = 1.0;
        }
    }
}

/// The mass of each cell times what `per_steradian` gives for its ring, views side by side.
fn densities(cumulative: &[f32], per_steradian: impl Fn(usize) -> f32) -> Vec<f32> {
    let mut densities = Vec::with_capacity(THETA_H * PHI_H * VIEWS);
    for (ring, around) in (0..THETA_H).flat_map(|ring| (0..PHI_H).map(move |around| (ring, around))) {
        let per_steradian = per_steradian(ring);
        densities.extend(cumulative.chunks_exact(VIEW_FLOATS).map(|view| {
            let (marginal, conditionals) = view.split_at(MARGINAL);
            let row = &conditionals[ring * CONDITIONALS..][..CONDITIONALS];
            (marginal[ring + 1] - marginal[ring]) * (row[around + 1] - row[around]) * per_steradian
        }));
    }
    densities
}

/// The step of a cumulative distribution that holds `u`.
fn step_of(cumulative: &[f32], u: f32) -> usize {
    cumulative[1..].partition_point(|&c| c <= u).min(cumulative.len() - 2)
}

fn guide(cumulative: &[f32]) -> [u8; GUIDE] {
    std::array::from_fn(|i| step_of(cumulative, i as f32 / GUIDE as f32) as u8)
}

/// The step of a cumulative distribution that holds `u`, walked to from a guess, and how far into it. Steps of no
/// height are never chosen.
#[inline]
fn invert(cumulative: &[f32], u: f32, guess: usize) -> (usize, f32) {
    let last = cumulative.len() - 2;
    let mut step = guess.min(last);
    while step < last && cumulative[step + 1] <= u {
        step += 1;
    }
    while step > 0 && cumulative[step] > u {
        step -= 1;
    }
    let (low, high) = (cumulative[step], cumulative[step + 1]);
    let within = if high > low { ((u - low) / (high - low)).clamp(0.0, 1.0) } else { 0.5 };
    (step, within)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_walk_from_any_guess_ends_where_a_search_does() {
        let even: Vec<f32> = (0..=32).map(|i| i as f32 / 32.0).collect();
        let steep: Vec<f32> = (0..=90).map(|i| (i as f32 / 90.0).powi(9)).collect();
        let gaps = vec![0.0, 0.0, 0.0, 0.3, 0.3, 0.3, 0.8, 1.0, 1.0, 1.0];
        for cumulative in [even, steep, gaps, vec![0.0; 33]] {
            let guide = guide(&cumulative);
            for i in 0..4000 {
                let u = i as f32 / 4000.0;
                let expected = step_of(&cumulative, u);
                let guided = usize::from(guide[(u * GUIDE as f32) as usize]);
                for guess in [0, guided, cumulative.len() / 2, cumulative.len()] {
                    assert_eq!(invert(&cumulative, u, guess).0, expected, "{u} from {guess}");
                }
            }
        }
    }
}
