//! Textures seen through two curved mirrors at one sample a pixel: averaged over what covariance covers, over what
//! ray differentials cover, and at points.
//!
//! The demo `two-mirrors` with mirrors of several roughnesses. Counted are the pixels whose middle ray goes from one mirror to the other and
//! then to the floor. Error: relMSE against 1024 samples of `path`, whose textures are points, mean of four seeds.

use std::path::Path as FilePath;
use std::sync::Arc;

use glam::{Vec2, Vec3};
use halflight_image::RgbImage;
use halflight_material::MaterialKind;
use halflight_render::techniques::covariance::{
    Covariance, CovarianceSettings, Reconstruction, Sampling, Textures,
};
use halflight_render::techniques::path::Path;
use halflight_render::{Budget, Film, Technique};
use halflight_scene::Frame;
use halflight_trace::Ray;

use super::{BenchArgs, Findings};
use crate::command::failure::Failure;
use crate::command::interrupt;
use crate::command::progress::silent;
use crate::command::stage::{self, SceneArgs};
use crate::command::table::Table;

/// Roughness of the mirrors; α is its square.
const MIRRORS: [(&str, f32); 3] = [("smooth", 0.0), ("brushed, α 0.01", 0.1), ("brushed, α 0.0225", 0.15)];

/// Whether the pixel shows the floor in one mirror in the other.
fn through_both(frame: &Frame, size: [usize; 2]) -> Vec<bool> {
    let view = frame.camera.view(size[0], size[1]);
    (0..size[0] * size[1])
        .map(|i| {
            let pixel = Vec2::new((i % size[0]) as f32 + 0.5, (i / size[0]) as f32 + 0.5);
            let mut ray = view.ray(pixel, Vec2::splat(0.5), 0.0);
            for met in ["front", "back"] {
                let Some(hit) = frame.world.closest(&ray) else { return false };
                if frame.shape_name(hit.instance) != met {
                    return false;
                }
                let surface = frame.world.surface(&ray, &hit);
                let normal: Vec3 = surface.shading_normal;
                let on = ray.direction - 2.0 * normal * normal.dot(ray.direction);
                ray = Ray { t_max: f32::INFINITY, ..surface.spawn(on, 0.0) };
            }
            frame.world.closest(&ray).is_some_and(|hit| frame.shape_name(hit.instance) == "floor")
        })
        .collect()
}

fn picture(
    frame: &Frame,
    technique: &dyn Technique,
    size: [usize; 2],
    samples: u32,
    seed: u64,
) -> Result<RgbImage, Failure> {
    let mut film = Film::new(size[0], size[1]);
    let budget = Budget { samples: Some(samples), seed, ..Budget::default() };
    technique.render(frame, &mut film, &budget, &silent())?;
    Ok(film.image())
}

fn error(picture: &RgbImage, truth: &RgbImage, counts: &[bool]) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for ((x, t), _) in picture.pixels.iter().zip(&truth.pixels).zip(counts).filter(|(_, counts)| **counts) {
        for c in 0..3 {
            let (x, t) = (f64::from(x[c]), f64::from(t[c]));
            sum += (x - t) * (x - t) / (t * t + 0.01);
            count += 1.0;
        }
    }
    sum / f64::max(count, 1.0)
}

pub(super) fn footprints(args: &BenchArgs) -> Result<Findings, Failure> {
    let mut table = Table::new([
        "mirrors",
        "samples",
        "relMSE, points",
        "relMSE, differentials",
        "relMSE, covariance",
        "covariance / differentials",
        "goal",
    ]);
    let demo = FilePath::new("demo:two-mirrors");
    let stage = stage::load(demo, &SceneArgs::default(), &args.machine)?;
    let size = if args.quick { [96, 54] } else { [240, 135] };
    let mut counted = 0;
    for (what, roughness) in MIRRORS {
        let mut frame = stage.frame(0.0)?;
        for material in &mut frame.materials {
            if material.name == "mirror" {
                let material = Arc::make_mut(material);
                if let MaterialKind::Conductor { roughness: of_scene, .. } = &mut material.kind {
                    *of_scene = roughness.into();
                }
            }
        }
        let counts = through_both(&frame, size);
        counted = counts.iter().filter(|counts| **counts).count();
        let truth = picture(&frame, &Path::default(), size, if args.quick { 128 } else { 1024 }, 99)?;
        for samples in [1, 4, 16] {
            let mut errors = Vec::new();
            for textures in [Textures::Points, Textures::Differentials, Textures::Covariance] {
                let settings = CovarianceSettings {
                    textures,
                    reconstruction: Reconstruction::None,
                    sampling: Sampling::Uniform,
                    ..CovarianceSettings::default()
                };
                let technique = Covariance::new(settings);
                let mut sum = 0.0;
                for seed in 0..4 {
                    let picture = picture(&frame, &technique, size, samples, seed)?;
                    sum += error(&picture, &truth, &counts) / 4.0;
                    if let Some(folder) = args.maps.as_ref().filter(|_| seed == 0 && samples == 1) {
                        std::fs::create_dir_all(folder).map_err(Failure::failed)?;
                        let tone = halflight_image::ToneMapping::default();
                        let save = |name: String, picture: &RgbImage| {
                            halflight_image::save_png(&folder.join(name), picture, &tone)
                                .map_err(Failure::failed)
                        };
                        save(format!("two-mirrors-{roughness}-{textures:?}.png"), &picture)?;
                        save(format!("two-mirrors-{roughness}-truth.png"), &truth)?;
                    }
                }
                errors.push(sum);
            }
            table.row([
                what.into(),
                format!("{samples}"),
                format!("{:.4}", errors[0]),
                format!("{:.4}", errors[1]),
                format!("{:.4}", errors[2]),
                format!("{:.2}", errors[2] / errors[1]),
                if samples == 1 { "0.5".into() } else { String::new() },
            ]);
        }
        if interrupt::is_asked_to_stop() {
            break;
        }
    }
    let notes =
        vec![format!("{counted} pixels show the floor through both mirrors; no reconstruction filter")];
    Ok(Findings {
        title: "textures through two mirrors: footprints from covariance against ray differentials",
        table,
        notes,
    })
}
