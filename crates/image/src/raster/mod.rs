//! Pictures as PNG, JPEG and TIFF hold them: rows of one to four interleaved channels in the file's own numbers.

mod jpeg_png;
mod tiff;

pub(crate) use self::jpeg_png::{JPEG_ASKED, PNG_ASKED, decode_jpeg, decode_png};
pub(crate) use self::tiff::{GeoTags, TIFF_ASKED, decode_tiff};

use crate::texel::decode_texel;
use crate::{ColorSpace, srgb_decode};

/// A decoded file, before anyone says what its numbers mean.
pub(crate) struct Raster {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Grey, grey and alpha, colour, colour and alpha: one to four.
    pub(crate) channels: usize,
    /// `width * height * channels` of them.
    pub(crate) samples: Samples,
}

/// The numbers of a [`Raster`].
pub(crate) enum Samples {
    /// 0…255 stands for 0…1.
    Bytes(Vec<u8>),
    /// 0…65535 stands for 0…1.
    Words(Vec<u16>),
    /// Linear.
    Floats(Vec<f32>),
    /// Measurements: signed and wide integers and doubles, whose range stands for nothing by itself.
    Numbers(Vec<f64>),
}

impl Raster {
    /// Red, green, blue, alpha of every pixel as the file has them (grey repeated, alpha one if there is none).
    pub(crate) fn rgba<T: Copy>(&self, samples: &[T], one: T) -> Vec<[T; 4]> {
        let pixel = |p: &[T]| match *p {
            [v] => [v, v, v, one],
            [v, a] => [v, v, v, a],
            [r, g, b] => [r, g, b, one],
            [r, g, b, a, ..] => [r, g, b, a],
            [] => [one; 4],
        };
        samples.chunks_exact(self.channels.max(1)).map(pixel).collect()
    }

    /// Linear floats; numbers of limited range go through the sRGB curve if `encoded`. `None` for measurements.
    pub(crate) fn linear(&self, encoded: bool) -> Option<Vec<[f32; 4]>> {
        let color = |[r, g, b, a]: [f32; 4]| {
            if encoded { [srgb_decode(r), srgb_decode(g), srgb_decode(b), a] } else { [r, g, b, a] }
        };
        match &self.samples {
            Samples::Bytes(bytes) => {
                let space = if encoded { ColorSpace::Srgb } else { ColorSpace::Linear };
                Some(self.rgba(bytes, 255).into_iter().map(|texel| decode_texel(texel, space)).collect())
            }
            Samples::Words(words) => {
                let words = self.rgba(words, u16::MAX).into_iter();
                Some(words.map(|pixel| color(pixel.map(|v| f32::from(v) / 65535.0))).collect())
            }
            Samples::Floats(floats) => Some(self.rgba(floats, 1.0)),
            Samples::Numbers(_) => None,
        }
    }

    /// The numbers of the file as they are, of every pixel's channels in turn.
    pub(crate) fn raw(&self) -> Vec<f64> {
        match &self.samples {
            Samples::Bytes(values) => values.iter().map(|&v| v.into()).collect(),
            Samples::Words(values) => values.iter().map(|&v| v.into()).collect(),
            Samples::Floats(values) => values.iter().map(|&v| v.into()).collect(),
            Samples::Numbers(values) => values.clone(),
        }
    }
}
