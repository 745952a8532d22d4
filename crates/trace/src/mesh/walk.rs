//! One ray through a tree, eight boxes at a time, nearest first.
//!
//! A box is met where max(near planes, 0) ≤ min(far planes, end of the ray), each plane's distance being
//! (plane − origin) / direction, computed as plane · inverse − origin · inverse. The interval is widened so that it
//! holds for every point that the triangle test may accept, see [`BoxRay::new`]; the triangle test's distances are
//! raised to the near end of their leaf's box. Together: a box that is skipped because something nearer is known holds
//! nothing that would have won, so **the answer does not depend on the order of the walk**, and packets of rays give
//! the same bits as single ones.
//! Sources: Wald, Benthin, Boulos, Getting Rid of Packets, 2008; Ize, Robust BVH Ray Traversal, 2013 (the bounds of
//! rounding).
//!
//! `unsafe` is needed for indexing without checks in this loop (indices come from the builder, which numbers what it
//! made) and for the stack, which is not initialised: filling it would cost a quarter of a ray.
#![allow(unsafe_code)]

use std::mem::MaybeUninit;

use glam::{Vec3, Vec3A};

use super::build::STACK;
use super::node::{LEAF, Tree};
use crate::Ray;
use crate::simd::{Lanes, ROUNDOFF};

/// Far distances are scaled by this: 16 roundings, where inverse, product and difference make at most 4 on each side.
pub(crate) const FAR_SCALE: f32 = 1.0 + 16.0 * ROUNDOFF;
/// A component of the direction is taken to be at least this part of the largest: then its inverse is finite, and over
/// any distance that floats resolve, the ray is where it should be.
pub(crate) const LEAST_COMPONENT: f32 = 1e-20;
/// Roundings, in parts of the distance from the ray's origin to the farthest point of the geometry, by which the
/// triangle test may misplace a corner: difference 1, shear 2 + 1, fused sum 1, product in the baseline 1, each of up
/// to twice the distance in the sum; rounded up.
pub(crate) const CORNER_ROUNDINGS: f32 = 10.0;

/// Where a geometry is: centre and half extent, for the bound of rounding.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Reach {
    centre: Vec3,
    half: Vec3,
}

impl Reach {
    pub(crate) fn new(low: Vec3, high: Vec3) -> Reach {
        Reach { centre: (low + high) * 0.5, half: ((high - low) * 0.5).max(Vec3::ZERO) }
    }

    /// Centre and half extent.
    #[inline(always)]
    pub(crate) fn parts(&self) -> ([f32; 3], [f32; 3]) {
        (self.centre.to_array(), self.half.to_array())
    }
}

/// A ray made ready for boxes.
#[derive(Clone, Copy)]
pub(crate) struct BoxRay {
    /// The row of near planes of each axis; the far ones are in the row `^ 1`.
    pub(crate) near_row: [usize; 3],
    pub(crate) inverse: [f32; 3],
    pub(crate) near_shift: [f32; 3],
    pub(crate) far_inverse: [f32; 3],
    pub(crate) far_shift: [f32; 3],
    pub(crate) time: f32,
}

impl BoxRay {
    #[inline(always)]
    pub(crate) fn new(ray: &Ray, reach: &Reach) -> BoxRay {
        let (origin, direction) = (Vec3A::from(ray.origin), Vec3A::from(ray.direction));
        let size = direction.abs();
        let least = Vec3A::splat(size.max_element() * LEAST_COMPONENT);
        let farthest = ((origin - Vec3A::from(reach.centre)).abs() + Vec3A::from(reach.half)).max_element();
        // Two more for rounding in the shifts.
        let margin = (CORNER_ROUNDINGS * ROUNDOFF) * farthest + (4.0 * ROUNDOFF) * origin.abs().max_element();
        let inverse = Vec3A::ONE / size.max(least).copysign(direction);
        let slack = inverse.abs() * margin;
        let product = origin * inverse;
        let row = |axis: usize, component: f32| 2 * axis + usize::from(component.is_sign_negative());
        BoxRay {
            near_row: [row(0, ray.direction.x), row(1, ray.direction.y), row(2, ray.direction.z)],
            inverse: inverse.to_array(),
            near_shift: (product + slack).to_array(),
            far_inverse: (inverse * FAR_SCALE).to_array(),
            far_shift: ((product - slack) * FAR_SCALE).to_array(),
            time: ray.time.clamp(0.0, 1.0),
        }
    }
}

/// Three values, each in all lanes. (`array::map` would not be inlined, and so not have the instructions.)
#[inline(always)]
fn splat3<V: Lanes>(values: [f32; 3]) -> [V; 3] {
    [V::splat(values[0]), V::splat(values[1]), V::splat(values[2])]
}

/// The vectors of a [`BoxRay`].
pub(crate) struct WideBoxRay<V> {
    near_row: [usize; 3],
    inverse: [V; 3],
    near_shift: [V; 3],
    far_inverse: [V; 3],
    far_shift: [V; 3],
    before: V,
    time: V,
}

impl<V: Lanes> WideBoxRay<V> {
    #[inline(always)]
    pub(crate) fn new(ray: &BoxRay) -> Self {
        WideBoxRay {
            near_row: ray.near_row,
            inverse: splat3(ray.inverse),
            near_shift: splat3(ray.near_shift),
            far_inverse: splat3(ray.far_inverse),
            far_shift: splat3(ray.far_shift),
            before: V::splat(1.0 - ray.time),
            time: V::splat(ray.time),
        }
    }

    /// The planes of one row, as they stand at the ray's time. Products with both ends, not one end and a difference:
    /// so a box lies inside its parent's at every time, rounding and all.
    #[inline(always)]
    unsafe fn planes<const MOVING: bool>(&self, tree: &Tree, node: usize, row: usize) -> V {
        // SAFETY: the caller vouches for `node`; rows are 0 … 5.
        unsafe {
            let open = V::load(tree.nodes.get_unchecked(node).rows.get_unchecked(row));
            if MOVING {
                let close = V::load(tree.close.get_unchecked(node).get_unchecked(row));
                return self.time.mul_add(close, open.mul(self.before));
            }
            open
        }
    }

    /// Near ends of the ray's stay in each child, and a bit for each child that it meets before `end`.
    ///
    /// # Safety
    /// `node` is a node of the tree; one walked with `MOVING` has as many `close` boxes as nodes.
    #[inline(always)]
    pub(crate) unsafe fn meet<const MOVING: bool>(&self, tree: &Tree, node: usize, end: f32) -> (V, u32) {
        let mut near = V::splat(0.0);
        let mut far = V::splat(end);
        for axis in 0..3 {
            let row = self.near_row[axis];
            // SAFETY: the caller vouches for `node`.
            let (near_planes, far_planes) = unsafe {
                (self.planes::<MOVING>(tree, node, row), self.planes::<MOVING>(tree, node, row ^ 1))
            };
            near = near_planes.mul_sub(self.inverse[axis], self.near_shift[axis]).max(near);
            far = far_planes.mul_sub(self.far_inverse[axis], self.far_shift[axis]).min(far);
        }
        (near, near.le(far))
    }
}

/// What is done at the leaves. A trait, not a closure: a closure that is not inlined would be compiled without the
/// instructions of the level.
pub(crate) trait Visitor {
    /// Visits a leaf that the ray enters at `near`, the ray ending at `end`; gives the new end. A negative one stops the
    /// walk.
    fn leaf(&mut self, leaf: u32, near: f32, end: f32) -> f32;
}

/// Walks the tree from a node (not a leaf), visiting each leaf that the ray meets before `end`. With `SORTED` children
/// are visited nearest first.
///
/// # Safety
/// `start` is a node of the tree, whose words name only nodes and leaves that exist, and whose depth the builder bounded;
/// a tree walked with `MOVING` has as many `close` boxes as nodes.
#[inline(always)]
pub(crate) unsafe fn walk<V: Lanes, const MOVING: bool, const SORTED: bool, T: Visitor>(
    tree: &Tree,
    start: u32,
    ray: &BoxRay,
    mut end: f32,
    visitor: &mut T,
) {
    let ray = WideBoxRay::<V>::new(ray);
    let mut stack = [const { MaybeUninit::<(u32, f32)>::uninit() }; STACK];
    let mut height = 0_usize;
    let (mut current, mut current_near) = (start, 0.0_f32);
    loop {
        // Go down to a leaf along the nearest children.
        while current & LEAF == 0 {
            // SAFETY: `current` names a node.
            let (near, mut met) = unsafe { ray.meet::<MOVING>(tree, current as usize, end) };
            // SAFETY: as above.
            let children = unsafe { &tree.nodes.get_unchecked(current as usize).children };
            if met == 0 {
                current = u32::MAX;
                break;
            }
            let mut nears = [0.0_f32; 8];
            near.store(&mut nears);
            let first = met.trailing_zeros() as usize & 7;
            met &= met - 1;
            (current, current_near) = (children[first], nears[first]);
            if met == 0 {
                continue;
            }
            let base = height;
            while met != 0 {
                let slot = if SORTED { met.trailing_zeros() } else { met.ilog2() } as usize & 7;
                met ^= 1 << slot;
                let mut entry = (children[slot], nears[slot]);
                if SORTED {
                    // Keep the nearest in hand and the others on the stack, the farthest lowest.
                    if entry.1 < current_near {
                        std::mem::swap(&mut entry.0, &mut current);
                        std::mem::swap(&mut entry.1, &mut current_near);
                    }
                    let mut place = height;
                    // SAFETY: places from `base` to `height` are filled; the stack is as deep as the tree needs.
                    unsafe {
                        while place > base && stack.get_unchecked(place - 1).assume_init_ref().1 < entry.1 {
                            *stack.get_unchecked_mut(place) = *stack.get_unchecked(place - 1);
                            place -= 1;
                        }
                        stack.get_unchecked_mut(place).write(entry);
                    }
                } else {
                    // SAFETY: the stack is as deep as the tree needs.
                    unsafe { stack.get_unchecked_mut(height).write(entry) };
                }
                height += 1;
            }
        }
        if current != u32::MAX {
            end = visitor.leaf(current & !LEAF, current_near, end);
            if end < 0.0 {
                return;
            }
        }
        // Take up what is nearest of the rest, unless something nearer has been found meanwhile.
        loop {
            if height == 0 {
                return;
            }
            height -= 1;
            // SAFETY: places below `height` are filled.
            (current, current_near) = unsafe { stack.get_unchecked(height).assume_init() };
            if current_near <= end {
                break;
            }
        }
    }
}
