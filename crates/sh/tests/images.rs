//! Projection of images, and windows.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use halflight_sh::window::{self, Window};
use halflight_sh::{Sh, ShError, Zh, project};

/// A smooth radiance of 0.1 to 7 that no finite order holds.
fn smooth(d: DVec3) -> f64 {
    0.1 + 6.9 * (2.0 * (d.dot(DVec3::new(0.6, 0.64, -0.48)) - 1.0)).exp()
}

fn gray(d: DVec3) -> Vec3 {
    Vec3::splat(smooth(d) as f32)
}

fn largest_error(found: &Sh<6>) -> f64 {
    let truth: Sh<6, f64> = project::function(60, smooth);
    (0..36).map(|i| (truth[i] - f64::from(found[i])).abs()).fold(0.0, f64::max)
}

#[test]
fn verified_math_1_solid_angles_of_images_sum_to_the_sphere() {
    for (width, height) in [(64, 32), (1, 1), (7, 3)] {
        let sum: f64 =
            (0..height).map(|row| width as f64 * project::lat_long_solid_angle(width, height, row)).sum();
        assert!((sum - 4.0 * PI).abs() < 1e-12);
    }
    for size in [1, 2, 16] {
        let face: f64 = (0..size)
            .flat_map(|row| (0..size).map(move |column| (column, row)))
            .map(|(column, row)| project::cube_solid_angle(size, column, row))
            .sum();
        assert!((6.0 * face - 4.0 * PI).abs() < 1e-12);
    }
}

#[test]
fn verified_math_1_projection_of_images_is_of_second_order() {
    let lat_long = |width: usize, height: usize| {
        let [red, _, _] = project::lat_long::<6>(width, height, |x, y| {
            gray(project::lat_long_direction(width, height, x, y))
        })
        .unwrap();
        largest_error(&red)
    };
    let cube = |size: usize| {
        let [red, _, _] =
            project::cube::<6>(size, |face, x, y| gray(project::cube_direction(size, face, x, y))).unwrap();
        largest_error(&red)
    };
    let (small, middle, large) = (lat_long(32, 16), lat_long(64, 32), lat_long(256, 128));
    let (cube_small, cube_middle) = (cube(16), cube(32));
    eprintln!("lat-long {small:.1e} {middle:.1e} {large:.1e}, cube {cube_small:.1e} {cube_middle:.1e}");
    assert!(small < 3.0e-2 && middle < 7.3e-3 && large < 4.5e-4);
    assert!(cube_small < 1.2e-2 && cube_middle < 3.0e-3);
    assert!((3.5..4.5).contains(&(small / middle)) && (3.5..4.5).contains(&(cube_small / cube_middle)));
}

#[test]
fn images_project_to_the_axes_of_the_world() {
    // One bright texel towards each axis: its image is brightest there.
    for (axis, column, row) in
        [(Vec3::NEG_Z, 32, 16), (Vec3::X, 48, 16), (Vec3::Y, 32, 0), (Vec3::Z, 0, 16), (Vec3::NEG_X, 16, 16)]
    {
        let texel = |x: usize, y: usize| Vec3::splat(if (x, y) == (column, row) { 1.0 } else { 0.0 });
        let [red, _, _] = project::lat_long::<4>(64, 32, texel).unwrap();
        let along = red.band(1);
        let towards = Vec3::new(along[2], along[0], along[1]).normalize();
        assert!(towards.dot(axis) > 0.99, "{axis}: {towards}");
    }
    for (face, axis) in
        [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z].into_iter().enumerate()
    {
        let texel = |f: usize, _: usize, _: usize| Vec3::splat(if f == face { 1.0 } else { 0.0 });
        let [red, _, _] = project::cube::<3>(4, texel).unwrap();
        let along = red.band(1);
        assert!(Vec3::new(along[2], along[0], along[1]).normalize().dot(axis) > 0.9999);
    }
}

#[test]
fn images_that_cannot_be_projected_say_why() {
    let white = |_: usize, _: usize| Vec3::ONE;
    assert_eq!(project::lat_long::<3>(0, 5, white), Err(ShError::Empty { width: 0, height: 5 }));
    assert_eq!(project::cube::<3>(0, |_, _, _| Vec3::ONE), Err(ShError::Empty { width: 0, height: 0 }));
    let infinite =
        |x: usize, y: usize| Vec3::new(1.0, if (x, y) == (2, 1) { f32::INFINITY } else { 0.0 }, 0.0);
    let error = project::lat_long::<3>(4, 2, infinite).unwrap_err();
    assert_eq!(error, ShError::NonFinite { what: "the image", x: 2, y: 1, value: f32::INFINITY });
    assert!(error.to_string().contains("(2, 1)"));
    assert!(matches!(
        project::lat_long_texels::<3>(4, 2, &[]),
        Err(ShError::Length { expected: 8, found: 0, .. })
    ));
    assert!(project::lat_long::<3>(1, 1, white).is_ok());
}

#[test]
fn a_small_sun_keeps_little_of_its_energy() {
    let sun = |x: usize, y: usize| Vec3::splat(if (x, y) == (20, 10) { 1e4 } else { 0.1 });
    let sh = project::lat_long::<4>(64, 32, sun).unwrap();
    assert!(project::kept_energy(64, 32, sun, &sh).unwrap() < 0.1);
    let even = |_: usize, _: usize| Vec3::ONE;
    let sh = project::lat_long::<4>(64, 32, even).unwrap();
    assert!((project::kept_energy(64, 32, even, &sh).unwrap() - 1.0).abs() < 1e-5);
}

#[test]
fn windows_scale_bands_and_keep_the_mean() {
    let hanning = Window::Hanning { width: 8.0 };
    assert_eq!(hanning.factor(0), 1.0);
    assert!((hanning.factor(4) - 0.5).abs() < 1e-12);
    assert_eq!(hanning.factor(8), 0.0);
    let lanczos = Window::Lanczos { width: 5.0 };
    assert!((lanczos.factor(1) - 0.935_489_283_788_639).abs() < 1e-12);
    for broken in [0.0, -1.0, f64::NAN] {
        assert_eq!(lanczos.with_width(broken).factor(1), 0.0);
        assert_eq!(lanczos.with_width(broken).factor(0), 1.0);
    }
}

#[test]
fn automatic_windows_leave_nothing_negative_and_no_more_blur_than_needed() {
    let sun: Sh<5> = Zh::phong(200.0).to_direction(Vec3::new(0.6, 0.0, 0.8));
    assert!(window::minimum(&sun.cast()) < -0.05);
    for family in [Window::Hanning { width: 1.0 }, Window::Lanczos { width: 1.0 }] {
        let ([soft], chosen) = window::to_non_negative(&[sun], family);
        let lowest = window::minimum(&soft.cast());
        assert!((-1e-5..1e-3).contains(&lowest), "{family:?}: {lowest}");
        assert_eq!(soft[0], sun[0]);
        assert!(chosen.is_some());
    }
    let sky = Sh::<5>::one();
    assert_eq!(window::to_non_negative(&[sky], Window::Hanning { width: 1.0 }), ([sky], None));
}
