#![allow(clippy::unwrap_used)]

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
        let pilots = Pilots { integrator: Integrator::new(&frame, settings), axes: &axes, carry: true };
        let camera = CameraSampler::new(&frame, 48, 32, 0);
        let path = picture(&Path::new(PathSettings::default()), &frame, 1, 0).image();
        for (x, y) in [(3, 3), (10, 20), (24, 16), (30, 25), (40, 18), (16, 15)] {
            let (ray, mut sampler) = camera.ray(x, y, 0);
            let mut found = Found::default();
            let radiance = pilots.trace(ray, &mut sampler, &mut found, None);
            assert_eq!(radiance.to_array(), path.pixels[y * 48 + x], "{x} {y}");
            let forecast = forecast(&found.covariance.covariance(), &axes);
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
    for name in
        ["predicted-density", "measured-density", "density-disagreement", "filter.wide", "filter.scale"]
    {
        let layer = &together.layers[name];
        assert!(layer.iter().all(|v| v.is_finite()), "{name}");
    }
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
