use glam::{DMat3, DVec3};
use halflight_sh::{Rotation, Sh, reference};

use crate::common::{Numbers, largest_difference};

fn slow<const N: usize>(f: &Sh<N, f64>, r: &DMat3) -> Sh<N, f64> {
    Sh::from_slice(&reference::rotated(f.coefficients(), r)).expect("as many coefficients")
}

fn both_forms_agree<const N: usize>(limit: f64) {
    let mut numbers = Numbers(4);
    let special = [
        DMat3::IDENTITY,
        DMat3::from_rotation_x(1.0),
        DMat3::from_rotation_z(2.0),
        DMat3::from_rotation_x(std::f64::consts::PI),
        DMat3::from_rotation_y(std::f64::consts::PI),
        DMat3::from_rotation_y(1e-9) * DMat3::from_rotation_z(0.4),
        DMat3::from_rotation_x(1e-17),
    ];
    let random: Vec<DMat3> = (0..60).map(|_| numbers.rotation()).collect();
    for r in special.iter().chain(&random) {
        let f: Sh<N, f64> = numbers.sh();
        let fast = f.rotated(r);
        let worst = largest_difference(&slow(&f, r), &fast);
        assert!(worst < limit, "order {N}: {worst:e} for {r:?}");
        let single = f.cast().rotated(&r.as_mat3()).cast();
        assert!(largest_difference(&single, &fast) < 4e-6, "order {N} in f32");
    }
}

#[test]
fn verified_math_1_euler_form_equals_ivanic_ruedenberg() {
    both_forms_agree::<2>(4e-15);
    both_forms_agree::<3>(4e-15);
    both_forms_agree::<4>(6e-15);
    both_forms_agree::<6>(1e-14);
    both_forms_agree::<8>(2e-14);
}

#[test]
fn rotated_functions_are_the_functions_of_directions_turned_back() {
    let mut numbers = Numbers(5);
    for _ in 0..20 {
        let (f, r): (Sh<5, f64>, _) = (numbers.sh(), numbers.rotation());
        let d = numbers.direction();
        assert!((f.rotated(&r).at(d) - f.at(r.transpose() * d)).abs() < 1e-13);
    }
}

#[test]
fn rotations_form_a_group_and_keep_inner_products_and_products() {
    let mut numbers = Numbers(6);
    for _ in 0..10 {
        let (f, g): (Sh<6, f64>, Sh<6, f64>) = (numbers.sh(), numbers.sh());
        let (a, b) = (numbers.rotation(), numbers.rotation());
        assert!(largest_difference(&f.rotated(&b).rotated(&a), &f.rotated(&(a * b))) < 2e-14);
        assert!((f.rotated(&a).dot(&g.rotated(&a)) - f.dot(&g)).abs() < 1e-13);
        assert!(
            largest_difference(&f.rotated(&a).product(&g.rotated(&a)), &f.product(&g).rotated(&a)) < 1e-13
        );
        let kept = Rotation::from_matrix(&a);
        assert_eq!(kept.apply(&f), f.rotated(&a));
    }
}

#[test]
fn first_band_turns_like_a_vector() {
    let r = DMat3::from_rotation_x(std::f64::consts::FRAC_PI_2);
    // y goes to z.
    let turned = Sh::<2, f64>::basis(DVec3::Y).rotated(&r);
    assert!(largest_difference(&turned, &Sh::basis(DVec3::Z)) < 1e-15);
}
