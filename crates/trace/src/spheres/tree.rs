//! An eight-wide tree over groups of eight spheres.
//!
//! Built by median splits along the longest side of the centres' box, three at a time: the same for any number of
//! threads. Boxes are met by slabs in f32, widened by the rounding of the slab test (3 ε relative; Ize 2013).

use glam::Vec3;

use super::{Sphere, is_usable};
use crate::simd::{Lanes, Plain};
use crate::{Ray, Simd};

/// A child: a node, or if [`LEAF`] is set a group; [`NONE`] where there is no child.
type Child = u32;
const LEAF: u32 = 1 << 31;
const NONE: u32 = u32::MAX;

/// Eight boxes side by side: least and greatest x, y, z.
#[repr(align(64))]
#[derive(Clone, Debug)]
struct Node {
    low: [[f32; 8]; 3],
    high: [[f32; 8]; 3],
    children: [Child; 8],
}

/// Eight spheres side by side; absent ones have a NaN for their centre.
#[repr(align(64))]
#[derive(Clone, Debug)]
struct Group {
    center: [[f32; 8]; 3],
    radius: [f32; 8],
    index: [u32; 8],
}

/// The tree. Empty without usable spheres.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    nodes: Vec<Node>,
    groups: Vec<Group>,
    root: Child,
}

impl Tree {
    pub(super) fn build(spheres: &[Sphere]) -> Tree {
        let mut tree = Tree { nodes: Vec::new(), groups: Vec::new(), root: NONE };
        let mut order: Vec<u32> =
            (0..spheres.len() as u32).filter(|&i| is_usable(&spheres[i as usize])).collect();
        if !order.is_empty() {
            tree.root = tree.add(spheres, &mut order);
        }
        tree
    }

    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice()) + size_of_val(self.groups.as_slice())
    }

    fn add(&mut self, spheres: &[Sphere], order: &mut [u32]) -> Child {
        if order.len() <= 8 {
            let mut group = Group { center: [[f32::NAN; 8]; 3], radius: [0.0; 8], index: [NONE; 8] };
            for (lane, &index) in order.iter().enumerate() {
                let sphere = spheres[index as usize];
                for axis in 0..3 {
                    group.center[axis][lane] = sphere.center[axis];
                }
                (group.radius[lane], group.index[lane]) = (sphere.radius, index);
            }
            self.groups.push(group);
            return (self.groups.len() - 1) as u32 | LEAF;
        }
        let at = self.nodes.len();
        self.nodes.push(Node {
            low: [[f32::INFINITY; 8]; 3],
            high: [[f32::NEG_INFINITY; 8]; 3],
            children: [NONE; 8],
        });
        for (lane, part) in eighths(spheres, order).into_iter().filter(|part| !part.is_empty()).enumerate() {
            for &index in part.iter() {
                let Sphere { center, radius } = spheres[index as usize];
                let node = &mut self.nodes[at];
                for axis in 0..3 {
                    node.low[axis][lane] = node.low[axis][lane].min(center[axis] - radius);
                    node.high[axis][lane] = node.high[axis][lane].max(center[axis] + radius);
                }
            }
            self.nodes[at].children[lane] = self.add(spheres, part);
        }
        at as u32
    }

    /// Calls `meet` for each sphere that the ray may meet before `t_max`, near ones first by and large; it returns
    /// the new `t_max`, negative to stop.
    #[inline]
    pub(super) fn visit(&self, simd: Simd, ray: &RaySpread, t_max: f32, meet: impl FnMut(u32, f32) -> f32) {
        if self.root == NONE {
            return;
        }
        match simd {
            #[cfg(target_arch = "x86_64")]
            Simd::Avx2 | Simd::Avx512 => wide::visit(self, ray, t_max, meet),
            _ => self.descend::<Plain>(ray, t_max, meet),
        }
    }

    #[inline(always)]
    fn descend<L: Lanes>(&self, ray: &RaySpread, mut t_max: f32, mut meet: impl FnMut(u32, f32) -> f32) {
        // Depth is below log₄ 2³¹ + 1 < 17 (an eighth has at most a quarter of its parent); each level leaves seven.
        let mut stack = [(NONE, 0.0f32); 128];
        let mut waiting = 0;
        let mut next = self.root;
        loop {
            if next & LEAF != 0 {
                let group = &self.groups[(next & !LEAF) as usize];
                let mut mask = group_candidates::<L>(group, ray);
                while mask != 0 {
                    let lane = mask.trailing_zeros() as usize;
                    mask &= mask - 1;
                    t_max = meet(group.index[lane & 7], t_max);
                    if t_max < 0.0 {
                        return;
                    }
                }
            } else {
                let node = &self.nodes[next as usize];
                let mut distance = [0.0; 8];
                let mut mask = node_candidates::<L>(node, ray, t_max, &mut distance);
                let first = waiting;
                while mask != 0 {
                    let lane = mask.trailing_zeros() as usize & 7;
                    mask &= mask - 1;
                    // The nearest ends on top of the stack.
                    let mut place = waiting;
                    while place > first && stack[place - 1].1 < distance[lane] {
                        stack[place] = stack[place - 1];
                        place -= 1;
                    }
                    stack[place] = (node.children[lane], distance[lane]);
                    waiting += 1;
                }
            }
            loop {
                if waiting == 0 {
                    return;
                }
                waiting -= 1;
                if stack[waiting].1 <= t_max {
                    next = stack[waiting].0;
                    break;
                }
            }
        }
    }
}

/// A ray for the tests of eight at once.
pub(super) struct RaySpread {
    origin: Vec3,
    direction: Vec3,
    inverse: Vec3,
    inverse_squared: f32,
}

impl RaySpread {
    pub(super) fn new(ray: &Ray) -> Self {
        // Kept off zero: 0 · ∞ would be no number.
        let off_zero = |d: f32| if d.abs() < 1e-30 { 1e-30f32.copysign(d) } else { d };
        let direction = ray.direction;
        let inverse =
            Vec3::new(1.0 / off_zero(direction.x), 1.0 / off_zero(direction.y), 1.0 / off_zero(direction.z));
        // In f64, where the square of a short direction does not vanish.
        let inverse_squared = (1.0 / direction.as_dvec3().length_squared()) as f32;
        Self { origin: ray.origin, direction, inverse, inverse_squared }
    }
}

/// The spheres of a group that the ray's line passes within their radius, or nearly.
#[inline(always)]
fn group_candidates<L: Lanes>(group: &Group, ray: &RaySpread) -> u32 {
    let x = L::load(&group.center[0]).sub(L::splat(ray.origin.x));
    let y = L::load(&group.center[1]).sub(L::splat(ray.origin.y));
    let z = L::load(&group.center[2]).sub(L::splat(ray.origin.z));
    let (dx, dy, dz) = (L::splat(ray.direction.x), L::splat(ray.direction.y), L::splat(ray.direction.z));
    let along = x.mul(dx).add(y.mul(dy)).add(z.mul(dz)).mul(L::splat(ray.inverse_squared));
    let (ax, ay, az) = (along.neg_mul_add(dx, x), along.neg_mul_add(dy, y), along.neg_mul_add(dz, z));
    let aside = ax.mul(ax).add(ay.mul(ay)).add(az.mul(az));
    // Roundings of f, of f·d and of the product leave at most some 6 ε |f| per axis. Compared without a root: with
    // w = r + 2e-6 (|f_x| + |f_y| + |f_z|), aside² ≤ w². Too many candidates do no harm.
    let reach = x.max(L::splat(0.0).sub(x)).add(y.max(L::splat(0.0).sub(y))).add(z.max(L::splat(0.0).sub(z)));
    let wide = L::load(&group.radius).add(reach.mul(L::splat(2e-6)));
    aside.le(wide.mul(wide)) & 0xff
}

/// The children whose boxes the ray meets before `t_max`, and where.
#[inline(always)]
fn node_candidates<L: Lanes>(node: &Node, ray: &RaySpread, t_max: f32, distance: &mut [f32; 8]) -> u32 {
    let mut enter = L::splat(0.0);
    let mut leave = L::splat(t_max);
    for axis in 0..3 {
        let (origin, inverse) = (L::splat(ray.origin[axis]), L::splat(ray.inverse[axis]));
        let a = L::load(&node.low[axis]).sub(origin).mul(inverse);
        let b = L::load(&node.high[axis]).sub(origin).mul(inverse);
        // Six roundings wider on the far side, for those of both ends; and nearer for the comparison with hits.
        enter = a.min(b).max(enter);
        leave = a.max(b).mul(L::splat(1.0 + 6.0 * f32::EPSILON)).min(leave);
    }
    enter.mul(L::splat(1.0 - 6.0 * f32::EPSILON)).store(distance);
    // Boxes of absent children are inside out, which the minima and maxima above would turn right side out.
    let present = L::load(&node.low[0]).le(L::load(&node.high[0]));
    enter.le(leave) & present & 0xff
}

/// Cuts a set in eight by medians, three times in two.
fn eighths<'a>(spheres: &[Sphere], order: &'a mut [u32]) -> Vec<&'a mut [u32]> {
    let mut parts = vec![order];
    for _ in 0..3 {
        parts = parts.into_iter().flat_map(|part| halves(spheres, part)).collect();
    }
    parts
}

fn halves<'a>(spheres: &[Sphere], order: &'a mut [u32]) -> [&'a mut [u32]; 2] {
    // What fits a group stays together.
    if order.len() <= 8 {
        return [order, &mut []];
    }
    let (mut low, mut high) = (Vec3::splat(f32::INFINITY), Vec3::splat(f32::NEG_INFINITY));
    for &index in order.iter() {
        low = low.min(spheres[index as usize].center);
        high = high.max(spheres[index as usize].center);
    }
    let axis = (0.5 * high - 0.5 * low).max_position();
    // Whole groups on the left, so that few groups are partly empty.
    let middle = (order.len() / 2).next_multiple_of(8).min(order.len() - 1);
    let key = |index: &u32| spheres[*index as usize].center[axis];
    order.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)).then(a.cmp(b)));
    order.split_at_mut(middle).into()
}

/// The descent compiled for wide instructions.
///
/// This module needs `unsafe` to call functions compiled for instructions that not every processor has.
#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code)]
mod wide {
    use super::{RaySpread, Tree};
    use crate::simd::Wide8;

    #[inline]
    pub(super) fn visit(tree: &Tree, ray: &RaySpread, t_max: f32, meet: impl FnMut(u32, f32) -> f32) {
        // SAFETY: the tracer holds a level that `Simd::or_best` confirmed this processor to have.
        unsafe { avx2(tree, ray, t_max, meet) }
    }

    #[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
    fn avx2(tree: &Tree, ray: &RaySpread, t_max: f32, meet: impl FnMut(u32, f32) -> f32) {
        tree.descend::<Wide8>(ray, t_max, meet);
    }
}
