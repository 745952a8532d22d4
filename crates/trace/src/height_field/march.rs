//! The march of one ray: down the pyramid in the order in which the ray meets the children, to the first block that
//! it meets the surface in.
//!
//! **Order.** Lanes are put in an order in which both coordinates of the ray grow. What the ray meets first then has
//! the lower lane, since both coordinates of the children it meets are monotone: no sorting, no distances on a stack.
//!
//! **No cracks.** Along a ray f(t) = y(t) − h(x(t), z(t)) is continuous, and a hit is where its sign changes. f is
//! evaluated only where the ray crosses an edge, by a formula that belongs to the edge: t from the line of the grid,
//! h from the two posts. Both cells at the edge get the same bits, so every change of sign lies inside one triangle,
//! and none is lost. A node is skipped only if y(t) at its borders – the same bits again – lies beyond its
//! heights, where f cannot change sign. When a ray passes exactly through a post, it visits a cell of no length in
//! between: on leaving, ties go to x; on entering, to z.

use super::lanes::Lanes16;
use super::pyramid::Level;

/// A ray in the coordinates of the grid: x and z in cells, y in metres, t in units that make a step of about a cell.
#[derive(Clone, Copy, Debug)]
pub(super) struct GridRay {
    /// Where it starts, within the (slightly widened) box of the field.
    pub(super) origin: [f32; 3],
    /// x and z are not zero.
    pub(super) direction: [f32; 3],
    /// Whether the ray itself starts within the box, and not only the part of it that is marched.
    pub(super) starts_inside: bool,
    /// A little beyond the ray's end.
    pub(super) t_end: f32,
}

/// What the march needs of the field.
pub(super) struct Surroundings<'a> {
    pub(super) heights: &'a [f32],
    /// At the closing of the shutter, and how far the shutter is.
    pub(super) close: Option<(&'a [f32], f32)>,
    pub(super) columns: usize,
    pub(super) rows: usize,
    pub(super) levels: &'a [Level],
}

/// Where the surface was met.
#[derive(Clone, Copy, Debug)]
pub(super) struct GridHit {
    pub(super) t: f32,
    pub(super) cell: [usize; 2],
    pub(super) which: u32,
    pub(super) u: f32,
    pub(super) v: f32,
}

/// Levels of 4 × 4 children: 16 of them would have more cells than can be numbered.
const GREATEST_DEPTH: usize = 17;

const LANE_X: [f32; 16] = [0., 1., 2., 3., 0., 1., 2., 3., 0., 1., 2., 3., 0., 1., 2., 3.];
const LANE_Z: [f32; 16] = [0., 0., 0., 0., 1., 1., 1., 1., 2., 2., 2., 2., 3., 3., 3., 3.];

/// What stays the same along a ray, in all lanes.
struct Spread<L> {
    ox: L,
    oy: L,
    oz: L,
    dx: L,
    dy: L,
    dz: L,
    inverse_x: L,
    inverse_z: L,
    t_end: L,
}

/// Lines of the grid in units of the child's size, for lanes in the order of the ray.
struct Lines<L> {
    near_x: L,
    far_x: L,
    near_z: L,
    far_z: L,
}

// Everything below that computes with lanes is a function and not a closure, or a method that takes one: closures are
// not compiled for the instructions of the function around them.

/// The cell of a place along an axis with so many posts.
#[inline(always)]
fn cell_of(place: f32, posts: usize) -> usize {
    // A cast of a negative number gives 0.
    (place as usize).min(posts - 2)
}

/// When the ray crosses the lines `base + size · line`.
#[inline(always)]
fn crossing<L: Lanes16>(line: L, size: L, base: L, origin: L, inverse: L) -> L {
    line.mul_add(size, base).sub(origin).mul(inverse)
}

/// Which children of a node the ray may meet the surface in; bit k for the k-th in the order of the ray.
#[inline(always)]
fn meets<L: Lanes16>(
    all: &Spread<L>,
    lines: &Lines<L>,
    order: L::Order,
    field: &Surroundings<'_>,
    level: usize,
    x: usize,
    z: usize,
) -> u32 {
    let floor = &field.levels[level];
    let node = &floor.nodes[z * floor.columns + x];
    let size = (4usize << (2 * level)) as f32;
    let (x0, z0) = (L::splat(4.0 * size * x as f32), L::splat(4.0 * size * z as f32));
    let size = L::splat(size);
    let enter = crossing(lines.near_x, size, x0, all.ox, all.inverse_x)
        .max(crossing(lines.near_z, size, z0, all.oz, all.inverse_z))
        .max(L::splat(0.0));
    let leave = crossing(lines.far_x, size, x0, all.ox, all.inverse_x).min(crossing(
        lines.far_z,
        size,
        z0,
        all.oz,
        all.inverse_z,
    ));
    let y_enter = enter.mul_add(all.dy, all.oy);
    let y_leave = leave.mul_add(all.dy, all.oy);
    let low = L::load_ordered(&node.low, order);
    let high = L::load_ordered(&node.high, order);
    let within = L::both(enter.le(leave), enter.le(all.t_end));
    let tall = L::both(low.le(y_enter.max(y_leave)), y_enter.min(y_leave).le(high));
    L::bits(L::both(within, tall))
}

/// f at t, on an edge between two posts, where t lies at the fraction `along`.
#[inline(always)]
fn above<L: Lanes16>(all: &Spread<L>, t: L, from: L, to: L, along: L) -> L {
    let h = along.max(L::splat(0.0)).min(L::splat(1.0)).mul_add(to.sub(from), from);
    t.mul_add(all.dy, all.oy).sub(h)
}

/// Marches a ray to the first hit that `accept` takes; it is asked for hits in the order of t.
#[inline(always)]
pub(super) fn march<L: Lanes16, T>(
    ray: &GridRay,
    field: &Surroundings<'_>,
    mut accept: impl FnMut(GridHit) -> Option<T>,
) -> Option<T> {
    let [ox, oy, oz] = ray.origin;
    let [dx, dy, dz] = ray.direction;
    let all = Spread {
        ox: L::splat(ox),
        oy: L::splat(oy),
        oz: L::splat(oz),
        dx: L::splat(dx),
        dy: L::splat(dy),
        dz: L::splat(dz),
        inverse_x: L::splat(1.0 / dx),
        inverse_z: L::splat(1.0 / dz),
        t_end: L::splat(ray.t_end),
    };
    let flip = if dx < 0.0 { 3 } else { 0 } | if dz < 0.0 { 12 } else { 0 };
    let order = L::order(flip);
    let (toward_x, toward_z) = (f32::from(u8::from(dx < 0.0)), f32::from(u8::from(dz < 0.0)));
    let ordered_x = L::load_ordered(&LANE_X, order);
    let ordered_z = L::load_ordered(&LANE_Z, order);
    let lines = Lines {
        near_x: ordered_x.add(L::splat(toward_x)),
        far_x: ordered_x.add(L::splat(1.0 - toward_x)),
        near_z: ordered_z.add(L::splat(toward_z)),
        far_z: ordered_z.add(L::splat(1.0 - toward_z)),
    };

    let mut waiting = [0u32; GREATEST_DEPTH];
    let top = field.levels.len() - 1;
    let mut level = top;
    let (mut x, mut z) = (0, 0);
    let mut mask;
    if ray.starts_inside {
        // The nodes that hold the ray's start are known without a descent: all their tests are under way at once,
        // where a descent waits for each. Then down as far as the tests lead to the start.
        let start = (cell_of(ox, field.columns), cell_of(oz, field.rows));
        for level in 0..=top {
            let shift = 2 * level + 4;
            waiting[level] = meets(&all, &lines, order, field, level, start.0 >> shift, start.1 >> shift);
        }
        loop {
            mask = waiting[level];
            let shift = 2 * level + 2;
            (x, z) = (start.0 >> shift, start.1 >> shift);
            let lane = 1 << (((x & 3) | (z & 3) << 2) as u32 ^ flip);
            (x, z) = (x >> 2, z >> 2);
            if level == 0 || mask & lane == 0 {
                break;
            }
            waiting[level] = mask & !lane;
            level -= 1;
        }
    } else {
        mask = meets(&all, &lines, order, field, level, 0, 0);
    }
    loop {
        while mask == 0 {
            level += 1;
            if level >= field.levels.len() {
                return None;
            }
            mask = waiting[level];
            (x, z) = (x >> 2, z >> 2);
        }
        let lane = mask.trailing_zeros() ^ flip;
        mask &= mask - 1;
        let child = (4 * x + (lane & 3) as usize, 4 * z + (lane >> 2) as usize);
        if level == 0 {
            if let Some(found) = block::<L, T>(&all, ray, field, flip, child, &mut accept) {
                return Some(found);
            }
        } else {
            waiting[level] = mask;
            level -= 1;
            (x, z) = child;
            mask = meets(&all, &lines, order, field, level, x, z);
        }
    }
}

/// The heights of the posts of a block's cells, at their four corners (00, 10, 01, 11).
#[inline(always)]
fn corners<L: Lanes16>(field: &Surroundings<'_>, heights: &[f32], x: usize, z: usize) -> [L; 4] {
    if x + 4 < field.columns && z + 4 < field.rows {
        let stride = field.columns;
        let first = &heights[z * stride + x..];
        [
            L::load_rows(first, stride),
            L::load_rows(&first[1..], stride),
            L::load_rows(&first[stride..], stride),
            L::load_rows(&first[stride + 1..], stride),
        ]
    } else {
        let [a, b, c, d] = border_posts(heights, field.columns, field.rows, x, z);
        [L::load(&a), L::load(&b), L::load(&c), L::load(&d)]
    }
}

/// The posts at the corners of a block's cells at the far borders, where the block is cut off.
#[cold]
#[inline(never)]
fn border_posts(heights: &[f32], columns: usize, rows: usize, x: usize, z: usize) -> [[f32; 16]; 4] {
    std::array::from_fn(|corner| {
        std::array::from_fn(|lane| {
            let column = (x + (lane & 3) + (corner & 1)).min(columns - 1);
            let row = (z + (lane >> 2) + (corner >> 1)).min(rows - 1);
            heights[row * columns + column]
        })
    })
}

/// The cells of a block of 4 × 4 at once: where does the sign of f change?
#[inline(always)]
fn block<L: Lanes16, T>(
    all: &Spread<L>,
    ray: &GridRay,
    field: &Surroundings<'_>,
    flip: u32,
    (x, z): (usize, usize),
    accept: &mut impl FnMut(GridHit) -> Option<T>,
) -> Option<T> {
    let (x, z) = (4 * x, 4 * z);
    let [mut h00, mut h10, mut h01, mut h11] = corners::<L>(field, field.heights, x, z);
    if let Some((close, time)) = field.close {
        let close = corners::<L>(field, close, x, z);
        let time = L::splat(time);
        h00 = close[0].sub(h00).mul_add(time, h00);
        h10 = close[1].sub(h10).mul_add(time, h10);
        h01 = close[2].sub(h01).mul_add(time, h01);
        h11 = close[3].sub(h11).mul_add(time, h11);
    }
    let zero = L::splat(0.0);
    let one = L::splat(1.0);
    let i = L::load(&LANE_X).add(L::splat(x as f32));
    let j = L::load(&LANE_Z).add(L::splat(z as f32));
    let (left, right) = (i.sub(all.ox).mul(all.inverse_x), i.add(one).sub(all.ox).mul(all.inverse_x));
    let (back, front) = (j.sub(all.oz).mul(all.inverse_z), j.add(one).sub(all.oz).mul(all.inverse_z));
    // Posts of the near and far edges, x edges from lower to higher z and z edges from lower to higher x.
    let (near_x, far_x, x_near, x_far) = if flip & 3 == 0 {
        (left, right, (h00, h01), (h10, h11))
    } else {
        (right, left, (h10, h11), (h00, h01))
    };
    let (near_z, far_z, z_near, z_far) = if flip & 12 == 0 {
        (back, front, (h00, h10), (h01, h11))
    } else {
        (front, back, (h01, h11), (h00, h10))
    };
    let enter = near_x.max(near_z);
    let leave = far_x.min(far_z);
    let by_x = near_z.lt(near_x);
    let along = L::select(by_x, enter.mul_add(all.dz, all.oz).sub(j), enter.mul_add(all.dx, all.ox).sub(i));
    let from = L::select(by_x, x_near.0, z_near.0);
    let mut f_enter = above(all, enter, from, L::select(by_x, x_near.1, z_near.1), along);
    let by_x = far_x.le(far_z);
    let along = L::select(by_x, leave.mul_add(all.dz, all.oz).sub(j), leave.mul_add(all.dx, all.ox).sub(i));
    let from = L::select(by_x, x_far.0, z_far.0);
    let f_leave = above(all, leave, from, L::select(by_x, x_far.1, z_far.1), along);

    // The cell that the ray starts in: f at its origin.
    let started = enter.lt(zero);
    let enter = enter.max(zero);
    let within = L::both(enter.le(leave), enter.le(all.t_end));
    if L::bits(L::both(started, within)) != 0 {
        let (u, v) = (all.ox.sub(i).max(zero).min(one), all.oz.sub(j).max(zero).min(one));
        let lower = v.mul_add(h11.sub(h10), u.mul_add(h10.sub(h00), h00));
        let upper = u.mul_add(h11.sub(h01), v.mul_add(h01.sub(h00), h00));
        f_enter = L::select(started, all.oy.sub(L::select(v.le(u), lower, upper)), f_enter);
    }

    // The diagonal between the two triangles.
    let [dx, _, dz] = ray.direction;
    let across = L::splat(1.0 / (dx - dz));
    let diagonal = all.oz.sub(j).sub(all.ox.sub(i)).mul(across);
    let crosses = L::both(enter.lt(diagonal), diagonal.lt(leave));
    let f_diagonal =
        L::select(crosses, above(all, diagonal, h00, h11, diagonal.mul_add(all.dx, all.ox).sub(i)), f_enter);

    let (a, b, c) = (L::bits(zero.le(f_enter)), L::bits(zero.le(f_diagonal)), L::bits(zero.le(f_leave)));
    let (across, along) = ((field.columns - 1 - x).min(4), (field.rows - 1 - z).min(4));
    // The far borders may cut the block off.
    let cells = ((1u32 << across) - 1) * (0x1111 & ((1 << (4 * along)) - 1));
    let changes = ((a ^ b) | (b ^ c)) & L::bits(within) & cells;
    if changes == 0 {
        return None;
    }
    let times = [enter.store(), diagonal.store(), leave.store()];
    let signed = [f_enter.store(), f_diagonal.store(), f_leave.store()];
    let crosses = L::bits(crosses);
    let mut left = flipped(changes, flip);
    while left != 0 {
        let lane = (left.trailing_zeros() ^ flip) as usize;
        left &= left - 1;
        let cell = [x + (lane & 3), z + (lane >> 2)];
        // From border to border, or from border to diagonal and on.
        let stops = if crosses >> lane & 1 == 1 { [1, 2] } else { [2, 2] };
        let mut start = (times[0][lane], signed[0][lane]);
        for stop in stops {
            let end = (times[stop][lane], signed[stop][lane]);
            if (start.1 >= 0.0) != (end.1 >= 0.0)
                && let Some(found) = accept(within_triangle(ray, cell, start, end))
            {
                return Some(found);
            }
            start = end;
        }
    }
    None
}

/// The zero of f between two points (t, f) on the border of one triangle.
#[inline(always)]
fn within_triangle(ray: &GridRay, cell: [usize; 2], start: (f32, f32), end: (f32, f32)) -> GridHit {
    let [ox, _, oz] = ray.origin;
    let [dx, _, dz] = ray.direction;
    let at = |t: f32| {
        let u = t * dx + (ox - cell[0] as f32);
        let v = t * dz + (oz - cell[1] as f32);
        (u.clamp(0.0, 1.0), v.clamp(0.0, 1.0))
    };
    let (u, v) = at(0.5 * (start.0 + end.0));
    let which = u32::from(v > u);
    let t = start.0 + (end.0 - start.0) * (start.1 / (start.1 - end.1));
    let t = t.clamp(start.0, end.0);
    let (u, v) = at(t);
    // Keep the point in its triangle: v ≤ u in the lower one, u ≤ v in the upper one.
    let (u, v) = if which == 0 { (u, v.min(u)) } else { (u.min(v), v) };
    GridHit { t, cell, which, u, v }
}

/// The mask whose bit k is bit k ⊕ flip of `mask`.
#[inline(always)]
fn flipped(mask: u32, flip: u32) -> u32 {
    let mut mask = mask;
    if flip & 3 != 0 {
        mask = (mask & 0x5555) << 1 | mask >> 1 & 0x5555;
        mask = (mask & 0x3333) << 2 | mask >> 2 & 0x3333;
    }
    if flip & 12 != 0 {
        mask = (mask & 0x0f0f) << 4 | mask >> 4 & 0x0f0f;
        mask = (mask & 0x00ff) << 8 | mask >> 8 & 0x00ff;
    }
    mask
}

#[cfg(test)]
mod tests {
    #[test]
    fn flipping_a_mask_moves_each_bit_to_its_mirror_image() {
        for flip in [0u32, 3, 12, 15] {
            for bit in 0..16u32 {
                assert_eq!(super::flipped(1 << bit, flip), 1 << (bit ^ flip));
            }
        }
    }
}
