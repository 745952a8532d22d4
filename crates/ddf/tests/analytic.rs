//! The identities of directed distances on fields that are known exactly, to 1e-9.

use glam::DVec3;
use halflight_ddf::AnalyticField;

fn fields() -> Vec<AnalyticField> {
    let ball = AnalyticField::Sphere { center: DVec3::new(0.1, -0.2, 0.3), radius: 0.7 };
    let cuboid = AnalyticField::Box { center: DVec3::new(-0.2, 0.1, 0.0), half: DVec3::new(0.5, 0.3, 0.8) };
    let torus = AnalyticField::Torus { center: DVec3::new(0.0, 0.1, 0.0), radius: 0.8, tube: 0.25 };
    let plane = AnalyticField::Plane { point: DVec3::new(0.0, -0.4, 0.0), normal: DVec3::new(0.6, 0.8, 0.0) };
    let far = AnalyticField::Sphere { center: DVec3::new(2.0, 0.5, 0.0), radius: 0.4 };
    let union = AnalyticField::Union(vec![ball.clone(), far, torus.clone()]);
    vec![ball, cuboid, torus, plane, union]
}

/// Points of a Halton sequence in a cube, with directions.
fn rays(count: usize) -> impl Iterator<Item = (DVec3, DVec3)> {
    let halton = |mut i: usize, base: usize| {
        let (mut f, mut r) = (1.0, 0.0);
        while i > 0 {
            f /= base as f64;
            r += f * (i % base) as f64;
            i /= base;
        }
        r
    };
    (1..=count).map(move |i| {
        let x = DVec3::new(halton(i, 2), halton(i, 3), halton(i, 5)) * 6.0 - 3.0;
        let (cos, phi) = (1.0 - 2.0 * halton(i, 7), std::f64::consts::TAU * halton(i, 11));
        let sin = (1.0 - cos * cos).sqrt();
        (x, DVec3::new(sin * phi.cos(), sin * phi.sin(), cos))
    })
}

/// A hit that is neither grazing nor near where another one begins to hide it.
fn clear(field: &AnalyticField, x: DVec3, omega: DVec3) -> bool {
    let Some(hit) = field.query(x, omega) else { return false };
    let near = [DVec3::X, DVec3::Y, DVec3::Z].into_iter().flat_map(|axis| [axis, -axis]);
    hit.normal.dot(omega).abs() > 0.1
        && near.into_iter().all(|axis| {
            field.query(x + 1e-3 * axis, omega).is_some_and(|other| {
                (other.distance - hit.distance).abs() < 0.05 && other.normal.distance(hit.normal) < 0.1
            })
        })
}

#[test]
fn the_directed_eikonal_of_002_holds_to_1e_9() {
    for field in fields() {
        let mut checked = 0;
        for (x, omega) in rays(4000).filter(|&(x, omega)| clear(&field, x, omega)) {
            let hit = field.query(x, omega).expect("the ray is clear");
            let step = 0.3 * hit.distance;
            let on = field.query(x + step * omega, omega).expect("the surface is still ahead");
            assert!((on.distance - (hit.distance - step)).abs() < 1e-9, "{field:?} {x} {omega}");
            let gradient = field.gradient(x, omega).expect("a hit");
            assert!((gradient.dot(omega) + 1.0).abs() < 1e-9);
            checked += 1;
        }
        assert!(checked > 100, "{checked} rays for {field:?}");
    }
}

#[test]
fn eq_3_of_002_the_normal_is_the_gradient_scaled_and_points_to_the_origin_of_the_ray() {
    for field in fields() {
        for (x, omega) in rays(4000).filter(|&(x, omega)| clear(&field, x, omega)) {
            let hit = field.query(x, omega).expect("the ray is clear");
            let gradient = field.gradient(x, omega).expect("a hit");
            assert!((gradient.normalize() - hit.normal).length() < 1e-9);
            assert!((gradient.length() - 1.0 / hit.normal.dot(omega).abs()).abs() < 1e-9 * gradient.length());
            assert!(hit.normal.dot(omega) < 0.0);
            // The gradient is that of the field: fourth-order differences, at steps that make them good to 1e-7.
            for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
                let d = |s: f64| field.query(x + s * axis, omega).map_or(f64::NAN, |hit| hit.distance);
                let h = 1e-4;
                let slope = (8.0 * (d(h) - d(-h)) - (d(2.0 * h) - d(-2.0 * h))) / (12.0 * h);
                assert!((slope - gradient.dot(axis)).abs() < 1e-6 * gradient.length().powi(3), "{field:?}");
            }
        }
    }
}

#[test]
fn the_gradient_by_direction_is_distance_times_the_gradient_by_position_across_the_ray() {
    for field in fields() {
        for (x, omega) in rays(4000).filter(|&(x, omega)| clear(&field, x, omega)) {
            let hit = field.query(x, omega).expect("the ray is clear");
            let by_position = field.gradient(x, omega).expect("a hit");
            let across = by_position - omega * omega.dot(by_position);
            let (u, v) = omega.any_orthonormal_pair();
            for axis in [u, v] {
                let d = |s: f64| {
                    let turned = (omega + s * axis).normalize();
                    field.query(x, turned).map_or(f64::NAN, |hit| hit.distance)
                };
                let h = 1e-5;
                let slope = (8.0 * (d(h) - d(-h)) - (d(2.0 * h) - d(-2.0 * h))) / (12.0 * h);
                let expected = hit.distance * across.dot(axis);
                if slope.is_finite() {
                    let scale = (hit.distance * by_position.length().powi(2)).max(1.0).powi(2);
                    assert!((slope - expected).abs() < 1e-4 * scale, "{slope} {expected} {field:?}");
                }
            }
        }
    }
}

#[test]
fn eq_5_of_002_the_unsigned_distance_is_the_least_over_all_directions() {
    for field in fields() {
        for (x, _) in rays(60) {
            let truth = field.unsigned_distance(x);
            let mut least = f64::INFINITY;
            for (_, omega) in rays(3000) {
                let found = field.query(x, omega).map_or(f64::INFINITY, |hit| hit.distance);
                assert!(found >= truth - 1e-9, "{field:?} at {x}");
                least = least.min(found);
            }
            // The nearest of 3000 directions is off by about 0.03, and meets an edge up to so much farther along.
            assert!(least < truth + 0.05 * (1.0 + truth), "{least} {truth} {field:?} at {x}");
        }
    }
}

#[test]
fn curvature_follows_from_second_derivatives_along_the_tangents() {
    // Against a ball of radius r, straight on: φ(x + s u) − φ(x) = s²/(2r) + O(s⁴).
    let ball = AnalyticField::Sphere { center: DVec3::ZERO, radius: 0.8 };
    let d = |s: f64| ball.query(DVec3::new(s, 0.0, 2.0), DVec3::NEG_Z).map_or(f64::NAN, |hit| hit.distance);
    let h = 1e-3;
    let second = (d(h) - 2.0 * d(0.0) + d(-h)) / (h * h);
    assert!((second - 1.0 / 0.8).abs() < 1e-5, "{second}");
}

#[test]
fn rays_without_direction_or_with_numbers_that_are_none_see_nothing() {
    for field in fields() {
        for (x, omega) in [(DVec3::ZERO, DVec3::ZERO), (DVec3::NAN, DVec3::X), (DVec3::ZERO, DVec3::INFINITY)]
        {
            assert!(field.query(x, omega).is_none());
            assert!(!field.is_visible(x, omega));
        }
    }
}
