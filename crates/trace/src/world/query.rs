//! Rays through the tree of instances.
//!
//! `unsafe` is needed to call the copies compiled for AVX2, and for [`walk`], which trusts the tree.
#![allow(unsafe_code)]

use super::{Many, Top, World};
use crate::mesh::levels;
use crate::mesh::walk::{BoxRay, Visitor, walk};
use crate::simd::{Lanes, Plain, Simd};
use crate::{Geometry, Hit, LocalHit, Ray, RayGeometry};

/// Asks one instance.
#[inline(always)]
pub(super) fn closest_in(world: &World, number: u32, ray: &Ray) -> Option<LocalHit> {
    let local = world.places[number as usize].local_ray(ray)?;
    match world.instances[number as usize].geometry.as_ref() {
        Geometry::Mesh(mesh) => levels::closest(world.simd, mesh, &local),
        other => other.as_rays().closest(&local),
    }
}

/// Asks one instance.
#[inline(always)]
pub(super) fn occluded_in(world: &World, number: u32, ray: &Ray) -> bool {
    let Some(local) = world.places[number as usize].local_ray(ray) else { return false };
    match world.instances[number as usize].geometry.as_ref() {
        Geometry::Mesh(mesh) => levels::occluded(world.simd, mesh, &local),
        Geometry::Rectangle(rectangle) => rectangle.occluded(&local),
        other => other.as_rays().occluded(&local),
    }
}

pub(super) fn hit_of(instance: u32, hit: LocalHit) -> Hit {
    Hit { t: hit.t, instance, primitive: hit.primitive, u: hit.u, v: hit.v }
}

/// Keeps the nearer of two hits, and of equal ones that of the smaller instance. A hit counts as no nearer than the
/// instance's box, `near`: so the order in which instances are asked does not matter.
#[inline(always)]
pub(crate) fn keep(best: &mut Option<Hit>, mut found: Hit, near: f32) {
    found.t = found.t.max(near);
    let wins =
        best.is_none_or(|best| found.t < best.t || (found.t == best.t && found.instance < best.instance));
    if wins {
        *best = Some(found);
    }
}

/// The instances, for one ray. With `ANY` the first hit found ends the walk.
pub(super) struct Visit<'a, const ANY: bool> {
    pub(super) world: &'a World,
    pub(super) many: &'a Many,
    pub(super) ray: &'a Ray,
    pub(super) best: Option<Hit>,
    pub(super) blocked: bool,
}

impl<const ANY: bool> Visitor for Visit<'_, ANY> {
    #[inline(always)]
    fn leaf(&mut self, leaf: u32, near: f32, end: f32) -> f32 {
        let number = self.many.instances[leaf as usize];
        if ANY {
            self.blocked = occluded_in(self.world, number, self.ray);
            return if self.blocked { -1.0 } else { end };
        }
        match closest_in(self.world, number, &Ray { t_max: end, ..*self.ray }) {
            Some(found) => {
                keep(&mut self.best, hit_of(number, found), near);
                self.best.map_or(end, |best| best.t)
            }
            None => end,
        }
    }
}

#[inline(always)]
fn walk_instances<V: Lanes, const MOVING: bool, const ANY: bool>(
    world: &World,
    many: &Many,
    ray: &Ray,
) -> (Option<Hit>, bool) {
    let mut visit = Visit::<ANY> { world, many, ray, best: None, blocked: false };
    // SAFETY: a tree of many has a root, came from the builder, and moves as `MOVING` says.
    unsafe {
        walk::<V, MOVING, true, _>(&many.tree, 0, &BoxRay::new(ray, &many.reach), ray.t_max, &mut visit)
    };
    (visit.best, visit.blocked)
}

#[inline(always)]
fn closest_many<V: Lanes>(world: &World, many: &Many, ray: &Ray) -> Option<Hit> {
    if many.tree.close.is_empty() {
        walk_instances::<V, false, false>(world, many, ray).0
    } else {
        walk_instances::<V, true, false>(world, many, ray).0
    }
}

#[inline(always)]
fn occluded_many<V: Lanes>(world: &World, many: &Many, ray: &Ray) -> bool {
    if many.tree.close.is_empty() {
        walk_instances::<V, false, true>(world, many, ray).1
    } else {
        walk_instances::<V, true, true>(world, many, ray).1
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
fn closest_avx2(world: &World, many: &Many, ray: &Ray) -> Option<Hit> {
    closest_many::<crate::simd::Wide8>(world, many, ray)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
fn occluded_avx2(world: &World, many: &Many, ray: &Ray) -> bool {
    occluded_many::<crate::simd::Wide8>(world, many, ray)
}

#[inline]
pub(super) fn closest(world: &World, ray: &Ray) -> Option<Hit> {
    match &world.top {
        Top::Nothing => None,
        Top::One(number) if ray.is_usable() => {
            closest_in(world, *number, ray).map(|hit| hit_of(*number, hit))
        }
        Top::Many(many) if ray.is_usable() => {
            #[cfg(target_arch = "x86_64")]
            if world.simd >= Simd::Avx2 {
                // SAFETY: a world has only a level whose instructions were found.
                return unsafe { closest_avx2(world, many, ray) };
            }
            closest_many::<Plain>(world, many, ray)
        }
        _ => None,
    }
}

#[inline]
pub(super) fn occluded(world: &World, ray: &Ray) -> bool {
    match &world.top {
        Top::Nothing => false,
        Top::One(number) => ray.is_usable() && occluded_in(world, *number, ray),
        Top::Many(many) if ray.is_usable() => {
            #[cfg(target_arch = "x86_64")]
            if world.simd >= Simd::Avx2 {
                // SAFETY: a world has only a level whose instructions were found.
                return unsafe { occluded_avx2(world, many, ray) };
            }
            occluded_many::<Plain>(world, many, ray)
        }
        Top::Many(_) => false,
    }
}
