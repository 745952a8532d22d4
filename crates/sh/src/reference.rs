//! The slow and obvious forms, in f64 and for any order: what the fast ones are tested against.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};

/// y_i of a unit direction straight from the definition: K_lm, the recursion of P_l^m in the form of the textbook, and
/// cos mφ, sin mφ of the azimuth.
#[must_use]
pub fn basis(order: usize, direction: DVec3) -> Vec<f64> {
    let (x, sine) = (direction.z, direction.x.hypot(direction.y));
    let azimuth = direction.y.atan2(direction.x);
    let mut values = vec![0.0; order * order];
    for m in 0..order {
        // P_m^m = (2m−1)!! sin^m, then upwards in l.
        let mut before = 0.0;
        let mut p: f64 = (1..=m).map(|k| (2.0 * k as f64 - 1.0) * sine).product();
        for l in m..order {
            let ratio: f64 = (l - m + 1..=l + m).map(|k| k as f64).product();
            let k = ((2.0 * l as f64 + 1.0) / (4.0 * PI * ratio)).sqrt();
            let angle = m as f64 * azimuth;
            if m == 0 {
                values[l * l + l] = k * p;
            } else {
                values[l * l + l + m] = 2f64.sqrt() * k * p * angle.cos();
                values[l * l + l - m] = 2f64.sqrt() * k * p * angle.sin();
            }
            let (l, m) = (l as f64, m as f64);
            (before, p) = (p, ((2.0 * l + 1.0) * x * p - (l + m) * before) / (l + 1.0 - m));
        }
    }
    values
}

/// The matrix of a rotation for one band after the other, row by row: band l is a square of 2l + 1.
///
/// J. Ivanic, K. Ruedenberg, Rotation Matrices for Real Spherical Harmonics: Direct Determination by Recursion, 1996,
/// with the corrections of 1998. The block of l = 1 is the matrix in the order (y, z, x).
#[must_use]
pub fn rotation_matrix(order: usize, matrix: &DMat3) -> Vec<Vec<f64>> {
    let axis = [1, 2, 0];
    let first: Vec<f64> = (0..9).map(|place| matrix.col(axis[place % 3])[axis[place / 3]]).collect();
    let mut bands = vec![vec![1.0]];
    for l in 1..order {
        if l == 1 {
            bands.push(first.clone());
            continue;
        }
        let band = next_band(l as i32, &first, &bands[l - 1]);
        bands.push(band);
    }
    bands.truncate(order);
    bands
}

fn next_band(l: i32, first: &[f64], before: &[f64]) -> Vec<f64> {
    let r = |i: i32, j: i32| first[((i + 1) * 3 + j + 1) as usize];
    let q = |a: i32, b: i32| before[((a + l - 1) * (2 * l - 1) + b + l - 1) as usize];
    let p = |i: i32, a: i32, b: i32| {
        if b == l {
            r(i, 1) * q(a, l - 1) - r(i, -1) * q(a, 1 - l)
        } else if b == -l {
            r(i, 1) * q(a, 1 - l) + r(i, -1) * q(a, l - 1)
        } else {
            r(i, 0) * q(a, b)
        }
    };
    let mut band = Vec::with_capacity(((2 * l + 1) * (2 * l + 1)) as usize);
    for m in -l..=l {
        for n in -l..=l {
            let d = f64::from(if n.abs() == l { 2 * l * (2 * l - 1) } else { (l + n) * (l - n) });
            let a = m.abs();
            let at_zero = if m == 0 { 1.0 } else { 0.0 };
            let u = (f64::from((l + m) * (l - m)) / d).sqrt();
            let v =
                0.5 * ((1.0 + at_zero) * f64::from((l + a - 1) * (l + a)) / d).sqrt() * (1.0 - 2.0 * at_zero);
            let w = -0.5 * (f64::from((l - a - 1) * (l - a)) / d).sqrt() * (1.0 - at_zero);
            let mut sum = 0.0;
            if u != 0.0 {
                sum += u * p(0, m, n);
            }
            if v != 0.0 {
                sum += v * match m {
                    0 => p(1, 1, n) + p(-1, -1, n),
                    1 => 2f64.sqrt() * p(1, 0, n),
                    -1 => 2f64.sqrt() * p(-1, 0, n),
                    m if m > 0 => p(1, m - 1, n) - p(-1, 1 - m, n),
                    m => p(1, m + 1, n) + p(-1, -m - 1, n),
                };
            }
            if w != 0.0 {
                sum += w * if m > 0 {
                    p(1, m + 1, n) + p(-1, -m - 1, n)
                } else {
                    p(1, m - 1, n) - p(-1, 1 - m, n)
                };
            }
            band.push(sum);
        }
    }
    band
}

/// A vector of coefficients turned by the matrices of [`rotation_matrix`].
#[must_use]
pub fn rotated(coefficients: &[f64], matrix: &DMat3) -> Vec<f64> {
    let order = coefficients.len().isqrt();
    let bands = rotation_matrix(order, matrix);
    let mut out = Vec::with_capacity(coefficients.len());
    for (l, band) in bands.iter().enumerate() {
        let (n, from) = (2 * l + 1, &coefficients[l * l..(l + 1) * (l + 1)]);
        out.extend((0..n).map(|row| (0..n).map(|column| band[row * n + column] * from[column]).sum::<f64>()));
    }
    out
}

/// Nodes of a quadrature over the sphere, exact for functions of bands below 2 · `order`: directions and solid angles.
#[must_use]
pub fn sphere_quadrature(order: usize) -> Vec<(DVec3, f64)> {
    let (heights, around) = (order.max(1), 2 * order.max(1));
    let mut nodes = Vec::with_capacity(heights * around);
    for (z, weight) in crate::legendre::gauss_legendre(heights) {
        let r = (1.0 - z * z).sqrt();
        for step in 0..around {
            let angle = 2.0 * PI * (step as f64 + 0.5) / around as f64;
            nodes.push((DVec3::new(r * angle.cos(), r * angle.sin(), z), weight * 2.0 * PI / around as f64));
        }
    }
    nodes
}
