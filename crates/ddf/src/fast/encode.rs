//! From the ray's part in a cell to the inputs of the network.
//!
//! Points at equal steps of the part, p_k = start + k/(K−1) · length · ω; at each the features of the corners of the
//! cell of each grid, interpolated trilinearly. All points share their corners, so that a grid costs eight look-ups
//! whatever K is. After them ω and the length in cells.

use glam::{UVec3, Vec3};

use super::matmul::fma;
use super::shape::{FastShape, MOST_LEVELS};
use crate::grid::Level;

/// The ray's part in a cell, in grid space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Part {
    pub(crate) cell: UVec3,
    pub(crate) start: Vec3,
    pub(crate) direction: Vec3,
    pub(crate) length: f32,
}

/// Where the features of a cell stand.
pub(crate) type Corners = [[u32; 8]; MOST_LEVELS];

/// The corners of a cell in each grid.
#[inline(always)]
pub(crate) fn corners(levels: &[Level], cell: UVec3) -> Corners {
    let mut corners = [[0; 8]; MOST_LEVELS];
    for (level, to) in levels.iter().zip(&mut corners) {
        *to = level.corners(cell);
    }
    corners
}

/// Position within the cell of a grid, 0 to 1 but for the margin.
#[inline(always)]
pub(crate) fn local(point: Vec3, cell: UVec3, shift: u32) -> Vec3 {
    let base = Vec3::new((cell.x >> shift) as f32, (cell.y >> shift) as f32, (cell.z >> shift) as f32);
    point * (1.0 / (1u32 << shift) as f32) - base
}

/// Weights of the eight corners.
#[inline(always)]
pub(crate) fn weights(f: Vec3) -> [f32; 8] {
    let g = Vec3::ONE - f;
    let (a, b, c, d) = (g.x * g.y, f.x * g.y, g.x * f.y, f.x * f.y);
    [a * g.z, b * g.z, c * g.z, d * g.z, a * f.z, b * f.z, c * f.z, d * f.z]
}

/// The point of a part at a fraction of its length.
#[inline(always)]
pub(crate) fn point(part: &Part, k: usize, points: usize) -> Vec3 {
    part.start + part.direction * (part.length * k as f32 / (points - 1) as f32)
}

/// How features are stored.
pub(crate) trait Table {
    /// The features of a vertex.
    fn get<const F: usize>(&self, place: u32) -> [f32; F];
}

impl Table for [f32] {
    #[inline(always)]
    fn get<const F: usize>(&self, place: u32) -> [f32; F] {
        *self[place as usize * F..].first_chunk().unwrap_or(&[0.0; F])
    }
}

impl Table for [i16] {
    #[inline(always)]
    fn get<const F: usize>(&self, place: u32) -> [f32; F] {
        let raw: &[i16; F] = self[place as usize * F..].first_chunk().unwrap_or(&[0; F]);
        let mut wide = [0.0; F];
        for i in 0..F {
            wide[i] = f32::from(raw[i]);
        }
        wide
    }
}

/// Writes the inputs of a part. `scales` multiply what the tables hold.
#[inline(always)]
pub(crate) fn encode<const FUSED: bool, const F: usize, T: Table + ?Sized>(
    shape: &FastShape,
    levels: &[Level],
    tables: &[&T],
    scales: &[f32],
    corners: &Corners,
    part: &Part,
    inputs: &mut [f32],
) {
    let mut at = 0;
    for (number, level) in levels.iter().enumerate() {
        let mut features = [[0.0f32; F]; 8];
        for c in 0..8 {
            features[c] = tables[number].get(corners[number][c]);
        }
        let scale = scales[number];
        for k in 0..shape.points {
            let w = weights(local(point(part, k, shape.points), part.cell, level.shift()));
            let mut sum = [0.0; F];
            for c in 0..8 {
                for f in 0..F {
                    sum[f] = fma::<FUSED>(w[c], features[c][f], sum[f]);
                }
            }
            for f in 0..F {
                inputs[at + f] = sum[f] * scale;
            }
            at += F;
        }
    }
    inputs[at..at + 4].copy_from_slice(&[part.direction.x, part.direction.y, part.direction.z, part.length]);
    inputs[at + 4..].fill(0.0);
}

/// Adds the gradient by the features, given that by the inputs.
#[inline(always)]
pub(crate) fn encode_gradient<const FUSED: bool, const F: usize>(
    shape: &FastShape,
    levels: &[Level],
    corners: &Corners,
    part: &Part,
    of_inputs: &[f32],
    tables: &mut [Vec<f32>],
) {
    let mut at = 0;
    for (number, level) in levels.iter().enumerate() {
        let mut sums = [[0.0f32; F]; 8];
        for k in 0..shape.points {
            let w = weights(local(point(part, k, shape.points), part.cell, level.shift()));
            let g: &[f32; F] = of_inputs[at..].first_chunk().unwrap_or(&[0.0; F]);
            for c in 0..8 {
                for f in 0..F {
                    sums[c][f] = fma::<FUSED>(w[c], g[f], sums[c][f]);
                }
            }
            at += F;
        }
        let table = &mut tables[number];
        for c in 0..8 {
            let to = &mut table[corners[number][c] as usize * F..][..F];
            for f in 0..F {
                to[f] += sums[c][f];
            }
        }
    }
}

/// A direction in which a part is moved: its start, and its length with it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Move {
    pub(crate) start: Vec3,
    pub(crate) length: f32,
}

/// The faces through which a part's line enters and leaves its cell, by axis; a line along an axis has no others.
#[inline(always)]
pub(crate) fn face_axes(part: &Part) -> (usize, usize) {
    let (low, high) = (part.cell.as_vec3(), part.cell.as_vec3() + 1.0);
    let d = part.direction;
    let (mut leave, mut leave_axis, mut enter, mut enter_axis) = (f32::INFINITY, 0, f32::NEG_INFINITY, 0);
    for axis in 0..3 {
        if d[axis].abs() < 1e-9 {
            continue;
        }
        let (near, far) = if d[axis] > 0.0 { (low, high) } else { (high, low) };
        let (a, b) = ((near[axis] - part.start[axis]) / d[axis], (far[axis] - part.start[axis]) / d[axis]);
        if a > enter {
            (enter, enter_axis) = (a, axis);
        }
        if b < leave {
            (leave, leave_axis) = (b, axis);
        }
    }
    (enter_axis, leave_axis)
}

/// Slopes of the weights of the eight corners along a direction.
#[inline(always)]
fn weight_slopes(f: Vec3, along: Vec3) -> [f32; 8] {
    let g = Vec3::ONE - f;
    let (x, y, z) = ([g.x, f.x], [g.y, f.y], [g.z, f.z]);
    let d = |v: f32| [-v, v];
    let (dx, dy, dz) = (d(along.x), d(along.y), d(along.z));
    let mut slopes = [0.0; 8];
    for c in 0..8 {
        let (i, j, k) = (c & 1, c >> 1 & 1, c >> 2);
        slopes[c] = (dx[i] * y[j] + x[i] * dy[j]) * z[k] + x[i] * y[j] * dz[k];
    }
    slopes
}

/// How the point at a fraction of a part moves.
#[inline(always)]
fn point_move(part: &Part, by: &Move, k: usize, points: usize) -> Vec3 {
    by.start + part.direction * (by.length * k as f32 / (points - 1) as f32)
}

/// Writes the derivative of the inputs as the part is moved.
#[inline(always)]
pub(crate) fn encode_move<const FUSED: bool, const F: usize>(
    shape: &FastShape,
    levels: &[Level],
    tables: &[&[f32]],
    corners: &Corners,
    part: &Part,
    by: &Move,
    inputs: &mut [f32],
) {
    let mut at = 0;
    for (number, level) in levels.iter().enumerate() {
        let cell_size = (1u32 << level.shift()) as f32;
        let mut features = [[0.0f32; F]; 8];
        for c in 0..8 {
            features[c] = Table::get(tables[number], corners[number][c]);
        }
        for k in 0..shape.points {
            let f = local(point(part, k, shape.points), part.cell, level.shift());
            let w = weight_slopes(f, point_move(part, by, k, shape.points) / cell_size);
            let mut sum = [0.0; F];
            for c in 0..8 {
                for f in 0..F {
                    sum[f] = fma::<FUSED>(w[c], features[c][f], sum[f]);
                }
            }
            inputs[at..at + F].copy_from_slice(&sum);
            at += F;
        }
    }
    inputs[at..at + 3].fill(0.0);
    inputs[at + 3] = by.length;
    inputs[at + 4..].fill(0.0);
}

/// Adds the gradient by the features, given that by the derivative of the inputs.
#[inline(always)]
pub(crate) fn encode_move_gradient<const FUSED: bool, const F: usize>(
    shape: &FastShape,
    levels: &[Level],
    corners: &Corners,
    part: &Part,
    by: &Move,
    of_inputs: &[f32],
    tables: &mut [Vec<f32>],
) {
    let mut at = 0;
    for (number, level) in levels.iter().enumerate() {
        let cell_size = (1u32 << level.shift()) as f32;
        let mut sums = [[0.0f32; F]; 8];
        for k in 0..shape.points {
            let f = local(point(part, k, shape.points), part.cell, level.shift());
            let w = weight_slopes(f, point_move(part, by, k, shape.points) / cell_size);
            let g: &[f32; F] = of_inputs[at..].first_chunk().unwrap_or(&[0.0; F]);
            for c in 0..8 {
                for f in 0..F {
                    sums[c][f] = fma::<FUSED>(w[c], g[f], sums[c][f]);
                }
            }
            at += F;
        }
        let table = &mut tables[number];
        for c in 0..8 {
            let to = &mut table[corners[number][c] as usize * F..][..F];
            for f in 0..F {
                to[f] += sums[c][f];
            }
        }
    }
}

/// The derivative of the output by each point of the part, given that by the inputs; the last entry is that by the
/// length alone (as an input of its own).
pub(crate) fn point_gradient<const F: usize, T: Table + ?Sized>(
    shape: &FastShape,
    levels: &[Level],
    tables: &[&T],
    scales: &[f32],
    corners: &Corners,
    part: &Part,
    of_inputs: &[f32],
) -> ([Vec3; super::shape::MOST_POINTS], f32) {
    let mut by_point = [Vec3::ZERO; super::shape::MOST_POINTS];
    let mut at = 0;
    for (number, level) in levels.iter().enumerate() {
        let cell_size = (1u32 << level.shift()) as f32;
        for k in 0..shape.points {
            let f = local(point(part, k, shape.points), part.cell, level.shift());
            let g = Vec3::ONE - f;
            let mut by_local = Vec3::ZERO;
            for c in 0..8 {
                let vertex: [f32; F] = tables[number].get(corners[number][c]);
                let along: f32 = (0..F).map(|i| vertex[i] * of_inputs[at + i]).sum();
                let pick = |bit: usize, axis: usize| if c >> bit & 1 != 0 { f[axis] } else { g[axis] };
                let sign = |bit: usize| if c >> bit & 1 != 0 { 1.0 } else { -1.0 };
                by_local += along
                    * Vec3::new(
                        sign(0) * pick(1, 1) * pick(2, 2),
                        sign(1) * pick(0, 0) * pick(2, 2),
                        sign(2) * pick(0, 0) * pick(1, 1),
                    );
            }
            by_point[k] += by_local * (scales[number] / cell_size);
            at += F;
        }
    }
    (by_point, of_inputs[at + 3])
}
