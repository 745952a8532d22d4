//! Rays through the tree of instances.
//!
//! `unsafe` is needed to call the copies compiled for AVX2, and for [`walk`], which trusts the tree.
#![allow(unsafe_code)]

use super::{Many, Top, World};
use crate::mesh::levels;
use crate::mesh::walk::{BoxRay, walk};
use crate::simd::{Lanes, Plain, Simd};
use crate::{Geometry, Hit, LocalHit, Ray};

/// Asks one instance.
#[inline(always)]
fn closest_in(world: &World, number: u32, ray: &Ray) -> Option<LocalHit> {
    let local = world.places[number as usize].local_ray(ray)?;
    match world.instances[number as usize].geometry.as_ref() {
        Geometry::Mesh(mesh) => levels::closest(world.simd, mesh, &local),
        other => other.as_rays().closest(&local),
    }
}

/// Asks one instance.
#[inline(always)]
fn occluded_in(world: &World, number: u32, ray: &Ray) -> bool {
    let Some(local) = world.places[number as usize].local_ray(ray) else { return false };
    match world.instances[number as usize].geometry.as_ref() {
        Geometry::Mesh(mesh) => levels::occluded(world.simd, mesh, &local),
        other => other.as_rays().occluded(&local),
    }
}

fn hit_of(instance: u32, hit: LocalHit) -> Hit {
    Hit { t: hit.t, instance, primitive: hit.primitive, u: hit.u, v: hit.v }
}

/// Keeps the nearer of two hits, and of equal ones that of the smaller instance. A hit counts as no nearer than the
/// instance's box, `near`: so the order in which instances are asked does not matter.
#[inline(always)]
fn keep(best: &mut Option<Hit>, instance: u32, mut found: LocalHit, near: f32) {
    found.t = found.t.max(near);
    let wins = best.is_none_or(|best| found.t < best.t || (found.t == best.t && instance < best.instance));
    if wins {
        *best = Some(hit_of(instance, found));
    }
}

#[inline(always)]
fn closest_body<V: Lanes, const MOVING: bool>(world: &World, many: &Many, ray: &Ray) -> Option<Hit> {
    let mut best = None;
    // SAFETY: a tree of many has a root, came from the builder, and moves as `MOVING` says.
    unsafe {
        walk::<V, MOVING, true>(&many.tree, 0, &BoxRay::new(ray, &many.reach), ray.t_max, |leaf, near, end| {
            let number = many.instances[leaf as usize];
            if let Some(found) = closest_in(world, number, &Ray { t_max: end, ..*ray }) {
                keep(&mut best, number, found, near);
            }
            best.map_or(end, |best: Hit| best.t)
        });
    }
    best
}

#[inline(always)]
fn occluded_body<V: Lanes, const MOVING: bool>(world: &World, many: &Many, ray: &Ray) -> bool {
    let mut blocked = false;
    // SAFETY: as in `closest_body`.
    unsafe {
        walk::<V, MOVING, false>(&many.tree, 0, &BoxRay::new(ray, &many.reach), ray.t_max, |leaf, _, end| {
            blocked = occluded_in(world, many.instances[leaf as usize], ray);
            if blocked { -1.0 } else { end }
        });
    }
    blocked
}

#[inline(always)]
fn closest_many<V: Lanes>(world: &World, many: &Many, ray: &Ray) -> Option<Hit> {
    if many.tree.close.is_empty() {
        closest_body::<V, false>(world, many, ray)
    } else {
        closest_body::<V, true>(world, many, ray)
    }
}

#[inline(always)]
fn occluded_many<V: Lanes>(world: &World, many: &Many, ray: &Ray) -> bool {
    if many.tree.close.is_empty() {
        occluded_body::<V, false>(world, many, ray)
    } else {
        occluded_body::<V, true>(world, many, ray)
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
        Top::One(number) if ray.is_usable() => closest_in(world, *number, ray).map(|hit| hit_of(*number, hit)),
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

pub(super) fn closest_packet(world: &World, rays: &[Ray], hits: &mut [Option<Hit>]) {
    for (ray, hit) in rays.iter().zip(hits) {
        *hit = closest(world, ray);
    }
}

pub(super) fn occluded_packet(world: &World, rays: &[Ray], blocked: &mut [bool]) {
    for (ray, blocked) in rays.iter().zip(blocked) {
        *blocked = occluded(world, ray);
    }
}
