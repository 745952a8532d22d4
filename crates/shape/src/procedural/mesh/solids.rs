//! Boxes and flat ground.

use glam::{Vec2, Vec3};

use super::grid;
use crate::TriangleMesh;

/// A rectangle in the plane y = 0 about the origin, facing up, of `size` metres along x and z.
pub fn plane(size: Vec2, columns: usize, rows: usize) -> TriangleMesh {
    let mut mesh = grid(columns.max(1), rows.max(1), |u, v| {
        (Vec3::new((u - 0.5) * size.x, 0.0, (v - 0.5) * size.y), Vec3::Y)
    });
    // u grows with x and v with z, as the rows of an image laid on the ground.
    for uv in &mut mesh.uvs {
        *uv = Vec2::ONE - *uv;
    }
    mesh
}

/// A box of the given size with sharp edges, on y = 0 and about the y axis; each face has the whole texture: upright on the
/// walls, and on top with its upper edge at the back (−z).
pub fn cuboid(size: Vec3) -> TriangleMesh {
    rounded_box(size, 0.0, 0)
}

/// A box of the given outer size whose edges are rounded with a radius (at most half of the least side), `segments`
/// quads across a quarter of the rounding, on y = 0 and about the y axis.
pub fn rounded_box(size: Vec3, rounding: f32, segments: usize) -> TriangleMesh {
    let half = 0.5 * size;
    let rounding = rounding.clamp(0.0, half.min_element());
    let segments = if rounding > 0.0 { segments.max(1) } else { 0 };
    // Places along a side of half-length h: equal angles over the rounding, and the flat part in one piece.
    let places = |h: f32| -> Vec<f32> {
        if segments == 0 {
            return vec![-h, h];
        }
        let reach =
            |i: usize| rounding * (std::f32::consts::FRAC_PI_4 * i as f32 / segments as f32).tan().min(1.0);
        let low = (0..=segments).rev().map(|i| -(h - rounding) - reach(i));
        let high = (0..=segments).map(|i| h - rounding + reach(i));
        low.chain(high).collect()
    };
    let mut mesh = TriangleMesh::default();
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
            let (across, along) = (places(half[a]), places(half[b]));
            let first = mesh.positions.len() as u32;
            for &y in &along {
                for &x in &across {
                    let mut point = Vec3::ZERO;
                    (point[axis], point[a], point[b]) = (sign * half[axis], x, y);
                    let inner = half - Vec3::splat(rounding);
                    let core = point.clamp(-inner, inner);
                    let mut flat = Vec3::ZERO;
                    flat[axis] = sign;
                    let normal = (point - core).normalize_or(flat);
                    mesh.positions.push(core + rounding * normal + Vec3::new(0.0, half.y, 0.0));
                    mesh.normals.push(normal);
                    // Where the picture's right and up go on this face.
                    let share = point / half;
                    let (right, up) = match axis {
                        0 => (-sign * share.z, share.y),
                        1 => (share.x, -sign * share.z),
                        _ => (sign * share.x, share.y),
                    };
                    mesh.uvs.push(0.5 + 0.5 * Vec2::new(right, -up));
                }
            }
            let stride = across.len() as u32;
            for row in 0..along.len() as u32 - 1 {
                for column in 0..stride - 1 {
                    let p = first + row * stride + column;
                    let (q, r, s) = (p + 1, p + stride + 1, p + stride);
                    // axis, a, b are a right-handed triple: a × b points along +axis.
                    let quads = if sign > 0.0 { [[p, q, r], [p, r, s]] } else { [[p, r, q], [p, s, r]] };
                    for triangle in quads {
                        super::push_solid(&mut mesh, triangle);
                    }
                }
            }
        }
    }
    mesh
}
