//! Loops of other crates, compiled for each level of vector instructions.
//!
//! A loop over slices in plain Rust is turned into vector instructions by the compiler, but only into those that it may
//! assume. [`Simd::run`] has one copy of a [`Kernel`] for each level and chooses among them at run time. Products and
//! sums are not fused unless the code says so, so all copies give the same bits.
//!
//! `unsafe` is needed to call the copies compiled for AVX2 and AVX-512.
#![allow(unsafe_code)]

use super::Simd;

/// A loop with what it works on.
///
/// ```
/// use halflight_trace::{Kernel, Simd};
/// struct Scale<'a>(&'a mut [f32], f32);
/// impl Kernel for Scale<'_> {
///     type Output = ();
///     #[inline(always)]
///     fn run(self) {
///         self.0.iter_mut().for_each(|x| *x *= self.1);
///     }
/// }
/// let mut numbers = [1.0, 2.0, 3.0];
/// Simd::detect().run(Scale(&mut numbers, 2.0));
/// assert_eq!(numbers, [2.0, 4.0, 6.0]);
/// ```
pub trait Kernel {
    /// What comes out.
    type Output;
    /// The loop. Mark it, and the functions that it calls, `#[inline(always)]`: what is not inlined is compiled for no
    /// level.
    fn run(self) -> Self::Output;
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
fn avx2<K: Kernel>(kernel: K) -> K::Output {
    kernel.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
fn avx512<K: Kernel>(kernel: K) -> K::Output {
    kernel.run()
}

impl Simd {
    /// Runs a loop with the instructions of this level, or of the best this machine has below it.
    #[inline]
    pub fn run<K: Kernel>(self, kernel: K) -> K::Output {
        #[cfg(target_arch = "x86_64")]
        match self.or_best() {
            // SAFETY: the machine was found to have these instructions.
            Simd::Avx512 => return unsafe { avx512(kernel) },
            // SAFETY: as above.
            Simd::Avx2 => return unsafe { avx2(kernel) },
            Simd::Baseline => {}
        }
        kernel.run()
    }
}
