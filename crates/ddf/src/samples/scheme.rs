//! How samples are drawn.

use std::sync::Arc;

use glam::Vec3;
use halflight_shape::TriangleMesh;
use halflight_trace::{MeshTracer, Ray, RayGeometry};
use rayon::prelude::*;

use super::{FieldSample, Inside};
use crate::random::Random;

/// Where samples come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleScheme {
    /// Points on faces, directions, marching steps [002 eq. 9–13].
    Surface {
        /// s_fc: points on each face.
        faces: usize,
        /// s_dr: directions from each point.
        directions: usize,
        /// s_p: points along each ray.
        marching: usize,
    },
    /// Points of the bounding cube and directions, both uniform.
    Random {
        /// How many.
        count: usize,
    },
    /// The pixels of cameras around the mesh: 10 azimuths × 5 polar angles in [002 Fig. 6].
    PointOfView {
        /// Cameras around.
        azimuths: usize,
        /// Cameras from pole to pole.
        polars: usize,
        /// Pixels along each side.
        pixels: usize,
    },
}

/// How far the march goes: the radius of the sphere that holds the bounding cube.
const BOUND: f32 = 1.8;

/// Draws samples of a mesh, which is given in the unit sphere. The result depends on mesh, scheme and seed only.
#[must_use]
pub fn draw_samples(unit_mesh: &Arc<TriangleMesh>, scheme: SampleScheme, seed: u64) -> Vec<FieldSample> {
    let tracer = MeshTracer::build(Arc::clone(unit_mesh));
    match scheme {
        SampleScheme::Surface { faces, directions, marching } => {
            let inside = Inside::new(&tracer);
            let draw = Surface { tracer: &tracer, inside: &inside, directions, marching };
            (0..unit_mesh.triangles.len())
                .into_par_iter()
                .with_min_len(64)
                .flat_map_iter(|face| {
                    let mut random = Random::new(seed, 21, face as u64);
                    let mut samples = Vec::new();
                    for _ in 0..faces {
                        draw.point(face, &mut random, &mut samples);
                    }
                    samples
                })
                .collect()
        }
        SampleScheme::Random { count } => (0..count)
            .into_par_iter()
            .with_min_len(1024)
            .map(|index| {
                let mut random = Random::new(seed, 22, index as u64);
                let inside = Vec3::new(random.float(), random.float(), random.float()) * 2.0 - 1.0;
                let direction = random.direction();
                cast(&tracer, inside, direction)
            })
            .collect(),
        SampleScheme::PointOfView { azimuths, polars, pixels } => {
            let rays = azimuths * polars * pixels * pixels;
            (0..rays)
                .into_par_iter()
                .with_min_len(1024)
                .map(|index| {
                    let (camera, pixel) = (index / (pixels * pixels), index % (pixels * pixels));
                    let (origin, direction) = camera_ray(camera, pixel, azimuths, polars, pixels);
                    cast(&tracer, origin, direction)
                })
                .collect()
        }
    }
}

fn cast(tracer: &MeshTracer, origin: Vec3, direction: Vec3) -> FieldSample {
    let distance = tracer.closest(&Ray::new(origin, direction)).map_or(f32::INFINITY, |hit| hit.t);
    FieldSample { origin, direction, distance }
}

/// The ray of a pixel of a camera on a sphere of radius 2, which looks at the middle and just holds the unit sphere.
fn camera_ray(camera: usize, pixel: usize, azimuths: usize, polars: usize, pixels: usize) -> (Vec3, Vec3) {
    let phi = std::f32::consts::TAU * (camera % azimuths) as f32 / azimuths as f32;
    let theta = std::f32::consts::PI * ((camera / azimuths) as f32 + 0.5) / polars as f32;
    let towards = Vec3::new(theta.sin() * phi.sin(), theta.cos(), theta.sin() * phi.cos());
    let right = Vec3::Y.cross(towards).normalize_or(Vec3::X);
    let up = towards.cross(right);
    // The sphere of radius 1 seen from 2 fills sin⁻¹ ½.
    let half = 3f32.sqrt().recip();
    let at = |index: usize| ((index as f32 + 0.5) / pixels as f32 * 2.0 - 1.0) * half;
    let direction = -towards + at(pixel % pixels) * right - at(pixel / pixels) * up;
    (2.0 * towards, direction.normalize())
}

struct Surface<'a> {
    tracer: &'a MeshTracer,
    inside: &'a Inside<'a>,
    directions: usize,
    marching: usize,
}

impl Surface<'_> {
    /// The samples of one point of a face.
    fn point(&self, face: usize, random: &mut Random, to: &mut Vec<FieldSample>) {
        let [a, b, c] = self.tracer.mesh().corners(face);
        // [002 eq. 9], corrected: see docs/errata.md.
        let (u, v) = random.barycentric();
        let point = a + u * (b - a) + v * (c - a);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        if normal == Vec3::ZERO {
            return;
        }
        for _ in 0..self.directions {
            // [002 eq. 10], corrected: see docs/errata.md.
            let omega = random.direction();
            let origin = point + normal * 1e-5f32.copysign(normal.dot(omega));
            self.ray(origin, omega, random, to);
        }
    }

    fn ray(&self, p: Vec3, omega: Vec3, random: &mut Random, to: &mut Vec<FieldSample>) {
        let hit = self.tracer.closest(&Ray::new(p, omega)).map(|hit| hit.t);
        // A ray that never meets the mesh again is outside by the odd–even rule; one that does may be within.
        if hit.is_some_and(|t| self.inside.contains(p + 0.5 * t * omega)) {
            return;
        }
        let reach = hit.unwrap_or(BOUND);
        let aside = omega.any_orthonormal_vector();
        for _ in 0..self.marching {
            let t = reach * random.float();
            let x = p + t * omega;
            // [002 eq. 11]
            to.push(FieldSample { origin: x, direction: -omega, distance: t });
            // [002 eq. 12], and the second hit where there is one.
            let ahead = hit.map_or(f32::INFINITY, |hit| hit - t);
            to.push(FieldSample { origin: x, direction: omega, distance: ahead });
            // [002 eq. 13]: only those that miss; the others are seen from the faces that they meet.
            for direction in [aside, -aside] {
                if !self.tracer.occluded(&Ray::new(x, direction)) {
                    to.push(FieldSample { origin: x, direction, distance: f32::INFINITY });
                }
            }
        }
    }
}
