//! Random chains of events: nothing ever becomes negative, and what is different on paper is different in numbers.

use crate::support::{Numbers, difference};
use halflight_frequency::covariance::{
    Covariance, Covariance2, Covariance3, Covariance4, Covariance5, Interface, Mean, microfacet_lobe, printed,
};

fn random_event<const N: usize>(light: Covariance<N>, numbers: &mut Numbers) -> Covariance<N> {
    let pick = (numbers.next_number() * 14.0) as u32;
    let mut between = |a: f64, b: f64| numbers.between(a, b);
    match pick {
        0 => light.travel(between(0.0, 10.0)),
        1 => light.rotate(between(-3.0, 3.0)),
        2 => light.arrive(between(0.0, 1.0)),
        3 => light.leave(between(0.0, 1.0)),
        4 => light.curve([between(-5.0, 5.0), between(-1.0, 1.0), between(-5.0, 5.0)], between(0.0, 1.0)),
        5 => light.occlude(10f64.powf(between(-4.0, 2.0))),
        6 => light.texture([between(0.0, 1e4), between(-1e2, 1e2), between(0.0, 1e4)]),
        7 => light.cosine(between(0.0, 1.0)),
        8 => light.reflect(microfacet_lobe(between(0.001, 1.0), between(0.0, 1.0))),
        9 => light
            .refract(&Interface {
                indices: [between(1.0, 2.0), between(1.0, 2.0)],
                cos_in: between(0.0, 1.0),
            })
            .unwrap_or(light),
        10 => light.thin_lens(between(-3.0, 3.0)),
        11 => light.into_motion([between(-9.0, 9.0), between(-9.0, 9.0)], [between(-1.0, 1.0), 0.0]),
        12 => light.scatter(between(-1.0, 1.0), between(0.0, 2.0)),
        _ => light.absorb([between(-3.0, 9.0), between(-1.0, 1.0), between(-3.0, 9.0)]),
    }
}

/// Chains of one to twelve events; returns the most negative eigenvalue over the trace.
fn chains<const N: usize>(count: usize, seed: u64) {
    let mut numbers = Numbers(seed);
    for number in 0..count {
        let mut light = match number % 4 {
            0 => Covariance::ZERO,
            1 => Covariance::<N>::diagonal(std::array::from_fn(|i| if i == N / 2 { 3.0 } else { 0.0 })),
            2 => Covariance::diagonal([1.0; N]),
            _ => Covariance::of_window(std::array::from_fn(|i| 0.01 + 0.1 * i as f64)),
        };
        for _ in 0..1 + (numbers.next_number() * 12.0) as usize {
            light = random_event(light, &mut numbers);
        }
        assert!(light.rows.iter().flatten().all(|v| v.is_finite()), "{number}: {light:?}");
        assert!(light.is_positive_semidefinite(1e-9), "{number}: {:?} of {light:?}", light.eigenvalues());
    }
}

#[test]
fn a_million_random_chains_stay_positive_semidefinite() {
    chains::<2>(250_000, 1);
    chains::<3>(250_000, 2);
    chains::<4>(250_000, 3);
    chains::<5>(250_000, 4);
}

#[test]
fn paths_together_vary_as_their_light_weighted_mean() {
    let (a, b) = (Covariance4::diagonal([1.0; 4]), Covariance4::diagonal([3.0; 4]).travel(1.0));
    let mut mean = Mean::default();
    mean.add(&a, 3.0);
    mean.add(&b, 1.0);
    mean.add(&b, f64::NAN);
    mean.add(&b, -1.0);
    let together = mean.covariance();
    for i in 0..4 {
        for j in 0..4 {
            assert!((together.rows[i][j] - 0.75 * a.rows[i][j] - 0.25 * b.rows[i][j]).abs() < 1e-12);
        }
    }
    assert_eq!(Mean::<5>::default().covariance(), Covariance5::ZERO);
}

#[test]
fn slide_refraction_as_printed_is_upside_down() {
    let interface = Interface { indices: [1.0, 1.5], cos_in: 1.0f64.cos() };
    let cos_out = interface.cos_out().unwrap();
    let light = Covariance2::diagonal([0.0, 1.0]);
    let right = light.refract_without_window(&interface).unwrap().rows[1][1].sqrt();
    let printed = printed::refract(light, interface.indices, [interface.cos_in, cos_out]).rows[1][1].sqrt();
    assert!((right - 2.301).abs() < 4e-3 && (printed - 1.0 / 2.301).abs() < 1e-3, "{right} {printed}");
}

#[test]
fn slide_lens_as_printed_does_not_focus() {
    let light = Covariance2::diagonal([4.0, 0.0]).travel(1.0);
    // 1/1 + 1/1 = 1/0.5.
    assert!(light.thin_lens(0.5).travel(1.0).rows[1][1] < 1e-12);
    assert!(printed::lens(light, 0.5, 1.0).rows[1][1] > 1.0);
}

#[test]
fn slide_motion_as_printed_is_no_change_of_frame_and_back() {
    let light = Covariance3::diagonal([1.0, 1.0, 0.0]);
    // Nothing in the way: nothing may change.
    assert!(difference(&light.occlude_moving(f64::INFINITY, [2.0, 0.0]), &light) < 1e-12);
    let printed = printed::occlude_moving(light, 0.0, 2.0);
    assert!((printed.rows[0][0] - light.rows[0][0]).abs() > 1.0, "{printed:?}");
}

#[test]
fn slide_brdf_as_printed_has_no_answer_for_distant_light() {
    let distant = Covariance2::diagonal([0.0, 2.0]);
    assert_eq!(printed::reflect(distant, 3.0), None);
    let kept = distant.reflect([3.0 / (4.0 * std::f64::consts::PI.powi(2)), 0.0, 0.0]).rows[1][1];
    assert!((kept - 2.0 / (1.0 + 3.0 * 2.0)).abs() < 1e-12);
    let invertible = Covariance2 { rows: [[1.0, 0.3], [0.3, 2.0]] };
    let ours = invertible.reflect([3.0 / (4.0 * std::f64::consts::PI.powi(2)), 0.0, 0.0]);
    assert!(difference(&ours, &printed::reflect(invertible, 3.0).unwrap()) < 1e-12);
}

#[test]
fn slide_curvature_is_one_over_the_radius() {
    // A sphere of radius 4 under distant light, seen from 1 m: 2 d/R + 1, not 2 d R + 1.
    let light = Covariance2::diagonal([0.0, 1.0]);
    let seen =
        |k: f64| light.curve([k, 0.0, 0.0], 1.0).curve([k, 0.0, 0.0], 1.0).travel(1.0).rows[1][1].sqrt();
    assert!((seen(1.0 / 4.0) - 1.5).abs() < 1e-12 && (seen(4.0) - 9.0).abs() < 1e-12);
}

#[test]
fn slide_foreshortening_left_out_changes_what_arrives() {
    let light = Covariance2::diagonal([1.0, 0.0]);
    assert!((light.arrive(0.5).rows[0][0] - 0.25).abs() < 1e-12);
    assert!((light.leave(0.5).rows[0][0] - 4.0).abs() < 1e-12);
}
