//! Ratio attenuation: how much of each blocker's log-visibility counts where blockers overlap.
//!
//! Summing logarithms multiplies visibilities as if blockers were independent. Random overlap is that; overlap beyond
//! what the low-order density of blockers predicts, as in the spheres that fill one body, must be taken out ([000] has the
//! idea in words; the definition is verified against quadrature):
//!
//! ```text
//! Ω_b  = 2π (1 − cos θ_b)
//! I_bj = Ω_min(b,j) · S(1 − clamp((δ_bj − |θ_b − θ_j|)/(θ_b + θ_j − |θ_b − θ_j|), 0, 1)),  S(x) = x²(3 − 2x)
//! m_b  = Σ_j I_bj / Ω_b                              multiplicity, self included, ≥ 1
//! D    = Σ_b D_b,   D_b = cap(θ_b) turned to d_b     blocker density in SH
//! d_b  = max(0, (⟨D_b, D⟩ − ⟨D_b, D_b⟩)/Ω_b)         overlap that the density already expresses
//! w_b  = min(1, (1 + d_b)/m_b)
//! keep b iff d_b · n > −sin θ_b
//! ```
//!
//! This is the plain form for one point, O(B²) in the number of blockers because of m_b; m_b may instead be known for
//! each sphere beforehand. Mean error over the sets of [`crate::study`]: 1.2 % of the unoccluded irradiance, 1.9 % without.

use std::f32::consts::{FRAC_PI_2, TAU};

use glam::Vec3;

use crate::{BlockerTable, Sh, Zh};

/// A blocker as a point sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cap {
    /// Unit direction of its middle.
    pub direction: Vec3,
    /// θ_b in radians, up to π/2.
    pub half_angle: f32,
}

impl Cap {
    /// A sphere seen from the origin; `None` at its very centre. From inside or near the surface it counts as if its
    /// radius were 0.9 of the distance.
    #[must_use]
    pub fn of_sphere(centre: Vec3, radius: f32) -> Option<Cap> {
        let distance = centre.length();
        let direction = (centre / distance).is_finite().then(|| centre / distance)?;
        Some(Cap { direction, half_angle: (radius / distance).min(0.9).asin() })
    }

    /// Ω_b, in steradians.
    #[must_use]
    pub fn solid_angle(&self) -> f32 {
        let half = (self.half_angle * 0.5).sin();
        2.0 * TAU * half * half
    }

    /// I_bj: an approximation of the solid angle that two caps share.
    #[must_use]
    pub fn overlap(&self, other: &Cap) -> f32 {
        let between = self.direction.angle_between(other.direction);
        let apart = (self.half_angle - other.half_angle).abs();
        let reach = self.half_angle + other.half_angle - apart;
        let x = 1.0 - ((between - apart) / reach.max(1e-12)).clamp(0.0, 1.0);
        self.solid_angle().min(other.solid_angle()) * (x * x * (3.0 - 2.0 * x))
    }

    /// Whether any of the cap is above the horizon of a normal.
    #[must_use]
    pub fn above_horizon(&self, normal: Vec3) -> bool {
        self.direction.dot(normal) > -self.half_angle.min(FRAC_PI_2).sin()
    }
}

/// m_b of each cap.
#[must_use]
pub fn multiplicities(caps: &[Cap]) -> Vec<f32> {
    caps.iter()
        .map(|b| {
            let shared: f32 = caps.iter().map(|j| b.overlap(j)).sum();
            (shared / b.solid_angle().max(f32::MIN_POSITIVE)).max(1.0)
        })
        .collect()
}

/// w_b of each cap, from the multiplicities.
#[must_use]
pub fn weights<const ORDER: usize>(caps: &[Cap], multiplicities: &[f32]) -> Vec<f32> {
    let terms: Vec<Sh<ORDER>> =
        caps.iter().map(|cap| Zh::cap(f64::from(cap.half_angle)).to_direction(cap.direction)).collect();
    let density: Sh<ORDER> = terms.iter().copied().sum();
    caps.iter()
        .zip(&terms)
        .zip(multiplicities)
        .map(|((cap, term), &multiplicity)| {
            let expressed = (term.dot(&density) - term.dot(term)) / cap.solid_angle().max(f32::MIN_POSITIVE);
            ((1.0 + expressed.max(0.0)) / multiplicity.max(1.0)).min(1.0)
        })
        .collect()
}

/// F = Σ w_b log-visibility of the caps that reach above the horizon of `normal` (of all, without one).
///
/// The weights see all caps, those below the horizon too.
#[must_use]
pub fn log_visibility<const ORDER: usize>(
    table: &BlockerTable<ORDER>,
    caps: &[Cap],
    multiplicities: &[f32],
    normal: Option<Vec3>,
) -> Sh<ORDER> {
    weights::<ORDER>(caps, multiplicities)
        .into_iter()
        .zip(caps)
        .filter(|(_, cap)| normal.is_none_or(|normal| cap.above_horizon(normal)))
        .map(|(weight, cap)| table.log_visibility(cap) * weight)
        .sum()
}
