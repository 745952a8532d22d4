//! Vectors of SH coefficients.

use std::ops::{Add, AddAssign, Index, IndexMut, Mul, MulAssign, Neg, Sub, SubAssign};

use crate::simd::Work;
use crate::zonal::scale_bands;
use crate::{Real, Zh, kernels};

/// A function on the sphere as `ORDER`² coefficients: bands 0 to `ORDER` − 1, coefficient (l, m) at l² + l + m.
///
/// `T` is `f32` per pixel, `f64` for precomputation, or [`crate::batch::Lanes`] for sixteen vectors side by side.
/// Orders are 1 to 8; another one does not compile.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(transparent)]
pub struct Sh<const ORDER: usize, T = f32>(pub(crate) [[T; ORDER]; ORDER]);

impl<const ORDER: usize, T: Copy> Sh<ORDER, T> {
    /// Number of coefficients.
    pub const COUNT: usize = ORDER * ORDER;

    const CHECK: () = assert!(ORDER >= 1 && ORDER <= 8, "spherical harmonics are computed for orders 1 to 8");

    /// The coefficients that a function of the index gives.
    #[inline(always)]
    #[must_use]
    pub fn from_fn(mut coefficient: impl FnMut(usize) -> T) -> Self {
        const { Self::CHECK };
        Sh(filled(|row, column| coefficient(row * ORDER + column)))
    }

    /// The coefficients of a slice, if it has as many.
    #[must_use]
    pub fn from_slice(coefficients: &[T]) -> Option<Self> {
        (coefficients.len() == ORDER * ORDER).then(|| Self::from_fn(|i| coefficients[i]))
    }

    /// The coefficients, `ORDER`² of them.
    #[inline(always)]
    #[must_use]
    pub fn coefficients(&self) -> &[T] {
        self.0.as_flattened()
    }

    /// The coefficients, to be changed.
    #[inline(always)]
    pub fn coefficients_mut(&mut self) -> &mut [T] {
        self.0.as_flattened_mut()
    }

    /// The 2l + 1 coefficients of band `l`, from m = −l to l. `l` is less than `ORDER`.
    #[must_use]
    pub fn band(&self, l: usize) -> &[T] {
        &self.coefficients()[l * l..(l + 1) * (l + 1)]
    }

    /// Each coefficient changed by a function.
    #[inline(always)]
    #[must_use]
    pub fn map<U: Copy>(&self, mut change: impl FnMut(T) -> U) -> Sh<ORDER, U> {
        Sh(filled(|row, column| change(self.0[row][column])))
    }

    /// The same function with more bands (zero) or fewer (cut off).
    #[must_use]
    pub fn resized<const OTHER: usize>(&self) -> Sh<OTHER, T>
    where
        T: Real,
    {
        Sh::from_fn(|i| self.coefficients().get(i).copied().unwrap_or(T::of(0.0)))
    }
}

impl<const ORDER: usize, T: Real> Sh<ORDER, T> {
    /// The function 0.
    #[inline(always)]
    #[must_use]
    pub fn zero() -> Self {
        Self::from_fn(|_| T::of(0.0))
    }

    /// The function 1: (√4π, 0, …).
    #[inline(always)]
    #[must_use]
    pub fn one() -> Self {
        Self::constant(T::of(1.0))
    }

    /// A constant function.
    #[inline(always)]
    #[must_use]
    pub fn constant(value: T) -> Self {
        let mut sh = Self::zero();
        sh.0[0][0] = value * T::of(SQRT_4PI);
        sh
    }

    /// y_i of a unit direction: what a unit point of light there projects to.
    #[inline(always)]
    #[must_use]
    pub fn basis(direction: impl Into<[T; 3]>) -> Self {
        const { Self::CHECK };
        Sh(kernels::basis(direction.into()))
    }

    /// The function's value in a unit direction.
    #[inline]
    #[must_use]
    pub fn at(&self, direction: impl Into<[T; 3]>) -> T {
        self.dot(&Self::basis(direction))
    }

    /// ∫ f g over the sphere.
    #[inline(always)]
    #[must_use]
    pub fn dot(&self, other: &Self) -> T {
        // Four sums: one would wait for each addition.
        let mut sums = [T::of(0.0); 4];
        for (i, (&a, &b)) in self.coefficients().iter().zip(other.coefficients()).enumerate() {
            sums[i % 4] = a.mul_add(b, sums[i % 4]);
        }
        (sums[0] + sums[1]) + (sums[2] + sums[3])
    }

    /// √∫ f².
    #[must_use]
    pub fn norm(&self) -> T {
        self.dot(self).sqrt()
    }

    /// The projection of the product of two functions: Σ_jk Γ_ijk f_j g_k. Commutative, and not associative.
    #[must_use]
    pub fn product(&self, other: &Self) -> Self {
        T::best(Product(self, other))
    }

    /// The product with itself, at three quarters of the cost.
    #[must_use]
    pub fn square(&self) -> Self {
        T::best(Square(self))
    }

    /// [`Sh::product`] for kernels ([`crate::Kernel`]) that are compiled for special instructions.
    #[inline(always)]
    #[must_use]
    pub fn product_inlined(&self, other: &Self) -> Self {
        Sh(kernels::product(&self.0, &other.0))
    }

    /// [`Sh::square`] for kernels that are compiled for special instructions.
    #[inline(always)]
    pub(crate) fn square_inlined(&self) -> Self {
        Sh(kernels::square(&self.0))
    }

    /// ∫ f g h over the sphere.
    #[must_use]
    pub fn triple_product(&self, g: &Self, h: &Self) -> T {
        self.product(g).dot(h)
    }

    /// The matrix of multiplication by this function.
    #[must_use]
    pub fn product_matrix(&self) -> ProductMatrix<ORDER, T> {
        let mut rows = [[Self::zero(); ORDER]; ORDER];
        let at = rows.as_flattened_mut();
        let f = self.coefficients();
        for &crate::tensor::Entry { i, j, k, value } in kernels::tripling(ORDER) {
            let gamma = T::of(value);
            let mut add = |row: usize, column: usize, factor: usize| {
                let place = &mut at[row].coefficients_mut()[column];
                *place = gamma.mul_add(f[factor], *place);
                if row != column {
                    let place = &mut at[column].coefficients_mut()[row];
                    *place = gamma.mul_add(f[factor], *place);
                }
            };
            // The three ways to take one of the indices away, each once.
            add(i, j, k);
            if k != j {
                add(i, k, j);
            }
            if i != j {
                add(j, k, i);
            }
        }
        ProductMatrix(rows)
    }

    /// Convolution with a zonal function: f_lm √(4π/(2l+1)) z_l.
    #[must_use]
    pub fn convolved(&self, kernel: &Zh<ORDER, T>) -> Self {
        let mut sh = *self;
        scale_bands(&mut sh, &kernel.scaled());
        sh
    }

    /// Radiance to irradiance as a function of the normal: convolution with the clamped cosine.
    #[must_use]
    pub fn irradiance(&self) -> Self {
        self.convolved(&Zh::clamped_cosine())
    }
}

struct Product<'a, const ORDER: usize, T>(&'a Sh<ORDER, T>, &'a Sh<ORDER, T>);

impl<const ORDER: usize, T: Real> Work for Product<'_, ORDER, T> {
    type Output = Sh<ORDER, T>;
    #[inline(always)]
    fn run(self) -> Sh<ORDER, T> {
        self.0.product_inlined(self.1)
    }
}

struct Square<'a, const ORDER: usize, T>(&'a Sh<ORDER, T>);

impl<const ORDER: usize, T: Real> Work for Square<'_, ORDER, T> {
    type Output = Sh<ORDER, T>;
    #[inline(always)]
    fn run(self) -> Sh<ORDER, T> {
        self.0.square_inlined()
    }
}

/// An array from its places. A plain loop: the functions of the standard library are calls that are not always inlined,
/// and a call inside a kernel leaves the instructions it is compiled for.
#[inline(always)]
pub(crate) fn filled<const A: usize, const B: usize, T: Copy>(
    mut value: impl FnMut(usize, usize) -> T,
) -> [[T; B]; A] {
    let mut all = [[value(0, 0); B]; A];
    for row in 0..A {
        for column in 0..B {
            if row + column > 0 {
                all[row][column] = value(row, column);
            }
        }
    }
    all
}

/// √4π: the coefficient of the function 1.
pub(crate) const SQRT_4PI: f64 = 3.544_907_701_811_032;

/// √(4π/(2l+1)), by which a zonal coefficient is scaled when its axis moves.
#[inline(always)]
pub(crate) fn zonal_factor(l: usize) -> f64 {
    const FACTORS: [f64; 8] = [
        3.544_907_701_811_031_8,
        2.046_653_415_892_977,
        1.585_330_919_042_404_3,
        1.339_849_171_381_357_6,
        1.181_635_900_603_677_4,
        1.068_829_887_577_114_3,
        0.983_180_498_897_452_7,
        0.915_291_232_863_768_9,
    ];
    FACTORS[l]
}

macro_rules! impl_scalar {
    ($t:ty, $other:ty) => {
        impl<const ORDER: usize> Sh<ORDER, $t> {
            /// The same coefficients in the other precision.
            #[must_use]
            pub fn cast(&self) -> Sh<ORDER, $other> {
                self.map(|value| value as $other)
            }

            /// Whether every coefficient is a finite number.
            #[must_use]
            pub fn is_finite(&self) -> bool {
                self.coefficients().iter().all(|value| value.is_finite())
            }
        }
    };
}

impl_scalar!(f32, f64);
impl_scalar!(f64, f32);

impl<const ORDER: usize, T: Real> Default for Sh<ORDER, T> {
    fn default() -> Self {
        Self::zero()
    }
}

impl<const ORDER: usize, T> Index<usize> for Sh<ORDER, T> {
    type Output = T;
    #[inline(always)]
    fn index(&self, index: usize) -> &T {
        &self.0.as_flattened()[index]
    }
}

impl<const ORDER: usize, T> IndexMut<usize> for Sh<ORDER, T> {
    #[inline(always)]
    fn index_mut(&mut self, index: usize) -> &mut T {
        &mut self.0.as_flattened_mut()[index]
    }
}

impl<const ORDER: usize, T: Real> Add for Sh<ORDER, T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::from_fn(|i| self[i] + other[i])
    }
}

impl<const ORDER: usize, T: Real> Sub for Sh<ORDER, T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::from_fn(|i| self[i] - other[i])
    }
}

impl<const ORDER: usize, T: Real> Neg for Sh<ORDER, T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::from_fn(|i| -self[i])
    }
}

impl<const ORDER: usize, T: Real> Mul<T> for Sh<ORDER, T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: T) -> Self {
        Self::from_fn(|i| self[i] * factor)
    }
}

impl<const ORDER: usize, T: Real> AddAssign for Sh<ORDER, T> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const ORDER: usize, T: Real> SubAssign for Sh<ORDER, T> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl<const ORDER: usize, T: Real> MulAssign<T> for Sh<ORDER, T> {
    #[inline(always)]
    fn mul_assign(&mut self, factor: T) {
        *self = *self * factor;
    }
}

impl<const ORDER: usize, T: Real> std::iter::Sum for Sh<ORDER, T> {
    fn sum<I: Iterator<Item = Self>>(terms: I) -> Self {
        terms.fold(Self::zero(), |a, b| a + b)
    }
}

/// The symmetric matrix M_f with M_f g = f·g: (M_f)_ij = Σ_k Γ_ijk f_k. Worth its making when one function multiplies
/// many.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProductMatrix<const ORDER: usize, T = f32>(pub(crate) [[Sh<ORDER, T>; ORDER]; ORDER]);

impl<const ORDER: usize, T: Real> ProductMatrix<ORDER, T> {
    /// Row `index`.
    #[must_use]
    pub fn row(&self, index: usize) -> &Sh<ORDER, T> {
        &self.0.as_flattened()[index]
    }

    /// f·g.
    #[must_use]
    pub fn apply(&self, g: &Sh<ORDER, T>) -> Sh<ORDER, T> {
        Sh::from_fn(|i| self.row(i).dot(g))
    }
}
