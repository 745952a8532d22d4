#![allow(clippy::unwrap_used)]

use super::super::tests::{frame, relative_mse};
use super::super::{Covariance, CovarianceSettings, Textures};
use super::*;
use crate::film::Film;
use crate::technique::{Budget, Quiet, Technique};
use crate::techniques::path::Path;

/// A camera that looks at a mirror ball, through a glass ball beside it, at a floor.
const BALLS: &str = r#"
[camera]
origin = [0, 0.6, 4]
target = [0, 0.5, 0]
vertical_fov_degrees = 30
[environment]
type = "constant"
color = 1
[material.mirror]
type = "mirror"
[material.glass]
type = "dielectric"
ior = 1.5
[[shape]]
type = "plane"
half_extent = 10
[[shape]]
type = "sphere"
center = [-0.5, 0.5, 0]
radius = 0.5
material = "mirror"
[[shape]]
type = "sphere"
center = [0.6, 0.5, 0]
radius = 0.5
material = "glass"
"#;

/// Where the ray through a place of the film meets the floor, over smooth surfaces; refracted where it can be.
fn to_floor(frame: &Frame, view: &View, pixel: Vec2, mut spread: Option<&mut Spread>) -> Option<Vec3> {
    let mut ray = view.ray(pixel, Vec2::splat(0.5), 0.0);
    for _ in 0..4 {
        let hit = frame.world.closest(&ray)?;
        let surface = frame.world.surface(&ray, &hit);
        let way = surface.position.distance(ray.origin);
        let found = spread.as_deref_mut().map(|spread| spread.arrive(frame, &ray, &hit, &surface, way).1);
        let vertex = Vertex::stopped(frame, &ray, &hit);
        if !vertex.bsdf.is_delta_only() {
            return Some(surface.position);
        }
        let sample = vertex.bsdf.sample(vertex.wo, 0.999, Vec2::splat(0.5))?;
        let direction = vertex.to_world(sample.wi).normalize();
        if let (Some(spread), Some(met)) = (spread.as_deref_mut(), found) {
            spread.leave(&vertex, &met, direction, None, 0);
        }
        ray = surface.spawn(direction, 0.0);
    }
    None
}

#[test]
fn spread_is_the_difference_of_neighbouring_rays_over_mirrors_and_through_glass() {
    let frame = frame(BALLS);
    let view = frame.camera.view(200, 100);
    let mut counted = 0;
    for y in (4..100).step_by(7) {
        for x in (3..200).step_by(7) {
            let pixel = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
            let (mut spread, _) =
                Spread::of_camera(Textures::Differentials, &view, pixel, Vec2::splat(0.5), 0.0, false, 0)
                    .unwrap();
            let Some(middle) = to_floor(&frame, &view, pixel, Some(&mut spread)) else { continue };
            for (axis, side) in [Vec2::X, Vec2::Y].into_iter().zip(&spread.sides[..2]) {
                let h = 0.02;
                let [a, b] = [h, -h].map(|h| to_floor(&frame, &view, pixel + h * axis, None));
                let (Some(a), Some(b)) = (a, b) else { continue };
                let difference = (a - b) * (0.5 / h) * BOX;
                // Not where the neighbours went another way.
                if a.distance(middle) > 0.1 || b.distance(middle) > 0.1 || difference.length() < 1e-3 {
                    continue;
                }
                counted += 1;
                let error = (side.position - difference).length() / difference.length();
                assert!(error < 0.05, "{x} {y}: {} for {difference}", side.position);
            }
        }
    }
    assert!(counted > 150, "{counted}");
}

#[test]
fn averaged_textures_go_to_those_of_points() {
    let folder = tempfile::tempdir().unwrap();
    let picture = halflight_image::RgbImage::from_fn(64, 64, |x, y| {
        if (x / 2 + y / 2) % 2 == 0 { [0.9, 0.7, 0.2] } else { [0.05, 0.1, 0.3] }
    });
    halflight_image::save_png(
        &folder.path().join("check.png"),
        &picture,
        &halflight_image::ToneMapping::default(),
    )
    .unwrap();
    let text = BALLS.replace("half_extent = 10\n", "half_extent = 10\nmaterial = \"floor\"\n")
        + &format!(
            "[material.floor]\ntype = \"diffuse\"\nalbedo = {{ file = {:?}, repeat = [8, 8] }}\n",
            folder.path().join("check.png")
        );
    let frame = frame(&text);
    let picture = |technique: &dyn Technique, samples: u32| {
        let mut film = Film::new(48, 32);
        let budget = Budget { samples: Some(samples), ..Budget::default() };
        technique.render(&frame, &mut film, &budget, &Quiet).unwrap();
        film
    };
    let truth = picture(&Path::default(), 1024);
    let of = |textures: Textures, samples: u32| {
        let settings = CovarianceSettings {
            textures,
            reconstruction: super::super::Reconstruction::None,
            ..CovarianceSettings::default()
        };
        relative_mse(&picture(&Covariance::new(settings), samples), &truth)
    };
    let (points, few) = (of(Textures::Points, 1), of(Textures::Covariance, 1));
    let many = of(Textures::Covariance, 256);
    println!("points {points}, averaged {few}, with 256 samples {many}");
    assert!(few < 0.7 * points && many < 0.1 * few, "{points} {few} {many}");
}

/// A phong floor of tiles whose diffuse and specular parts are above 1 together, seen straight and in a brushed ball.
fn tiles(folder: &std::path::Path) -> Frame {
    let picture = halflight_image::RgbImage::from_fn(64, 64, |x, y| {
        if (x / 4 + y / 4) % 2 == 0 { [0.95, 0.9, 0.8] } else { [0.1, 0.15, 0.3] }
    });
    halflight_image::save_png(&folder.join("tiles.png"), &picture, &halflight_image::ToneMapping::default())
        .unwrap();
    let text = BALLS
        .replace("half_extent = 10\n", "half_extent = 10\nmaterial = \"floor\"\n")
        .replace("type = \"mirror\"", "type = \"conductor\"\ncolor = 0.9\nroughness = 0.2")
        + &format!(
            "[material.floor]\ntype = \"phong\"\nspecular = 0.3\nexponent = 200\n\
             diffuse = {{ file = {:?}, repeat = [12, 12] }}\n",
            folder.join("tiles.png")
        );
    frame(&text)
}

#[test]
fn averaged_textures_are_never_worse_than_points_or_differentials_and_as_bright() {
    let folder = tempfile::tempdir().unwrap();
    let frame = tiles(folder.path());
    let picture = |technique: &dyn Technique, samples: u32, seed: u64| {
        let mut film = Film::new(24, 16);
        let budget = Budget { samples: Some(samples), seed, ..Budget::default() };
        technique.render(&frame, &mut film, &budget, &Quiet).unwrap();
        film
    };
    let mean = |film: &Film| film.image().pixels.iter().flatten().map(|v| f64::from(*v)).sum::<f64>();
    let truth = picture(&Path::default(), 8192, 99);
    for samples in [1, 16, 64, 256, 1024] {
        let seeds = if samples > 100 { 1 } else { 4 };
        let of = |textures: Textures| {
            let technique = Covariance::new(CovarianceSettings {
                textures,
                reconstruction: super::super::Reconstruction::None,
                sampling: super::super::Sampling::Uniform,
                ..CovarianceSettings::default()
            });
            let films: Vec<Film> = (0..seeds).map(|seed| picture(&technique, samples, seed)).collect();
            let error =
                films.iter().map(|film| relative_mse(film, &truth)).sum::<f64>() / f64::from(seeds as u32);
            (error, films.iter().map(mean).sum::<f64>() / f64::from(seeds as u32) / mean(&truth))
        };
        let [points, differentials, covariance] =
            [Textures::Points, Textures::Differentials, Textures::Covariance].map(of);
        println!("{samples}: points {points:?}, differentials {differentials:?}, covariance {covariance:?}");
        assert!(covariance.0 < 1.1 * points.0.min(differentials.0), "{samples}");
        if samples >= 16 {
            assert!((covariance.1 - 1.0).abs() < 0.01 && (differentials.1 - 1.0).abs() < 0.01, "{samples}");
        }
    }
}
