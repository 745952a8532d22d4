//! What the kernels compute with: one number, or many side by side.

use std::fmt::Debug;
use std::ops::{Add, Mul, Neg, Sub};

use crate::simd::{self, Work, with_avx};

/// A number, or a group of numbers that are computed together. Implemented for `f32`, `f64` and the lanes of this
/// crate, and for nothing else.
pub trait Real:
    Copy
    + Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Neg<Output = Self>
    + sealed::Sealed
{
    /// A constant.
    fn of(value: f64) -> Self;
    /// A constant of a table, known in both precisions.
    #[inline(always)]
    fn of_table(single: f32, double: f64) -> Self {
        let _ = single;
        Self::of(double)
    }
    /// `self · b + c`; fused where that is one instruction.
    #[must_use]
    fn mul_add(self, b: Self, c: Self) -> Self;
    /// `self − b · c`; fused where that is one instruction.
    #[must_use]
    fn less(self, b: Self, c: Self) -> Self;
    /// Square root.
    #[must_use]
    fn sqrt(self) -> Self;
    /// Quotient.
    #[must_use]
    fn over(self, divisor: Self) -> Self;
    /// The larger of two.
    #[must_use]
    fn max(self, other: Self) -> Self;
    /// The smaller of two.
    #[must_use]
    fn min(self, other: Self) -> Self;
}

pub(crate) mod sealed {
    use super::Real;
    use crate::kernels;
    use crate::simd::Work;

    /// Keeps the set of implementations closed, and gives single numbers the better instructions.
    pub trait Sealed: Sized {
        /// Does some work that computes with this type.
        #[inline(always)]
        fn best<W: Work>(work: W) -> W::Output {
            work.run()
        }

        /// Rotates a vector: see [`kernels::rotate`].
        #[inline(always)]
        fn rotate<const N: usize>(f: &[[Self; N]; N], turns: &[[Self; 2]; 3]) -> [[Self; N]; N]
        where
            Self: Real,
        {
            kernels::rotate(f, turns)
        }
    }
}

impl sealed::Sealed for f32 {
    #[inline(always)]
    fn best<W: Work>(work: W) -> W::Output {
        with_avx(work)
    }

    #[inline(always)]
    fn rotate<const N: usize>(f: &[[f32; N]; N], turns: &[[f32; 2]; 3]) -> [[f32; N]; N] {
        simd::rotate(f, turns)
    }
}

impl sealed::Sealed for f64 {}

macro_rules! plain {
    ($t:ty) => {
        impl Real for $t {
            #[inline(always)]
            fn of(value: f64) -> Self {
                value as $t
            }
            #[inline(always)]
            fn mul_add(self, b: Self, c: Self) -> Self {
                // Not fused: without the instruction, `f32::mul_add` is a call of a slow function.
                self * b + c
            }
            #[inline(always)]
            fn less(self, b: Self, c: Self) -> Self {
                self - b * c
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                self.sqrt()
            }
            #[inline(always)]
            fn over(self, divisor: Self) -> Self {
                self / divisor
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                if self > other { self } else { other }
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                if self < other { self } else { other }
            }
        }
    };
}

plain!(f32);
plain!(f64);
