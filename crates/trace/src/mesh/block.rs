//! A leaf: up to eight triangles, stored so that eight are tested at once.

use glam::Vec3;

/// Coordinates of eight triangles: `[vertex][axis][triangle]`. Places without a triangle hold NaN, which no
/// comparison lets through.
pub(crate) type Corners = [[[f32; 8]; 3]; 3];

/// Up to eight triangles: 320 bytes, five cache lines.
#[repr(C, align(64))]
#[derive(Clone, Debug)]
pub(crate) struct Block {
    /// Corners (as the shutter opens, if the mesh moves).
    pub(crate) corners: Corners,
    /// Indices of the triangles in the mesh; `u32::MAX` where there is none.
    pub(crate) triangles: [u32; 8],
}

/// Corners of no triangles.
pub(crate) const NO_CORNERS: Corners = [[[f32::NAN; 8]; 3]; 3];

/// Whether a corner can take part: finite, and not so far away that products of its coordinates overflow at once.
#[inline]
pub(crate) fn usable(point: Vec3) -> bool {
    // NaN is not less than anything.
    point.x.abs() < FARTHEST && point.y.abs() < FARTHEST && point.z.abs() < FARTHEST
}

/// Beyond this a corner is as good as infinite: its square is the largest that a float holds.
const FARTHEST: f32 = 1e18;

/// Gathers the corners of a block's triangles, and the box around them. A triangle with a corner that is not [`usable`]
/// is left out.
pub(crate) fn gather(
    ids: &[u32; 8],
    triangles: &[[u32; 3]],
    positions: &[Vec3],
    corners: &mut Corners,
) -> (Vec3, Vec3) {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    *corners = NO_CORNERS;
    for (place, &id) in ids.iter().enumerate() {
        if id == u32::MAX {
            continue;
        }
        let points = triangles[id as usize].map(|vertex| positions[vertex as usize]);
        if !points.iter().all(|&p| usable(p)) {
            continue;
        }
        for (vertex, point) in points.iter().enumerate() {
            low = low.min(*point);
            high = high.max(*point);
            for axis in 0..3 {
                corners[vertex][axis][place] = point[axis];
            }
        }
    }
    (low, high)
}
