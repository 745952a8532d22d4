//! How well a field stands for its object, and what it costs.
//!
//! At random points 1.05 to 6 bounding radii from the middle and outside the object, the vector of the field is
//! held against rays: against their projection to the same order (the error of the shells and the grid alone), and, lit by
//! a soft lobe of light from a random side, against the irradiance that the rays themselves find hidden (the error of
//! the bands as well).

use std::sync::Arc;
use std::time::Instant;

use glam::Vec3;
use halflight_sh::{Sh, Zh};
use halflight_shape::TriangleMesh;
use halflight_trace::{Geometry, Instance, MeshTracer, Ray, Simd, World};
use rayon::prelude::*;

use super::cast::{Caster, cone};
use super::entity::ball;
use super::shells::{Fineness, Shells};
use crate::sampler::Sampler;
use crate::sh_light::axes;

/// Points that are looked at.
const POINTS: u32 = 256;
/// Rays from each of them.
const RAYS: usize = 8192;
/// Exponent of the lobe of light.
const LIGHT: f64 = 8.0;

/// A line of the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldAccuracy {
    /// Bands of the harmonics.
    pub order: u32,
    /// Shells of the field.
    pub shells: u32,
    /// Steps of the grid of directions along one side.
    pub directions: u32,
    /// Bytes of the field.
    pub memory_bytes: usize,
    /// Wall seconds to make it.
    pub seconds: f64,
    /// Root mean square difference of visibility, over points and directions, from rays projected to the same order.
    pub interpolation: f64,
    /// Mean absolute error of the irradiance that is hidden of a lobe of light, in parts of the lobe's own integral.
    pub irradiance: f64,
    /// That error where nothing is thought to be hidden.
    pub without: f64,
}

/// The accuracy of the fields of a mesh, one for each (order, shells, directions), made with so many rays a vector.
pub fn field_accuracy(
    mesh: &Arc<TriangleMesh>,
    settings: &[[u32; 3]],
    rays: u32,
    simd: Simd,
) -> Vec<FieldAccuracy> {
    settings
        .iter()
        .map(|&[order, shells, directions]| match order {
            ..=3 => row::<3>(mesh, shells, directions, rays, simd),
            4 => row::<4>(mesh, shells, directions, rays, simd),
            5 => row::<5>(mesh, shells, directions, rays, simd),
            _ => row::<6>(mesh, shells, directions, rays, simd),
        })
        .collect()
}

fn row<const ORDER: usize>(
    mesh: &Arc<TriangleMesh>,
    shells: u32,
    directions: u32,
    rays: u32,
    simd: Simd,
) -> FieldAccuracy {
    let geometry = Arc::new(Geometry::Mesh(MeshTracer::build(Arc::clone(mesh))));
    let parts = [(Arc::clone(&geometry), glam::Affine3A::IDENTITY)];
    let (center, radius) = ball(&parts);
    let world = World::build(vec![Instance { geometry, transform: halflight_trace::Motion::IDENTITY }], simd);
    let fine = Fineness { shells: shells.max(2) as usize, directions: directions.max(2) as usize };
    let start = Instant::now();
    let caster = Caster { world: &world, center, radius, rays: rays as usize };
    let field = Shells::<ORDER, 1>::new((center, radius), fine, |point| [caster.hidden(point)]);
    let seconds = start.elapsed().as_secs_f64();
    let errors: Vec<[f64; 3]> =
        (0..POINTS).into_par_iter().map(|point| errors_at(&world, &field, (center, radius), point)).collect();
    let mean = |i: usize| errors.iter().map(|e| e[i]).sum::<f64>() / errors.len() as f64;
    FieldAccuracy {
        order: ORDER as u32,
        shells,
        directions,
        memory_bytes: field.memory_bytes(),
        seconds,
        interpolation: mean(0).sqrt(),
        irradiance: mean(1),
        without: mean(2),
    }
}

/// Squared difference from projected rays; errors of the irradiance with the field and with nothing.
fn errors_at<const ORDER: usize>(
    world: &World,
    field: &Shells<ORDER, 1>,
    (center, radius): (Vec3, f32),
    point: u32,
) -> [f64; 3] {
    let mut sampler = Sampler::new(7, point, 0, 0);
    let mut direction = || {
        let u = sampler.next_four();
        let height = 2.0 * u[0] - 1.0;
        let (s, c) = (std::f32::consts::TAU * u[1]).sin_cos();
        let across = (1.0 - height * height).max(0.0).sqrt();
        (Vec3::new(across * c, height, across * s), u[2])
    };
    let ((away, along), (light, _), (aside, _)) = (direction(), direction(), direction());
    let from = center + away * (radius * 1.05 * (6.0f32 / 1.05).powf(along));
    // A surface that more or less faces the object.
    let normal = (aside - away).normalize_or(-away);
    let (directions, weight) = cone(Vec3::Y, -1.0, RAYS);
    let mut hidden = Sh::<ORDER, f64>::zero();
    let (mut open, mut lit) = (0.0, 0.0);
    for ray in directions {
        let value = f64::from(ray.dot(light).max(0.0)).powf(LIGHT) * (LIGHT + 1.0) / std::f64::consts::TAU
            * f64::from(ray.dot(normal).max(0.0));
        open += value;
        if world.occluded(&Ray::new(from, ray)) {
            hidden += Sh::<ORDER, f64>::basis(axes(ray).map(f64::from));
        } else {
            lit += value;
        }
    }
    let [weight, open, lit] = [f64::from(weight), open * f64::from(weight), lit * f64::from(weight)];
    let [of_field] = field.at(from);
    let difference = (of_field - (hidden * weight).cast()).norm();
    let cosine = Zh::<ORDER>::clamped_cosine().to_direction(axes(normal));
    let lobe = Zh::<ORDER>::phong(LIGHT).to_direction(axes(light));
    let shadow = f64::from(of_field.product(&cosine).dot(&lobe));
    [
        f64::from(difference * difference) / (4.0 * std::f64::consts::PI),
        (shadow - (open - lit)).abs(),
        (open - lit).abs(),
    ]
}
