//! Every operator against the Fourier transform of a light field: analytic, and numerical of a Gaussian beam and of a random
//! band-limited field. The operators' definitions (the light after, as a function of the light before) stand here again, in
//! the primal domain.

use std::f64::consts::PI;

use crate::support::{Numbers, beam, difference, moments, packet_field, packets, sampled};
use halflight_frequency::covariance::{
    Covariance, Covariance2, Covariance3, Covariance4, Covariance5, Interface, Lens, henyey_greenstein_peak,
    kernel_precision, lobe_from_log_hessian, microfacet_lobe, phong_lobe, remaining, variance_within,
};

type Matrix<const N: usize> = [[f64; N]; N];

/// C⁻¹/4π² by Gauss–Jordan: the slow way from the primal covariance, or back from Σ.
fn inverse_over_four_pi_squared<const N: usize>(m: &Matrix<N>) -> Covariance<N> {
    let mut a = *m;
    let mut inverse = [[0.0; N]; N];
    for i in 0..N {
        inverse[i][i] = 1.0;
    }
    for k in 0..N {
        let pivot = (k..N).max_by(|&i, &j| a[i][k].abs().total_cmp(&a[j][k].abs())).unwrap_or(k);
        a.swap(k, pivot);
        inverse.swap(k, pivot);
        let scale = a[k][k];
        for j in 0..N {
            a[k][j] /= scale;
            inverse[k][j] /= scale;
        }
        for i in (0..N).filter(|&i| i != k) {
            let factor = a[i][k];
            for j in 0..N {
                a[i][j] -= factor * a[k][j];
                inverse[i][j] -= factor * inverse[k][j];
            }
        }
    }
    Covariance { rows: inverse.map(|row| row.map(|value| value / (4.0 * PI * PI))) }
}

fn product<const N: usize>(a: &Matrix<N>, b: &Matrix<N>) -> Matrix<N> {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..N).map(|k| a[i][k] * b[k][j]).sum()))
}

fn transposed<const N: usize>(a: &Matrix<N>) -> Matrix<N> {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

/// A random positive definite matrix.
fn random<const N: usize>(numbers: &mut Numbers) -> Covariance<N> {
    let a: Matrix<N> = std::array::from_fn(|_| std::array::from_fn(|_| numbers.between(-1.0, 1.0)));
    let mut rows = product(&a, &transposed(&a));
    for (i, row) in rows.iter_mut().enumerate() {
        row[i] += 0.3;
    }
    Covariance { rows }
}

/// By the primal covariance: the light after is l₀(T z), so C₁ = T⁻¹ C₀ T⁻ᵀ.
fn through_primal<const N: usize>(light: &Covariance<N>, t: &Matrix<N>) -> Covariance<N> {
    let before = inverse_over_four_pi_squared(&light.rows).rows;
    let inverse_t = inverse_over_four_pi_squared(t).rows.map(|row| row.map(|v| v * 4.0 * PI * PI));
    inverse_over_four_pi_squared(&product(&product(&inverse_t, &before), &transposed(&inverse_t)))
}

fn identity<const N: usize>() -> Matrix<N> {
    std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 }))
}

/// A linear operator: its T, and what the module does.
type Linear<const N: usize> = (&'static str, Matrix<N>, Covariance<N>);

fn linear_operators<const N: usize>(light: Covariance<N>) -> Vec<Linear<N>> {
    let (space, u) = (N / 2, N / 2);
    let with = |entries: &[(usize, usize, f64)]| {
        let mut t = identity::<N>();
        for &(i, j, value) in entries {
            t[i][j] = value;
        }
        t
    };
    let both = |entries: Vec<(usize, usize, f64)>| with(&entries);
    let interface = Interface { indices: [1.0, 1.5], cos_in: 0.7 };
    let cos_out = interface.cos_out().expect("no total reflection into glass");
    let g = 1.5 * cos_out / 0.7;
    let mut all = vec![
        ("travel", both((0..space).map(|a| (a, u + a, 2.5)).collect()), light.travel(2.5)),
        ("arrival", with(&[(0, 0, 0.6)]), light.arrive(0.6)),
        ("exit", with(&[(0, 0, 1.0 / 0.6)]), light.leave(0.6)),
        ("thin lens", both((0..space).map(|a| (u + a, a, -1.0 / 0.4)).collect()), light.thin_lens(0.4)),
    ];
    if N < 4 {
        all.push(("curvature", with(&[(u, 0, 1.7)]), light.curve([1.7, 9.0, 9.0], 0.5)));
        all.push((
            "refraction",
            with(&[(u, u, g)]),
            light.refract_without_window(&interface).expect("refracts"),
        ));
    } else {
        let curved = with(&[(u, 0, 1.7), (u, 1, 0.4), (u + 1, 0, 0.5 * 0.4), (u + 1, 1, -0.5 * 0.8)]);
        all.push(("curvature", curved, light.curve([1.7, 0.4, -0.8], 0.5)));
        let (s, c) = 0.7f64.sin_cos();
        let turned = with(&[
            (0, 0, c),
            (0, 1, -s),
            (1, 0, s),
            (1, 1, c),
            (u, u, c),
            (u, u + 1, -s),
            (u + 1, u, s),
            (u + 1, u + 1, c),
        ]);
        all.push(("rotation", turned, light.rotate(0.7)));
        all.push((
            "refraction",
            with(&[(u, u, g), (u + 1, u + 1, 1.5)]),
            light.refract_without_window(&interface).expect("refracts"),
        ));
    }
    if N % 2 == 1 {
        let (v, w) = ([0.8, -0.3], [0.2, 0.5]);
        let moving = both((0..space).flat_map(|a| [(a, N - 1, v[a]), (u + a, N - 1, w[a])]).collect());
        all.push(("motion", moving, light.into_motion(v, w)));
        let back = both((0..space).flat_map(|a| [(a, N - 1, -v[a]), (u + a, N - 1, -w[a])]).collect());
        all.push(("motion back", back, light.out_of_motion(v, w)));
    }
    all
}

fn linear_against_primal<const N: usize>() {
    let mut numbers = Numbers(N as u64);
    for _ in 0..50 {
        let light = random::<N>(&mut numbers);
        for (name, t, ours) in linear_operators(light) {
            let expected = through_primal(&light, &t);
            assert!(difference(&ours, &expected) < 1e-9, "{name} in {N}: {}", difference(&ours, &expected));
        }
    }
}

#[test]
fn linear_operators_are_the_analytic_transform_of_gaussian_beams() {
    linear_against_primal::<2>();
    linear_against_primal::<3>();
    linear_against_primal::<4>();
    linear_against_primal::<5>();
}

fn windows_and_blurs<const N: usize>() {
    let mut numbers = Numbers(77 + N as u64);
    let (space, u) = (N / 2, N / 2);
    for _ in 0..50 {
        let light = random::<N>(&mut numbers);
        let primal = inverse_over_four_pi_squared(&light.rows).rows;
        // A window multiplies: inverse primal covariances add.
        let mut precision = light.rows.map(|row| row.map(|v| v * 4.0 * PI * PI));
        for axis in 0..space {
            precision[axis][axis] += 1.0 / (0.25 * 0.3 * 0.3);
        }
        let expected = Covariance { rows: precision.map(|row| row.map(|v| v / (4.0 * PI * PI))) };
        assert!(difference(&light.occlude(0.3), &expected) < 1e-9, "occlusion in {N}");
        // A lobe blurs: primal covariances add.
        let lobe = if N < 4 { [0.02, 0.0, 0.0] } else { [0.02, 0.007, 0.05] };
        let mut blurred = primal;
        blurred[u][u] += lobe[0];
        if space > 1 {
            blurred[u][u + 1] += lobe[1];
            blurred[u + 1][u] += lobe[1];
            blurred[u + 1][u + 1] += lobe[2];
        }
        let expected = inverse_over_four_pi_squared(&blurred);
        assert!(difference(&light.reflect(lobe), &expected) < 1e-9, "lobe in {N}");
        // A phase function, on aligned axes.
        let mut t = identity::<N>();
        t[0][0] = 0.4;
        let aligned = through_primal(&light, &t);
        let mut scattered = inverse_over_four_pi_squared(&aligned.rows).rows;
        let variance = henyey_greenstein_peak(0.8);
        for axis in 0..space {
            scattered[u + axis][u + axis] += variance;
        }
        let expected = inverse_over_four_pi_squared(&scattered);
        assert!(difference(&light.scatter(0.4, variance), &expected) < 1e-9, "scattering in {N}");
        // Absorption by depth with curvature H is the window of precision H.
        let h = if N < 4 { [3.0, 0.0, 0.0] } else { [3.0, 0.5, 1.0] };
        let mut precision = light.rows.map(|row| row.map(|v| v * 4.0 * PI * PI));
        precision[0][0] += h[0];
        if space > 1 {
            precision[0][1] += h[1];
            precision[1][0] += h[1];
            precision[1][1] += h[2];
        }
        let expected = Covariance { rows: precision.map(|row| row.map(|v| v / (4.0 * PI * PI))) };
        assert!(difference(&light.absorb(h), &expected) < 1e-9, "absorption in {N}");
    }
}

#[test]
fn windows_and_blurs_are_the_analytic_transform_of_gaussian_beams() {
    windows_and_blurs::<2>();
    windows_and_blurs::<3>();
    windows_and_blurs::<4>();
    windows_and_blurs::<5>();
}

/// T z.
fn apply<const N: usize>(t: &Matrix<N>, z: [f64; N]) -> [f64; N] {
    std::array::from_fn(|i| (0..N).map(|j| t[i][j] * z[j]).sum())
}

#[test]
fn linear_operators_are_the_numerical_transform_of_a_gaussian_beam() {
    let light = Covariance2 { rows: [[0.5, 0.2], [0.2, 0.4]] };
    let chain = [
        ("travel", identity2(1.0, 0.8, 0.0, 1.0), light.travel(0.8)),
        ("curvature", identity2(1.0, 0.0, 0.9, 1.0), light.curve([0.9, 0.0, 0.0], 1.0)),
        ("arrival", identity2(0.7, 0.0, 0.0, 1.0), light.arrive(0.7)),
        ("exit", identity2(1.0 / 0.7, 0.0, 0.0, 1.0), light.leave(0.7)),
        ("lens", identity2(1.0, 0.0, -1.0 / 1.5, 1.0), light.thin_lens(1.5)),
    ];
    let h = [0.05; 2];
    for (name, t, ours) in chain {
        let field = sampled(256, h, |z| beam(&light, apply(&t, z)));
        let (measured, _) = moments(field, 256, h, 1);
        assert!(difference(&ours, &measured) < 1e-6, "{name}: {}", difference(&ours, &measured));
    }
    // Over time.
    let light = Covariance3 { rows: [[0.35, 0.1, 0.05], [0.1, 0.3, -0.05], [0.05, -0.05, 0.3]] };
    let h = [0.11; 3];
    let moving = light.into_motion([0.6, 0.0], [-0.2, 0.0]);
    let t = [[1.0, 0.0, 0.6], [0.0, 1.0, -0.2], [0.0, 0.0, 1.0]];
    let (measured, _) = moments(sampled(80, h, |z| beam(&light, apply(&t, z))), 80, h, 1);
    assert!(difference(&moving, &measured) < 1e-6, "motion: {}", difference(&moving, &measured));
    // In space.
    let mut light = Covariance4::diagonal([0.3, 0.35, 0.3, 0.33]);
    (light.rows[0][2], light.rows[2][0]) = (0.08, 0.08);
    for (name, t, ours) in
        linear_operators(light).into_iter().filter(|(name, ..)| ["arrival", "rotation"].contains(name))
    {
        let h = [if name == "arrival" { 0.25 } else { 0.155 }, 0.155, 0.155, 0.155];
        let (measured, _) = moments(sampled(32, h, |z| beam(&light, apply(&t, z))), 32, h, 1);
        assert!(difference(&ours, &measured) < 1e-6, "{name}: {}", difference(&ours, &measured));
    }
}

fn identity2(a: f64, b: f64, c: f64, d: f64) -> Matrix<2> {
    [[a, b], [c, d]]
}

#[test]
fn linear_operators_are_the_numerical_transform_of_a_random_field() {
    let waves = packets(5);
    let h = [0.05; 2];
    let n = 256;
    let (light, _) = moments(sampled(n, h, |z| packet_field(&waves, z)), n, h, 2);
    for (name, t, ours) in [
        ("travel", identity2(1.0, 0.5, 0.0, 1.0), light.travel(0.5)),
        ("curvature", identity2(1.0, 0.0, 0.6, 1.0), light.curve([0.6, 0.0, 0.0], 1.0)),
        ("arrival", identity2(0.8, 0.0, 0.0, 1.0), light.arrive(0.8)),
        ("exit", identity2(1.25, 0.0, 0.0, 1.0), light.leave(0.8)),
        ("lens", identity2(1.0, 0.0, -0.5, 1.0), light.thin_lens(2.0)),
    ] {
        let (measured, _) = moments(sampled(n, h, |z| packet_field(&waves, apply(&t, z))), n, h, 2);
        assert!(difference(&ours, &measured) < 1e-6, "{name}: {}", difference(&ours, &measured));
    }
}

#[test]
fn a_window_adds_its_spectrum_to_a_random_field_in_the_mean_over_places() {
    let waves = packets(9);
    let (h, n) = ([0.05; 2], 256);
    let (before, _) = moments(sampled(n, h, |z| packet_field(&waves, z)), n, h, 2);
    let deviation: f64 = 0.4;
    let (mut sum, mut total) = (Covariance2::ZERO, 0.0);
    // The window at every place, a step well below its width apart.
    for place in -20..=20 {
        let center = f64::from(place) * 0.2;
        let window = |x: f64| (-0.5 * ((x - center) / deviation).powi(2)).exp();
        let field = sampled(n, h, |z| packet_field(&waves, z) * window(z[0]));
        let (moment, weight) = moments(field, n, h, 2);
        for i in 0..2 {
            for j in 0..2 {
                sum.rows[i][j] += weight * moment.rows[i][j];
            }
        }
        total += weight;
    }
    let measured = Covariance2 { rows: sum.rows.map(|row| row.map(|v| v / total)) };
    // Moments of |l̂|² are half of Σ, so half of what the operator adds: 1/(8π² s²), as the verified mathematics has it.
    let doubled = Covariance2 { rows: before.rows.map(|row| row.map(|v| 2.0 * v)) };
    let after = doubled.windowed(0, deviation * deviation);
    let ours = Covariance2 { rows: after.rows.map(|row| row.map(|v| 0.5 * v)) };
    assert!(difference(&ours, &measured) < 1e-6, "{}", difference(&ours, &measured));
}

#[test]
fn windows_and_lobes_are_the_numerical_transform_of_a_gaussian_beam() {
    let light = Covariance2 { rows: [[0.5, 0.2], [0.2, 0.4]] };
    let (h, n) = ([0.05; 2], 256);
    let opening: f64 = 0.9;
    let windowed = sampled(n, h, |z| beam(&light, z) * (-2.0 * (z[0] / opening).powi(2)).exp());
    let (measured, _) = moments(windowed, n, h, 1);
    assert!(difference(&light.occlude(opening), &measured) < 1e-6);
    // The blur by direct summation over the lobe.
    let variance: f64 = 0.04;
    let lobe: Vec<(f64, f64)> = (-60..=60)
        .map(|k| {
            let u = f64::from(k) * 0.02;
            (u, (-0.5 * u * u / variance).exp())
        })
        .collect();
    let field = sampled(n, h, |[x, u]| lobe.iter().map(|&(du, w)| beam(&light, [x, u - du]) * w).sum());
    let (measured, _) = moments(field, n, h, 1);
    let ours = light.reflect([variance, 0.0, 0.0]);
    assert!(difference(&ours, &measured) < 1e-6, "{}", difference(&ours, &measured));
}

#[test]
fn refraction_is_snells_law_to_two_thousandths() {
    for (indices, angle) in [([1.0, 1.5], 0.0f64), ([1.0, 1.5], 0.5), ([1.0, 1.5], 1.0), ([1.5, 1.0], 0.3)] {
        let interface = Interface { indices, cos_in: angle.cos() };
        let out = interface.cos_out().expect("below the critical angle").acos();
        // A beam narrow enough for the first order: 3 milliradians.
        let light = Covariance2::of_window([0.5, 0.003]);
        let h = [0.1, 0.000_4];
        let field = sampled(128, h, |[x, u]| {
            let incident = (indices[1] / indices[0] * (out + u).sin()).asin() - angle;
            beam(&light, [x, incident])
        });
        let (measured, _) = moments(field, 128, h, 1);
        let ours = light.refract_without_window(&interface).expect("refracts");
        let error = (ours.rows[1][1] / measured.rows[1][1] - 1.0).abs();
        assert!(error < 2e-3, "{indices:?} {angle}: {error}");
        // The scale of the verified mathematics.
        let g = (ours.rows[1][1] / light.rows[1][1]).sqrt();
        let expected = indices[1] * out.cos() / (indices[0] * angle.cos());
        assert!((g / expected - 1.0).abs() < 1e-12);
    }
    let steep = |angle: f64| {
        let interface = Interface { indices: [1.0, 1.5], cos_in: angle.cos() };
        let light = Covariance2::diagonal([0.0, 1.0]).refract_without_window(&interface).expect("refracts");
        light.rows[1][1].sqrt()
    };
    for (angle, scale) in [(0.0, 1.500), (0.5, 1.620), (1.0, 2.301)] {
        assert!((steep(angle) - scale).abs() < 4e-3);
    }
}

#[test]
fn light_near_the_critical_angle_varies_faster_and_beyond_it_does_not_pass() {
    let light = Covariance2::diagonal([1.0, 0.1]);
    let critical = (1.0f64 / 1.5).asin();
    let passed = |angle: f64| light.refract(&Interface { indices: [1.5, 1.0], cos_in: angle.cos() });
    let (far, near) = (passed(0.2).expect("passes"), passed(critical - 0.01).expect("passes"));
    assert!(near.rows[1][1] > far.rows[1][1]);
    assert!(passed(critical + 0.01).is_none());
    for index in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(light.refract(&Interface { indices: [1.0, index], cos_in: 0.5 }).is_none(), "{index}");
    }
}

#[test]
fn a_lens_focuses_what_it_should_exactly() {
    // Object at d0, image at d with 1/d0 + 1/d = 1/f: rays of one point meet, so the image depends on no angle.
    for (object, focal) in [(2.0, 0.5), (0.75, 0.25), (8.0, 4.0)] {
        let image = 1.0 / (1.0 / focal - 1.0 / object);
        let source = Covariance2::diagonal([4.0, 0.0]);
        let sharp = source.travel(object).thin_lens(focal).travel(image);
        assert!(sharp.rows[1][1].abs() < 1e-12 * sharp.rows[0][0], "{sharp:?}");
        let magnified = (sharp.rows[0][0] / 4.0).sqrt();
        assert!((magnified - object / image).abs() < 1e-12 * magnified, "{magnified}");
    }
    let light = Covariance4::diagonal([1.0, 2.0, 3.0, 4.0]);
    assert_eq!(light.thin_lens(f64::INFINITY), light);
}

#[test]
fn two_refractions_and_curvature_make_a_lens() {
    let light = Covariance4 {
        rows: [[2.0, 0.1, 0.3, 0.0], [0.1, 1.0, 0.0, 0.2], [0.3, 0.0, 0.7, 0.1], [0.0, 0.2, 0.1, 0.9]],
    };
    let lens = Lens { curvatures: [1.5, 0.5], thickness: 0.0, index: 1.6 };
    let thick = light.thick_lens(&lens).expect("glass");
    let thin = light.thin_lens(1.0 / (0.6 * 2.0));
    assert!(difference(&thick, &thin) < 1e-12);
    // Gullstrand: 1/f = P1 + P2 − P1 P2 d/n, as light from infinity tells behind the lens: the slope of x against u.
    let lens = Lens { thickness: 0.3, ..lens };
    let distant = Covariance2::diagonal([0.0, 1.0]);
    let behind = distant.thick_lens(&lens).expect("glass");
    let powers = [0.6 * 1.5, 0.6 * 0.5];
    let power = powers[0] + powers[1] - powers[0] * powers[1] * 0.3 / 1.6;
    // Ω_u along the line: from Ω = (0, 1) comes (−power, 1 − P1 d/n).
    let expected: f64 = -power;
    let scale = behind.rows[0][1] / behind.rows[1][1].sqrt();
    assert!((scale.abs() - expected.abs()).abs() < 1e-9, "{scale} {expected}");
    assert!(light.thick_lens(&Lens { index: 0.0, ..lens }).is_none());
}

/// Where a ray of the eye goes that a sphere of radius 1 about the origin reflects or refracts, on axes across the ray.
/// Numerical derivatives of the exact geometry, in the convention of the module: all rays are those of the eye.
fn eye_ray_jacobian(sin: f64, ratio: Option<f64>) -> Matrix<4> {
    type V = [f64; 3];
    let add = |a: V, b: V, s: f64| [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
    let dot = |a: V, b: V| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let unit = |a: V| add([0.0; 3], a, 1.0 / dot(a, a).sqrt());
    let cross =
        |a: V, b: V| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let cos = (1.0 - sin * sin).sqrt();
    // The sphere's top at the origin, its normal +z; the plane of incidence is (x, z).
    let event = |position: V, direction: V| {
        let center = [0.0, 0.0, -1.0];
        let to = add(position, center, -1.0);
        let b = dot(to, direction);
        let c = dot(to, to) - 1.0;
        // The crossing nearer to the top of the sphere.
        let root = (b * b - c).sqrt();
        let t = -b - root;
        let hit = add(position, direction, t);
        let normal = add(hit, center, -1.0);
        let cosine = -dot(direction, normal);
        let next = match ratio {
            None => add(direction, normal, 2.0 * cosine),
            Some(eta) => {
                let out = (1.0 - eta * eta * (1.0 - cosine * cosine)).sqrt();
                add(add([0.0; 3], direction, eta), normal, eta * cosine - out)
            }
        };
        (hit, unit(next))
    };
    let incoming = [sin, 0.0, -cos];
    let before = [[cos, 0.0, sin], [0.0, 1.0, 0.0]];
    let (_, outgoing) = event(add([0.0; 3], incoming, -1e-3), incoming);
    let y = [0.0, 1.0, 0.0];
    let x = unit(cross(y, outgoing));
    // The axis that looks the same way along the surface.
    let x = if x[0] < 0.0 { add([0.0; 3], x, -1.0) } else { x };
    let after = [x, y];
    let out = |z: [f64; 4]| {
        let position = add(add([0.0; 3], before[0], z[0]), before[1], z[1]);
        let direction = unit(add(add(incoming, before[0], z[2]), before[1], z[3]));
        let (hit, next) = event(add(position, direction, -0.01), direction);
        // Back to the plane across the outgoing ray through the origin.
        let t = -dot(hit, outgoing) / dot(next, outgoing);
        let at = add(hit, next, t);
        let slope = dot(next, outgoing);
        [dot(at, after[0]), dot(at, after[1]), dot(next, after[0]) / slope, dot(next, after[1]) / slope]
    };
    let step = 1e-5;
    let mut jacobian = [[0.0; 4]; 4];
    for j in 0..4 {
        let mut z = [0.0; 4];
        z[j] = step;
        let high = out(z);
        z[j] = -step;
        let low = out(z);
        for i in 0..4 {
            jacobian[i][j] = (high[i] - low[i]) / (2.0 * step);
        }
    }
    jacobian
}

#[test]
fn curvature_reflects_and_refracts_as_rays_on_a_sphere_do() {
    let mut numbers = Numbers(3);
    for sin in [0.0, 0.3, 0.6, 0.8f64] {
        let cos = (1.0 - sin * sin).sqrt();
        let light = random::<4>(&mut numbers);
        // l₁(z) = l₀(T z), where T z is the ray that the eye's ray z becomes.
        let expected = light.transformed(&eye_ray_jacobian(sin, None));
        let ours = light.arrive(cos).curve([1.0, 0.0, 1.0], cos).curve([1.0, 0.0, 1.0], cos).leave(cos);
        assert!(difference(&ours, &expected) < 1e-5, "mirror at {sin}: {}", difference(&ours, &expected));
        // The eye in air looks into glass: light comes from glass.
        let expected = light.transformed(&eye_ray_jacobian(sin, Some(1.0 / 1.5)));
        let cos_in = (1.0 - sin * sin / 2.25).sqrt();
        let interface = Interface { indices: [1.5, 1.0], cos_in };
        let ours = light
            .arrive(cos_in)
            .curve([-1.0, 0.0, -1.0], cos_in)
            .refract_without_window(&interface)
            .expect("passes")
            .curve([1.0, 0.0, 1.0], cos)
            .leave(cos);
        assert!(difference(&ours, &expected) < 1e-5, "glass at {sin}: {}", difference(&ours, &expected));
    }
}

#[test]
fn distant_and_local_lights_are_seen_in_a_sphere_as_the_verified_mathematics_says() {
    let (k, d, e) = (0.5, 2.0, 3.0);
    let seen = |light: Covariance2, d: f64| {
        let on = light.travel(d).curve([k, 0.0, 0.0], 1.0).curve([k, 0.0, 0.0], 1.0).travel(e);
        on.rows[1][1].sqrt()
    };
    assert!((seen(Covariance2::diagonal([0.0, 1.0]), 0.0) - (2.0 * k * e + 1.0)).abs() < 1e-12);
    assert!((seen(Covariance2::diagonal([1.0, 0.0]), d) - (d + e + 2.0 * k * d * e)).abs() < 1e-12);
}

#[test]
fn lobes_have_the_variances_of_their_functions() {
    for (exponent, variance) in [(10.0, 0.0907), (100.0, 0.009_90), (1000.0, 0.001_00)] {
        assert!((phong_lobe(exponent)[0] / variance - 1.0).abs() < 0.11);
        let hessian = lobe_from_log_hessian([-exponent, 0.0, -exponent]);
        assert!((hessian[0] - 1.0 / exponent).abs() < 1e-12);
    }
    // Henyey and Greenstein's peak by finite differences.
    for g in [0.3, 0.8, 0.95] {
        let log = |theta: f64| -1.5 * (1.0 + g * g - 2.0 * g * f64::cos(theta)).ln();
        let h = 1e-4;
        let second = (log(h) - 2.0 * log(0.0) + log(-h)) / (h * h);
        assert!((henyey_greenstein_peak(g) * -second - 1.0).abs() < 1e-3);
    }
    let [along, _, across] = microfacet_lobe(0.05, 0.5);
    assert!((along - 0.005).abs() < 1e-12 && (across - 0.001_25).abs() < 1e-12);
}

#[test]
fn a_rough_interface_blurs_as_its_slopes_turn_refracted_rays() {
    // From the geometry: rays refracted by normals that lean by ±δ.
    let interface = Interface { indices: [1.0, 1.5], cos_in: 0.8 };
    let angle = 0.8f64.acos();
    let refracted = |lean: f64| ((angle - lean).sin() / 1.5).asin() + lean;
    let delta = 1e-4;
    let turned = (refracted(delta) - refracted(-delta)) / (2.0 * delta);
    let slope = 0.01;
    let light = Covariance2::diagonal([0.0, 1e6]);
    let rough = light.refract_rough(&interface, slope).expect("passes");
    let smooth = light.refract(&interface).expect("passes");
    let added = (1.0 / rough.rows[1][1] - 1.0 / smooth.rows[1][1]) / (4.0 * PI * PI);
    assert!((added / (slope * turned * turned) - 1.0).abs() < 1e-6, "{added}");
}

#[test]
fn an_edge_in_motion_varies_in_time_as_it_does_in_space() {
    let light = Covariance5::diagonal([1.0, 2.0, 0.5, 0.6, 0.0]);
    let (radius, v) = (0.2, [3.0, -1.0]);
    let ours = light.occlude_moving(radius, v);
    let o = 1.0 / (4.0 * PI * PI * 0.25 * radius * radius);
    let mut expected = light;
    for (axis, v) in v.into_iter().enumerate() {
        let mut e = [0.0; 5];
        (e[axis], e[4]) = (1.0, -v);
        expected = expected.multiplied(&e, o);
    }
    assert!(difference(&ours, &expected) < 1e-12);
}

#[test]
fn nothing_singular_makes_anything_but_numbers() {
    let distant = Covariance4::diagonal([0.0, 0.0, 5.0, 0.0]);
    for singular in [Covariance4::ZERO, distant, Covariance4::of_window([0.0, f64::INFINITY, 1.0, f64::NAN])]
    {
        for after in [
            singular.reflect([0.0, 0.0, 0.0]),
            singular.reflect([f64::INFINITY, 0.0, 0.01]),
            singular.reflect([f64::NAN, f64::NAN, f64::NAN]),
            singular.leave(0.0),
            singular.occlude(0.0),
            singular.cosine(0.0),
            singular.thin_lens(0.0),
            singular.travel(1e12).travel(-1e12),
            singular.scatter(0.0, f64::INFINITY),
            singular.integrated(2).integrated(3),
        ] {
            assert!(after.rows.iter().flatten().all(|v| v.is_finite()), "{singular:?} {after:?}");
            assert!(kernel_precision(&after).iter().all(|v| v.is_finite()));
            let part = variance_within(&after, &[0.1; 4]);
            assert!((0.0..=1.0).contains(&part), "{part}");
        }
    }
}

#[test]
fn the_variance_within_a_window_is_that_of_a_random_field() {
    // E[1 − ρ] by quadrature over two samples of a box-free Gaussian spread.
    let sigma = Covariance2 { rows: [[0.5, 0.2], [0.2, 0.4]] };
    let w = [0.3, 0.1];
    let (mut sum, mut total) = (0.0, 0.0);
    for i in -80..=80 {
        for j in -80..=80 {
            let d = [f64::from(i) * 0.05, f64::from(j) * 0.05];
            let weight = (-0.25 * (d[0] * d[0] / w[0] + d[1] * d[1] / w[1])).exp();
            let q = d[0] * (sigma.rows[0][0] * d[0] + 2.0 * sigma.rows[0][1] * d[1])
                + sigma.rows[1][1] * d[1] * d[1];
            sum += weight * (1.0 - (-PI * PI * q).exp());
            total += weight;
        }
    }
    assert!((variance_within(&sigma, &w) - sum / total).abs() < 1e-6);
}

#[test]
fn what_remains_of_a_defocused_edge_is_its_circle_of_confusion() {
    // A texture without limit at depth z, seen through a lens focused at f: blur of a (1/z − 1/f)/2 per axis, in slopes.
    let camera = halflight_frequency::covariance::ThinLensCamera {
        pixel: [0.01, 0.01],
        focus_distance: 4.0,
        aperture_radius: 0.1,
    };
    let light = Covariance4::diagonal([1e12, 1e12, 0.0, 0.0]).travel(2.0);
    let film = camera.film(&light);
    let left = remaining(&film, &camera.integrated(false));
    let blur = 0.5 * 0.1 * (1.0 / 2.0 - 1.0 / 4.0) / 0.01;
    let expected = 1.0 / (4.0 * PI * PI * blur * blur);
    assert!((left.rows[0][0] / expected - 1.0).abs() < 1e-3, "{} {expected}", left.rows[0][0]);
    // In focus nothing is blurred.
    let sharp = camera.film(&Covariance4::diagonal([1e12, 1e12, 0.0, 0.0]).travel(4.0));
    assert!(remaining(&sharp, &camera.integrated(false)).rows[0][0] > 1e6 * expected);
}
