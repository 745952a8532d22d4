//! Predicted bandwidth against a windowed Fourier transform of pictures whose geometry is exact: planes, spheres and
//! cylinders that mirror a band-limited sky, by themselves or through a lobe.

use std::f32::consts::TAU;

use glam::Vec3;
use halflight_frequency::bandwidth::{Exit, lobe, pixel};
use halflight_frequency::measured;
use halflight_image::Plane;
use rayon::prelude::*;

const FOV: f32 = 0.6;
const SIDE: usize = 256;
const EYE: Vec3 = Vec3::new(0.0, 0.0, 6.0);

#[derive(Clone, Copy, Debug)]
enum Shape {
    /// Faces the eye, turned about the vertical by an angle.
    Plane(f32),
    /// Of radius 1.5 about the origin.
    Sphere,
    /// Of radius 1.2 about the vertical axis.
    Cylinder,
}

struct Point {
    distance: f32,
    cos: f32,
    mirror: Vec3,
    curvature: f32,
    other_curvature: f32,
}

fn pixel_direction(x: f32, y: f32) -> Vec3 {
    let t = 2.0 * (0.5 * FOV).tan() / SIDE as f32;
    Vec3::new((x - SIDE as f32 / 2.0) * t, (SIDE as f32 / 2.0 - y) * t, -1.0).normalize()
}

fn hit(shape: Shape, d: Vec3) -> Option<Point> {
    let round = |o: Vec3, dir: Vec3, radius: f32| {
        let (a, b, c) = (dir.length_squared(), o.dot(dir), o.length_squared() - radius * radius);
        let root = b * b - a * c;
        (root > 0.0).then(|| (-b - root.sqrt()) / a)
    };
    let (distance, normal, curvature, other_curvature) = match shape {
        Shape::Plane(turn) => {
            let n = Vec3::new(turn.sin(), 0.0, turn.cos());
            (-EYE.dot(n) / d.dot(n), n, 0.0, 0.0)
        }
        Shape::Sphere => {
            let t = round(EYE, d, 1.5)?;
            (t, (EYE + d * t) / 1.5, 1.0 / 1.5, 1.0 / 1.5)
        }
        Shape::Cylinder => {
            let flat = Vec3::new(1.0, 0.0, 1.0);
            let t = round(EYE * flat, d * flat, 1.2)?;
            (t, (EYE + d * t) * flat / 1.2, 1.0 / 1.2, 0.0)
        }
    };
    let cos = -d.dot(normal);
    (cos > 0.0).then(|| Point { distance, cos, mirror: d + 2.0 * cos * normal, curvature, other_curvature })
}

fn hash(mut x: u32) -> f32 {
    x = (x ^ 61) ^ (x >> 16);
    x = x.wrapping_mul(9);
    x = (x ^ (x >> 4)).wrapping_mul(0x27d4_eb2d);
    (x ^ (x >> 15)) as f32 / u32::MAX as f32
}

/// Plane waves in space whose frequencies fill the ball of radius `most`: seen along any direction, a disc that is even near
/// its centre.
fn waves(most: f32, count: u32) -> Vec<(Vec3, f32)> {
    (0..count)
        .map(|i| {
            let z = 2.0 * hash(4 * i) - 1.0;
            let (s, c) = (TAU * hash(4 * i + 1)).sin_cos();
            let r = (1.0 - z * z).sqrt();
            let size = most * hash(4 * i + 2).cbrt();
            (Vec3::new(r * c, r * s, z) * size, TAU * hash(4 * i + 3))
        })
        .collect()
}

fn sky(waves: &[(Vec3, f32)], direction: Vec3) -> f32 {
    waves.iter().map(|(k, phase)| (TAU * k.dot(direction) + phase).cos()).sum()
}

/// What a Gaussian lobe of exponent α makes of a sky of waves: each loses exp(−2π² r² ν²), r² = 1/α, by its frequency ν
/// across the direction.
fn blurred(waves: &[(Vec3, f32)], direction: Vec3, alpha: f32) -> f32 {
    waves
        .iter()
        .map(|(k, phase)| {
            let along = k.dot(direction);
            let across = k.length_squared() - along * along;
            (-0.5 * TAU * TAU / alpha * across).exp() * (TAU * along + phase).cos()
        })
        .sum()
}

/// Ratios of prediction to measurement over the well-resolved pixels of a picture.
fn ratios(shape: Shape, most: f32, alpha: Option<f32>, spectrum: f32) -> Vec<f32> {
    // Of a sky that is sharper than the lobe few waves are left: take more.
    let waves = waves(most, if alpha.is_some() { 1000 } else { 150 });
    let points: Vec<Option<Point>> = (0..SIDE * SIDE)
        .map(|i| hit(shape, pixel_direction((i % SIDE) as f32 + 0.5, (i / SIDE) as f32 + 0.5)))
        .collect();
    let shade = |p: &Option<Point>| {
        p.as_ref()
            .map_or(0.0, |p| alpha.map_or_else(|| sky(&waves, p.mirror), |a| blurred(&waves, p.mirror, a)))
    };
    let picture = Plane { width: SIDE, height: SIDE, values: points.par_iter().map(shade).collect() };
    let angle = pixel::pixel_angle(FOV, SIDE as f32, 1.0);
    let rho = alpha.map_or(f32::INFINITY, lobe::phong);
    let mut ratios = Vec::new();
    for y in (32..SIDE - 32).step_by(8) {
        for x in (32..SIDE - 32).step_by(8) {
            let square = (0..32 * 32).all(|i| points[(y + i / 32 - 16) * SIDE + x + i % 32 - 16].is_some());
            let Some(p) = points[y * SIDE + x].as_ref().filter(|p| square && p.cos > 0.55) else { continue };
            let exit = Exit { curvature: p.curvature, distance: p.distance, cos_exit: p.cos, texture: 0.0 };
            let angular = exit.distant(spectrum, rho).angular * exit.roundness(p.other_curvature);
            let predicted = pixel::pixel_bandwidth(angular, angle, angle);
            if (0.12..0.4).contains(&predicted) {
                ratios.push(predicted / measured::windowed_bandwidth(&picture, x, y));
            }
        }
    }
    ratios.sort_by(f32::total_cmp);
    ratios
}

fn check(shape: Shape, most: f32, alpha: Option<f32>) {
    // Of a ball seen from afar, 1 − (1 − q²)^(3/2) lies within q of its radius: 95 % within 0.93.
    let ratios = ratios(shape, most, alpha, 0.93 * most);
    let n = ratios.len();
    assert!(n > 60, "{shape:?}: only {n} pixels");
    let inside = ratios.iter().filter(|r| (1.0 / 1.3..1.3).contains(*r)).count();
    let at = |q: f32| ratios[(q * (n - 1) as f32) as usize];
    eprintln!(
        "{shape:?} {most} {alpha:?}: {n} pixels, {:.2} {:.2} {:.2}, {inside} inside",
        at(0.05),
        at(0.5),
        at(0.95)
    );
    assert!(
        inside * 10 >= n * 9,
        "{shape:?} {most} {alpha:?}: {inside} of {n} within 1.3; median {}",
        at(0.5)
    );
}

#[test]
fn mirrors_show_a_sky_as_fast_as_predicted() {
    check(Shape::Plane(0.0), 90.0, None);
    check(Shape::Plane(0.8), 90.0, None);
    check(Shape::Sphere, 12.0, None);
    check(Shape::Cylinder, 10.0, None);
}

#[test]
fn lobes_limit_what_is_seen_as_predicted() {
    // The sky is far sharper than the lobes pass.
    check(Shape::Sphere, 30.0, Some(900.0));
    check(Shape::Cylinder, 50.0, Some(2000.0));
    check(Shape::Plane(0.3), 300.0, Some(100_000.0));
}
