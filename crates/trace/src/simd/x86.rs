//! Lanes as AVX2 and AVX-512 have them.
//!
//! This module needs `unsafe` because the intrinsics are only sound on processors that have the instructions. The
//! types are private to the crate and are named only by bodies that run inside `#[target_feature]` functions, which
//! in turn are called only after [`super::Simd::detect`] found the features.
#![allow(unsafe_code)]

use std::arch::x86_64::*;

use super::Lanes;

/// Eight lanes of AVX2 with fused multiply-add.
#[derive(Clone, Copy)]
pub(crate) struct Wide8(__m256);

/// Sixteen lanes of AVX-512.
#[derive(Clone, Copy)]
pub(crate) struct Wide16(__m512);

impl Lanes for Wide8 {
    const N: usize = 8;

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
    fn store_where(self, lanes: u32, to: &mut [f32]) {
        assert!(to.len() >= 8);
        // SAFETY: the slice has room for 8 floats, and the store asks for no alignment.
        unsafe {
            let bits = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
            let chosen = _mm256_cmpeq_epi32(_mm256_and_si256(_mm256_set1_epi32(lanes as i32), bits), bits);
            _mm256_maskstore_ps(to.as_mut_ptr(), chosen, self.0);
        }
    }
    #[inline(always)]
    fn splat(value: f32) -> Self {
        // SAFETY: as the module says.
        unsafe { Wide8(_mm256_set1_ps(value)) }
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        // SAFETY: as the module says.
        unsafe { Wide8(_mm256_add_ps(self.0, other.0)) }
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        // SAFETY: as the module says.
        unsafe { Wide8(_mm256_sub_ps(self.0, other.0)) }
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        // SAFETY: as the module says.
        unsafe { Wide8(_mm256_mul_ps(self.0, other.0)) }
    }
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        // SAFETY: as the module says.
        unsafe { Wide8(_mm256_div_ps(self.0, other.0)) }
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: as the module says.
        unsafe { Wide8(_mm256_min_ps(self.0, other.0)) }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // SAFETY: as the module says.
        unsafe { Wide8(_mm256_max_ps(self.0, other.0)) }
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        // SAFETY: as the module says.
        unsafe { Wide8(_mm256_fmadd_ps(self.0, b.0, c.0)) }
    }
    #[inline(always)]
    fn mul_sub(self, b: Self, c: Self) -> Self {
        // SAFETY: as the module says.
        unsafe { Wide8(_mm256_fmsub_ps(self.0, b.0, c.0)) }
    }
    #[inline(always)]
    fn neg_mul_add(self, b: Self, c: Self) -> Self {
        // SAFETY: as the module says.
        unsafe { Wide8(_mm256_fnmadd_ps(self.0, b.0, c.0)) }
    }
    #[inline(always)]
    fn le(self, other: Self) -> u32 {
        // SAFETY: as the module says.
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0)) as u32 }
    }
    #[inline(always)]
    fn lt(self, other: Self) -> u32 {
        // SAFETY: as the module says.
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0)) as u32 }
    }
    #[inline(always)]
    fn eq(self, other: Self) -> u32 {
        // SAFETY: as the module says.
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_EQ_OQ>(self.0, other.0)) as u32 }
    }
    #[inline(always)]
    fn negative(self) -> u32 {
        // SAFETY: as the module says.
        unsafe { _mm256_movemask_ps(self.0) as u32 }
    }
    #[inline(always)]
    fn highest(self) -> f32 {
        // SAFETY: as the module says.
        unsafe {
            let four = _mm_max_ps(_mm256_castps256_ps128(self.0), _mm256_extractf128_ps::<1>(self.0));
            let two = _mm_max_ps(four, _mm_movehl_ps(four, four));
            _mm_cvtss_f32(_mm_max_ss(two, _mm_shuffle_ps::<1>(two, two)))
        }
    }
    #[inline(always)]
    fn transpose(rows: [Self; 8]) -> [Self; 8] {
        // Pairs of rows, then pairs of pairs, then halves.
        // SAFETY: as the module says.
        unsafe {
            let [Wide8(a), Wide8(b), Wide8(c), Wide8(d), Wide8(e), Wide8(f), Wide8(g), Wide8(h)] = rows;
            let (ab0, ab1) = (_mm256_unpacklo_ps(a, b), _mm256_unpackhi_ps(a, b));
            let (cd0, cd1) = (_mm256_unpacklo_ps(c, d), _mm256_unpackhi_ps(c, d));
            let (ef0, ef1) = (_mm256_unpacklo_ps(e, f), _mm256_unpackhi_ps(e, f));
            let (gh0, gh1) = (_mm256_unpacklo_ps(g, h), _mm256_unpackhi_ps(g, h));
            let (p0, p1) = (_mm256_shuffle_ps::<0x44>(ab0, cd0), _mm256_shuffle_ps::<0xee>(ab0, cd0));
            let (p2, p3) = (_mm256_shuffle_ps::<0x44>(ab1, cd1), _mm256_shuffle_ps::<0xee>(ab1, cd1));
            let (q0, q1) = (_mm256_shuffle_ps::<0x44>(ef0, gh0), _mm256_shuffle_ps::<0xee>(ef0, gh0));
            let (q2, q3) = (_mm256_shuffle_ps::<0x44>(ef1, gh1), _mm256_shuffle_ps::<0xee>(ef1, gh1));
            [
                Wide8(_mm256_permute2f128_ps::<0x20>(p0, q0)),
                Wide8(_mm256_permute2f128_ps::<0x20>(p1, q1)),
                Wide8(_mm256_permute2f128_ps::<0x20>(p2, q2)),
                Wide8(_mm256_permute2f128_ps::<0x20>(p3, q3)),
                Wide8(_mm256_permute2f128_ps::<0x31>(p0, q0)),
                Wide8(_mm256_permute2f128_ps::<0x31>(p1, q1)),
                Wide8(_mm256_permute2f128_ps::<0x31>(p2, q2)),
                Wide8(_mm256_permute2f128_ps::<0x31>(p3, q3)),
            ]
        }
    }
}

impl Lanes for Wide16 {
    const N: usize = 16;

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
    fn store_where(self, lanes: u32, to: &mut [f32]) {
        assert!(to.len() >= 16);
        // SAFETY: the slice has room for 16 floats, and the store asks for no alignment.
        unsafe {
            _mm512_mask_storeu_ps(to.as_mut_ptr(), lanes as __mmask16, self.0);
        }
    }
    #[inline(always)]
    fn splat(value: f32) -> Self {
        // SAFETY: as the module says.
        unsafe { Wide16(_mm512_set1_ps(value)) }
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        // SAFETY: as the module says.
        unsafe { Wide16(_mm512_add_ps(self.0, other.0)) }
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        // SAFETY: as the module says.
        unsafe { Wide16(_mm512_sub_ps(self.0, other.0)) }
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        // SAFETY: as the module says.
        unsafe { Wide16(_mm512_mul_ps(self.0, other.0)) }
    }
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        // SAFETY: as the module says.
        unsafe { Wide16(_mm512_div_ps(self.0, other.0)) }
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: as the module says.
        unsafe { Wide16(_mm512_min_ps(self.0, other.0)) }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // SAFETY: as the module says.
        unsafe { Wide16(_mm512_max_ps(self.0, other.0)) }
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        // SAFETY: as the module says.
        unsafe { Wide16(_mm512_fmadd_ps(self.0, b.0, c.0)) }
    }
    #[inline(always)]
    fn mul_sub(self, b: Self, c: Self) -> Self {
        // SAFETY: as the module says.
        unsafe { Wide16(_mm512_fmsub_ps(self.0, b.0, c.0)) }
    }
    #[inline(always)]
    fn neg_mul_add(self, b: Self, c: Self) -> Self {
        // SAFETY: as the module says.
        unsafe { Wide16(_mm512_fnmadd_ps(self.0, b.0, c.0)) }
    }
    #[inline(always)]
    fn le(self, other: Self) -> u32 {
        // SAFETY: as the module says.
        unsafe { u32::from(_mm512_cmp_ps_mask::<_CMP_LE_OQ>(self.0, other.0)) }
    }
    #[inline(always)]
    fn lt(self, other: Self) -> u32 {
        // SAFETY: as the module says.
        unsafe { u32::from(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, other.0)) }
    }
    #[inline(always)]
    fn eq(self, other: Self) -> u32 {
        // SAFETY: as the module says.
        unsafe { u32::from(_mm512_cmp_ps_mask::<_CMP_EQ_OQ>(self.0, other.0)) }
    }
    #[inline(always)]
    fn negative(self) -> u32 {
        // SAFETY: as the module says.
        unsafe { u32::from(_mm512_movepi32_mask(_mm512_castps_si512(self.0))) }
    }
    #[inline(always)]
    fn highest(self) -> f32 {
        // SAFETY: as the module says.
        unsafe { _mm512_reduce_max_ps(self.0) }
    }
    #[inline(always)]
    fn transpose(rows: [Self; 8]) -> [Self; 8] {
        unreachable!("only eight-lane registers are transposed: {} rows", rows.len())
    }
}
