//! Other libraries' coefficients, against values that their own formulas give.

// The constants are the libraries' own, digit by digit.
#![allow(clippy::excessive_precision)]

use std::f64::consts::PI;

use glam::DVec3;
use halflight_sh::convert::{Convention, E3nnNorm};
use halflight_sh::{Sh, ShError};

const D: DVec3 = DVec3::new(0.36, 0.48, 0.8);

/// In an orthonormal basis, the coefficients of a point of light are the basis functions towards it.
fn point_of_light<const N: usize>(convention: Convention) -> Vec<f64> {
    Sh::<N, f64>::basis(D).to_convention(convention).expect("an order that the library has")
}

fn close(found: &[f64], expected: &[f64], limit: f64) {
    assert_eq!(found.len(), expected.len());
    for (i, (a, b)) in found.iter().zip(expected).enumerate() {
        assert!((a - b).abs() < limit, "coefficient {i}: {a} and {b}");
    }
}

#[test]
fn directxmath_has_the_condon_shortley_phase() {
    let DVec3 { x, y, z } = D;
    let (s1, c1) = (y, x);
    let (s2, c2) = (x * s1 + y * c1, x * c1 - y * s1);
    let (s3, c3) = (x * s2 + y * c2, x * c2 - y * s2);
    // The constants of sh_eval_basis_3.
    let p21 = -1.092_548_430_592_079_2 * z;
    let p31 = -2.285_228_997_322_328_8 * z * z + 0.457_045_799_464_465_77;
    let p32 = 1.445_305_721_320_277_1 * z;
    let expected = [
        0.282_094_791_773_878_14,
        -0.488_602_511_902_919_92 * s1,
        0.488_602_511_902_919_92 * z,
        -0.488_602_511_902_919_92 * c1,
        0.546_274_215_296_039_59 * s2,
        p21 * s1,
        0.946_174_695_757_560_08 * z * z - 0.315_391_565_252_520_05,
        p21 * c1,
        0.546_274_215_296_039_59 * c2,
        -0.590_043_589_926_643_52 * s3,
        p32 * s2,
        p31 * s1,
        z * (1.865_881_662_950_577 * z * z - 1.119_528_997_770_346_2),
        p31 * c1,
        p32 * c2,
        -0.590_043_589_926_643_52 * c3,
    ];
    close(&point_of_light::<4>(Convention::DirectXMath), &expected, 1e-14);
}

#[test]
fn threejs_is_ours_to_six_digits() {
    let DVec3 { x, y, z } = D;
    // getBasisAt.
    let expected = [
        0.282095,
        0.488603 * y,
        0.488603 * z,
        0.488603 * x,
        1.092548 * x * y,
        1.092548 * y * z,
        0.315392 * (3.0 * z * z - 1.0),
        1.092548 * x * z,
        0.546274 * (x * x - y * y),
    ];
    close(&point_of_light::<3>(Convention::ThreeJs), &expected, 1e-6);
    // getIrradianceAt of the same coefficients is our irradiance.
    let light = Sh::<3, f64>::basis(D);
    let c = light.to_convention(Convention::ThreeJs).unwrap();
    let DVec3 { x, y, z } = DVec3::new(0.48, -0.6, 0.64);
    let theirs = c[0] * 0.886227
        + 2.0 * 0.511664 * (c[1] * y + c[2] * z + c[3] * x)
        + 2.0 * 0.429043 * (c[4] * x * y + c[5] * y * z + c[7] * x * z)
        + c[6] * (0.743125 * z * z - 0.247708)
        + c[8] * 0.429043 * (x * x - y * y);
    assert!((theirs - light.irradiance().at(DVec3::new(x, y, z))).abs() < 3e-6);
}

#[test]
fn e3nn_has_y_as_its_polar_axis() {
    let DVec3 { x, y, z } = D;
    let r = x * x + z * z;
    // _spherical_harmonics, in the normalization `component`.
    let s20 = 15f64.sqrt() * x * z;
    let s24 = 0.5 * 15f64.sqrt() * (z * z - x * x);
    let component = [
        1.0,
        3f64.sqrt() * x,
        3f64.sqrt() * y,
        3f64.sqrt() * z,
        s20,
        15f64.sqrt() * x * y,
        5f64.sqrt() * (y * y - 0.5 * r),
        15f64.sqrt() * y * z,
        s24,
        42f64.sqrt() / 6.0 * (s20 * z + s24 * x),
        7f64.sqrt() * s20 * y,
        168f64.sqrt() / 8.0 * (4.0 * y * y - r) * x,
        0.5 * 7f64.sqrt() * y * (2.0 * y * y - 3.0 * r),
        168f64.sqrt() / 8.0 * z * (4.0 * y * y - r),
        7f64.sqrt() * s24 * y,
        42f64.sqrt() / 6.0 * (s24 * z - s20 * x),
    ];
    let integral: Vec<f64> = component.iter().map(|value| value / (4.0 * PI).sqrt()).collect();
    close(&point_of_light::<4>(Convention::E3nn(E3nnNorm::Integral)), &integral, 1e-14);
    // In every normalization coefficients times basis give the function back.
    let mut f = Sh::<4, f64>::zero();
    for i in 0..16 {
        f[i] = 1.0 / (i as f64 + 2.0);
    }
    let reconstructed = |norm: E3nnNorm, scale: &dyn Fn(usize) -> f64| -> f64 {
        let c = f.to_convention(Convention::E3nn(norm)).unwrap();
        (0..16).map(|i| c[i] * component[i] * scale(i.isqrt())).sum()
    };
    for found in [
        reconstructed(E3nnNorm::Component, &|_| 1.0),
        reconstructed(E3nnNorm::Integral, &|_| 1.0 / (4.0 * PI).sqrt()),
        reconstructed(E3nnNorm::Norm, &|l| 1.0 / (2.0 * l as f64 + 1.0).sqrt()),
    ] {
        assert!((found - f.at(D)).abs() < 1e-13);
    }
}

#[test]
fn filament_has_the_phase_unscaled_and_polynomials_pre_scaled() {
    let DVec3 { x, y, z } = D;
    // CubemapSH::TSH.
    let p = PI.sqrt();
    let tsh = [
        1.0 / (2.0 * p),
        -3f64.sqrt() * y / (2.0 * p),
        3f64.sqrt() * z / (2.0 * p),
        -3f64.sqrt() * x / (2.0 * p),
        15f64.sqrt() * y * x / (2.0 * p),
        -15f64.sqrt() * y * z / (2.0 * p),
        5f64.sqrt() * (3.0 * z * z - 1.0) / (4.0 * p),
        -15f64.sqrt() * z * x / (2.0 * p),
        15f64.sqrt() * (x * x - y * y) / (4.0 * p),
    ];
    close(&point_of_light::<3>(Convention::FilamentPhase), &tsh, 1e-14);
    // computeIrradianceSH3Bands of one direction.
    let (c0, c1, c2) = (PI, 2.0 * PI / 3.0, PI / 4.0);
    let q = 1.0 / (PI * PI);
    let scaled = [
        q / 4.0 * c0,
        q / 4.0 * 3.0 * c1 * y,
        q / 4.0 * 3.0 * c1 * z,
        q / 4.0 * 3.0 * c1 * x,
        q / 4.0 * 15.0 * c2 * y * x,
        q / 4.0 * 15.0 * c2 * y * z,
        q / 16.0 * 5.0 * c2 * (3.0 * z * z - 1.0),
        q / 4.0 * 15.0 * c2 * z * x,
        q / 16.0 * 15.0 * c2 * (x * x - y * y),
    ];
    close(&point_of_light::<3>(Convention::FilamentIrradiance), &scaled, 1e-14);
    // A white sky has irradiance π; Filament writes it over π.
    let white = Sh::<3, f64>::one().to_convention(Convention::FilamentIrradiance).unwrap();
    assert!((white[0] - 1.0).abs() < 1e-14);
}

#[test]
fn every_convention_comes_back_unchanged() {
    let mut f = Sh::<3, f64>::zero();
    for i in 0..9 {
        f[i] = (i as f64 * 1.7).sin();
    }
    for (name, convention) in Convention::ALL {
        assert_eq!(Convention::from_name(name), Some(convention));
        let there = f.to_convention(convention).unwrap();
        let back = Sh::<3, f64>::from_convention(convention, &there).unwrap();
        close(back.coefficients(), f.coefficients(), 1e-14);
    }
    assert_eq!(Convention::from_name("unreal"), None);
}

#[test]
fn orders_that_a_library_lacks_are_refused() {
    assert_eq!(Sh::<4, f64>::zero().to_convention(Convention::ThreeJs), Err(ShError::Order { order: 4 }));
    assert!(matches!(
        Sh::<3, f64>::from_convention(Convention::ThreeJs, &[0.0; 4]),
        Err(ShError::Length { expected: 9, found: 4, .. })
    ));
}
