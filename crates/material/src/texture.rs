//! Pictures on surfaces.
//!
//! **Convention**: (0, 0) is the top left corner of the picture and v grows downwards, as in glTF (loaders of
//! formats whose v grows upwards turn it). Texel (i, j) has its centre at ((i + ½)/W, (j + ½)/H); values between
//! centres are bilinear **in linear light**: sRGB bytes are decoded before they are mixed.

use std::sync::{Arc, LazyLock};

use glam::{Vec2, Vec4};
use halflight_image::{ColorSpace, Texels, TextureImage};

use crate::footprint::Levels;

/// What a texture shows beyond its borders.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The picture again.
    #[default]
    Repeat,
    /// The nearest texel of the border.
    Clamp,
    /// The picture turned over, then again as it was.
    Mirror,
}

/// A change of texture coordinates before the look-up: `p = offset + rotate(scale · uv)`, in the order and with
/// the sense of rotation of glTF's `KHR_texture_transform`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UvTransform {
    /// Added last, in units of the picture.
    pub offset: Vec2,
    /// Counter-clockwise rotation of the coordinates about (0, 0), in radians.
    pub rotation: f32,
    /// Multiplied first.
    pub scale: Vec2,
}

impl Default for UvTransform {
    fn default() -> Self {
        Self { offset: Vec2::ZERO, rotation: 0.0, scale: Vec2::ONE }
    }
}

impl UvTransform {
    /// The transformed coordinates.
    pub fn apply(&self, uv: Vec2) -> Vec2 {
        let p = uv * self.scale;
        if self.rotation == 0.0 {
            return p + self.offset;
        }
        // KHR_texture_transform: the matrix [cos sin; −sin cos] with v growing downwards.
        let (sin, cos) = self.rotation.sin_cos();
        Vec2::new(cos * p.x + sin * p.y, cos * p.y - sin * p.x) + self.offset
    }
}

/// A picture and how it lies on a surface.
#[derive(Clone, Debug)]
pub struct Texture {
    /// The texels.
    pub image: Arc<TextureImage>,
    /// What is seen beyond the left and right border.
    pub wrap_u: Wrap,
    /// What is seen beyond the upper and lower border.
    pub wrap_v: Wrap,
    /// Applied to the coordinates first.
    pub transform: UvTransform,
    /// Shows texels as squares of one value instead of mixing neighbours.
    pub nearest: bool,
    /// Smaller versions, for footprints.
    pub levels: Levels,
}

impl Texture {
    /// A texture that repeats, without a transform.
    pub fn new(image: Arc<TextureImage>) -> Self {
        Self {
            image,
            wrap_u: Wrap::Repeat,
            wrap_v: Wrap::Repeat,
            transform: UvTransform::default(),
            nearest: false,
            levels: Levels::default(),
        }
    }

    /// The linear red, green, blue, alpha at `uv`; zero if the picture is empty or `uv` is not finite.
    pub fn sample(&self, uv: Vec2) -> Vec4 {
        let (width, height) = (self.image.width, self.image.height);
        let uv = self.transform.apply(uv);
        if !uv.is_finite() || width == 0 || height == 0 {
            return Vec4::ZERO;
        }
        self.bilinear(uv, width, height, |x, y| self.texel(x, y))
    }

    /// Between the four texels about a place, given after the transform, of a picture or a smaller version of it.
    #[inline]
    pub(crate) fn bilinear(
        &self,
        at: Vec2,
        width: usize,
        height: usize,
        texel: impl Fn(usize, usize) -> Vec4,
    ) -> Vec4 {
        let (x0, x1, mut fx) = bracket(at.x, width, self.wrap_u);
        let (y0, y1, mut fy) = bracket(at.y, height, self.wrap_v);
        if self.nearest {
            (fx, fy) = (fx.round(), fy.round());
        }
        let upper = texel(x0, y0).lerp(texel(x1, y0), fx);
        let lower = texel(x0, y1).lerp(texel(x1, y1), fx);
        upper.lerp(lower, fy)
    }

    /// The mean of all texels, linear. Walks the whole picture.
    pub fn mean(&self) -> Vec4 {
        let (width, height) = (self.image.width, self.image.height);
        let mut sum = glam::DVec4::ZERO;
        for y in 0..height {
            for x in 0..width {
                sum += self.texel(x, y).as_dvec4();
            }
        }
        (sum / (width * height).max(1) as f64).as_vec4()
    }

    pub(crate) fn texel(&self, x: usize, y: usize) -> Vec4 {
        let index = y * self.image.width + x;
        match &self.image.texels {
            Texels::Floats(values) => Vec4::from_array(values[index]),
            Texels::Bytes(values, space) => {
                let [r, g, b, a] = values[index].map(usize::from);
                let table = match space {
                    ColorSpace::Srgb => &BYTES.srgb,
                    ColorSpace::Linear => &BYTES.linear,
                };
                Vec4::new(table[r], table[g], table[b], BYTES.linear[a])
            }
        }
    }
}

/// The two texels around a coordinate and how far it lies towards the second.
fn bracket(coordinate: f32, size: usize, wrap: Wrap) -> (usize, usize, f32) {
    // Reduced to a few periods first, so that a coordinate of any magnitude stays an exact index.
    let reduced = match wrap {
        Wrap::Repeat => coordinate.rem_euclid(1.0),
        Wrap::Clamp => coordinate.clamp(0.0, 1.0),
        Wrap::Mirror => coordinate.rem_euclid(2.0),
    };
    let position = reduced * size as f32 - 0.5;
    let floor = position.floor();
    let (first, size) = (floor as i64, size as i64);
    let fold = |i: i64| match wrap {
        Wrap::Repeat => i.rem_euclid(size),
        Wrap::Clamp => i.clamp(0, size - 1),
        Wrap::Mirror => {
            let i = i.rem_euclid(2 * size);
            if i < size { i } else { 2 * size - 1 - i }
        }
    };
    (fold(first) as usize, fold(first + 1) as usize, position - floor)
}

struct ByteTables {
    srgb: [f32; 256],
    linear: [f32; 256],
}

/// IEC 61966-2-1, decoded once.
static BYTES: LazyLock<ByteTables> = LazyLock::new(|| {
    let decode = |v: f64| if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) };
    ByteTables {
        srgb: std::array::from_fn(|i| decode(i as f64 / 255.0) as f32),
        linear: std::array::from_fn(|i| (i as f64 / 255.0) as f32),
    }
});
