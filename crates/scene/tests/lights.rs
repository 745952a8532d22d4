//! Lights are sampled with the densities that they claim.

use std::f32::consts::PI;
use std::sync::Arc;

use glam::{Affine3A, Quat, Vec2, Vec3};
use halflight_image::RgbImage;
use halflight_material::{ColorInput, Material, MaterialKind};
use halflight_scene::lights::{
    Arrival, DeltaLight, Emitter, EmitterShape, Environment, EnvironmentMap, Lights,
};

fn shining(two_sided: bool) -> Arc<Material> {
    Arc::new(Material {
        name: "lamp".into(),
        kind: MaterialKind::Black,
        emission: Some(ColorInput::Constant(Vec3::new(3.0, 2.0, 1.0))),
        two_sided,
        normal_map: None,
        opacity: None,
    })
}

fn emitter(shape: EmitterShape, pose: Affine3A, two_sided: bool) -> Emitter {
    Emitter { shape, pose: [pose; 2], material: shining(two_sided), instance: 0, primitive: 0 }
}

fn triangle() -> EmitterShape {
    let corners = [Vec3::new(-1.0, 0.0, 0.2), Vec3::new(1.2, -0.3, 0.0), Vec3::new(0.1, 1.1, -0.4)];
    EmitterShape::Triangle { corners: [corners; 2], uvs: [Vec2::ZERO, Vec2::X, Vec2::Y] }
}

fn poses() -> Vec<(&'static str, Affine3A)> {
    let turned = Affine3A::from_rotation_translation(Quat::from_rotation_x(0.7), Vec3::new(0.3, 2.0, -0.5));
    vec![
        ("rigid", turned),
        ("scaled", turned * Affine3A::from_scale(Vec3::splat(0.4))),
        ("stretched", turned * Affine3A::from_scale(Vec3::new(0.3, 1.7, 0.8))),
        ("mirrored", turned * Affine3A::from_scale(Vec3::new(-0.6, 0.6, 0.6))),
        (
            "sheared",
            turned
                * Affine3A::from_mat3(glam::Mat3::from_cols(
                    Vec3::X,
                    Vec3::new(0.5, 1.0, 0.0),
                    Vec3::new(0.0, 0.2, 1.0),
                )),
        ),
    ]
}

fn shapes() -> Vec<(&'static str, EmitterShape)> {
    vec![
        ("triangle", triangle()),
        ("rectangle", EmitterShape::Rectangle),
        ("disk", EmitterShape::Disk),
        ("sphere", EmitterShape::Sphere { center: Vec3::new(0.2, 0.1, 0.0), radius: 0.7 }),
    ]
}

/// Points of the unit square with low discrepancy.
fn lattice(n: u32) -> impl Iterator<Item = Vec2> {
    (0..n).map(move |i| Vec2::new((i as f32 + 0.5) / n as f32, (i as f32 * 0.618_034).fract()))
}

#[test]
fn a_sampled_point_has_the_density_that_looking_it_up_gives() {
    for (pose_name, pose) in poses() {
        for (shape_name, shape) in shapes() {
            let emitter = emitter(shape, pose, true);
            for from in [Vec3::ZERO, Vec3::new(2.0, -1.0, 1.0), Vec3::new(0.0, 1.2, -4.0), emitter.center()] {
                for u in lattice(500) {
                    let Some(sample) = emitter.sample(from, u, 0.0) else { continue };
                    let pdf = emitter.pdf(from, sample.point, sample.normal, 0.0);
                    // At grazing angles both lose digits in the same cosine.
                    let cosine = sample.normal.dot((sample.point - from).normalize()).abs();
                    if cosine > 1e-2 {
                        let what = format!("{shape_name}, {pose_name}, from {from}: {} {pdf}", sample.pdf);
                        assert!((sample.pdf - pdf).abs() <= 5e-3 * pdf, "{what}");
                    }
                }
            }
        }
    }
}

/// Irradiance from the sampler against a sum over small pieces of the surface, uniform in local parameters.
#[test]
fn the_estimated_irradiance_is_that_of_the_surface_cut_into_pieces() {
    let normal = Vec3::new(0.1, 1.0, -0.2).normalize();
    for (pose_name, pose) in poses() {
        for (shape_name, shape) in shapes() {
            let emitter = emitter(shape.clone(), pose, false);
            for from in [Vec3::ZERO, Vec3::new(1.0, -0.5, 0.7)] {
                let n = 40_000;
                let mut estimate = 0.0f64;
                for u in lattice(n) {
                    let Some(sample) = emitter.sample(from, u, 0.0) else { continue };
                    let direction = (sample.point - from).normalize();
                    let radiance = emitter.radiance(sample.uv, sample.normal, -direction);
                    let cosine = normal.dot(direction).max(0.0);
                    estimate += f64::from(radiance.x * cosine / sample.pdf) / f64::from(n);
                }
                let exact = pieces(&shape, &pose, from, normal);
                let what = format!("{shape_name}, {pose_name}, from {from}: {estimate} {exact}");
                assert!((estimate - exact).abs() < 0.02 * exact + 2e-3, "{what}");
            }
        }
    }
}

/// Radiance 3 times the projected solid angle of the front of a shape, by finite differences of its parametrisation.
fn pieces(shape: &EmitterShape, pose: &Affine3A, from: Vec3, normal: Vec3) -> f64 {
    let point = |u: f32, v: f32| -> Vec3 {
        let local = match shape {
            EmitterShape::Triangle { corners: [c, _], .. } => {
                c[0] + (c[1] - c[0]) * u * (1.0 - v) + (c[2] - c[0]) * v * u
            }
            EmitterShape::Rectangle => Vec3::new(2.0 * u - 1.0, 2.0 * v - 1.0, 0.0),
            EmitterShape::Disk => Vec3::new(u * (2.0 * PI * v).cos(), u * (2.0 * PI * v).sin(), 0.0),
            EmitterShape::Sphere { center, radius } => {
                let (theta, phi) = (PI * u, 2.0 * PI * v);
                *center + *radius * Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
            }
        };
        pose.transform_point3(local)
    };
    // A mirroring transform turns the parametrisation's normal, not the surface's front.
    let sign = if pose.matrix3.determinant() < 0.0 { -1.0 } else { 1.0 };
    let n = 300;
    let h = 0.5 / n as f32;
    let mut sum = 0.0f64;
    for i in 0..n {
        for j in 0..n {
            let (u, v) = ((i as f32 + 0.5) / n as f32, (j as f32 + 0.5) / n as f32);
            let (du, dv) = (point(u + h, v) - point(u - h, v), point(u, v + h) - point(u, v - h));
            let area = sign * du.cross(dv);
            let to = point(u, v) - from;
            let facing = -area.dot(to.normalize());
            let cosine = normal.dot(to.normalize()).max(0.0);
            sum += f64::from(3.0 * facing.max(0.0) * cosine / to.length_squared());
        }
    }
    sum
}

#[test]
fn choosing_among_all_kinds_of_lights_gives_the_sum_of_their_irradiances() {
    let map = RgbImage::from_fn(16, 8, |x, y| [0.3 + 0.1 * x as f32, 0.5, if y < 2 { 4.0 } else { 0.1 }]);
    let environment =
        Environment { map: Arc::new(EnvironmentMap::new(map)), rotation: 0.4, intensity: Vec3::splat(0.8) };
    let lamp = |at: Vec3, size: f32, instance: u32| Emitter {
        instance,
        ..emitter(EmitterShape::Sphere { center: at, radius: size }, Affine3A::IDENTITY, true)
    };
    let emitters = vec![lamp(Vec3::new(0.0, 2.0, 0.0), 0.5, 0), lamp(Vec3::new(3.0, 1.0, 0.0), 0.2, 1)];
    let deltas =
        vec![DeltaLight::Point { position: [Vec3::new(-1.0, 1.0, 0.0); 2], intensity: Vec3::splat(0.7) }];
    let normal = Vec3::Y;
    let irradiance = |lights: &Lights| {
        let n = 60_000u32;
        let mut sum = glam::DVec3::ZERO;
        for (i, u) in lattice(n).enumerate() {
            let choice = (i as f32 * 0.754_877_7).fract();
            if let Some(sample) = lights.sample(Vec3::ZERO, choice, u, 0.0) {
                let cosine = normal.dot(sample.direction).max(0.0);
                let radiance = match sample.arrival {
                    Arrival::Environment(point) => lights.environment().unwrap().radiance_at(point),
                    Arrival::From { radiance, .. } => radiance,
                };
                sum += (radiance * cosine / sample.pdf).as_dvec3() / f64::from(n);
            }
        }
        sum
    };
    let all = irradiance(&Lights::new(Some(environment.clone()), emitters.clone(), deltas.clone(), 3.0));
    let parts = irradiance(&Lights::new(Some(environment), Vec::new(), Vec::new(), 3.0))
        + irradiance(&Lights::new(None, emitters, Vec::new(), 3.0))
        + irradiance(&Lights::new(None, Vec::new(), deltas, 3.0));
    assert!(all.distance(parts) < 0.02 * parts.length(), "{all} {parts}");
}

#[test]
fn the_density_of_hitting_an_emitter_includes_its_choice() {
    let emitters: Vec<Emitter> = (0..40)
        .map(|i| Emitter {
            instance: i,
            ..emitter(
                EmitterShape::Sphere {
                    center: Vec3::new(i as f32 - 20.0, 3.0, 0.0),
                    radius: 0.1 + 0.01 * i as f32,
                },
                Affine3A::IDENTITY,
                true,
            )
        })
        .collect();
    for count in [1, 3, 16, 40] {
        let lights = Lights::new(None, emitters[..count].to_vec(), Vec::new(), 10.0);
        for (i, u) in lattice(300).enumerate() {
            let choice = (i as f32 * 0.754_877_7).fract();
            let sample = lights.sample(Vec3::ZERO, choice, u, 0.0).unwrap();
            let Arrival::From { point: Some(point), .. } = sample.arrival else {
                unreachable!("no environment")
            };
            let found = (0..count)
                .min_by(|&a, &b| {
                    let off = |k: usize| {
                        let EmitterShape::Sphere { center, radius } = emitters[k].shape else {
                            return f32::MAX;
                        };
                        (point.distance(center) - radius).abs()
                    };
                    off(a).total_cmp(&off(b))
                })
                .unwrap();
            let index = lights.emitter_of(found as u32, 0).unwrap();
            let EmitterShape::Sphere { center, .. } = emitters[found].shape else { unreachable!() };
            let pdf = lights.emitter_pdf(index, Vec3::ZERO, point, (point - center).normalize(), 0.0);
            assert!((pdf - sample.pdf).abs() < 1e-3 * pdf, "{count} lights: {pdf} {}", sample.pdf);
        }
    }
}

#[test]
fn places_change_with_texture_coordinates_as_their_derivatives_say() {
    for (shape_name, shape) in shapes() {
        for (pose_name, pose) in poses() {
            let emitter = emitter(shape.clone(), pose, false);
            let at = |u: Vec2| emitter.sample_surface(u, 0.0).expect("a point of it");
            let (here, there) = (at(Vec2::new(0.31, 0.42)), at(Vec2::new(0.3102, 0.4203)));
            let [across, down] = emitter.derivatives(0.5 * (here.uv + there.uv)).expect("derivatives");
            let step = there.uv - here.uv;
            let (told, found) = (step.x * across + step.y * down, there.point - here.point);
            assert!(
                told.distance(found) < 0.01 * found.length(),
                "{shape_name}, {pose_name}: {told} {found}"
            );
        }
    }
    let folded = EmitterShape::Triangle { corners: [[Vec3::X, Vec3::Y, Vec3::Z]; 2], uvs: [Vec2::ONE; 3] };
    assert!(emitter(folded, Affine3A::IDENTITY, false).derivatives(Vec2::ONE).is_none());
}
