//! The few vector operations that the inner loops need, and their plain form.

/// `N` floats that are computed together.
///
/// A value of a wide form exists only inside functions compiled for its instructions: that is what makes its methods,
/// which call those instructions, sound. `Plain` exists everywhere.
pub(crate) trait Lanes: Copy {
    /// How many.
    const N: usize;

    /// The first `N` floats of a slice; panics if there are fewer.
    fn load(from: &[f32]) -> Self;
    /// Writes the lanes to the front of a slice; panics if it is shorter than `N`.
    fn store(self, to: &mut [f32]);
    /// Writes only the lanes whose bit is set.
    fn store_where(self, lanes: u32, to: &mut [f32]);
    fn splat(value: f32) -> Self;
    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    fn div(self, other: Self) -> Self;
    /// `self · b + c`, fused where the level has it.
    fn mul_add(self, b: Self, c: Self) -> Self;
    /// `self · b − c`, fused where the level has it.
    fn mul_sub(self, b: Self, c: Self) -> Self;
    /// `c − self · b`, fused where the level has it.
    fn neg_mul_add(self, b: Self, c: Self) -> Self;
    fn min(self, other: Self) -> Self;
    fn max(self, other: Self) -> Self;
    /// One bit for each lane where `self ≤ other`; false where either is NaN, as in all comparisons.
    fn le(self, other: Self) -> u32;
    fn lt(self, other: Self) -> u32;
    fn eq(self, other: Self) -> u32;
    /// One bit for each lane whose sign is minus, −0 included.
    fn negative(self) -> u32;
    /// The largest lane; none is NaN.
    fn highest(self) -> f32;
    /// Rows to columns, for eight rows of the first eight lanes.
    fn transpose(rows: [Self; 8]) -> [Self; 8];
}

/// Eight lanes in plain Rust.
#[derive(Clone, Copy)]
pub(crate) struct Plain([f32; 8]);

impl Plain {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        let mut out = [0.0; 8];
        for i in 0..8 {
            out[i] = f(self.0[i], other.0[i]);
        }
        Plain(out)
    }

    #[inline(always)]
    fn bits(self, other: Self, f: impl Fn(f32, f32) -> bool) -> u32 {
        let mut bits = 0;
        for i in 0..8 {
            bits |= u32::from(f(self.0[i], other.0[i])) << i;
        }
        bits
    }
}

impl Lanes for Plain {
    const N: usize = 8;

    #[inline(always)]
    fn load(from: &[f32]) -> Self {
        let mut lanes = [0.0; 8];
        lanes.copy_from_slice(&from[..8]);
        Plain(lanes)
    }
    #[inline(always)]
    fn store(self, to: &mut [f32]) {
        to[..8].copy_from_slice(&self.0);
    }
    #[inline(always)]
    fn store_where(self, lanes: u32, to: &mut [f32]) {
        for (lane, place) in to[..8].iter_mut().enumerate() {
            *place = if lanes >> lane & 1 != 0 { self.0[lane] } else { *place };
        }
    }
    #[inline(always)]
    fn splat(value: f32) -> Self {
        Plain([value; 8])
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
    fn div(self, other: Self) -> Self {
        self.zip(other, |a, b| a / b)
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        self.mul(b).add(c)
    }
    #[inline(always)]
    fn mul_sub(self, b: Self, c: Self) -> Self {
        self.mul(b).sub(c)
    }
    #[inline(always)]
    fn neg_mul_add(self, b: Self, c: Self) -> Self {
        c.sub(self.mul(b))
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
        self.bits(other, |a, b| a <= b)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> u32 {
        self.bits(other, |a, b| a < b)
    }
    #[inline(always)]
    fn eq(self, other: Self) -> u32 {
        self.bits(other, |a, b| a == b)
    }
    #[inline(always)]
    fn negative(self) -> u32 {
        self.bits(self, |a, _| a.is_sign_negative())
    }
    #[inline(always)]
    fn highest(self) -> f32 {
        self.0.iter().fold(f32::NEG_INFINITY, |a, &b| if b > a { b } else { a })
    }
    #[inline(always)]
    fn transpose(rows: [Self; 8]) -> [Self; 8] {
        let mut columns = rows;
        for i in 0..8 {
            for j in 0..8 {
                columns[i].0[j] = rows[j].0[i];
            }
        }
        columns
    }
}
