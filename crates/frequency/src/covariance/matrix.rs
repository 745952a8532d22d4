//! A symmetric positive semidefinite matrix in two to five dimensions, and the three things that events do to it: change of
//! variables, multiplication by a window, blur by a kernel.

use std::f64::consts::PI;

/// 4π², between primal variances and their inverses in frequency.
pub(crate) const FOUR_PI_SQUARED: f64 = 4.0 * PI * PI;

/// The largest entry: frequencies beyond 10¹⁵ cycles per unit do not exist, and squares of it still have room in f64.
pub(crate) const UNLIMITED: f64 = 1e30;

/// What an axis may lose before rounding (1e-16) matters beside what is left.
const LOST: f64 = 1e-4;

/// Covariance of a local light field's spectrum, in cycles² per unit².
///
/// N is 2 for (x, u), 3 for (x, u, t), 4 for (x, y, u, v), 5 for (x, y, u, v, t); no other is of use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Covariance<const N: usize> {
    /// Rows of the matrix; always symmetric.
    pub rows: [[f64; N]; N],
}

impl<const N: usize> Default for Covariance<N> {
    fn default() -> Self {
        Self::ZERO
    }
}

impl<const N: usize> Covariance<N> {
    /// Light that is the same everywhere.
    pub const ZERO: Self = Self { rows: [[0.0; N]; N] };
    /// How many of the dimensions are positions; as many are angles.
    pub const SPACE: usize = N / 2;
    /// Whether the last dimension is time.
    pub const HAS_TIME: bool = N % 2 == 1;

    /// Independent variations along the axes, cycles².
    #[must_use]
    pub fn diagonal(variances: [f64; N]) -> Self {
        let mut result = Self::ZERO;
        for i in 0..N {
            result.rows[i][i] = bounded(variances[i]);
        }
        result
    }

    /// The spectrum of a Gaussian window whose standard deviations these are; infinity where it has no border.
    #[must_use]
    pub fn of_window(deviations: [f64; N]) -> Self {
        Self::diagonal(deviations.map(|s| 1.0 / (FOUR_PI_SQUARED * s * s)))
    }

    /// Dimension of the time; the last.
    #[inline]
    #[must_use]
    pub fn time() -> Option<usize> {
        Self::HAS_TIME.then_some(N - 1)
    }

    /// Σ' = Tᵀ Σ T, where the light after is l₁(z) = l₀(T z).
    #[inline]
    #[must_use]
    pub fn transformed(&self, t: &[[f64; N]; N]) -> Self {
        let mut half = [[0.0; N]; N];
        for i in 0..N {
            for j in 0..N {
                for k in 0..N {
                    half[i][j] += self.rows[i][k] * t[k][j];
                }
            }
        }
        let mut result = Self::ZERO;
        for i in 0..N {
            for j in i..N {
                let mut sum = 0.0;
                for k in 0..N {
                    sum += t[k][i] * half[k][j];
                }
                (result.rows[i][j], result.rows[j][i]) = (sum, sum);
            }
        }
        result.tidy()
    }

    /// The shear T = 1 + amount · e_row e_columnᵀ: l₁(z) has z_row + amount · z_column in place of z_row.
    #[inline]
    #[must_use]
    pub fn sheared(mut self, row: usize, column: usize, amount: f64) -> Self {
        let terms = self.rows[column][column] + amount * amount * self.rows[row][row];
        // Ω_column' = Ω_column + amount · Ω_row.
        for j in 0..N {
            self.rows[column][j] += amount * self.rows[row][j];
        }
        for i in 0..N {
            self.rows[i][column] += amount * self.rows[i][row];
        }
        if self.rows[column][column] >= LOST * terms {
            return self.within_range(column);
        }
        let mut scale = self.variances();
        scale[column] = terms;
        self.tidy().resolved(&scale)
    }

    /// T = diag(…, factor at `axis`, …).
    #[inline]
    #[must_use]
    pub fn scaled(mut self, axis: usize, factor: f64) -> Self {
        for j in 0..N {
            self.rows[axis][j] *= factor;
        }
        for i in 0..N {
            self.rows[i][axis] *= factor;
        }
        self.within_range(axis)
    }

    /// Multiplication by something that varies by `amount` cycles² along one direction `e`: Σ + amount · e eᵀ.
    #[inline]
    #[must_use]
    pub fn multiplied(mut self, e: &[f64; N], amount: f64) -> Self {
        let amount = bounded(amount);
        for i in 0..N {
            for j in 0..N {
                self.rows[i][j] += amount * e[i] * e[j];
            }
        }
        for axis in 0..N {
            self = self.within_range(axis);
        }
        self
    }

    /// Multiplication by a Gaussian window of variance `variance` along one axis; 0 is a slit, infinity nothing.
    #[inline]
    #[must_use]
    pub fn windowed(mut self, axis: usize, variance: f64) -> Self {
        self.rows[axis][axis] = bounded(self.rows[axis][axis] + 1.0 / (FOUR_PI_SQUARED * variance.max(0.0)));
        self
    }

    /// Convolution by a Gaussian of variance `variance` along the direction `e`: (Σ⁻¹ + 4π² b e eᵀ)⁻¹ as a rank-one update,
    /// which singular matrices survive. `[003]` BRDF, in the safe form of the verified mathematics.
    #[inline]
    #[must_use]
    pub fn blurred(mut self, e: &[f64; N], variance: f64) -> Self {
        let mut s = [0.0; N];
        for i in 0..N {
            for j in 0..N {
                s[i] += self.rows[i][j] * e[j];
            }
        }
        let along: f64 = (0..N).map(|i| e[i] * s[i]).sum();
        // 1/(1/b + eᵀΣe), so that an infinite b is a slice.
        let inverse = 1.0 / (FOUR_PI_SQUARED * variance.max(0.0));
        let denominator = inverse + along;
        // Nothing varies there, or not a number.
        if denominator <= 0.0 || !denominator.is_finite() {
            return self;
        }
        let scale = self.variances();
        for i in 0..N {
            for j in 0..N {
                self.rows[i][j] -= s[i] * s[j] / denominator;
            }
        }
        if (0..N).all(|i| self.rows[i][i] >= LOST * scale[i]) {
            return self;
        }
        self.tidy().resolved(&scale)
    }

    /// Convolution along one axis.
    #[inline]
    #[must_use]
    pub fn blurred_along(self, axis: usize, variance: f64) -> Self {
        let mut e = [0.0; N];
        e[axis] = 1.0;
        self.blurred(&e, variance)
    }

    /// Integration over one axis: the slice Ω_axis = 0 of the spectrum, its conditional covariance.
    #[inline]
    #[must_use]
    pub fn integrated(self, axis: usize) -> Self {
        let mut result = self.blurred_along(axis, f64::INFINITY);
        for i in 0..N {
            (result.rows[axis][i], result.rows[i][axis]) = (0.0, 0.0);
        }
        result
    }

    /// What two things vary by that multiply, or that light has met one after the other on the same axes: Σ + Σ₂.
    #[inline]
    #[must_use]
    pub fn plus(mut self, other: &Self) -> Self {
        for i in 0..N {
            for j in 0..N {
                self.rows[i][j] += other.rows[i][j];
            }
        }
        self.tidy()
    }

    /// eᵀ Σ e.
    #[inline]
    #[must_use]
    pub fn along(&self, e: &[f64; N]) -> f64 {
        let mut sum = 0.0;
        for i in 0..N {
            for j in 0..N {
                sum += e[i] * self.rows[i][j] * e[j];
            }
        }
        sum.max(0.0)
    }

    /// The sum of the diagonal.
    #[inline]
    #[must_use]
    pub fn trace(&self) -> f64 {
        (0..N).map(|i| self.rows[i][i]).sum()
    }

    /// det(1 + W Σ) for a diagonal W ≥ 0, by elimination on the symmetric form 1 + √W Σ √W.
    #[must_use]
    pub fn determinant_of_one_plus(&self, w: &[f64; N]) -> f64 {
        let mut m = [[0.0; N]; N];
        for i in 0..N {
            for j in 0..N {
                m[i][j] = (w[i].max(0.0) * w[j].max(0.0)).sqrt() * self.rows[i][j];
            }
            m[i][i] += 1.0;
        }
        let mut determinant = 1.0;
        for k in 0..N {
            let pivot = m[k][k].max(1.0);
            determinant *= pivot;
            for i in k + 1..N {
                let factor = m[i][k] / pivot;
                for j in k + 1..N {
                    m[i][j] -= factor * m[k][j];
                }
            }
        }
        determinant
    }

    /// Eigenvalues in no order, by Jacobi's rotations: for tests and explanations.
    #[must_use]
    pub fn eigenvalues(&self) -> [f64; N] {
        let mut m = self.rows;
        for _ in 0..64 {
            let off: f64 =
                (0..N).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| m[i][j] * m[i][j]).sum();
            let on: f64 = (0..N).map(|i| m[i][i] * m[i][i]).sum();
            if off <= 1e-32 * on {
                break;
            }
            for p in 0..N {
                for q in p + 1..N {
                    rotate_away(&mut m, p, q);
                }
            }
        }
        std::array::from_fn(|i| m[i][i])
    }

    /// Whether no eigenvalue is negative by more than `tolerance` times the trace.
    #[must_use]
    pub fn is_positive_semidefinite(&self, tolerance: f64) -> bool {
        let floor = -tolerance * self.trace();
        self.eigenvalues().iter().all(|&value| value >= floor)
    }

    #[inline]
    fn variances(&self) -> [f64; N] {
        std::array::from_fn(|i| self.rows[i][i])
    }

    /// Where an axis has lost most of `scale`, the size of the terms that made it, what is left may be rounding: keeps the
    /// part that can be told from it, by a Cholesky decomposition with pivots that are cut off at the rounding.
    #[cold]
    fn resolved(mut self, scale: &[f64; N]) -> Self {
        /// A few roundings of f64.
        const ROUNDING: f64 = 16.0 * f64::EPSILON;
        let mut result = Self::ZERO;
        for _ in 0..N {
            let share = |i: usize| if scale[i] > 0.0 { self.rows[i][i] / scale[i] } else { 0.0 };
            let pivot = (1..N).fold(0, |best, i| if share(i) > share(best) { i } else { best });
            if share(pivot) <= ROUNDING {
                break;
            }
            let (column, height) = (self.rows[pivot], self.rows[pivot][pivot]);
            for i in 0..N {
                for j in 0..N {
                    let square = column[i] * column[j] / height;
                    result.rows[i][j] += square;
                    self.rows[i][j] -= square;
                }
            }
            for i in 0..N {
                (self.rows[pivot][i], self.rows[i][pivot]) = (0.0, 0.0);
            }
        }
        result.tidy()
    }

    /// The axis as it is, if it is a variance that exists.
    #[inline]
    fn within_range(mut self, axis: usize) -> Self {
        if !(0.0..=UNLIMITED).contains(&self.rows[axis][axis]) {
            self.limit(axis);
        }
        self
    }

    /// After rounding: no negative variances, none above the largest frequency, and no correlation above 1.
    #[inline]
    fn tidy(mut self) -> Self {
        for i in 0..N {
            let kept = self.rows[i][i];
            if !(0.0..=UNLIMITED).contains(&kept) {
                self.limit(i);
            }
        }
        for i in 0..N {
            for j in 0..i {
                let most = (self.rows[i][i] * self.rows[j][j]).sqrt();
                let value = self.rows[i][j].clamp(-most, most);
                (self.rows[i][j], self.rows[j][i]) = (value, value);
            }
        }
        self
    }

    /// Brings one axis back into range; a scaling of the axis, which keeps the matrix semidefinite.
    #[cold]
    fn limit(&mut self, axis: usize) {
        let value = self.rows[axis][axis];
        if value > UNLIMITED && value.is_finite() {
            let factor = (UNLIMITED / value).sqrt();
            for j in 0..N {
                self.rows[axis][j] *= factor;
            }
            for i in 0..N {
                self.rows[i][axis] *= factor;
            }
            return;
        }
        // Less than nothing by rounding, or not a number: nothing correlates with it.
        for j in 0..N {
            (self.rows[axis][j], self.rows[j][axis]) = (0.0, 0.0);
        }
        self.rows[axis][axis] = if value > 0.0 { UNLIMITED } else { 0.0 };
    }
}

#[inline]
pub(crate) fn bounded(value: f64) -> f64 {
    // NaN (0/0: a window of no size on nothing) is without limit.
    if value <= UNLIMITED { value.max(0.0) } else { UNLIMITED }
}

fn rotate_away<const N: usize>(m: &mut [[f64; N]; N], p: usize, q: usize) {
    if m[p][q] == 0.0 {
        return;
    }
    let angle = 0.5 * (2.0 * m[p][q]).atan2(m[q][q] - m[p][p]);
    let (sin, cos) = angle.sin_cos();
    for k in 0..N {
        let (a, b) = (m[k][p], m[k][q]);
        (m[k][p], m[k][q]) = (cos * a - sin * b, sin * a + cos * b);
    }
    for k in 0..N {
        let (a, b) = (m[p][k], m[q][k]);
        (m[p][k], m[q][k]) = (cos * a - sin * b, sin * a + cos * b);
    }
}

/// The union of several paths: their covariances weighted by what they bring.
///
/// The spectrum of a sum has, phases being random, the weighted mean of the moments.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mean<const N: usize> {
    sum: [[f64; N]; N],
    /// What all paths bring together.
    pub weight: f64,
}

impl<const N: usize> Default for Mean<N> {
    fn default() -> Self {
        Self { sum: [[0.0; N]; N], weight: 0.0 }
    }
}

impl<const N: usize> Mean<N> {
    /// Adds a path that brings so much light; nothing if that is not a positive number.
    pub fn add(&mut self, covariance: &Covariance<N>, weight: f64) {
        if !(weight > 0.0 && weight.is_finite()) {
            return;
        }
        for i in 0..N {
            for j in 0..N {
                self.sum[i][j] += weight * covariance.rows[i][j];
            }
        }
        self.weight += weight;
    }

    /// Adds what another has gathered.
    pub fn merge(&mut self, other: &Self) {
        for i in 0..N {
            for j in 0..N {
                self.sum[i][j] += other.sum[i][j];
            }
        }
        self.weight += other.weight;
    }

    /// The mean; zero without paths.
    #[must_use]
    pub fn covariance(&self) -> Covariance<N> {
        if self.weight <= 0.0 {
            return Covariance::ZERO;
        }
        Covariance { rows: self.sum.map(|row| row.map(|value| value / self.weight)) }.tidy()
    }
}
