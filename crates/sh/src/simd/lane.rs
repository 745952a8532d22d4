//! What the batched kernels need of a vector of floats, and its plain form.

use std::ops::{Add, Mul, Neg, Sub};

use crate::Real;
use crate::real::sealed::Sealed;

/// `N` floats that are computed together. A value of a wide form exists only inside functions compiled for its
/// instructions, which is what makes its methods sound: kernels get the type from [`super::Simd::run`] and cannot name it.
pub trait Lane: Real {
    /// How many; a divisor of 16.
    const N: usize;
    /// A truth for each lane.
    type Mask: Copy;

    /// The first `N` floats of a slice; panics if there are fewer.
    fn load(from: &[f32]) -> Self;
    /// Writes the lanes to the front of a slice; panics if it is shorter than `N`.
    fn store(self, to: &mut [f32]);
    /// One number in all lanes.
    fn splat(value: f32) -> Self;
    /// Lanes where `self > other`; false where either is NaN.
    fn gt(self, other: Self) -> Self::Mask;
    /// Whether the mask is set anywhere.
    fn any(mask: Self::Mask) -> bool;
    /// `a` where the mask is set, else `b`.
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self;
    /// 2ⁿ of whole numbers in [−126, 127].
    fn two_to_the(self) -> Self;
    /// The nearest whole number, of magnitudes below 2²².
    fn round(self) -> Self;
    /// `table[index]` of whole numbers; indices out of range read some entry of the table, which is not empty.
    fn gather(table: &[f32], index: Self) -> Self;
    /// What a table of rows of `columns` entries holds at (row, column), both whole numbers, and the entry after it, which
    /// comes with it for little more; places out of range read some entries of the table, which has at least two. Unlike
    /// [`Lane::gather`] it reaches all of a table of more than 2²⁴ entries.
    fn gather_pairs(table: &[f32], columns: usize, row: Self, column: Self) -> [Self; 2];
    /// The sum of the lanes.
    fn sum(self) -> f32;

    /// eˣ, to 2e-7 relative; clamped to finite, positive results.
    ///
    /// Cody–Waite reduction to |r| ≤ ½ ln 2 and the polynomial of Cephes (Moshier), `expf`.
    #[inline(always)]
    fn exp(self) -> Self {
        let x = self.max(Self::splat(-87.0)).min(Self::splat(88.0));
        let n = (x * Self::splat(std::f32::consts::LOG2_E)).round();
        let r = x.less(n, Self::splat(0.693_359_4)).less(n, Self::splat(-2.121_944_4e-4));
        let mut p = Self::splat(1.987_569_1e-4);
        for coefficient in [1.398_199_9e-3, 8.333_452e-3, 4.166_579_6e-2, 1.666_666_5e-1, 0.5] {
            p = p.mul_add(r, Self::splat(coefficient));
        }
        (p * r).mul_add(r, r + Self::splat(1.0)) * n.two_to_the()
    }
}

/// Four lanes in plain Rust.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plain([f32; 4]);

impl Plain {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Plain(std::array::from_fn(|i| f(self.0[i], other.0[i])))
    }
}

impl Add for Plain {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
}

impl Sub for Plain {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
}

impl Mul for Plain {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
}

impl Neg for Plain {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Plain(self.0.map(|a| -a))
    }
}

impl Sealed for Plain {}

impl Real for Plain {
    #[inline(always)]
    fn of(value: f64) -> Self {
        Plain([value as f32; 4])
    }
    #[inline(always)]
    fn of_table(single: f32, _: f64) -> Self {
        Plain([single; 4])
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        self * b + c
    }
    #[inline(always)]
    fn less(self, b: Self, c: Self) -> Self {
        self - b * c
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Plain(self.0.map(f32::sqrt))
    }
    #[inline(always)]
    fn over(self, divisor: Self) -> Self {
        self.zip(divisor, |a, b| a / b)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }
}

impl Lane for Plain {
    const N: usize = 4;
    type Mask = [bool; 4];

    #[inline(always)]
    fn load(from: &[f32]) -> Self {
        Plain(std::array::from_fn(|i| from[i]))
    }
    #[inline(always)]
    fn store(self, to: &mut [f32]) {
        to[..4].copy_from_slice(&self.0);
    }
    #[inline(always)]
    fn splat(value: f32) -> Self {
        Plain([value; 4])
    }
    #[inline(always)]
    fn gt(self, other: Self) -> [bool; 4] {
        std::array::from_fn(|i| self.0[i] > other.0[i])
    }
    #[inline(always)]
    fn any(mask: [bool; 4]) -> bool {
        mask.iter().any(|&set| set)
    }
    #[inline(always)]
    fn select(mask: [bool; 4], a: Self, b: Self) -> Self {
        Plain(std::array::from_fn(|i| if mask[i] { a.0[i] } else { b.0[i] }))
    }
    #[inline(always)]
    fn two_to_the(self) -> Self {
        Plain(self.0.map(|n| f32::from_bits(((n as i32 + 127) as u32) << 23)))
    }
    #[inline(always)]
    fn round(self) -> Self {
        Plain(self.0.map(|x| (x + 12_582_912.0) - 12_582_912.0))
    }
    #[inline(always)]
    fn gather(table: &[f32], index: Self) -> Self {
        Plain(index.0.map(|i| table[(i as usize).min(table.len() - 1)]))
    }
    #[inline(always)]
    fn gather_pairs(table: &[f32], columns: usize, row: Self, column: Self) -> [Self; 2] {
        assert!(table.len() >= 2);
        let mut pairs = [Plain([0.0; 4]); 2];
        for i in 0..4 {
            let place = (row.0[i] as usize).saturating_mul(columns).saturating_add(column.0[i] as usize);
            let place = place.min(table.len() - 2);
            (pairs[0].0[i], pairs[1].0[i]) = (table[place], table[place + 1]);
        }
        pairs
    }
    #[inline(always)]
    fn sum(self) -> f32 {
        (self.0[0] + self.0[1]) + (self.0[2] + self.0[3])
    }
}
