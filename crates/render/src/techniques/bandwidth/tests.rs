#![allow(clippy::unwrap_used)]

use halflight_image::{RgbImage, metrics};
use halflight_scene::{LoadOptions, Scene};

use super::*;
use crate::technique::Quiet;

const THINGS: &str = r#"
[image]
size = [96, 64]
[camera]
origin = [0, 1.5, 4]
target = [0, 0.45, 0]
vertical_fov_degrees = 36
[material.ground]
type = "diffuse"
albedo = [0.6, 0.5, 0.4]
[material.shiny]
type = "phong"
diffuse = [0.2, 0.3, 0.4]
specular = [0.4, 0.4, 0.4]
exponent = 60
[material.metal]
type = "conductor"
color = [0.9, 0.7, 0.3]
roughness = 0.45
[[shape]]
type = "plane"
half_extent = 5
material = "ground"
[[shape]]
type = "sphere"
center = [-0.7, 0.5, 0]
radius = 0.5
material = "shiny"
[[shape]]
type = "sphere"
center = [0.6, 0.45, 0.2]
radius = 0.45
material = "metal"
"#;
const STUDIO: &str = "\n[environment]\ntype = \"studio\"\n";
const LAMP: &str = r#"
[material.lamp]
type = "emissive"
radiance = [12, 10, 8]
[[shape]]
type = "rectangle"
material = "lamp"
transform = { scale = 0.4, rotate_degrees = [90, 0, 0], translate = [0, 2.2, 0.3] }
"#;

pub(super) fn scene(text: &str) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).unwrap();
    Scene::load(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

pub(super) fn picture(scene: &Scene, settings: BandwidthSettings) -> (RgbImage, RenderReport) {
    let [width, height] = scene.image().size.map(|s| s as usize);
    let mut technique = BandwidthTechnique::new(settings);
    technique.prepare(scene, &Quiet).unwrap();
    let mut film = Film::new(width, height);
    let budget = Budget { samples: Some(1), ..Budget::default() };
    let report = technique.render(&scene.at(0.0).unwrap(), &mut film, &budget, &Quiet).unwrap();
    (film.image(), report)
}

pub(super) fn truth(scene: &Scene) -> RgbImage {
    picture(scene, BandwidthSettings { mode: Mode::Reference, samples: 512, ..BandwidthSettings::default() })
        .0
}

/// Root mean square error of each 16 × 16 block, in display values of a picture of that exposure; the worst.
pub(super) fn worst_block(image: &RgbImage, truth: &RgbImage) -> f64 {
    let shown = |v: f32| f64::from(halflight_image::srgb_encode(v.clamp(0.0, 1.0)));
    let mut worst = 0.0f64;
    for top in (0..image.height).step_by(16) {
        for left in (0..image.width).step_by(16) {
            let (mut sum, mut count) = (0.0, 0);
            for y in top..(top + 16).min(image.height) {
                for x in left..(left + 16).min(image.width) {
                    for c in 0..3 {
                        let i = y * image.width + x;
                        sum += (shown(image.pixels[i][c]) - shown(truth.pixels[i][c])).powi(2);
                        count += 1;
                    }
                }
            }
            worst = worst.max((sum / f64::from(count)).sqrt());
        }
    }
    worst
}

#[test]
fn what_is_interpolated_agrees_with_what_is_shaded_everywhere() {
    for (light, least) in [(STUDIO, 33.0), (LAMP, 33.0)] {
        let scene = scene(&format!("{THINGS}{light}"));
        let truth = truth(&scene);
        for mode in [Mode::Plain, Mode::Preconvolved] {
            let (image, report) = picture(&scene, BandwidthSettings { mode, ..BandwidthSettings::default() });
            let psnr = metrics::psnr(&image, &truth, 0.0).unwrap();
            let block = worst_block(&image, &truth);
            eprintln!("{mode:?} {psnr:.1} dB, worst block {block:.3}; {:?}", report.notes);
            assert!(psnr > least && block < 0.06, "{mode:?}: {psnr} dB, {block}");
            assert_eq!(report.non_finite, 0);
        }
    }
}

const PAINTED: &str = r#"
[image]
size = [96, 64]
[camera]
origin = [0, 1.2, 3]
target = [0, 0.4, 0]
vertical_fov_degrees = 40
[environment]
type = "studio"
[material.tiles]
type = "metallic-roughness"
base_color = { file = "tiles.png", repeat = [9, 9] }
roughness = 0.4
[material.knot]
type = "phong"
diffuse = { file = "tiles.png", repeat = [20, 3] }
specular = [0.3, 0.3, 0.3]
exponent = 40
[[shape]]
type = "plane"
half_extent = 4
material = "tiles"
[[shape]]
type = "generated"
mesh = "knot"
radius = 0.42
tube = 0.14
material = "knot"
transform = { translate = [0, 0.6, 0] }
"#;

fn painted() -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let tiles =
        RgbImage::from_fn(
            64,
            64,
            |x, y| {
                if (x / 16 + y / 16) % 2 == 0 { [0.9, 0.8, 0.1] } else { [0.1, 0.1, 0.3] }
            },
        );
    halflight_image::save_png(&folder.path().join("tiles.png"), &tiles, &Default::default()).unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, PAINTED).unwrap();
    Scene::load(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn pictures_on_materials_are_multiplied_in_where_nothing_is_shaded() {
    let scene = painted();
    let truth = truth(&scene);
    for mode in [Mode::Plain, Mode::Preconvolved] {
        let (image, report) = picture(&scene, BandwidthSettings { mode, ..BandwidthSettings::default() });
        let psnr = metrics::psnr(&image, &truth, 0.0).unwrap();
        let block = worst_block(&image, &truth);
        eprintln!("{mode:?} {psnr:.1} dB, worst block {block:.3}; {:?}", report.notes);
        assert!(psnr > 34.0 && block < 0.05, "{mode:?}: {psnr} dB, {block}");
        let share: f64 = report.notes[1].split(' ').nth(1).unwrap().parse().unwrap();
        // The tiles change in every other pixel.
        assert!(share < 60.0, "{:?}", report.notes);
    }
}

#[test]
fn what_is_shaded_beside_an_edge_does_not_stand_out() {
    // A dark ball before a bright floor, and a bright one: their fringes against the floor farther away.
    let text = format!("{THINGS}{STUDIO}").replace("[0.2, 0.3, 0.4]", "[0.01, 0.01, 0.01]");
    let scene = scene(&text);
    let truth = truth(&scene);
    let (image, _) = picture(&scene, BandwidthSettings::default());
    let frame = scene.at(0.0).unwrap();
    let surfaces = Surfaces::look(&frame, [96, 64], Vec2::splat(0.5), Vec::new());
    let (mut sum, mut count) = (0.0f64, 0);
    for y in 1..63 {
        for x in 1..95 {
            let point = surfaces.at(x, y);
            let beside = [(x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)];
            if point.is_there() && beside.iter().any(|&(x, y)| !surfaces.at(x, y).is_of(point)) {
                for c in 0..3 {
                    let (a, b) = (image.pixels[y * 96 + x][c], truth.pixels[y * 96 + x][c]);
                    let shown = |v: f32| f64::from(halflight_image::srgb_encode(v.clamp(0.0, 1.0)));
                    sum += (shown(a) - shown(b)).powi(2);
                    count += 1;
                }
            }
        }
    }
    let error = (sum / f64::from(count)).sqrt();
    eprintln!("beside edges {error:.4}");
    assert!(error < 0.02, "{error}");
}

#[test]
fn shadows_of_spheres_are_those_of_rays_but_for_their_softness() {
    let scene = scene(&format!("{THINGS}\n[environment]\ntype = \"constant\"\ncolor = 1\n"));
    for mode in [Mode::Plain, Mode::Preconvolved, Mode::Reference] {
        let shown = |visibility| {
            let settings =
                BandwidthSettings { mode, visibility, samples: 256, ..BandwidthSettings::default() };
            picture(&scene, settings).0
        };
        let (off, rays) = (shown(Visibility::Off), shown(Visibility::Rays));
        let spheres = shown(Visibility::Spheres);
        let apart = |a: &RgbImage, b: &RgbImage| {
            let sum: f32 = a.pixels.iter().zip(&b.pixels).map(|(a, b)| (a[1] - b[1]).abs()).sum();
            sum / b.pixels.iter().map(|b| b[1]).sum::<f32>()
        };
        let (without, with) = (apart(&off, &rays), apart(&spheres, &rays));
        eprintln!("{mode:?}: {without:.4} without shadows, {with:.4} with those of spheres");
        assert!(with < 0.02 && with < 0.4 * without, "{mode:?}: {with} {without}");
    }
}

#[test]
fn the_picture_does_not_depend_on_the_number_of_threads() {
    for visibility in [Visibility::Rays, Visibility::Spheres] {
        is_the_same_on_any_number_of_threads(visibility);
    }
}

fn is_the_same_on_any_number_of_threads(visibility: Visibility) {
    let scene = scene(&format!("{THINGS}{STUDIO}{LAMP}"));
    let settings = BandwidthSettings {
        preset: Preset::Draft,
        visibility,
        antialias: Antialias::Four,
        ..BandwidthSettings::default()
    };
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| picture(&scene, settings).0)
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn strange_lights_and_materials_give_sound_pictures() {
    let black = "\n[environment]\ntype = \"black\"\n";
    let even = "\n[environment]\ntype = \"constant\"\ncolor = [1, 2, 3]\n";
    let no_lamp = LAMP.replace("scale = 0.4", "scale = [0, 0.4, 1]");
    let dull = THINGS.replace("0.9, 0.7, 0.3", "0, 0, 0").replace("0.6, 0.5, 0.4", "0, 0, 0");
    for text in [
        format!("{THINGS}{black}"),
        format!("{THINGS}{even}"),
        format!("{THINGS}{even}{no_lamp}"),
        format!("{dull}{STUDIO}{LAMP}"),
        format!("{}{STUDIO}", THINGS.replace("[96, 64]", "[1, 1]")),
        format!("{}{STUDIO}", THINGS.replace("[96, 64]", "[37, 1]")),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.toml");
        std::fs::write(&path, &text).unwrap();
        // A light without area may be refused, in words.
        let Ok(scene) = Scene::load(&path, &LoadOptions::default()) else {
            assert!(text.contains("scale = [0"), "{text}");
            continue;
        };
        for mode in [Mode::Plain, Mode::Preconvolved] {
            let settings =
                BandwidthSettings { mode, antialias: Antialias::Sixteen, ..BandwidthSettings::default() };
            let (image, report) = picture(&scene, settings);
            assert_eq!(report.non_finite, 0);
            assert!(image.pixels.iter().flatten().all(|v| v.is_finite() && *v >= 0.0));
        }
    }
}

#[test]
fn a_measured_material_that_returns_nothing_under_a_map_of_one_pixel_is_black() {
    let folder = tempfile::tempdir().unwrap();
    let mut table = vec![0u8; 12 + 3 * 8 * 90 * 90 * 180];
    for (i, size) in [90i32, 90, 180].into_iter().enumerate() {
        table[4 * i..4 * i + 4].copy_from_slice(&size.to_le_bytes());
    }
    std::fs::write(folder.path().join("nothing.binary"), table).unwrap();
    let sky = RgbImage::from_fn(1, 1, |_, _| [2.0, 1.0, 0.5]);
    halflight_image::save_hdr(&folder.path().join("one.hdr"), &sky).unwrap();
    let text = "[image]\nsize = [24, 16]\n[environment]\ntype = \"image\"\nfile = \"one.hdr\"\n\
        [material.nothing]\ntype = \"measured\"\nfile = \"nothing.binary\"\n\
        [[shape]]\ntype = \"sphere\"\nradius = 0.5\nmaterial = \"nothing\"\n";
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).unwrap();
    let scene = Scene::load(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    for mode in [Mode::Plain, Mode::Preconvolved] {
        let (image, report) = picture(&scene, BandwidthSettings { mode, ..BandwidthSettings::default() });
        assert_eq!(report.non_finite, 0);
        let dark = image.pixels.iter().filter(|p| **p == [0.0; 3]).count();
        let sky = image.pixels.iter().filter(|p| (p[0] - 2.0).abs() < 0.02).count();
        assert!(dark > 10 && sky > 10 && dark + sky == 24 * 16, "{dark} {sky}");
    }
}

#[test]
fn under_even_light_the_variance_and_the_bandwidth_of_a_diffuse_plane_are_nothing() {
    let text = format!("{THINGS}\n[environment]\ntype = \"constant\"\ncolor = 1\n");
    let (image, report) = picture(&scene(&text), BandwidthSettings::default());
    let floor = image.pixels[62 * 96 + 48];
    assert!((floor[0] - 0.6).abs() < 0.02 && (floor[2] - 0.4).abs() < 0.02, "{floor:?}");
    assert!(report.notes[1].starts_with("shaded"), "{:?}", report.notes);
}

#[test]
fn predicted_variance_covers_the_measured_one_nearly_everywhere() {
    // One picture of one sample more or less in each pixel tells little of each; many looks tell its variance.
    let scene = scene(&format!("{THINGS}{STUDIO}"));
    let frame = scene.at(0.0).unwrap();
    let settings = BandwidthSettings { mode: Mode::Plain, ..BandwidthSettings::default() };
    let technique = BandwidthTechnique::new(settings);
    let lobes = technique.lobes_of(&frame);
    let light = FrameLight::new(&frame, &technique.light, Mode::Plain);
    let surfaces = Surfaces::look(&frame, [96, 64], Vec2::splat(0.5), Vec::new());
    let judge = Judge::new(&frame, &light, &lobes, &technique.settings, [96, 64]);
    let buffer = Buffer::new(&judge, &surfaces);
    let (mut covered, mut all, mut ratios) = (0, 0, Vec::new());
    for i in (0..96 * 64).step_by(23) {
        let point = &surfaces.points[i];
        if !point.is_there() {
            continue;
        }
        let (mut sum, mut square) = (0.0f64, 0.0f64);
        let looks = 1024;
        for seed in 0..looks {
            let (settings, blocking) = (&technique.settings, Blocking::Nothing);
            let progress = &Quiet;
            let shader =
                Shader { frame: &frame, light: &light, lobes: &lobes, settings, blocking, seed, progress };
            let mut room = shader.room();
            let radiance = shader.radiance(point, [i as u32, 7], [1, 0], &mut room);
            let l = f64::from(halflight_scene::lights::luminance(radiance));
            sum += l;
            square += l * l;
        }
        let mean = sum / looks as f64;
        let measured = (square / looks as f64 - mean * mean) / (mean * mean).max(1e-12);
        let predicted = f64::from(buffer.pixels[i].variance);
        all += 1;
        covered += usize::from(predicted >= measured);
        ratios.push(predicted / measured.max(1e-9));
    }
    ratios.sort_by(f64::total_cmp);
    let median = ratios[ratios.len() / 2];
    eprintln!("covered: {covered} of {all}, median ratio {median:.2}");
    assert!(covered * 100 >= 95 * all && median < 8.0 && median > 0.5, "{covered} of {all}, {median}");
}

#[test]
fn a_pixel_is_explained_step_by_step() {
    let scene = scene(&format!("{THINGS}{STUDIO}{LAMP}"));
    let technique = BandwidthTechnique::new(BandwidthSettings::default());
    let frame = scene.at(0.0).unwrap();
    let text = technique.explain(&frame, [96, 64], [32, 34]).unwrap();
    for word in ["light", "travel", "incidence", "curvature", "reflection", "exit", "level", "samples for"] {
        assert!(text.contains(word), "{word}: {text}");
    }
    assert!(technique.explain(&frame, [96, 64], [96, 0]).is_none());
    assert!(technique.explain(&frame, [96, 64], [0, 0]).is_some());
}
