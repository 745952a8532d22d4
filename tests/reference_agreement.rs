//! The path tracer agrees with another renderer on scenes described independently of both.
//!
//! The pictures in `../shared/reference` were made by Mitsuba 3 and confirmed by Blender Cycles. Agreement means: mean
//! radiance within 0.5 % in every channel, and a relMSE below 1e-3 when the reference's own noise is subtracted.

use std::path::{Path, PathBuf};

use halflight::image::{RgbImage, load_rgb, metrics};
use halflight::render::techniques::path::{Path as PathTracer, PathSettings};
use halflight::{Budget, Film, LoadOptions, Quiet, Scene, Technique};

fn folder(relative: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(relative)
}

fn render(scene: &str, size: Option<[u32; 2]>, max_depth: u32, samples: u32) -> RgbImage {
    let options = LoadOptions { size, ..LoadOptions::default() };
    let scene =
        Scene::load(&folder("tests/reference").join(scene), &options).unwrap_or_else(|e| panic!("{e}"));
    let frame = scene.at(0.0).expect("nothing in these scenes can be missing");
    let [width, height] = scene.image().size.map(|side| side as usize);
    let mut film = Film::new(width, height);
    let settings = PathSettings { max_depth, roulette_depth: 1000, ..PathSettings::default() };
    let budget = Budget { samples: Some(samples), ..Budget::default() };
    let report =
        PathTracer::new(settings).render(&frame, &mut film, &budget, &Quiet).expect("path shows any scene");
    assert_eq!(report.non_finite, 0);
    film.image()
}

/// The reference picture, or `None` with a word where it is not there.
fn reference(relative: &str) -> Option<RgbImage> {
    let path = folder("../shared").join(relative);
    if !path.exists() {
        eprintln!("skipped: there is no {}", path.display());
        return None;
    }
    Some(load_rgb(&path).unwrap_or_else(|e| panic!("{e}")))
}

fn largest_mean_error(image: &RgbImage, reference: &RgbImage) -> f64 {
    let ((ours, _), (theirs, _)) = (metrics::mean_rgb(image), metrics::mean_rgb(reference));
    ours.iter().zip(theirs).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max)
}

fn agrees(scene: &str, picture: &str, max_depth: u32, samples: u32, noise: f64) {
    let Some(reference) = reference(&format!("reference/{picture}.exr")) else { return };
    let image = render(scene, None, max_depth, samples);
    let mean_error = largest_mean_error(&image, &reference);
    let relative_mse = metrics::relative_mse(&image, &reference).expect("pictures of one size") - noise;
    println!(
        "{picture}: mean radiance within {:.3} %, relMSE {relative_mse:.2e} beyond the reference's noise",
        100.0 * mean_error
    );
    assert!(mean_error < 0.005, "{picture}: mean radiance differs by {mean_error}");
    assert!(relative_mse < 1e-3, "{picture}: relMSE {relative_mse}");
}

#[test]
fn the_bunny_under_the_sky_agrees_in_direct_light() {
    agrees("bunny_diffuse.toml", "bunny_diffuse.direct", 1, 128, 1.0e-4);
}

#[test]
fn the_bunny_under_the_sky_agrees_in_seven_scatterings() {
    agrees("bunny_diffuse.toml", "bunny_diffuse.path8", 7, 128, 9.5e-5);
}

#[test]
fn the_bunny_of_measured_paint_agrees_in_direct_light() {
    agrees("bunny_merlfile.toml", "bunny_merlfile.direct", 1, 128, 3.8e-4);
}

#[test]
fn the_height_field_with_spheres_agrees_in_direct_light() {
    agrees("hf25_coneman.toml", "hf25_coneman.direct", 1, 32, 3.2e-5);
}

#[test]
fn the_row_behind_a_lens_agrees_in_direct_light() {
    agrees("dof_row.toml", "dof_row.direct", 1, 128, 1.8e-4);
}

/// Rendered smaller, as only the mean is compared: the reference has another pixel filter.
#[test]
fn the_cornell_box_agrees_in_mean_radiance() {
    let Some(reference) = reference("data/scenes/cornell-box/TungstenRender.exr") else { return };
    let image = render("cornell_box.toml", Some([256, 256]), 64, 64);
    let mean_error = largest_mean_error(&image, &reference);
    println!("cornell-box: mean radiance within {:.3} %", 100.0 * mean_error);
    assert!(mean_error < 0.01, "mean radiance differs by {mean_error}");
}
