//! Many rays through the tree of instances: packets down to the instance, and packets again within it.
//!
//! `unsafe` is needed to call the copies compiled for AVX2 and AVX-512, and for the walks, which trust the tree.
#![allow(unsafe_code)]

use std::marker::PhantomData;

use super::place::{Kind, Place};
use super::query::{self, closest_in, hit_of, keep, occluded_in};
use super::{Many, Top, World};
use crate::mesh::columns::{Columns, Sorting, first_rays};
use crate::mesh::levels;
use crate::mesh::packet::{PACKET, Packet, Values};
use crate::mesh::packet_walk::{Crowd, walk_packet};
use crate::mesh::walk::walk;
use crate::simd::{Lanes, Simd};
#[cfg(target_arch = "x86_64")]
use crate::simd::{Wide8, Wide16};
use crate::{Geometry, Hit, Ray};

const NO_RAY: Ray = Ray { origin: glam::Vec3::ZERO, direction: glam::Vec3::ZERO, t_max: 0.0, time: 0.0 };

/// Up to 64 rays in the space of a geometry. A ray that has no way there is one that meets nothing.
fn in_place<'a>(place: &Place, rays: &'a [Ray], room: &'a mut [Ray; PACKET]) -> &'a [Ray] {
    if matches!(place.kind, Kind::Here) {
        return rays;
    }
    for (local, ray) in room.iter_mut().zip(rays) {
        *local = place.local_ray(ray).unwrap_or(NO_RAY);
    }
    &room[..rays.len()]
}

/// Asks one instance with up to 64 rays.
pub(super) fn closest_of(world: &World, number: u32, rays: &[Ray], hits: &mut [Option<Hit>]) {
    match world.instances[number as usize].geometry.as_ref() {
        Geometry::Mesh(mesh) => {
            let mut room = [NO_RAY; PACKET];
            let local = in_place(&world.places[number as usize], rays, &mut room);
            levels::closest_chunk(world.simd, mesh, local, number, hits);
        }
        _ => {
            for (ray, hit) in rays.iter().zip(hits) {
                let found = if ray.is_usable() { closest_in(world, number, ray) } else { None };
                *hit = found.map(|found| hit_of(number, found));
            }
        }
    }
}

/// Asks one instance with up to 64 rays: a bit for each that is blocked.
fn occluded_of(world: &World, number: u32, rays: &[Ray]) -> u64 {
    match world.instances[number as usize].geometry.as_ref() {
        Geometry::Mesh(mesh) => {
            let mut room = [NO_RAY; PACKET];
            levels::occluded_chunk(
                world.simd,
                mesh,
                in_place(&world.places[number as usize], rays, &mut room),
            )
        }
        _ => {
            let mut blocked = 0;
            for (place, ray) in rays.iter().enumerate() {
                blocked |= u64::from(ray.is_usable() && occluded_in(world, number, ray)) << place;
            }
            blocked
        }
    }
}

/// The rays of a mask, side by side, each with its place in the packet.
#[inline(always)]
fn gather(
    rays: &[Ray],
    chosen: &[u8],
    mask: u64,
    room: &mut [Ray; PACKET],
    places: &mut [u8; PACKET],
) -> usize {
    let mut count = 0;
    let mut rest = mask;
    while rest != 0 {
        let place = rest.trailing_zeros() as usize;
        rest &= rest - 1;
        room[count] = rays[chosen[place] as usize];
        places[count] = place as u8;
        count += 1;
    }
    count
}

/// The instances, for packets. With `ANY` a ray is done with at its first hit.
struct Instances<'a, V, const ANY: bool> {
    world: &'a World,
    many: &'a Many,
    rays: &'a [Ray],
    chosen: &'a [u8],
    best: [Option<Hit>; PACKET],
    lanes: PhantomData<V>,
}

impl<V: Lanes, const ANY: bool> Crowd for Instances<'_, V, ANY> {
    #[inline(always)]
    fn leaf(&mut self, packet: &mut Packet, leaf: u32, rays: u64, nears: &Values) -> (u64, bool) {
        let number = self.many.instances[leaf as usize];
        let (mut room, mut places) = ([NO_RAY; PACKET], [0; PACKET]);
        let count = gather(self.rays, self.chosen, rays, &mut room, &mut places);
        if ANY {
            let found = occluded_of(self.world, number, &room[..count]);
            let done = |(bit, &place): (usize, &u8)| (found >> bit & 1) << place;
            return (places[..count].iter().enumerate().map(done).fold(0, |all, bit| all | bit), false);
        }
        for (ray, &place) in room[..count].iter_mut().zip(&places) {
            ray.t_max = *packet.end(place as usize);
        }
        let mut found = [None; PACKET];
        closest_of(self.world, number, &room[..count], &mut found[..count]);
        for (found, &place) in found[..count].iter().zip(&places) {
            let place = place as usize;
            if let Some(found) = found {
                keep(&mut self.best[place], *found, nears[place]);
                if let Some(best) = self.best[place] {
                    *packet.end(place) = best.t;
                }
            }
        }
        (0, true)
    }

    #[inline(always)]
    fn alone(&mut self, packet: &mut Packet, node: u32, ray: usize) -> bool {
        let mut visit = query::Visit::<ANY> {
            world: self.world,
            many: self.many,
            ray: &self.rays[self.chosen[ray] as usize],
            best: self.best[ray],
            blocked: false,
        };
        let end = *packet.end(ray);
        // SAFETY: the node is the tree's, and the tree came from the builder.
        unsafe { walk::<V, false, true, _>(&self.many.tree, node, &packet.box_ray(ray), end, &mut visit) };
        self.best[ray] = visit.best;
        if let Some(best) = visit.best {
            *packet.end(ray) = best.t;
        }
        visit.blocked
    }
}

#[inline(always)]
fn closest_body<V: Lanes, G: Lanes>(world: &World, many: &Many, rays: &[Ray], hits: &mut [Option<Hit>]) {
    hits.fill(None);
    let mut columns = Columns::EMPTY;
    let mut sorting = Sorting::new(rays);
    let mut chosen = [0; PACKET];
    while let Some((count, together)) = sorting.next(&mut chosen) {
        let chosen = &chosen[..count];
        if together {
            let mut packet = Packet::EMPTY;
            columns.gather::<V>(rays, chosen);
            packet.prepare::<G>(&rays[chosen[0] as usize], &columns, &many.reach);
            let mut instances =
                Instances::<V, false> { world, many, rays, chosen, best: [None; PACKET], lanes: PhantomData };
            // SAFETY: a tree of many has a root and came from the builder.
            unsafe { walk_packet::<V, G, _>(&many.tree, &mut packet, first_rays(count), &mut instances) };
            for (place, &ray) in chosen.iter().enumerate() {
                hits[ray as usize] = instances.best[place];
            }
        } else {
            for &ray in chosen {
                hits[ray as usize] = query::closest(world, &rays[ray as usize]);
            }
        }
    }
}

#[inline(always)]
fn occluded_body<V: Lanes, G: Lanes>(world: &World, many: &Many, rays: &[Ray]) -> u64 {
    let mut blocked = 0;
    let mut columns = Columns::EMPTY;
    let mut sorting = Sorting::new(rays);
    let mut chosen = [0; PACKET];
    while let Some((count, together)) = sorting.next(&mut chosen) {
        let chosen = &chosen[..count];
        if together {
            let mut packet = Packet::EMPTY;
            columns.gather::<V>(rays, chosen);
            packet.prepare::<G>(&rays[chosen[0] as usize], &columns, &many.reach);
            let mut instances =
                Instances::<V, true> { world, many, rays, chosen, best: [None; PACKET], lanes: PhantomData };
            // SAFETY: a tree of many has a root and came from the builder.
            let found =
                unsafe { walk_packet::<V, G, _>(&many.tree, &mut packet, first_rays(count), &mut instances) };
            for (place, &ray) in chosen.iter().enumerate() {
                blocked |= (found >> place & 1) << ray;
            }
        } else {
            for &ray in chosen {
                blocked |= u64::from(query::occluded(world, &rays[ray as usize])) << ray;
            }
        }
    }
    blocked
}

/// Copies of both queries for one set of instructions.
#[cfg(target_arch = "x86_64")]
macro_rules! level {
    ($name:ident, $features:literal, $v:ty, $g:ty) => {
        mod $name {
            use super::*;

            #[target_feature(enable = $features)]
            pub(super) fn closest(world: &World, many: &Many, rays: &[Ray], hits: &mut [Option<Hit>]) {
                closest_body::<$v, $g>(world, many, rays, hits);
            }

            #[target_feature(enable = $features)]
            pub(super) fn occluded(world: &World, many: &Many, rays: &[Ray]) -> u64 {
                occluded_body::<$v, $g>(world, many, rays)
            }
        }
    };
}

#[cfg(target_arch = "x86_64")]
level!(avx2, "avx2,fma,bmi1,bmi2,lzcnt,popcnt", Wide8, Wide8);
#[cfg(target_arch = "x86_64")]
level!(avx512, "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt", Wide8, Wide16);

/// Asks a tree that stands still, if this machine has the instructions for packets.
fn closest_of_many(world: &World, many: &Many, rays: &[Ray], hits: &mut [Option<Hit>]) -> bool {
    #[cfg(target_arch = "x86_64")]
    if many.tree.close.is_empty() {
        match world.simd {
            // SAFETY: a world has only a level whose instructions were found.
            Simd::Avx512 => unsafe { avx512::closest(world, many, rays, hits) },
            // SAFETY: as above.
            Simd::Avx2 => unsafe { avx2::closest(world, many, rays, hits) },
            Simd::Baseline => return false,
        }
        return true;
    }
    let _ = (world, many, rays, hits);
    false
}

/// As `closest_of_many`: a bit for each ray that is blocked.
fn occluded_of_many(world: &World, many: &Many, rays: &[Ray]) -> Option<u64> {
    #[cfg(target_arch = "x86_64")]
    if many.tree.close.is_empty() {
        return match world.simd {
            // SAFETY: a world has only a level whose instructions were found.
            Simd::Avx512 => Some(unsafe { avx512::occluded(world, many, rays) }),
            // SAFETY: as above.
            Simd::Avx2 => Some(unsafe { avx2::occluded(world, many, rays) }),
            Simd::Baseline => None,
        };
    }
    let _ = (world, many, rays);
    None
}

pub(super) fn closest_packet(world: &World, rays: &[Ray], hits: &mut [Option<Hit>]) {
    for (rays, hits) in rays.chunks(PACKET).zip(hits.chunks_mut(PACKET)) {
        match &world.top {
            Top::Nothing => hits.fill(None),
            Top::One(number) => {
                closest_of(world, *number, rays, hits);
            }
            Top::Many(many) => {
                if !closest_of_many(world, many, rays, hits) {
                    for (ray, hit) in rays.iter().zip(hits) {
                        *hit = query::closest(world, ray);
                    }
                }
            }
        }
    }
}

pub(super) fn occluded_packet(world: &World, rays: &[Ray], blocked: &mut [bool]) {
    for (rays, blocked) in rays.chunks(PACKET).zip(blocked.chunks_mut(PACKET)) {
        let bits = match &world.top {
            Top::Nothing => 0,
            Top::One(number) => occluded_of(world, *number, rays),
            Top::Many(many) => occluded_of_many(world, many, rays).unwrap_or_else(|| {
                let bit = |(place, ray)| u64::from(query::occluded(world, ray)) << place;
                rays.iter().enumerate().map(bit).fold(0, |all, bit| all | bit)
            }),
        };
        for (place, blocked) in blocked.iter_mut().enumerate() {
            *blocked = bits >> place & 1 != 0;
        }
    }
}
