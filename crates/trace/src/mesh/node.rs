//! The tree: nodes of eight children, whose boxes are laid out for eight-wide tests.

use glam::Vec3;

/// Set in a child word that names a leaf.
pub(crate) const LEAF: u32 = 1 << 31;
/// A child word that names nothing; its box is never hit.
pub(crate) const EMPTY: u32 = u32::MAX;
/// Corner of the box of an absent child: lower corner +`NOWHERE`, upper −`NOWHERE`. Finite, so that interpolating
/// two of them gives no NaN.
pub(crate) const NOWHERE: f32 = 1e30;

/// Rows of eight coordinates, in the order x low, x high, y low, y high, z low, z high.
pub(crate) type Rows = [[f32; 8]; 6];

/// The boxes of children that are all absent.
pub(crate) const NO_BOXES: Rows =
    [[NOWHERE; 8], [-NOWHERE; 8], [NOWHERE; 8], [-NOWHERE; 8], [NOWHERE; 8], [-NOWHERE; 8]];

/// Eight children: 256 bytes, four cache lines.
#[repr(C, align(64))]
#[derive(Clone, Debug)]
pub(crate) struct Node {
    /// Boxes (as the shutter opens, if the tree moves).
    pub(crate) rows: Rows,
    /// A node's index, or `LEAF` | a leaf's index, or `EMPTY`.
    pub(crate) children: [u32; 8],
}

impl Node {
    pub(crate) const NONE: Node = Node { rows: NO_BOXES, children: [EMPTY; 8] };
}

/// Puts a box into one column.
pub(crate) fn set_box(rows: &mut Rows, slot: usize, low: Vec3, high: Vec3) {
    for axis in 0..3 {
        rows[2 * axis][slot] = low[axis];
        rows[2 * axis + 1][slot] = high[axis];
    }
}

/// The box around all columns.
pub(crate) fn around(rows: &Rows) -> (Vec3, Vec3) {
    let low = |row: usize| rows[row].iter().copied().fold(NOWHERE, f32::min);
    let high = |row: usize| rows[row].iter().copied().fold(-NOWHERE, f32::max);
    (Vec3::new(low(0), low(2), low(4)), Vec3::new(high(1), high(3), high(5)))
}

/// A tree over leaves that are numbered from 0.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tree {
    /// The root first; every node before its children.
    pub(crate) nodes: Vec<Node>,
    /// The boxes as the shutter closes, one for each node; empty if nothing moves.
    pub(crate) close: Vec<Rows>,
}

impl Tree {
    /// The boxes around everything, at both ends of the shutter interval.
    pub(crate) fn bounds(&self) -> [(Vec3, Vec3); 2] {
        let open = self
            .nodes
            .first()
            .map_or((Vec3::splat(NOWHERE), Vec3::splat(-NOWHERE)), |root| around(&root.rows));
        let close = self.close.first().map_or(open, around);
        [open, close]
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice()) + size_of_val(self.close.as_slice())
    }
}
