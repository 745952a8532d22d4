//! Claims about the technique as a whole, and about its parts against closed forms and rays.

use std::sync::Arc;

use glam::{Affine3A, Mat3, Quat, Vec3};
use halflight_scene::{LoadOptions, Scene};
use halflight_sh::{Sh, Zh};
use halflight_shape::TriangleMesh;
use halflight_shape::procedural::mesh as shapes;
use halflight_trace::{Geometry, Instance, MeshTracer, Motion, Rectangle, Simd, Sphere, SphereTracer, World};

use super::cast::Caster;
use super::entity::{Entity, ball};
use super::flat::{Flat, FlatTable};
use super::own::Own;
use super::pose::in_axes;
use super::shells::{Fineness, Shells};
use super::{ShadowFields, ShadowFieldsSettings};
use crate::film::Film;
use crate::sh_light::axes;
use crate::technique::{Budget, Quiet, RenderReport, Technique};
use crate::techniques::path::{Path, PathSettings};

type Parts = [(Arc<Geometry>, Affine3A); 1];

const FINE: Fineness = Fineness { shells: 16, directions: 16 };

fn mesh(mesh: TriangleMesh) -> Geometry {
    Geometry::Mesh(MeshTracer::build(Arc::new(mesh)))
}

fn with_caster<R>(
    geometry: Geometry,
    place: Affine3A,
    rays: usize,
    f: impl FnOnce(&Caster, &Parts) -> R,
) -> R {
    let parts = [(Arc::new(geometry), place)];
    let (center, radius) = ball(&parts);
    let instance = Instance { geometry: Arc::clone(&parts[0].0), transform: Motion::fixed(place) };
    let world = World::build(vec![instance], Simd::detect());
    f(&Caster { world: &world, center, radius, rays }, &parts)
}

fn field<const ORDER: usize>(caster: &Caster) -> Shells<ORDER, 1> {
    Shells::new((caster.center, caster.radius), FINE, |point| [caster.hidden(point)])
}

/// Root mean square over directions.
fn rms<const ORDER: usize>(difference: Sh<ORDER>) -> f32 {
    difference.norm() / (4.0 * std::f32::consts::PI).sqrt()
}

fn directions(count: usize) -> impl Iterator<Item = Vec3> {
    super::cast::cone(Vec3::new(0.36, 0.48, 0.8), -1.0, count).0
}

fn load(text: &str) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).unwrap();
    Scene::load(&path, &LoadOptions::default()).unwrap()
}

/// Few rays: a test is no picture.
fn quick() -> ShadowFieldsSettings {
    ShadowFieldsSettings {
        rays: 256,
        shells: 14,
        directions: 12,
        spacing: 0.2,
        posts: 16,
        ..Default::default()
    }
}

fn render_at(
    text: &str,
    settings: ShadowFieldsSettings,
    time: f64,
    samples: u32,
) -> (Vec<Vec3>, RenderReport) {
    let scene = load(text);
    let mut technique = ShadowFields::new(settings);
    technique.prepare(&scene, &Quiet).unwrap();
    let [width, height] = scene.image().size;
    let mut film = Film::new(width as usize, height as usize);
    let budget = Budget { samples: Some(samples), ..Budget::default() };
    let report = technique.render(&scene.at(time).unwrap(), &mut film, &budget, &Quiet).unwrap();
    (film.image().pixels.into_iter().map(Vec3::from).collect(), report)
}

fn render(text: &str) -> Vec<Vec3> {
    render_at(text, quick(), 0.0, 1).0
}

fn path_traced(text: &str, time: f64, samples: u32) -> Vec<Vec3> {
    let scene = load(text);
    let [width, height] = scene.image().size;
    let mut film = Film::new(width as usize, height as usize);
    let path = Path::new(PathSettings { max_depth: 1, ..PathSettings::default() });
    let budget = Budget { samples: Some(samples), ..Budget::default() };
    path.render(&scene.at(time).unwrap(), &mut film, &budget, &Quiet).unwrap();
    film.image().pixels.into_iter().map(Vec3::from).collect()
}

/// Mean over the pixels of the absolute difference, by the mean of the truth.
fn relative(picture: &[Vec3], truth: &[Vec3]) -> f32 {
    let mean = truth.iter().map(|p| p.element_sum()).sum::<f32>();
    picture.iter().zip(truth).map(|(a, b)| (*a - *b).abs().element_sum()).sum::<f32>() / mean
}

#[test]
fn the_field_of_a_sphere_is_that_of_a_cap_at_every_distance() {
    let sphere = Sphere { center: Vec3::new(0.3, 0.1, -0.2), radius: 0.7 };
    with_caster(
        Geometry::Spheres(SphereTracer::build(vec![sphere])),
        Affine3A::IDENTITY,
        1024,
        |caster, _| {
            let field = field::<4>(caster);
            for (distance, most) in
                [(1.02, 0.13), (1.2, 0.05), (1.5, 0.035), (2.5, 0.018), (5.0, 6e-3), (20.0, 1e-3)]
            {
                let worst = directions(200)
                    .map(|d| {
                        let [hidden] = field.at(sphere.center + d * (0.7 * distance));
                        let cap = Zh::<4>::cap((1.0 / f64::from(distance)).asin()).to_direction(axes(-d));
                        rms(hidden - cap)
                    })
                    .fold(0.0, f32::max);
                eprintln!("{distance} radii: {worst:.4}");
                assert!(worst < most, "{distance} radii: {worst}");
            }
        },
    );
}

#[test]
fn a_turned_and_grown_object_has_the_turned_field() {
    let knot = || mesh(shapes::knot(2, 3, 0.4, 0.13, 48, 10));
    let turn = Mat3::from_quat(Quat::from_euler(glam::EulerRot::XYZ, 0.7, -1.9, 0.4));
    let place = Affine3A { matrix3: (turn * 2.5).into(), translation: glam::vec3a(3.0, -1.0, 2.0) };
    let still = with_caster(knot(), Affine3A::IDENTITY, 512, |caster, _| field::<4>(caster));
    let moved = with_caster(knot(), place, 512, |caster, _| field::<4>(caster));
    let mut sum = 0.0;
    for (i, d) in directions(100).enumerate() {
        let point = d * (0.7 + 0.02 * i as f32);
        let [there] = moved.at(place.transform_point3(point));
        let here = still.at(point)[0].rotated(&in_axes(&turn));
        sum += rms(there - here) / 100.0;
    }
    eprintln!("mean difference {sum:.4}");
    assert!(sum < 0.012, "{sum}");
}

#[test]
fn a_convex_body_hides_nothing_from_itself_and_a_step_hides_its_own_tread() {
    let own = |geometry: Geometry| {
        with_caster(geometry, Affine3A::IDENTITY, 512, |caster, parts| {
            Own::<4>::new(caster, &parts[0].0, &Affine3A::IDENTITY, 0.2)
        })
    };
    let hit = |primitive, u, v| halflight_trace::Hit { t: 1.0, instance: 0, primitive, u, v };
    let cube = own(mesh(shapes::cuboid(Vec3::ONE)));
    for primitive in 0..12 {
        for (u, v) in [(0.0, 0.0), (0.3, 0.3), (1.0, 0.0), (0.0, 1.0), (0.5, 0.5), (0.9, 0.05)] {
            assert_eq!(
                cube.at(&hit(primitive, u, v), Vec3::Y, true),
                Some(Sh::zero()),
                "{primitive} {u} {v}"
            );
        }
    }
    // A floor and a wall at its border x = 0: near the wall half of the floor's sky is hidden.
    let step = TriangleMesh {
        positions: vec![
            Vec3::new(0.0, 0.0, -9.0),
            Vec3::new(0.0, 0.0, 9.0),
            Vec3::new(9.0, 0.0, 0.0),
            Vec3::new(0.0, 9.0, 0.0),
        ],
        triangles: vec![[0, 1, 2], [0, 3, 1]],
        ..TriangleMesh::default()
    };
    let step = own(mesh(step));
    let seen = |u: f32| {
        let hidden = step.at(&hit(0, 0.5 - 0.5 * u, u), Vec3::Y, true).unwrap();
        let cosine = Zh::<4>::clamped_cosine().to_direction(axes(Vec3::Y));
        1.0 - hidden.dot(&cosine) / std::f32::consts::PI
    };
    assert!((seen(0.02) - 0.5).abs() < 0.06, "{}", seen(0.02));
    assert!(seen(0.6) > 0.85, "{}", seen(0.6));
}

#[test]
fn flat_shapes_hide_what_rays_say() {
    let table = FlatTable::<4>::new();
    let place =
        Rectangle::transform(Vec3::new(0.2, -0.3, 0.1), Vec3::new(1.0, 0.4, 0.0), Vec3::new(-0.1, 0.5, 1.3));
    for is_disk in [false, true] {
        let geometry =
            if is_disk { Geometry::Disk(halflight_trace::Disk) } else { Geometry::Rectangle(Rectangle) };
        let flat = Flat::new(place, is_disk).unwrap();
        let (mut worst, mut sum) = (0.0f32, 0.0);
        with_caster(geometry, place, 16384, |caster, _| {
            for (i, d) in directions(120).enumerate() {
                let point = caster.center + d * caster.radius * (0.05 + 0.05 * i as f32);
                let difference = rms(flat.hidden(&table, point) - caster.hidden::<4>(point));
                worst = worst.max(difference);
                sum += difference / 120.0;
            }
        });
        eprintln!("disk {is_disk}: mean {sum:.4}, worst {worst:.4}");
        assert!(sum < 2e-3 && worst < 0.03, "{is_disk} {sum} {worst}");
    }
}

/// A floor seen from above, a lamp of radiance 10 at height 1.
fn lamp_over_floor(radius: f32, more: &str) -> String {
    format!(
        "environment = \"black\"
        [image]
        size = [48, 48]
        [camera]
        origin = [0, 3, 0]
        target = [0, 0, 0]
        up = [0, 0, -1]
        vertical_fov_degrees = 60
        [[shape]]
        type = \"plane\"
        material = {{ type = \"diffuse\", albedo = 0.5 }}
        [[light]]
        type = \"sphere\"
        position = [0, 1, 0]
        radius = {radius}
        radiance = 10
        {more}"
    )
}

/// A ball as a shape.
fn shape_ball(at: [f32; 3], radius: f32) -> String {
    format!(
        "[[shape]]\ntype = \"sphere\"\nradius = {radius}\nmaterial = {{ type = \"diffuse\", albedo = 0.5 }}\n\
         transform = {{ translate = {at:?} }}\n"
    )
}

#[test]
fn a_lamp_lights_a_floor_by_its_form_factor() {
    // The cosine itself is 6 % too bright overhead in four bands, 3 % too dark in six.
    for (order, most) in [(4, 0.06), (6, 0.04)] {
        let settings = ShadowFieldsSettings { order, ..quick() };
        let (picture, _) = render_at(&lamp_over_floor(0.1, ""), settings, 0.0, 1);
        let (mut sum, mut truth_sum) = (0.0, 0.0);
        for (i, pixel) in picture.iter().enumerate() {
            let at = |i: usize| ((i as f32 + 0.5) / 48.0 * 2.0 - 1.0) * 3.0 * 30f32.to_radians().tan();
            let across = at(i % 48).hypot(at(i / 48));
            // The lamp hides the floor below it from the eye.
            if across < 0.3 {
                continue;
            }
            let squared = 1.0 + across * across;
            // E = πL (r/d)² cos for a sphere wholly above the horizon.
            let truth = 0.5 * 10.0 * 0.01 / squared * (1.0 / squared.sqrt());
            sum += (pixel.x - truth).abs();
            truth_sum += truth;
        }
        eprintln!("order {order}: mean {:.4}", sum / truth_sum);
        assert!(sum / truth_sum < most, "{order}: {}", sum / truth_sum);
    }
}

#[test]
fn what_stands_before_a_lamp_hides_it_and_what_stands_behind_it_does_not() {
    let lamp = 0.5;
    let open = render(&lamp_over_floor(lamp, ""));
    let before = lamp_over_floor(lamp, &shape_ball([0.6, 0.25, 0.0], 0.2));
    let (shown, truth) = (render(&before), path_traced(&before, 0.0, 64));
    // On the floor around the ball, which the lamp does not hide from the eye.
    let floor = |i: &usize| {
        let at = |i: usize| ((i as f32 + 0.5) / 48.0 * 2.0 - 1.0) * 3.0 * 30f32.to_radians().tan();
        (0.95..1.4).contains(&at(i % 48)) && at(i / 48).abs() < 0.5
    };
    let within = |p: &[Vec3]| (0..p.len()).filter(floor).map(|i| p[i]).collect::<Vec<_>>();
    let error = relative(&within(&shown), &within(&truth));
    let without = relative(&within(&open), &within(&truth));
    eprintln!("in the shadow of a ball: {error:.3}, without shadows {without:.3}");
    assert!(error < 0.5 * without, "{error} {without}");
    // Seen from the floor, a ball above the lamp is farther; it hides some floor from the eye.
    let behind = render(&lamp_over_floor(lamp, &shape_ball([0.0, 1.9, 0.0], 0.1)));
    for (i, (a, b)) in open.iter().zip(&behind).enumerate() {
        let off_middle = (i as i32 % 48 - 24).abs().max((i as i32 / 48 - 24).abs());
        if off_middle > 14 {
            assert_eq!(a, b, "{i}");
        }
    }
}

/// Two balls, a knot and a box over a floor under a light of four bands; everything times `scale`.
fn still(scale: f32, turned: bool) -> String {
    let ball = |at: Vec3, r: f32| shape_ball((at * scale).to_array(), r * scale);
    let balls = [ball(Vec3::new(-0.5, 0.3, 0.2), 0.3), ball(Vec3::new(0.1, 0.25, 0.6), 0.25)];
    let [first, second] = if turned { [&balls[1], &balls[0]] } else { [&balls[0], &balls[1]] };
    format!(
        "[environment]
        type = \"studio\"
        bands = 4
        [image]
        size = [64, 48]
        [camera]
        origin = [{o0}, {o1}, {o2}]
        target = [0, {t}, 0]
        vertical_fov_degrees = 34
        [[shape]]
        type = \"plane\"
        half_extent = {e}
        material = {{ type = \"diffuse\", albedo = 0.5 }}
        {first}{second}
        [[shape]]
        type = \"generated\"
        mesh = \"knot\"
        radius = 0.3
        tube = 0.1
        detail = 96
        material = {{ type = \"diffuse\", albedo = 0.6 }}
        transform = {{ translate = [{k0}, {k1}, 0], scale = {scale} }}
        [[shape]]
        type = \"box\"
        size = [0.4, 0.8, 0.4]
        material = {{ type = \"phong\", diffuse = 0.4, specular = 0.3, exponent = 6 }}
        transform = {{ translate = [0, 0, {b}], scale = {scale}, rotate_degrees = [0, 30, 0] }}",
        o0 = 0.4 * scale,
        o1 = 1.6 * scale,
        o2 = 3.2 * scale,
        t = 0.3 * scale,
        e = 10.0 * scale,
        k0 = 0.7 * scale,
        k1 = 0.5 * scale,
        b = -0.7 * scale,
    )
}

#[test]
fn a_scene_under_a_light_of_four_bands_is_near_the_path_tracer() {
    let text = still(1.0, false);
    let settings = ShadowFieldsSettings { rays: 512, spacing: 0.12, ..quick() };
    let (shown, report) = render_at(&text, settings, 0.0, 8);
    let error = relative(&shown, &path_traced(&text, 0.0, 256));
    eprintln!("mean relative error {error:.4}; {:?}", report.notes);
    assert_eq!(report.non_finite, 0);
    assert!(error < 0.04, "{error}");
}

#[test]
fn what_is_nearer_comes_first_wherever_it_stands_in_the_scene_file() {
    assert_eq!(render(&still(1.0, false)), render(&still(1.0, true)));
}

#[test]
fn a_scene_of_another_size_looks_the_same() {
    let error = relative(&render(&still(7.0, false)), &render(&still(1.0, false)));
    assert!(error < 2e-3, "{error}");
}

#[test]
fn the_number_of_threads_does_not_change_a_bit() {
    let text = still(1.0, false);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| render(&text))
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn moving_objects_keep_their_fields_and_take_their_shadows_along() {
    let text = |keys: &str| {
        format!(
            "environment = \"#ffffff\"
            [image]
            size = [48, 36]
            [camera]
            origin = [0, 2, 3]
            target = [0, 0.3, 0]
            [[shape]]
            type = \"plane\"
            material = {{ type = \"diffuse\", albedo = 0.5 }}
            [[shape]]
            type = \"box\"
            size = [0.3, 1, 0.5]
            material = {{ type = \"diffuse\", albedo = 0.5 }}
            {keys}"
        )
    };
    let moving = text(
        "keyframes = [{ time = 0, translate = [-3, 0, 0] }, \
         { time = 1, translate = [0.2, 0.2, 0], rotate_degrees = [0, 70, 20], scale = 0.8 }]",
    );
    let there = text("transform = { translate = [0.2, 0.2, 0], rotate_degrees = [0, 70, 20], scale = 0.8 }");
    let (moved, report) = render_at(&moving, quick(), 1.0, 1);
    let error = relative(&moved, &render(&there));
    assert!(error < 6e-3, "{error}");
    assert!(!report.notes.iter().any(|note| note.contains("deform")), "{:?}", report.notes);
}

#[test]
fn empty_scenes_and_points_within_the_innermost_shell_are_sound() {
    let empty = render(
        "environment = \"#808080\"\n[image]\nsize = [8, 8]\n[camera]\norigin = [0, 0, 1]\ntarget = [0, 0, 0]",
    );
    assert!(empty.iter().all(|p| p.is_finite() && p.x > 0.0));
    let torus = "environment = \"#808080\"
        [image]
        size = [24, 24]
        [camera]
        origin = [0, 1.5, 1.5]
        target = [0, 0, 0]
        [[shape]]
        type = \"generated\"
        mesh = \"torus\"
        radius = 2
        tube = 0.3
        [[shape]]
        type = \"sphere\"
        radius = 0.1";
    let (picture, report) = render_at(torus, quick(), 0.0, 1);
    assert!(picture.iter().all(|p| p.is_finite()) && report.non_finite == 0);
    assert!(report.notes.iter().any(|note| note.contains("within the ball")), "{:?}", report.notes);
    let mut technique = ShadowFields::new(quick());
    let dark = load("environment = \"black\"\n[[shape]]\ntype = \"sphere\"");
    let mut film = Film::new(4, 4);
    assert!(technique.render(&dark.at(0.0).unwrap(), &mut film, &Budget::default(), &Quiet).is_err());
    technique.prepare(&dark, &Quiet).unwrap();
    let error = technique.render(&dark.at(0.0).unwrap(), &mut film, &Budget::default(), &Quiet);
    assert!(error.is_err_and(|error| error.reason.contains("neither an environment nor shining objects")));
}

#[test]
fn a_height_field_shades_itself_and_what_stands_on_it() {
    let text = "environment = \"#ffffff\"
        [image]
        size = [48, 36]
        [camera]
        origin = [0, 5, 7]
        target = [0, 0.3, 0]
        [[shape]]
        type = \"height-field\"
        heights = { type = \"fractal\", seed = 3, amplitude = 1.5 }
        extent = [8, 8]
        posts = [64, 64]
        material = { type = \"diffuse\", albedo = 0.5 }
        [[shape]]
        type = \"sphere\"
        radius = 0.6
        center = [0.5, 1.5, 0.5]
        material = { type = \"diffuse\", albedo = 0.5 }";
    let settings = ShadowFieldsSettings { posts: 32, ..quick() };
    let error = relative(&render_at(text, settings, 0.0, 4).0, &path_traced(text, 0.0, 64));
    eprintln!("mean relative error {error:.4}");
    assert!(error < 0.06, "{error}");
}

#[test]
fn what_is_prepared_has_the_memory_that_the_documentation_says() {
    let settings = ShadowFieldsSettings { rays: 16, ..ShadowFieldsSettings::default() };
    let sphere = Geometry::Spheres(SphereTracer::build(vec![Sphere { center: Vec3::ZERO, radius: 1.0 }]));
    let entity = with_caster(sphere, Affine3A::IDENTITY, 16, |caster, parts| {
        Entity::<4>::new(caster, parts, None, &settings)
    });
    assert_eq!(entity.occlusion.memory_bytes(), 16 * 17 * 17 * 16 * 4);
}
