#![allow(clippy::unwrap_used)]

use glam::Vec3;
use halflight_scene::media::DensityGrid;
use halflight_scene::{Frame, LoadOptions, Scene};

use super::*;

/// Shapes and materials of every kind, moving, through a lens.
const COMMON: &str = r#"
[image]
size = [48, 40]
[camera]
origin = [0, 1.6, 4]
target = [0, 0.5, 0]
vertical_fov_degrees = 40
aperture_radius = 0.02
focus_distance = 4
shutter = [0, 0.5]
[material.ground]
type = "diffuse"
albedo = [0.6, 0.5, 0.4]
[material.shiny]
type = "phong"
diffuse = [0.2, 0.3, 0.4]
specular = [0.4, 0.4, 0.4]
exponent = 40
[material.metal]
type = "conductor"
color = [0.9, 0.7, 0.3]
roughness = 0.3
[material.glass]
type = "dielectric"
ior = 1.5
[material.mirror]
type = "mirror"
[material.veil]
type = "diffuse"
albedo = [0.7, 0.7, 0.3]
opacity = 0.4
[[shape]]
type = "plane"
y = 0
half_extent = 5
material = "ground"
[[shape]]
type = "spheres"
spheres = [[-0.8, 0.4, 0.2, 0.4], [-0.2, 0.25, 1.1, 0.25]]
material = "glass"
[[shape]]
type = "box"
material = "metal"
transform = { scale = 0.6, translate = [0.8, 0.3, 0] }
[[shape]]
type = "box"
material = "shiny"
transform = { scale = 0.4, translate = [0, 0.3, -0.3] }
[[shape]]
type = "box"
material = "veil"
transform = { scale = 0.3, translate = [-0.4, 0.9, 0.6] }
[[shape]]
type = "sphere"
center = [0.3, 0.3, 0.9]
radius = 0.3
material = "mirror"
"#;

const SKY: &str = r#"
[environment]
type = "sky"
sun_elevation_degrees = 35
"#;

const LAMPS: &str = r#"
[material.lamp]
type = "emissive"
radiance = [12, 10, 8]
[[shape]]
type = "sphere"
center = [0.4, 1.5, 0.5]
radius = 0.15
material = "lamp"
[[light]]
type = "point"
position = [-1, 2, 1]
intensity = [3, 3, 4]
"#;

/// Media that overlap, one of them on a grid, coloured, one of them everywhere.
const FOG: &str = r#"
[[medium]]
scattering = [0.05, 0.1, 0.15]
absorption = 0.02
anisotropy = 0.6
[[medium]]
center = [0.3, 0.5, 0.3]
radius = 0.7
scattering = 1.5
anisotropy = -0.3
[[medium]]
min = [-1.2, 0, -0.5]
max = [0.2, 1, 1.2]
grid = "smoke.grid"
scattering = [2, 1, 0.5]
absorption = [0.1, 0.5, 1]
"#;

fn frame(text: &str) -> Frame {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    let values = (0..5 * 4 * 3).map(|i| (i * 7 % 11) as f32 * 0.2).collect();
    DensityGrid::new([5, 4, 3], values).unwrap().save(&folder.path().join("smoke.grid")).unwrap();
    std::fs::write(&path, text).unwrap();
    let scene = Scene::load(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    scene.at(0.0).unwrap()
}

#[test]
fn the_paths_of_a_block_bring_what_each_would_bring_alone() {
    let all = format!("{SKY}{LAMPS}{FOG}");
    for lights in [SKY.to_owned(), LAMPS.to_owned(), format!("{SKY}{LAMPS}"), format!("{LAMPS}{FOG}"), all] {
        let frame = frame(&format!("{COMMON}{lights}"));
        let mut lit = 0;
        for settings in [
            PathSettings { max_depth: 1, ..PathSettings::default() },
            PathSettings { max_depth: 0, ..PathSettings::default() },
            PathSettings { max_depth: 6, roulette_depth: 1, clamp: Some(2.0) },
        ] {
            let integrator = Integrator::new(&frame, settings);
            let camera = CameraSampler::new(&frame, 48, 40, 3);
            let mut block = Block::new();
            for sample in 0..4 {
                for (left, top, columns, rows) in
                    [(0, 0, 8, 8), (16, 16, 8, 8), (24, 20, 8, 8), (40, 33, 7, 5)]
                {
                    let place = |i: usize| [left + i % columns, top + i / columns];
                    let simd = frame.world.simd();
                    let pixels = (0..columns * rows).map(place);
                    let (count, samplers) = camera.rays(pixels, sample, simd, &mut block.rays);
                    let mut rays = 0;
                    integrator.radiance_of_block(&mut block, count, samplers, &mut rays);
                    for i in 0..count {
                        let [x, y] = place(i);
                        let (ray, mut sampler) = camera.ray(x, y, sample);
                        let hit = frame.world.closest(&ray);
                        let alone = integrator.radiance_alone(ray, hit, &mut sampler);
                        assert_eq!(block.radiance[i], alone, "{settings:?} {x} {y} {sample}");
                        lit += usize::from(alone != Vec3::ZERO);
                    }
                    assert!(rays >= count as u64);
                }
            }
        }
        assert!(lit > 0);
    }
}

/// The mean radiance of a picture of 48 by 40 pixels.
fn mean(text: &str, samples: u32) -> f64 {
    let frame = frame(text);
    let mut film = Film::new(48, 40);
    let budget = Budget { samples: Some(samples), ..Budget::default() };
    Path::default().render(&frame, &mut film, &budget, &crate::technique::Quiet).unwrap();
    let pixels = film.image().pixels;
    pixels.iter().map(|p| f64::from(p[0] + p[1] + p[2])).sum::<f64>() / (3 * pixels.len()) as f64
}

#[test]
fn a_surface_that_is_not_there_throws_no_shadow_and_half_of_one_throws_half() {
    const GROUND: &str = r#"
[camera]
origin = [0, 4, 0.01]
target = [0, 0, 0]
vertical_fov_degrees = 40
[environment]
type = "constant"
color = 0
[[light]]
type = "point"
position = [0, 3, 0.5]
intensity = [5, 5, 5]
[material.ground]
type = "diffuse"
albedo = [0.5, 0.5, 0.5]
[[shape]]
type = "plane"
y = 0
half_extent = 5
material = "ground"
"#;
    let card = |opacity: f32| {
        format!(
            "{GROUND}[material.card]\ntype = \"diffuse\"\nalbedo = [0, 0, 0]\nopacity = {opacity}\n\
             [[shape]]\ntype = \"rectangle\"\nmaterial = \"card\"\n\
             transform = {{ scale = 5, rotate_degrees = [90, 0, 0], translate = [0, 2, 0] }}\n"
        )
    };
    let (open, none, half, solid) =
        (mean(GROUND, 4), mean(&card(0.0), 4), mean(&card(0.5), 256), mean(&card(1.0), 4));
    assert!((none / open - 1.0).abs() < 1e-4, "{none} {open}");
    // Seen through the card, and lit through it.
    assert!((half / open - 0.25).abs() < 0.01, "{half} {open}");
    assert!(solid.abs() < 1e-6, "{solid}");
}

/// A camera that looks along −z at nothing, for media.
const TELESCOPE: &str = r#"
[camera]
origin = [0, 0, 3]
target = [0, 0, 0]
vertical_fov_degrees = 1
"#;

#[test]
fn a_furnace_of_media_without_absorption_is_white() {
    for shape in
        ["center = [0, 0, 0]\nradius = 1", "min = [-1, -1, -1]\nmax = [1, 1, 1]\ngrid = \"smoke.grid\""]
    {
        for anisotropy in [0.0, 0.7, -0.4] {
            let text = format!(
                "{TELESCOPE}[environment]\ncolor = 1\n[[medium]]\nscattering = [2, 1, 0.5]\nanisotropy = \
                 {anisotropy}\n{shape}\n[technique.path]\nmax_depth = 200\n"
            );
            let frame = frame(&text);
            let mut film = Film::new(48, 40);
            let budget = Budget { samples: Some(96), ..Budget::default() };
            let settings = PathSettings { max_depth: 200, ..PathSettings::default() };
            Path::new(settings).render(&frame, &mut film, &budget, &crate::technique::Quiet).unwrap();
            for channel in 0..3 {
                let pixels = film.image().pixels;
                let mean = pixels.iter().map(|p| f64::from(p[channel])).sum::<f64>() / pixels.len() as f64;
                assert!((mean - 1.0).abs() < 0.01, "{shape} {anisotropy} {channel}: {mean}");
            }
        }
    }
}

#[test]
fn light_scattered_once_in_a_slab_is_its_integral() {
    // A beam from above on a slab seen from the side: L = ∫ σ_s p(90°) E exp(−σ_t (h − y)) exp(−σ_t s) ds.
    let (s, a, g) = (0.4f64, 0.2f64, 0.5f64);
    let text = format!(
        "[camera]\norigin = [0, 0, 3]\ntarget = [0, 0, 0]\nvertical_fov_degrees = 0.01\n\
         [environment]\ntype = \"black\"\n[[light]]\ntype = \"directional\"\ndirection = [0, -1, 0]\n\
         irradiance = 3\n[[medium]]\nmin = [-50, -1, -1.5]\nmax = [50, 1, 0.5]\nscattering = {s}\n\
         absorption = {a}\nanisotropy = {g}\n"
    );
    let frame = frame(&text);
    let mut film = Film::new(48, 40);
    let budget = Budget { samples: Some(256), ..Budget::default() };
    let settings = PathSettings { max_depth: 1, ..PathSettings::default() };
    Path::new(settings).render(&frame, &mut film, &budget, &crate::technique::Quiet).unwrap();
    let pixels = film.image().pixels;
    let mean = pixels.iter().map(|p| f64::from(p[0])).sum::<f64>() / pixels.len() as f64;
    let phase = (1.0 - g * g) / (4.0 * std::f64::consts::PI * (1.0 + g * g).powf(1.5));
    let t = s + a;
    // Two metres of the ray, one metre of medium above each point of it.
    let expected = 3.0 * s * phase * (-t).exp() * (1.0 - (-2.0 * t).exp()) / t;
    assert!((mean / expected - 1.0).abs() < 0.01, "{mean} {expected}");
}

#[test]
fn a_lamp_behind_a_medium_is_dimmed_as_beer_and_lambert_say() {
    let text = format!(
        "{TELESCOPE}[environment]\ntype = \"black\"\n[[light]]\ntype = \"rectangle\"\nposition = [0, 0, -3]\n\
         target = [0, 0, 0]\nsize = [4, 4]\nradiance = 5\n[[medium]]\nabsorption = 0.7\n\
         min = [-9, -9, -1]\nmax = [9, 9, 1]\n"
    );
    let expected = 5.0 * (-1.4f64).exp();
    let found = mean(&text, 4);
    assert!((found / expected - 1.0).abs() < 1e-3, "{found} {expected}");
}
