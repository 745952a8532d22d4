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

use super::columns::Columns;
use super::node::Tree;
use super::triangle::ShearRay;
use super::walk::{BoxRay, CORNER_ROUNDINGS, FAR_SCALE, LEAST_COMPONENT, Reach};
use crate::simd::{Lanes, ROUNDOFF};
use crate::{Hit, LocalHit, Ray};

/// Rays in a packet: an 8 × 8 tile of pixels, and the bits of a word.
pub(crate) const PACKET: usize = 64;
pub(crate) type Values = [f32; PACKET];

/// Rays side by side, all of one octant of directions and one longest axis, made ready as [`BoxRay`] and [`ShearRay`] do.
#[repr(C, align(64))]
pub(crate) struct Packet {
    inverse: [Values; 3],
    near_shift: [Values; 3],
    far_inverse: [Values; 3],
    far_shift: [Values; 3],
    /// In the order of `axes`.
    pub(super) origin: [Values; 3],
    pub(super) shear: [Values; 3],
    /// Ends of the rays: the nearest hits so far.
    pub(super) t: Values,
    pub(super) u: Values,
    pub(super) v: Values,
    pub(super) primitive: [u32; PACKET],
    near_row: [usize; 3],
    pub(super) axes: [usize; 3],
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

/// Loads a register's worth at an offset.
#[inline(always)]
pub(super) fn at<V: Lanes>(values: &Values, group: usize) -> V {
    V::load(&values[group * V::N..(group + 1) * V::N])
}

/// Loads a register's worth of three coordinates.
#[inline(always)]
pub(super) fn three<V: Lanes>(values: &[Values; 3], group: usize) -> [V; 3] {
    [at(&values[0], group), at(&values[1], group), at(&values[2], group)]
}

/// |x|.
#[inline(always)]
pub(super) fn magnitude<G: Lanes>(x: G) -> G {
    x.max(G::splat(0.0).sub(x))
}

#[inline(always)]
pub(super) fn lowest<G: Lanes>(values: G) -> f32 {
    -G::splat(0.0).sub(values).highest()
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
    pub(super) fn best(&self, ray: usize) -> LocalHit {
        LocalHit { t: self.t[ray], primitive: self.primitive[ray], u: self.u[ray], v: self.v[ray] }
    }

    #[inline(always)]
    pub(super) fn set_best(&mut self, ray: usize, hit: &LocalHit) {
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
    pub(super) fn shear_ray(&self, ray: usize) -> ShearRay {
        let of = |values: &[Values; 3]| [values[0][ray], values[1][ray], values[2][ray]];
        ShearRay { axes: self.axes, origin: of(&self.origin), shear: of(&self.shear), time: 0.0 }
    }

    /// The farthest end of all rays.
    #[inline(always)]
    pub(super) fn farthest_end<G: Lanes>(&self) -> f32 {
        let mut end = G::splat(0.0);
        for group in 0..PACKET / G::N {
            end = at::<G>(&self.t, group).max(end);
        }
        end.highest()
    }

    /// Ends rays that are done with at once, so that nothing is far enough for them any more.
    #[inline(always)]
    pub(super) fn finish(&mut self, rays: u64) {
        let mut rest = rays;
        while rest != 0 {
            self.t[rest.trailing_zeros() as usize & (PACKET - 1)] = 0.0;
            rest &= rest - 1;
        }
    }

    /// The rays, of those given, that meet a child's box; where they enter it is written to `nears`.
    #[inline(always)]
    pub(super) unsafe fn meet<G: Lanes>(
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
    pub(super) unsafe fn sweep<V: Lanes>(&self, tree: &Tree, node: u32, end: f32) -> (V, u32) {
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
pub(super) fn group_mask<G: Lanes>() -> u32 {
    ((1_u64 << G::N) - 1) as u32
}
