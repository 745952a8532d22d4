use std::f64::consts::{FRAC_PI_2, PI};

use halflight_sh::{Sh, Zh, reference};

use crate::common::{Numbers, largest_difference};

#[test]
fn verified_math_1_cap_closed_forms_of_000() {
    for step in 0..=90 {
        let t = f64::from(step).to_radians();
        let (c, s) = (t.cos(), t.sin());
        let z = Zh::<4, f64>::cap(t).0;
        let closed = [
            PI.sqrt() * (1.0 - c),
            (3.0 * PI).sqrt() / 2.0 * s * s,
            (5.0 * PI).sqrt() / 2.0 * c * s * s,
            (7.0 * PI).sqrt() / 16.0 * (3.0 + 5.0 * (2.0 * t).cos()) * s * s,
        ];
        for l in 0..4 {
            assert!((z[l] - closed[l]).abs() < 1e-14, "{step}°, band {l}: {} {}", z[l], closed[l]);
        }
    }
}

#[test]
fn verified_math_1_clamped_cosine_values() {
    let expected = [0.886_227, 1.023_327, 0.495_416, 0.0, -0.110_778, 0.0];
    for (z, expected) in Zh::<6, f64>::clamped_cosine().0.iter().zip(expected) {
        assert!((z - expected).abs() < 1e-6);
    }
}

#[test]
fn phong_lobes_equal_quadrature_and_integrate_to_one() {
    for exponent in [1.0, 2.0, 4.0, 16.0, 64.0] {
        let lobe = |angle: f64| (exponent + 1.0) / (2.0 * PI) * angle.cos().max(0.0).powf(exponent);
        let slow = Zh::<6, f64>::of_angle(lobe, &[FRAC_PI_2]);
        let fast = Zh::<6, f64>::phong(exponent);
        for l in 0..6 {
            assert!((slow.0[l] - fast.0[l]).abs() < 1e-12, "exponent {exponent}, band {l}");
        }
        assert!((fast.0[0] * (4.0 * PI).sqrt() - 1.0).abs() < 1e-14);
    }
}

#[test]
fn zonal_functions_turn_to_directions_like_general_ones() {
    let mut numbers = Numbers(7);
    for _ in 0..20 {
        let zh = Zh::<6, f64>(std::array::from_fn(|_| numbers.signed()));
        let r = numbers.rotation();
        let turned = zh.to_direction(r.z_axis);
        assert!(largest_difference(&turned, &zh.to_sh().rotated(&r)) < 2e-14);
        let d = numbers.direction();
        assert!((turned.at(d) - zh.at_angle(d.dot(r.z_axis).clamp(-1.0, 1.0).acos())).abs() < 1e-12);
    }
}

#[test]
fn irradiance_is_the_cosine_weighted_integral() {
    let mut numbers = Numbers(8);
    let radiance: Sh<3, f64> = numbers.sh();
    for _ in 0..5 {
        let normal = numbers.direction();
        let slow: f64 = reference::sphere_quadrature(200)
            .iter()
            .map(|(d, weight)| weight * radiance.at(*d) * d.dot(normal).max(0.0))
            .sum();
        assert!((radiance.irradiance().at(normal) - slow).abs() < 1e-4);
        let lobe = Zh::clamped_cosine().to_direction(normal);
        assert!((radiance.dot(&lobe) - radiance.irradiance().at(normal)).abs() < 1e-13);
    }
}
