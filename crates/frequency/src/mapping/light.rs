//! Spatial bandwidth of planar lights.

use glam::Vec2;
use halflight_image::Plane;

use super::max_pyramid::MaxPyramid;
use crate::wavelet::{Border, Filter, Pyramid, Rule, padded_local_bandwidth, polygon_mask, whole_bandwidth};

/// Cycles per metre around every point of a planar light, its edges included.
#[derive(Clone, Debug, PartialEq)]
pub struct LightBandwidth {
    map: MaxPyramid,
    whole: f32,
}

impl LightBandwidth {
    /// From its emission as a picture, dark where the light is not, and the size of a texel. A light of zero size or
    /// without light has bandwidth zero.
    #[must_use]
    pub fn new(emission: &Plane, metres_per_texel: Vec2, filter: Filter, rule: Rule) -> Self {
        let sized = metres_per_texel.is_finite() && metres_per_texel.min_element() > 0.0;
        let texel = if sized { metres_per_texel } else { Vec2::ZERO };
        let map = MaxPyramid::new(padded_local_bandwidth(emission, filter, rule, texel), [false; 2]);
        let whole = if sized {
            whole_bandwidth(&Pyramid::new(emission, filter, Border::Repeat), rule) / texel.min_element()
        } else {
            0.0
        };
        Self { map, whole }
    }

    /// A plain light: any flat polygon, its corners in its plane, in metres.
    #[must_use]
    pub fn polygon(corners: &[Vec2], resolution: usize, filter: Filter, rule: Rule) -> Self {
        let (mask, texel) = polygon_mask(corners, resolution);
        Self::new(&mask, texel, filter, rule)
    }

    /// The map over the light, cycles per metre.
    #[must_use]
    pub fn map(&self) -> &MaxPyramid {
        &self.map
    }

    /// Around the point (u, v) in 0..1 of the light's picture, cycles per metre.
    #[inline]
    #[must_use]
    pub fn at(&self, uv: Vec2) -> f32 {
        self.map.at(uv.x, uv.y)
    }

    /// One number for the texture of the light, cycles per metre, without its edges.
    #[must_use]
    pub fn whole(&self) -> f32 {
        self.whole
    }
}
