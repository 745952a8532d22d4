//! Sixteen lanes, one for each child of a node of the pyramid or each cell of a block, at each level of instructions.
//!
//! This module needs `unsafe` because intrinsics are only sound on processors that have them. `Avx2` and `Avx512` are
//! named only by functions that are compiled for those instructions, and these are called only where
//! [`crate::Simd::detect`] has found them.
#![allow(unsafe_code)]

/// Sixteen floats computed together; lane x + 4 z.
pub(super) trait Lanes16: Copy {
    /// The outcome of a comparison.
    type Mask: Copy;
    /// How lanes are put into the order in which a ray meets them.
    type Order: Copy;

    fn splat(value: f32) -> Self;
    fn load(from: &[f32; 16]) -> Self;
    /// Four rows of four, `stride` apart; `from` reaches as far as their last element.
    fn load_rows(from: &[f32], stride: usize) -> Self;
    fn store(self) -> [f32; 16];
    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    /// `self · b + c`, fused where the level has it.
    fn mul_add(self, b: Self, c: Self) -> Self;
    fn min(self, other: Self) -> Self;
    fn max(self, other: Self) -> Self;
    fn le(self, other: Self) -> Self::Mask;
    fn lt(self, other: Self) -> Self::Mask;
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    fn both(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// One bit a lane.
    fn bits(mask: Self::Mask) -> u32;
    /// The order in which lane k takes what is in lane k ⊕ flip, flip < 16.
    fn order(flip: u32) -> Self::Order;
    fn load_ordered(from: &[f32; 16], order: Self::Order) -> Self;
}

/// Plain Rust.
#[derive(Clone, Copy)]
pub(super) struct Plain([f32; 16]);

impl Plain {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|k| f(self.0[k], other.0[k])))
    }
    #[inline(always)]
    fn compare(self, other: Self, f: impl Fn(f32, f32) -> bool) -> u32 {
        (0..16).fold(0, |bits, k| bits | u32::from(f(self.0[k], other.0[k])) << k)
    }
}

impl Lanes16 for Plain {
    type Mask = u32;
    type Order = u32;

    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self([value; 16])
    }
    #[inline(always)]
    fn load(from: &[f32; 16]) -> Self {
        Self(*from)
    }
    #[inline(always)]
    fn load_rows(from: &[f32], stride: usize) -> Self {
        Self(std::array::from_fn(|k| from[(k >> 2) * stride + (k & 3)]))
    }
    #[inline(always)]
    fn store(self) -> [f32; 16] {
        self.0
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        self.mul(b).add(c)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn le(self, other: Self) -> u32 {
        self.compare(other, |a, b| a <= b)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> u32 {
        self.compare(other, |a, b| a < b)
    }
    #[inline(always)]
    fn select(mask: u32, yes: Self, no: Self) -> Self {
        Self(std::array::from_fn(|k| if mask >> k & 1 == 1 { yes.0[k] } else { no.0[k] }))
    }
    #[inline(always)]
    fn both(a: u32, b: u32) -> u32 {
        a & b
    }
    #[inline(always)]
    fn bits(mask: u32) -> u32 {
        mask
    }
    #[inline(always)]
    fn order(flip: u32) -> u32 {
        flip
    }
    #[inline(always)]
    fn load_ordered(from: &[f32; 16], flip: u32) -> Self {
        Self(std::array::from_fn(|k| from[(k as u32 ^ flip) as usize & 15]))
    }
}

#[cfg(target_arch = "x86_64")]
pub(super) use x86::{Avx2, Avx512};

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::*;

    use super::Lanes16;

    /// Two vectors of eight, with fused multiply-add.
    #[derive(Clone, Copy)]
    pub(in super::super) struct Avx2(__m256, __m256);

    // SAFETY of every block below: these types are named only inside functions compiled for their instructions, which
    // are called only where the processor has them. Loads and stores ask for no alignment and stay within what the
    // argument's type or the assertion beside them guarantees.
    impl Lanes16 for Avx2 {
        type Mask = (__m256, __m256);
        type Order = (__m256i, bool);

        #[inline(always)]
        fn splat(value: f32) -> Self {
            unsafe { Self(_mm256_set1_ps(value), _mm256_set1_ps(value)) }
        }
        #[inline(always)]
        fn load(from: &[f32; 16]) -> Self {
            unsafe { Self(_mm256_loadu_ps(from.as_ptr()), _mm256_loadu_ps(from.as_ptr().add(8))) }
        }
        #[inline(always)]
        fn load_rows(from: &[f32], stride: usize) -> Self {
            assert!(stride < 1 << 31 && from.len() >= 3 * stride + 4);
            unsafe {
                let row = |k: usize| _mm_loadu_ps(from.as_ptr().add(k * stride));
                Self(_mm256_set_m128(row(1), row(0)), _mm256_set_m128(row(3), row(2)))
            }
        }
        #[inline(always)]
        fn store(self) -> [f32; 16] {
            let mut to = [0.0; 16];
            unsafe {
                _mm256_storeu_ps(to.as_mut_ptr(), self.0);
                _mm256_storeu_ps(to.as_mut_ptr().add(8), self.1);
            }
            to
        }
        #[inline(always)]
        fn add(self, other: Self) -> Self {
            unsafe { Self(_mm256_add_ps(self.0, other.0), _mm256_add_ps(self.1, other.1)) }
        }
        #[inline(always)]
        fn sub(self, other: Self) -> Self {
            unsafe { Self(_mm256_sub_ps(self.0, other.0), _mm256_sub_ps(self.1, other.1)) }
        }
        #[inline(always)]
        fn mul(self, other: Self) -> Self {
            unsafe { Self(_mm256_mul_ps(self.0, other.0), _mm256_mul_ps(self.1, other.1)) }
        }
        #[inline(always)]
        fn mul_add(self, b: Self, c: Self) -> Self {
            unsafe { Self(_mm256_fmadd_ps(self.0, b.0, c.0), _mm256_fmadd_ps(self.1, b.1, c.1)) }
        }
        #[inline(always)]
        fn min(self, other: Self) -> Self {
            unsafe { Self(_mm256_min_ps(self.0, other.0), _mm256_min_ps(self.1, other.1)) }
        }
        #[inline(always)]
        fn max(self, other: Self) -> Self {
            unsafe { Self(_mm256_max_ps(self.0, other.0), _mm256_max_ps(self.1, other.1)) }
        }
        #[inline(always)]
        fn le(self, other: Self) -> Self::Mask {
            unsafe {
                (_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0), _mm256_cmp_ps::<_CMP_LE_OQ>(self.1, other.1))
            }
        }
        #[inline(always)]
        fn lt(self, other: Self) -> Self::Mask {
            unsafe {
                (_mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0), _mm256_cmp_ps::<_CMP_LT_OQ>(self.1, other.1))
            }
        }
        #[inline(always)]
        fn select(mask: Self::Mask, yes: Self, no: Self) -> Self {
            unsafe { Self(_mm256_blendv_ps(no.0, yes.0, mask.0), _mm256_blendv_ps(no.1, yes.1, mask.1)) }
        }
        #[inline(always)]
        fn both(a: Self::Mask, b: Self::Mask) -> Self::Mask {
            unsafe { (_mm256_and_ps(a.0, b.0), _mm256_and_ps(a.1, b.1)) }
        }
        #[inline(always)]
        fn bits(mask: Self::Mask) -> u32 {
            unsafe { _mm256_movemask_ps(mask.0) as u32 | (_mm256_movemask_ps(mask.1) as u32) << 8 }
        }
        #[inline(always)]
        fn order(flip: u32) -> Self::Order {
            unsafe {
                let lanes = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
                (_mm256_xor_si256(lanes, _mm256_set1_epi32((flip & 7) as i32)), flip & 8 != 0)
            }
        }
        #[inline(always)]
        fn load_ordered(from: &[f32; 16], (order, swap): Self::Order) -> Self {
            let (first, second) = if swap { (8, 0) } else { (0, 8) };
            unsafe {
                Self(
                    _mm256_permutevar8x32_ps(_mm256_loadu_ps(from.as_ptr().add(first)), order),
                    _mm256_permutevar8x32_ps(_mm256_loadu_ps(from.as_ptr().add(second)), order),
                )
            }
        }
    }

    /// One vector of sixteen.
    #[derive(Clone, Copy)]
    pub(in super::super) struct Avx512(__m512);

    // SAFETY: as above.
    impl Lanes16 for Avx512 {
        type Mask = __mmask16;
        type Order = __m512i;

        #[inline(always)]
        fn splat(value: f32) -> Self {
            unsafe { Self(_mm512_set1_ps(value)) }
        }
        #[inline(always)]
        fn load(from: &[f32; 16]) -> Self {
            unsafe { Self(_mm512_loadu_ps(from.as_ptr())) }
        }
        #[inline(always)]
        fn load_rows(from: &[f32], stride: usize) -> Self {
            assert!(stride < 1 << 31 && from.len() >= 3 * stride + 4);
            unsafe {
                let row = |k: usize| _mm_loadu_ps(from.as_ptr().add(k * stride));
                let lanes = _mm512_castps128_ps512(row(0));
                let lanes = _mm512_insertf32x4::<1>(lanes, row(1));
                let lanes = _mm512_insertf32x4::<2>(lanes, row(2));
                Self(_mm512_insertf32x4::<3>(lanes, row(3)))
            }
        }
        #[inline(always)]
        fn store(self) -> [f32; 16] {
            let mut to = [0.0; 16];
            unsafe { _mm512_storeu_ps(to.as_mut_ptr(), self.0) }
            to
        }
        #[inline(always)]
        fn add(self, other: Self) -> Self {
            unsafe { Self(_mm512_add_ps(self.0, other.0)) }
        }
        #[inline(always)]
        fn sub(self, other: Self) -> Self {
            unsafe { Self(_mm512_sub_ps(self.0, other.0)) }
        }
        #[inline(always)]
        fn mul(self, other: Self) -> Self {
            unsafe { Self(_mm512_mul_ps(self.0, other.0)) }
        }
        #[inline(always)]
        fn mul_add(self, b: Self, c: Self) -> Self {
            unsafe { Self(_mm512_fmadd_ps(self.0, b.0, c.0)) }
        }
        #[inline(always)]
        fn min(self, other: Self) -> Self {
            unsafe { Self(_mm512_min_ps(self.0, other.0)) }
        }
        #[inline(always)]
        fn max(self, other: Self) -> Self {
            unsafe { Self(_mm512_max_ps(self.0, other.0)) }
        }
        #[inline(always)]
        fn le(self, other: Self) -> Self::Mask {
            unsafe { _mm512_cmp_ps_mask::<_CMP_LE_OQ>(self.0, other.0) }
        }
        #[inline(always)]
        fn lt(self, other: Self) -> Self::Mask {
            unsafe { _mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, other.0) }
        }
        #[inline(always)]
        fn select(mask: Self::Mask, yes: Self, no: Self) -> Self {
            unsafe { Self(_mm512_mask_blend_ps(mask, no.0, yes.0)) }
        }
        #[inline(always)]
        fn both(a: Self::Mask, b: Self::Mask) -> Self::Mask {
            a & b
        }
        #[inline(always)]
        fn bits(mask: Self::Mask) -> u32 {
            u32::from(mask)
        }
        #[inline(always)]
        fn order(flip: u32) -> Self::Order {
            unsafe {
                let lanes = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
                _mm512_xor_si512(lanes, _mm512_set1_epi32(flip as i32))
            }
        }
        #[inline(always)]
        fn load_ordered(from: &[f32; 16], order: Self::Order) -> Self {
            unsafe { Self(_mm512_permutexvar_ps(order, _mm512_loadu_ps(from.as_ptr()))) }
        }
    }
}
