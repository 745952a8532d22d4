//! The 95 % rule: from powers at frequencies to one bandwidth.

use super::pyramid::Pyramid;

/// The share of the power that may lie above the bandwidth.
pub const TAIL: f32 = 0.05;

/// Detail below this share of the mean amplitude is rounding, not signal: a thousandth of what eight bits resolve at white.
pub const NEGLIGIBLE_CONTRAST: f32 = 4e-6;

/// What to say within the octave in which the tail is passed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rule {
    /// Its upper end: conservative, and a power of two. The default.
    #[default]
    Octave,
    /// The place within it, the logarithm of the tail taken as falling with the square of frequency, as that of a Gaussian
    /// does; for edges, whose tail is 1/f, it is up to a ninth too high. Nearer to the truth on average, and no longer
    /// always above it.
    Within,
}

impl Rule {
    /// The frequency in the octave below `upper` at which the tail is passed: of its `power` as much as is `needed` is to lie
    /// above it, with what lies above the octave a `tail` in all.
    #[inline]
    pub(super) fn frequency(self, upper: f32, needed: f32, power: f32, tail: f32) -> f32 {
        match self {
            Self::Octave => upper,
            Self::Within => {
                // What lies above the upper end and above the lower one. What rounding leaves of none is bounded.
                let above = (tail - needed).max(1e-3 * tail);
                let (all, tail) = (above + power, tail.max(above));
                let share = ((all / tail).ln() / (all / above).ln()).clamp(0.0, 1.0);
                upper * (0.25 + 0.75 * share).sqrt()
            }
        }
    }
}

/// The bandwidth of a whole picture, cycles per texel: zero for a constant one, ½ where the finest octave has its share.
#[must_use]
pub fn whole_bandwidth(pyramid: &Pyramid, rule: Rule) -> f32 {
    let energies = pyramid.energies();
    let total: f64 = energies.iter().sum();
    let contrast = f64::from(NEGLIGIBLE_CONTRAST) * f64::from(pyramid.mean);
    if total <= contrast * contrast {
        return 0.0;
    }
    let tail = f64::from(TAIL) * total;
    let mut needed = tail;
    for (i, &energy) in energies.iter().enumerate() {
        if energy >= needed {
            return rule.frequency(upper_end(i), needed as f32, energy as f32, tail as f32);
        }
        needed -= energy;
    }
    upper_end(energies.len())
}

/// 2^−(i+1): the upper end of octave i, cycles per texel.
#[inline]
pub(super) fn upper_end(octave: usize) -> f32 {
    0.5 * (-(octave as f32)).exp2()
}
