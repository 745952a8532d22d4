//! One bounce in closed form: what the bandwidth buffer evaluates for every pixel and direction.
//!
//! Multiplying out ν = T_d' P_x C_-c B C_-c P_i T_d ν_light (`[001]` eq. (3)–(4), corrected), with k = min(1, ρ/|ν_a|) at B:
//!
//! ```text
//! distant   ν_a = min(ν, ρ) |2 c d'/cos θ_x + 1| + d' t/cos θ_x          ν_s = min(ν, ρ) |2 c|/cos θ_x + t/cos θ_x
//! local     ν_a = k ν |d' (cos θ_i + 2 c d)/cos θ_x + d| + d' t/cos θ_x  ν_s = k ν |cos θ_i + 2 c d|/cos θ_x + t/cos θ_x
//! ```
//!
//! The texture widens the line into a parallelogram, whose bounds are the sums of the two magnitudes. For distant lights the
//! factor is the same for all directions, so the average over sixteen of them, eq. (5), is one weighted mean of min(ν, ρ).

use super::operators::{Bandwidth, GRAZING, bounded};

/// The surface at a pixel and the way from there to the eye: what all directions of light share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exit {
    /// c, 1/m: largest principal curvature in size, convex > 0.
    pub curvature: f32,
    /// d', metres from the surface to the eye.
    pub distance: f32,
    /// cos θ_x between the normal and the direction to the eye.
    pub cos_exit: f32,
    /// t, cycles per metre along the surface.
    pub texture: f32,
}

impl Exit {
    /// 2 c d'/cos θ_x + 1: how much faster the picture varies than a distant light, along the tilt. Exact for mirrors.
    #[inline]
    #[must_use]
    pub fn magnification(&self) -> f32 {
        2.0 * self.curvature * self.distance / self.cos_exit.max(GRAZING) + 1.0
    }

    /// 2 c d' cos θ_x + 1: the same across the tilt, for a surface that is curved alike in all directions.
    #[inline]
    #[must_use]
    pub fn magnification_across(&self) -> f32 {
        2.0 * self.curvature * self.distance * self.cos_exit.max(GRAZING) + 1.0
    }

    /// By how much the radius that holds 95 % of a two-dimensional spectrum is smaller than [`Self::distant`] says, because
    /// the spectrum is stretched in one direction more than in the other: √(0.64 + 0.36 (smaller/larger)²), which leads
    /// from the one-dimensional 1.96 to the isotropic 2.45 standard deviations of a Gaussian. `other_curvature` is the
    /// second principal one: that of the surface for spheres, 0 for cylinders.
    #[inline]
    #[must_use]
    pub fn roundness(&self, other_curvature: f32) -> f32 {
        let across = Exit { curvature: other_curvature, ..*self }.magnification_across().abs();
        let along = self.magnification().abs();
        let ratio = across.min(along) / across.max(along).max(f32::MIN_POSITIVE);
        // A ratio that is not a number reduces nothing.
        let ratio = if ratio.is_finite() { ratio } else { 1.0 };
        (0.64 + 0.36 * ratio * ratio).sqrt()
    }

    /// What the texture alone sends to the eye: it is added to every path.
    #[inline]
    #[must_use]
    pub fn textured(&self) -> Bandwidth {
        let spatial = self.texture / self.cos_exit.max(GRAZING);
        Bandwidth::new(spatial, self.distance * spatial).magnitude()
    }

    /// At the eye, from a distant light of `light` cycles/rad by a lobe of `lobe` cycles/rad. `[001]` eq. (4).
    #[inline]
    #[must_use]
    pub fn distant(&self, light: f32, lobe: f32) -> Bandwidth {
        self.distant_limited(light.min(lobe))
    }

    #[inline]
    fn distant_limited(&self, angular: f32) -> Bandwidth {
        let across = 2.0 * self.curvature / self.cos_exit.max(GRAZING);
        let line = Bandwidth::new(across * angular, self.magnification() * angular);
        (line.magnitude() + self.textured()).magnitude()
    }

    /// At the eye, from a light of `light` cycles/m at `distance` metres that arrives at `cos_incidence`, by a lobe of
    /// `lobe` cycles/rad. `[001]` eq. (4), with the sign of the first travel put right.
    #[inline]
    #[must_use]
    pub fn local(&self, light: f32, distance: f32, cos_incidence: f32, lobe: f32) -> Bandwidth {
        (self.local_line(light, distance, cos_incidence, lobe).magnitude() + self.textured()).magnitude()
    }

    #[inline(always)]
    fn local_line(&self, light: f32, distance: f32, cos_incidence: f32, lobe: f32) -> Bandwidth {
        let arriving = distance * light;
        let kept = (lobe / arriving.abs()).min(1.0) * light;
        let spatial = kept * (cos_incidence + 2.0 * self.curvature * distance) / self.cos_exit.max(GRAZING);
        Bandwidth::new(spatial, spatial * self.distance + kept * distance)
    }

    /// `[001]` eq. (5), magnitudes averaged, over `N` directions towards distant light with weights λ_i ≥ 0; no light at
    /// all gives the texture's share.
    #[inline]
    #[must_use]
    pub fn average_distant<const N: usize>(
        &self,
        light: &[f32; N],
        lobe: &[f32; N],
        weight: &[f32; N],
    ) -> Bandwidth {
        let mut sum = 0.0;
        let mut total = 0.0;
        for i in 0..N {
            sum += weight[i] * bounded(light[i].min(lobe[i]));
            total += weight[i];
        }
        self.distant_limited(if total > 0.0 { sum / total } else { 0.0 })
    }

    /// The same for `N` points of local lights: frequency, distance and cosine of each.
    #[inline]
    #[must_use]
    pub fn average_local<const N: usize>(
        &self,
        light: &[f32; N],
        distance: &[f32; N],
        cos_incidence: &[f32; N],
        lobe: &[f32; N],
        weight: &[f32; N],
    ) -> Bandwidth {
        let (mut spatial, mut angular) = ([0.0; N], [0.0; N]);
        for i in 0..N {
            let line = self.local_line(light[i], distance[i], cos_incidence[i], lobe[i]).magnitude();
            spatial[i] = weight[i] * line.spatial;
            angular[i] = weight[i] * line.angular;
        }
        let total: f32 = weight.iter().sum();
        let scale = if total > 0.0 { 1.0 / total } else { 0.0 };
        let mean = Bandwidth::new(spatial.iter().sum::<f32>(), angular.iter().sum::<f32>()) * scale;
        (mean.magnitude() + self.textured()).magnitude()
    }
}
