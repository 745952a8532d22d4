//! Random numbers that derive from what they are for: (seed, step, index), so that results do not depend on threads.
//!
//! SplitMix64 (Steele, Lea and Flood 2014, *Fast Splittable Pseudorandom Number Generators*).

use glam::Vec3;

/// A stream of random numbers.
#[derive(Clone, Debug)]
pub(crate) struct Random {
    state: u64,
}

impl Random {
    /// The stream of a purpose.
    #[inline(always)]
    pub(crate) fn new(seed: u64, step: u64, index: u64) -> Random {
        let mut random = Random { state: seed ^ 0x9e37_79b9_7f4a_7c15 };
        random.state = random.bits() ^ step.wrapping_mul(0xd134_2543_de82_ef95);
        random.state = random.bits() ^ index.wrapping_mul(0xa24b_aed4_963e_e407);
        random.bits();
        random
    }

    #[inline(always)]
    pub(crate) fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.state ^ (self.state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In [0, 1), 24 bits.
    #[inline(always)]
    pub(crate) fn float(&mut self) -> f32 {
        (self.bits() >> 40) as f32 * (1.0 / 16_777_216.0)
    }

    /// In [0, 1), 53 bits.
    #[inline(always)]
    pub(crate) fn double(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0)
    }

    /// From 0 to below `count`, which is not 0.
    #[inline(always)]
    pub(crate) fn below(&mut self, count: usize) -> usize {
        ((u128::from(self.bits()) * count as u128) >> 64) as usize
    }

    /// Uniform on the unit sphere: cos θ = 1 − 2a, where [002 eq. 10] has θ = aπ: see `docs/errata.md`.
    #[inline(always)]
    pub(crate) fn direction(&mut self) -> Vec3 {
        let cos = 1.0 - 2.0 * self.float();
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        let phi = std::f32::consts::TAU * self.float();
        Vec3::new(sin * phi.cos(), sin * phi.sin(), cos)
    }

    /// Barycentric weights of the second and third corner, uniform on a triangle: (a, b) folded where a + b > 1, which
    /// [002 eq. 9] leaves out: see `docs/errata.md`.
    #[inline(always)]
    pub(crate) fn barycentric(&mut self) -> (f32, f32) {
        let (a, b) = (self.float(), self.float());
        if a + b > 1.0 { (1.0 - a, 1.0 - b) } else { (a, b) }
    }

    /// Of normal distribution (Box and Muller).
    pub(crate) fn normal(&mut self) -> f32 {
        let radius = (-2.0 * (1.0 - self.float()).ln()).sqrt();
        radius * (std::f32::consts::TAU * self.float()).cos()
    }
}
