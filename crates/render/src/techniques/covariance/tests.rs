#![allow(clippy::unwrap_used)]

use glam::{Vec2, Vec3};
use halflight_scene::{LoadOptions, Scene};

use super::*;
use crate::technique::Quiet;
use crate::techniques::path::{Path, PathSettings};

/// A checkered row behind a wide lens, one ball in motion, fog.
const SCENE: &str = r#"
[image]
size = [48, 32]
[camera]
origin = [0, 1, 4]
target = [0, 0.3, 0]
vertical_fov_degrees = 35
aperture_radius = 0.08
focus_distance = 4
shutter = [0, 0.2]
[environment]
type = "constant"
color = [0.4, 0.5, 0.7]
[[light]]
type = "rectangle"
position = [2, 4, 2]
target = [0, 0, 0]
size = [2, 2]
radiance = 5
[material.metal]
type = "conductor"
color = [0.9, 0.7, 0.3]
roughness = 0.3
[material.glass]
type = "dielectric"
ior = 1.5
[[shape]]
type = "plane"
y = 0
half_extent = 6
[[shape]]
type = "spheres"
spheres = [[-0.8, 0.4, 0.2, 0.4]]
material = "glass"
[[shape]]
type = "sphere"
center = [0.6, 0.4, 1.5]
radius = 0.4
material = "metal"
[[shape]]
type = "box"
transform = { scale = 0.5, translate = [0.2, 0.3, -2] }
keyframes = [{ time = 0, translate = [0, 0, 0] }, { time = 1, translate = [2, 0, 0] }]
"#;

pub(super) fn frame(text: &str) -> Frame {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).unwrap();
    Scene::load(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}")).at(0.0).unwrap()
}

fn picture(technique: &dyn Technique, frame: &Frame, samples: u32, seed: u64) -> Film {
    let mut film = Film::new(48, 32);
    let budget = Budget { samples: Some(samples), seed, ..Budget::default() };
    technique.render(frame, &mut film, &budget, &Quiet).unwrap();
    film
}

pub(super) fn relative_mse(film: &Film, truth: &Film) -> f64 {
    let (a, b) = (film.image().pixels, truth.image().pixels);
    let error = a.iter().zip(&b).flat_map(|(a, b)| (0..3).map(move |c| (f64::from(a[c]), f64::from(b[c]))));
    error.map(|(x, r)| (x - r) * (x - r) / (r * r + 0.01)).sum::<f64>() / (3 * a.len()) as f64
}

#[test]
fn pilots_bring_what_paths_bring() {
    let fog = "[[medium]]\nscattering = 0.1\nabsorption = 0.05\nanisotropy = 0.5\n";
    for text in [SCENE.to_owned(), format!("{SCENE}{fog}")] {
        let frame = frame(&text);
        let axes = FilmAxes::new(&frame, 48, 32);
        let settings = CovarianceSettings::default().of_paths();
        let (integrator, lamps) = (Integrator::new(&frame, settings), Lamps::new(&frame));
        let pilots = Pilots { integrator, axes: &axes, lamps: &lamps, carry: true };
        let camera = CameraSampler::new(&frame, 48, 32, 0);
        let path = picture(&Path::new(PathSettings::default()), &frame, 1, 0).image();
        for (x, y) in [(3, 3), (10, 20), (24, 16), (30, 25), (40, 18), (16, 15)] {
            let (ray, mut sampler) = camera.ray(x, y, 0);
            let (mut found, mut group) = (Found::default(), Group::default());
            let radiance = pilots.trace(ray, &mut sampler, &mut group, None);
            pilots.walk(&mut group, &mut found);
            assert_eq!(radiance.to_array(), path.pixels[y * 48 + x], "{x} {y}");
            let forecast = forecast(&found, &halflight_frequency::covariance::Covariance5::ZERO, &axes);
            assert!(forecast.precision.iter().all(|s| s.is_finite()));
            assert!((0.0..=1.0).contains(&forecast.varies), "{}", forecast.varies);
        }
    }
}

#[test]
fn many_samples_go_to_the_truth_and_few_are_nearer_to_it_than_those_of_path() {
    let frame = frame(SCENE);
    let truth = picture(&Path::default(), &frame, 2048, 99);
    let error = |samples: u32| relative_mse(&picture(&Covariance::default(), &frame, samples, 1), &truth);
    let of_path = |samples: u32| relative_mse(&picture(&Path::default(), &frame, samples, 1), &truth);
    let (few, more, many) = (error(16), error(64), error(512));
    println!("covariance {few} {more} {many}, path {} {} {}", of_path(16), of_path(64), of_path(512));
    assert!(few < of_path(16), "{few}");
    assert!(more < 0.6 * few && many < 0.4 * more, "{few} {more} {many}");
}

#[test]
fn a_picture_does_not_depend_on_threads_and_has_its_maps() {
    let frame = frame(SCENE);
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let alone = one.install(|| picture(&Covariance::default(), &frame, 8, 3));
    let together = picture(&Covariance::default(), &frame, 8, 3);
    assert_eq!(alone, together);
    for name in [
        "predicted-density",
        "measured-density",
        "density-disagreement",
        "filter.wide",
        "filter.scale",
        "light-density",
    ] {
        let layer = &together.layers[name];
        assert!(layer.iter().all(|v| v.is_finite()), "{name}");
    }
    // Out of focus the lens asks for samples, and in motion the shutter.
    let most = |name: &str| together.layers[name].iter().copied().fold(0.0, f32::max);
    assert!(
        most("lens-density") > 2.0 && most("shutter-density") > 1.2,
        "{} {}",
        most("lens-density"),
        most("shutter-density")
    );
    let least = |name: &str| together.layers[name].iter().copied().fold(9.0, f32::min);
    assert!(least("lens-density") >= 1.0 && least("shutter-density") >= 1.0 && least("light-density") >= 1.0);
    assert!((together.mean_samples() - 8.0).abs() < 0.5, "{}", together.mean_samples());
}

#[test]
fn what_is_out_of_focus_or_moves_may_be_filtered_and_what_is_sharp_may_not() {
    let text = SCENE.replace("center = [0.6, 0.4, 1.5]", "center = [0.6, 0.4, 2.6]");
    let frame = frame(&text);
    let film = picture(&Covariance::default(), &frame, 4, 0);
    let explained = Covariance::default().explain(&frame, [48, 32], [24, 16]).unwrap();
    assert!(explained.text.contains("film") && !explained.steps.events.is_empty());
    assert!(Covariance::default().explain(&frame, [48, 32], [48, 0]).is_none());
    assert!(film.layers["filter.wide"].iter().any(|w| *w > 1.0));
}

/// A sharp map of the sky over a floor of tiles, seen through a lens, beside frosted glass.
const EVENTS: &str = r#"
[camera]
origin = [0, 1, 4]
target = [0, 0.2, 0]
vertical_fov_degrees = 35
aperture_radius = 0.05
focus_distance = 4
[environment]
type = "sky"
[[light]]
type = "rectangle"
position = [0, 3, 1]
target = [0, 0, 0]
size = [1, 1]
radiance = 8
[[light]]
type = "sphere"
position = [1, 2, 0]
radius = 0.1
radiance = 80
[material.frosted]
type = "dielectric"
roughness = 0.4
[[shape]]
type = "plane"
half_extent = 6
material = "floor"
[[shape]]
type = "box"
transform = { scale = [0.7, 0.7, 0.1], translate = [-0.4, 0.4, 0.5] }
material = "frosted"
"#;

#[test]
fn explanations_name_what_a_path_meets_and_lights_as_large_as_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tiles.png");
    let tiles = halflight_image::RgbImage::from_fn(64, 64, |x, y| {
        if (x / 4 + y / 4) % 2 == 0 { [0.8, 0.7, 0.6] } else { [0.1, 0.1, 0.2] }
    });
    halflight_image::save_png(&path, &tiles, &halflight_image::ToneMapping::default()).unwrap();
    let text = format!(
        "{EVENTS}[material.floor]\ntype = \"diffuse\"\nalbedo = {{ file = {path:?}, repeat = [8, 8] }}\n"
    );
    let frame = frame(&text);
    let covariance = Covariance::default();
    let mut all = String::new();
    for x in (0..48).step_by(4) {
        for y in (0..32).step_by(4) {
            let explained = covariance.explain(&frame, [48, 32], [x, y]).unwrap();
            for event in &explained.steps.events {
                assert!(event.covariance.is_positive_semidefinite(1e-6), "{x} {y}: {}", event.name);
            }
            all += &explained.text;
        }
    }
    for event in ["texture of floor", "cosine", "lens, focused at", "rough refraction by frosted", "the sky,"]
    {
        assert!(all.contains(event), "{event}");
    }
    // Both lamps are some 2 m away at the least: 1 m² or 0.03 m² of them.
    let sizes: Vec<f32> = all
        .lines()
        .filter_map(|line| line.strip_prefix("light: ")?.split(" sr").next()?.parse().ok())
        .collect();
    assert!(sizes.len() > 3 && sizes.iter().all(|size| *size < 0.4), "{sizes:?}");
}

#[test]
fn lamps_are_as_large_as_they_are_seen_and_a_sharp_map_has_a_sharp_spectrum() {
    let frame = frame(EVENTS.replace("material = \"floor\"", "").as_str());
    let lamps = Lamps::new(&frame);
    let (from, time) = (Vec3::new(0.2, 0.0, 0.3), 0.0);
    for k in 0..64 {
        let u = Vec2::new((k as f32 * 0.618_034).fract(), (k as f32 + 0.5) / 64.0);
        let Some((sample, Some((emitter, uv)))) =
            frame.lights.sample_on(from, (k as f32 * 0.754_877_7).fract(), u, time)
        else {
            continue;
        };
        let halflight_scene::lights::Arrival::From { point: Some(point), .. } = sample.arrival else {
            continue;
        };
        let found = lamps.of_sample(emitter, uv, from, point, time);
        let lamp = &frame.lights.emitters()[emitter as usize];
        // Of the ball exactly; of the square as seen from its middle.
        let way = lamp.center() - from;
        let expected = match &lamp.shape {
            halflight_scene::lights::EmitterShape::Sphere { .. } => {
                std::f32::consts::TAU * (1.0 - (1.0 - 0.01 / way.length_squared()).sqrt())
            }
            _ => {
                lamp.area() * Vec3::new(0.0, 3.0, 1.0).normalize().dot(way.normalize()) / way.length_squared()
            }
        };
        assert!((found / expected - 1.0).abs() < 0.1, "{found} for {expected}");
    }
    // About the sun the map is sharper than opposite to it.
    let towards_sun = {
        let brightest = (0..4000).map(|k| {
            let u = Vec2::new((k as f32 * 0.618_034).fract(), (k as f32 + 0.5) / 4000.0);
            halflight_scene::sampling::uniform_sphere(u)
        });
        let light = |d: &Vec3| frame.lights.escaped(*d).element_sum();
        brightest.max_by(|a, b| light(a).total_cmp(&light(b))).unwrap()
    };
    let away = Vec3::new(-towards_sun.x, towards_sun.y, -towards_sun.z);
    let (sharp, smooth) = (lamps.sky(towards_sun).bandwidth, lamps.sky(away).bandwidth);
    assert!(sharp > 2.0 * smooth, "{sharp} {smooth}");
}

#[test]
fn the_lens_and_then_a_film_far_away_are_the_camera() {
    let frame = frame(SCENE);
    let axes = FilmAxes::new(&frame, 48, 32);
    let direction = axes.direction(30, 20);
    let light =
        halflight_frequency::covariance::Covariance5::of_window([0.3, 0.2, 0.05, 0.07, 0.4]).travel(2.7);
    let film = axes.film(direction, &light);
    // What comes from a point in focus has no lens to vary over.
    let point = halflight_frequency::covariance::Covariance5::of_window([
        1e-4,
        1e-4,
        f64::INFINITY,
        f64::INFINITY,
        f64::INFINITY,
    ]);
    let (_, focus) = axes.lens(direction, &point).unwrap();
    let focused = axes.film(direction, &point.travel(focus));
    assert!(focused.rows[2][2] < 1e-9 * focused.rows[0][0].max(1.0) && film.rows[2][2] > 0.0, "{focused:?}");
}
