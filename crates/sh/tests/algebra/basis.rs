use glam::{DVec3, Vec3};
use halflight_sh::{Sh, reference};

use crate::common::Numbers;

fn against_reference<const N: usize>() {
    let mut numbers = Numbers(1);
    for _ in 0..200 {
        let d = numbers.direction();
        let slow = reference::basis(N, d);
        let fast = Sh::<N, f64>::basis(d);
        let single = Sh::<N>::basis(d.as_vec3());
        for i in 0..N * N {
            assert!((slow[i] - fast[i]).abs() < 2e-14, "order {N}, coefficient {i}: {} {}", slow[i], fast[i]);
            assert!((slow[i] - f64::from(single[i])).abs() < 4e-6, "order {N}, coefficient {i}");
        }
    }
}

#[test]
fn unrolled_polynomials_equal_the_definition_at_every_order() {
    against_reference::<1>();
    against_reference::<2>();
    against_reference::<3>();
    against_reference::<4>();
    against_reference::<5>();
    against_reference::<6>();
    against_reference::<7>();
    against_reference::<8>();
}

#[test]
fn verified_math_1_y_11_is_positive_on_the_x_axis() {
    assert!((Sh::<2>::basis(Vec3::X)[3] - 0.488_603).abs() < 1e-6);
    assert!((Sh::<2>::basis(Vec3::Y)[1] - 0.488_603).abs() < 1e-6);
    assert!((Sh::<2>::basis(Vec3::Z)[2] - 0.488_603).abs() < 1e-6);
}

#[test]
fn verified_math_1_basis_is_orthonormal_to_1e_12_in_f64_and_1e_6_in_f32() {
    let (mut double, mut single) = (vec![0.0; 64 * 64], vec![0.0; 64 * 64]);
    for (d, weight) in reference::sphere_quadrature(16) {
        let (y, y32) = (Sh::<8, f64>::basis(d), Sh::<8>::basis(d.as_vec3()));
        for i in 0..64 {
            for j in 0..64 {
                double[i * 64 + j] += weight * y[i] * y[j];
                single[i * 64 + j] += weight * f64::from(y32[i] * y32[j]);
            }
        }
    }
    for i in 0..64 {
        for j in 0..64 {
            let target = if i == j { 1.0 } else { 0.0 };
            assert!((double[i * 64 + j] - target).abs() < 1e-12, "({i}, {j}): {}", double[i * 64 + j]);
            assert!((single[i * 64 + j] - target).abs() < 1e-6, "({i}, {j}): {}", single[i * 64 + j]);
        }
    }
}

#[test]
fn poles_are_finite_and_have_only_zonal_values() {
    for z in [1.0, -1.0] {
        let sh = Sh::<8, f64>::basis(DVec3::new(0.0, 0.0, z));
        for l in 0..8 {
            for (place, value) in sh.band(l).iter().enumerate() {
                if place == l {
                    let k = ((2.0 * l as f64 + 1.0) / (4.0 * std::f64::consts::PI)).sqrt();
                    assert!((value - k * z.powi(l as i32)).abs() < 1e-14);
                } else {
                    assert_eq!(*value, 0.0);
                }
            }
        }
    }
}
