//! What shading needs to know of a point on a triangle.
//!
//! The point is Σ bᵢ pᵢ, summed in doubles from the weights that the hit carries, so that it lies in the triangle's plane
//! up to the rounding to floats. To leave it safely a ray has to start off that plane by more than
//! Σₐ |nₐ| (|pₐ| + c · maxᵢⱼ |vᵢⱼ − pⱼ|) / 2²⁴ over the axes a: the first part is the rounding of the point, the second
//! what the triangle test may misplace the corners v by, seen from the point. The shear (see `triangle`) mixes the axes,
//! so that a corner far away along one of them is misplaced along the others too.
//! After: Pharr, Jakob, Humphreys, Physically Based Rendering, 4th edition, §6.8.

use glam::{DVec3, Vec2, Vec3};

use halflight_shape::TriangleMesh;

use crate::simd::ROUNDOFF;
use crate::{LocalHit, LocalSurface};

/// c above: difference, shear and sums make at most 6 roundings of a corner's distance; 2 to spare.
const CORNER_ROUNDINGS: f32 = 8.0;
/// Roundings of the point itself: one to floats, one when the ray's origin is moved off, and one to spare.
const POINT_ROUNDINGS: f32 = 3.0;
/// Roundings of a corner that moves: two products and a sum.
const MOTION_ROUNDINGS: f32 = 3.0;

/// Corners of a triangle at a time; `close` are all positions as the shutter closes.
pub(crate) fn corners_at(
    mesh: &TriangleMesh,
    close: Option<&[Vec3]>,
    triangle: [u32; 3],
    time: f32,
) -> [Vec3; 3] {
    let time = time.clamp(0.0, 1.0);
    triangle.map(|vertex| {
        let open = mesh.positions[vertex as usize];
        close.map_or(open, |close| open * (1.0 - time) + close[vertex as usize] * time)
    })
}

/// Interpolates an attribute, if the mesh has it at all three corners.
fn blend<T: Copy>(values: &[T], triangle: [u32; 3], mix: impl Fn([T; 3]) -> T) -> Option<T> {
    let at = |corner: usize| values.get(triangle[corner] as usize).copied();
    Some(mix([at(0)?, at(1)?, at(2)?]))
}

/// The surface at a hit; `close` and `time` for meshes that move.
pub(crate) fn surface(
    mesh: &TriangleMesh,
    close: Option<&[Vec3]>,
    time: f32,
    hit: &LocalHit,
) -> LocalSurface {
    let triangle = mesh.triangles[hit.primitive as usize];
    let corners = corners_at(mesh, close, triangle, time);
    let u = hit.u.clamp(0.0, 1.0);
    let v = hit.v.clamp(0.0, 1.0 - u);
    let weights = [1.0 - u - v, u, v];

    // The point and the plane in doubles.
    let [a, b, c] = corners.map(|corner: Vec3| corner.as_dvec3());
    let (along_u, along_v) = (b - a, c - a);
    let position = (a + along_u * f64::from(u) + along_v * f64::from(v)).as_vec3();
    let normal = along_u.cross(along_v);
    let geometric_normal = normal.try_normalize().unwrap_or(DVec3::Y).as_vec3();

    // What a ray that leaves must stay clear of, weighted by the normal.
    let mut spread = Vec3::ZERO;
    let mut size = Vec3::ZERO;
    for corner in corners {
        spread = spread.max((corner - position).abs());
        size = size.max(corner.abs());
    }
    let mut errors =
        (Vec3::splat(spread.max_element()) * CORNER_ROUNDINGS + position.abs() * POINT_ROUNDINGS) * ROUNDOFF;
    if close.is_some() {
        errors += size * (MOTION_ROUNDINGS * ROUNDOFF);
    }
    let weight = geometric_normal.abs();
    let position_error = errors.dot(weight) / weight.element_sum();

    // Attributes. Interpolated normals may cancel or be zero: then the surface is flat.
    let mix = |values: [Vec3; 3]| values[0] * weights[0] + values[1] * weights[1] + values[2] * weights[2];
    let mut shading_normal = blend(&mesh.normals, triangle, mix)
        .and_then(Vec3::try_normalize)
        .filter(|normal| normal.is_finite())
        .unwrap_or(geometric_normal);
    if shading_normal.dot(geometric_normal) < 0.0 {
        shading_normal = -shading_normal;
    }
    let uvs = [0, 1, 2].map(|corner| mesh.uvs.get(triangle[corner] as usize).copied());
    let (uv, uv_corners) = match uvs {
        [Some(p), Some(q), Some(r)] => (p * weights[0] + q * weights[1] + r * weights[2], [p, q, r]),
        // Without texture coordinates the triangle's own parameters do.
        _ => (Vec2::new(u, v), [Vec2::ZERO, Vec2::X, Vec2::Y]),
    };
    let tangents = [0, 1, 2].map(|corner| mesh.tangents.get(triangle[corner] as usize).copied());
    let (tangent, handedness) = match tangents {
        [Some(p), Some(q), Some(r)] => (
            mix([p.truncate(), q.truncate(), r.truncate()]),
            if p.w * weights[0] + q.w * weights[1] + r.w * weights[2] < 0.0 { -1.0 } else { 1.0 },
        ),
        _ => tangent_of(along_u.as_vec3(), along_v.as_vec3(), uv_corners, geometric_normal),
    };
    LocalSurface {
        position,
        position_error,
        geometric_normal,
        shading_normal,
        uv,
        tangent,
        handedness,
        color: blend(&mesh.colors, triangle, mix).unwrap_or(Vec3::ONE),
        material_slot: mesh.material_slots.get(hit.primitive as usize).copied().unwrap_or(0),
    }
}

/// The direction in which u grows, ∂p/∂u, and the hand of the texture: −1 where the picture is mirrored on the surface,
/// that is where ∂p/∂u and −∂p/∂v (v grows downwards) are no right-handed frame with the normal.
///
/// With edges e₁, e₂ and texture differences (u₁, v₁), (u₂, v₂): ∂p/∂u = (v₂ e₁ − v₁ e₂) / (u₁ v₂ − u₂ v₁).
fn tangent_of(e1: Vec3, e2: Vec3, uvs: [Vec2; 3], normal: Vec3) -> (Vec3, f32) {
    let (d1, d2) = (uvs[1] - uvs[0], uvs[2] - uvs[0]);
    let determinant = d1.x * d2.y - d2.x * d1.y;
    if determinant == 0.0 || !determinant.is_finite() {
        return (Vec3::ZERO, 1.0);
    }
    let sign = determinant.signum();
    let tangent = (e1 * d2.y - e2 * d1.y) * sign;
    let up = (e1 * d2.x - e2 * d1.x) * sign;
    (tangent, if normal.cross(tangent).dot(up) < 0.0 { -1.0 } else { 1.0 })
}
