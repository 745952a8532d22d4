//! Reproducible random numbers, for tables over random configurations and for tests.

use std::f64::consts::TAU;

/// Numbers from a counter. Source: Steele, Lea, Flood, Fast Splittable Pseudorandom Number Generators, 2014
/// (`splitmix64`).
pub(crate) struct Numbers(u64);

impl Numbers {
    pub(crate) fn new(seed: u64) -> Self {
        Numbers(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x5851_f42d_4c95_7f2d)
    }

    /// In [0, 1).
    pub(crate) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    /// A uniform direction.
    pub(crate) fn direction(&mut self) -> glam::DVec3 {
        let (z, turn) = (self.between(-1.0, 1.0), TAU * self.next());
        let r = (1.0 - z * z).max(0.0).sqrt();
        glam::DVec3::new(r * turn.cos(), r * turn.sin(), z)
    }
}
