//! A packet's way through a tree, and what it does in the leaves of a mesh. See `packet`.
//!
//! `unsafe` is needed for indexing without checks, as in `walk`.
#![allow(unsafe_code)]

use std::marker::PhantomData;
use std::mem::MaybeUninit;

use super::MeshTracer;
use super::block::Block;
use super::build::STACK;
use super::node::{LEAF, Tree};
use super::packet::{PACKET, Packet, Values, at, group_mask};
use super::triangle::{Edges, ShearRay, distances, edges, hit_block, wins};
use super::walk::{Visitor, walk};
use crate::LocalHit;
use crate::simd::Lanes;

/// A subtree that this many rays or fewer reach is walked by each alone. Chosen with `ray_rate` among 1 … 8.
const ALONE: u32 = 3;
/// A leaf that fewer rays of a register reach is tested ray by ray, eight triangles at a time; above, triangle by
/// triangle.
const RAY_BY_RAY: u32 = 6;

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
