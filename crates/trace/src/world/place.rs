//! Where an instance stands, made ready for rays.

use glam::{Affine3A, Vec3};

use crate::simd::ROUNDOFF;
use crate::{Instance, Motion, Ray};

/// Lower and upper corner.
type Corners = (Vec3, Vec3);

/// An instance's transform, and its box in the world.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) kind: Kind,
    /// As the shutter opens and as it closes; none if the instance cannot be met.
    pub(super) bounds: Option<[Corners; 2]>,
}

/// How a ray gets into the space of the geometry.
#[derive(Clone, Copy, Debug)]
pub(super) enum Kind {
    /// It is there already.
    Here,
    /// By this transform from the world.
    Fixed(Affine3A),
    /// By the inverse of the transform at the ray's time.
    Moving(Motion),
}

impl Place {
    pub(super) fn new(instance: &Instance) -> Place {
        let motion = instance.transform;
        let kind = if motion.is_moving() {
            Kind::Moving(motion)
        } else if motion.open == Affine3A::IDENTITY {
            Kind::Here
        } else {
            Kind::Fixed(motion.open.inverse())
        };
        let local = instance.geometry.as_rays().bounds();
        let there = match kind {
            Kind::Here => Some([local, local]),
            _ => {
                bounds_of(&motion.open, local).and_then(|open| Some([open, bounds_of(&motion.close, local)?]))
            }
        };
        let is_empty = instance.geometry.as_rays().primitives() == 0;
        let bounds = there.filter(|[open, close]| {
            let sound = |corners: &Corners| {
                corners.0.is_finite() && corners.1.is_finite() && corners.0.cmple(corners.1).all()
            };
            !is_empty && sound(open) && sound(close)
        });
        Place { kind, bounds }
    }

    /// The ray in the space of the geometry; t is unchanged, the direction's length is not. None where the transform
    /// has no inverse at the ray's time.
    #[inline(always)]
    pub(super) fn local_ray(&self, ray: &Ray) -> Option<Ray> {
        match &self.kind {
            Kind::Here => Some(*ray),
            Kind::Fixed(inverse) => Some(through(inverse, ray)),
            Kind::Moving(motion) => moving_ray(motion, ray),
        }
    }
}

/// A ray seen through a transform.
#[inline(always)]
fn through(transform: &Affine3A, ray: &Ray) -> Ray {
    Ray {
        origin: transform.transform_point3(ray.origin),
        direction: transform.transform_vector3(ray.direction),
        ..*ray
    }
}

#[inline(never)]
fn moving_ray(motion: &Motion, ray: &Ray) -> Option<Ray> {
    let inverse = inverse_of(&motion.at(ray.time))?;
    Some(through(&inverse, ray))
}

/// The inverse of a transform that has one.
pub(super) fn inverse_of(transform: &Affine3A) -> Option<Affine3A> {
    let determinant = transform.matrix3.determinant();
    if determinant == 0.0 || !determinant.is_finite() {
        return None;
    }
    Some(transform.inverse()).filter(Affine3A::is_finite)
}

/// The box in the world of a box in an instance, widened by what rays lose on their way between the two; none if the
/// transform has no inverse.
fn bounds_of(transform: &Affine3A, (low, high): Corners) -> Option<Corners> {
    inverse_of(transform)?;
    let (centre, half) = ((low + high) * 0.5, (high - low) * 0.5);
    let matrix = transform.matrix3;
    let reach = |v: Vec3| -> Vec3 {
        let v = v.abs();
        Vec3::from(matrix.x_axis.abs()) * v.x
            + Vec3::from(matrix.y_axis.abs()) * v.y
            + Vec3::from(matrix.z_axis.abs()) * v.z
    };
    let middle = transform.transform_point3(centre);
    let translation = Vec3::from(transform.translation.abs());
    let margin = (reach(low.abs().max(high.abs())) + translation) * (16.0 * ROUNDOFF);
    let extent = reach(half) + margin;
    Some((middle - extent, middle + extent))
}
