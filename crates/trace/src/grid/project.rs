//! From points to the coordinates of a grid of rays.
//!
//! A point p is on the ray through (x, y) at T times the length from the eye to the grid if
//! p − origin = T (corner + x across + y down): with the matrix of the three vectors inverted, (x T, y T, T) is an affine
//! function of p, here made for the points of an instance.

use glam::{Affine3A, DAffine3, DMat3, DVec3, Vec3};

use super::RayGrid;
use crate::mesh::Block;

/// Coordinates beyond this many rays from the grid's corner are left to [`super::fill::across_the_eye`].
pub(super) const GUARD: f32 = 16384.0;

/// The affine function; row k gives the k-th of (x T, y T, T).
#[derive(Clone, Copy, Debug)]
pub(super) struct Projection {
    exact: DAffine3,
    pub(super) rows: [[f32; 4]; 3],
}

/// Rays that a thing may be seen by: `low ≤ (x, y) ≤ high`, not necessarily whole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Extent {
    pub(super) low: [f32; 2],
    pub(super) high: [f32; 2],
}

impl Extent {
    pub(super) fn is_empty(&self) -> bool {
        !(self.low[0] <= self.high[0] && self.low[1] <= self.high[1])
    }

    /// Whether any of `count` rows from `top` on may see it.
    #[inline(always)]
    pub(super) fn meets_rows(&self, top: usize, count: usize) -> bool {
        self.low[1] <= (top + count - 1) as f32 && self.high[1] >= top as f32
    }
}

/// Nearer to the eye's plane than this part of the farthest end of an edge nothing is looked for.
const NEAREST: f64 = 1e-20;

/// The box on the grid around what lies before the eye of edges between points (x T, y T, T).
pub(super) fn in_front<const N: usize>(edges: [(DVec3, DVec3); N]) -> ([f64; 2], [f64; 2]) {
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    let mut add = |point: DVec3, t: f64| {
        let (x, y) = (point.x / t, point.y / t);
        low = [low[0].min(x), low[1].min(y)];
        high = [high[0].max(x), high[1].max(y)];
    };
    let mut farthest = 0.0_f64;
    for (a, b) in &edges {
        farthest = farthest.max(a.z).max(b.z);
    }
    let near = NEAREST * farthest;
    for (a, b) in edges {
        if a.z >= near && near > 0.0 {
            add(a, a.z);
        }
        if b.z >= near && near > 0.0 {
            add(b, b.z);
        }
        if (a.z >= near) != (b.z >= near) && near > 0.0 {
            add(a + (b - a) * ((near - a.z) / (b.z - a.z)), near);
        }
    }
    (low, high)
}

impl Projection {
    /// For points of the world; none if the rays of the grid do not span space.
    pub(super) fn of_grid(grid: &RayGrid) -> Option<Projection> {
        let spanned = DMat3::from_cols(grid.across.as_dvec3(), grid.down.as_dvec3(), grid.corner.as_dvec3());
        let inverse = spanned.inverse();
        let exact = DAffine3::from_mat3_translation(inverse, -(inverse * grid.origin.as_dvec3()));
        (spanned.determinant() != 0.0).then(|| Projection::new(exact)).flatten()
    }

    fn new(exact: DAffine3) -> Option<Projection> {
        let (matrix, moved) = (exact.matrix3.transpose(), exact.translation);
        let row = |axes: DVec3, moved: f64| [axes.x as f32, axes.y as f32, axes.z as f32, moved as f32];
        let rows = [row(matrix.x_axis, moved.x), row(matrix.y_axis, moved.y), row(matrix.z_axis, moved.z)];
        rows.as_flattened().iter().all(|x| x.is_finite()).then_some(Projection { exact, rows })
    }

    /// For the points of an instance.
    pub(super) fn after(&self, transform: &Affine3A) -> Projection {
        let matrix = glam::Mat3::from(transform.matrix3).as_dmat3();
        let placed = DAffine3::from_mat3_translation(matrix, Vec3::from(transform.translation).as_dvec3());
        Projection::new(self.exact * placed).unwrap_or(*self)
    }

    /// (x T, y T, T) of a point.
    #[inline(always)]
    pub(super) fn of(&self, x: f32, y: f32, z: f32) -> [f32; 3] {
        let [p, q, r] = &self.rows;
        [
            p[0] * x + p[1] * y + (p[2] * z + p[3]),
            q[0] * x + q[1] * y + (q[2] * z + q[3]),
            r[0] * x + r[1] * y + (r[2] * z + r[3]),
        ]
    }

    /// [`Self::of`] without a rounding to floats: where a triangle is far larger than its distance to the eye, its corners
    /// say nothing of that distance in floats.
    pub(super) fn exactly(&self, point: Vec3) -> DVec3 {
        self.exact.transform_point3(point.as_dvec3())
    }

    /// The rays of the grid that may see something in a box. A little wider, for roundings.
    pub(super) fn of_box(&self, (low, high): (Vec3, Vec3), grid: &RayGrid) -> Extent {
        let corner = |number: usize| {
            let pick = |axis: usize| f64::from(if number >> axis & 1 == 0 { low[axis] } else { high[axis] });
            self.exact.transform_point3(DVec3::new(pick(0), pick(1), pick(2)))
        };
        let corners: [DVec3; 8] = std::array::from_fn(corner);
        let (low, high) = in_front(EDGES.map(|[a, b]| (corners[a], corners[b])));
        let last = [grid.columns as f64 - 1.0, grid.rows as f64 - 1.0];
        let mut extent = Extent { low: [0.0; 2], high: [0.0; 2] };
        if !(low[0] <= high[0] && low[1] <= high[1]) {
            // All of it is behind the eye.
            return Extent { low: [1.0; 2], ..extent };
        }
        for axis in 0..2 {
            let slack = |end: f64| 1e-3 + 1e-6 * end.abs();
            extent.low[axis] = (low[axis] - slack(low[axis])).max(0.0) as f32;
            extent.high[axis] = (high[axis] + slack(high[axis])).min(last[axis]) as f32;
        }
        extent
    }

    /// The rays of the grid that may see triangles.
    pub(super) fn of_leaves(&self, leaves: &[Block], grid: &RayGrid) -> Extent {
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for corner in leaves.iter().flat_map(|leaf| &leaf.corners) {
            for axis in 0..3 {
                for &at in &corner[axis] {
                    // Places without a triangle are NaN, which is neither less nor more.
                    low[axis] = if at < low[axis] { at } else { low[axis] };
                    high[axis] = if at > high[axis] { at } else { high[axis] };
                }
            }
        }
        self.of_box((low.into(), high.into()), grid)
    }
}

/// Edges of a box whose corner k has the high end of axis a where bit a of k is set.
const EDGES: [[usize; 2]; 12] =
    [[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]];
