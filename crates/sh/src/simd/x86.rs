//! Lanes as AVX2 and AVX-512 have them, and the functions compiled for them.
//!
//! This module needs `unsafe` because the intrinsics are only sound on processors that have the instructions. The types
//! are private to the crate and come into being only inside kernels that [`run_avx2`] and [`run_avx512`] run, which
//! check the processor first.
#![allow(unsafe_code)]

use std::arch::x86_64::*;
use std::ops::{Add, Mul, Neg, Sub};

use super::{Kernel, Lane, Work};
use crate::Real;
use crate::real::sealed::Sealed;

pub(super) fn has_avx2() -> bool {
    is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")
}

pub(super) fn has_avx512() -> bool {
    has_avx2()
        && is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512vl")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512bw")
}

#[inline]
pub(super) fn run_avx2<K: Kernel>(kernel: K) -> K::Output {
    #[target_feature(enable = "avx2,fma")]
    fn compiled<K: Kernel>(kernel: K) -> K::Output {
        kernel.run::<Wide8>()
    }
    assert!(has_avx2());
    // SAFETY: the processor has the features.
    unsafe { compiled(kernel) }
}

#[inline]
pub(super) fn run_avx512<K: Kernel>(kernel: K) -> K::Output {
    #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma")]
    fn compiled<K: Kernel>(kernel: K) -> K::Output {
        kernel.run::<Wide16>()
    }
    assert!(has_avx512());
    // SAFETY: the processor has the features.
    unsafe { compiled(kernel) }
}

/// As [`run_avx`], with twice the registers.
#[inline(always)]
pub(super) fn run_avx512vl<W: Work>(work: W) -> W::Output {
    #[target_feature(enable = "avx512f,avx512vl")]
    fn compiled<W: Work>(work: W) -> W::Output {
        work.run()
    }
    debug_assert!(is_x86_feature_detected!("avx512vl"));
    // SAFETY: the only caller has found the feature, and processors that have it have AVX-512F.
    unsafe { compiled(work) }
}

#[inline(always)]
pub(super) fn run_avx<W: Work>(work: W) -> W::Output {
    #[target_feature(enable = "avx")]
    fn compiled<W: Work>(work: W) -> W::Output {
        work.run()
    }
    debug_assert!(is_x86_feature_detected!("avx"));
    // SAFETY: the only caller has found the feature.
    unsafe { compiled(work) }
}

/// Eight lanes of AVX2 with fused multiply-add.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wide8(__m256);

/// Sixteen lanes of AVX-512.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wide16(__m512);

macro_rules! arithmetic {
    ($wide:ident, $lanes:literal, $add:ident, $sub:ident, $mul:ident, $div:ident, $fma:ident, $fnma:ident, $sqrt:ident,
     $max:ident, $min:ident, $splat:ident, $zero:ident) => {
        impl Add for $wide {
            type Output = Self;
            #[inline(always)]
            fn add(self, other: Self) -> Self {
                // SAFETY: as the module says.
                unsafe { $wide($add(self.0, other.0)) }
            }
        }
        impl Sub for $wide {
            type Output = Self;
            #[inline(always)]
            fn sub(self, other: Self) -> Self {
                // SAFETY: as the module says.
                unsafe { $wide($sub(self.0, other.0)) }
            }
        }
        impl Mul for $wide {
            type Output = Self;
            #[inline(always)]
            fn mul(self, other: Self) -> Self {
                // SAFETY: as the module says.
                unsafe { $wide($mul(self.0, other.0)) }
            }
        }
        impl Neg for $wide {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                // SAFETY: as the module says.
                unsafe { $wide($sub($zero(), self.0)) }
            }
        }
        impl Sealed for $wide {}
        impl Real for $wide {
            #[inline(always)]
            fn of(value: f64) -> Self {
                Self::splat(value as f32)
            }
            #[inline(always)]
            fn of_table(single: f32, _: f64) -> Self {
                Self::splat(single)
            }
            #[inline(always)]
            fn mul_add(self, b: Self, c: Self) -> Self {
                // SAFETY: as the module says.
                unsafe { $wide($fma(self.0, b.0, c.0)) }
            }
            #[inline(always)]
            fn less(self, b: Self, c: Self) -> Self {
                // SAFETY: as the module says.
                unsafe { $wide($fnma(b.0, c.0, self.0)) }
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                // SAFETY: as the module says.
                unsafe { $wide($sqrt(self.0)) }
            }
            #[inline(always)]
            fn over(self, divisor: Self) -> Self {
                // SAFETY: as the module says.
                unsafe { $wide($div(self.0, divisor.0)) }
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                // SAFETY: as the module says.
                unsafe { $wide($max(self.0, other.0)) }
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                // SAFETY: as the module says.
                unsafe { $wide($min(self.0, other.0)) }
            }
        }
    };
}

arithmetic!(
    Wide8,
    8,
    _mm256_add_ps,
    _mm256_sub_ps,
    _mm256_mul_ps,
    _mm256_div_ps,
    _mm256_fmadd_ps,
    _mm256_fnmadd_ps,
    _mm256_sqrt_ps,
    _mm256_max_ps,
    _mm256_min_ps,
    _mm256_set1_ps,
    _mm256_setzero_ps
);
arithmetic!(
    Wide16,
    16,
    _mm512_add_ps,
    _mm512_sub_ps,
    _mm512_mul_ps,
    _mm512_div_ps,
    _mm512_fmadd_ps,
    _mm512_fnmadd_ps,
    _mm512_sqrt_ps,
    _mm512_max_ps,
    _mm512_min_ps,
    _mm512_set1_ps,
    _mm512_setzero_ps
);

impl Lane for Wide8 {
    const N: usize = 8;
    type Mask = __m256;

    #[inline(always)]
    fn load(from: &[f32]) -> Self {
        assert!(from.len() >= 8);
        // SAFETY: the slice holds 8 floats, and the load asks for no alignment.
        unsafe { Wide8(_mm256_loadu_ps(from.as_ptr())) }
    }
    #[inline(always)]
    fn store(self, to: &mut [f32]) {
        assert!(to.len() >= 8);
        // SAFETY: the slice has room for 8 floats, and the store asks for no alignment.
        unsafe { _mm256_storeu_ps(to.as_mut_ptr(), self.0) }
    }
    #[inline(always)]
    fn splat(value: f32) -> Self {
        // SAFETY: as the module says.
        unsafe { Wide8(_mm256_set1_ps(value)) }
    }
    #[inline(always)]
    fn gt(self, other: Self) -> __m256 {
        // SAFETY: as the module says.
        unsafe { _mm256_cmp_ps::<_CMP_GT_OQ>(self.0, other.0) }
    }
    #[inline(always)]
    fn any(mask: __m256) -> bool {
        // SAFETY: as the module says.
        unsafe { _mm256_movemask_ps(mask) != 0 }
    }
    #[inline(always)]
    fn select(mask: __m256, a: Self, b: Self) -> Self {
        // SAFETY: as the module says.
        unsafe { Wide8(_mm256_blendv_ps(b.0, a.0, mask)) }
    }
    #[inline(always)]
    fn two_to_the(self) -> Self {
        // SAFETY: as the module says.
        unsafe {
            let biased = _mm256_add_epi32(_mm256_cvtps_epi32(self.0), _mm256_set1_epi32(127));
            Wide8(_mm256_castsi256_ps(_mm256_slli_epi32::<23>(biased)))
        }
    }
    #[inline(always)]
    fn round(self) -> Self {
        // SAFETY: as the module says.
        unsafe { Wide8(_mm256_round_ps::<{ _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC }>(self.0)) }
    }
    #[inline(always)]
    fn gather(table: &[f32], index: Self) -> Self {
        assert!(!table.is_empty() && table.len() <= i32::MAX as usize);
        // SAFETY: the unsigned minimum keeps every index within the table.
        unsafe {
            let last = _mm256_set1_epi32(table.len() as i32 - 1);
            let places = _mm256_min_epu32(_mm256_cvtps_epi32(index.0), last);
            Wide8(_mm256_i32gather_ps::<4>(table.as_ptr(), places))
        }
    }
    #[inline(always)]
    fn gather_pairs(table: &[f32], columns: usize, row: Self, column: Self) -> [Self; 2] {
        assert!(table.len() >= 2 && table.len() <= i32::MAX as usize);
        // SAFETY: the unsigned minimum keeps every place and the one after it within the table; loads need no alignment.
        unsafe {
            let last = _mm256_set1_epi32(table.len() as i32 - 2);
            let first = _mm256_mullo_epi32(_mm256_cvtps_epi32(row.0), _mm256_set1_epi32(columns as i32));
            let places = _mm256_min_epu32(_mm256_add_epi32(first, _mm256_cvtps_epi32(column.0)), last);
            let table = table.as_ptr().cast::<f64>();
            let low = _mm256_i32gather_pd::<4>(table, _mm256_castsi256_si128(places));
            let high = _mm256_i32gather_pd::<4>(table, _mm256_extracti128_si256::<1>(places));
            let (low, high) = (_mm256_castpd_ps(low), _mm256_castpd_ps(high));
            // Halves are still side by side: 0 1 4 5 | 2 3 6 7.
            let here = _mm256_castps_pd(_mm256_shuffle_ps::<0b10_00_10_00>(low, high));
            let next = _mm256_castps_pd(_mm256_shuffle_ps::<0b11_01_11_01>(low, high));
            let here = _mm256_castpd_ps(_mm256_permute4x64_pd::<0b11_01_10_00>(here));
            [Wide8(here), Wide8(_mm256_castpd_ps(_mm256_permute4x64_pd::<0b11_01_10_00>(next)))]
        }
    }
    #[inline(always)]
    fn sum(self) -> f32 {
        // SAFETY: as the module says.
        unsafe {
            let four = _mm_add_ps(_mm256_castps256_ps128(self.0), _mm256_extractf128_ps::<1>(self.0));
            let two = _mm_add_ps(four, _mm_movehl_ps(four, four));
            _mm_cvtss_f32(_mm_add_ss(two, _mm_shuffle_ps::<1>(two, two)))
        }
    }
}

impl Lane for Wide16 {
    const N: usize = 16;
    type Mask = __mmask16;

    #[inline(always)]
    fn load(from: &[f32]) -> Self {
        assert!(from.len() >= 16);
        // SAFETY: the slice holds 16 floats, and the load asks for no alignment.
        unsafe { Wide16(_mm512_loadu_ps(from.as_ptr())) }
    }
    #[inline(always)]
    fn store(self, to: &mut [f32]) {
        assert!(to.len() >= 16);
        // SAFETY: the slice has room for 16 floats, and the store asks for no alignment.
        unsafe { _mm512_storeu_ps(to.as_mut_ptr(), self.0) }
    }
    #[inline(always)]
    fn splat(value: f32) -> Self {
        // SAFETY: as the module says.
        unsafe { Wide16(_mm512_set1_ps(value)) }
    }
    #[inline(always)]
    fn gt(self, other: Self) -> __mmask16 {
        // SAFETY: as the module says.
        unsafe { _mm512_cmp_ps_mask::<_CMP_GT_OQ>(self.0, other.0) }
    }
    #[inline(always)]
    fn any(mask: __mmask16) -> bool {
        mask != 0
    }
    #[inline(always)]
    fn select(mask: __mmask16, a: Self, b: Self) -> Self {
        // SAFETY: as the module says.
        unsafe { Wide16(_mm512_mask_blend_ps(mask, b.0, a.0)) }
    }
    #[inline(always)]
    fn two_to_the(self) -> Self {
        // SAFETY: as the module says.
        unsafe {
            let biased = _mm512_add_epi32(_mm512_cvtps_epi32(self.0), _mm512_set1_epi32(127));
            Wide16(_mm512_castsi512_ps(_mm512_slli_epi32::<23>(biased)))
        }
    }
    #[inline(always)]
    fn round(self) -> Self {
        // SAFETY: as the module says.
        unsafe { Wide16(_mm512_roundscale_ps::<0>(self.0)) }
    }
    #[inline(always)]
    fn gather(table: &[f32], index: Self) -> Self {
        assert!(!table.is_empty() && table.len() <= i32::MAX as usize);
        // SAFETY: the unsigned minimum keeps every index within the table.
        unsafe {
            let last = _mm512_set1_epi32(table.len() as i32 - 1);
            let places = _mm512_min_epu32(_mm512_cvtps_epi32(index.0), last);
            Wide16(_mm512_i32gather_ps::<4>(places, table.as_ptr()))
        }
    }
    #[inline(always)]
    fn gather_pairs(table: &[f32], columns: usize, row: Self, column: Self) -> [Self; 2] {
        assert!(table.len() >= 2 && table.len() <= i32::MAX as usize);
        // SAFETY: the unsigned minimum keeps every place and the one after it within the table; loads need no alignment.
        unsafe {
            let last = _mm512_set1_epi32(table.len() as i32 - 2);
            let first = _mm512_mullo_epi32(_mm512_cvtps_epi32(row.0), _mm512_set1_epi32(columns as i32));
            let places = _mm512_min_epu32(_mm512_add_epi32(first, _mm512_cvtps_epi32(column.0)), last);
            let table = table.as_ptr().cast::<f64>();
            let low = _mm512_i32gather_pd::<4>(_mm512_castsi512_si256(places), table);
            let high = _mm512_i32gather_pd::<4>(_mm512_extracti64x4_epi64::<1>(places), table);
            let (low, high) = (_mm512_castpd_ps(low), _mm512_castpd_ps(high));
            let even = _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
            let odd = _mm512_add_epi32(even, _mm512_set1_epi32(1));
            let here = _mm512_permutex2var_ps(low, even, high);
            [Wide16(here), Wide16(_mm512_permutex2var_ps(low, odd, high))]
        }
    }
    #[inline(always)]
    fn sum(self) -> f32 {
        // SAFETY: as the module says.
        unsafe { _mm512_reduce_add_ps(self.0) }
    }
}
