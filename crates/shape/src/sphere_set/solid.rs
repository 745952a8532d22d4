//! What is inside a mesh, in voxels, and how much of a ball is not.
//!
//! A voxel is inside if the generalised winding number at its centre, w = ∫ (signed crossings along d) dω / 4π,
//! estimated from the six directions ±x, ±y, ±z, exceeds ½ in magnitude; or if at least five of the six meet the
//! surface an odd number of times, which saves meshes whose parts do not agree on what is outside. On closed meshes
//! all six agree; at the holes of a scan the majority decides; sheets ([`super::sheets`]) enclose nothing.
//!
//! Crossings are found by drawing every triangle onto the columns of the grid, three times, with edges that neighbours
//! decide alike, so that no ray slips through between two triangles. The volume of a ball outside is the sum over the
//! rows of a grid: chord less what prefix sums say is inside. Coarser grids serve larger balls, so a ball costs at
//! most about 800 rows, some 3 µs.

use glam::{IVec3, Vec3};
use rayon::prelude::*;

use super::sheets::without_sheets;

/// The largest radius, in cells, for which a level is used.
const LARGEST_RADIUS: f32 = 16.0;
/// The coarsest level has at least this many cells on its longest side.
const COARSEST: usize = 12;

/// The inside of a mesh.
pub(super) struct Solid {
    /// The finest first, each half as fine as the one before.
    levels: Vec<Level>,
    /// Inside volume.
    pub(super) volume: f64,
}

/// A grid of cells with the share of each that is inside.
struct Level {
    low: Vec3,
    cell: f32,
    size: [usize; 3],
    /// Along x: `prefix[row * (nx + 1) + i]` is the inside length of the first i cells, in cells.
    prefix: Vec<f32>,
}

impl Solid {
    /// Fills a mesh within `low..high`, with `longest` cells along the longest side.
    pub(super) fn build(
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        bounds: (Vec3, Vec3),
        longest: usize,
    ) -> Self {
        let extent = (bounds.1 - bounds.0).max_element().max(f32::MIN_POSITIVE);
        let cell = extent / longest as f32;
        // Odd margins keep voxel centres off the planes and edges that modelled meshes like.
        let low = bounds.0 - cell * Vec3::new(1.371, 1.289, 1.447);
        let size = ((bounds.1 - low) / cell).to_array().map(|n| n.ceil() as usize + 2);
        let inside = fill(positions, &without_sheets(positions, triangles), low, cell, size);
        let volume = inside.iter().filter(|x| **x > 0.0).count() as f64 * f64::from(cell).powi(3);
        let mut levels = Vec::new();
        let mut grid = (inside, size, cell);
        loop {
            let coarse = grid.1.iter().max() < Some(&(2 * COARSEST));
            let next = if coarse { None } else { Some(halved(&grid)) };
            levels.push(Level::new(low, &grid));
            match next {
                Some(next) => grid = next,
                None => break Self { levels, volume },
            }
        }
    }

    /// The edge of the finest cells.
    pub(super) fn cell(&self) -> f32 {
        self.levels[0].cell
    }

    /// All cells of the finest level that are inside: their indices, x fastest.
    pub(super) fn cells(&self) -> Vec<[usize; 3]> {
        let level = &self.levels[0];
        let [nx, ny, nz] = level.size;
        let all = (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])));
        all.filter(|&at| level.value(at) > 0.5).collect()
    }

    /// The centre of a cell of the finest level.
    pub(super) fn center(&self, at: [usize; 3]) -> Vec3 {
        let level = &self.levels[0];
        level.low + level.cell * Vec3::from_array(at.map(|i| i as f32 + 0.5))
    }

    /// The number of cells of the finest level along each axis.
    pub(super) fn size(&self) -> [usize; 3] {
        self.levels[0].size
    }

    /// The level that suits balls about as large as this one.
    pub(super) fn level_for(&self, radius: f32) -> usize {
        let fits = |level: &Level| radius <= LARGEST_RADIUS * level.cell;
        self.levels.iter().position(fits).unwrap_or(self.levels.len() - 1)
    }

    /// The volume of a ball that is not inside, counted on one level.
    pub(super) fn outside(&self, level: usize, center: Vec3, radius: f32) -> f32 {
        let volume = 4.0 / 3.0 * std::f32::consts::PI * radius.powi(3);
        volume * self.levels[level].outside_fraction(center, radius)
    }
}

impl Level {
    fn new(low: Vec3, (inside, size, cell): &(Vec<f32>, [usize; 3], f32)) -> Self {
        let nx = size[0];
        let mut prefix = Vec::with_capacity((nx + 1) * size[1] * size[2]);
        for row in inside.chunks_exact(nx) {
            let mut sum = 0.0;
            prefix.push(0.0);
            for x in row {
                sum += x;
                prefix.push(sum);
            }
        }
        Self { low, cell: *cell, size: *size, prefix }
    }

    fn value(&self, [x, y, z]: [usize; 3]) -> f32 {
        let at = (z * self.size[1] + y) * (self.size[0] + 1) + x;
        self.prefix[at + 1] - self.prefix[at]
    }

    /// The share of a ball that is not inside. Continuous in centre and radius: the chords of rows at the rim have no
    /// length.
    fn outside_fraction(&self, center: Vec3, radius: f32) -> f32 {
        let c = (center - self.low) / self.cell;
        let r = radius / self.cell;
        let [nx, ny, nz] = self.size;
        let rows = |c: f32, r: f32| ((c - r - 0.5).ceil() as i32)..=((c + r - 0.5).floor() as i32);
        let (mut ball, mut inside) = (0.0f32, 0.0f32);
        for z in rows(c.z, r) {
            let dz = z as f32 + 0.5 - c.z;
            let disk = r * r - dz * dz;
            for y in rows(c.y, disk.max(0.0).sqrt()) {
                let dy = y as f32 + 0.5 - c.y;
                let half = (disk - dy * dy).max(0.0).sqrt();
                ball += 2.0 * half;
                if z < 0 || y < 0 || z as usize >= nz || y as usize >= ny {
                    continue;
                }
                let row = &self.prefix[(z as usize * ny + y as usize) * (nx + 1)..][..=nx];
                if row[nx] > 0.0 {
                    inside += sum_to(row, c.x + half) - sum_to(row, c.x - half);
                }
            }
        }
        if ball > 0.0 {
            return (1.0 - inside / ball).clamp(0.0, 1.0);
        }
        // Smaller than a cell and between the rows: all of it is like the cell it lies in.
        let at = c.floor().as_ivec3();
        let within =
            at.cmpge(IVec3::ZERO).all() && at.cmplt(IVec3::new(nx as i32, ny as i32, nz as i32)).all();
        if within { 1.0 - self.value(at.to_array().map(|i| i as usize)) } else { 1.0 }
    }
}

/// The prefix sum at any place, linear between cells.
#[inline]
fn sum_to(row: &[f32], x: f32) -> f32 {
    let last = row.len() - 1;
    let x = x.clamp(0.0, last as f32);
    let i = (x as usize).min(last - 1);
    row[i] + (x - i as f32) * (row[i + 1] - row[i])
}

/// The same grid with cells twice as large.
fn halved((inside, size, cell): &(Vec<f32>, [usize; 3], f32)) -> (Vec<f32>, [usize; 3], f32) {
    let [nx, ny, nz] = *size;
    let half = size.map(|n| n.div_ceil(2));
    let mut values = vec![0.0; half[0] * half[1] * half[2]];
    for z in 0..nz {
        for y in 0..ny {
            let row = &inside[(z * ny + y) * nx..][..nx];
            let target = &mut values[(z / 2 * half[1] + y / 2) * half[0]..][..half[0]];
            for (x, value) in row.iter().enumerate() {
                target[x / 2] += 0.125 * value;
            }
        }
    }
    (values, half, 2.0 * cell)
}

/// 1 for each cell whose centre is inside and 0 for the others, x fastest.
fn fill(positions: &[Vec3], triangles: &[[u32; 3]], low: Vec3, cell: f32, size: [usize; 3]) -> Vec<f32> {
    let votes: Vec<(Vec<i8>, Vec<u8>)> =
        (0..3).into_par_iter().map(|axis| votes_along(axis, positions, triangles, low, cell, size)).collect();
    let count = size[0] * size[1] * size[2];
    (0..count)
        .into_par_iter()
        .map(|i| {
            let winding: i32 = votes.iter().map(|(winding, _)| i32::from(winding[i])).sum();
            let odd: u8 = votes.iter().map(|(_, odd)| odd[i]).sum();
            f32::from(u8::from(winding.abs() > 3 || odd >= 5))
        })
        .collect()
}

/// Signed crossings seen along +axis and −axis, added up, and how many of the two counts are odd.
fn votes_along(
    axis: usize,
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    low: Vec3,
    cell: f32,
    size: [usize; 3],
) -> (Vec<i8>, Vec<u8>) {
    let mut crossings = crossings(axis, positions, triangles, low, cell, size);
    crossings.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let count = size[0] * size[1] * size[2];
    let (mut winding, mut odd) = (vec![0i8; count], vec![0u8; count]);
    let stride = [1, size[0], size[0] * size[1]];
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    for column in crossings.chunk_by(|a, b| a.0 == b.0) {
        let at = column[0].0 as usize;
        let base = at % size[u] * stride[u] + at / size[u] * stride[v];
        let total: i32 = column.iter().map(|c| i32::from(c.2)).sum();
        let (mut passed, mut below) = (0usize, 0i32);
        for k in 0..size[axis] {
            while passed < column.len() && column[passed].1 < k as f32 + 0.5 {
                below += i32::from(column[passed].2);
                passed += 1;
            }
            let i = base + k * stride[axis];
            // Leaving through the front counts +1: along +axis a normal that points along it, along −axis against.
            winding[i] = (total - below - below).clamp(-100, 100) as i8;
            odd[i] = (passed % 2 + (column.len() - passed) % 2) as u8;
        }
    }
    (winding, odd)
}

/// (column, depth in cells, +1 where the front looks along +axis and −1 where it looks back) of each crossing.
fn crossings(
    axis: usize,
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    low: Vec3,
    cell: f32,
    size: [usize; 3],
) -> Vec<(u32, f32, i8)> {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut found = Vec::new();
    for triangle in triangles {
        // In cells, centres at integers.
        let corners = triangle.map(|i| {
            let p = ((positions[i as usize] - low) / cell).to_array();
            [f64::from(p[u]) - 0.5, f64::from(p[v]) - 0.5, f64::from(p[axis])]
        });
        let range = |k: usize, n: usize| {
            let least = corners.iter().map(|c| c[k]).fold(f64::INFINITY, f64::min);
            let most = corners.iter().map(|c| c[k]).fold(f64::NEG_INFINITY, f64::max);
            (least.ceil().max(0.0) as usize)..((most.floor() + 1.0).clamp(0.0, n as f64) as usize)
        };
        let area = cross(corners[0], corners[1], corners[2]);
        if area == 0.0 {
            continue;
        }
        for j in range(1, size[v]) {
            for i in range(0, size[u]) {
                let p = [i as f64, j as f64, 0.0];
                let sides = [0, 1, 2].map(|k| left_of(corners[k], corners[(k + 1) % 3], p));
                if sides[0] == sides[1] && sides[1] == sides[2] {
                    let weights =
                        [(1, 2), (2, 0), (0, 1)].map(|(a, b)| cross(corners[a], corners[b], p) / area);
                    let depth: f64 = (0..3).map(|k| weights[k] * corners[k][2]).sum();
                    found.push(((j * size[u] + i) as u32, depth as f32, if area > 0.0 { 1 } else { -1 }));
                }
            }
        }
    }
    found
}

/// Twice the signed area of a triangle in (u, v).
fn cross(a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Whether a point is left of an edge. The edge is always taken in the same direction, so that the triangles on both of
/// its sides get opposite answers.
fn left_of(a: [f64; 3], b: [f64; 3], p: [f64; 3]) -> bool {
    if (a[0], a[1]) <= (b[0], b[1]) { cross(a, b, p) > 0.0 } else { cross(b, a, p) <= 0.0 }
}

impl Solid {
    /// The volume of the union of balls, and of the part of it that is inside.
    pub(super) fn union_of(&self, balls: &[(Vec3, f32)]) -> (f64, f64) {
        let level = &self.levels[0];
        let [nx, ny, nz] = level.size;
        let rows: Vec<(f64, f64)> = (0..nz)
            .into_par_iter()
            .map(|z| {
                let height = level.low.z + level.cell * (z as f32 + 0.5);
                let cut: Vec<_> = balls.iter().filter(|(c, r)| (c.z - height).abs() < *r).collect();
                let (mut union, mut inside) = (0.0, 0.0);
                let mut chords: Vec<(f32, f32)> = Vec::new();
                for y in 0..ny {
                    let depth = level.low.y + level.cell * (y as f32 + 0.5);
                    chords.clear();
                    for (c, r) in &cut {
                        let half = r * r - (c.z - height).powi(2) - (c.y - depth).powi(2);
                        if half > 0.0 {
                            let (x, half) = ((c.x - level.low.x) / level.cell, half.sqrt() / level.cell);
                            chords.push((x - half, x + half));
                        }
                    }
                    let row = &level.prefix[(z * ny + y) * (nx + 1)..][..=nx];
                    for_each_union(&mut chords, |from, to| {
                        union += f64::from(to - from);
                        inside += f64::from(sum_to(row, to) - sum_to(row, from));
                    });
                }
                (union, inside)
            })
            .collect();
        let cubic = f64::from(level.cell).powi(3);
        let sum = rows.into_iter().fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
        (sum.0 * cubic, sum.1 * cubic)
    }
}

/// Visits the disjoint intervals that overlapping ones make.
pub(super) fn for_each_union(intervals: &mut [(f32, f32)], mut visit: impl FnMut(f32, f32)) {
    intervals.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut open: Option<(f32, f32)> = None;
    for &mut (from, to) in intervals {
        open = match open {
            Some((begin, end)) if from <= end => Some((begin, end.max(to))),
            Some((begin, end)) => {
                visit(begin, end);
                Some((from, to))
            }
            None => Some((from, to)),
        };
    }
    if let Some((begin, end)) = open {
        visit(begin, end);
    }
}
