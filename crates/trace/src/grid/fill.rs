//! Which points of a few rows a triangle covers, and which triangle is nearest there.

use glam::DVec3;

use super::project::{GUARD, in_front};
use crate::Hit;

/// Points of a row that are asked at once.
const LANES: usize = 8;
/// Nothing covers a point yet.
pub(super) const NOTHING: u32 = u32::MAX;

/// A few whole rows of the grid.
#[derive(Debug, Default)]
pub(super) struct Rows {
    pub(super) columns: usize,
    pub(super) top: usize,
    pub(super) count: usize,
    /// The nearest triangle at each point, its instance [`NOTHING`] where there is none; `t` holds 1/T meanwhile, `u` and
    /// `v` the weights of the second and third corner.
    pub(super) nearest: Vec<Hit>,
    /// Whether a triangle was treated apart.
    pub(super) any_apart: bool,
}

/// Corners of `N` triangles as the grid sees them: `[corner][triangle]`.
pub(super) struct Batch<const N: usize> {
    /// x and y on the grid, not finite or far outside where T ≤ 0 or nearly so.
    pub(super) x: [[f32; N]; 3],
    pub(super) y: [[f32; N]; 3],
    /// 1/T.
    pub(super) nearness: [[f32; N]; 3],
}

/// Points between which a triangle lies, and whether it has to be treated apart.
struct Boxes<const N: usize> {
    left: [i32; N],
    right: [i32; N],
    upper: [i32; N],
    lower: [i32; N],
    /// 1 where all corners are in front of the eye and not far outside, and there are points in the box.
    covering: [u32; N],
    /// 1 where one or two are behind the eye, or all in front and some far outside.
    apart: [u32; N],
}

impl Rows {
    pub(super) fn clear(&mut self, columns: usize, top: usize, count: usize) {
        (self.columns, self.top, self.count, self.any_apart) = (columns, top, count, false);
        self.nearest.clear();
        let nothing = Hit { t: 0.0, instance: NOTHING, primitive: 0, u: 0.0, v: 0.0 };
        self.nearest.resize(columns * count, nothing);
    }

    /// Rasterises the first `count` triangles of a batch; gives a bit for each that has to be treated apart. (Loops, not
    /// closures: a closure that is not inlined would be compiled without the instructions of the level.)
    #[inline(always)]
    pub(super) fn fill<const N: usize>(
        &mut self,
        batch: &Batch<N>,
        count: usize,
        instance: u32,
        primitives: &[u32; N],
    ) -> u32 {
        let boxes = self.boxes(batch);
        let (mut covering, mut apart) = (0, 0);
        for i in 0..N {
            covering |= boxes.covering[i] << i;
            apart |= boxes.apart[i] << i;
        }
        let all = u32::MAX >> (32 - count as u32);
        covering &= all;
        while covering != 0 {
            let i = covering.trailing_zeros() as usize;
            covering &= covering - 1;
            let columns = [boxes.left[i], boxes.right[i]];
            let rows = [boxes.upper[i], boxes.lower[i]];
            let a = [batch.x[0][i], batch.y[0][i], batch.nearness[0][i]];
            let b = [batch.x[1][i], batch.y[1][i], batch.nearness[1][i]];
            let c = [batch.x[2][i], batch.y[2][i], batch.nearness[2][i]];
            self.triangle([a, b, c], columns, rows, instance, primitives[i]);
        }
        self.any_apart |= apart & all != 0;
        apart & all
    }

    #[inline(always)]
    fn boxes<const N: usize>(&self, batch: &Batch<N>) -> Boxes<N> {
        let none = [0; N];
        let mut boxes =
            Boxes { left: none, right: none, upper: none, lower: none, covering: [0; N], apart: [0; N] };
        let (right, top) = (self.columns as f32 - 1.0, self.top as f32);
        let bottom = (self.top + self.count - 1) as f32;
        let (x, y, nearness) = (&batch.x, &batch.y, &batch.nearness);
        for i in 0..N {
            let low_x = least(least(x[0][i], x[1][i]), x[2][i]);
            let high_x = most(most(x[0][i], x[1][i]), x[2][i]);
            let low_y = least(least(y[0][i], y[1][i]), y[2][i]);
            let high_y = most(most(y[0][i], y[1][i]), y[2][i]);
            // 1/T has the sign of T; all comparisons with NaN are false.
            let far = least(least(nearness[0][i], nearness[1][i]), nearness[2][i]);
            let near = most(most(nearness[0][i], nearness[1][i]), nearness[2][i]);
            let inside = (low_x > -GUARD) & (high_x < GUARD) & (low_y > -GUARD) & (high_y < GUARD);
            let plain = (far > 0.0) & inside;
            let (left, right) = (not_below(most(low_x, 0.0)), not_above(most(least(high_x, right), -1.0)));
            let (upper, lower) = (not_below(most(low_y, top)), not_above(most(least(high_y, bottom), -1.0)));
            boxes.covering[i] = u32::from(plain & (left <= right) & (upper <= lower));
            boxes.apart[i] = u32::from(!plain & (near > 0.0));
            (boxes.left[i], boxes.right[i]) = (left, right);
            (boxes.upper[i], boxes.lower[i]) = (upper, lower);
        }
        boxes
    }

    /// One triangle whose corners are (x, y, 1/T), within a box of points.
    ///
    /// The edge functions of an edge are computed from its smaller to its greater end, so that both triangles at it find
    /// the same number: no point falls between them.
    #[inline(always)]
    fn triangle(
        &mut self,
        corners: [[f32; 3]; 3],
        [left, right]: [i32; 2],
        [upper, lower]: [i32; 2],
        instance: u32,
        primitive: u32,
    ) {
        let opposite = [
            Edge::new(corners[1], corners[2]),
            Edge::new(corners[2], corners[0]),
            Edge::new(corners[0], corners[1]),
        ];
        for y in upper..=lower {
            let row = &mut self.nearest[(y as usize - self.top) * self.columns..][..self.columns];
            for first in (left..=right).step_by(LANES) {
                let none = [0.0; LANES];
                let (mut nearness, mut u, mut v) = (none, none, none);
                for lane in 0..LANES {
                    let (at_x, at_y) = ((first + lane as i32) as f32, y as f32);
                    let a = opposite[0].at(at_x, at_y);
                    let b = opposite[1].at(at_x, at_y);
                    let c = opposite[2].at(at_x, at_y);
                    let inside =
                        ((a >= 0.0) & (b >= 0.0) & (c >= 0.0)) | ((a <= 0.0) & (b <= 0.0) & (c <= 0.0));
                    let area = a + b + c;
                    // Weights are linear on the grid when they are multiplied by 1/T.
                    let (a, b, c) = (a * corners[0][2], b * corners[1][2], c * corners[2][2]);
                    let sum = a + b + c;
                    let scale = 1.0 / sum;
                    nearness[lane] = if inside & (area != 0.0) { sum / area } else { 0.0 };
                    (u[lane], v[lane]) = (b * scale, c * scale);
                }
                // Which points are nearer is unforeseeable: it is gathered in bits, not branched on one by one.
                let places = &mut row[first as usize..(right as usize + 1).min(first as usize + LANES)];
                let mut nearer = 0u32;
                for (lane, nearest) in places.iter().enumerate() {
                    nearer |= u32::from(nearness[lane] > nearest.t) << lane;
                }
                while nearer != 0 {
                    let lane = nearer.trailing_zeros() as usize;
                    nearer &= nearer - 1;
                    places[lane] = Hit { t: nearness[lane], instance, primitive, u: u[lane], v: v[lane] };
                }
            }
        }
    }

    /// A triangle with corners (x T, y T, T) of which some are behind the eye or far outside: its edge functions in
    /// three coordinates, within the box of the part before the eye.
    #[inline(never)]
    pub(super) fn across_the_eye(&mut self, [a, b, c]: [DVec3; 3], instance: u32, primitive: u32) {
        let (low, high) = in_front([(a, b), (b, c), (c, a)]);
        let (first, last) = (self.top as f64, (self.top + self.count - 1) as f64);
        let right = self.columns as f64 - 1.0;
        if !(high[1] >= first && low[1] <= last && high[0] >= 0.0 && low[0] <= right) {
            return;
        }
        let volume = a.dot(b.cross(c));
        if volume == 0.0 || !volume.is_finite() {
            return;
        }
        let planes = [b.cross(c) / volume, c.cross(a) / volume, a.cross(b) / volume];
        let columns = low[0].max(0.0).ceil() as usize..=high[0].min(right) as usize;
        for y in low[1].max(first).ceil() as usize..=high[1].min(last) as usize {
            let row = (y - self.top) * self.columns;
            for x in columns.clone() {
                let point = DVec3::new(x as f64, y as f64, 1.0);
                let (a, b, c) = (planes[0].dot(point), planes[1].dot(point), planes[2].dot(point));
                let sum = a + b + c;
                let nearest = &mut self.nearest[row + x];
                if a >= 0.0 && b >= 0.0 && c >= 0.0 && sum as f32 > nearest.t {
                    let (u, v) = ((b / sum) as f32, (c / sum) as f32);
                    *nearest = Hit { t: sum as f32, instance, primitive, u, v };
                }
            }
        }
    }
}

#[inline(always)]
fn least(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
fn most(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// Added to a number of size below 2²², it leaves the nearest whole number in the lowest bits.
const WHOLE: f32 = 12_582_912.0;

#[inline(always)]
fn nearest_whole(value: f32) -> i32 {
    (value + WHOLE).to_bits() as i32 - WHOLE.to_bits() as i32
}

/// The least whole number that is not below a number, or now and then the one before it.
#[inline(always)]
fn not_below(value: f32) -> i32 {
    nearest_whole(value + 0.4999)
}

/// The greatest whole number that is not above a number, or now and then the one after it.
#[inline(always)]
fn not_above(value: f32) -> i32 {
    nearest_whole(value - 0.4999)
}

/// A directed edge from the smaller of its ends to the greater.
#[derive(Clone, Copy)]
struct Edge {
    from: [f32; 2],
    along: [f32; 2],
}

impl Edge {
    #[inline(always)]
    fn new(a: [f32; 3], b: [f32; 3]) -> Self {
        let turned = (b[0], b[1]) < (a[0], a[1]);
        let (from, to) = if turned { (b, a) } else { (a, b) };
        let sign = if turned { -1.0 } else { 1.0 };
        Self { from: [from[0], from[1]], along: [sign * (to[0] - from[0]), sign * (to[1] - from[1])] }
    }

    /// Twice the area of the triangle of the edge and a point.
    #[inline(always)]
    fn at(&self, x: f32, y: f32) -> f32 {
        self.along[0] * (y - self.from[1]) - self.along[1] * (x - self.from[0])
    }
}
