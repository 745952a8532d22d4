//! Importance tables: unbiased, well distributed, quiet.

use std::f32::consts::PI;

use glam::Vec3;
use halflight_frequency::importance::{ImportanceTable, TableSize, point};

fn phong(alpha: f32) -> impl Fn(Vec3, Vec3) -> f32 + Sync {
    move |view, light| Vec3::new(-view.x, -view.y, view.z).dot(light).max(0.0).powf(alpha) * light.z.max(0.0)
}

fn direction(theta: f32, phi: f32) -> Vec3 {
    Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
}

/// ∫ f over the hemisphere.
fn integral(f: impl Fn(Vec3) -> f32) -> f32 {
    let (n, m) = (600, 1200);
    let mut sum = 0.0f64;
    for i in 0..n {
        let theta = (i as f32 + 0.5) / n as f32 * 0.5 * PI;
        for j in 0..m {
            sum += f64::from(theta.sin() * f(direction(theta, 2.0 * PI * j as f32 / m as f32)));
        }
    }
    (sum * f64::from(PI * PI) / f64::from(n * m)) as f32
}

#[test]
fn every_block_of_the_sequence_has_one_point_in_each_box() {
    for seed in [0, 1, 77] {
        for (across, down) in [(16, 1), (4, 4), (1, 16), (2, 8)] {
            for block in 0..4 {
                let mut seen = [0; 16];
                for i in 0..16 {
                    let p = point(block * 16 + i, seed);
                    seen[(p.x * across as f32) as usize * down + (p.y * down as f32) as usize] += 1;
                }
                assert_eq!(seen, [1; 16]);
            }
        }
    }
}

#[test]
fn estimates_meet_the_integral_for_every_number_of_samples_and_every_view() {
    let size = TableSize { vectors: 16, samples: 256, ..TableSize::default() };
    for alpha in [1.0, 50.0, 1000.0] {
        let lobe = phong(alpha);
        let table = ImportanceTable::new(&lobe, size);
        for (theta, phi) in [(0.02, 0.0), (0.7, 1.0), (1.2, 4.0)] {
            let view = direction(theta, phi);
            let light = |d: Vec3| 1.0 + d.x - 0.5 * d.y;
            let truth = integral(|d| lobe(view, d) * light(d));
            for n in [16, 100, 256] {
                let mut mean = 0.0;
                let mut square = 0.0;
                for v in 0..16 {
                    let samples = table.vector(view, v);
                    let sum: f32 = (0..n)
                        .map(|i| {
                            let d = samples.direction(i);
                            lobe(view, d) * light(d) / samples.samples[i].pdf
                        })
                        .sum();
                    let estimate = sum / n as f32 / truth;
                    mean += estimate / 16.0;
                    square += estimate * estimate / 16.0;
                }
                let spread = (square - mean * mean).max(0.0).sqrt();
                eprintln!("alpha {alpha} theta {theta} n {n}: {mean} {spread}");
                assert!(
                    (mean - 1.0).abs() < 0.01 + spread,
                    "alpha {alpha} theta {theta} n {n}: {mean} {spread}"
                );
                assert!(spread < 1.6 / (n as f32).sqrt(), "alpha {alpha} theta {theta} n {n}: {spread}");
            }
        }
    }
}

#[test]
fn densities_integrate_to_one() {
    // E_p[1/p] is the solid angle of the hemisphere.
    let table =
        ImportanceTable::new(phong(20.0), TableSize { samples: 4096, elevations: 4, ..TableSize::default() });
    let samples = table.vector(direction(0.6, 0.0), 1).samples;
    let mean: f32 = samples.iter().map(|s| 1.0 / s.pdf).sum::<f32>() / samples.len() as f32;
    assert!((mean / (2.0 * PI) - 1.0).abs() < 0.05, "{mean}");
    assert!(
        samples
            .iter()
            .all(|s| s.pdf > 0.0 && s.direction.z > 0.0 && (s.direction.length() - 1.0).abs() < 1e-4)
    );
}

#[test]
fn black_and_broken_lobes_are_sampled_uniformly_and_grain_is_respected() {
    let small = TableSize { elevations: 3, azimuths: 1, vectors: 1, samples: 64, rows: 8 };
    for value in [0.0, -3.0, f32::NAN, f32::INFINITY] {
        let table = ImportanceTable::new(|_, _| value, small);
        for s in table.vector(Vec3::NAN, 9).samples {
            assert!((s.pdf * 2.0 * PI - 1.0).abs() < 1e-3, "{value}: {}", s.pdf);
        }
    }
    let grain = |view: Vec3, light: Vec3| if light.dot(Vec3::X) * view.x > 0.0 { 1.0 } else { 0.0 };
    let table = ImportanceTable::new(grain, TableSize { azimuths: 8, ..small });
    for phi in [0.3, 2.8] {
        let view = direction(0.8, phi);
        let samples = table.vector(view, 0);
        let inside = (0..64).filter(|&i| grain(view, samples.direction(i)) > 0.0).count();
        assert!(inside > 56, "{inside}");
    }
    let none = TableSize { elevations: 0, azimuths: 0, vectors: 0, samples: 0, rows: 0 };
    assert_eq!(ImportanceTable::new(|_, _| 1.0, none).vector(Vec3::Z, 0).samples.len(), 1);
}
