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
//! Materials that differ in one colour alone share the first two: f is a sum of what is not coloured and what is, and the
//! samples carry both; what they follow is the sum for the nearest power of two of the colour's luminance.
//!
//! Source: `[001]` §2.3 and §3.3. Cost: 0.2 s for the samples, up to 1 s of processor time for ρ of a sharp lobe.

use std::collections::HashMap;
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
use super::surface::SurfacePoint;

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
    /// ρ in the middle of its highlight, seen from 45°.
    pub(super) sharpness: f32,
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
    pub(super) fn new(material: &Material, count: usize, kept: &KeptTables, shared: &SharedTables) -> Self {
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
        let is_table = !(is_black || is_single || is_own);
        let tinted = match &parts {
            Parts::Tinted(pair) if is_table => {
                Some(shared.of(pair, parts.weights(&plain, &input)[1], &parts))
            }
            _ => None,
        };
        let bandwidth_of = |material: &&Material| match (kept.of(material), &tinted) {
            (Some(tables), _) => tables.bandwidth.clone(),
            (None, Some((bandwidth, _))) => bandwidth.clone(),
            (None, None) => reflectance_bandwidth(material, &material.bsdf(&input)),
        };
        let bandwidths: Vec<_> = judged.iter().map(bandwidth_of).collect();
        let bandwidth = bandwidths[1..].iter().fold(bandwidths[0].clone(), |all, one| all.larger(one));
        let slope = std::f32::consts::FRAC_1_SQRT_2;
        let sharpness = bandwidth.at(Vec3::new(-slope, 0.0, slope), Vec3::new(slope, 0.0, slope));
        let directions = if is_black {
            Directions::None
        } else if is_single {
            Directions::Single
        } else if is_own {
            Directions::Own
        } else {
            let wholes = parts.wholes();
            let wholes = wholes.as_ref().map_or_else(|| vec![&parts], |pair| pair.iter().collect());
            let table = |((material, parts), bandwidth): ((&&Material, &Parts), _)| match (
                kept.of(material),
                &tinted,
            ) {
                (Some(tables), _) => Arc::clone(&tables.samples),
                (None, Some((_, samples))) => Arc::clone(samples),
                (None, None) => Arc::new(HalfSamples::new(density(&material.bsdf(&input)), parts, bandwidth)),
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
        Self { bandwidth, sharpness, directions, parts, is_complete, probes, count, forms, colours }
    }

    /// The probes for a view with this cosine: one set of them, or one for each part of a mix.
    #[inline]
    pub(super) fn probes(&self, cosine: f32) -> impl Iterator<Item = &[Probe]> {
        let start = elevation(cosine) * self.count;
        let sets = self.probes.chunks_exact(ELEVATIONS * self.count);
        sets.map(move |set| &set[start..start + self.count])
    }

    /// ρ at a point for light from a direction of the world.
    #[inline]
    pub(super) fn towards(&self, point: &SurfacePoint, direction: Vec3) -> f32 {
        let local = Vec3::from(point.axes().map(|axis| axis.dot(direction)));
        self.bandwidth.at(local, point.view())
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
}

/// Bytes that lobes occupy; what they share counts once.
pub(super) fn memory_bytes(lobes: &[Arc<Lobe>]) -> usize {
    let mut counted: Vec<*const HalfSamples> = Vec::new();
    let mut of = |lobe: &Lobe| {
        let mut bytes = size_of_val(lobe.probes.as_slice()) + size_of_val(lobe.bandwidth.values());
        if let Directions::Table(tables) = &lobe.directions {
            for samples in tables {
                if !counted.contains(&Arc::as_ptr(samples)) {
                    counted.push(Arc::as_ptr(samples));
                    bytes += samples.memory_bytes();
                }
            }
        }
        bytes
    };
    lobes.iter().map(|lobe| of(lobe)).sum()
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

/// What is known of materials that differ in nothing but one colour, and in that by less than two to one.
#[derive(Default)]
pub(super) struct SharedTables(Mutex<HashMap<String, Tinted>>);

type Tinted = (ReflectanceBandwidth, Arc<HalfSamples>);

impl SharedTables {
    /// Of the material that is `pair` in black and in white, in this colour.
    fn of(&self, pair: &[Material; 2], color: Vec3, parts: &Parts) -> Tinted {
        let shade = luminance(color).clamp(1.0 / 64.0, 1.0).log2().round();
        let key = format!("{shade} {:?}", pair[1].kind);
        let known = |tables: &HashMap<String, Tinted>| tables.get(&key).cloned();
        if let Some(tinted) = known(&self.0.lock().unwrap_or_else(PoisonError::into_inner)) {
            return tinted;
        }
        // Not under the lock. Two threads may make the same, of which one is kept.
        let input = SurfaceInput::default();
        let [black, white] = pair.each_ref().map(|material| material.bsdf(&input));
        let (black, white) = (density(&black), density(&white));
        let share = shade.exp2();
        let followed = |view: Vec3, light: Vec3| {
            let none = black(view, light);
            none + share * (white(view, light) - none)
        };
        let bandwidth = match &pair[1].kind {
            MaterialKind::Diffuse { .. } => ReflectanceBandwidth::constant(lobe::phong(1.0)),
            _ => {
                let f = |wi: Vec3, wo: Vec3| followed(wo, wi) / wi.z.max(1e-4);
                ReflectanceBandwidth::new(f, &Slices::ISOTROPIC)
            }
        };
        let samples = Arc::new(HalfSamples::new(followed, parts, &bandwidth));
        let mut tables = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        tables.entry(key).or_insert((bandwidth, samples)).clone()
    }

    /// Drops what no material uses any more.
    fn drop_unused(&self) {
        let mut tables = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        tables.retain(|_, (_, samples)| Arc::strong_count(samples) > 1);
    }
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
    shared: SharedTables,
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
        let black = Arc::new(Lobe::new(&black, count, &KeptTables::default(), &self.shared));
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
                None if is_used(index) => Arc::new(Lobe::new(material, count, &kept, &self.shared)),
                None => Arc::clone(&black),
            })
            .collect();
        let made = materials.iter().zip(&lobes).filter(|(_, lobe)| !Arc::ptr_eq(lobe, &black));
        let made = made.map(|(material, lobe)| (Arc::clone(material), Arc::clone(lobe))).collect();
        *self.lobes.lock().unwrap_or_else(PoisonError::into_inner) = made;
        self.shared.drop_unused();
        lobes
    }
}
