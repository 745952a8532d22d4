//! The vertices of one grid: which there are, and the place of each in the table of features.

use glam::UVec3;

use super::Cells;

/// Vertices of the cells of a grid of resolution R >> `shift` that hold an occupied cell.
#[derive(Clone, Debug)]
pub(crate) struct Level {
    shift: u32,
    blocks_along: u32,
    blocks: Vec<Block>,
    count: usize,
}

/// 4³ vertices.
#[derive(Clone, Copy, Debug, Default)]
struct Block {
    bits: u64,
    before: u32,
}

#[inline(always)]
fn bit(x: u32, y: u32, z: u32) -> u32 {
    (x & 3) | (y & 3) << 2 | (z & 3) << 4
}

impl Level {
    pub(crate) fn new(cells: &Cells, shift: u32) -> Level {
        let along = ((cells.resolution() >> shift) + 1).div_ceil(4);
        let mut blocks = vec![Block::default(); (along as usize).pow(3)];
        cells.for_each(|cell| {
            let cell = cell >> shift;
            for corner in 0..8 {
                let v = cell + UVec3::new(corner & 1, corner >> 1 & 1, corner >> 2);
                let block = ((v.z / 4 * along) + v.y / 4) * along + v.x / 4;
                blocks[block as usize].bits |= 1 << bit(v.x, v.y, v.z);
            }
        });
        let mut count = 0;
        for block in &mut blocks {
            block.before = count;
            count += block.bits.count_ones();
        }
        Level { shift, blocks_along: along, blocks, count: count as usize }
    }

    #[inline(always)]
    pub(crate) fn shift(&self) -> u32 {
        self.shift
    }

    /// How many vertices there are.
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(self.blocks.as_slice())
    }

    /// The places of the eight corners of the cell of this grid that holds an occupied cell; x fastest.
    #[inline(always)]
    pub(crate) fn corners(&self, cell: UVec3) -> [u32; 8] {
        let c = UVec3::new(cell.x >> self.shift, cell.y >> self.shift, cell.z >> self.shift);
        let mut places = [0; 8];
        for (corner, place) in places.iter_mut().enumerate() {
            let corner = corner as u32;
            let (x, y, z) = (c.x + (corner & 1), c.y + (corner >> 1 & 1), c.z + (corner >> 2));
            let block = self.blocks
                [((((z >> 2) * self.blocks_along) + (y >> 2)) * self.blocks_along + (x >> 2)) as usize];
            let below = block.bits & ((1u64 << bit(x, y, z)) - 1);
            *place = block.before + below.count_ones();
        }
        places
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use halflight_shape::procedural::mesh::ico_sphere;
    use std::collections::HashMap;

    #[test]
    fn every_vertex_has_one_place_of_its_own() {
        let mut mesh = ico_sphere(12.0, 3);
        mesh.positions.iter_mut().for_each(|p| *p += glam::Vec3::splat(16.0));
        let cells = Cells::of_mesh(&mesh, 32);
        for shift in [0, 1, 2] {
            let level = Level::new(&cells, shift);
            let mut places = HashMap::new();
            cells.for_each(|cell| {
                for (corner, place) in level.corners(cell).into_iter().enumerate() {
                    let corner = corner as u32;
                    let vertex = (cell >> shift) + UVec3::new(corner & 1, corner >> 1 & 1, corner >> 2);
                    assert_eq!(*places.entry(vertex).or_insert(place), place);
                }
            });
            let mut all: Vec<u32> = places.into_values().collect();
            all.sort_unstable();
            assert_eq!(all, (0..level.count() as u32).collect::<Vec<_>>());
        }
    }
}
