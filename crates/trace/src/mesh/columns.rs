//! Which rays go together: sorting up to 64 of them by octant and longest axis, and turning them from rows to columns.
//!
//! Most packets are neighbours in a picture and all of one kind: that is found out a register of rays at a time, after
//! they have been turned. Only if it is not so are they sorted one by one.
//!
//! `unsafe` is needed to see a ray as the eight floats that it is.
#![allow(unsafe_code)]

use glam::Vec3;

use super::packet::{PACKET, Values, at, group_mask, lowest, magnitude, three};
use super::triangle::main_axis;
use crate::Ray;
use crate::simd::Lanes;

/// Fewer rays of one class than this are not worth a packet.
const SMALLEST_PACKET: usize = 12;
/// Rays whose directions differ in a coordinate by more than this part of the longest are not walked together.
const WIDEST_PACKET: f32 = 0.5;
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
    (signs | (main_axis(d.abs()) as u32) << 3) as u8
}

/// Rays, a coordinate at a time.
#[repr(C, align(64))]
pub(crate) struct Columns {
    pub(super) origins: [Values; 3],
    pub(super) directions: [Values; 3],
    pub(super) ends: Values,
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
