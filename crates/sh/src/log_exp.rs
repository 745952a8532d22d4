//! The exact logarithm and exponential of a function in SH (\[004\]).
//!
//! With M_f = R D Rᵀ the matrix of multiplication by f:
//!
//! ```text
//! exp f = R e^D Rᵀ 1            log g = R ln(max(D, floor)) Rᵀ 1
//! ```
//!
//! exp is the limit of the power series under SH products. log equals the form of \[004\], `R q'(D) Rᵀ (g − 1)`, where no
//! eigenvalue is below the floor, and has neither its removable singularity nor its undefined case D ≤ 0. exp(log g) = g
//! holds only approximately, since M_log g ≠ ln M_g: rms 1e-4 while all eigenvalues exceed 0.2, a few 1e-2 once the
//! floor acts. The floor of 0.02 is the value that verified best for visibility.
//!
//! A zonal function multiplies without mixing m, so its logarithm is zonal and needs only the `ORDER` × `ORDER` block of
//! m = 0.

use std::f64::consts::PI;

use crate::eigen::symmetric;
use crate::sh::SQRT_4PI;
use crate::{Sh, Zh, kernels};

/// R φ(D) Rᵀ · 1 of a symmetric matrix with the constant function as first coordinate.
fn function_of_matrix(matrix: Vec<f64>, n: usize, function: impl Fn(&[f64]) -> Vec<f64>) -> Vec<f64> {
    let (values, vectors) = symmetric(matrix, n);
    let values = function(&values);
    (0..n)
        .map(|i| SQRT_4PI * (0..n).map(|k| vectors[i * n + k] * values[k] * vectors[k]).sum::<f64>())
        .collect()
}

/// Smallest eigenvalues, as a part of the largest where `relative`.
fn log_with_floor(floor: f64, relative: bool) -> impl Fn(&[f64]) -> Vec<f64> {
    move |values| {
        let largest = values.iter().copied().fold(0.0, f64::max);
        let floor = if relative { floor * largest } else { floor };
        values.iter().map(|&value| value.max(floor).max(f64::MIN_POSITIVE).ln()).collect()
    }
}

fn exponentials(values: &[f64]) -> Vec<f64> {
    values.iter().map(|value| value.exp()).collect()
}

impl<const ORDER: usize> Sh<ORDER, f64> {
    fn matrix(&self) -> Vec<f64> {
        self.product_matrix().0.as_flattened().iter().flat_map(|row| row.coefficients().to_vec()).collect()
    }

    /// Eigenvalues of the matrix of multiplication by this function, ascending. They lie within its range of values.
    #[must_use]
    pub fn eigenvalues(&self) -> Vec<f64> {
        let (mut values, _) = symmetric(self.matrix(), ORDER * ORDER);
        values.sort_by(f64::total_cmp);
        values
    }

    /// The exact exponential, by eigen-decomposition.
    #[must_use]
    pub fn exp(&self) -> Self {
        let values = function_of_matrix(self.matrix(), ORDER * ORDER, exponentials);
        Self::from_fn(|i| values[i])
    }

    /// The exact logarithm, by eigen-decomposition; eigenvalues below `floor` are raised to it.
    #[must_use]
    pub fn log(&self, floor: f64) -> Self {
        let values = function_of_matrix(self.matrix(), ORDER * ORDER, log_with_floor(floor, false));
        Self::from_fn(|i| values[i])
    }
}

impl<const ORDER: usize> Sh<ORDER, f32> {
    /// The exact exponential, by eigen-decomposition in f64. For pixels there is [`crate::Exponential`].
    #[must_use]
    pub fn exp(&self) -> Self {
        self.cast().exp().cast()
    }

    /// The exact logarithm, by eigen-decomposition in f64; eigenvalues below `floor` are raised to it.
    #[must_use]
    pub fn log(&self, floor: f64) -> Self {
        self.cast().log(floor).cast()
    }
}

impl<const ORDER: usize> Zh<ORDER, f64> {
    /// The block of m = 0 of the matrix of multiplication.
    fn matrix(&self) -> Vec<f64> {
        let mut matrix = vec![0.0; ORDER * ORDER];
        let zonal = |index: usize| {
            let l = index.isqrt();
            (index == l * l + l).then_some(l)
        };
        for entry in kernels::tripling(ORDER) {
            if let (Some(a), Some(b), Some(c)) = (zonal(entry.i), zonal(entry.j), zonal(entry.k)) {
                let mut places = vec![(a, b, c), (b, a, c), (a, c, b), (c, a, b), (b, c, a), (c, b, a)];
                places.sort_unstable();
                places.dedup();
                for (row, column, factor) in places {
                    matrix[row * ORDER + column] += entry.value * self.0[factor];
                }
            }
        }
        matrix
    }

    /// The exact exponential: that of [`Sh::exp`], which is zonal.
    #[must_use]
    pub fn exp(&self) -> Self {
        let values = function_of_matrix(self.matrix(), ORDER, exponentials);
        Zh(std::array::from_fn(|l| values[l]))
    }

    /// The exact logarithm: that of [`Sh::log`], which is zonal.
    #[must_use]
    pub fn log(&self, floor: f64) -> Self {
        self.log_with(floor, false)
    }

    /// The exact logarithm with a floor that is a part of the largest eigenvalue.
    #[must_use]
    pub fn log_relative(&self, floor: f64) -> Self {
        self.log_with(floor, true)
    }

    fn log_with(&self, floor: f64, relative: bool) -> Self {
        let values = function_of_matrix(self.matrix(), ORDER, log_with_floor(floor, relative));
        Zh(std::array::from_fn(|l| values[l]))
    }

    /// The projection of the function's own values through another, by quadrature: ∫ φ(f(ω)) y_l0.
    #[must_use]
    pub fn of_angle(value: impl Fn(f64) -> f64, breaks: &[f64]) -> Self {
        let mut edges = vec![0.0, PI];
        edges.extend(breaks.iter().copied().filter(|&angle| angle > 0.0 && angle < PI));
        edges.sort_by(f64::total_cmp);
        let nodes = crate::legendre::gauss_legendre(64);
        let mut zh = [0.0; ORDER];
        for pair in edges.windows(2) {
            let (middle, half) = ((pair[0] + pair[1]) * 0.5, (pair[1] - pair[0]) * 0.5);
            for &(x, weight) in &nodes {
                let angle = middle + half * x;
                let p = crate::legendre::legendre(ORDER, angle.cos());
                let amount = 2.0 * PI * half * weight * angle.sin() * value(angle);
                for l in 0..ORDER {
                    zh[l] += amount * ((2.0 * l as f64 + 1.0) / (4.0 * PI)).sqrt() * p[l];
                }
            }
        }
        Zh(zh)
    }
}
