//! Ratio attenuation: how much of each blocker's log-visibility counts where blockers overlap.
//!
//! Summing logarithms multiplies visibilities as if blockers were independent. Random overlap is that; overlap beyond
//! what the low-order density of blockers predicts, as in the spheres that fill one body, must be taken out (\[000\] has the
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

#[cfg(test)]
mod tests {
    use super::*;

    fn cap(direction: Vec3, degrees: f32) -> Cap {
        Cap { direction: direction.normalize(), half_angle: degrees.to_radians() }
    }

    #[test]
    fn a_cap_overlaps_itself_wholly_and_one_apart_from_it_not_at_all() {
        let (a, b) = (cap(Vec3::X, 20.0), cap(Vec3::Y, 30.0));
        assert!((a.overlap(&a) - a.solid_angle()).abs() < 1e-6);
        assert_eq!(a.overlap(&b), 0.0);
        let within = cap(Vec3::new(1.0, 0.1, 0.0), 5.0);
        assert!((a.overlap(&within) - within.solid_angle()).abs() < 1e-6);
    }

    #[test]
    fn equal_caps_count_once_together_and_one_alone_counts_wholly() {
        let caps = [cap(Vec3::X, 5.0); 4];
        let m = multiplicities(&caps);
        assert!(m.iter().all(|m| (m - 4.0).abs() < 1e-4));
        let total: f32 = weights::<4>(&caps, &m).iter().sum();
        assert!((1.0..1.2).contains(&total), "{total}");
        assert_eq!(weights::<4>(&caps[..1], &[1.0]), vec![1.0]);
    }

    #[test]
    fn only_caps_wholly_below_the_horizon_are_dropped() {
        assert!(cap(Vec3::new(1.0, 0.0, -0.3), 20.0).above_horizon(Vec3::Z));
        assert!(!cap(Vec3::new(1.0, 0.0, -0.4), 20.0).above_horizon(Vec3::Z));
    }

    #[test]
    fn spheres_around_or_at_the_point_have_a_sound_angle() {
        assert_eq!(Cap::of_sphere(Vec3::ZERO, 1.0), None);
        let inside = Cap::of_sphere(Vec3::X * 0.5, 1.0).expect("a direction");
        assert!((inside.half_angle - 0.9f32.asin()).abs() < 1e-6);
        assert_eq!(Cap::of_sphere(Vec3::splat(f32::NAN), 1.0), None);
    }

    #[test]
    fn no_blockers_are_no_shadow() {
        assert_eq!(log_visibility(&BlockerTable::<4>::new(), &[], &[], None), Sh::zero());
    }
}
