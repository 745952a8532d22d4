//! Rotation of SH vectors by a matrix.
//!
//! Active: (R f)(ω) = f(Rᵀ ω), so what stood at ω stands at R ω afterwards. A rotation R = Rz(α) Ry(β) Rz(γ) acts as
//! `D = Z_α X₋₉₀ Z_β X₊₉₀ Z_γ` (\[004\], in the order printed there): rotations about z mix only the coefficients ±m of a
//! band, `f'₋ₘ = cos(mα) f₋ₘ + sin(mα) fₘ`, `f'ₘ = −sin(mα) f₋ₘ + cos(mα) fₘ`, and the two quarter turns about x
//! (X₊₉₀ takes y to z) are constants, mostly zeros. The slow form, by recursion over the bands, is
//! [`crate::reference::rotation_matrix`].

use glam::{DMat3, Mat3};

use crate::simd::Work;
use crate::{Real, Sh};

/// A rotation prepared for SH vectors of one order. Making it costs a square root and two divisions; keep it when several
/// vectors turn alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotation<const ORDER: usize, T = f32> {
    /// (cos, sin) of α, β and γ.
    turns: [[T; 2]; 3],
}

/// (x, y) at length 1; where it is too short to tell, (1, 0).
#[inline(always)]
fn direction_in_plane<T: Real + PartialEq>(x: T, y: T) -> (T, T) {
    let across = x.mul_add(x, y * y);
    let known = across.max(T::of(1e-30));
    if known == across {
        let length = across.sqrt();
        (x.over(length), y.over(length))
    } else {
        (T::of(1.0), T::of(0.0))
    }
}

/// A 3 × 3 matrix of numbers `T`: [`Mat3`] of f32, [`DMat3`] of f64.
pub trait Matrix3<T>: sealed::Sealed {
    /// The images of x, y and z.
    fn columns(&self) -> [[T; 3]; 3];
}

mod sealed {
    /// Keeps the set of implementations closed.
    pub trait Sealed {}
    impl Sealed for glam::Mat3 {}
    impl Sealed for glam::DMat3 {}
}

impl Matrix3<f32> for Mat3 {
    fn columns(&self) -> [[f32; 3]; 3] {
        self.to_cols_array_2d()
    }
}

impl Matrix3<f64> for DMat3 {
    fn columns(&self) -> [[f64; 3]; 3] {
        self.to_cols_array_2d()
    }
}

impl<const ORDER: usize, T: Real + PartialEq> Sh<ORDER, T> {
    /// The function turned by a rotation matrix.
    #[inline]
    #[must_use]
    pub fn rotated(&self, matrix: &impl Matrix3<T>) -> Self {
        T::best(Turn { columns: matrix.columns(), sh: self })
    }
}

/// Decomposition and rotation in one.
struct Turn<'a, const ORDER: usize, T> {
    columns: [[T; 3]; 3],
    sh: &'a Sh<ORDER, T>,
}

impl<const ORDER: usize, T: Real + PartialEq> Work for Turn<'_, ORDER, T> {
    type Output = Sh<ORDER, T>;
    #[inline(always)]
    fn run(self) -> Sh<ORDER, T> {
        Apply { turns: &euler_turns(self.columns), sh: self.sh }.run()
    }
}

struct Apply<'a, const ORDER: usize, T> {
    turns: &'a [[T; 2]; 3],
    sh: &'a Sh<ORDER, T>,
}

impl<const ORDER: usize, T: Real> Work for Apply<'_, ORDER, T> {
    type Output = Sh<ORDER, T>;
    #[inline(always)]
    fn run(self) -> Sh<ORDER, T> {
        Sh(T::rotate(&self.sh.0, self.turns))
    }
}

/// (cos, sin) of α, β, γ.
///
/// γ, which is needed first, comes from what falls on +z; near the poles it is poorly known, and β and α are then
/// computed from it, so that its error cancels.
#[inline(always)]
fn euler_turns<T: Real + PartialEq>([x, y, z]: [[T; 3]; 3]) -> [[T; 2]; 3] {
    let (cg, sg) = direction_in_plane(-x[2], y[2]);
    let (cb, sb) = (z[2], (sg * y[2]).less(cg, x[2]));
    let (ca, sa) = (sg.mul_add(x[1], cg * y[1]), -(sg.mul_add(x[0], cg * y[0])));
    [[ca, sa], [cb, sb], [cg, sg]]
}

impl<const ORDER: usize, T: Real + PartialEq> Rotation<ORDER, T> {
    /// The rotation of a matrix that is orthogonal with determinant 1.
    #[inline]
    #[must_use]
    pub fn from_matrix(matrix: &impl Matrix3<T>) -> Self {
        Rotation { turns: euler_turns(matrix.columns()) }
    }

    /// The function turned.
    #[inline]
    #[must_use]
    pub fn apply(&self, sh: &Sh<ORDER, T>) -> Sh<ORDER, T> {
        T::best(Apply { turns: &self.turns, sh })
    }
}
