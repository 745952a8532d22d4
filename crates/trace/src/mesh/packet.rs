//! Up to 64 coherent rays through a tree together.
//!
//! Whole packets are first tested against the eight children of a node at once, by interval arithmetic over their
//! origins and inverse directions, which can only err on the side of going in. A child that is reached is then tested by
//! each ray, a register of rays at a time and with the same arithmetic as a single ray; so which leaves a ray visits,
//! and what it finds there, is what it would have found alone, to the last bit (see `walk` for why the order of visits
//! does not matter). When few rays are left in a subtree they go on one by one.
//! Sources: Wald, Slusallek, Benthin, Wagner, Interactive Rendering with Coherent Ray Tracing, 2001; Reshetov, Soupikov,
//! Hurley, Multi-Level Ray Tracing, 2005 (the interval test); Benthin, Wald, Woop, Ernst, Mark, Combining Single and
//! Packet-Ray Tracing, 2012.
//!
//! `unsafe` is needed for indexing without checks, as in `walk`.
#![allow(unsafe_code)]

use std::marker::PhantomData;
use std::mem::MaybeUninit;

use glam::Vec3;

use super::MeshTracer;
use super::block::Block;
use super::build::STACK;
use super::node::{LEAF, Tree};
use super::triangle::{Edges, ShearRay, distances, edges, hit_block, wins};
use super::walk::{BoxRay, CORNER_ROUNDINGS, FAR_SCALE, LEAST_COMPONENT, Reach, Visitor, walk};
use crate::simd::{Lanes, ROUNDOFF};
use crate::{Hit, LocalHit, Ray};

/// Rays in a packet: an 8 × 8 tile of pixels, and the bits of a word.
pub(crate) const PACKET: usize = 64;
/// A subtree that this many rays or fewer reach is walked by each alone. Chosen with `ray_rate` among 1 … 8.
const ALONE: u32 = 3;
/// Fewer rays of one class than this are not worth a packet.
const SMALLEST_PACKET: usize = 12;
/// Rays whose directions differ in a coordinate by more than this part of the longest are not walked together.
const WIDEST_PACKET: f32 = 0.5;
/// A leaf that fewer rays of a register reach is tested ray by ray, eight triangles at a time; above, triangle by
/// triangle.
const RAY_BY_RAY: u32 = 6;

pub(crate) type Values = [f32; PACKET];

/// Rays side by side, all of one octant of directions and one longest axis, made ready as [`BoxRay`] and [`ShearRay`] do.
#[repr(C, align(64))]
pub(crate) struct Packet {
    inverse: [Values; 3],
    near_shift: [Values; 3],
    far_inverse: [Values; 3],
    far_shift: [Values; 3],
    /// In the order of `axes`.
    origin: [Values; 3],
    shear: [Values; 3],
    /// Ends of the rays: the nearest hits so far.
    t: Values,
    u: Values,
    v: Values,
    primitive: [u32; PACKET],
    near_row: [usize; 3],
    axes: [usize; 3],
    beam: Beam,
}

/// Intervals around all rays of a packet.
struct Beam {
    /// Smallest and largest inverse direction.
    inverse: [[f32; 2]; 3],
    /// The origin from which near planes are nearest, and the one from which far planes are farthest, widened as single
    /// rays are.
    near_origin: [f32; 3],
    far_origin: [f32; 3],
}

/// A hit in an instance; none if nothing was found.
#[inline(always)]
pub(crate) fn hit_in(instance: u32, hit: &LocalHit) -> Option<Hit> {
    let found = hit.primitive != u32::MAX;
    found.then_some(Hit { t: hit.t, instance, primitive: hit.primitive, u: hit.u, v: hit.v })
}

/// The numbers of rays that are taken as they come.
pub(crate) const IN_ORDER: [u8; PACKET] = {
    let mut places = [0; PACKET];
    let mut i = 0;
    while i < PACKET {
        places[i] = i as u8;
        i += 1;
    }
    places
};

/// The octant and longest axis of a ray; rays of one packet have it in common.
#[inline(always)]
pub(crate) fn class_of(ray: &Ray) -> u8 {
    let d = ray.direction;
    let signs = d.x.to_bits() >> 31 | (d.y.to_bits() >> 31) << 1 | (d.z.to_bits() >> 31) << 2;
    (signs | (super::triangle::main_axis(d.abs()) as u32) << 3) as u8
}

/// Loads a register's worth at an offset.
#[inline(always)]
fn at<V: Lanes>(values: &Values, group: usize) -> V {
    V::load(&values[group * V::N..(group + 1) * V::N])
}

/// Loads a register's worth of three coordinates.
#[inline(always)]
fn three<V: Lanes>(values: &[Values; 3], group: usize) -> [V; 3] {
    [at(&values[0], group), at(&values[1], group), at(&values[2], group)]
}

/// |x|.
#[inline(always)]
fn magnitude<G: Lanes>(x: G) -> G {
    x.max(G::splat(0.0).sub(x))
}

#[inline(always)]
fn lowest<G: Lanes>(values: G) -> f32 {
    -G::splat(0.0).sub(values).highest()
}

/// Rays, a coordinate at a time.
#[repr(C, align(64))]
pub(crate) struct Columns {
    origins: [Values; 3],
    directions: [Values; 3],
    ends: Values,
}

impl Columns {
    pub(crate) const EMPTY: Columns =
        Columns { origins: [[0.0; PACKET]; 3], directions: [[0.0; PACKET]; 3], ends: [0.0; PACKET] };

    /// The rays that `chosen` names. The places beyond repeat the first of them, with no length.
    #[inline(always)]
    pub(crate) fn gather<V: Lanes>(&mut self, rays: &[Ray], chosen: &[u8]) {
        for block in 0..PACKET / 8 {
            let mut rows = [V::splat(0.0); 8];
            for (lane, row) in rows.iter_mut().enumerate() {
                let place = block * 8 + lane;
                let ray = &rays[chosen[if place < chosen.len() { place } else { 0 }] as usize];
                // SAFETY: a ray is eight floats in C's order.
                *row = V::load(unsafe { &*std::ptr::from_ref(ray).cast::<[f32; 8]>() });
            }
            let [ox, oy, oz, dx, dy, dz, end, _] = V::transpose(rows);
            let span = block * 8..block * 8 + 8;
            ox.store(&mut self.origins[0][span.clone()]);
            oy.store(&mut self.origins[1][span.clone()]);
            oz.store(&mut self.origins[2][span.clone()]);
            dx.store(&mut self.directions[0][span.clone()]);
            dy.store(&mut self.directions[1][span.clone()]);
            dz.store(&mut self.directions[2][span.clone()]);
            end.store(&mut self.ends[span]);
        }
        self.ends[chosen.len()..].fill(0.0);
    }

    /// Whether all rays, of which there are `count`, are usable, of one class, and close in direction.
    #[inline(always)]
    pub(crate) fn go_together<G: Lanes>(&self, count: usize) -> bool {
        let none = G::splat(0.0);
        let all = group_mask::<G>();
        let (mut usable, mut signs, mut mains) = (true, [(0, all); 3], [(0, all); 3]);
        let mut low = [G::splat(f32::INFINITY); 3];
        let mut high = [G::splat(f32::NEG_INFINITY); 3];
        for group in 0..PACKET / G::N {
            let [ox, oy, oz] = three::<G>(&self.origins, group);
            let d = three::<G>(&self.directions, group);
            let [dx, dy, dz] = d;
            let sum = ox.add(oy).add(oz).add(dx.add(dy).add(dz));
            let [ax, ay, az] = [magnitude(dx), magnitude(dy), magnitude(dz)];
            let finite = sum.mul(none).eq(none);
            let moving = none.lt(ax.max(ay).max(az));
            let started = none.lt(at::<G>(&self.ends, group));
            // Places beyond the last ray repeat the first, but for their end.
            let beyond = !(first_rays(count) >> (group * G::N)) as u32;
            usable &= (finite & moving & (started | beyond)) & all == all;
            // The longest axis as `main_axis` finds it.
            let x = ay.le(ax) & az.le(ax);
            let y = az.le(ay) & !x;
            let main = [x, y, !x & !y];
            for axis in 0..3 {
                let negative = d[axis].negative();
                signs[axis] = (signs[axis].0 | negative, signs[axis].1 & negative);
                mains[axis] = (mains[axis].0 | main[axis] & all, mains[axis].1 & main[axis]);
                low[axis] = d[axis].min(low[axis]);
                high[axis] = d[axis].max(high[axis]);
            }
        }
        if !usable || count < SMALLEST_PACKET {
            return false;
        }
        let (mut spread, mut longest) = (0.0_f32, 0.0_f32);
        for axis in 0..3 {
            let one = |(any, every): (u32, u32)| any == 0 || every == all;
            if !one(signs[axis]) || !one(mains[axis]) {
                return false;
            }
            let (low, high) = (lowest(low[axis]), high[axis].highest());
            spread = spread.max(high - low);
            longest = longest.max(high.abs()).max(low.abs());
        }
        spread < WIDEST_PACKET * longest
    }
}

impl Packet {
    /// A packet of no rays.
    pub(crate) const EMPTY: Packet = Packet {
        inverse: [[0.0; PACKET]; 3],
        near_shift: [[0.0; PACKET]; 3],
        far_inverse: [[0.0; PACKET]; 3],
        far_shift: [[0.0; PACKET]; 3],
        origin: [[0.0; PACKET]; 3],
        shear: [[0.0; PACKET]; 3],
        t: [0.0; PACKET],
        u: [0.0; PACKET],
        v: [0.0; PACKET],
        primitive: [u32::MAX; PACKET],
        near_row: [0; 3],
        axes: [0; 3],
        beam: Beam { inverse: [[0.0; 2]; 3], near_origin: [0.0; 3], far_origin: [0.0; 3] },
    };

    /// Makes rays of one class ready, of which `first` is one: as `BoxRay::new` and `ShearRay::new`, operation by
    /// operation, a register of rays at a time.
    #[inline(always)]
    pub(crate) fn prepare<G: Lanes>(&mut self, first: &Ray, columns: &Columns, reach: &Reach) {
        let Columns { origins, directions, ends } = columns;
        self.t = *ends;
        self.axes = ShearRay::new(first).axes;
        self.near_row = BoxRay::new(first, reach).near_row;
        let (centre, half) = reach.parts();
        let forward = [0, 1, 2].map(|axis: usize| self.near_row[axis] & 1 == 0);
        let none = G::splat(0.0);
        let mut widest = none;
        let mut low = [[G::splat(f32::INFINITY); 2]; 3];
        let mut high = [[G::splat(f32::NEG_INFINITY); 2]; 3];
        for group in 0..PACKET / G::N {
            let span = group * G::N..(group + 1) * G::N;
            let (mut largest, mut farthest, mut size) = (none, none, none);
            for axis in 0..3 {
                let (o, d) = (at::<G>(&origins[axis], group), at::<G>(&directions[axis], group));
                largest = magnitude(d).max(largest);
                farthest = magnitude(o.sub(G::splat(centre[axis]))).add(G::splat(half[axis])).max(farthest);
                size = magnitude(o).max(size);
            }
            let least = largest.mul(G::splat(LEAST_COMPONENT));
            let margin =
                G::splat(CORNER_ROUNDINGS * ROUNDOFF).mul(farthest).add(G::splat(4.0 * ROUNDOFF).mul(size));
            widest = margin.max(widest);
            for axis in 0..3 {
                let (o, d) = (at::<G>(&origins[axis], group), at::<G>(&directions[axis], group));
                let sign = G::splat(if forward[axis] { 1.0 } else { -1.0 });
                let inverse = G::splat(1.0).div(magnitude(d).max(least).mul(sign));
                let slack = margin.mul(magnitude(inverse));
                let product = o.mul(inverse);
                inverse.store(&mut self.inverse[axis][span.clone()]);
                product.add(slack).store(&mut self.near_shift[axis][span.clone()]);
                inverse.mul(G::splat(FAR_SCALE)).store(&mut self.far_inverse[axis][span.clone()]);
                product.sub(slack).mul(G::splat(FAR_SCALE)).store(&mut self.far_shift[axis][span.clone()]);
                low[axis] = [inverse.min(low[axis][0]), o.min(low[axis][1])];
                high[axis] = [inverse.max(high[axis][0]), o.max(high[axis][1])];
            }
            let [x, y, z] = self.axes;
            let inverse = G::splat(1.0).div(at::<G>(&directions[z], group));
            at::<G>(&directions[x], group).mul(inverse).store(&mut self.shear[0][span.clone()]);
            at::<G>(&directions[y], group).mul(inverse).store(&mut self.shear[1][span.clone()]);
            inverse.store(&mut self.shear[2][span.clone()]);
        }
        for place in 0..3 {
            self.origin[place] = origins[self.axes[place]];
        }
        // Twice the margin of a single ray: the rest is for the rounding of the test itself.
        let margin = 2.0 * widest.highest();
        for axis in 0..3 {
            self.beam.inverse[axis] = [lowest(low[axis][0]), high[axis][0].highest()];
            let (low, high) = (lowest(low[axis][1]) - margin, high[axis][1].highest() + margin);
            self.beam.near_origin[axis] = if forward[axis] { high } else { low };
            self.beam.far_origin[axis] = if forward[axis] { low } else { high };
        }
    }

    /// What a ray has found in an instance.
    #[inline(always)]
    pub(crate) fn hit(&self, ray: usize, instance: u32) -> Option<Hit> {
        hit_in(instance, &self.best(ray))
    }

    #[inline(always)]
    fn best(&self, ray: usize) -> LocalHit {
        LocalHit { t: self.t[ray], primitive: self.primitive[ray], u: self.u[ray], v: self.v[ray] }
    }

    #[inline(always)]
    fn set_best(&mut self, ray: usize, hit: &LocalHit) {
        (self.t[ray], self.u[ray], self.v[ray], self.primitive[ray]) = (hit.t, hit.u, hit.v, hit.primitive);
    }

    #[inline(always)]
    pub(crate) fn box_ray(&self, ray: usize) -> BoxRay {
        let of = |values: &[Values; 3]| [values[0][ray], values[1][ray], values[2][ray]];
        BoxRay {
            near_row: self.near_row,
            inverse: of(&self.inverse),
            near_shift: of(&self.near_shift),
            far_inverse: of(&self.far_inverse),
            far_shift: of(&self.far_shift),
            time: 0.0,
        }
    }

    /// Where a ray ends, and how to shorten it.
    #[inline(always)]
    pub(crate) fn end(&mut self, ray: usize) -> &mut f32 {
        &mut self.t[ray]
    }

    #[inline(always)]
    fn shear_ray(&self, ray: usize) -> ShearRay {
        let of = |values: &[Values; 3]| [values[0][ray], values[1][ray], values[2][ray]];
        ShearRay { axes: self.axes, origin: of(&self.origin), shear: of(&self.shear), time: 0.0 }
    }

    /// The farthest end of all rays.
    #[inline(always)]
    fn farthest_end<G: Lanes>(&self) -> f32 {
        let mut end = G::splat(0.0);
        for group in 0..PACKET / G::N {
            end = at::<G>(&self.t, group).max(end);
        }
        end.highest()
    }

    /// Ends rays that are done with at once, so that nothing is far enough for them any more.
    #[inline(always)]
    fn finish(&mut self, rays: u64) {
        let mut rest = rays;
        while rest != 0 {
            self.t[rest.trailing_zeros() as usize & (PACKET - 1)] = 0.0;
            rest &= rest - 1;
        }
    }

    /// The rays, of those given, that meet a child's box; where they enter it is written to `nears`.
    #[inline(always)]
    unsafe fn meet<G: Lanes>(
        &self,
        tree: &Tree,
        node: u32,
        slot: usize,
        rays: u64,
        nears: &mut Values,
    ) -> u64 {
        // SAFETY: the caller vouches for node and slot.
        let rows = unsafe { &tree.nodes.get_unchecked(node as usize).rows };
        let mut met = 0;
        for group in 0..PACKET / G::N {
            let here = (rays >> (group * G::N)) as u32 & group_mask::<G>();
            if here == 0 {
                continue;
            }
            let mut near = G::splat(0.0);
            let mut far = at::<G>(&self.t, group);
            for axis in 0..3 {
                // SAFETY: rows are 0 … 5, slots 0 … 7.
                let (near_plane, far_plane) = unsafe {
                    let row = *self.near_row.get_unchecked(axis);
                    (
                        *rows.get_unchecked(row & 7).get_unchecked(slot),
                        *rows.get_unchecked((row ^ 1) & 7).get_unchecked(slot),
                    )
                };
                let (inverse, shift) =
                    (at::<G>(&self.inverse[axis], group), at(&self.near_shift[axis], group));
                near = G::splat(near_plane).mul_sub(inverse, shift).max(near);
                let (inverse, shift) =
                    (at::<G>(&self.far_inverse[axis], group), at(&self.far_shift[axis], group));
                far = G::splat(far_plane).mul_sub(inverse, shift).min(far);
            }
            near.store(&mut nears[group * G::N..]);
            met |= u64::from(near.le(far) & here) << (group * G::N);
        }
        met
    }

    /// Lower bounds of where any ray enters each of a node's children, and a bit for each child that some ray may meet.
    #[inline(always)]
    unsafe fn sweep<V: Lanes>(&self, tree: &Tree, node: u32, end: f32) -> (V, u32) {
        // SAFETY: the caller vouches for the node.
        let rows = unsafe { &tree.nodes.get_unchecked(node as usize).rows };
        let mut near = V::splat(0.0);
        let mut far = V::splat(end);
        for axis in 0..3 {
            // SAFETY: rows are 0 … 5.
            let (near_planes, far_planes) = unsafe {
                let row = *self.near_row.get_unchecked(axis);
                (V::load(rows.get_unchecked(row)), V::load(rows.get_unchecked(row ^ 1)))
            };
            let [low, high] = self.beam.inverse[axis];
            let (low, high) = (V::splat(low), V::splat(high));
            let from = near_planes.sub(V::splat(self.beam.near_origin[axis]));
            let to = far_planes.sub(V::splat(self.beam.far_origin[axis]));
            near = from.mul(low).min(from.mul(high)).max(near);
            far = to.mul(low).max(to.mul(high)).min(far);
        }
        // Twice the allowance of a single ray.
        (near, near.le(far.mul(V::splat(FAR_SCALE * FAR_SCALE))))
    }
}

/// All lanes of a register.
#[inline(always)]
fn group_mask<G: Lanes>() -> u32 {
    ((1_u64 << G::N) - 1) as u32
}

/// Tests rays against a leaf; gives those that found something.
#[inline(always)]
fn hit_leaf<V: Lanes, G: Lanes, const ANY: bool>(
    packet: &mut Packet,
    block: &Block,
    rays: u64,
    nears: &Values,
) -> u64 {
    let mut found = 0;
    for group in 0..PACKET / G::N {
        let here = (rays >> (group * G::N)) as u32 & group_mask::<G>();
        if here == 0 {
            continue;
        }
        if here.count_ones() < RAY_BY_RAY {
            let mut rest = here;
            while rest != 0 {
                let ray = (group * G::N + rest.trailing_zeros() as usize) & (PACKET - 1);
                rest &= rest - 1;
                let mut best = packet.best(ray);
                if hit_block::<V, false, ANY>(block, None, &packet.shear_ray(ray), nears[ray], &mut best) {
                    packet.set_best(ray, &best);
                    found |= 1 << ray;
                }
            }
        } else {
            let mut rest = here;
            for place in 0..8 {
                if block.triangles[place] == u32::MAX || rest == 0 {
                    break;
                }
                let hit = hit_triangle::<G, ANY>(packet, block, place, group, rest, nears);
                found |= u64::from(hit) << (group * G::N);
                if ANY {
                    rest &= !hit;
                }
            }
        }
    }
    found
}

/// One corner of one triangle, sheared for a register of rays: x', y', and z.
#[inline(always)]
fn sheared<G: Lanes>(
    packet: &Packet,
    block: &Block,
    corner: usize,
    place: usize,
    group: usize,
) -> ([G; 2], G) {
    let corner = &block.corners[corner];
    let x = G::splat(corner[packet.axes[0]][place]).sub(at(&packet.origin[0], group));
    let y = G::splat(corner[packet.axes[1]][place]).sub(at(&packet.origin[1], group));
    let z = G::splat(corner[packet.axes[2]][place]).sub(at(&packet.origin[2], group));
    (
        [
            at::<G>(&packet.shear[0], group).neg_mul_add(z, x),
            at::<G>(&packet.shear[1], group).neg_mul_add(z, y),
        ],
        z,
    )
}

/// Tests a register of rays against one triangle, as `hit_block` does one ray against eight.
#[inline(always)]
fn hit_triangle<G: Lanes, const ANY: bool>(
    packet: &mut Packet,
    block: &Block,
    place: usize,
    group: usize,
    rays: u32,
    nears: &Values,
) -> u32 {
    let (a, az) = sheared::<G>(packet, block, 0, place, group);
    let (b, bz) = sheared::<G>(packet, block, 1, place, group);
    let (c, cz) = sheared::<G>(packet, block, 2, place, group);
    let Edges { u, v, w, inside } = edges(a, b, c, rays);
    if inside == 0 {
        return 0;
    }
    let (t, scale) = distances(u, v, w, [az, bz, cz], at(&packet.shear[2], group));
    let end = at::<G>(&packet.t, group);
    let lanes = inside & G::splat(0.0).lt(t) & t.le(end) & t.lt(G::splat(f32::INFINITY));
    if ANY || lanes == 0 {
        return lanes;
    }
    let t = t.max(at(nears, group));
    let mut better = t.lt(end) & lanes;
    let mut equal = t.eq(end) & lanes;
    while equal != 0 {
        let lane = equal.trailing_zeros() as usize;
        equal &= equal - 1;
        let ray = (group * G::N + lane) & (PACKET - 1);
        better |= u32::from(wins(packet.t[ray], block.triangles[place], &packet.best(ray))) << lane;
    }
    let span = group * G::N..(group + 1) * G::N;
    t.store_where(better, &mut packet.t[span.clone()]);
    v.mul(scale).store_where(better, &mut packet.u[span.clone()]);
    w.mul(scale).store_where(better, &mut packet.v[span.clone()]);
    for (lane, primitive) in packet.primitive[span].iter_mut().enumerate() {
        *primitive = if better >> lane & 1 != 0 { block.triangles[place] } else { *primitive };
    }
    better
}

/// A child to be visited, and the rays that met its parent.
#[derive(Clone, Copy)]
struct Visit {
    rays: u64,
    node: u32,
    slot: u32,
    near: f32,
}

/// What is done where a packet ends up; see [`super::walk::Visitor`] for why this is a trait. Rays are the bits of a word.
pub(crate) trait Crowd {
    /// Visits a leaf with the rays that meet it and where they enter it; gives the rays that are done with (have found
    /// all they want), and whether any ray has become shorter.
    fn leaf(&mut self, packet: &mut Packet, leaf: u32, rays: u64, nears: &Values) -> (u64, bool);
    /// Walks one ray alone from a node; gives whether it is done with.
    fn alone(&mut self, packet: &mut Packet, node: u32, ray: usize) -> bool;
}

/// Walks a packet through a tree that stands still; gives the rays that are done with.
///
/// # Safety
/// The tree has a root, its words name only nodes and leaves that exist, and its depth is what the builder allows.
#[inline(always)]
pub(crate) unsafe fn walk_packet<V: Lanes, G: Lanes, C: Crowd>(
    tree: &Tree,
    packet: &mut Packet,
    rays: u64,
    crowd: &mut C,
) -> u64 {
    let mut stack = [const { MaybeUninit::<Visit>::uninit() }; STACK];
    let mut height = 0_usize;
    let mut nears = [0.0_f32; PACKET];
    let mut done = 0_u64;
    let mut end = packet.farthest_end::<G>();
    // The node to open next, with the rays that reach it.
    let mut opened = Some((0_u32, rays));
    loop {
        if let Some((node, rays)) = opened.take() {
            // SAFETY: `node` is a node of the tree.
            let (near, mut met) = unsafe { packet.sweep::<V>(tree, node, end) };
            let mut bounds = [0.0_f32; 8];
            near.store(&mut bounds);
            let base = height;
            while met != 0 {
                let slot = met.trailing_zeros() & 7;
                met &= met - 1;
                let visit = Visit { rays, node, slot, near: bounds[slot as usize] };
                // SAFETY: places from `base` to `height` are filled; the stack is as deep as the tree needs, one place a
                // level more than for single rays, which keep one child in hand: see `STACK`.
                unsafe {
                    let mut place = height;
                    while place > base && stack.get_unchecked(place - 1).assume_init_ref().near < visit.near {
                        *stack.get_unchecked_mut(place) = *stack.get_unchecked(place - 1);
                        place -= 1;
                    }
                    stack.get_unchecked_mut(place).write(visit);
                }
                height += 1;
            }
        }
        if height == 0 {
            return done;
        }
        height -= 1;
        // SAFETY: places below `height` are filled.
        let visit = unsafe { stack.get_unchecked(height).assume_init() };
        if visit.near > end {
            continue;
        }
        // SAFETY: visits name nodes of the tree and slots of nodes.
        let (met, child) = unsafe {
            (
                packet.meet::<G>(tree, visit.node, visit.slot as usize, visit.rays & !done, &mut nears),
                *tree
                    .nodes
                    .get_unchecked(visit.node as usize)
                    .children
                    .get_unchecked(visit.slot as usize & 7),
            )
        };
        if met == 0 {
            continue;
        }
        if child & LEAF != 0 {
            let (finished, changed) = crowd.leaf(packet, child & !LEAF, met, &nears);
            done |= finished;
            packet.finish(finished);
            if changed || finished != 0 {
                end = packet.farthest_end::<G>();
            }
        } else if met.count_ones() <= ALONE {
            let mut rest = met;
            while rest != 0 {
                let ray = rest.trailing_zeros() as usize & (PACKET - 1);
                rest &= rest - 1;
                done |= u64::from(crowd.alone(packet, child, ray)) << ray;
            }
            packet.finish(done & met);
            end = packet.farthest_end::<G>();
        } else {
            opened = Some((child, met));
        }
        if rays & !done == 0 {
            return done;
        }
    }
}

/// Leaves of a mesh that stands still, for one ray or for a packet. With `ANY` a ray is done with at its first hit.
pub(crate) struct Triangles<'a, V, G, const ANY: bool> {
    mesh: &'a MeshTracer,
    shear: ShearRay,
    best: LocalHit,
    lanes: PhantomData<(V, G)>,
}

impl<V: Lanes, G: Lanes, const ANY: bool> Visitor for Triangles<'_, V, G, ANY> {
    #[inline(always)]
    fn leaf(&mut self, leaf: u32, near: f32, end: f32) -> f32 {
        // SAFETY: the tree names only blocks that exist.
        let block = unsafe { self.mesh.blocks.get_unchecked(leaf as usize) };
        let found = hit_block::<V, false, ANY>(block, None, &self.shear, near, &mut self.best);
        match (ANY, found) {
            (true, true) => -1.0,
            (true, false) => end,
            (false, _) => self.best.t,
        }
    }
}

impl<V: Lanes, G: Lanes, const ANY: bool> Crowd for Triangles<'_, V, G, ANY> {
    #[inline(always)]
    fn leaf(&mut self, packet: &mut Packet, leaf: u32, rays: u64, nears: &Values) -> (u64, bool) {
        // SAFETY: the tree names only blocks that exist.
        let block = unsafe { self.mesh.blocks.get_unchecked(leaf as usize) };
        let found = hit_leaf::<V, G, ANY>(packet, block, rays, nears);
        if ANY { (found, false) } else { (0, found != 0) }
    }

    #[inline(always)]
    fn alone(&mut self, packet: &mut Packet, node: u32, ray: usize) -> bool {
        self.shear = packet.shear_ray(ray);
        self.best = packet.best(ray);
        let start = self.best.t;
        let mut stopped = Stopped { inner: self, stopped: false };
        // SAFETY: the node is the tree's, and the tree came from the builder.
        unsafe {
            if ANY {
                walk::<V, false, false, _>(
                    &stopped.inner.mesh.tree,
                    node,
                    &packet.box_ray(ray),
                    start,
                    &mut stopped,
                );
            } else {
                walk::<V, false, true, _>(
                    &stopped.inner.mesh.tree,
                    node,
                    &packet.box_ray(ray),
                    start,
                    &mut stopped,
                );
            }
        }
        let stopped = stopped.stopped;
        packet.set_best(ray, &self.best);
        stopped
    }
}

/// Notes whether a visitor stopped the walk.
struct Stopped<'a, T> {
    inner: &'a mut T,
    stopped: bool,
}

impl<T: Visitor> Visitor for Stopped<'_, T> {
    #[inline(always)]
    fn leaf(&mut self, leaf: u32, near: f32, end: f32) -> f32 {
        let end = self.inner.leaf(leaf, near, end);
        self.stopped |= end < 0.0;
        end
    }
}

/// Walks a packet through a mesh that stands still: nearest hits are left in the packet; with `ANY` the rays that meet
/// anything are given.
#[inline(always)]
pub(crate) fn trace<V: Lanes, G: Lanes, const ANY: bool>(
    mesh: &MeshTracer,
    packet: &mut Packet,
    rays: u64,
) -> u64 {
    let mut triangles =
        Triangles::<V, G, ANY> { mesh, shear: packet.shear_ray(0), best: packet.best(0), lanes: PhantomData };
    // SAFETY: the caller looked that the tree has a root; the tree came from the builder.
    unsafe { walk_packet::<V, G, _>(&mesh.tree, packet, rays, &mut triangles) }
}

/// Sorts up to 64 rays into packets of one class, and rays that had better go alone.
pub(crate) struct Sorting<'a> {
    rays: &'a [Ray],
    classes: [u8; PACKET],
    left: u64,
}

impl<'a> Sorting<'a> {
    #[inline(always)]
    pub(crate) fn new(rays: &'a [Ray]) -> Sorting<'a> {
        let mut sorting = Sorting { rays, classes: [u8::MAX; PACKET], left: 0 };
        for (place, ray) in rays.iter().enumerate() {
            if ray.is_usable() {
                sorting.classes[place] = class_of(ray);
                sorting.left |= 1 << place;
            }
        }
        sorting
    }

    /// The next rays of one class, their number, and whether they should go together; none when all are taken.
    #[inline(always)]
    pub(crate) fn next(&mut self, chosen: &mut [u8; PACKET]) -> Option<(usize, bool)> {
        if self.left == 0 {
            return None;
        }
        let first = self.left.trailing_zeros() as usize;
        let mut count = 0;
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for place in first..self.rays.len() {
            if self.left >> place & 1 != 0 && self.classes[place] == self.classes[first] {
                chosen[count & (PACKET - 1)] = place as u8;
                count += 1;
                self.left &= !(1 << place);
                low = low.min(self.rays[place].direction);
                high = high.max(self.rays[place].direction);
            }
        }
        let spread = (high - low).max_element();
        let longest = high.abs().max(low.abs()).max_element();
        Some((count, count >= SMALLEST_PACKET && spread < WIDEST_PACKET * longest))
    }
}

/// The bits of the first `count` rays.
#[inline(always)]
pub(crate) fn first_rays(count: usize) -> u64 {
    u64::MAX >> (PACKET - count)
}
