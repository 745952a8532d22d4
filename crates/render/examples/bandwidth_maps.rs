//! Predicted bandwidth and variance beside measured ones, as maps: `bandwidth_maps FOLDER`.
//!
//! A sphere, a plane and a cylinder under a sky of noise. Measured bandwidth is that of a windowed Fourier transform
//! (32 × 32, Hann) of a converged picture; measured variance that of single samples over 64 pictures. One sheet a shape:
//! the picture; bandwidth predicted and measured (0 to 0.4 cycles per pixel); variance predicted and measured (0.01 to 100 of
//! the squared mean, by its logarithm). Pixels that tell nothing are grey: no surface within the window, or a prediction
//! below 0.12 or above 0.4 cycles per pixel, which no window of 32 pixels can measure.

use std::path::Path;

use halflight_frequency::measured;
use halflight_image::{Plane, RgbImage, ToneMapping, save_hdr, save_png};
use halflight_render::techniques::bandwidth::{BandwidthSettings, BandwidthTechnique, Mode};
use halflight_render::{Budget, Film, Quiet, Technique};
use halflight_scene::{LoadOptions, Scene};

const SIDE: usize = 256;
/// Pictures of single samples.
const LOOKS: u64 = 64;

fn scene(folder: &Path, name: &str, shape: &str, roughness: f32, fov: f32) -> Scene {
    let text = format!(
        r#"
[image]
size = [{SIDE}, {SIDE}]
[camera]
origin = [0, 0, 6]
target = [0, 0, 0]
vertical_fov_degrees = {fov}
[environment]
type = "image"
file = "{name}-sky.hdr"
[material.metal]
type = "conductor"
color = [0.9, 0.9, 0.9]
roughness = {roughness}
[[shape]]
material = "metal"
{shape}
"#
    );
    let path = folder.join(format!("{name}.toml"));
    std::fs::write(&path, text).expect("a file");
    Scene::load(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// A sky of noise in so many columns, four texels to each, even between.
fn noise(columns: u32) -> RgbImage {
    let value = |x: u32, y: u32| {
        let mut h = (x % columns).wrapping_mul(0x9e37_79b9) ^ y.wrapping_mul(0x85eb_ca6b);
        h = (h ^ (h >> 15)).wrapping_mul(0x2c1b_3c6d);
        h = (h ^ (h >> 12)).wrapping_mul(0x297a_2d39);
        ((h ^ (h >> 15)) & 0xffff) as f32 / 65535.0
    };
    RgbImage::from_fn(4 * columns as usize, 2 * columns as usize, |x, y| {
        let (fx, fy) = (x % 4, y % 4);
        let (x, y) = (x as u32 / 4, y as u32 / 4);
        let row = |y| value(x, y) + fx as f32 / 4.0 * (value(x + 1, y) - value(x, y));
        [row(y) + fy as f32 / 4.0 * (row(y + 1) - row(y)); 3]
    })
}

fn luminances(image: &RgbImage) -> Vec<f32> {
    image.pixels.iter().map(|p| 0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2]).collect()
}

/// Dark blue over green to yellow.
fn color(value: f32) -> [f32; 3] {
    const KNOTS: [[f32; 3]; 5] =
        [[0.06, 0.0, 0.09], [0.04, 0.08, 0.26], [0.01, 0.28, 0.26], [0.11, 0.57, 0.12], [0.98, 0.79, 0.02]];
    let at = value.clamp(0.0, 1.0) * 4.0;
    let low = (at as usize).min(3);
    std::array::from_fn(|c| KNOTS[low][c] + (at - low as f32) * (KNOTS[low + 1][c] - KNOTS[low][c]))
}

fn quantile(sorted: &[f32], share: f32) -> f32 {
    sorted.get((share * sorted.len().saturating_sub(1) as f32) as usize).copied().unwrap_or(0.0)
}

fn main() {
    let Some(folder) = std::env::args().nth(1) else {
        eprintln!("bandwidth_maps FOLDER");
        return;
    };
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder).expect("a folder");
    let shapes = [
        ("sphere", "type = \"sphere\"\nradius = 1.5", 0.2, 34.4, 256),
        (
            "plane",
            "type = \"rectangle\"\ntransform = { rotate_degrees = [0, 20, 0], scale = 9 }",
            0.07,
            80.0,
            512,
        ),
        (
            "cylinder",
            "type = \"generated\"\nmesh = \"cylinder\"\nradius = 1.2\nheight = 6\ndetail = 512\ntransform = { translate = [0, -3, 0] }",
            0.18,
            34.4,
            256,
        ),
    ];
    for (name, shape, roughness, fov, columns) in shapes {
        save_hdr(&folder.join(format!("{name}-sky.hdr")), &noise(columns)).expect("a map");
        let scene = scene(folder, name, shape, roughness, fov);
        let frame = scene.at(0.0).unwrap_or_else(|error| panic!("{error}"));
        let render = |settings: BandwidthSettings, seed: u64| {
            let mut technique = BandwidthTechnique::new(settings);
            technique.prepare(&scene, &Quiet).expect("a scene that it can show");
            let mut film = Film::new(SIDE, SIDE);
            let budget = Budget { samples: Some(1), seed, ..Budget::default() };
            technique.render(&frame, &mut film, &budget, &Quiet).expect("a picture");
            film
        };
        let with = |mode, samples| BandwidthSettings { mode, samples, ..BandwidthSettings::default() };
        let predicted = render(with(Mode::Plain, 1), 0);
        let picture = render(with(Mode::Forward, 4096), 0).image();
        let lit = luminances(&picture);
        let plane = Plane { width: SIDE, height: SIDE, values: lit.clone() };
        let transformed = measured::windowed_map(&plane);
        let (bandwidth, variance) = (&predicted.layers["bandwidth"], &predicted.layers["predicted-variance"]);

        let mut technique = BandwidthTechnique::new(with(Mode::Forward, 1));
        technique.prepare(&scene, &Quiet).expect("a scene that it can show");
        let (mut sum, mut squares) = (vec![0.0f64; SIDE * SIDE], vec![0.0f64; SIDE * SIDE]);
        for seed in 0..LOOKS {
            let mut film = Film::new(SIDE, SIDE);
            let budget = Budget { samples: Some(1), seed, ..Budget::default() };
            technique.render(&frame, &mut film, &budget, &Quiet).expect("a picture");
            for (i, l) in luminances(&film.image()).into_iter().enumerate() {
                sum[i] += f64::from(l);
                squares[i] += f64::from(l) * f64::from(l);
            }
        }
        let n = LOOKS as f64;
        let spread: Vec<f32> = (0..SIDE * SIDE)
            .map(|i| {
                let mean = sum[i] / n;
                ((squares[i] / n - mean * mean) * n / (n - 1.0) / f64::from(lit[i] * lit[i]).max(1e-12))
                    as f32
            })
            .collect();

        let covered = |i: usize| variance[i] > 0.0;
        let inside = |i: usize| {
            let (x, y) = (i % SIDE, i / SIDE);
            (16..SIDE - 16).contains(&x)
                && (16..SIDE - 16).contains(&y)
                && (0..=32).step_by(4).all(|dy| {
                    (0..=32)
                        .step_by(4)
                        .all(|dx| covered((y + dy - 16).min(SIDE - 1) * SIDE + (x + dx - 16).min(SIDE - 1)))
                })
        };
        let resolved = |i: usize| inside(i) && (0.12..0.4).contains(&bandwidth[i]);
        let mut ratios: Vec<f32> =
            (0..SIDE * SIDE).filter(|&i| resolved(i)).map(|i| bandwidth[i] / transformed.values[i]).collect();
        ratios.sort_by(f32::total_cmp);
        let near = ratios.iter().filter(|r| (1.0 / 1.3..1.3).contains(*r)).count();
        let mut noises: Vec<f32> =
            (0..SIDE * SIDE).filter(|&i| covered(i)).map(|i| variance[i] / spread[i].max(1e-9)).collect();
        noises.sort_by(f32::total_cmp);
        let above = noises.iter().filter(|&&r| r >= 1.0).count();
        println!(
            "{name}: bandwidth predicted/measured {:.2} {:.2} {:.2} (5 %, median, 95 %), {:.1} % of {} pixels within 1.3; variance {:.2} in the median, conservative at {:.1} % of {} pixels",
            quantile(&ratios, 0.05),
            quantile(&ratios, 0.5),
            quantile(&ratios, 0.95),
            100.0 * near as f64 / ratios.len().max(1) as f64,
            ratios.len(),
            quantile(&noises, 0.5),
            100.0 * above as f64 / noises.len().max(1) as f64,
            noises.len(),
        );
        const GREY: [f32; 3] = [0.2; 3];
        let sheet = RgbImage::from_fn(5 * SIDE, SIDE, |x, y| {
            let i = y * SIDE + x % SIDE;
            let logarithm = |v: f32| color((v.max(1e-9).log10() + 2.0) / 4.0);
            match x / SIDE {
                0 => [2.0 * lit[i]; 3],
                1 if resolved(i) => color(bandwidth[i] / 0.4),
                2 if resolved(i) => color(transformed.values[i] / 0.4),
                3 if covered(i) => logarithm(variance[i]),
                4 if covered(i) => logarithm(spread[i]),
                _ => GREY,
            }
        });
        save_png(&folder.join(format!("{name}.png")), &sheet, &ToneMapping::default()).expect("a picture");
    }
}
