//! Whether rays that go everywhere are blocked, many at once.
//!
//! Rays without a common direction gain nothing from packets. What they gain from is doing one thing at a time: in a
//! world of a few instances first every ray is held against the boxes of all of them, then each instance is asked with
//! the rays that meet its box and are not blocked yet, those first that answer soonest. The answers are those of
//! [`query::occluded`](super::query::occluded).
//!
//! `unsafe` is needed to call the copies compiled for AVX2 and AVX-512, and for the box test, which trusts the tree.
#![allow(unsafe_code)]

use super::query::{self, occluded_in};
use super::{Many, Top, World};
use crate::mesh::levels;
use crate::mesh::packet::PACKET;
use crate::mesh::walk::{BoxRay, WideBoxRay};
#[cfg(target_arch = "x86_64")]
use crate::simd::Wide8;
use crate::simd::{Lanes, Simd};
use crate::{Geometry, Ray};

/// Instances whose boxes are held against a ray in one test.
const FEW: usize = 8;

/// The places in the root of a world of few instances, those of cheap geometry first.
fn in_order(world: &World, many: &Many) -> [u8; FEW] {
    let mut order = [0, 1, 2, 3, 4, 5, 6, 7];
    let cost = |slot: u8| match many.instances.get(leaf_of(many, slot)) {
        Some(&number) => match world.instances[number as usize].geometry.as_ref() {
            Geometry::Rectangle(_) | Geometry::Disk(_) => 0,
            Geometry::Spheres(_) => 1,
            Geometry::Mesh(_) | Geometry::HeightField(_) | Geometry::Custom(_) => 2,
        },
        None => 3,
    };
    order.sort_by_key(|&slot| cost(slot));
    order
}

/// The leaf in a place of the root; beyond all leaves if there is none.
fn leaf_of(many: &Many, slot: u8) -> usize {
    (many.tree.nodes[0].children[slot as usize] ^ crate::mesh::node::LEAF) as usize
}

/// A bit for each of up to 64 rays that is blocked, in a world whose tree is one node that stands still.
#[inline(always)]
fn occluded_by_few<V: Lanes>(world: &World, many: &Many, rays: &[Ray]) -> u64 {
    let mut met = [0_u32; PACKET];
    for (ray, met) in rays.iter().zip(&mut met) {
        if ray.is_usable() {
            let wide = WideBoxRay::<V>::new(&BoxRay::new(ray, &many.reach));
            // SAFETY: the tree has a root.
            *met = unsafe { wide.meet::<false>(&many.tree, 0, ray.t_max) }.1;
        }
    }
    let mut blocked = 0;
    for slot in in_order(world, many) {
        let mut asked = 0_u64;
        for (place, met) in met[..rays.len()].iter().enumerate() {
            asked |= u64::from(met >> slot & 1) << place;
        }
        asked &= !blocked;
        if asked != 0 {
            blocked |= occluded_by_one::<V>(world, many.instances[leaf_of(many, slot)], rays, asked);
        }
    }
    blocked
}

/// Which of the asked rays an instance blocks. (Loops, not closures: a closure that is not inlined would be compiled
/// without the instructions of the level.)
#[inline(always)]
fn occluded_by_one<V: Lanes>(world: &World, number: u32, rays: &[Ray], asked: u64) -> u64 {
    let place = &world.places[number as usize];
    let (mut rest, mut blocked) = (asked, 0);
    let mesh = match world.instances[number as usize].geometry.as_ref() {
        Geometry::Mesh(mesh) => Some(mesh),
        _ => None,
    };
    while rest != 0 {
        let bit = rest & rest.wrapping_neg();
        let ray = &rays[rest.trailing_zeros() as usize];
        rest ^= bit;
        let found = match mesh {
            Some(mesh) => match place.local_ray(ray) {
                Some(local) => levels::occluded_any::<V>(mesh, &local),
                None => false,
            },
            None => occluded_in(world, number, ray),
        };
        if found {
            blocked |= bit;
        }
    }
    blocked
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
fn few_avx2(world: &World, many: &Many, rays: &[Ray]) -> u64 {
    occluded_by_few::<Wide8>(world, many, rays)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
fn few_avx512(world: &World, many: &Many, rays: &[Ray]) -> u64 {
    occluded_by_few::<Wide8>(world, many, rays)
}

/// As [`occluded_by_few`], or none where that is not the way.
fn few(world: &World, rays: &[Ray]) -> Option<u64> {
    let Top::Many(many) = &world.top else { return None };
    if many.tree.nodes.len() != 1 || !many.tree.close.is_empty() {
        return None;
    }
    #[cfg(target_arch = "x86_64")]
    match world.simd {
        // SAFETY: a world has only a level whose instructions were found.
        Simd::Avx512 => return Some(unsafe { few_avx512(world, many, rays) }),
        // SAFETY: as above.
        Simd::Avx2 => return Some(unsafe { few_avx2(world, many, rays) }),
        Simd::Baseline => {}
    }
    None
}

pub(super) fn occluded_scattered(world: &World, rays: &[Ray], blocked: &mut [bool]) {
    for (rays, blocked) in rays.chunks(PACKET).zip(blocked.chunks_mut(PACKET)) {
        match few(world, rays) {
            Some(bits) => {
                for (place, blocked) in blocked.iter_mut().enumerate() {
                    *blocked = bits >> place & 1 != 0;
                }
            }
            None => {
                for (ray, blocked) in rays.iter().zip(blocked) {
                    *blocked = query::occluded(world, ray);
                }
            }
        }
    }
}
