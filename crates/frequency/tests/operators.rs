//! Every operator against the geometry that it describes.

use halflight_frequency::bandwidth::{Bandwidth, Chain, Exit, lobe, pixel, variance};

fn close(a: f32, b: f32, tolerance: f32) {
    assert!((a - b).abs() <= tolerance * (1.0 + b.abs()), "{a} is not {b}");
}

/// A circular mirror in the plane, convex or concave: where a ray from the eye ends on a light that is a line across the
/// central reflected ray, and the direction in which it goes, both by their derivatives with the angle at the eye.
fn mirror_derivatives(curvature: f64, to_eye: f64, incidence: f64, to_light: f64) -> (f64, f64) {
    let trace = |u: f64| {
        // The surface point is the origin, the normal +y; the eye at `incidence` from the normal.
        let eye = [to_eye * incidence.sin(), to_eye * incidence.cos()];
        let angle = incidence + u;
        let d = [-angle.sin(), -angle.cos()];
        let (point, normal) = if curvature == 0.0 {
            let t = -eye[1] / d[1];
            ([eye[0] + t * d[0], 0.0], [0.0, 1.0])
        } else {
            let radius = 1.0 / curvature; // negative: the centre lies on the eye's side
            let o = [eye[0], eye[1] + radius];
            let b = o[0] * d[0] + o[1] * d[1];
            let c = o[0] * o[0] + o[1] * o[1] - radius * radius;
            let root = (b * b - c).sqrt();
            let candidates = [-b - root, -b + root];
            // The hit near the origin.
            let t = candidates
                .into_iter()
                .min_by(|a, b| (a - to_eye).abs().total_cmp(&(b - to_eye).abs()))
                .unwrap_or(0.0);
            let p = [eye[0] + t * d[0], eye[1] + t * d[1]];
            (p, [p[0] / radius, (p[1] + radius) / radius])
        };
        let k = 2.0 * (d[0] * normal[0] + d[1] * normal[1]);
        let r = [d[0] - k * normal[0], d[1] - k * normal[1]];
        // The light: a line through `to_light` along the central reflected ray, across it.
        let axis = [-incidence.sin(), incidence.cos()];
        let along = [incidence.cos(), incidence.sin()];
        let reach = to_light - (point[0] * axis[0] + point[1] * axis[1]);
        let t = reach / (r[0] * axis[0] + r[1] * axis[1]);
        let x = (point[0] + t * r[0]) * along[0] + (point[1] + t * r[1]) * along[1];
        (r[0].atan2(r[1]), x)
    };
    let h = 1e-6;
    let (a, b) = (trace(-h), trace(h));
    (((b.0 - a.0) / (2.0 * h)).abs(), ((b.1 - a.1) / (2.0 * h)).abs())
}

const CASES: [(f64, f64, f64, f64); 8] = [
    (0.0, 2.0, 0.0, 2.0),
    (0.0, 1.5, 0.9, 4.0),
    (1.0, 2.0, 0.0, 3.0),
    (0.5, 3.0, 0.7, 2.0),
    (4.0, 5.0, 1.2, 0.5),
    (-0.1, 2.0, 0.4, 1.0),
    (-0.5, 0.7, 0.2, 0.6),
    (20.0, 1.0, 0.3, 7.0),
];

#[test]
fn eq_4_for_distant_lights_is_the_geometry_of_a_mirror() {
    for (c, d_eye, theta, _) in CASES {
        let (turned, _) = mirror_derivatives(c, d_eye, theta, 1.0);
        let exit =
            Exit { curvature: c as f32, distance: d_eye as f32, cos_exit: theta.cos() as f32, texture: 0.0 };
        close(exit.distant(3.0, 1e6).angular, 3.0 * turned as f32, 1e-4);
    }
}

#[test]
fn eq_4_corrected_for_local_lights_is_the_geometry_of_a_mirror() {
    for (c, d_eye, theta, d_light) in CASES {
        let (_, moved) = mirror_derivatives(c, d_eye, theta, d_light);
        let cos = theta.cos() as f32;
        let exit = Exit { curvature: c as f32, distance: d_eye as f32, cos_exit: cos, texture: 0.0 };
        close(exit.local(5.0, d_light as f32, cos, 1e9).angular, 5.0 * moved as f32, 2e-4);
    }
}

#[test]
fn fig_4_operators_are_their_matrices() {
    let nu = Bandwidth::new(3.0, -2.0);
    assert_eq!(nu.travel(2.0), Bandwidth::new(3.0, -8.0)); // T_d
    assert_eq!(nu.incidence(0.5), Bandwidth::new(1.5, -2.0)); // P_i
    assert_eq!(nu.exit(0.5), Bandwidth::new(6.0, -2.0)); // P_x
    assert_eq!(nu.curvature(0.5), Bandwidth::new(2.0, -2.0)); // C_c
    assert_eq!(nu.band_limit(1.0), Bandwidth::new(1.5, -1.0)); // B, both components
    assert_eq!(nu.band_limit(5.0), nu);
    assert_eq!(nu.reflect(4.0, 1.0), Bandwidth::new(5.5, -1.0)); // B with texture, sign-preserving
    assert_eq!(Bandwidth::new(-3.0, 2.0).reflect(4.0, 1.0), Bandwidth::new(-5.5, 1.0));
    assert_eq!(Bandwidth::default().band_limit(0.0), Bandwidth::default());
}

#[test]
fn the_closed_forms_are_the_chain_of_operators() {
    for (c, d_eye, theta, d_light) in CASES.map(|(a, b, c, d)| (a as f32, b as f32, c as f32, d as f32)) {
        let (cos_x, cos_i) = (theta.cos(), (theta * 0.5).cos());
        for (texture, rho) in [(0.0, 1e6), (0.0, 0.7), (4.0, 0.7), (4.0, 1e6)] {
            let exit = Exit { curvature: c, distance: d_eye, cos_exit: cos_x, texture };
            let far = Chain::new(Bandwidth::distant(3.0))
                .reflect(0.9, c, texture, rho, cos_x)
                .travel(d_eye)
                .bandwidth();
            let got = exit.distant(3.0, rho);
            close(got.angular, far.angular, 1e-4);
            close(got.spatial, far.spatial, 1e-4);

            let near = Chain::new(Bandwidth::local(5.0))
                .travel(d_light)
                .reflect(cos_i, c, texture, rho, cos_x)
                .travel(d_eye)
                .bandwidth();
            let got = exit.local(5.0, d_light, cos_i, rho);
            close(got.angular, near.angular, 1e-4);
            close(got.spatial, near.spatial, 1e-4);

            if c >= 0.0 {
                // One vector with signs says the same, as nothing can cancel on convex surfaces.
                let one = Bandwidth::distant(3.0).curvature(-c).reflect(texture, rho).curvature(-c);
                let one = one.exit(cos_x).travel(d_eye).magnitude();
                if c > 0.0 {
                    close(far.angular, one.angular, 1e-4);
                }
            }
        }
    }
}

#[test]
fn a_texture_on_a_plane_reaches_the_eye_magnified_by_distance_and_tilt() {
    let exit = Exit { curvature: 0.0, distance: 3.0, cos_exit: 0.5, texture: 10.0 };
    close(exit.distant(0.0, 0.0).angular, 60.0, 1e-6);
    close(exit.local(0.0, 1.0, 1.0, 0.0).angular, 60.0, 1e-6);
}

#[test]
fn eq_5_averages_magnitudes_with_weights() {
    let exit = Exit { curvature: 1.5, distance: 2.0, cos_exit: 0.6, texture: 1.0 };
    let light: [f32; 16] = std::array::from_fn(|i| 0.5 + i as f32);
    let rho: [f32; 16] = std::array::from_fn(|i| 9.0 - 0.3 * i as f32);
    let weight: [f32; 16] = std::array::from_fn(|i| ((i * 7) % 5) as f32);
    let distance: [f32; 16] = std::array::from_fn(|i| 1.0 + 0.1 * i as f32);
    let cos: [f32; 16] = std::array::from_fn(|i| 1.0 - 0.05 * i as f32);
    let total: f32 = weight.iter().sum();
    let mean = |f: &dyn Fn(usize) -> Bandwidth| {
        let sum = (0..16).fold(Bandwidth::default(), |sum, i| sum + f(i) * weight[i]);
        sum * (1.0 / total)
    };
    let far = mean(&|i| exit.distant(light[i], rho[i]));
    let got = exit.average_distant(&light, &rho, &weight);
    close(got.angular, far.angular, 1e-5);
    close(got.spatial, far.spatial, 1e-5);
    let near = mean(&|i| exit.local(light[i], distance[i], cos[i], rho[i]));
    let got = exit.average_local(&light, &distance, &cos, &rho, &weight);
    close(got.angular, near.angular, 1e-5);
    close(got.spatial, near.spatial, 1e-5);
    assert_eq!(exit.average_distant(&light, &rho, &[0.0; 16]), exit.textured());
}

#[test]
fn eq_6_pixel_angles_are_those_of_a_pinhole() {
    let (fov, width) = (0.96f32, 512.0f32);
    let direction = |x: f64| (x * 2.0 * f64::from(0.5 * fov).tan() / f64::from(width)).atan();
    for x in [0.0, 100.0, 255.0] {
        let exact = direction(x + 0.5) - direction(x - 0.5);
        close(pixel::pixel_angle(fov, width, direction(x).cos() as f32), exact as f32, 1e-5);
        assert!(pixel::pixel_angle_bound(fov, width, direction(x).cos() as f32) >= exact as f32 * 0.999_99);
    }
}

#[test]
fn eq_11_corrected_levels_obey_nyquist() {
    for (b, level) in
        [(0.5, 0), (0.3, 0), (0.25, 1), (0.24, 1), (0.126, 1), (0.125, 2), (0.51, -1), (1.1, -2)]
    {
        assert_eq!(pixel::level(b, -9, 9), level, "{b}");
    }
    for k in 1..4000 {
        let b = k as f32 * 1e-3;
        let spacing = (pixel::level(b, -20, 20) as f32).exp2();
        assert!(spacing <= 0.5 / b * 1.000_001 && 2.0 * spacing > 0.5 / b);
    }
    assert_eq!(pixel::level(0.0, -2, 9), 9);
    assert_eq!(pixel::level(f32::NAN, -2, 9), -2);
    assert_eq!(pixel::level(f32::INFINITY, -2, 9), -2);
    assert_eq!(pixel::coarsest_level(512, 300), 8);
    assert_eq!(pixel::coarsest_level(0, 0), 0);
    close(pixel::representable(-2), 2.0, 1e-6);
}

#[test]
fn rho_of_cosine_lobes_is_the_measured_one() {
    for (alpha, measured) in [(4.0, 0.468), (16.0, 0.895), (64.0, 1.77), (256.0, 3.53)] {
        close(lobe::phong_line(alpha), measured, 0.03);
        close(lobe::phong_exponent(lobe::phong(alpha)), alpha, 1e-4);
    }
}

#[test]
fn eq_9_corrected_bounds_the_variance_of_uniform_sampling() {
    // A lobe of exponent α lit by 1 + cos(2π·3·θ), drawn from the lobe; quadrature for the truth.
    use std::f32::consts::PI;
    for alpha in [1.0f32, 50.0, 200.0] {
        let light = |cos: f32| 1.0 + (2.0 * PI * 3.0 * cos.acos()).cos();
        let brdf = |cos: f32| (alpha + 1.0) / (2.0 * PI) * cos.powf(alpha);
        let n = 20_000;
        let (mut first, mut second, mut moment) = (0.0f64, 0.0f64, 0.0f64);
        for i in 0..n {
            let cos = (i as f32 + 0.5) / n as f32;
            let chi = light(cos) * brdf(cos);
            first += f64::from(chi * cos) / f64::from(n);
            second += f64::from(chi * cos).powi(2) / f64::from(n);
            moment += f64::from(chi).powi(2) / f64::from(n);
        }
        let variance = (4.0 * PI * PI) as f64 * (second - first * first);
        // Sixteen stratified directions from the density of the lobe.
        let cos: [f32; 16] = std::array::from_fn(|i| ((i as f32 + 0.5) / 16.0).powf(1.0 / (alpha + 1.0)));
        let chi = cos.map(|c| light(c) * brdf(c));
        let pdf = cos.map(brdf);
        let estimate = variance::second_moment(&chi, &pdf);
        let ratio = f64::from(estimate) / moment;
        assert!((0.8..1.3).contains(&ratio), "alpha {alpha}: {ratio}");
        let rho = [lobe::phong(alpha); 16];
        let plain = variance::second_moment_plain(&chi, &pdf, &[3.0; 16], &rho);
        let convolved = variance::second_moment_preconvolved(&chi, &pdf, &rho);
        assert!(f64::from(variance::uniform_bound(plain)) >= variance);
        assert!(f64::from(variance::uniform_bound(convolved)) >= variance * 0.9);
        assert!(convolved >= estimate && plain >= convolved || rho[0] > 3.0);
    }
}

#[test]
fn counts_follow_the_target() {
    assert_eq!(variance::sample_count(4.0, 1.0, 0.1, 1, 10_000), 400);
    assert_eq!(variance::sample_count(0.0, 1.0, 0.1, 4, 64), 4);
    assert_eq!(variance::sample_count(1.0, 0.0, 0.1, 4, 64), 4);
    assert_eq!(variance::sample_count(f32::NAN, 1.0, 0.1, 4, 64), 64);
    assert_eq!(variance::sample_count(f32::MAX, 1.0, 0.1, 4, 64), 64);
    // The variance of importance sampling: weights 1 and 3 in turn.
    let lambda: [f32; 8] = std::array::from_fn(|i| if i % 2 == 0 { 1.0 } else { 3.0 });
    close(variance::importance_variance(&lambda, &[1.0; 8]), 8.0 / 7.0, 1e-6);
}
