//! Reading single texels: what a texture look-up does four times a sample.

use crate::{ColorSpace, RgbImage, Texels, TextureImage, srgb_decode_byte};

/// The linear values of four bytes; alpha is linear in any case.
#[inline]
pub(crate) fn decode_texel(texel: [u8; 4], space: ColorSpace) -> [f32; 4] {
    let share = |byte: u8| f32::from(byte) * (1.0 / 255.0);
    let [r, g, b, a] = texel;
    match space {
        ColorSpace::Srgb => [srgb_decode_byte(r), srgb_decode_byte(g), srgb_decode_byte(b), share(a)],
        ColorSpace::Linear => texel.map(share),
    }
}

impl TextureImage {
    /// Linear red, green, blue, alpha of one texel. Bytes go through a table; nothing is allocated.
    ///
    /// # Panics
    /// If (x, y) lies outside the picture.
    #[inline]
    pub fn texel(&self, x: usize, y: usize) -> [f32; 4] {
        let index = y * self.width + x;
        match &self.texels {
            Texels::Bytes(texels, space) => decode_texel(texels[index], *space),
            Texels::Floats(texels) => texels[index],
        }
    }

    /// Bytes of memory that the texels take.
    pub fn memory_bytes(&self) -> usize {
        match &self.texels {
            Texels::Bytes(texels, _) => texels.len() * 4,
            Texels::Floats(texels) => texels.len() * 16,
        }
    }

    /// The linear colours without alpha.
    pub fn to_rgb(&self) -> RgbImage {
        RgbImage::from_fn(self.width, self.height, |x, y| {
            let [r, g, b, _] = self.texel(x, y);
            [r, g, b]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alpha_is_linear_in_either_space() {
        for (space, red) in [(ColorSpace::Srgb, 0.215_861), (ColorSpace::Linear, 128.0 / 255.0)] {
            let texels = Texels::Bytes(vec![[128; 4]], space);
            let [r, _, _, a] = TextureImage { width: 1, height: 1, texels }.texel(0, 0);
            assert!((r - red).abs() < 1e-6 && (a - 128.0 / 255.0).abs() < 1e-6);
        }
    }
}
