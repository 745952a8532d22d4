//! Chi-square tests: lights and cameras send as many samples into every direction as their densities say.
//!
//! The density of a direction is found without the sampler: by intersecting the light, by the plane of the film, by the
//! projection of the lens.

use std::f32::consts::{FRAC_PI_3, PI};
use std::sync::Arc;

use glam::{Affine3A, DAffine3, DVec3, Mat3, Quat, Vec2, Vec3};
use halflight_image::RgbImage;
use halflight_material::test_kit::{ChiSquare, chi_square_of};
use halflight_material::{ColorInput, Material, MaterialKind};
use halflight_scene::camera::{Camera, FieldOfView};
use halflight_scene::lights::{DeltaLight, Emitter, EmitterShape, Environment, EnvironmentMap, Lights};

/// All tests of this file together.
const TESTS: usize = 60;

/// Panics unless samples fall as the density says and it integrates to the probability that there is a sample.
fn agree(what: &str, sampler: impl FnMut(f32, Vec2) -> Option<Vec3>, density: impl Fn(Vec3) -> f32) {
    agree_over(4, what, sampler, density);
}

/// With 2 to the power of `depth` bins on each side of the horizon.
fn agree_over(
    depth: usize,
    what: &str,
    sampler: impl FnMut(f32, Vec2) -> Option<Vec3>,
    density: impl Fn(Vec3) -> f32,
) {
    let settings = ChiSquare { samples: 30_000, depth, tests: TESTS, ..ChiSquare::default() };
    let report = chi_square_of(sampler, density, &settings);
    assert!(report.passes(), "{what}: {report}");
}

fn emitter(shape: EmitterShape, pose: Affine3A, instance: u32) -> Emitter {
    let material = Material {
        name: "lamp".into(),
        kind: MaterialKind::Black,
        emission: Some(ColorInput::Constant(Vec3::ONE)),
        two_sided: true,
        normal_map: None,
        opacity: None,
    };
    Emitter { shape, pose: [pose; 2], material: Arc::new(material), instance, primitive: 0 }
}

fn triangle(corners: [Vec3; 3]) -> EmitterShape {
    EmitterShape::Triangle { corners: [corners; 2], uvs: [Vec2::ZERO, Vec2::X, Vec2::Y] }
}

/// Where a ray meets the surface in the world, with normals: by algebra in the shape's own space.
fn crossings(emitter: &Emitter, from: Vec3, direction: Vec3) -> Vec<(Vec3, Vec3)> {
    let pose = emitter.pose[0];
    let to_world = DAffine3::from_mat3_translation(pose.matrix3.as_dmat3(), pose.translation.as_dvec3());
    let to_local = to_world.inverse();
    let (o, d) =
        (to_local.transform_point3(from.as_dvec3()), to_local.transform_vector3(direction.as_dvec3()));
    let flat = |t: f64| o + t * d;
    let found: Vec<(f64, DVec3)> = match &emitter.shape {
        EmitterShape::Rectangle => {
            let t = -o.z / d.z;
            (flat(t).truncate().abs().max_element() <= 1.0).then_some((t, DVec3::Z)).into_iter().collect()
        }
        EmitterShape::Disk => {
            let t = -o.z / d.z;
            (flat(t).truncate().length() <= 1.0).then_some((t, DVec3::Z)).into_iter().collect()
        }
        EmitterShape::Triangle { corners: [corners, _], .. } => {
            let [a, b, c] = corners.map(|p| p.as_dvec3());
            let normal = (b - a).cross(c - a);
            let t = normal.dot(a - o) / normal.dot(d);
            let side = |p: DVec3, q: DVec3| (q - p).cross(flat(t) - p).dot(normal) >= 0.0;
            (side(a, b) && side(b, c) && side(c, a)).then_some((t, normal)).into_iter().collect()
        }
        EmitterShape::Sphere { center, radius } => {
            let to = o - center.as_dvec3();
            let (a, b, c) = (d.length_squared(), to.dot(d), to.length_squared() - f64::from(radius * radius));
            let root = (b * b - a * c).max(0.0).sqrt();
            if b * b < a * c {
                Vec::new()
            } else {
                [(-b - root) / a, (-b + root) / a].map(|t| (t, to + t * d)).to_vec()
            }
        }
    };
    let normal_to_world = to_world.matrix3.inverse().transpose();
    found
        .into_iter()
        .filter(|(t, _)| *t > 0.0 && t.is_finite())
        .map(|(t, n)| {
            (to_world.transform_point3(flat(t)).as_vec3(), (normal_to_world * n).normalize().as_vec3())
        })
        .collect()
}

fn poses() -> [(&'static str, Affine3A); 3] {
    let turned = Affine3A::from_rotation_translation(Quat::from_rotation_x(0.7), Vec3::new(0.3, 2.0, -0.5));
    let shear = Mat3::from_cols(0.7 * Vec3::X, Vec3::new(0.4, 1.0, 0.0), Vec3::new(0.0, 0.2, 1.3));
    [
        ("scaled", turned * Affine3A::from_scale(Vec3::splat(0.6))),
        ("mirrored and stretched", turned * Affine3A::from_scale(Vec3::new(-0.5, 1.2, 0.8))),
        ("sheared", turned * Affine3A::from_mat3(shear)),
    ]
}

/// Stretched spheres are drawn by area, both sides; round ones by the cone of their near side, seen from outside.
fn density(emitter: &Emitter, from: Vec3, direction: Vec3, near_side_only: bool) -> f32 {
    let all = crossings(emitter, from, direction);
    let seen = if near_side_only { &all[..all.len().min(1)] } else { &all[..] };
    seen.iter().map(|(point, normal)| emitter.pdf(from, *point, *normal, 0.0)).sum()
}

fn each_pose_and_place(name: &str, shape: &EmitterShape) {
    for (pose_name, pose) in poses() {
        let emitter = emitter(shape.clone(), pose, 0);
        for from in [Vec3::ZERO, Vec3::new(1.5, -0.5, 1.0), Vec3::new(0.2, 1.7, -1.5)] {
            let inside = matches!(shape, EmitterShape::Sphere { .. })
                && crossings(&emitter, from, Vec3::new(0.3, 0.5, 0.8)).len() == 1;
            let near_side_only = pose_name == "scaled" && !inside;
            let sampler = |_: f32, u: Vec2| {
                emitter.sample(from, u, 0.0).map(|sample| (sample.point - from).normalize())
            };
            let what = format!("{name}, {pose_name}, from {from}");
            agree(&what, sampler, |wi| density(&emitter, from, wi, near_side_only));
        }
    }
}

#[test]
fn directions_to_a_rectangle_come_as_often_as_its_density_says() {
    each_pose_and_place("rectangle", &EmitterShape::Rectangle);
}

#[test]
fn directions_to_a_disk_come_as_often_as_its_density_says() {
    each_pose_and_place("disk", &EmitterShape::Disk);
}

#[test]
fn directions_to_a_triangle_come_as_often_as_its_density_says() {
    let corners = [Vec3::new(-1.0, 0.0, 0.2), Vec3::new(1.2, -0.3, 0.0), Vec3::new(0.1, 1.1, -0.4)];
    each_pose_and_place("triangle", &triangle(corners));
}

#[test]
fn directions_to_a_sphere_or_an_ellipsoid_come_as_often_as_its_density_says() {
    let shape = EmitterShape::Sphere { center: Vec3::new(0.2, 0.1, 0.0), radius: 0.7 };
    each_pose_and_place("sphere", &shape);
}

#[test]
fn directions_to_a_sphere_from_inside_come_as_often_as_its_density_says() {
    let ball = emitter(EmitterShape::Sphere { center: Vec3::ZERO, radius: 1.0 }, Affine3A::IDENTITY, 0);
    let from = Vec3::new(0.3, -0.2, 0.6);
    let sampler = |_: f32, u: Vec2| ball.sample(from, u, 0.0).map(|s| (s.point - from).normalize());
    agree("sphere from inside", sampler, |wi| density(&ball, from, wi, false));
}

/// The shape of a lamp that shows a picture does not depend on the picture: neither do the directions.
#[test]
fn directions_to_a_lamp_with_a_texture_come_as_often_as_its_density_says() {
    let picture = RgbImage::from_fn(8, 8, |x, y| if (x + y) % 3 == 0 { [9.0, 4.0, 1.0] } else { [0.1; 3] });
    let folder = tempfile::tempdir().expect("a folder for the test");
    let path = folder.path().join("lamp.hdr");
    halflight_image::save_hdr(&path, &picture).expect("the picture is written");
    let text = format!("diffuse emission={}", path.display());
    let material = halflight_scene::material_from_text(&text).expect("a shining material");
    assert!(material.is_emissive());
    let pose = Affine3A::from_rotation_translation(Quat::from_rotation_y(0.5), Vec3::new(0.4, 0.5, -1.5));
    let lamp = Emitter { material: Arc::new(material), ..emitter(EmitterShape::Rectangle, pose, 0) };
    let lights = Lights::new(None, vec![lamp.clone()], Vec::new(), 2.0);
    let sampler = |choice: f32, u: Vec2| lights.sample(Vec3::ZERO, choice, u, 0.0).map(|s| s.direction);
    agree("textured lamp", sampler, |wi| density(&lamp, Vec3::ZERO, wi, false));
}

/// A map with a bright spot, dark parts and a gradient.
fn map() -> Arc<EnvironmentMap> {
    Arc::new(EnvironmentMap::new(RgbImage::from_fn(16, 8, |x, y| match (x, y) {
        (5, 2) => [60.0, 50.0, 30.0],
        (8..11, 5..7) => [0.0; 3],
        _ => [0.2 + 0.1 * x as f32, 0.5, 0.1 + 0.3 * y as f32],
    })))
}

/// The kit's poles are at ±z, those of a map at ±y: turned like this, steps of the density are straight.
fn up_to_z(v: Vec3) -> Vec3 {
    Vec3::new(v.z, v.x, v.y)
}

fn z_to_up(v: Vec3) -> Vec3 {
    Vec3::new(v.y, v.z, v.x)
}

#[test]
fn directions_to_an_environment_come_as_often_as_its_density_says_however_it_is_turned() {
    for rotation in [0.0, 0.4, 3.0, -2.2] {
        let environment = Environment { map: map(), rotation, intensity: Vec3::splat(0.8) };
        // The steps between texels need small bins to be integrated over.
        agree_over(
            7,
            &format!("environment turned by {rotation}"),
            |_, u| Some(up_to_z(environment.sample(u).0)),
            |wi| environment.pdf(z_to_up(wi)),
        );
    }
}

#[test]
fn directions_to_a_uniform_environment_are_uniform() {
    let map = Arc::new(EnvironmentMap::new(RgbImage::from_fn(4, 2, |_, _| [0.7; 3])));
    let environment = Environment { map, rotation: 1.0, intensity: Vec3::ONE };
    agree("uniform", |_, u| Some(environment.sample(u).0), |_| 0.25 / PI);
}

#[test]
fn all_lights_together_send_directions_as_often_as_the_sum_of_their_densities_says() {
    let environment = Environment { map: map(), rotation: 0.9, intensity: Vec3::ONE };
    // A mesh of two triangles, a ball and a lamp, that do not stand before each other: a density adds up anyway.
    let quad = [Vec3::new(-1.0, 1.0, -1.0), Vec3::new(1.0, 1.2, -1.0), Vec3::new(1.0, 1.0, 0.5)];
    let other = [quad[0], quad[2], Vec3::new(-1.0, 1.1, 0.5)];
    let at = Affine3A::from_translation;
    let emitters = vec![
        emitter(triangle(quad), Affine3A::IDENTITY, 0),
        Emitter { primitive: 1, ..emitter(triangle(other), Affine3A::IDENTITY, 0) },
        emitter(EmitterShape::Sphere { center: Vec3::ZERO, radius: 0.5 }, at(Vec3::new(2.0, 0.3, 0.0)), 1),
        emitter(EmitterShape::Disk, at(Vec3::new(-0.5, -0.4, -2.0)), 2),
    ];
    let deltas =
        vec![DeltaLight::Point { position: [Vec3::new(-1.0, 0.4, 0.7); 2], intensity: Vec3::splat(0.5) }];
    for (environment, deltas) in [(Some(environment), Vec::new()), (None, deltas)] {
        let lights = Lights::new(environment, emitters.clone(), deltas, 3.0);
        let sampler = |choice: f32, u: Vec2| {
            let sample = lights.sample(Vec3::ZERO, choice, u, 0.0).filter(|sample| !sample.delta)?;
            Some(up_to_z(sample.direction))
        };
        let density = |wi: Vec3| {
            let wi = z_to_up(wi);
            let sky = lights.environment().map_or(0.0, |e| lights.environment_pdf(e.locate(wi)));
            let lamps: f32 = lights
                .emitters()
                .iter()
                .enumerate()
                .filter_map(|(index, lamp)| {
                    let (point, normal) = *crossings(lamp, Vec3::ZERO, wi).first()?;
                    Some(lights.emitter_pdf(index as u32, Vec3::ZERO, point, normal, 0.0))
                })
                .sum();
            sky + lamps
        };
        agree("all lights", sampler, density);
    }
}

fn camera(aperture_radius: f32, moves: bool) -> Camera {
    let open = Camera::look_at(Vec3::new(1.0, 2.0, 3.0), Vec3::ZERO, Vec3::Y);
    let close = if moves { Affine3A::from_translation(0.5 * Vec3::X) * open } else { open };
    Camera {
        pose: [open, close],
        field_of_view: FieldOfView::Vertical(FRAC_PI_3),
        aperture_radius,
        focus_distance: 2.5,
    }
}

/// From world space to the frame of the camera, with what it sees along +z, as the kit likes it.
fn seen(camera: &Camera, direction: Vec3) -> Vec3 {
    let local = Mat3::from(camera.pose[0].matrix3).transpose() * direction;
    Vec3::new(local.x, local.y, -local.z)
}

/// A density of 1/A over a part of area A of the plane at distance 1 is 1/(A cos³) over solid angle.
#[test]
fn rays_through_a_pixel_fill_it_evenly_from_a_pinhole() {
    for (film, pixel) in [([1usize, 1usize], [0.0f32, 0.0]), ([4, 3], [0.0, 0.0]), ([4, 3], [2.0, 2.0])] {
        let camera = camera(0.0, film == [1, 1]);
        let view = camera.view(film[0], film[1]);
        let half_height = (0.5 * FRAC_PI_3).tan();
        let side = 2.0 * half_height / film[1] as f32;
        let sampler = |time: f32, u: Vec2| {
            let ray = view.ray(Vec2::from(pixel) + u, Vec2::splat(0.5), time);
            Some(seen(&camera, ray.direction))
        };
        let density = |wi: Vec3| {
            let (s, t) = (wi.x / wi.z, wi.y / wi.z);
            let column = (s + half_height * film[0] as f32 / film[1] as f32) / side;
            let row = (half_height - t) / side;
            let inside = wi.z > 0.0
                && (pixel[0]..pixel[0] + 1.0).contains(&column)
                && (pixel[1]..pixel[1] + 1.0).contains(&row);
            if inside { 1.0 / (side * side * wi.z.powi(3)) } else { 0.0 }
        };
        agree(&format!("pixel {pixel:?} of {film:?}"), sampler, density);
    }
}

/// A uniform disk, lifted to the hemisphere above it, has the density cos/π.
#[test]
fn rays_leave_a_thin_lens_evenly_over_its_disk() {
    let camera = camera(0.3, false);
    let view = camera.view(64, 48);
    let sampler = |_: f32, u: Vec2| {
        let ray = view.ray(Vec2::new(20.3, 30.1), u, 0.0);
        let point = camera.pose[0].inverse().transform_point3(ray.origin) / 0.3;
        let height = (1.0 - point.truncate().length_squared()).max(0.0).sqrt();
        Some(point.truncate().extend(height))
    };
    agree("lens", sampler, |wi| wi.z.max(0.0) / PI);
}

/// From one point of the lens, the rays of a pixel fill its image in the plane of focus evenly.
#[test]
fn rays_through_a_pixel_fill_it_evenly_from_any_point_of_a_lens() {
    let camera = camera(0.3, false);
    let view = camera.view(1, 1);
    let lens = Vec2::new(0.8, 0.35);
    let half = 2.5 * (0.5 * FRAC_PI_3).tan();
    let origin = view.ray(Vec2::ZERO, lens, 0.0).origin;
    let on_lens = camera.pose[0].inverse().transform_point3(origin);
    let sampler = |_: f32, u: Vec2| Some(seen(&camera, view.ray(u, lens, 0.0).direction));
    let density = |wi: Vec3| {
        let point = on_lens.truncate() + 2.5 * wi.truncate() / wi.z;
        let inside = wi.z > 0.0 && point.abs().max_element() <= half;
        if inside { 2.5 * 2.5 / (4.0 * half * half * wi.z.powi(3)) } else { 0.0 }
    };
    agree("pixel from a point of the lens", sampler, density);
}
