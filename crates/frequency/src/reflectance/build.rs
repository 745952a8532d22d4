//! From a function of two directions to the table.

use std::f32::consts::{FRAC_PI_2, PI};

use glam::{Vec2, Vec3};
use halflight_image::Plane;
use rayon::prelude::*;

use super::{SIDE, disc};
use crate::bandwidth::bounded;
use crate::wavelet::{Border, Filter, Pyramid, Rule, local_bandwidth, whole_bandwidth};

/// How slices are taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slices {
    /// Whether the reflectance does not depend on the azimuth of both directions together.
    pub isotropic: bool,
    /// Directions along the side of the first slice, at least 16: lobes that are narrower than its texels, π/coarsest, are
    /// found in the mirror's direction only.
    pub coarsest: usize,
    /// Directions along the side of the finest slice: the narrowest lobe that can be told is
    /// 0.5 · finest/π cycles per radian (1024: 163, a cosine lobe of exponent 350 000).
    pub finest: usize,
    /// Which wavelets.
    pub filter: Filter,
    /// What to say within an octave.
    pub rule: Rule,
}

impl Slices {
    /// For reflectances without a grain.
    pub const ISOTROPIC: Self =
        Self { isotropic: true, coarsest: 128, finest: 1024, filter: Filter::Smooth, rule: Rule::Within };
    /// For all others: 16 times the work.
    pub const ANISOTROPIC: Self = Self { isotropic: false, coarsest: 64, finest: 512, ..Self::ISOTROPIC };
}

pub(super) fn table(f: &(impl Fn(Vec3, Vec3) -> f32 + Sync), slices: &Slices) -> Vec<f32> {
    let count = if slices.isotropic { SIDE } else { SIDE * SIDE };
    let maps: Vec<Vec<f32>> =
        (0..count).into_par_iter().map(|i| slice(f, incident(i, slices), slices)).collect();
    maps.concat()
}

/// The middle of an incident cell.
fn incident(index: usize, slices: &Slices) -> Vec3 {
    let middle = |i: usize| (i as f32 + 0.5) / SIDE as f32;
    if slices.isotropic {
        let (sin, cos) = (middle(index) * FRAC_PI_2).sin_cos();
        Vec3::new(sin, 0.0, cos)
    } else {
        disc::disc_to_hemisphere(2.0 * Vec2::new(middle(index % SIDE), middle(index / SIDE)) - Vec2::ONE)
    }
}

/// One map of `SIDE`² outgoing directions.
fn slice(f: &(impl Fn(Vec3, Vec3) -> f32 + Sync), wi: Vec3, slices: &Slices) -> Vec<f32> {
    let positive = |value: f32| if value.is_finite() { value.max(0.0) } else { 0.0 };
    let mirror = Vec3::new(-wi.x, -wi.y, wi.z);
    let peak = positive(f(wi, mirror));
    // Blocks of whole texels.
    let mut side = slices.coarsest.max(SIDE).next_multiple_of(SIDE);
    loop {
        let place = |i: usize| 2.0 * (i as f32 + 0.5) / side as f32 - 1.0;
        let value =
            |i: usize| positive(f(wi, disc::disc_to_hemisphere(Vec2::new(place(i % side), place(i / side)))));
        let values: Vec<f32> = (0..side * side).into_par_iter().with_min_len(1024).map(value).collect();
        // A peak that no texel has seen by half is narrower than they are.
        let missed = peak > 2.0 * values.iter().copied().fold(0.0, f32::max);
        let picture = Plane { width: side, height: side, values };
        let pyramid = Pyramid::new(&picture, slices.filter, Border::Repeat);
        // An eighth of a cycle: the octave below Nyquist's is empty, and the lobe is seen whole.
        let whole = whole_bandwidth(&pyramid, slices.rule);
        if (missed || whole > 0.125) && 2 * side <= slices.finest {
            side *= 2;
            continue;
        }
        let map = local_bandwidth(&pyramid, slices.rule, |x, y| {
            disc::stretch(Vec2::new(place(x), place(y))) * (2.0 / side as f32)
        });
        // Around its peak a smooth lobe looks two to three times as fast as its spectrum as a whole is.
        let mut map = scaled_down(&map, whole * side as f32 / PI);
        if missed {
            map[disc::cell(mirror)] = 0.5 * side as f32 / PI;
        }
        return map;
    }
}

/// The largest value of each block, at most `whole`.
fn scaled_down(map: &Plane, whole: f32) -> Vec<f32> {
    let block = map.width / SIDE;
    let mut out = vec![0.0f32; SIDE * SIDE];
    for (i, &value) in map.values.iter().enumerate() {
        let cell = &mut out[i / map.width / block * SIDE + i % map.width / block];
        *cell = cell.max(bounded(value.min(whole)));
    }
    out
}
