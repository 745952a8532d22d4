//! The operators of `[001]` Fig. 4 on one bandwidth vector.

use std::ops::{Add, Mul};

/// What stands for "not band-limited", in any unit. Bounds are clamped here, so that they stay finite; the picture clamps
/// again at what it can show.
pub const UNLIMITED: f32 = 1e9;

/// The smallest cosine that anything is divided by: at a grazing angle of 89.994° the picture has long been clamped.
pub const GRAZING: f32 = 1e-4;

/// The size of a frequency: not negative, not above [`UNLIMITED`], which is also what NaN becomes.
#[inline(always)]
#[must_use]
pub fn bounded(frequency: f32) -> f32 {
    frequency.abs().min(UNLIMITED)
}

/// The end of the line that is the spectrum of a local light field along one path: signed while operators act,
/// a pair of bounds after [`Bandwidth::magnitude`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bandwidth {
    /// ν_s, cycles per metre across the ray.
    pub spatial: f32,
    /// ν_a, cycles per radian.
    pub angular: f32,
}

impl Bandwidth {
    /// Both components, in cycles per metre and cycles per radian.
    #[inline]
    #[must_use]
    pub const fn new(spatial: f32, angular: f32) -> Self {
        Self { spatial, angular }
    }

    /// What leaves a distant light: angular only.
    #[inline]
    #[must_use]
    pub const fn distant(angular: f32) -> Self {
        Self::new(0.0, angular)
    }

    /// What leaves a point of an area light: spatial only.
    #[inline]
    #[must_use]
    pub const fn local(spatial: f32) -> Self {
        Self::new(spatial, 0.0)
    }

    /// T_d, free travel over `distance` metres: angular shear. `[001]` Fig. 4.
    #[inline]
    #[must_use]
    pub fn travel(self, distance: f32) -> Self {
        Self { angular: self.angular - distance * self.spatial, ..self }
    }

    /// P_i, from across the ray to along a surface that the ray meets at `cos_incidence`. `[001]` Fig. 4.
    #[inline]
    #[must_use]
    pub fn incidence(self, cos_incidence: f32) -> Self {
        Self { spatial: self.spatial * cos_incidence, ..self }
    }

    /// P_x, from along a surface to across the ray that leaves it at `cos_exit`. `[001]` Fig. 4. Grazing angles are
    /// clamped at [`GRAZING`].
    #[inline]
    #[must_use]
    pub fn exit(self, cos_exit: f32) -> Self {
        Self { spatial: self.spatial / cos_exit.max(GRAZING), ..self }
    }

    /// C_c, spatial shear by `curvature` in 1/m. `[001]` Fig. 4. A reflection applies it twice with **minus** the surface's
    /// curvature (convex > 0), which is the largest principal one or the normal one in the plane of incidence, not Gauss's:
    /// that is in 1/m² and zero on a cylinder.
    #[inline]
    #[must_use]
    pub fn curvature(self, curvature: f32) -> Self {
        Self { spatial: self.spatial + curvature * self.angular, ..self }
    }

    /// The share of the line that a lobe of angular bandwidth `lobe` lets through: k = min(1, ρ/|ν_a|).
    #[inline]
    #[must_use]
    pub fn kept(self, lobe: f32) -> f32 {
        // 0/0 is NaN, which `min` turns into 1: nothing to clip.
        (lobe / self.angular.abs()).min(1.0)
    }

    /// The band-limiting half of B. `[001]` Fig. 4, corrected: a line is cut, so **both** components shrink; as printed,
    /// only the angular one does.
    #[inline]
    #[must_use]
    pub fn band_limit(self, lobe: f32) -> Self {
        self * self.kept(lobe)
    }

    /// B_{t,ρ} as one vector, sign-preserving: `[|ν_s| k + t, |ν_a| k]`. `[001]` Fig. 4, corrected. Where later operators
    /// could let the texture's share cancel (concave surfaces), carry the two apart, as [`Exit`](super::Exit) and
    /// [`Chain`](super::Chain) do.
    #[inline]
    #[must_use]
    pub fn reflect(self, texture: f32, lobe: f32) -> Self {
        let cut = self.band_limit(lobe);
        Self { spatial: cut.spatial + texture.copysign(cut.spatial), ..cut }
    }

    /// Bounds: no signs, nothing above [`UNLIMITED`], no NaN.
    #[inline]
    #[must_use]
    pub fn magnitude(self) -> Self {
        Self::new(bounded(self.spatial), bounded(self.angular))
    }
}

impl Mul<f32> for Bandwidth {
    type Output = Self;
    #[inline]
    fn mul(self, factor: f32) -> Self {
        Self::new(self.spatial * factor, self.angular * factor)
    }
}

impl Add for Bandwidth {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        Self::new(self.spatial + other.spatial, self.angular + other.angular)
    }
}
