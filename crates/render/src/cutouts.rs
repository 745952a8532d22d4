//! Surfaces that are there only in part, such as leaves cut out of cards: rays go past what is not there.
//!
//! At each hit the ray goes on with the probability 1 − opacity, so that vertices are always solid, light sampling sees
//! through holes, and a passage is no scattering. Chance comes from the bits of ray and hit: no random numbers of a path
//! are used up. Scenes without such surfaces pay nothing. After the stochastic alpha test of Pharr, Jakob and Humphreys,
//! Physically Based Rendering, 4th edition, §7.1.1.

use halflight_scene::Frame;
use halflight_trace::{Hit, Ray, Surface};

/// Surfaces that a ray may pass; what is behind so many is taken for hidden.
const MOST_PASSED: usize = 1024;

/// Whether a frame has such surfaces at all.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cutouts {
    pub(crate) any: bool,
}

impl Cutouts {
    pub(crate) fn of(frame: &Frame) -> Self {
        Self { any: frame.materials.iter().any(|material| material.opacity.is_some()) }
    }

    /// The first hit along a ray that stops it, given the nearest; `ray` becomes the one that this hit belongs to.
    #[inline]
    pub(crate) fn stopping(self, frame: &Frame, ray: &mut Ray, nearest: Option<Hit>) -> Option<Hit> {
        if self.any { stopping(frame, ray, nearest) } else { nearest }
    }

    /// Whether a ray that meets something is stopped before its end.
    pub(crate) fn blocked(self, frame: &Frame, ray: &Ray) -> bool {
        let mut ray = *ray;
        let nearest = frame.world.closest(&ray);
        self.stopping(frame, &mut ray, nearest).is_some()
    }
}

fn stopping(frame: &Frame, ray: &mut Ray, nearest: Option<Hit>) -> Option<Hit> {
    let mut nearest = nearest;
    for _ in 0..MOST_PASSED {
        let hit = nearest?;
        let Some(surface) = passed(frame, ray, &hit) else { return nearest };
        let beyond = ray.t_max - hit.t;
        *ray = Ray { t_max: beyond, ..surface.spawn(ray.direction, ray.time) };
        nearest = frame.world.closest(ray);
    }
    nearest
}

/// The surface at a hit, if the ray goes past it.
fn passed(frame: &Frame, ray: &Ray, hit: &Hit) -> Option<Surface> {
    let surface = frame.world.surface(ray, hit);
    let opacity = frame.material(surface.instance, surface.material_slot).opacity.as_ref()?;
    (chance(ray, hit) >= opacity.at(surface.uv)).then_some(surface)
}

/// A number in [0, 1) that looks random from one ray to the next.
fn chance(ray: &Ray, hit: &Hit) -> f32 {
    let (from, along) = (ray.origin.to_array(), ray.direction.to_array());
    let bits = from.into_iter().chain(along).chain([hit.t, hit.u, hit.v]).map(f32::to_bits);
    let mixed = bits.chain([hit.primitive, hit.instance]).fold(0x9e37_79b9_7f4a_7c15, |mixed: u64, bits| {
        let mixed = (mixed ^ u64::from(bits)).wrapping_mul(0xff51_afd7_ed55_8ccd);
        mixed ^ mixed >> 32
    });
    (mixed >> 40) as f32 / (1u64 << 24) as f32
}
