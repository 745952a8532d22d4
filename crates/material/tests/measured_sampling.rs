//! What sampling the measured lobe is worth: the variance of weights against cosine sampling.

mod common;

use glam::{Vec2, Vec3};
use halflight_material::test_kit::{ChiSquare, Random, chi_square, never_breaks};
use halflight_material::{Lookup, Material, MaterialKind, MeasuredBrdf, SurfaceInput};
use std::sync::Arc;

/// Mean and relative variance of the green weight of samples, and its largest value.
fn moments(mut weight: impl FnMut() -> f32, samples: usize) -> (f64, f64, f32) {
    let (mut sum, mut squares, mut largest) = (0.0, 0.0, 0.0f32);
    for _ in 0..samples {
        let w = weight();
        largest = largest.max(w);
        sum += f64::from(w);
        squares += f64::from(w).powi(2);
    }
    let mean = sum / samples as f64;
    (mean, (squares / samples as f64 - mean * mean) / (mean * mean).max(1e-30), largest)
}

fn compare(material: &Material, wo: Vec3, samples: usize) -> [(f64, f64, f32); 2] {
    let bsdf = material.bsdf(&SurfaceInput::default());
    let lambert = Material::diffuse(Vec3::ONE);
    let cosine = lambert.bsdf(&SurfaceInput::default());
    let mut random = Random::new(41);
    let by_lobe =
        moments(|| bsdf.sample(wo, random.unit(), random.square()).map_or(0.0, |s| s.weight.y), samples);
    let mut random = Random::new(43);
    let by_cosine = moments(
        || {
            let sample =
                cosine.sample(wo, 0.5, Vec2::new(random.unit(), random.unit())).expect("always scatters");
            bsdf.eval(wo, sample.wi).y / sample.pdf
        },
        samples,
    );
    [by_lobe, by_cosine]
}

fn view(degrees: f32) -> Vec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    Vec3::new(sin * 0.6, sin * 0.8, cos)
}

#[test]
fn a_narrow_lobe_is_sampled_with_a_hundredth_of_the_variance_of_cosine_sampling() {
    let brdf = common::synthetic(&common::metal("gold", 0.25, 0.0), Lookup::Interpolated);
    let material = Material::new("gold", MaterialKind::Measured(brdf));
    for degrees in [5.0, 30.0, 60.0] {
        let [lobe, cosine] = compare(&material, view(degrees), 40_000);
        // Four standard errors of the noisier mean.
        let allowed = 4.0 * cosine.0 * (cosine.1 / 40_000.0).sqrt();
        assert!((lobe.0 - cosine.0).abs() < allowed, "means {} and {}", lobe.0, cosine.0);
        assert!(lobe.1 < 0.01 * cosine.1, "{degrees}°: variance {} against {}", lobe.1, cosine.1);
    }
}

#[test]
fn published_tables_are_sampled_well_from_the_normal_to_grazing() {
    println!("relative variance of weights, lobe / cosine, and the largest weight");
    for name in ["blue-rubber", "chrome", "color-changing-paint3", "gold-paint", "red-metallic-paint"] {
        let Some(path) = common::shared(&format!("brdf/{name}.nbrdf.binary.xz")) else { return };
        let start = std::time::Instant::now();
        let brdf = MeasuredBrdf::load(&path, Lookup::Nearest).expect("a published table");
        let seconds = start.elapsed().as_secs_f64();
        let material = Material::new(name, MaterialKind::Measured(Arc::new(brdf)));
        let mut line = format!("{name:22} ({seconds:.2} s to load)");
        for degrees in [5.0, 31.0, 61.0, 75.0] {
            let [lobe, cosine] = compare(&material, view(degrees), 40_000);
            line += &format!("  {degrees}°: {:.3} / {:.3} max {:.1}", lobe.1, cosine.1, lobe.2);
            assert!(lobe.1 < cosine.1.max(0.2), "{name} at {degrees}°: {} against {}", lobe.1, cosine.1);
        }
        println!("{line}");
        let bsdf = material.bsdf(&SurfaceInput::default());
        let report = chi_square(&bsdf, view(40.0), &ChiSquare { tests: 5, ..ChiSquare::default() });
        assert!(report.passes(), "{name}: {report}");
        assert_eq!(never_breaks(&bsdf, 20_000, 3), Ok(()));
    }
}
