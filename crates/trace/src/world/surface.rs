//! From the surface in the space of a geometry to the surface in the world.
//!
//! With the transform p' = M p + T, normals go by M⁻ᵀ. A distance e along the normal n becomes e / |M⁻ᵀ n|. To it come
//! the roundings of M p + T, and those of the way back that a ray from the point will take,
//! M⁻¹ p' + T⁻¹: each sum of four rounds each coordinate at most four times.
//! After: Pharr, Jakob, Humphreys, Physically Based Rendering, 4th edition, §6.8.5.

use glam::{Affine3A, Vec3, Vec3A};

use super::World;
use super::place::{Kind, inverse_of};
use crate::simd::ROUNDOFF;
use crate::{Geometry, Hit, LocalHit, LocalSurface, Ray, RayGeometry, Surface};

/// Roundings of one coordinate of a transformed point.
const TRANSFORM_ROUNDINGS: f32 = 4.0;

#[inline]
pub(super) fn surface(world: &World, ray: &Ray, hit: &Hit) -> Surface {
    let number = hit.instance as usize;
    let place = &world.places[number];
    let local_hit = LocalHit { t: hit.t, primitive: hit.primitive, u: hit.u, v: hit.v };
    let local = match world.instances[number].geometry.as_ref() {
        // These look at nothing of the ray but its time, which is the same in every space.
        Geometry::Mesh(mesh) => mesh.surface(ray, &local_hit),
        Geometry::HeightField(field) => field.surface(ray, &local_hit),
        Geometry::Rectangle(rectangle) => rectangle.surface(ray, &local_hit),
        other => other.as_rays().surface(&place.local_ray(ray).unwrap_or(*ray), &local_hit),
    };
    let placed = match &place.kind {
        Kind::Here => local,
        Kind::Fixed(inverse) => transformed(&local, &world.instances[number].transform.open, inverse),
        Kind::Moving(motion) => {
            let transform = motion.at(ray.time);
            transformed(&local, &transform, &inverse_of(&transform).unwrap_or(Affine3A::IDENTITY))
        }
    };
    Surface {
        position: placed.position,
        position_error: placed.position_error,
        geometric_normal: placed.geometric_normal,
        shading_normal: placed.shading_normal,
        uv: placed.uv,
        tangent: unit_tangent(placed.tangent, placed.shading_normal),
        handedness: placed.handedness,
        color: placed.color,
        instance: hit.instance,
        primitive: hit.primitive,
        material_slot: placed.material_slot,
    }
}

/// |M| |p| + |T|.
#[inline]
fn absolute(transform: &Affine3A, point: Vec3A) -> Vec3A {
    let (matrix, point) = (transform.matrix3, point.abs());
    matrix.x_axis.abs() * point.x
        + matrix.y_axis.abs() * point.y
        + matrix.z_axis.abs() * point.z
        + transform.translation.abs()
}

/// M⁻ᵀ n, given M⁻¹.
#[inline]
fn normal_through(inverse: &Affine3A, normal: Vec3) -> Vec3A {
    inverse.matrix3.transpose() * Vec3A::from(normal)
}

fn transformed(local: &LocalSurface, transform: &Affine3A, inverse: &Affine3A) -> LocalSurface {
    let local_position = Vec3A::from(local.position);
    let position = transform.transform_point3a(local_position);
    let scaled_normal = normal_through(inverse, local.geometric_normal);
    let shrink = scaled_normal.length();
    let geometric_normal = scaled_normal / shrink;
    let mut shading_normal = if local.shading_normal == local.geometric_normal {
        geometric_normal
    } else {
        normal_through(inverse, local.shading_normal).normalize_or(geometric_normal)
    };
    if shading_normal.dot(geometric_normal) < 0.0 {
        shading_normal = geometric_normal;
    }

    // Distances along the normal, here and there.
    let there = Vec3A::from(local.geometric_normal).abs();
    let here = geometric_normal.abs();
    let from_surface = local.position_error * there.element_sum();
    let way_back = absolute(inverse, position);
    let way_out = absolute(transform, local_position);
    let roundings = TRANSFORM_ROUNDINGS * ROUNDOFF;
    let along_normal =
        (from_surface + roundings * way_back.dot(there)) / shrink + roundings * way_out.dot(here);

    // A transform that mirrors turns the hand of the texture's frame.
    let mirrored = transform.matrix3.determinant() < 0.0;
    LocalSurface {
        position: position.into(),
        position_error: along_normal / here.element_sum(),
        geometric_normal: geometric_normal.into(),
        shading_normal: shading_normal.into(),
        tangent: transform.transform_vector3(local.tangent),
        handedness: if mirrored { -local.handedness } else { local.handedness },
        ..*local
    }
}

/// The part of a tangent that is perpendicular to the normal, of unit length; any such direction if there is none.
fn unit_tangent(tangent: Vec3, normal: Vec3) -> Vec3 {
    let flat_part = |tangent: Vec3| tangent - normal * normal.dot(tangent);
    let flat = flat_part(tangent);
    let (length, flat_length) = (tangent.length_squared(), flat.length_squared());
    // Shorter than this part of it, what is left is mostly rounding.
    const LEAST: f32 = 1e-8;
    if flat_length > LEAST * length && flat_length > f32::MIN_POSITIVE && length < f32::INFINITY {
        return flat / flat_length.sqrt();
    }
    // Perhaps it was only too long or too short to be squared.
    let flat = flat_part(tangent.normalize_or_zero());
    if flat.length_squared() > LEAST { flat.normalize() } else { normal.any_orthonormal_vector() }
}
