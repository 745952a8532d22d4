use std::f64::consts::FRAC_PI_2;

use halflight_sh::attenuation::Cap;
use halflight_sh::{
    BlockerTable, ClosedForm, Exponential, Sh, Zh, closed_form, exact_log_visibility, log_lobe,
    optimal_linear,
};

use crate::common::{Numbers, largest_difference, rms};

#[test]
fn exact_exponential_is_the_limit_of_the_power_series() {
    let mut numbers = Numbers(9);
    let f: Sh<4, f64> = numbers.sh();
    let (mut sum, mut power) = (Sh::one(), Sh::one());
    for n in 1..60 {
        power = power.product(&f) * (1.0 / f64::from(n));
        sum += power;
    }
    assert!(largest_difference(&sum, &f.exp()) < 1e-11);
}

#[test]
fn zonal_logarithm_and_exponential_equal_the_general_ones() {
    for degrees in [5.0f64, 30.0, 60.0, 88.0] {
        let visible = Zh::<5, f64>::one() - Zh::cap(degrees.to_radians());
        assert!(largest_difference(&visible.log(0.02).to_sh(), &visible.to_sh().log(0.02)) < 1e-10);
        let log = visible.log(0.02);
        assert!(largest_difference(&log.exp().to_sh(), &log.to_sh().exp()) < 1e-10);
    }
    let lobe = Zh::<4, f64>::phong(4.0);
    let largest = lobe.to_sh().eigenvalues()[15];
    assert!(largest_difference(&lobe.log_relative(0.01).to_sh(), &lobe.to_sh().log(0.01 * largest)) < 1e-10);
}

#[test]
fn verified_math_2_eigenvalues_reach_the_floor_where_stated() {
    fn angle_of_floor<const N: usize>() -> f64 {
        let smallest =
            |degrees: f64| (Zh::<N, f64>::one() - Zh::cap(degrees.to_radians())).to_sh().eigenvalues()[0];
        let (mut low, mut high) = (1.0, 90.0);
        for _ in 0..30 {
            let middle = 0.5 * (low + high);
            if smallest(middle) > 0.02 { low = middle } else { high = middle }
        }
        low
    }
    assert!((angle_of_floor::<3>() - 64.8).abs() < 0.06);
    assert!((angle_of_floor::<4>() - 48.9).abs() < 0.06);
    assert!((angle_of_floor::<5>() - 39.2).abs() < 0.06);
    assert!((angle_of_floor::<6>() - 32.7).abs() < 0.06);
}

#[test]
fn verified_math_2_round_trip_errors_are_at_the_stated_levels() {
    let error = |degrees: f64| {
        let visible = Zh::<4, f64>::one() - Zh::cap(degrees.to_radians());
        rms(&visible.log(0.02).exp().to_sh(), &visible.to_sh())
    };
    for degrees in [1.0, 10.0, 20.0, 30.0, 40.0] {
        assert!(error(degrees) < 1.4e-4, "{degrees}: {}", error(degrees));
    }
    assert!((error(45.0) / 1e-3 - 1.0).abs() < 0.5, "{}", error(45.0));
    assert!((error(50.0) / 8e-3 - 1.0).abs() < 0.3, "{}", error(50.0));
    for degrees in [55.0, 60.0, 65.0, 70.0, 75.0] {
        assert!((2.5e-2..5e-2).contains(&error(degrees)), "{degrees}: {}", error(degrees));
    }
    assert!((error(90.0) / 1.3e-2 - 1.0).abs() < 0.2, "{}", error(90.0));
}

#[test]
fn verified_math_2_table_of_128_entries_is_within_2e_4() {
    let worst = |entries: usize| {
        let table = BlockerTable::<4>::with(entries, 0.02);
        (0..900)
            .map(|step| {
                let angle = (f64::from(step) + 0.5) / 900.0 * FRAC_PI_2;
                let visible = Zh::<4, f64>::one() - Zh::cap(angle);
                let _ = visible;
                let exact = exact_log_visibility::<4>(angle, 0.02).exp().to_sh();
                let looked_up = table.lookup(angle as f32).map(f64::from).exp().to_sh();
                rms(&exact, &looked_up)
            })
            .fold(0.0, f64::max)
    };
    assert!(worst(128) < 3e-4, "{}", worst(128));
    assert!(worst(64) < 1.5e-3, "{}", worst(64));
}

#[test]
fn equation_000_closed_form_is_log_epsilon_times_the_cap() {
    let cap = Zh::<4, f64>::cap(0.5);
    let fixed = closed_form::<4>(ClosedForm::Fixed { epsilon: 0.2 }, 0.5);
    for l in 0..4 {
        assert!((fixed.0[l] - 0.2f64.ln() * cap.0[l]).abs() < 1e-14);
    }
    assert_eq!(ClosedForm::ByAngle.log_epsilon(0.0), -1.0);
    assert!((ClosedForm::ByAngle.log_epsilon(40f64.to_radians()) + 2.01).abs() < 1e-9);
    assert!((ClosedForm::ByAngle.log_epsilon(2.0) + 2.46).abs() < 1e-9);
    // A small blocker: the right log ε darkens by its solid angle, a small ε by three times that.
    let direction = glam::Vec3::Z;
    let cap = Cap { direction, half_angle: 0.05 };
    let darkened = |form| {
        1.0 - Exponential::Exact.apply(&BlockerTable::<4>::closed_form(form).log_visibility(&cap))[0]
            / Sh::<4>::one()[0]
    };
    let truth = cap.solid_angle() / (4.0 * std::f32::consts::PI);
    assert!((darkened(ClosedForm::ByAngle) / truth - 1.0).abs() < 0.02);
    assert!(darkened(ClosedForm::Fixed { epsilon: 0.05 }) / truth > 2.8);
}

#[test]
fn verified_math_4_log_lobe_values() {
    let expected = [
        (1.0, [-14.26864, 6.73501, 1.10099, -2.09166]),
        (2.0, [-14.6322, 6.06621, 2.40706, -1.49650]),
        (4.0, [-15.61258, 5.13060, 3.20656, 0.45213]),
        (8.0, [-16.26257, 3.12228, 3.54235, 3.26881]),
    ];
    for (exponent, values) in expected {
        let zh = log_lobe::<4>(exponent, Exponential::Exact);
        for l in 0..4 {
            assert!((zh.0[l] - values[l]).abs() < 2e-4, "exponent {exponent}: {:?}", zh.0);
        }
    }
}

#[test]
fn log_lobe_has_the_energy_of_the_lobe_under_the_exponential_that_shades() {
    for form in [Exponential::Exact, Exponential::default()] {
        let lobe = form.apply(&log_lobe::<4>(3.0, form).to_sh());
        assert!((lobe[0] / Zh::<4>::phong(3.0).0[0] - 1.0).abs() < 1e-4);
    }
}

#[test]
fn verified_math_2_optimal_linear_table_of_order_4() {
    assert_eq!(optimal_linear(4, 0.0), (1.0, 1.0));
    let stated = [
        (0.5, 1.0095, 0.936),
        (1.0, 1.0365, 0.884),
        (1.5, 1.078, 0.825),
        (2.0, 1.1345, 0.796),
        (3.0, 1.293, 0.773),
        (4.0, 1.511, 0.777),
        (6.0, 2.165, 0.852),
        (8.0, 3.147, 0.949),
    ];
    for (norm, a, b) in stated {
        let found = optimal_linear(4, norm);
        eprintln!("{norm}: {found:?} stated {a} {b}");
        // The median is over other random sets; its spread is said to grow from 1 % to 25 %.
        let tolerance = 0.02 + 0.012 * norm;
        assert!((found.0 / a - 1.0).abs() < tolerance && (found.1 / b - 1.0).abs() < tolerance + 0.03);
    }
}

#[test]
fn every_exponential_of_a_small_vector_is_the_exact_one() {
    let mut numbers = Numbers(10);
    let f = (numbers.sh::<4>() * 0.05).cast();
    for form in [
        Exponential::default(),
        Exponential::FixedSquaring { squarings: 3 },
        Exponential::LinearSquaring { threshold: 0.02 },
        Exponential::Linear,
        Exponential::Series { degree: 4 },
        Exponential::PlainSeries { degree: 6 },
    ] {
        let error = rms(&form.apply(&f).cast(), &f.exp().cast());
        assert!(error < 3e-3, "{form:?}: {error}");
    }
    let zero = Sh::<4>::zero();
    assert_eq!(Exponential::default().apply(&zero), Sh::one());
}

#[test]
fn large_and_broken_vectors_end() {
    let mut f = Sh::<4>::zero();
    f[3] = 1e30;
    let _ = Exponential::default().apply(&f);
    f[3] = f32::NAN;
    let _ = Exponential::default().apply(&f);
    let _ = f.exp();
}
