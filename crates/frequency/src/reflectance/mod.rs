//! The angular bandwidth ρ of any reflectance, tabulated.
//!
//! For 16 × 16 incident directions, a map of 16 × 16 outgoing ones: cycles per radian of f(ω_i, ·) around ω_o. Slices are
//! evaluated at 128² to 1024² directions (doubled until the finest octave no longer holds the bandwidth), analysed by
//! wavelets, and scaled down by the maximum. Isotropic reflectances need 16 incident elevations instead of 256 directions.
//!
//! Source: `[001]` §2.3 (reflectance), with the verified rule. Directions are in the local frame (+z = normal); slices are
//! equidistant discs, (x, y) = θ/(π/2) · (cos φ, sin φ), continued beyond the horizon by the horizon's values so that the
//! horizon itself is no edge. f is the BRDF without the cosine, any channel or luminance. No direction has more than the
//! whole slice by the same rule: what is faster than that holds less than 5 % of the lobe's detail.
//!
//! Error: for cosᵅ lobes 0.7 to 1.8 times 0.2755 √α at the peak from α = 16 on, 2.3 times at α = 4, 6 times at α = 1: the
//! mean of a slice does not count as its power, or a highlight over a diffuse ground would not count
//! (`tests/reflectances.rs`). Cost: 16 to 256 slices of at
//! least 4096 evaluations, in parallel: 44 ms without and 0.9 s with a grain for a Phong lobe of exponent 64 on two cores.

mod build;
mod bytes;
mod disc;

pub use build::Slices;
pub use bytes::BytesError;
pub use disc::{disc_to_hemisphere, hemisphere_to_disc};

use glam::Vec3;

/// Directions along one side of a table.
pub const SIDE: usize = 16;

/// ρ(ω_i, ω_o) of one reflectance.
#[derive(Clone, Debug, PartialEq)]
pub struct ReflectanceBandwidth {
    isotropic: bool,
    /// Per incident direction (elevation, or disc cell) `SIDE²` outgoing disc cells.
    table: Vec<f32>,
}

impl ReflectanceBandwidth {
    /// The table of `f(wi, wo)`, which is called from many threads. Values that are negative or not finite count as zero;
    /// a reflectance of zero has bandwidth zero.
    #[must_use]
    pub fn new(f: impl Fn(Vec3, Vec3) -> f32 + Sync, slices: &Slices) -> Self {
        Self { isotropic: slices.isotropic, table: build::table(&f, slices) }
    }

    /// The same bandwidth for all directions: analytic lobes.
    #[must_use]
    pub fn constant(bandwidth: f32) -> Self {
        Self { isotropic: true, table: vec![crate::bandwidth::bounded(bandwidth); SIDE * SIDE * SIDE] }
    }

    /// ρ in cycles per radian for light from `wi` seen from `wo`, unit vectors in the local frame; directions below the
    /// surface are lifted to the horizon.
    #[inline]
    #[must_use]
    pub fn at(&self, wi: Vec3, wo: Vec3) -> f32 {
        let (incident, outgoing) = if self.isotropic {
            let angle = wi.z.clamp(0.0, 1.0).acos() * std::f32::consts::FRAC_2_PI;
            let row = ((angle * SIDE as f32) as usize).min(SIDE - 1);
            let across = wi.x.hypot(wi.y);
            let (c, s) = if across > 1e-6 { (wi.x / across, wi.y / across) } else { (1.0, 0.0) };
            (row, Vec3::new(c * wo.x + s * wo.y, c * wo.y - s * wo.x, wo.z))
        } else {
            (disc::cell(wi), wo)
        };
        self.table[incident * SIDE * SIDE + disc::cell(outgoing)]
    }

    /// Whether incident azimuths are folded into one.
    #[must_use]
    pub fn is_isotropic(&self) -> bool {
        self.isotropic
    }

    /// The largest ρ of the table, cycles per radian.
    #[must_use]
    pub fn largest(&self) -> f32 {
        self.table.iter().copied().fold(0.0, f32::max)
    }

    /// The larger of two: of reflectances that are added. Of one with and one without a grain, the largest value of the one
    /// without counts everywhere.
    #[must_use]
    pub fn larger(&self, other: &Self) -> Self {
        if self.isotropic != other.isotropic {
            let (plain, grained) = if self.isotropic { (self, other) } else { (other, self) };
            let least = plain.largest();
            let table = grained.table.iter().map(|value| value.max(least)).collect();
            return Self { isotropic: false, table };
        }
        let table = self.table.iter().zip(&other.table).map(|(a, b)| a.max(*b)).collect();
        Self { isotropic: self.isotropic, table }
    }

    /// All values: per incident direction 16 × 16 outgoing ones.
    #[must_use]
    pub fn values(&self) -> &[f32] {
        &self.table
    }
}
