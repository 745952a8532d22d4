//! Rays, what they hit, and rays that leave from there.

use glam::{Vec2, Vec3};

/// A ray, from its origin to `t_max`. Eight floats in this order, which packets of rays rely on.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Ray {
    /// Where it starts.
    pub origin: Vec3,
    /// Where it goes; unit length, so that t is in metres.
    pub direction: Vec3,
    /// Hits at t > `t_max` do not count. Infinite for a ray without end.
    pub t_max: f32,
    /// When within the frame's shutter interval, 0 at its opening and 1 at its closing.
    pub time: f32,
}

impl Ray {
    /// A ray without end, as the shutter opens.
    #[inline]
    #[must_use]
    pub fn new(origin: Vec3, direction: Vec3) -> Ray {
        Ray { origin, direction, t_max: f32::INFINITY, time: 0.0 }
    }

    /// The point at distance `t`.
    #[inline]
    #[must_use]
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + self.direction * t
    }

    /// Whether the ray can hit anything at all: finite, of some length, and with an end that is not behind it.
    #[inline(always)]
    pub(crate) fn is_usable(&self) -> bool {
        let (o, d) = (self.origin, self.direction);
        // Zero times anything is zero, but for infinity and NaN.
        let finite = ((o.x + o.y + o.z) + (d.x + d.y + d.z)) * 0.0 == 0.0;
        finite & (d.abs().max_element() > 0.0) & (self.t_max > 0.0)
    }
}

/// The nearest intersection of a ray, as much of it as traversal knows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance along the ray.
    pub t: f32,
    /// Index of the instance in the world.
    pub instance: u32,
    /// Index of the primitive in the instance's geometry.
    pub primitive: u32,
    /// First parameter on the primitive: for a triangle the barycentric weight of its second vertex.
    pub u: f32,
    /// Second parameter on the primitive: for a triangle the barycentric weight of its third vertex.
    pub v: f32,
}

/// What shading needs to know of a hit, in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// The point, recomputed on the primitive so that its error is small and known.
    pub position: Vec3,
    /// Bound of the error of `position`, in metres along any axis. It includes what a ray that starts there loses
    /// on its way into the space of the geometry.
    pub position_error: f32,
    /// Unit normal of the geometry, on the side that the winding calls front.
    pub geometric_normal: Vec3,
    /// Unit interpolated normal, in the hemisphere of `geometric_normal`.
    pub shading_normal: Vec3,
    /// Texture coordinates.
    pub uv: Vec2,
    /// Unit direction of growing u, perpendicular to `shading_normal`.
    pub tangent: Vec3,
    /// +1 or −1: the bitangent, where the picture's "up" goes (falling v), is
    /// `handedness · shading_normal × tangent`; −1 where a picture is mirrored on the surface.
    pub handedness: f32,
    /// Linear vertex colour, white where there is none.
    pub color: Vec3,
    /// Index of the instance in the world.
    pub instance: u32,
    /// Index of the primitive in the instance's geometry.
    pub primitive: u32,
    /// Material slot of the primitive.
    pub material_slot: u32,
}

/// The part of a shadow ray that is left out at its far end, relative to its length. It is the wall between a light
/// found by sampling and the light's own surface; pbrt's `ShadowEpsilon` is the same.
const SHADOW_MARGIN: f32 = 1e-4;

impl Surface {
    /// The surface's point, moved off the surface to the side that `direction` points to, by just more than the
    /// point's error.
    ///
    /// The error is a box of half-width `position_error`; its extent along the normal n is the error times
    /// |n.x| + |n.y| + |n.z|. After the move each coordinate is rounded away from the surface.
    /// Source: Pharr, Jakob, Humphreys, Physically Based Rendering, 4th edition, §6.8.6.
    #[inline]
    #[must_use]
    pub fn offset_point(&self, direction: Vec3) -> Vec3 {
        let normal = self.geometric_normal;
        let side = if direction.dot(normal) < 0.0 { -normal } else { normal };
        let offset = side * (self.position_error * side.abs().element_sum());
        let point = self.position + offset;
        Vec3::new(away(point.x, offset.x), away(point.y, offset.y), away(point.z, offset.z))
    }

    /// A ray without end that leaves the surface in a direction and does not meet it again where it left.
    #[inline]
    #[must_use]
    pub fn spawn(&self, direction: Vec3, time: f32) -> Ray {
        Ray { origin: self.offset_point(direction), direction, t_max: f32::INFINITY, time }
    }

    /// A ray from the surface towards a point, ending just short of it: by 1/10,000 of the way, or by what the
    /// point's coordinates cannot resolve if that is more.
    #[inline]
    #[must_use]
    pub fn spawn_to(&self, point: Vec3, time: f32) -> Ray {
        let origin = self.offset_point(point - self.position);
        // 16 roundings of the largest coordinate: the point's own error and the ray's on its way there.
        let unresolved = 16.0 * crate::simd::ROUNDOFF * point.abs().max_element();
        ray_between(origin, point, unresolved, time)
    }

    /// A ray from this surface to another one, leaving out the errors of both ends.
    #[inline]
    #[must_use]
    pub fn spawn_to_surface(&self, other: &Surface, time: f32) -> Ray {
        let origin = self.offset_point(other.position - self.position);
        let end = other.offset_point(self.position - other.position);
        ray_between(origin, end, 0.0, time)
    }
}

/// The next float in the direction of a step; the same one for a step of zero. Without branches, unlike `next_up`.
#[inline(always)]
fn away(coordinate: f32, step: f32) -> f32 {
    // The bits of floats of one sign count up with their magnitude; a sum with zero has no minus zero.
    let bits = (coordinate + 0.0).to_bits();
    let up = step > 0.0;
    let next = if up == (coordinate >= 0.0) { bits.wrapping_add(1) } else { bits.wrapping_sub(1) };
    let next = if coordinate == 0.0 { 1 | u32::from(!up) << 31 } else { next };
    if step == 0.0 { coordinate } else { f32::from_bits(next) }
}

/// The ray from `origin` to `end`, shortened by the shadow margin and by at least `unresolved`.
#[inline]
fn ray_between(origin: Vec3, end: Vec3, unresolved: f32, time: f32) -> Ray {
    let way = end - origin;
    let distance = way.length();
    let t_max = (distance - (distance * SHADOW_MARGIN).max(unresolved)).max(0.0);
    // Two points at one place: a ray of no length, which meets nothing.
    let direction = if distance > 0.0 { way / distance } else { Vec3::Y };
    Ray { origin, direction, t_max, time }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_next_float_away_is_that_of_the_library() {
        for coordinate in
            [0.0, -0.0, 1.0, -1.0, 0.1, -7e-30, 3e38, f32::MIN_POSITIVE, -f32::MIN_POSITIVE, 1e-45]
        {
            assert_eq!(away(coordinate, 1e-9), coordinate.next_up());
            assert_eq!(away(coordinate, -2.0), coordinate.next_down());
            assert_eq!(away(coordinate, 0.0), coordinate);
        }
    }
}
