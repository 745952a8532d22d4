//! Flat unit shapes: the square and the disk in the plane z = 0, facing +z. An instance's transform gives them their
//! place and size.
//!
//! The plane is met at t = −o_z / d_z, computed in f64: the point has the error of the ray's own numbers. u grows
//! along +x and v along −y, from 0 to 1 over the square (the disk has the texture of the square around it): seen from
//! the front with +y up, a picture stands upright.
//!
//! ```
//! use glam::Vec3;
//! use halflight_trace::{Disk, Ray, RayGeometry, Rectangle};
//! let ray = Ray::new(Vec3::new(0.9, 0.9, 3.0), Vec3::NEG_Z);
//! assert!(Rectangle.occluded(&ray) && !Disk.occluded(&ray));
//! ```

use glam::{Affine3A, Mat3A, Vec2, Vec3, Vec3A};

use crate::{LocalHit, LocalSurface, Ray, RayGeometry};

/// The square [−1, 1]² in the plane z = 0, facing +z.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rectangle;

impl Rectangle {
    /// The transform that makes the unit square the rectangle with this centre and these halves of its edges; it
    /// faces `half_u × half_v`.
    ///
    /// ```
    /// use glam::Vec3;
    /// use halflight_trace::Rectangle;
    /// let lamp = Rectangle::transform(Vec3::Y, Vec3::X, Vec3::Z);
    /// assert_eq!(lamp.transform_point3(Vec3::new(1.0, 1.0, 0.0)), Vec3::new(1.0, 1.0, 1.0));
    /// assert_eq!(lamp.transform_vector3(Vec3::Z), Vec3::NEG_Y);
    /// ```
    #[must_use]
    pub fn transform(center: Vec3, half_u: Vec3, half_v: Vec3) -> Affine3A {
        let normal = half_u.cross(half_v).normalize_or(Vec3::Z);
        Affine3A {
            matrix3: Mat3A::from_cols(half_u.into(), half_v.into(), normal.into()),
            translation: Vec3A::from(center),
        }
    }
}

/// The disk of radius 1 in the plane z = 0, facing +z.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Disk;

impl Disk {
    /// The transform that makes the unit disk the disk with this centre, normal and radius.
    #[must_use]
    pub fn transform(center: Vec3, normal: Vec3, radius: f32) -> Affine3A {
        let (u, v) = normal.normalize_or(Vec3::Z).any_orthonormal_pair();
        Rectangle::transform(center, radius * u, radius * v)
    }
}

/// Where a ray meets z = 0, if within its ends: t, x, y.
#[inline]
fn meet(ray: &Ray) -> Option<(f32, f64, f64)> {
    let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let t = -origin.z / direction.z;
    let rounded = t as f32;
    // False for NaN too: a ray within the plane, or one that is no ray.
    let within = rounded > 0.0 && rounded <= ray.t_max && t < f64::INFINITY;
    within.then_some((rounded, origin.x + t * direction.x, origin.y + t * direction.y))
}

#[inline]
fn hit((t, x, y): (f32, f64, f64)) -> LocalHit {
    LocalHit { t, primitive: 0, u: (0.5 + 0.5 * x) as f32, v: (0.5 - 0.5 * y) as f32 }
}

fn surface(hit: &LocalHit) -> LocalSurface {
    LocalSurface {
        position: Vec3::new(2.0 * hit.u - 1.0, 1.0 - 2.0 * hit.v, 0.0),
        // u and v are within a rounding of 1.
        position_error: 2.0 * f32::EPSILON,
        geometric_normal: Vec3::Z,
        shading_normal: Vec3::Z,
        uv: Vec2::new(hit.u, hit.v),
        tangent: Vec3::X,
        handedness: 1.0,
        color: Vec3::ONE,
        material_slot: 0,
    }
}

const BOUNDS: (Vec3, Vec3) = (Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, 1.0, 0.0));

impl RayGeometry for Rectangle {
    fn bounds(&self) -> (Vec3, Vec3) {
        BOUNDS
    }
    #[inline]
    fn closest(&self, ray: &Ray) -> Option<LocalHit> {
        meet(ray).filter(|(_, x, y)| x.abs() <= 1.0 && y.abs() <= 1.0).map(hit)
    }
    #[inline]
    fn occluded(&self, ray: &Ray) -> bool {
        self.closest(ray).is_some()
    }
    fn surface(&self, _ray: &Ray, hit: &LocalHit) -> LocalSurface {
        surface(hit)
    }
    fn primitives(&self) -> usize {
        1
    }
    fn memory_bytes(&self) -> usize {
        0
    }
}

impl RayGeometry for Disk {
    fn bounds(&self) -> (Vec3, Vec3) {
        BOUNDS
    }
    #[inline]
    fn closest(&self, ray: &Ray) -> Option<LocalHit> {
        meet(ray).filter(|(_, x, y)| x * x + y * y <= 1.0).map(hit)
    }
    #[inline]
    fn occluded(&self, ray: &Ray) -> bool {
        self.closest(ray).is_some()
    }
    fn surface(&self, _ray: &Ray, hit: &LocalHit) -> LocalSurface {
        surface(hit)
    }
    fn primitives(&self) -> usize {
        1
    }
    fn memory_bytes(&self) -> usize {
        0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_sides_are_hit_and_the_point_is_on_the_plane() {
        for z in [2.0f32, -2.0] {
            let ray = Ray::new(Vec3::new(0.25, -0.5, z), Vec3::new(0.0, 0.1, -z.signum()));
            let hit = Rectangle.closest(&ray).unwrap();
            let surface = Rectangle.surface(&ray, &hit);
            assert_eq!(hit.t, 2.0);
            assert!(surface.position.abs_diff_eq(Vec3::new(0.25, -0.3, 0.0), 1e-6));
            assert!(surface.uv.abs_diff_eq(Vec2::new(0.625, 0.65), 1e-6));
            assert!(Disk.occluded(&ray));
        }
    }

    #[test]
    fn rays_in_the_plane_behind_or_too_short_miss() {
        assert!(!Rectangle.occluded(&Ray::new(Vec3::NEG_X * 3.0, Vec3::X)));
        assert!(!Rectangle.occluded(&Ray::new(Vec3::Z, Vec3::Z)));
        assert!(!Rectangle.occluded(&Ray { t_max: 0.9, ..Ray::new(Vec3::Z, Vec3::NEG_Z) }));
        assert!(Rectangle.occluded(&Ray { t_max: 1.0, ..Ray::new(Vec3::Z, Vec3::NEG_Z) }));
        assert!(!Rectangle.occluded(&Ray::new(Vec3::new(0.0, 0.0, f32::NAN), Vec3::NEG_Z)));
        assert!(!Rectangle.occluded(&Ray::new(Vec3::new(0.3, 0.3, 0.0), Vec3::new(1.0, 0.0, 1.0))), "t = 0");
    }

    #[test]
    fn transforms_put_the_unit_shapes_in_their_place() {
        let disk = Disk::transform(Vec3::new(1.0, 2.0, 3.0), Vec3::new(0.0, -2.0, 0.0), 0.5);
        let rim = disk.transform_point3(Vec3::new(0.6, 0.8, 0.0)) - Vec3::new(1.0, 2.0, 3.0);
        assert!((rim.length() - 0.5).abs() < 1e-6 && rim.y.abs() < 1e-6);
        assert!(disk.transform_vector3(Vec3::Z).abs_diff_eq(Vec3::NEG_Y, 1e-6));
    }
}
