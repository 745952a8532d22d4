//! Adam (Kingma and Ba 2015), on slices.
//!
//! m ← β₁m + (1 − β₁)g, v ← β₂v + (1 − β₂)g², w ← w − η m̂/(√v̂ + ε). An entry whose gradient is exactly 0 was not seen
//! in this step and stays as it is (as in Müller et al. 2022, *Instant Neural Graphics Primitives*).

/// The two moments of each parameter.
#[derive(Clone, Debug, Default)]
pub(crate) struct Adam {
    pub(crate) first: Vec<f32>,
    pub(crate) second: Vec<f32>,
}

/// β₁, β₂ and ε as Müller et al. have them, which suits gradients that are sparse.
const BETA_1: f32 = 0.9;
const BETA_2: f32 = 0.99;
const EPSILON: f32 = 1e-15;

/// What a step multiplies by.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rate {
    scale: f32,
    correction_2: f32,
}

impl Rate {
    /// Of a step, counted from 1.
    pub(crate) fn new(learning_rate: f32, step: u64) -> Rate {
        let power = step.min(100_000) as i32;
        let correction_1 = 1.0 - BETA_1.powi(power);
        let correction_2 = 1.0 - BETA_2.powi(power);
        Rate { scale: learning_rate / correction_1, correction_2: 1.0 / correction_2 }
    }

    /// One parameter.
    #[inline(always)]
    pub(crate) fn apply(self, w: &mut f32, m: &mut f32, v: &mut f32, g: f32) {
        let seen = g != 0.0;
        let first = BETA_1 * *m + (1.0 - BETA_1) * g;
        let second = BETA_2 * *v + (1.0 - BETA_2) * g * g;
        let moved = *w - self.scale * first / ((second * self.correction_2).sqrt() + EPSILON);
        *m = if seen { first } else { *m };
        *v = if seen { second } else { *v };
        *w = if seen { moved } else { *w };
    }
}

impl Adam {
    pub(crate) fn new(count: usize) -> Adam {
        Adam { first: vec![0.0; count], second: vec![0.0; count] }
    }
}
