//! Spheres on a grid of rays: each is asked which rays of the box around it meet it, sixteen at a time.
//!
//! With f from the eye to the centre and d from the eye to a point of the grid, T = f·d / d·d is where the ray comes
//! nearest to the centre, f − T d how it passes it, and half the chord √((r² − |f − T d|²) / d·d): the form of
//! [`crate::SphereTracer`], here in floats from the eye on. Cost: a few nanoseconds for sixteen rays.

use glam::{Affine3A, DVec3, Vec3};

use super::fill::Rows;
use super::project::Extent;
use super::{GridPoints, RayGrid};
use crate::spheres::is_usable;
use crate::{Geometry, Hit, Instance, Kernel, Sphere};

/// Rays that are done at once.
const LANES: usize = 16;
/// Spheres smaller than this part of their distance from the eye are left to rays: floats do not hold their shape.
const SMALLEST: f32 = 1e-4;
/// Squares of axes that differ by more than this part make no spheres of spheres.
const UNEVEN: f32 = 1e-5;

/// A sphere as the eye sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ball {
    /// From the eye to its middle.
    from_eye: Vec3,
    radius: f32,
}

impl Ball {
    pub(super) fn new(sphere: &Sphere, transform: &Affine3A, eye: Vec3) -> Self {
        let center = transform.transform_point3(sphere.center);
        Self { from_eye: center - eye, radius: sphere.radius * transform.matrix3.x_axis.length() }
    }
}

/// Whether an instance is spheres that are spheres in the world too, none of them too small to be seen from the eye in floats.
pub(super) fn are_balls(instance: &Instance, eye: Vec3) -> bool {
    let Geometry::Spheres(tracer) = instance.geometry.as_ref() else { return false };
    let transform = &instance.transform.open;
    let squares = transform.matrix3.transpose() * transform.matrix3;
    let size = squares.x_axis.x;
    let even = squares.abs_diff_eq(glam::Mat3A::from_diagonal(Vec3::splat(size)), UNEVEN * size);
    even && transform.matrix3.determinant() > 0.0
        && tracer.spheres().iter().all(|sphere| {
            let ball = Ball::new(sphere, transform, eye);
            !is_usable(sphere) || ball.radius > SMALLEST * ball.from_eye.length()
        })
}

/// One sphere, within the part of the grid that may see it.
#[inline(always)]
pub(super) fn fill(
    rows: &mut Rows,
    grid: &RayGrid,
    ball: &Ball,
    extent: &Extent,
    instance: u32,
    primitive: u32,
) {
    let (left, right) = (extent.low[0].ceil() as usize, extent.high[0] as usize);
    let upper = (extent.low[1].ceil() as usize).max(rows.top);
    let lower = (extent.high[1] as usize).min(rows.top + rows.count - 1);
    let (f, square) = (ball.from_eye, ball.radius * ball.radius);
    for y in upper..=lower {
        let start = grid.point(0, y);
        let row = &mut rows.nearest[(y - rows.top) * rows.columns..][..rows.columns];
        for first in (left..=right).step_by(LANES) {
            let mut nearness = [0.0; LANES];
            for lane in 0..LANES {
                let x = (first + lane) as f32;
                let d =
                    [start.x + grid.across.x * x, start.y + grid.across.y * x, start.z + grid.across.z * x];
                let inverse = 1.0 / (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
                let nearest = (f.x * d[0] + f.y * d[1] + f.z * d[2]) * inverse;
                let aside = [f.x - nearest * d[0], f.y - nearest * d[1], f.z - nearest * d[2]];
                let left = square - (aside[0] * aside[0] + aside[1] * aside[1] + aside[2] * aside[2]);
                let half_chord = ((if left > 0.0 { left } else { 0.0 }) * inverse).sqrt();
                let (near, far) = (nearest - half_chord, nearest + half_chord);
                let t = if near > 0.0 { near } else { far };
                nearness[lane] = if (left >= 0.0) & (t > 0.0) { 1.0 / t } else { 0.0 };
            }
            let last = (right + 1).min(first + LANES);
            for (nearness, hit) in nearness.iter().zip(&mut row[first..last]) {
                if *nearness > hit.t {
                    *hit = Hit { t: *nearness, instance, primitive, u: 0.0, v: 0.0 };
                }
            }
        }
    }
}

/// Points on spheres: hits of one instance in a row of the grid.
pub(super) struct OnBalls<'a> {
    pub(super) grid: &'a RayGrid,
    pub(super) spheres: &'a [Sphere],
    pub(super) transform: &'a Affine3A,
    pub(super) hits: &'a [Option<Hit>],
    /// The ray of the first hit.
    pub(super) place: [usize; 2],
    /// Where it stands among the points.
    pub(super) first: usize,
    pub(super) points: &'a mut GridPoints,
}

impl Kernel for OnBalls<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self { grid, spheres, transform, hits, place, first, points } = self;
        for (i, hit) in hits.iter().enumerate() {
            let Some(hit) = hit else { continue };
            // In doubles, as rays do it: from afar a float says too little of where on a sphere a hit is.
            let sphere = &spheres[hit.primitive as usize];
            let center = transform.transform_point3(sphere.center).as_dvec3();
            let radius = f64::from(sphere.radius * transform.matrix3.x_axis.length());
            let along = grid.point(place[0] + i, place[1]).normalize().as_dvec3() * f64::from(hit.t);
            let outward = (grid.origin.as_dvec3() + along - center).normalize_or(DVec3::Y);
            let (position, outward) = ((center + radius * outward).as_vec3(), outward.as_vec3());
            for axis in 0..3 {
                points.position[axis][first + i] = position[axis];
                points.geometric_normal[axis][first + i] = outward[axis];
                points.shading_normal[axis][first + i] = outward[axis];
            }
            points.material_slot[first + i] = 0;
        }
    }
}
