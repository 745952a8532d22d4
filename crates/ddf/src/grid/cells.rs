//! Which cells are occupied, and the way of a ray through them.

use std::ops::ControlFlow;

use glam::{IVec3, UVec3, Vec3};
use halflight_shape::TriangleMesh;
use rayon::prelude::*;

/// Triangles are met by cells that are wider by this much, so that rounding loses none.
const CELL_MARGIN: f32 = 1e-3;

/// R³ cells, a bit for each.
#[derive(Clone, Debug)]
pub(crate) struct Cells {
    /// R, a multiple of 4.
    resolution: u32,
    /// R/4.
    blocks_along: u32,
    /// A word for each block of 4³ cells.
    blocks: Vec<u64>,
    /// Lower and upper corner of what is occupied.
    low: Vec3,
    high: Vec3,
}

/// The part of a ray in one occupied cell.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chord {
    pub(crate) cell: UVec3,
    pub(crate) enter: f32,
    pub(crate) leave: f32,
}

#[inline(always)]
fn bit(x: u32, y: u32, z: u32) -> u32 {
    (x & 3) | (y & 3) << 2 | (z & 3) << 4
}

impl Cells {
    /// From the words of a file; `None` if there are not as many as there should be.
    pub(crate) fn from_blocks(resolution: u32, blocks: Vec<u64>) -> Option<Cells> {
        let along = resolution / 4;
        if !resolution.is_multiple_of(4) || resolution == 0 || blocks.len() != (along as usize).pow(3) {
            return None;
        }
        let mut cells =
            Cells { resolution, blocks_along: along, blocks, low: Vec3::INFINITY, high: Vec3::NEG_INFINITY };
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        cells.for_each(|cell| {
            low = low.min(cell.as_vec3());
            high = high.max(cell.as_vec3() + 1.0);
        });
        if low.x > high.x {
            (low, high) = (Vec3::ZERO, Vec3::ZERO);
        }
        (cells.low, cells.high) = (low, high);
        Some(cells)
    }

    /// The cells that the triangles of a mesh, given in grid space, pass through.
    pub(crate) fn of_mesh(mesh: &TriangleMesh, resolution: u32) -> Cells {
        let along = resolution.div_ceil(4).max(1);
        let resolution = along * 4;
        let length = (along as usize).pow(3);
        let parts: Vec<Vec<u64>> = mesh
            .triangles
            .par_chunks(mesh.triangles.len().div_ceil(4).max(1))
            .map(|triangles| {
                let mut blocks = vec![0u64; length];
                for triangle in triangles {
                    mark(triangle.map(|v| mesh.positions[v as usize]), resolution, along, &mut blocks);
                }
                blocks
            })
            .collect();
        let mut blocks = vec![0u64; length];
        for part in parts {
            blocks.iter_mut().zip(part).for_each(|(to, from)| *to |= from);
        }
        Cells::from_blocks(resolution, blocks).unwrap_or_else(|| Cells {
            resolution,
            blocks_along: along,
            blocks: vec![0; length],
            low: Vec3::ZERO,
            high: Vec3::ZERO,
        })
    }

    pub(crate) fn resolution(&self) -> u32 {
        self.resolution
    }

    pub(crate) fn blocks(&self) -> &[u64] {
        &self.blocks
    }

    pub(crate) fn bounds(&self) -> (Vec3, Vec3) {
        (self.low, self.high)
    }

    pub(crate) fn count(&self) -> usize {
        self.blocks.iter().map(|word| word.count_ones() as usize).sum()
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(self.blocks.as_slice())
    }

    #[inline(always)]
    fn block_index(&self, block: UVec3) -> usize {
        ((block.z * self.blocks_along + block.y) * self.blocks_along + block.x) as usize
    }

    #[cfg(test)]
    pub(crate) fn is_occupied(&self, cell: UVec3) -> bool {
        self.blocks[self.block_index(cell / 4)] >> bit(cell.x, cell.y, cell.z) & 1 != 0
    }

    /// Every occupied cell, block by block.
    pub(crate) fn for_each(&self, mut visit: impl FnMut(UVec3)) {
        let along = self.blocks_along as usize;
        for (index, &word) in self.blocks.iter().enumerate() {
            let block = UVec3::new(
                (index % along) as u32,
                (index / along % along) as u32,
                (index / (along * along)) as u32,
            );
            let mut left = word;
            while left != 0 {
                let at = left.trailing_zeros();
                left &= left - 1;
                visit(block * 4 + UVec3::new(at & 3, at >> 2 & 3, at >> 4));
            }
        }
    }

    /// Visits the occupied cells that o + t d passes for `from` ≤ t ≤ `to`, in order. The direction is of unit length.
    #[inline(always)]
    pub(crate) fn walk<B>(
        &self,
        origin: Vec3,
        direction: Vec3,
        from: f32,
        to: f32,
        mut visit: impl FnMut(Chord) -> ControlFlow<B>,
    ) -> Option<B> {
        // A direction along an axis crosses the other two planes far away, not at 0/0.
        const TINY: f32 = 1e-9;
        let nudge = |v: f32| if v.abs() < TINY { TINY.copysign(v) } else { v };
        let d = Vec3::new(nudge(direction.x), nudge(direction.y), nudge(direction.z));
        let inverse = d.recip();
        let (a, b) = ((self.low - origin) * inverse, (self.high - origin) * inverse);
        let enter = a.min(b).max_element().max(from);
        let leave = a.max(b).min_element().min(to);
        if enter.is_nan() || leave.is_nan() || enter >= leave {
            return None;
        }
        let o = origin + d * enter;
        let limit = leave - enter;
        let forward = d.cmpgt(Vec3::ZERO);
        let ahead = Vec3::select(forward, Vec3::ONE, Vec3::ZERO);
        let step = IVec3::select(forward, IVec3::ONE, IVec3::NEG_ONE);
        let most = self.resolution as f32 - 1.0;
        let last = self.blocks_along as i32;
        let mut block = (o.clamp(Vec3::ZERO, Vec3::splat(most)) * 0.25).as_ivec3();
        let mut next = ((block.as_vec3() + ahead) * 4.0 - o) * inverse;
        let delta = inverse.abs() * 4.0;
        let fine_delta = inverse.abs();
        let mut t = 0.0f32;
        loop {
            let out = next.min_element().max(t);
            let word = self.blocks[self.block_index(block.as_uvec3())];
            if word != 0 {
                let base = (block * 4).as_vec3();
                let mut cell = (o + d * t - base).clamp(Vec3::ZERO, Vec3::splat(3.0)).as_ivec3();
                let mut fine_next = (base + cell.as_vec3() + ahead - o) * inverse;
                let mut at = t;
                loop {
                    let until = fine_next.min_element().max(at);
                    if word >> bit(cell.x as u32, cell.y as u32, cell.z as u32) & 1 != 0 {
                        let chord = Chord {
                            cell: (block * 4 + cell).as_uvec3(),
                            enter: enter + at,
                            leave: enter + until.min(limit),
                        };
                        if let ControlFlow::Break(found) = visit(chord) {
                            return Some(found);
                        }
                    }
                    at = until;
                    if at >= limit {
                        return None;
                    }
                    let axis = least_axis(fine_next);
                    cell[axis] += step[axis];
                    fine_next[axis] += fine_delta[axis];
                    if !(0..4).contains(&cell[axis]) {
                        break;
                    }
                }
            }
            t = out;
            if t >= limit {
                return None;
            }
            let axis = least_axis(next);
            block[axis] += step[axis];
            if !(0..last).contains(&block[axis]) {
                return None;
            }
            next[axis] += delta[axis];
        }
    }
}

#[inline(always)]
fn least_axis(v: Vec3) -> usize {
    if v.x <= v.y && v.x <= v.z {
        0
    } else if v.y <= v.z {
        1
    } else {
        2
    }
}

fn mark(corners: [Vec3; 3], resolution: u32, along: u32, blocks: &mut [u64]) {
    let most = Vec3::splat(resolution as f32 - 1.0);
    let low = corners[0].min(corners[1]).min(corners[2]) - CELL_MARGIN;
    let high = corners[0].max(corners[1]).max(corners[2]) + CELL_MARGIN;
    if !(low.is_finite() && high.is_finite()) {
        return;
    }
    let (low, high) = (low.floor().clamp(Vec3::ZERO, most), high.floor().clamp(Vec3::ZERO, most));
    let (low, high) = (low.as_uvec3(), high.as_uvec3());
    for z in low.z..=high.z {
        for y in low.y..=high.y {
            for x in low.x..=high.x {
                let middle = UVec3::new(x, y, z).as_vec3() + 0.5;
                if low == high || meets_box(corners.map(|c| c - middle), 0.5 + CELL_MARGIN) {
                    let block = ((z / 4 * along) + y / 4) * along + x / 4;
                    blocks[block as usize] |= 1 << bit(x, y, z);
                }
            }
        }
    }
}

/// Whether a triangle meets the cube [−half, half]³, by separating axes (Akenine-Möller 2001, *Fast 3D Triangle-Box
/// Overlap Testing*).
fn meets_box(v: [Vec3; 3], half: f32) -> bool {
    let edges = [v[1] - v[0], v[2] - v[1], v[0] - v[2]];
    let low = v[0].min(v[1]).min(v[2]);
    let high = v[0].max(v[1]).max(v[2]);
    if low.max_element() > half || high.min_element() < -half {
        return false;
    }
    let normal = edges[0].cross(edges[1]);
    if normal.dot(v[0]).abs() > half * normal.abs().element_sum() {
        return false;
    }
    for edge in edges {
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            let across = axis.cross(edge);
            let p = v.map(|corner| corner.dot(across));
            let reach = half * across.abs().element_sum();
            if p[0].min(p[1]).min(p[2]) > reach || p[0].max(p[1]).max(p[2]) < -reach {
                return false;
            }
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use halflight_shape::procedural::mesh::ico_sphere;

    fn ball() -> (TriangleMesh, Cells) {
        let mut mesh = ico_sphere(12.0, 4);
        mesh.positions.iter_mut().for_each(|p| *p += Vec3::splat(16.0));
        let cells = Cells::of_mesh(&mesh, 32);
        (mesh, cells)
    }

    #[test]
    fn every_point_of_the_surface_lies_in_an_occupied_cell() {
        let (mesh, cells) = ball();
        let mut random = Random::new(1, 2, 3);
        for _ in 0..10_000 {
            let [a, b, c] = mesh.corners(random.below(mesh.triangles.len()));
            let (u, v) = random.barycentric();
            let p = a + u * (b - a) + v * (c - a);
            assert!(cells.is_occupied(p.as_uvec3()), "{p}");
        }
        assert!(cells.count() < 32 * 32 * 6, "{}", cells.count());
    }

    #[test]
    fn a_walk_visits_the_cells_that_dense_steps_along_the_ray_find() {
        let (_, cells) = ball();
        let mut random = Random::new(4, 5, 6);
        for turn in 0..300 {
            let o = Vec3::new(random.float(), random.float(), random.float()) * 60.0 - 14.0;
            let axis = [Vec3::X, Vec3::NEG_Y, Vec3::Z][turn % 3];
            let d = if turn % 10 == 0 { axis } else { random.direction() };
            let mut visited = Vec::new();
            let mut end = 0.0;
            let none: Option<()> = cells.walk(o, d, 0.0, 100.0, |chord| {
                assert!(chord.enter >= end - 1e-3 && chord.leave >= chord.enter, "{chord:?} after {end}");
                end = chord.leave;
                visited.push(chord.cell);
                ControlFlow::Continue(())
            });
            assert!(none.is_none());
            for i in 0..20_000 {
                let p = o + d * (i as f32 * 0.005);
                let inside = p.min_element() >= 0.0 && p.max_element() < 32.0;
                // A corner that is cut by less than rounding may be passed on either side.
                let clear = (p - p.round()).abs().min_element() > 1e-3;
                if inside && clear && cells.is_occupied(p.as_uvec3()) {
                    assert!(visited.contains(&p.as_uvec3()), "{p} of the ray {o} {d}");
                }
            }
        }
    }

    #[test]
    fn rays_that_are_not_numbers_visit_nothing() {
        let (_, cells) = ball();
        for (o, d) in [(Vec3::NAN, Vec3::X), (Vec3::ZERO, Vec3::NAN), (Vec3::INFINITY, Vec3::X)] {
            let found = cells.walk(o, d, 0.0, 100.0, |_| ControlFlow::Break(()));
            assert!(found.is_none());
        }
    }
}
