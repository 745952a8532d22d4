//! One ray against eight triangles, without a gap between them.
//!
//! The corners are sheared so that the ray is the axis of the frame: x' = x − Sx z, y' = y − Sy z, with z the axis in
//! which the ray goes farthest. The ray is inside if the three edge functions U = Cx By − Cy Bx, V = Ax Cy − Ay Cx,
//! W = Bx Ay − By Ax have one sign; t = Sz (U Az + V Bz + W Cz) / (U + V + W). Two triangles with a common edge compute
//! the same numbers for it with opposite signs (products are rounded one by one, never fused), so a ray cannot pass
//! between them. Where an edge function is 0 in floats its sign is found in doubles, in which products are exact.
//! Source: Woop, Benthin, Wald, Watertight Ray/Triangle Intersection, 2013.

use glam::Vec3;

use super::block::{Block, Corners};
use crate::simd::Lanes;
use crate::{LocalHit, Ray};

/// A ray made ready for triangles.
#[derive(Clone, Copy)]
pub(crate) struct ShearRay {
    /// The axes in the order x', y', z'.
    pub(crate) axes: [usize; 3],
    /// The origin, in that order.
    pub(crate) origin: [f32; 3],
    /// Sx, Sy, Sz.
    pub(crate) shear: [f32; 3],
    pub(crate) time: f32,
}

impl ShearRay {
    #[inline(always)]
    pub(crate) fn new(ray: &Ray) -> ShearRay {
        let size = ray.direction.abs();
        let main = main_axis(size);
        let axes = [[1, 2, 0], [2, 0, 1], [0, 1, 2]][main];
        let direction = ray.direction.to_array();
        let origin = ray.origin.to_array();
        let inverse = 1.0 / direction[main];
        ShearRay {
            axes,
            origin: [origin[axes[0]], origin[axes[1]], origin[axes[2]]],
            shear: [direction[axes[0]] * inverse, direction[axes[1]] * inverse, inverse],
            time: ray.time.clamp(0.0, 1.0),
        }
    }
}

/// The axis in which a direction is longest.
#[inline(always)]
pub(crate) fn main_axis(size: Vec3) -> usize {
    if size.x >= size.y && size.x >= size.z {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    }
}

/// Edge functions in doubles, for lanes where one of them is 0 in floats.
#[cold]
#[inline(never)]
pub(crate) fn exact_edges(a: [f32; 2], b: [f32; 2], c: [f32; 2]) -> [f32; 3] {
    let edge = |p: [f32; 2], q: [f32; 2]| {
        (f64::from(p[0]) * f64::from(q[1]) - f64::from(p[1]) * f64::from(q[0])) as f32
    };
    [edge(c, b), edge(a, c), edge(b, a)]
}

/// The lanes of a mask in which three numbers have one sign or are 0, as far as one triangle is concerned.
#[inline(always)]
fn same_sign(edges: [f32; 3]) -> bool {
    let [u, v, w] = edges;
    (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0)
}

/// Puts the exact edge functions into the lanes of `zero`; gives the lanes that are still inside.
#[cold]
#[inline(never)]
pub(crate) fn settle_zeros(zero: u32, corners: [&[f32; 16]; 6], edges: [&mut [f32; 16]; 3]) -> u32 {
    let [ax, ay, bx, by, cx, cy] = corners;
    let [u, v, w] = edges;
    let mut inside = 0;
    let mut rest = zero;
    while rest != 0 {
        let i = rest.trailing_zeros() as usize;
        rest &= rest - 1;
        let exact = exact_edges([ax[i], ay[i]], [bx[i], by[i]], [cx[i], cy[i]]);
        [u[i], v[i], w[i]] = exact;
        inside |= u32::from(same_sign(exact)) << i;
    }
    inside
}

/// Edge functions and sheared corners of lanes that each hold one ray and one triangle.
pub(crate) struct Edges<V> {
    pub(crate) u: V,
    pub(crate) v: V,
    pub(crate) w: V,
    pub(crate) inside: u32,
}

/// p × q in the plane, its products rounded one by one.
#[inline(always)]
fn cross<V: Lanes>(p: [V; 2], q: [V; 2]) -> V {
    p[0].mul(q[1]).sub(p[1].mul(q[0]))
}

#[inline(always)]
fn spill<V: Lanes>(value: V) -> [f32; 16] {
    let mut lanes = [0.0; 16];
    value.store(&mut lanes);
    lanes
}

/// Finds the lanes whose ray passes inside their triangle, given sheared corners.
#[inline(always)]
pub(crate) fn edges<V: Lanes>(a: [V; 2], b: [V; 2], c: [V; 2], lanes: u32) -> Edges<V> {
    let (mut u, mut v, mut w) = (cross(c, b), cross(a, c), cross(b, a));
    let least = u.min(v).min(w);
    let most = u.max(v).max(w);
    let none = V::splat(0.0);
    let mut inside = (none.le(least) | most.le(none)) & lanes;
    if inside != 0 {
        let zero = (least.eq(none) | most.eq(none)) & inside;
        if zero != 0 {
            let corners = [spill(a[0]), spill(a[1]), spill(b[0]), spill(b[1]), spill(c[0]), spill(c[1])];
            let (mut us, mut vs, mut ws) = (spill(u), spill(v), spill(w));
            let settled = settle_zeros(zero, corners.each_ref(), [&mut us, &mut vs, &mut ws]);
            (u, v, w) = (V::load(&us), V::load(&vs), V::load(&ws));
            inside = (inside & !zero) | settled;
        }
    }
    Edges { u, v, w, inside }
}

/// The eight triangles' coordinates on one axis (0 … 2 in the ray's order) of one corner, at the ray's time and as seen
/// from its origin.
#[inline(always)]
fn relative<V: Lanes, const MOVING: bool>(
    block: &Block,
    close: Option<&Corners>,
    corner: usize,
    place: usize,
    ray: &ShearRay,
) -> V {
    let axis = ray.axes[place];
    let mut at = V::load(&block.corners[corner][axis]);
    if let (true, Some(close)) = (MOVING, close) {
        let close = V::load(&close[corner][axis]);
        at = V::splat(ray.time).mul_add(close, at.mul(V::splat(1.0 - ray.time)));
    }
    at.sub(V::splat(ray.origin[place]))
}

/// One corner of the eight triangles, sheared: x', y', and z.
#[inline(always)]
fn sheared<V: Lanes, const MOVING: bool>(
    block: &Block,
    close: Option<&Corners>,
    corner: usize,
    ray: &ShearRay,
) -> ([V; 2], V) {
    let x = relative::<V, MOVING>(block, close, corner, 0, ray);
    let y = relative::<V, MOVING>(block, close, corner, 1, ray);
    let z = relative::<V, MOVING>(block, close, corner, 2, ray);
    ([V::splat(ray.shear[0]).neg_mul_add(z, x), V::splat(ray.shear[1]).neg_mul_add(z, y)], z)
}

/// Whether a hit replaces the best one: nearer, or as near and of smaller number.
#[inline(always)]
pub(crate) fn wins(t: f32, primitive: u32, best: &LocalHit) -> bool {
    t < best.t || (t == best.t && primitive < best.primitive)
}

/// Tests a ray against a leaf. `near` is where the ray enters the leaf's box: no hit counts as nearer.
/// With `ANY` the first hit found will do. `best.t` is the end of the ray, inclusive, and its number is `u32::MAX`
/// while nothing is found.
#[inline(always)]
pub(crate) fn hit_block<V: Lanes, const MOVING: bool, const ANY: bool>(
    block: &Block,
    close: Option<&Corners>,
    ray: &ShearRay,
    near: f32,
    best: &mut LocalHit,
) -> bool {
    let (a, az) = sheared::<V, MOVING>(block, close, 0, ray);
    let (b, bz) = sheared::<V, MOVING>(block, close, 1, ray);
    let (c, cz) = sheared::<V, MOVING>(block, close, 2, ray);
    let Edges { u, v, w, inside } = edges(a, b, c, 0xff);
    if inside == 0 {
        return false;
    }
    let (t, scale) = distances(u, v, w, [az, bz, cz], V::splat(ray.shear[2]));
    let none = V::splat(0.0);
    // A triangle seen edge-on has U + V + W = 0 and a t that is infinite or NaN: neither passes.
    let mut lanes = inside & none.lt(t) & t.le(V::splat(best.t)) & t.lt(V::splat(f32::INFINITY));
    if lanes == 0 {
        return false;
    }
    if ANY && near <= best.t {
        return true;
    }
    let (mut ts, mut us, mut vs) = ([0.0; 8], [0.0; 8], [0.0; 8]);
    t.max(V::splat(near)).store(&mut ts);
    v.mul(scale).store(&mut us);
    w.mul(scale).store(&mut vs);
    let mut found = false;
    while lanes != 0 {
        let lane = lanes.trailing_zeros() as usize & 7;
        lanes &= lanes - 1;
        if wins(ts[lane], block.triangles[lane], best) {
            *best = LocalHit { t: ts[lane], primitive: block.triangles[lane], u: us[lane], v: vs[lane] };
            found = true;
        }
    }
    found
}

/// Distances along the ray, and 1 / (U + V + W).
#[inline(always)]
pub(crate) fn distances<V: Lanes>(u: V, v: V, w: V, z: [V; 3], along: V) -> (V, V) {
    let scale = V::splat(1.0).div(u.add(v).add(w));
    let t = u.mul_add(z[0], v.mul_add(z[1], w.mul(z[2]))).mul(along).mul(scale);
    (t, scale)
}
