//! The mesh queries, one copy for each level of vector instructions.
//!
//! `unsafe` is needed to call the copies compiled for AVX2, and for [`walk`], which trusts the tree.
#![allow(unsafe_code)]

use super::MeshTracer;
use super::triangle::{ShearRay, hit_block};
use super::walk::{BoxRay, walk};
use crate::simd::{Lanes, Plain, Simd};
use crate::{LocalHit, Ray};

#[inline(always)]
fn closest_body<V: Lanes, const MOVING: bool>(mesh: &MeshTracer, ray: &Ray) -> Option<LocalHit> {
    let shear = ShearRay::new(ray);
    let mut best = LocalHit { t: ray.t_max, primitive: u32::MAX, u: 0.0, v: 0.0 };
    // SAFETY: node 0 exists (the caller looked), the tree came from the builder, and it moves as `MOVING` says.
    unsafe {
        walk::<V, MOVING, true>(&mesh.tree, 0, &BoxRay::new(ray, &mesh.reach), ray.t_max, |leaf, near, _| {
            let block = mesh.blocks.get_unchecked(leaf as usize);
            let close = if MOVING { Some(mesh.close.get_unchecked(leaf as usize)) } else { None };
            hit_block::<V, MOVING, false>(block, close, &shear, near, &mut best);
            best.t
        });
    }
    (best.primitive != u32::MAX).then_some(best)
}

#[inline(always)]
fn occluded_body<V: Lanes, const MOVING: bool>(mesh: &MeshTracer, ray: &Ray) -> bool {
    let shear = ShearRay::new(ray);
    let mut best = LocalHit { t: ray.t_max, primitive: u32::MAX, u: 0.0, v: 0.0 };
    let mut blocked = false;
    // SAFETY: as in `closest_body`.
    unsafe {
        walk::<V, MOVING, false>(&mesh.tree, 0, &BoxRay::new(ray, &mesh.reach), ray.t_max, |leaf, near, end| {
            let block = mesh.blocks.get_unchecked(leaf as usize);
            let close = if MOVING { Some(mesh.close.get_unchecked(leaf as usize)) } else { None };
            blocked = hit_block::<V, MOVING, true>(block, close, &shear, near, &mut best);
            if blocked { -1.0 } else { end }
        });
    }
    blocked
}

#[inline(always)]
fn closest_any<V: Lanes>(mesh: &MeshTracer, ray: &Ray) -> Option<LocalHit> {
    if mesh.tree.nodes.is_empty() || !ray.is_usable() {
        return None;
    }
    if mesh.is_moving() { closest_body::<V, true>(mesh, ray) } else { closest_body::<V, false>(mesh, ray) }
}

#[inline(always)]
fn occluded_any<V: Lanes>(mesh: &MeshTracer, ray: &Ray) -> bool {
    if mesh.tree.nodes.is_empty() || !ray.is_usable() {
        return false;
    }
    if mesh.is_moving() { occluded_body::<V, true>(mesh, ray) } else { occluded_body::<V, false>(mesh, ray) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
fn closest_avx2(mesh: &MeshTracer, ray: &Ray) -> Option<LocalHit> {
    closest_any::<crate::simd::Wide8>(mesh, ray)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
fn occluded_avx2(mesh: &MeshTracer, ray: &Ray) -> bool {
    occluded_any::<crate::simd::Wide8>(mesh, ray)
}

/// The nearest triangle with 0 < t ≤ `t_max`; of several as near the one of smallest number.
#[inline]
pub(crate) fn closest(simd: Simd, mesh: &MeshTracer, ray: &Ray) -> Option<LocalHit> {
    #[cfg(target_arch = "x86_64")]
    if simd >= Simd::Avx2 {
        // SAFETY: a level is only used after its instructions were found.
        return unsafe { closest_avx2(mesh, ray) };
    }
    let _ = simd;
    closest_any::<Plain>(mesh, ray)
}

/// Whether there is any triangle with 0 < t ≤ `t_max`.
#[inline]
pub(crate) fn occluded(simd: Simd, mesh: &MeshTracer, ray: &Ray) -> bool {
    #[cfg(target_arch = "x86_64")]
    if simd >= Simd::Avx2 {
        // SAFETY: a level is only used after its instructions were found.
        return unsafe { occluded_avx2(mesh, ray) };
    }
    let _ = simd;
    occluded_any::<Plain>(mesh, ray)
}
