//! What `[001]` prints, shown to be wrong, beside what holds. Listed in `docs/errata.md`.

use halflight_frequency::bandwidth::{Bandwidth, Exit, pixel, printed, variance};

const MIRROR: f32 = 1e9;

fn plane(distance: f32) -> Exit {
    Exit { curvature: 0.0, distance, cos_exit: 1.0, texture: 0.0 }
}

#[test]
fn eq_4_as_printed_subtracts_the_travels_of_a_local_light() {
    let light = Bandwidth::local(1.0);
    let printed = printed::one_bounce(light, 2.0, 1.0, MIRROR, &plane(2.0));
    assert_eq!(printed.angular, 0.0); // a mirror halfway would show a light without any detail
    assert_eq!(plane(2.0).local(1.0, 2.0, 1.0, MIRROR).angular, 4.0);
    let sphere = Exit { curvature: 0.5, ..plane(3.0) };
    assert_eq!(sphere.local(1.0, 2.0, 1.0, MIRROR).angular, 2.0 + 3.0 + 2.0 * 0.5 * 2.0 * 3.0);
    assert!(printed::one_bounce(light, 2.0, 1.0, MIRROR, &sphere).angular < 8.0);
}

#[test]
fn eq_4_as_printed_is_right_for_mirrors_under_distant_light() {
    let sphere = Exit { curvature: 2.0, distance: 3.0, cos_exit: 0.6, texture: 0.0 };
    let printed = printed::one_bounce(Bandwidth::distant(1.5), 7.0, 0.6, MIRROR, &sphere);
    assert!((printed.angular - sphere.distant(1.5, MIRROR).angular).abs() < 1e-4);
}

#[test]
fn fig_4_as_printed_clips_one_component_and_asks_for_too_much() {
    let sphere = Exit { curvature: 2.0, distance: 3.0, cos_exit: 1.0, texture: 0.0 };
    let light = 40.0;
    for (rho, least, most) in [(20.0, 1.3, 1.6), (10.0, 2.0, 2.6), (0.5, 4.0, 50.0)] {
        let printed = printed::one_bounce(Bandwidth::distant(light), 1.0, 1.0, rho, &sphere).angular;
        let ratio = printed / sphere.distant(light, rho).angular;
        assert!(ratio > least && ratio < most, "rho {rho}: {ratio}");
    }
}

#[test]
fn eq_5_on_signed_vectors_cancels() {
    let paths = [Bandwidth::new(2.0, 3.0), Bandwidth::new(-2.0, -3.0)];
    assert_eq!(printed::average(&paths, &[1.0, 1.0]).angular, 0.0);
    let exit = plane(1.0);
    assert_eq!(exit.average_distant(&[3.0, 3.0], &[MIRROR; 2], &[1.0, 1.0]).angular, 3.0);
}

#[test]
fn eq_6_as_printed_underestimates_the_angle_of_a_pixel() {
    let fov = 55f32.to_radians();
    let ratio = pixel::pixel_angle(fov, 512.0, 1.0) / printed::pixel_bandwidth(1.0, fov, 512.0);
    assert!((ratio - 1.08).abs() < 0.01, "{ratio}");
}

#[test]
fn eq_11_as_printed_is_one_level_too_coarse() {
    for k in 1..500 {
        let b = k as f32 * 0.001_37;
        assert_eq!(pixel::level(b, -20, 20), printed::level(b) - 1);
    }
}

#[test]
fn eq_9_as_printed_depends_on_the_number_of_directions() {
    let printed = |n: usize| printed::variance_sum(&vec![1.0; n], &vec![2.0; n], &vec![1.0; n]);
    assert_eq!(printed(64), 4.0 * printed(16));
    let pdf = 0.5 / std::f32::consts::PI;
    let ours =
        |n: usize| variance::second_moment_plain(&vec![1.0; n], &vec![pdf; n], &vec![2.0; n], &vec![1.0; n]);
    assert!((ours(64) - ours(16)).abs() < 1e-5 && (ours(16) - 3.0).abs() < 1e-5);
}

#[test]
fn eq_8_as_printed_is_not_conservative_below_one_cycle_per_radian() {
    // Constant light and a constant lobe vary at 0.1 cycles/rad at most: a tenth of the second moment is no bound of it.
    let (chi, light, lobe, pdf) = ([1.0; 16], [0.05; 16], [0.05; 16], [0.5 / std::f32::consts::PI; 16]);
    let moment = variance::second_moment(&chi, &pdf);
    assert!(printed::variance_sum(&chi, &light, &lobe) / 16.0 < 0.2 * moment);
    assert!(variance::second_moment_plain(&chi, &pdf, &light, &lobe) >= moment);
}

#[test]
fn gauss_curvature_does_not_see_cylinders() {
    assert_eq!(printed::curvature([2.0, 0.0]), 0.0);
    let cylinder = Exit { curvature: 2.0, ..plane(3.0) };
    assert_eq!(cylinder.distant(1.0, MIRROR).angular, 13.0);
}

#[test]
fn section_3_2_as_printed_counts_the_tilt_twice_and_swaps_the_axes() {
    let (first, second) = printed::anisotropy(0.1, 0.5);
    assert!(first > second); // "the minimum and maximum"
    let (along, across) = pixel::anisotropy(0.1, 0.5);
    assert_eq!((along, across), (0.1, 0.05)); // b_p holds 1/cos θ_x already
}
