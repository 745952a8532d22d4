//! Which vector instructions the inner loops use.
//!
//! Each inner loop is one `#[inline(always)]` body over [`Lanes`], and is instantiated inside one
//! `#[target_feature]` function per level; the level is chosen at run time, so one binary serves every machine.

mod kernel;
mod lanes;
#[cfg(target_arch = "x86_64")]
mod x86;

pub use kernel::Kernel;
pub(crate) use lanes::{Lanes, Plain};
#[cfg(target_arch = "x86_64")]
pub(crate) use x86::{Wide8, Wide16};

/// Half of the distance from 1 to the next float: the largest relative error of one rounding.
pub(crate) const ROUNDOFF: f32 = f32::EPSILON * 0.5;

/// A level of vector instructions. Answers of `Avx2` and `Avx512` agree to the last bit; `Baseline` has no fused
/// multiply-add and differs in rounding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Simd {
    /// What every machine of the target has.
    Baseline,
    /// 256-bit vectors and fused multiply-add.
    Avx2,
    /// 512-bit vectors where they help.
    Avx512,
}

impl Simd {
    /// The best level of this machine.
    #[must_use]
    pub fn detect() -> Simd {
        #[cfg(target_arch = "x86_64")]
        {
            let avx2 = is_x86_feature_detected!("avx2")
                && is_x86_feature_detected!("fma")
                && is_x86_feature_detected!("bmi1")
                && is_x86_feature_detected!("bmi2")
                && is_x86_feature_detected!("lzcnt")
                && is_x86_feature_detected!("popcnt");
            if avx2
                && is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512vl")
                && is_x86_feature_detected!("avx512dq")
                && is_x86_feature_detected!("avx512bw")
            {
                return Simd::Avx512;
            }
            if avx2 {
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
}

/// A level of vector instructions that does not exist, or not here.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownSimd {
    /// What was asked for.
    pub name: String,
    /// Whether the level exists but this machine lacks it.
    pub missing: bool,
}

impl std::fmt::Display for UnknownSimd {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.missing {
            write!(f, "this machine has no `{}`; its best level is `{}`", self.name, Simd::detect().name())
        } else {
            write!(
                f,
                "no level of vector instructions is called `{}`; there are auto, baseline, avx2, avx512",
                self.name
            )
        }
    }
}

impl std::error::Error for UnknownSimd {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_levels_are_read_back() {
        for level in [Simd::Baseline, Simd::Avx2, Simd::Avx512] {
            match Simd::from_name(level.name()) {
                Ok(read) => assert_eq!(read, level),
                Err(error) => assert!(error.missing && level > Simd::detect()),
            }
        }
        assert_eq!(Simd::from_name("auto"), Ok(Simd::detect()));
    }

    #[test]
    fn an_unknown_level_is_refused_with_the_names_that_exist() {
        let error = Simd::from_name("mmx").unwrap_err();
        assert!(error.to_string().contains("avx512"));
    }
}
