//! The rotation of one vector of order 4 in registers of sixteen lanes: a coefficient in each, in their usual order.
//!
//! The same steps as the kernel that the build script writes, with the same operations on each coefficient, so with the
//! same bits: a turn about z is `C·f + S·swapped`, where `swapped` exchanges the coefficients ±m of each band, and a
//! quarter turn about x has two terms in each row.
//!
//! This module needs `unsafe` to call what is compiled for a feature; its caller has found the feature.
#![allow(unsafe_code)]

use std::arch::x86_64::*;

/// Lanes of a table that the compiler keeps in the program.
#[repr(align(64))]
struct Table<T>([T; 16]);

/// |m| of each coefficient.
const DEGREE: [i32; 16] = [0, 1, 0, 1, 2, 1, 0, 1, 2, 3, 2, 1, 0, 1, 2, 3];
/// The place of the coefficient with −m.
const SWAPPED: Table<i32> = Table([0, 3, 2, 1, 8, 7, 6, 5, 4, 15, 14, 13, 12, 11, 10, 9]);
/// A negative sign where m > 0: `f'ₘ = cos·fₘ − sin·f₋ₘ`.
const SIGNS: Table<f32> =
    Table([0.0, 0.0, 0.0, -0.0, 0.0, 0.0, 0.0, -0.0, -0.0, 0.0, 0.0, 0.0, 0.0, -0.0, -0.0, -0.0]);

/// Where the cosine or sine of each coefficient's |m|-fold angle stands for one of three turns.
const fn places(turn: i32) -> Table<i32> {
    let mut places = [0; 16];
    let mut i = 0;
    while i < 16 {
        places[i] = 4 * DEGREE[i] + turn;
        i += 1;
    }
    Table(places)
}

const ALPHA: Table<i32> = places(0);
const BETA: Table<i32> = places(1);
const GAMMA: Table<i32> = places(2);

/// A quarter turn about x: of each row, the places and the factors of its two terms, in the order in which they are added.
struct QuarterTurn {
    first: (Table<i32>, Table<f32>),
    second: (Table<i32>, Table<f32>),
}

// √3/2, √(3/8), √(5/8) and √15/4.
const A: f32 = 0.866_025_4;
const B: f32 = 0.612_372_44;
const C: f32 = 0.790_569_4;
const D: f32 = 0.968_245_86;

/// y to z.
const FORTH: QuarterTurn = QuarterTurn {
    first: (
        Table([0, 2, 1, 3, 7, 5, 8, 4, 8, 14, 10, 14, 11, 15, 11, 15]),
        Table([1.0, -1.0, 1.0, 1.0, -1.0, -1.0, -A, 1.0, 0.5, -B, -1.0, C, -B, -D, -C, 0.25]),
    ),
    second: (
        Table([0, 2, 1, 3, 7, 5, 6, 4, 6, 12, 10, 12, 9, 13, 9, 13]),
        Table([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -0.5, 0.0, -A, C, 0.0, B, -C, -0.25, B, -D]),
    ),
};

/// z to y.
const BACK: QuarterTurn = QuarterTurn {
    first: (
        Table([0, 2, 1, 3, 7, 5, 8, 4, 8, 14, 10, 14, 11, 15, 11, 15]),
        Table([1.0, 1.0, -1.0, 1.0, 1.0, -1.0, -A, -1.0, 0.5, B, -1.0, -C, B, -D, C, 0.25]),
    ),
    second: (
        Table([0, 2, 1, 3, 7, 5, 6, 4, 6, 12, 10, 12, 9, 13, 9, 13]),
        Table([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -0.5, 0.0, -A, -C, 0.0, -B, C, -0.25, -B, -D]),
    ),
};

/// Whether [`rotate_4`] may be called.
#[inline(always)]
pub(super) fn is_there() -> bool {
    is_x86_feature_detected!("avx512vl")
}

/// Z_α X₋₉₀ Z_β X₊₉₀ Z_γ of a vector, with (cos, sin) of α, β and γ.
#[inline(always)]
pub(super) fn rotate_4(f: &[[f32; 4]; 4], turns: &[[f32; 2]; 3]) -> [[f32; 4]; 4] {
    debug_assert!(is_there());
    // SAFETY: the only caller has found the feature, and processors that have it have AVX-512F.
    unsafe { compiled(f, turns) }
}

#[target_feature(enable = "avx512f,avx512vl")]
#[inline]
fn compiled(f: &[[f32; 4]; 4], turns: &[[f32; 2]; 3]) -> [[f32; 4]; 4] {
    let [[ca, sa], [cb, sb], [cg, sg]] = *turns;
    let (c1, s1) = (_mm_setr_ps(ca, cb, cg, 0.0), _mm_setr_ps(sa, sb, sg, 0.0));
    let (c2, s2) = add_angles((c1, s1), (c1, s1));
    let (c3, s3) = add_angles((c1, s1), (c2, s2));
    let cosines = rows([_mm_set1_ps(1.0), c1, c2, c3]);
    let sines = rows([_mm_setzero_ps(), s1, s2, s3]);
    // SAFETY: sixteen numbers are read.
    let f = unsafe { _mm512_loadu_ps(f.as_ptr().cast()) };
    let f = turn(f, cosines, sines, &GAMMA);
    let f = quarter_turn(f, &FORTH);
    let f = turn(f, cosines, sines, &BETA);
    let f = quarter_turn(f, &BACK);
    let f = turn(f, cosines, sines, &ALPHA);
    let mut turned = [[0.0; 4]; 4];
    // SAFETY: sixteen numbers are written.
    unsafe { _mm512_storeu_ps(turned.as_mut_ptr().cast(), f) };
    turned
}

/// (cos, sin) of sums of angles.
#[target_feature(enable = "avx512f,avx512vl")]
#[inline]
fn add_angles((c, s): (__m128, __m128), (d, t): (__m128, __m128)) -> (__m128, __m128) {
    (_mm_sub_ps(_mm_mul_ps(c, d), _mm_mul_ps(s, t)), _mm_add_ps(_mm_mul_ps(c, t), _mm_mul_ps(s, d)))
}

#[target_feature(enable = "avx512f,avx512vl")]
#[inline]
fn rows([a, b, c, d]: [__m128; 4]) -> __m512 {
    let low = _mm512_insertf32x4::<1>(_mm512_castps128_ps512(a), b);
    _mm512_insertf32x4::<3>(_mm512_insertf32x4::<2>(low, c), d)
}

#[target_feature(enable = "avx512f,avx512vl")]
#[inline]
fn turn(f: __m512, cosines: __m512, sines: __m512, places: &Table<i32>) -> __m512 {
    let places = numbers(places);
    let cosine = _mm512_permutexvar_ps(places, cosines);
    let sine = _mm512_permutexvar_ps(places, sines);
    let signed = _mm512_castsi512_ps(_mm512_xor_si512(
        _mm512_castps_si512(sine),
        _mm512_castps_si512(factors(&SIGNS)),
    ));
    let swapped = _mm512_permutexvar_ps(numbers(&SWAPPED), f);
    _mm512_add_ps(_mm512_mul_ps(cosine, f), _mm512_mul_ps(signed, swapped))
}

#[target_feature(enable = "avx512f,avx512vl")]
#[inline]
fn quarter_turn(f: __m512, by: &QuarterTurn) -> __m512 {
    let first = _mm512_mul_ps(factors(&by.first.1), _mm512_permutexvar_ps(numbers(&by.first.0), f));
    let second = _mm512_mul_ps(factors(&by.second.1), _mm512_permutexvar_ps(numbers(&by.second.0), f));
    _mm512_add_ps(first, second)
}

#[target_feature(enable = "avx512f,avx512vl")]
#[inline]
fn numbers(table: &Table<i32>) -> __m512i {
    // SAFETY: sixteen numbers are read, aligned.
    unsafe { _mm512_load_si512(table.0.as_ptr().cast()) }
}

#[target_feature(enable = "avx512f,avx512vl")]
#[inline]
fn factors(table: &Table<f32>) -> __m512 {
    // SAFETY: sixteen numbers are read, aligned.
    unsafe { _mm512_load_ps(table.0.as_ptr()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels;

    #[test]
    fn sixteen_lanes_turn_a_vector_as_single_numbers_do() {
        if !is_there() {
            println!("skipped: this machine has no AVX-512");
            return;
        }
        for case in 0..1000 {
            let number = |i: usize| ((case * 31 + i * 17) as f32 * 0.618).sin() * 3.0;
            let f: [[f32; 4]; 4] = std::array::from_fn(|l| std::array::from_fn(|m| number(4 * l + m)));
            let turns: [[f32; 2]; 3] = std::array::from_fn(|i| {
                let (sin, cos) = (number(16 + i) * 2.0).sin_cos();
                [cos, sin]
            });
            let slow: [[f32; 4]; 4] = kernels::rotate(&f, &turns);
            assert_eq!(rotate_4(&f, &turns), slow, "case {case}");
        }
    }
}
