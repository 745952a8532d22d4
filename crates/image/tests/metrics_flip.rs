//! FLIP agrees with its authors' package.
//!
//! The package's numbers come from `tools/peers/flip.py`, which says how to run it and prints the lines below
//! (`flip-evaluator` 1.7). Two pairs are made of formulas; the others need the shared data.

use std::path::PathBuf;

use halflight_image::metrics::{ExposureRange, Flip, FlipMap, flip, hdr_flip};
use halflight_image::{RgbImage, load_rgb};

/// What the package gave for one pair.
struct Package {
    exposure_ev: f32,
    ldr: f64,
    hdr: f64,
    exposures: ExposureRange,
}

const fn package(exposure_ev: f32, ldr: f64, hdr: f64, start_ev: f32, stop_ev: f32, count: usize) -> Package {
    Package { exposure_ev, ldr, hdr, exposures: ExposureRange { start_ev, stop_ev, count } }
}

/// How far the means may be apart. Measured: at most 1e-4.
const TOLERANCE: f64 = 1e-3;

const RINGS_NOISY: Package = package(-1.0, 0.131735, 0.148936, -3.5988, 1.5600, 6);
const BARS_SHIFTED: Package = package(0.0, 0.252000, 0.233228, 0.9134, 4.4052, 4);
const CORNELL: Package = package(0.0, 0.036758, 0.084004, -2.5589, 5.0676, 8);
const BUNNY_DEPTH: Package = package(0.0, 0.086892, 0.079209, 1.3624, 2.5022, 2);
const BUNNY_MATERIAL: Package = package(1.0, 0.199625, 0.199989, 1.3624, 2.5022, 2);
const CONEMAN_CROP_NOISY: Package = package(0.5, 0.244583, 0.138306, 1.1568, 1.8934, 2);
const DOF_SHIFTED: Package = package(0.0, 0.020350, 0.018703, 1.4308, 2.4784, 2);
const BIDIR_DARKER: Package = package(2.0, 0.130370, 0.138454, -6.4007, 4.0725, 11);

/// Compares one pair both ways.
fn check(name: &str, package: &Package, image: &RgbImage, reference: &RgbImage) {
    let range = ExposureRange::of(reference);
    assert!((range.start_ev - package.exposures.start_ev).abs() < 1e-3, "{name}: {range:?}");
    assert!((range.stop_ev - package.exposures.stop_ev).abs() < 1e-3, "{name}: {range:?}");
    assert_eq!(range.count, package.exposures.count, "{name}");
    let ldr = flip(image, reference, package.exposure_ev).expect("one size").mean;
    let hdr = hdr_flip(image, reference).expect("one size").mean;
    eprintln!("{name}: LDR {ldr:.6} ({:+.1e}), HDR {hdr:.6} ({:+.1e})", ldr - package.ldr, hdr - package.hdr);
    assert!((ldr - package.ldr).abs() < TOLERANCE, "{name}: LDR {ldr}, the package gives {}", package.ldr);
    assert!((hdr - package.hdr).abs() < TOLERANCE, "{name}: HDR {hdr}, the package gives {}", package.hdr);
}

/// A picture of the shared data, if that is there.
fn shared(path: &str) -> Option<RgbImage> {
    let path = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared")).join(path);
    if !path.exists() {
        eprintln!("skipped: {} is not there", path.display());
        return None;
    }
    Some(load_rgb(&path).unwrap_or_else(|error| panic!("{error}")))
}

/// The generator of noise of the script: a value in [0, 1) per pixel and channel.
fn hashed(index: usize) -> f64 {
    let mut h = (index as u32).wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    h = (h ^ (h >> 16)).wrapping_mul(2_246_822_519);
    h = (h ^ (h >> 13)).wrapping_mul(3_266_489_917);
    f64::from(h ^ (h >> 16)) / 2_f64.powi(32)
}

fn noisy(picture: &RgbImage) -> RgbImage {
    RgbImage::from_fn(picture.width, picture.height, |x, y| {
        let i = y * picture.width + x;
        [0, 1, 2].map(|c| (f64::from(picture.pixels[i][c]) * (0.5 + hashed(3 * i + c))) as f32)
    })
}

fn shifted(picture: &RgbImage) -> RgbImage {
    let (width, height) = (picture.width, picture.height);
    RgbImage::from_fn(width, height, |x, y| picture.pixels[y * width + (x + width - 1) % width])
}

fn crop(picture: &RgbImage, left: usize, top: usize, width: usize, height: usize) -> RgbImage {
    RgbImage::from_fn(width, height, |x, y| picture.pixels[(y + top) * picture.width + x + left])
}

/// Coloured rings from black to forty times white.
fn rings(width: usize, height: usize) -> RgbImage {
    RgbImage::from_fn(width, height, |x, y| {
        let r = (x as f64 - 0.4 * width as f64).hypot(y as f64 - 0.6 * height as f64);
        let brightness = 40.0 * (-r / 12.0).exp() + 0.3;
        [0.21, 0.34, 0.55].map(|f| ((0.5 + 0.5 * (r * f).sin()).powi(3) * brightness) as f32)
    })
}

/// Grey bars, eight pixels wide, that get brighter to the right.
fn bars(width: usize, height: usize) -> RgbImage {
    RgbImage::from_fn(width, height, |x, _| {
        [if x / 8 % 2 == 0 { 0.1 } else { 0.2 + x as f32 / width as f32 }; 3]
    })
}

#[test]
fn coloured_rings_with_noise_agree() {
    let reference = rings(97, 61);
    check("rings_noisy", &RINGS_NOISY, &noisy(&reference), &reference);
}

#[test]
fn edges_moved_by_a_pixel_agree() {
    let reference = bars(120, 40);
    check("bars_shifted", &BARS_SHIFTED, &shifted(&reference), &reference);
}

#[test]
fn the_cornell_box_by_two_renderers_agrees() {
    let folder = "data/scenes/cornell-box/";
    let image = shared(&format!("{folder}TungstenRender.exr"));
    let reference = shared(&format!("{folder}mitsuba/scene_v3.exr"));
    let (Some(image), Some(reference)) = (image, reference) else { return };
    check("cornell", &CORNELL, &image, &reference);
}

#[test]
fn the_bunny_with_and_without_interreflection_agrees() {
    let Some(reference) = shared("reference/bunny_diffuse.direct.exr") else { return };
    let Some(image) = shared("reference/bunny_diffuse.path8.exr") else { return };
    check("bunny_depth", &BUNNY_DEPTH, &image, &reference);
}

#[test]
fn the_bunny_of_two_materials_agrees() {
    let Some(reference) = shared("reference/bunny_diffuse.direct.exr") else { return };
    let Some(image) = shared("reference/bunny_merlfile.direct.exr") else { return };
    check("bunny_material", &BUNNY_MATERIAL, &image, &reference);
}

#[test]
fn a_noisy_crop_of_the_terrain_agrees() {
    let Some(reference) = shared("reference/hf25_coneman.direct.exr") else { return };
    let reference = crop(&reference, 330, 170, 300, 200);
    check("coneman_crop_noisy", &CONEMAN_CROP_NOISY, &noisy(&reference), &reference);
}

#[test]
fn the_blurred_row_moved_by_a_pixel_agrees() {
    let Some(reference) = shared("reference/dof_row.direct.exr") else { return };
    check("dof_shifted", &DOF_SHIFTED, &shifted(&reference), &reference);
}

#[test]
fn a_room_a_tenth_darker_agrees() {
    let Some(reference) = shared("data/scenes/veach-bidir/TungstenRender.exr") else { return };
    let image = RgbImage::from_fn(reference.width, reference.height, |x, y| {
        reference.pixels[y * reference.width + x].map(|v| v * 0.9)
    });
    check("bidir_darker", &BIDIR_DARKER, &image, &reference);
}

#[test]
fn flip_is_zero_for_a_picture_and_itself_and_the_same_both_ways() {
    let reference = rings(97, 61);
    let image = noisy(&reference);
    assert_eq!(flip(&reference, &reference, 0.0).expect("one size").mean, 0.0);
    assert_eq!(hdr_flip(&reference, &reference).expect("one size").mean, 0.0);
    let there = flip(&image, &reference, 0.0).expect("one size");
    let back = flip(&reference, &image, 0.0).expect("one size");
    assert_eq!(there, back);
    assert!(there.map.values.iter().all(|v| (0.0..=1.0).contains(v)));
}

#[test]
fn flip_does_not_depend_on_the_number_of_threads() {
    let reference = rings(97, 61);
    let image = noisy(&reference);
    let with = |threads| -> FlipMap {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| hdr_flip(&image, &reference).expect("one size"))
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn pixels_without_a_value_are_black_to_flip() {
    let reference = bars(40, 24);
    let (mut image, mut black) = (reference.clone(), reference.clone());
    image.pixels[500] = [f32::NAN, 1.0, f32::INFINITY];
    black.pixels[500] = [0.0; 3];
    assert_eq!(flip(&image, &reference, 0.0), flip(&black, &reference, 0.0));
    let seen = hdr_flip(&image, &reference).expect("one size");
    assert!(seen.mean > 0.0 && seen.map.values.iter().all(|v| v.is_finite()));
}

#[test]
fn pictures_smaller_than_the_filters_and_values_beyond_the_screen_have_an_answer() {
    for (width, height) in [(1, 1), (1, 9), (3, 2)] {
        let reference = RgbImage::from_fn(width, height, |x, y| [(x + y) as f32 * 1e30, 0.5, 0.0]);
        let image = RgbImage::from_fn(width, height, |_, y| [-1.0, y as f32, f32::MAX]);
        for map in [flip(&image, &reference, 0.0), hdr_flip(&image, &reference)] {
            assert!((0.0..=1.0).contains(&map.expect("one size").mean));
        }
    }
}

#[test]
fn a_viewer_farther_away_sees_less_of_the_noise() {
    let reference = bars(120, 40);
    let image = noisy(&reference);
    let near = Flip::seen_from(0.7, 0.7, 3840.0).ldr(&image, &reference, 0.0).expect("one size").mean;
    let far = Flip::seen_from(2.1, 0.7, 3840.0).ldr(&image, &reference, 0.0).expect("one size").mean;
    assert!(far < 0.7 * near, "near {near}, far {far}");
}
