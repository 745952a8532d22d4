//! New boxes for a tree whose leaves have changed.
//!
//! Nodes stand before their children, so one pass from the last to the first finds every child's box ready. Leaves are
//! measured by all threads; the pass over nodes (one for about 36 triangles) is short.

use glam::Vec3;
use rayon::prelude::*;

use halflight_shape::TriangleMesh;

use super::block::{Block, Corners, gather};
use super::node::{EMPTY, LEAF, NO_BOXES, Node, Rows, around, set_box};

/// Leaves that one thread fills at a time.
const CHUNK: usize = 512;

/// Refills the corners of all leaves; gives the box of each.
pub(crate) fn fill_open(blocks: &mut [Block], mesh: &TriangleMesh) -> Vec<(Vec3, Vec3)> {
    blocks
        .par_iter_mut()
        .with_min_len(CHUNK)
        .map(|block| gather(&block.triangles, &mesh.triangles, &mesh.positions, &mut block.corners))
        .collect()
}

/// Corners of all leaves for other positions of the same mesh, and the box of each.
pub(crate) fn fill_close(
    blocks: &[Block],
    mesh: &TriangleMesh,
    positions: &[Vec3],
    corners: &mut Vec<Corners>,
) -> Vec<(Vec3, Vec3)> {
    corners.resize(blocks.len(), super::block::NO_CORNERS);
    corners
        .par_iter_mut()
        .zip(blocks)
        .with_min_len(CHUNK)
        .map(|(corners, block)| gather(&block.triangles, &mesh.triangles, positions, corners))
        .collect()
}

/// Boxes of every node from the boxes of the leaves. A leaf that holds nothing any more gets a box that is never hit.
pub(crate) fn node_rows(nodes: &[Node], leaves: &[(Vec3, Vec3)]) -> Vec<Rows> {
    let mut all = vec![NO_BOXES; nodes.len()];
    for (index, node) in nodes.iter().enumerate().rev() {
        let mut rows = NO_BOXES;
        for (slot, &child) in node.children.iter().enumerate() {
            if child == EMPTY {
                continue;
            }
            let (low, high) = if child & LEAF != 0 {
                leaves[(child & !LEAF) as usize]
            } else {
                around(&all[child as usize])
            };
            if low.x <= high.x {
                set_box(&mut rows, slot, low, high);
            }
        }
        all[index] = rows;
    }
    all
}
