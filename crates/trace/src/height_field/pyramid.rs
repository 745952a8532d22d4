//! The least and greatest heights of blocks of cells, of blocks of blocks, and so on.
//!
//! A node of level l has 4 × 4 children, each a square of 4^(l+1) cells; the children of level 0 are blocks of
//! 4 × 4 cells. Memory: 2 floats for 16 cells on level 0, in all 2/15 of that of the heights.

use halflight_shape::HeightField;
use rayon::prelude::*;

/// The intervals of height of sixteen children; lane x + 4 z. Empty (∞ … −∞) where there is no child.
#[repr(align(64))]
#[derive(Clone, Debug)]
pub(super) struct Node {
    pub(super) low: [f32; 16],
    pub(super) high: [f32; 16],
}

impl Node {
    const EMPTY: Node = Node { low: [f32::INFINITY; 16], high: [f32::NEG_INFINITY; 16] };

    /// Least and greatest height.
    pub(super) fn range(&self) -> (f32, f32) {
        let low = self.low.iter().fold(f32::INFINITY, |a, &b| a.min(b));
        (low, self.high.iter().fold(f32::NEG_INFINITY, |a, &b| a.max(b)))
    }
}

/// One level: `columns` × rows nodes.
#[derive(Clone, Debug)]
pub(super) struct Level {
    pub(super) columns: usize,
    pub(super) nodes: Vec<Node>,
}

impl Level {
    /// Nodes over `across × along` children whose intervals `child` gives.
    fn build(across: usize, along: usize, child: impl Fn(usize, usize) -> (f32, f32) + Sync) -> Level {
        let (columns, rows) = (across.div_ceil(4), along.div_ceil(4));
        let mut nodes = vec![Node::EMPTY; columns * rows];
        nodes.par_chunks_mut(columns).enumerate().for_each(|(row, line)| {
            for (column, node) in line.iter_mut().enumerate() {
                for lane in 0..16 {
                    let (x, z) = (4 * column + (lane & 3), 4 * row + (lane >> 2));
                    if x < across && z < along {
                        (node.low[lane], node.high[lane]) = child(x, z);
                    }
                }
            }
        });
        Level { columns, nodes }
    }
}

/// All levels, the finest first; the last has one node. `close` holds the heights at the closing of the shutter, if
/// they differ: intervals then hold for the whole shutter.
pub(super) fn build(field: &HeightField, close: Option<&HeightField>) -> Vec<Level> {
    let (cells_x, cells_z) = field.cells();
    let (blocks_x, blocks_z) = (cells_x.div_ceil(4), cells_z.div_ceil(4));
    let (mut low, mut high) = (vec![0.0; blocks_x * blocks_z], vec![0.0; blocks_x * blocks_z]);
    let lines = low.par_chunks_mut(blocks_x).zip(high.par_chunks_mut(blocks_x)).with_min_len(4);
    lines.enumerate().for_each_with((Vec::new(), Vec::new()), |(least, most), (z, (low, high))| {
        least.clear();
        most.clear();
        least.resize(field.columns, f32::INFINITY);
        most.resize(field.columns, f32::NEG_INFINITY);
        for heights in [Some(field), close].into_iter().flatten().map(|field| &field.heights) {
            for row in 4 * z..(4 * z + 5).min(field.rows) {
                let row = &heights[row * field.columns..][..field.columns];
                // Comparisons, not `f32::min`, which has more to say of NaN: there is none here.
                for ((least, most), &h) in least.iter_mut().zip(most.iter_mut()).zip(row) {
                    *least = if h < *least { h } else { *least };
                    *most = if h > *most { h } else { *most };
                }
            }
        }
        for (x, (low, high)) in low.iter_mut().zip(high).enumerate() {
            let columns = 4 * x..(4 * x + 5).min(field.columns);
            let least = least[columns.clone()].iter().fold(f32::INFINITY, |a, &b| if b < a { b } else { a });
            let most = most[columns].iter().fold(f32::NEG_INFINITY, |a, &b| if b > a { b } else { a });
            // A height interpolated between posts may leave their interval by a few roundings.
            let slack = 8.0 * f32::EPSILON * least.abs().max(most.abs()) + f32::MIN_POSITIVE;
            (*low, *high) = (least - slack, most + slack);
        }
    });
    let finest = Level::build(blocks_x, blocks_z, |x, z| (low[z * blocks_x + x], high[z * blocks_x + x]));
    let mut levels = vec![finest];
    loop {
        let below = &levels[levels.len() - 1];
        if below.nodes.len() == 1 {
            return levels;
        }
        let across = below.columns;
        let along = below.nodes.len() / across;
        let next = Level::build(across, along, |x, z| below.nodes[z * across + x].range());
        levels.push(next);
    }
}
