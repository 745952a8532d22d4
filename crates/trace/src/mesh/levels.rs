//! The mesh queries, one copy for each level of vector instructions.
//!
//! `unsafe` is needed to call the copies compiled for AVX2 and AVX-512, and for [`walk`], which trusts the tree. The
//! AVX-512 copy of the single-ray queries computes the same as the AVX2 one, eight lanes at a time; what it gains is
//! twice as many registers.
#![allow(unsafe_code)]

use std::marker::PhantomData;

use super::MeshTracer;
use super::columns::{Columns, IN_ORDER, Sorting, first_rays};
use super::packet::{PACKET, Packet, hit_in};
use super::packet_walk;
use super::triangle::{ShearRay, hit_block};
use super::walk::{BoxRay, Visitor, walk};
use crate::simd::{Lanes, Plain, Simd};
#[cfg(target_arch = "x86_64")]
use crate::simd::{Wide8, Wide16};
use crate::{Hit, LocalHit, Ray};

/// The leaves of a mesh, for one ray. With `ANY` the first hit found ends the walk.
struct Triangles<'a, V, const MOVING: bool, const ANY: bool> {
    mesh: &'a MeshTracer,
    shear: ShearRay,
    best: LocalHit,
    found: bool,
    lanes: PhantomData<V>,
}

impl<V: Lanes, const MOVING: bool, const ANY: bool> Visitor for Triangles<'_, V, MOVING, ANY> {
    #[inline(always)]
    fn leaf(&mut self, leaf: u32, near: f32, end: f32) -> f32 {
        // SAFETY: the tree names only blocks that exist; if the mesh moves there are as many sets of other corners.
        let (block, close) = unsafe {
            let close = if MOVING { Some(self.mesh.close.get_unchecked(leaf as usize)) } else { None };
            (self.mesh.blocks.get_unchecked(leaf as usize), close)
        };
        let found = hit_block::<V, MOVING, ANY>(block, close, &self.shear, near, &mut self.best);
        if ANY {
            self.found = found;
            return if found { -1.0 } else { end };
        }
        self.best.t
    }
}

#[inline(always)]
fn closest_body<V: Lanes, const MOVING: bool>(mesh: &MeshTracer, ray: &Ray) -> Option<LocalHit> {
    let best = LocalHit { t: ray.t_max, primitive: u32::MAX, u: 0.0, v: 0.0 };
    let mut triangles = Triangles::<V, MOVING, false> {
        mesh,
        shear: ShearRay::new(ray),
        best,
        found: false,
        lanes: PhantomData,
    };
    // SAFETY: node 0 exists (the caller looked), the tree came from the builder, and it moves as `MOVING` says.
    unsafe {
        walk::<V, MOVING, true, _>(&mesh.tree, 0, &BoxRay::new(ray, &mesh.reach), ray.t_max, &mut triangles)
    };
    (triangles.best.primitive != u32::MAX).then_some(triangles.best)
}

#[inline(always)]
fn occluded_body<V: Lanes, const MOVING: bool>(mesh: &MeshTracer, ray: &Ray) -> bool {
    let best = LocalHit { t: ray.t_max, primitive: u32::MAX, u: 0.0, v: 0.0 };
    let mut triangles = Triangles::<V, MOVING, true> {
        mesh,
        shear: ShearRay::new(ray),
        best,
        found: false,
        lanes: PhantomData,
    };
    // SAFETY: as in `closest_body`.
    unsafe {
        walk::<V, MOVING, false, _>(&mesh.tree, 0, &BoxRay::new(ray, &mesh.reach), ray.t_max, &mut triangles)
    };
    triangles.found
}

#[inline(always)]
fn closest_any<V: Lanes>(mesh: &MeshTracer, ray: &Ray) -> Option<LocalHit> {
    if mesh.tree.nodes.is_empty() {
        return None;
    }
    if mesh.is_moving() { closest_body::<V, true>(mesh, ray) } else { closest_body::<V, false>(mesh, ray) }
}

/// [`occluded`], to be called from a function compiled for the instructions of `V`.
#[inline(always)]
pub(crate) fn occluded_any<V: Lanes>(mesh: &MeshTracer, ray: &Ray) -> bool {
    if mesh.tree.nodes.is_empty() {
        return false;
    }
    if mesh.is_moving() { occluded_body::<V, true>(mesh, ray) } else { occluded_body::<V, false>(mesh, ray) }
}

#[inline(always)]
fn closest_chunk_body<V: Lanes, G: Lanes>(
    mesh: &MeshTracer,
    rays: &[Ray],
    instance: u32,
    hits: &mut [Option<Hit>],
) {
    if mesh.tree.nodes.is_empty() || rays.is_empty() {
        hits.fill(None);
        return;
    }
    let mut columns = Columns::EMPTY;
    let mut packet = Packet::EMPTY;
    columns.gather::<V>(rays, &IN_ORDER[..rays.len()]);
    if columns.go_together::<G>(rays.len()) {
        packet.prepare::<G>(&rays[0], &columns, &mesh.reach);
        packet_walk::trace::<V, G, false>(mesh, &mut packet, first_rays(rays.len()));
        for (place, hit) in hits.iter_mut().enumerate() {
            *hit = packet.hit(place, instance);
        }
        return;
    }
    hits.fill(None);
    let mut sorting = Sorting::new(rays);
    let mut chosen = [0; PACKET];
    while let Some((count, together)) = sorting.next(&mut chosen) {
        let chosen = &chosen[..count];
        if together {
            columns.gather::<V>(rays, chosen);
            packet = Packet::EMPTY;
            packet.prepare::<G>(&rays[chosen[0] as usize], &columns, &mesh.reach);
            packet_walk::trace::<V, G, false>(mesh, &mut packet, first_rays(count));
            for (place, &ray) in chosen.iter().enumerate() {
                hits[ray as usize] = packet.hit(place, instance);
            }
        } else {
            for &ray in chosen {
                let hit = closest_body::<V, false>(mesh, &rays[ray as usize]);
                hits[ray as usize] = hit.and_then(|hit| hit_in(instance, &hit));
            }
        }
    }
}

#[inline(always)]
fn occluded_chunk_body<V: Lanes, G: Lanes>(mesh: &MeshTracer, rays: &[Ray]) -> u64 {
    let mut blocked = 0;
    if mesh.tree.nodes.is_empty() || rays.is_empty() {
        return blocked;
    }
    let mut columns = Columns::EMPTY;
    let mut packet = Packet::EMPTY;
    columns.gather::<V>(rays, &IN_ORDER[..rays.len()]);
    if columns.go_together::<G>(rays.len()) {
        packet.prepare::<G>(&rays[0], &columns, &mesh.reach);
        return packet_walk::trace::<V, G, true>(mesh, &mut packet, first_rays(rays.len()));
    }
    let mut sorting = Sorting::new(rays);
    let mut chosen = [0; PACKET];
    while let Some((count, together)) = sorting.next(&mut chosen) {
        let chosen = &chosen[..count];
        if together {
            columns.gather::<V>(rays, chosen);
            packet.prepare::<G>(&rays[chosen[0] as usize], &columns, &mesh.reach);
            let found = packet_walk::trace::<V, G, true>(mesh, &mut packet, first_rays(count));
            for (place, &ray) in chosen.iter().enumerate() {
                blocked |= (found >> place & 1) << ray;
            }
        } else {
            for &ray in chosen {
                blocked |= u64::from(occluded_body::<V, false>(mesh, &rays[ray as usize])) << ray;
            }
        }
    }
    blocked
}

/// Copies of the four queries for one set of instructions: `V` for single rays and nodes, `G` for registers of rays.
#[cfg(target_arch = "x86_64")]
macro_rules! level {
    ($name:ident, $features:literal, $v:ty, $g:ty) => {
        mod $name {
            use super::*;

            #[target_feature(enable = $features)]
            pub(super) fn closest(mesh: &MeshTracer, ray: &Ray) -> Option<LocalHit> {
                closest_any::<$v>(mesh, ray)
            }

            #[target_feature(enable = $features)]
            pub(super) fn occluded(mesh: &MeshTracer, ray: &Ray) -> bool {
                occluded_any::<$v>(mesh, ray)
            }

            #[target_feature(enable = $features)]
            pub(super) fn closest_chunk(
                mesh: &MeshTracer,
                rays: &[Ray],
                instance: u32,
                hits: &mut [Option<Hit>],
            ) {
                closest_chunk_body::<$v, $g>(mesh, rays, instance, hits);
            }

            #[target_feature(enable = $features)]
            pub(super) fn occluded_chunk(mesh: &MeshTracer, rays: &[Ray]) -> u64 {
                occluded_chunk_body::<$v, $g>(mesh, rays)
            }
        }
    };
}

#[cfg(target_arch = "x86_64")]
level!(avx2, "avx2,fma,bmi1,bmi2,lzcnt,popcnt", Wide8, Wide8);
#[cfg(target_arch = "x86_64")]
level!(avx512, "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt", Wide8, Wide16);

/// Calls the copy of a query for a level.
macro_rules! at_level {
    ($simd:expr, $name:ident($($arg:expr),*), $plain:expr) => {{
        #[cfg(target_arch = "x86_64")]
        match $simd {
            // SAFETY: a level is only used after its instructions were found.
            Simd::Avx512 => return unsafe { avx512::$name($($arg),*) },
            // SAFETY: as above.
            Simd::Avx2 => return unsafe { avx2::$name($($arg),*) },
            Simd::Baseline => {}
        }
        let _ = $simd;
        $plain
    }};
}

/// The nearest triangle with 0 < t ≤ `t_max`; of several as near the one of smallest number. The ray is usable.
#[inline]
pub(crate) fn closest(simd: Simd, mesh: &MeshTracer, ray: &Ray) -> Option<LocalHit> {
    at_level!(simd, closest(mesh, ray), closest_any::<Plain>(mesh, ray))
}

/// Whether there is any triangle with 0 < t ≤ `t_max`. The ray is usable.
#[inline]
pub(crate) fn occluded(simd: Simd, mesh: &MeshTracer, ray: &Ray) -> bool {
    at_level!(simd, occluded(mesh, ray), occluded_any::<Plain>(mesh, ray))
}

/// [`closest`] for up to 64 rays, usable or not, with the instance that the mesh is.
pub(crate) fn closest_chunk(
    simd: Simd,
    mesh: &MeshTracer,
    rays: &[Ray],
    instance: u32,
    hits: &mut [Option<Hit>],
) {
    if simd == Simd::Baseline || mesh.is_moving() {
        for (ray, hit) in rays.iter().zip(hits) {
            let found = if ray.is_usable() { closest(simd, mesh, ray) } else { None };
            *hit = found.and_then(|found| hit_in(instance, &found));
        }
        return;
    }
    at_level!(simd, closest_chunk(mesh, rays, instance, hits), ());
}

/// [`occluded`] for up to 64 rays, usable or not: a bit for each.
pub(crate) fn occluded_chunk(simd: Simd, mesh: &MeshTracer, rays: &[Ray]) -> u64 {
    if simd == Simd::Baseline || mesh.is_moving() {
        let mut blocked = 0;
        for (place, ray) in rays.iter().enumerate() {
            blocked |= u64::from(ray.is_usable() && occluded(simd, mesh, ray)) << place;
        }
        return blocked;
    }
    at_level!(simd, occluded_chunk(mesh, rays), 0)
}
