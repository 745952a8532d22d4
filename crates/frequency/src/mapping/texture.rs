//! Spatial bandwidth of textures on surfaces.

use glam::{Vec2, Vec3};
use halflight_image::Plane;

use super::max_pyramid::MaxPyramid;
use crate::bandwidth::{UNLIMITED, bounded};
use crate::wavelet::{Border, Filter, Pyramid, Rule, local_bandwidth};

/// Cycles per texel around every texel, with the largest of larger regions above it.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureBandwidth {
    map: MaxPyramid,
}

impl TextureBandwidth {
    /// Analyses the luminance of a texture; `repeats` says whether it tiles.
    #[must_use]
    pub fn new(luminance: &Plane, filter: Filter, rule: Rule, repeats: bool) -> Self {
        let border = if repeats { Border::Wrap } else { Border::Repeat };
        let pyramid = Pyramid::new(luminance, filter, border);
        Self { map: MaxPyramid::new(local_bandwidth(&pyramid, rule, |_, _| Vec2::ONE), [repeats; 2]) }
    }

    /// The map in cycles per texel.
    #[must_use]
    pub fn map(&self) -> &MaxPyramid {
        &self.map
    }

    /// Cycles per metre along the surface at `uv`, where position changes by `dp_du` and `dp_dv` metres per unit of u and v;
    /// the largest within a footprint of `footprint` in uv (zero: of the texel). Where the mapping has collapsed,
    /// [`UNLIMITED`] unless the texture is constant there.
    #[must_use]
    pub fn on_surface(&self, uv: Vec2, footprint: Vec2, dp_du: Vec3, dp_dv: Vec3) -> f32 {
        let per_texel = if footprint == Vec2::ZERO {
            self.map.at(uv.x, uv.y)
        } else {
            self.map.within(uv.x, uv.y, footprint.x, footprint.y)
        };
        if per_texel == 0.0 {
            return 0.0;
        }
        let finest = self.map.finest();
        let smallest = smallest_stretch(dp_du / finest.width as f32, dp_dv / finest.height as f32);
        // A texel of no size shows every frequency; NaN is as good as that.
        if smallest > 0.0 { bounded(per_texel / smallest) } else { UNLIMITED }
    }
}

/// The smaller singular value of a map from texels to space, by the eigenvalues of its first fundamental form.
fn smallest_stretch(across: Vec3, down: Vec3) -> f32 {
    let (e, f, g) = (across.length_squared(), across.dot(down), down.length_squared());
    let half = 0.5 * (e + g);
    let root = (0.25 * (e - g) * (e - g) + f * f).sqrt();
    // The product of both is the squared area: dividing it by the larger keeps digits that half − root would lose.
    let area = across.cross(down).length_squared();
    (area / (half + root)).sqrt()
}
