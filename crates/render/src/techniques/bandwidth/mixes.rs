//! Two materials on one surface: shaded as finely as they are, and mixed after shading.
#![allow(clippy::unwrap_used)]

use halflight_image::{RgbImage, metrics};
use halflight_scene::{LoadOptions, Scene};

use super::tests::{picture, truth, worst_block};
use super::*;

const CHECKERED: &str = r#"
[image]
size = [96, 64]
[camera]
origin = [0, 1.2, 3]
target = [0, 0.4, 0]
vertical_fov_degrees = 40
[environment]
type = "studio"
[material.dull]
type = "phong"
diffuse = [0.05, 0.1, 0.2]
specular = [0.05, 0.05, 0.05]
exponent = 30
[material.shiny]
type = "conductor"
color = [0.9, 0.7, 0.3]
roughness = 0.4
[material.marble]
type = "diffuse"
albedo = { file = "checker.png", repeat = [7, 3], factor = 0.7 }
[material.both]
type = "mix"
first = "dull"
second = "SECOND"
mask = { file = "checker.png", repeat = [5, 3] }
[[shape]]
type = "plane"
half_extent = 4
material = "both"
[[shape]]
type = "sphere"
center = [0, 0.6, 0]
radius = 0.6
material = "both"
"#;

fn checkered(text: &str) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    // A soft line between the squares: there both are seen.
    let checker = RgbImage::from_fn(64, 64, |x, y| {
        let at = |i: usize| ((i as f32 + 0.5) / 64.0 * std::f32::consts::TAU).sin();
        [(0.5 + 4.0 * at(x) * at(y)).clamp(0.0, 1.0); 3]
    });
    halflight_image::save_png(&folder.path().join("checker.png"), &checker, &Default::default()).unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).unwrap();
    Scene::load(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn shaded(report: &RenderReport) -> f64 {
    report.notes[1].split(' ').nth(1).unwrap().parse().unwrap()
}

#[test]
fn a_checker_of_two_materials_is_shaded_as_finely_as_they_are_and_agrees_with_the_truth() {
    let lamp = "\n[[light]]\ntype = \"rectangle\"\nposition = [1, 3, 2]\ntarget = [0, 0, 0]\nradiance = 8\n";
    let (plain, convolved) = (Mode::Plain, Mode::Preconvolved);
    let cases = [
        ("shiny", "", &[plain, convolved] as &[_]),
        ("marble", "", &[convolved]),
        ("shiny", lamp, &[convolved]),
    ];
    for (second, light, modes) in cases {
        let text = CHECKERED.replace("SECOND", second) + light;
        let scene = checkered(&text);
        let truth = truth(&scene);
        let alone = |material: &str| {
            let text = text.replace("material = \"both\"", &format!("material = \"{material}\""));
            shaded(&picture(&checkered(&text), BandwidthSettings::default()).1)
        };
        let most = alone("dull").max(alone(second));
        for &mode in modes {
            let (image, report) = picture(&scene, BandwidthSettings { mode, ..BandwidthSettings::default() });
            let psnr = metrics::psnr(&image, &truth, 0.0).unwrap();
            let block = worst_block(&image, &truth);
            eprintln!(
                "{second} {mode:?} {psnr:.1} dB, worst block {block:.3}, alone {most} %; {:?}",
                report.notes
            );
            assert!(psnr > 33.0 && block < 0.06, "{second} {mode:?}: {psnr} dB, {block}");
            assert!(shaded(&report) < 1.25 * most, "{:?}, {most} % alone", report.notes);
            assert_eq!(report.non_finite, 0);
        }
    }
}

#[test]
fn what_is_not_taken_apart_is_shaded_as_its_pictures_vary_and_agrees_too() {
    // Three materials, and a mirror's delta function among them.
    let more = "[material.three]\ntype = \"mix\"\nfirst = \"both\"\nsecond = { type = \"mirror\", color = 0.5 }\n\
        mask = { file = \"checker.png\", factor = 0.4 }\n[[shape]]\ntype = \"sphere\"\nmaterial = \"three\"\n\
        center = [1.1, 0.4, 0.3]\nradius = 0.4\n";
    let scene = checkered(&(CHECKERED.replace("SECOND", "shiny") + more));
    let truth = truth(&scene);
    for mode in [Mode::Plain, Mode::Preconvolved] {
        let (image, report) = picture(&scene, BandwidthSettings { mode, ..BandwidthSettings::default() });
        let psnr = metrics::psnr(&image, &truth, 0.0).unwrap();
        eprintln!("{mode:?} {psnr:.1} dB; {:?}", report.notes);
        assert!(psnr > 30.0 && report.non_finite == 0, "{mode:?}: {psnr} dB");
    }
}
