//! The network of [002 §V-A], kept for comparison: (x, ω) through eight weight-normalised hidden layers of 512 with ReLU
//! and dropout, to one distance; clamp loss [002 eq. 8]; Adam.
//!
//! The direction enters as a unit vector, not as two angles: angles jump where the azimuth wraps. A miss has the target δ,
//! which is what ∞ means under the clamp, and a hit beyond δ has it too: the network cannot tell them apart
//! ([`SeedNetwork::query`] calls everything beyond 0.95 δ a miss; see `docs/errata.md`).
//!
//! Two schedules: *printed* (learning rate 10⁻⁷, dropout ½) does next to nothing in any time we could wait for; *ours*
//! (10⁻³ falling to 10⁻⁵, no dropout, half of each batch from the samples that hit) trains.

pub(crate) mod field;
mod layers;
mod train;

pub use field::SeedShape;
pub use train::{SeedOptions, SeedSchedule, SeedTrainer};

use glam::Vec3;

use layers::Layers;

/// A trained network of the seed, in the unit sphere.
#[derive(Clone, Debug)]
pub struct SeedNetwork {
    layers: Layers,
    delta: f32,
}

impl SeedNetwork {
    /// φ for many (x, ω) at once, clamped to δ; ω of unit length.
    #[must_use]
    pub fn distances(&self, rays: &[(Vec3, Vec3)]) -> Vec<f32> {
        self.layers.run(rays).into_iter().map(|t| t.clamp(-self.delta, self.delta)).collect()
    }

    /// φ for many (x, ω), `None` beyond 0.95 δ.
    #[must_use]
    pub fn query(&self, rays: &[(Vec3, Vec3)]) -> Vec<Option<f32>> {
        self.distances(rays).into_iter().map(|t| (t < 0.95 * self.delta).then_some(t.max(0.0))).collect()
    }

    /// Numbers that were learned.
    #[must_use]
    pub fn parameters(&self) -> usize {
        self.layers.parameters()
    }
}
