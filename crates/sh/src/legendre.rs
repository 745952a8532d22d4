//! Legendre functions in f64, and the quadrature that integrates them exactly.
//!
//! `Ñ_l^m(x) = K_lm P_l^m(x)` without Condon–Shortley phase, times √2 for m > 0, by the recursion
//! `Ñ_l = a (x Ñ_{l−1} − b Ñ_{l−2})`, which stays of order one at every l. This file is also compiled into the build
//! script that writes the constants of the fast kernels.

use std::f64::consts::PI;

/// √((4l² − 1)/(l² − m²)): the factor of the recursion in l.
pub(crate) fn step(l: usize, m: usize) -> f64 {
    let (l, m) = (l as f64, m as f64);
    ((4.0 * l * l - 1.0) / (l * l - m * m)).sqrt()
}

/// Ñ_m^m without its power of sin t: √2 K_mm (2m−1)!!.
pub(crate) fn diagonal(m: usize) -> f64 {
    let mut value = (1.0 / (4.0 * PI)).sqrt();
    for k in 1..=m {
        let k = k as f64;
        value *= ((2.0 * k + 1.0) / (2.0 * k)).sqrt();
    }
    if m > 0 { value * 2f64.sqrt() } else { value }
}

/// Ñ_l^m(x)/(1−x²)^(m/2) for l = m .. order−1.
pub(crate) fn reduced_column(order: usize, m: usize, x: f64) -> Vec<f64> {
    let mut column = vec![diagonal(m)];
    if order > m + 1 {
        column.push(step(m + 1, m) * x * column[0]);
    }
    for l in m + 2..order {
        let k = column.len();
        column.push(step(l, m) * (x * column[k - 1] - column[k - 2] / step(l - 1, m)));
    }
    column
}

/// P_0(x) .. P_{count−1}(x).
pub(crate) fn legendre(count: usize, x: f64) -> Vec<f64> {
    let mut p = vec![1.0, x];
    for l in 2..count.max(2) {
        let k = l as f64;
        p.push(((2.0 * k - 1.0) * x * p[l - 1] - (k - 1.0) * p[l - 2]) / k);
    }
    p.truncate(count);
    p
}

/// Nodes and weights on [−1, 1] that integrate polynomials of degree 2n − 1 exactly.
pub(crate) fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    (0..n)
        .map(|i| {
            let mut x = (PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..100 {
                let p = legendre(n + 1, x);
                slope = n as f64 * (x * p[n] - p[n - 1]) / (x * x - 1.0);
                let change = p[n] / slope;
                x -= change;
                if change.abs() < 1e-16 {
                    break;
                }
            }
            (x, 2.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}
