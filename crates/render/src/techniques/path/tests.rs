#![allow(clippy::unwrap_used)]

use glam::Vec3;
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

fn frame(text: &str) -> Frame {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).unwrap();
    let scene = Scene::load(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    scene.at(0.0).unwrap()
}

#[test]
fn the_paths_of_a_block_bring_what_each_would_bring_alone() {
    for lights in [SKY.to_owned(), LAMPS.to_owned(), format!("{SKY}{LAMPS}")] {
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
