//! What is known of a material before any frame: how fast its lobe varies, where it is large, and a few directions of
//! it by which a pixel is judged.
//!
//! - **ρ**, [`ReflectanceBandwidth`], of the reflectance with its pictures replaced by their means.
//! - **Importance samples**, [`HalfSamples`].
//! - **Probes**: per view n_b of these samples with f cos θ/p, ρ and the solid angle 1/(n_b p) that each stands for.
//!
//! A mix of two materials has all of these for each part. One table of samples for both would not do: where samples of a
//! narrow lobe stand for a broad one, the light of each is convolved too little for the gaps between them.
//!
//! Source: `[001]` §2.3 and §3.3. Cost: 0.2 s for the samples, up to 1 s of processor time for ρ of a sharp lobe.

use std::sync::{Arc, Mutex, PoisonError};

use glam::{Vec2, Vec3};
use halflight_frequency::bandwidth::lobe::phong_exponent;
use halflight_frequency::bandwidth::{UNLIMITED, lobe};
use halflight_frequency::importance::point;
use halflight_frequency::reflectance::{ReflectanceBandwidth, Slices};
use halflight_material::{Bsdf, Material, MaterialKind, SurfaceInput};
use halflight_scene::lights::luminance;
use rayon::prelude::*;

use super::kept::KeptTables;
use super::paint::{Paint, colours, numbers, without_paint};
use super::parts::{Parts, Split};
use super::samples::{ELEVATIONS, HalfSamples, MOST_SAMPLES, elevation, table_view};

/// One of the directions by which a pixel is judged, for a view in the xz-plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Probe {
    pub(super) direction: Vec3,
    /// Luminance of f cos θ/p.
    pub(super) gain: f32,
    /// ρ, cycles per radian.
    pub(super) lobe: f32,
    /// What it stands for, sr.
    pub(super) solid_angle: f32,
    /// Of the Phong lobe that varies as the reflectance does there, sr.
    pub(super) blurred: f32,
}

/// Where shading gets its directions from.
pub(super) enum Directions {
    /// From tables: isotropic lobes. One of all parts together, or of a mix one for each.
    Table(Vec<Arc<HalfSamples>>),
    /// From the material itself.
    Own,
    /// There is one: an ideal mirror.
    Single,
    /// Nothing scatters.
    None,
}

/// A material, analysed.
pub(super) struct Lobe {
    pub(super) bandwidth: ReflectanceBandwidth,
    pub(super) directions: Directions,
    pub(super) parts: Parts,
    /// Whether the parts tell of every colour: without, a vertex colour is asked of the material itself.
    pub(super) is_complete: bool,
    /// One set, or one for each part of a mix.
    probes: Vec<Probe>,
    count: usize,
    /// The pictures that change the form of the lobe: they are shaded as finely as they vary.
    forms: Vec<Paint>,
    /// The pictures that only colour it, and are multiplied in afterwards.
    colours: Vec<Paint>,
}

impl Lobe {
    /// Analyses a material; `count` is n_b.
    pub(super) fn new(material: &Material, count: usize, kept: &KeptTables) -> Self {
        let (plain, varies) = without_paint(material);
        let input = SurfaceInput::default();
        let bsdf = plain.bsdf(&input);
        let is_black = bsdf.albedo() == Vec3::ZERO && bsdf.is_delta_only();
        let is_sharp =
            |part: &&Material| !matches!(part.kind, MaterialKind::Black) && part.bsdf(&input).is_delta_only();
        let Split { mut parts, is_apart, is_complete } = Split::new(material, &plain);
        let (mut colours, mut forms) = (colours(material), numbers(material));
        let is_own = bsdf.transmits()
            || plain.leaves().iter().any(is_sharp)
            || plain.needs_tangents()
            || material.opacity.is_some()
            || varies
            || !is_apart && !colours.is_empty();
        let is_single = bsdf.is_delta_only() && !bsdf.transmits() && !varies;
        if is_black || is_single || is_own {
            // What is not taken apart is shaded with its pictures.
            parts = Parts::Whole(Box::new(plain.clone()));
            forms.append(&mut colours);
        }
        // What places are judged by.
        let judged = parts.mixed().map_or_else(|| vec![&plain], |pair| pair.iter().collect());
        let bandwidth_of = |material: &&Material| match kept.of(material) {
            Some(tables) => tables.bandwidth.clone(),
            None => reflectance_bandwidth(material, &material.bsdf(&input)),
        };
        let bandwidths: Vec<_> = judged.iter().map(bandwidth_of).collect();
        let bandwidth = bandwidths[1..].iter().fold(bandwidths[0].clone(), |all, one| all.larger(one));
        let directions = if is_black {
            Directions::None
        } else if is_single {
            Directions::Single
        } else if is_own {
            Directions::Own
        } else {
            let wholes = parts.wholes();
            let wholes = wholes.as_ref().map_or_else(|| vec![&parts], |pair| pair.iter().collect());
            let table = |((material, parts), bandwidth): ((&&Material, &Parts), _)| match kept.of(material) {
                Some(tables) => Arc::clone(&tables.samples),
                None => Arc::new(HalfSamples::new(density(&material.bsdf(&input)), parts, bandwidth)),
            };
            Directions::Table(judged.iter().zip(wholes).zip(&bandwidths).map(table).collect())
        };
        let probes = (judged.iter().zip(&bandwidths).enumerate())
            .flat_map(|(set, (material, bandwidth))| {
                let (bsdf, directions) = (material.bsdf(&input), &directions);
                let places = (0..ELEVATIONS).flat_map(|e| (0..count).map(move |i| (e, i)));
                places.map(move |(e, i)| probe(&bsdf, bandwidth, (directions, set), e, i, count))
            })
            .collect();
        Self { bandwidth, directions, parts, is_complete, probes, count, forms, colours }
    }

    /// The probes for a view with this cosine: one set of them, or one for each part of a mix.
    #[inline]
    pub(super) fn probes(&self, cosine: f32) -> impl Iterator<Item = &[Probe]> {
        let start = elevation(cosine) * self.count;
        let sets = self.probes.chunks_exact(ELEVATIONS * self.count);
        sets.map(move |set| &set[start..start + self.count])
    }

    /// Whether there are pictures on it.
    #[inline]
    pub(super) fn is_painted(&self) -> bool {
        !(self.forms.is_empty() && self.colours.is_empty())
    }

    /// Cycles per pixel of the pictures on it: of those that are shaded, and of those that are multiplied in afterwards.
    pub(super) fn painted(&self, uv: Vec2, across: Vec2, along: Vec2) -> [f32; 2] {
        [&self.forms, &self.colours]
            .map(|paints| paints.iter().map(|paint| paint.per_pixel(uv, across, along)).fold(0.0, f32::max))
    }

    /// Bytes that it occupies.
    pub(super) fn memory_bytes(&self) -> usize {
        let samples = match &self.directions {
            Directions::Table(tables) => tables.iter().map(|samples| samples.memory_bytes()).sum(),
            _ => 0,
        };
        samples + size_of_val(self.probes.as_slice()) + size_of_val(self.bandwidth.values())
    }
}

/// What importance samples follow.
pub(super) fn density(bsdf: &Bsdf) -> impl Fn(Vec3, Vec3) -> f32 + Sync {
    move |view, light| luminance(bsdf.eval(view, light))
}

fn probe(
    bsdf: &Bsdf,
    bandwidth: &ReflectanceBandwidth,
    (directions, set): (&Directions, usize),
    elevation: usize,
    index: usize,
    count: usize,
) -> Probe {
    let view = table_view(elevation);
    let (direction, gain, pdf, delta) = match directions {
        Directions::Table(tables) => {
            let samples = &tables[set];
            // A block that begins in the last vector: shading takes others as a rule.
            let start = MOST_SAMPLES - count.next_power_of_two();
            let (half, density) = samples.half(elevation * MOST_SAMPLES + start + index);
            let along = half.dot(view);
            let direction = 2.0 * along * half - view;
            let pdf = density / along;
            (direction, luminance(bsdf.eval(view, direction)) / pdf, pdf, false)
        }
        Directions::None => (Vec3::Z, 0.0, 1.0, false),
        Directions::Own | Directions::Single => {
            let u = point(index as u32, 77);
            let choice = (index as f32 + 0.5) * 0.618_034;
            match bsdf.sample(view, choice.fract(), u) {
                Some(sample) => (sample.wi, luminance(sample.weight), sample.pdf, sample.delta),
                None => (Vec3::Z, 0.0, 1.0, false),
            }
        }
    };
    let gain = if gain.is_finite() { gain } else { 0.0 };
    let lobe = if delta { UNLIMITED } else { bandwidth.at(direction, view) };
    let solid_angle = if delta { 0.0 } else { 1.0 / (pdf * count as f32).max(1e-6) };
    let blurred = 4.0 * std::f32::consts::PI / phong_exponent(lobe).max(1.0);
    Probe { direction, gain, lobe, solid_angle, blurred }
}

/// ρ of a material without pictures.
pub(super) fn reflectance_bandwidth(material: &Material, bsdf: &Bsdf) -> ReflectanceBandwidth {
    if bsdf.is_delta_only() {
        return ReflectanceBandwidth::constant(UNLIMITED);
    }
    match &material.kind {
        MaterialKind::Black => ReflectanceBandwidth::constant(0.0),
        // The cosine is all that limits its light.
        MaterialKind::Diffuse { .. } => ReflectanceBandwidth::constant(lobe::phong(1.0)),
        _ => {
            let f = |wi: Vec3, wo: Vec3| luminance(bsdf.eval(wo, wi)) / wi.z.max(1e-4);
            ReflectanceBandwidth::new(f, &Slices::ISOTROPIC)
        }
    }
}

/// Materials that were analysed, so that frames share them.
#[derive(Default)]
pub(super) struct LobeCache {
    lobes: Mutex<Vec<(Arc<Material>, Arc<Lobe>)>>,
    /// What became of the tables that are kept in files.
    pub(super) notes: Mutex<Vec<String>>,
}

impl LobeCache {
    /// The analyses of these materials, new ones made where needed; those of other materials are dropped.
    pub(super) fn lobes(
        &self,
        materials: &[Arc<Material>],
        is_used: &(dyn Fn(usize) -> bool + Sync),
        count: usize,
        in_files: bool,
    ) -> Vec<Arc<Lobe>> {
        // Not under the lock: threads that wait for their own work may take up that of another picture.
        let known = self.lobes.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let black = Material::new("", MaterialKind::Black);
        let black = Arc::new(Lobe::new(&black, count, &KeptTables::default()));
        let is_new = |material: &Arc<Material>| !known.iter().any(|(other, _)| Arc::ptr_eq(other, material));
        let new =
            materials.iter().enumerate().filter(|(index, material)| is_used(*index) && is_new(material));
        let (kept, notes) = KeptTables::new(new.map(|(_, material)| material.as_ref()), in_files);
        if !notes.is_empty() {
            *self.notes.lock().unwrap_or_else(PoisonError::into_inner) = notes;
        }
        let lobes: Vec<Arc<Lobe>> = materials
            .par_iter()
            .enumerate()
            .map(|(index, material)| match known.iter().find(|(other, _)| Arc::ptr_eq(other, material)) {
                Some((_, lobe)) => Arc::clone(lobe),
                None if is_used(index) => Arc::new(Lobe::new(material, count, &kept)),
                None => Arc::clone(&black),
            })
            .collect();
        let made = materials.iter().zip(&lobes).filter(|(_, lobe)| !Arc::ptr_eq(lobe, &black));
        let made = made.map(|(material, lobe)| (Arc::clone(material), Arc::clone(lobe))).collect();
        *self.lobes.lock().unwrap_or_else(PoisonError::into_inner) = made;
        lobes
    }
}
