//! Which vector instructions the batched kernels use, and how they are reached.
//!
//! A kernel is a value with one `#[inline(always)]` method over any [`Lane`] type. [`Simd::run`] instantiates it inside a
//! `#[target_feature]` function for each level and calls the one that the machine has, so one binary serves every
//! machine.

mod lane;
#[cfg(target_arch = "x86_64")]
mod turn;
#[cfg(target_arch = "x86_64")]
mod x86;

pub use lane::Lane;
pub(crate) use lane::Plain;

use crate::kernels;

/// A level of vector instructions. `Baseline` has no fused multiply-add and differs from the others in rounding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Simd {
    /// What every machine of the target has.
    Baseline,
    /// 256-bit vectors and fused multiply-add.
    Avx2,
    /// 512-bit vectors.
    Avx512,
}

/// Work that runs at any level.
pub trait Kernel {
    /// What it gives.
    type Output;
    /// The work, with `V` as its vectors. Implementations are `#[inline(always)]`.
    fn run<V: Lane>(self) -> Self::Output;
}

/// Work with single numbers.
///
/// It is public in name only: it stands in a trait that keeps [`crate::Real`] closed.
pub trait Work {
    /// What it gives.
    type Output;
    /// Does it. Implementations are `#[inline(always)]`.
    fn run(self) -> Self::Output;
}

/// Does work with the encodings of AVX, and the registers of AVX-512, where the machine has them: the same operations and
/// the same bits, in fewer instructions. There is no fused multiply-add in it.
#[inline(always)]
pub(crate) fn with_avx<W: Work>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx512vl") {
            return x86::run_avx512vl(work);
        }
        if is_x86_feature_detected!("avx") {
            return x86::run_avx(work);
        }
    }
    work.run()
}

/// The rotation of one vector, in vector registers where the machine has them and the order fits: the same bits.
#[inline(always)]
pub(crate) fn rotate<const N: usize>(f: &[[f32; N]; N], turns: &[[f32; 2]; 3]) -> [[f32; N]; N] {
    #[cfg(target_arch = "x86_64")]
    if N == 4 && turn::is_there() {
        return kernels::same(&turn::rotate_4(&kernels::same(f), turns));
    }
    kernels::rotate(f, turns)
}

impl Simd {
    /// The best level of this machine.
    #[must_use]
    pub fn detect() -> Simd {
        #[cfg(target_arch = "x86_64")]
        {
            if x86::has_avx512() {
                return Simd::Avx512;
            }
            if x86::has_avx2() {
                return Simd::Avx2;
            }
        }
        Simd::Baseline
    }

    /// The level, or the best this machine has below it.
    #[must_use]
    pub fn or_best(self) -> Simd {
        self.min(Simd::detect())
    }

    /// The level of a name: `baseline`, `avx2`, `avx512`, or `auto` for the best of this machine.
    ///
    /// # Errors
    /// A name that is none of these, or a level that this machine lacks.
    pub fn from_name(name: &str) -> Result<Simd, UnknownSimd> {
        let level = match name {
            "auto" => return Ok(Simd::detect()),
            "baseline" => Simd::Baseline,
            "avx2" => Simd::Avx2,
            "avx512" => Simd::Avx512,
            _ => return Err(UnknownSimd { name: name.to_owned(), missing: false }),
        };
        if level > Simd::detect() {
            return Err(UnknownSimd { name: name.to_owned(), missing: true });
        }
        Ok(level)
    }

    /// The name that [`Simd::from_name`] reads.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Simd::Baseline => "baseline",
            Simd::Avx2 => "avx2",
            Simd::Avx512 => "avx512",
        }
    }

    /// Runs a kernel at this level, or at the best below it that the machine has.
    #[inline]
    pub fn run<K: Kernel>(self, kernel: K) -> K::Output {
        #[cfg(target_arch = "x86_64")]
        match self.or_best() {
            Simd::Avx512 => return x86::run_avx512(kernel),
            Simd::Avx2 => return x86::run_avx2(kernel),
            Simd::Baseline => {}
        }
        kernel.run::<Plain>()
    }
}

/// A level of vector instructions that does not exist, or not here.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}", self.story())]
pub struct UnknownSimd {
    /// What was asked for.
    pub name: String,
    /// Whether the level exists but this machine lacks it.
    pub missing: bool,
}

impl UnknownSimd {
    fn story(&self) -> String {
        if self.missing {
            format!("this machine has no `{}`; its best level is `{}`", self.name, Simd::detect().name())
        } else {
            format!(
                "no level of vector instructions is called `{}`; there are auto, baseline, avx2, avx512",
                self.name
            )
        }
    }
}
