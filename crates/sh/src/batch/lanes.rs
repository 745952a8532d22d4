//! Sixteen floats of memory.

use std::ops::{Add, Mul, Neg, Sub};

use crate::real::sealed::Sealed;
use crate::{Real, Sh};

/// Vectors in a block.
pub const WIDTH: usize = 16;

/// Sixteen floats side by side, aligned to a cache line.
///
/// Its arithmetic is plain; the functions of this module are the fast way.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub struct Lanes(pub [f32; WIDTH]);

impl Lanes {
    /// The same number sixteen times.
    #[must_use]
    pub fn splat(value: f32) -> Self {
        Lanes([value; WIDTH])
    }

    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Lanes(std::array::from_fn(|i| f(self.0[i], other.0[i])))
    }
}

impl Default for Lanes {
    fn default() -> Self {
        Lanes([0.0; WIDTH])
    }
}

impl Add for Lanes {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
}

impl Sub for Lanes {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
}

impl Mul for Lanes {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
}

impl Neg for Lanes {
    type Output = Self;
    fn neg(self) -> Self {
        Lanes(self.0.map(|a| -a))
    }
}

impl Sealed for Lanes {}

impl Real for Lanes {
    fn of(value: f64) -> Self {
        Lanes([value as f32; WIDTH])
    }
    fn mul_add(self, b: Self, c: Self) -> Self {
        self * b + c
    }
    fn less(self, b: Self, c: Self) -> Self {
        self - b * c
    }
    fn sqrt(self) -> Self {
        Lanes(self.0.map(f32::sqrt))
    }
    fn over(self, divisor: Self) -> Self {
        self.zip(divisor, |a, b| a / b)
    }
    fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }
    fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }
}

/// One of the sixteen vectors of a block.
#[must_use]
pub fn lane<const ORDER: usize>(block: &Sh<ORDER, Lanes>, lane: usize) -> Sh<ORDER> {
    block.map(|lanes| lanes.0[lane])
}

/// Puts one vector among the sixteen of a block.
pub fn set_lane<const ORDER: usize>(block: &mut Sh<ORDER, Lanes>, lane: usize, sh: &Sh<ORDER>) {
    for (lanes, &value) in block.coefficients_mut().iter_mut().zip(sh.coefficients()) {
        lanes.0[lane] = value;
    }
}
