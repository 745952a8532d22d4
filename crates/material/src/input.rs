//! Parameters of materials that may vary over a surface.

use std::sync::Arc;

use glam::{Vec2, Vec3};

use crate::footprint::Footprint;
use crate::texture::Texture;

/// Where on a surface a material is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceInput {
    /// Texture coordinates; see [`Texture`] for the convention.
    pub uv: Vec2,
    /// The interpolated vertex colour, linear; it multiplies the colour of the material. White where there is none.
    pub color: Vec3,
}

impl Default for SurfaceInput {
    fn default() -> Self {
        Self { uv: Vec2::ZERO, color: Vec3::ONE }
    }
}

/// A colour: one for the whole surface, or from a picture.
#[derive(Clone, Debug)]
pub enum ColorInput {
    /// The same everywhere, linear Rec. 709.
    Constant(Vec3),
    /// The red, green and blue of a texture.
    Textured {
        /// The picture.
        texture: Arc<Texture>,
        /// Multiplies the picture.
        factor: Vec3,
    },
}

impl ColorInput {
    /// The colour at `uv`.
    pub fn at(&self, uv: Vec2) -> Vec3 {
        match self {
            ColorInput::Constant(color) => *color,
            ColorInput::Textured { texture, factor } => texture.sample(uv).truncate() * *factor,
        }
    }

    /// The mean colour under a footprint about `uv`; the colour there without one.
    #[inline]
    pub fn over(&self, uv: Vec2, footprint: Option<Footprint>) -> Vec3 {
        match (self, footprint) {
            (ColorInput::Textured { texture, factor }, Some(footprint)) => {
                texture.sample_over(uv, footprint).truncate() * *factor
            }
            _ => self.at(uv),
        }
    }

    /// The largest value of each colour over the picture.
    pub(crate) fn most(&self) -> Vec3 {
        match self {
            ColorInput::Constant(color) => *color,
            ColorInput::Textured { texture, factor } => texture.most().truncate() * *factor,
        }
    }

    /// The mean over the picture. Walks the whole picture: for preparation, not for shading.
    pub fn mean(&self) -> Vec3 {
        match self {
            ColorInput::Constant(color) => *color,
            ColorInput::Textured { texture, factor } => texture.mean().truncate() * *factor,
        }
    }
}

impl From<Vec3> for ColorInput {
    fn from(color: Vec3) -> Self {
        ColorInput::Constant(color)
    }
}

/// A number: one for the whole surface, or from one channel of a picture.
#[derive(Clone, Debug)]
pub enum ScalarInput {
    /// The same everywhere.
    Constant(f32),
    /// One channel of a texture.
    Textured {
        /// The picture.
        texture: Arc<Texture>,
        /// 0 red, 1 green, 2 blue, 3 alpha.
        channel: usize,
        /// Multiplies the picture.
        factor: f32,
    },
}

impl ScalarInput {
    /// The value at `uv`.
    pub fn at(&self, uv: Vec2) -> f32 {
        match self {
            ScalarInput::Constant(value) => *value,
            ScalarInput::Textured { texture, channel, factor } => {
                texture.sample(uv).to_array()[(*channel).min(3)] * factor
            }
        }
    }

    /// The value at `uv` as a share, from 0 to 1; 0 where the picture holds nothing usable.
    pub fn share_at(&self, uv: Vec2) -> f32 {
        let value = self.at(uv);
        if value.is_finite() { value.clamp(0.0, 1.0) } else { 0.0 }
    }
}

impl ScalarInput {
    /// The mean value under a footprint about `uv`; the value there without one.
    #[inline]
    pub fn over(&self, uv: Vec2, footprint: Option<Footprint>) -> f32 {
        match (self, footprint) {
            (ScalarInput::Textured { texture, channel, factor }, Some(footprint)) => {
                texture.sample_over(uv, footprint).to_array()[(*channel).min(3)] * factor
            }
            _ => self.at(uv),
        }
    }
}

impl From<f32> for ScalarInput {
    fn from(value: f32) -> Self {
        ScalarInput::Constant(value)
    }
}

/// How much of the light a surface stops; the rest goes straight through, as if it were not there.
#[derive(Clone, Debug)]
pub struct Opacity {
    /// From 0, not there, to 1, solid.
    pub amount: ScalarInput,
    /// With a cutoff the surface is there, wholly, where the amount is at least that, and nowhere else.
    pub cutoff: Option<f32>,
}

impl Opacity {
    /// The part that is stopped at `uv`, from 0 to 1; 1 where the picture holds nothing usable.
    pub fn at(&self, uv: Vec2) -> f32 {
        let amount = self.amount.at(uv);
        match self.cutoff {
            Some(cutoff) if amount < cutoff => 0.0,
            None if amount.is_finite() => amount.clamp(0.0, 1.0),
            _ => 1.0,
        }
    }
}

/// A tangent-space normal map: texel (r, g, b) means the normal (2r − 1, 2g − 1, 2b − 1), +y towards smaller v
/// ("OpenGL" sense, as glTF has it).
#[derive(Clone, Debug)]
pub struct NormalMap {
    /// The picture, in [`Linear`](halflight_image::ColorSpace::Linear) space.
    pub texture: Arc<Texture>,
    /// Multiplies the x and y of the normal.
    pub scale: f32,
}

impl NormalMap {
    /// The unit normal at `uv` in the tangent frame; +z where the picture holds nothing usable.
    pub fn at(&self, uv: Vec2) -> Vec3 {
        let texel = self.texture.sample(uv).truncate();
        let normal = (texel * 2.0 - Vec3::ONE) * Vec3::new(self.scale, self.scale, 1.0);
        match normal.try_normalize() {
            Some(unit) if unit.z > 0.0 => unit,
            _ => Vec3::Z,
        }
    }

    /// The mean normal under a footprint, and the variance of slopes about it that the footprint holds, per axis: the mean of
    /// unit normals that lean by variance s² is 1/(1 + s²) long (Toksvig 2005).
    pub fn over(&self, uv: Vec2, footprint: Footprint) -> (Vec3, f32) {
        let texel = self.texture.sample_over(uv, footprint).truncate();
        let normal = texel * 2.0 - Vec3::ONE;
        let length = normal.length();
        let variance = if length > 0.0 && length < 1.0 { (1.0 - length) / length } else { 0.0 };
        let scaled = normal * Vec3::new(self.scale, self.scale, 1.0);
        match scaled.try_normalize() {
            Some(unit) if unit.z > 0.0 => (unit, (variance * self.scale * self.scale).min(1.0)),
            _ => (Vec3::Z, 0.0),
        }
    }
}
