//! Random numbers from a seed, and the tail of the chi-square distribution.

use glam::{Vec2, Vec3};

/// A small generator (SplitMix64: Steele, Lea & Flood 2014): good enough to test samplers with, and the same
/// everywhere.
#[derive(Clone, Debug)]
pub struct Random {
    state: u64,
}

impl Random {
    /// A generator that depends on nothing but the seed.
    pub fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.state ^ (self.state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1u64 << 24) as f32
    }

    /// Uniform in the unit square.
    pub fn square(&mut self) -> Vec2 {
        Vec2::new(self.unit(), self.unit())
    }

    /// Uniform over the sphere.
    pub fn direction(&mut self) -> Vec3 {
        crate::sampling::spherical(1.0 - 2.0 * self.unit(), std::f32::consts::TAU * self.unit()).normalize()
    }
}

/// The p-value each of several tests has to exceed so that, were all true, one would fail with the probability
/// `significance`: Šidák's correction, 1 − (1 − α)^(1/n).
pub fn sidak_threshold(significance: f64, tests: usize) -> f64 {
    -((-significance).ln_1p() / tests.max(1) as f64).exp_m1()
}

/// The probability that a chi-square variable with that many degrees of freedom exceeds `statistic`.
pub fn chi_square_p_value(statistic: f64, degrees: usize) -> f64 {
    upper_gamma(0.5 * degrees as f64, 0.5 * statistic)
}

/// The regularised upper incomplete gamma function Q(a, x): the series below x = a + 1, Legendre's continued
/// fraction (evaluated by Lentz's method) above.
fn upper_gamma(a: f64, x: f64) -> f64 {
    if x <= 0.0 || a <= 0.0 {
        return 1.0;
    }
    let scale = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 {
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        while term > sum * 1e-15 {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        return (1.0 - scale * sum).clamp(0.0, 1.0);
    }
    let mut b = x + 1.0 - a;
    let (mut c, mut d) = (1e300, 1.0 / b);
    let mut fraction = d;
    for i in 1..10_000 {
        let i = f64::from(i);
        let numerator = -i * (i - a);
        b += 2.0;
        d = 1.0 / (numerator * d + b);
        c = b + numerator / c;
        fraction *= c * d;
        if (c * d - 1.0).abs() < 1e-15 {
            break;
        }
    }
    (scale * fraction).clamp(0.0, 1.0)
}

/// ln Γ(x) for x > 0: Stirling's series after shifting x above 10.
fn ln_gamma(mut x: f64) -> f64 {
    let mut shift = 0.0;
    while x < 10.0 {
        shift += x.ln();
        x += 1.0;
    }
    let r = 1.0 / (x * x);
    let series = (1.0 / 12.0 - r * (1.0 / 360.0 - r * (1.0 / 1260.0 - r / 1680.0))) / x;
    (x - 0.5) * x.ln() - x + 0.5 * std::f64::consts::TAU.ln() + series - shift
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tail_of_chi_square_has_its_published_values() {
        // Critical values of the usual tables.
        for (statistic, degrees, p) in
            [(3.841, 1, 0.05), (18.307, 10, 0.05), (23.209, 10, 0.01), (124.342, 100, 0.05)]
        {
            let found = chi_square_p_value(statistic, degrees);
            assert!((found - p).abs() < 2e-5, "{statistic} with {degrees}: {found}");
        }
        assert!((sidak_threshold(0.01, 1) - 0.01).abs() < 1e-15);
        assert!((sidak_threshold(0.01, 20) - 5.0239e-4).abs() < 1e-8);
    }
}
