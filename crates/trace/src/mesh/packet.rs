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
use crate::{LocalHit, Ray};

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

impl Packet {
    /// Makes rays ready: those that `chosen` names, all of one class. The places beyond repeat the first of them.
    #[inline(always)]
    pub(crate) fn new<'a>(
        rays: &[Ray],
        chosen: &[u8],
        reach: &Reach,
        room: &'a mut MaybeUninit<Packet>,
    ) -> &'a mut Packet {
        let first = rays[chosen[0] as usize];
        let shear_of_first = ShearRay::new(&first);
        let axes = shear_of_first.axes;
        let near_row = BoxRay::new(&first, reach).near_row;
        let mut origins = [[0.0_f32; PACKET]; 3];
        let mut directions = [[0.0_f32; PACKET]; 3];
        let mut t = [0.0_f32; PACKET];
        for place in 0..PACKET {
            let ray = &rays[chosen[if place < chosen.len() { place } else { 0 }] as usize];
            let (o, d) = (ray.origin, ray.direction);
            (origins[0][place], origins[1][place], origins[2][place]) = (o.x, o.y, o.z);
            (directions[0][place], directions[1][place], directions[2][place]) = (d.x, d.y, d.z);
            t[place] = ray.t_max;
        }
        // From here on as `BoxRay::new` and `ShearRay::new`, operation by operation.
        let (centre, half) = reach.parts();
        let mut least = [0.0_f32; PACKET];
        let mut margin = [0.0_f32; PACKET];
        for i in 0..PACKET {
            let largest = directions[0][i].abs().max(directions[1][i].abs()).max(directions[2][i].abs());
            least[i] = largest * LEAST_COMPONENT;
            let mut farthest = 0.0_f32;
            let mut size = 0.0_f32;
            for axis in 0..3 {
                farthest = farthest.max((origins[axis][i] - centre[axis]).abs() + half[axis]);
                size = size.max(origins[axis][i].abs());
            }
            margin[i] = (CORNER_ROUNDINGS * ROUNDOFF) * farthest + (4.0 * ROUNDOFF) * size;
        }
        let packet = room.as_mut_ptr();
        let mut beam = Beam { inverse: [[0.0; 2]; 3], near_origin: [0.0; 3], far_origin: [0.0; 3] };
        // SAFETY: each field is written once and none is read before; `packet` is valid for writes.
        unsafe {
            for axis in 0..3 {
                let mut low = [f32::INFINITY; 2];
                let mut high = [f32::NEG_INFINITY; 2];
                let mut widest = 0.0_f32;
                for i in 0..PACKET {
                    let component = directions[axis][i].abs().max(least[i]).copysign(directions[axis][i]);
                    let inverse = 1.0 / component;
                    let slack = margin[i] * inverse.abs();
                    (*packet).inverse[axis][i] = inverse;
                    (*packet).near_shift[axis][i] = origins[axis][i] * inverse + slack;
                    (*packet).far_inverse[axis][i] = inverse * FAR_SCALE;
                    (*packet).far_shift[axis][i] = (origins[axis][i] * inverse - slack) * FAR_SCALE;
                    low = [low[0].min(inverse), low[1].min(origins[axis][i])];
                    high = [high[0].max(inverse), high[1].max(origins[axis][i])];
                    widest = widest.max(margin[i]);
                }
                beam.inverse[axis] = [low[0], high[0]];
                // Twice the margin of a single ray: the rest is for the rounding of the test itself.
                let (low, high) = (low[1] - 2.0 * widest, high[1] + 2.0 * widest);
                let forward = near_row[axis] & 1 == 0;
                beam.near_origin[axis] = if forward { high } else { low };
                beam.far_origin[axis] = if forward { low } else { high };
            }
            for i in 0..PACKET {
                let inverse = 1.0 / directions[axes[2]][i];
                (*packet).shear[0][i] = directions[axes[0]][i] * inverse;
                (*packet).shear[1][i] = directions[axes[1]][i] * inverse;
                (*packet).shear[2][i] = inverse;
            }
            for place in 0..3 {
                (*packet).origin[place] = origins[axes[place]];
            }
            (*packet).t = t;
            (*packet).u = [0.0; PACKET];
            (*packet).v = [0.0; PACKET];
            (*packet).primitive = [u32::MAX; PACKET];
            (*packet).near_row = near_row;
            (*packet).axes = axes;
            (*packet).beam = beam;
            room.assume_init_mut()
        }
    }

    /// What a ray has found.
    #[inline(always)]
    pub(crate) fn hit(&self, ray: usize) -> Option<LocalHit> {
        let hit = self.best(ray);
        (hit.primitive != u32::MAX).then_some(hit)
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

    /// The farthest end of some rays.
    #[inline(always)]
    fn farthest_end(&self, rays: u64) -> f32 {
        let mut end = 0.0_f32;
        for i in 0..PACKET {
            let t = if rays >> i & 1 != 0 { self.t[i] } else { 0.0 };
            end = if t > end { t } else { end };
        }
        end
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
    let mut end = packet.farthest_end(rays);
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
            if changed || finished != 0 {
                end = packet.farthest_end(rays & !done);
            }
        } else if met.count_ones() <= ALONE {
            let mut rest = met;
            while rest != 0 {
                let ray = rest.trailing_zeros() as usize & (PACKET - 1);
                rest &= rest - 1;
                done |= u64::from(crowd.alone(packet, child, ray)) << ray;
            }
            end = packet.farthest_end(rays & !done);
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
