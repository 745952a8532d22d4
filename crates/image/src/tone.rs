//! From radiance to the 8-bit picture that a screen shows.

use std::path::Path;

use halflight_file::{SaveError, write_whole};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};

use crate::{RgbImage, hdr, srgb_encode};

/// How radiance becomes display values: `byte = round(255 · curve(radiance · 2^exposure_ev))`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToneMapping {
    /// Exposure in stops: +1 doubles the light.
    pub exposure_ev: f32,
    /// What is done to the exposed values.
    pub curve: ToneCurve,
}

/// The curve from exposed light to display values; each ends with the sRGB encoding.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ToneCurve {
    /// `encode(clamp(x, 0, 1))`: faithful below one, white above.
    #[default]
    Srgb,
    /// `encode(clamp(x (2.51 x + 0.03) / (x (2.43 x + 0.59) + 0.14), 0, 1))`, per channel: a shoulder that keeps
    /// highlights up to about ten times white, a toe that deepens shadows.
    ///
    /// Source: Narkowicz, "ACES Filmic Tone Mapping Curve", 2015, a fit to the ACES reference transform.
    Filmic,
}

impl Default for ToneMapping {
    fn default() -> Self {
        Self { exposure_ev: 0.0, curve: ToneCurve::Srgb }
    }
}

impl ToneMapping {
    /// The display value, 0…1, of one channel. What is not a number becomes black, infinite light white.
    pub fn apply(&self, radiance: f32) -> f32 {
        let x = (radiance * self.exposure_ev.exp2()).max(0.0);
        let x = match self.curve {
            ToneCurve::Srgb => x,
            // Beyond 1e6 the curve is flat, and its terms stay finite below.
            ToneCurve::Filmic => {
                let x = x.min(1e6);
                x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)
            }
        };
        srgb_encode(x.min(1.0))
    }
}

/// The picture as 8-bit display values: red, green, blue of each pixel, rows from the top.
pub fn to_srgb_bytes(image: &RgbImage, mapping: &ToneMapping) -> Vec<u8> {
    image.pixels.as_flattened().iter().map(|&v| (mapping.apply(v) * 255.0 + 0.5) as u8).collect()
}

/// Writes an 8-bit PNG.
///
/// # Errors
/// A picture without pixels, or trouble with the disk.
pub fn save_png(path: &Path, image: &RgbImage, mapping: &ToneMapping) -> Result<(), SaveError> {
    check_pixels(path, image, "PNG picture")?;
    write_whole(path, "PNG picture", |writer| write_png(writer, image, mapping))
}

/// An 8-bit PNG in memory.
///
/// # Errors
/// A picture without pixels, as text.
pub fn encode_png(image: &RgbImage, mapping: &ToneMapping) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    write_png(&mut bytes, image, mapping).map_err(|e| e.to_string())?;
    Ok(bytes)
}

/// Writes sRGB bytes as they are.
pub(crate) fn save_png_bytes(path: &Path, bytes: &[u8], size: [usize; 2]) -> Result<(), SaveError> {
    write_whole(path, "PNG picture", |writer| write_png_bytes(writer, bytes, size))
}

fn write_png(writer: impl std::io::Write, image: &RgbImage, mapping: &ToneMapping) -> std::io::Result<()> {
    write_png_bytes(writer, &to_srgb_bytes(image, mapping), [image.width, image.height])
}

fn write_png_bytes(writer: impl std::io::Write, bytes: &[u8], size: [usize; 2]) -> std::io::Result<()> {
    let encoder = PngEncoder::new_with_quality(writer, CompressionType::Default, FilterType::Adaptive);
    let [width, height] = size.map(|side| side as u32);
    encoder.write_image(bytes, width, height, ExtendedColorType::Rgb8).map_err(|e| match e {
        image::ImageError::IoError(error) => error,
        other => std::io::Error::other(other.to_string()),
    })
}

/// Writes a Radiance HDR file: linear, eight bits of mantissa; negative and non-finite values become zero.
///
/// # Errors
/// A picture without pixels, or trouble with the disk.
pub fn save_hdr(path: &Path, image: &RgbImage) -> Result<(), SaveError> {
    check_pixels(path, image, hdr::ASKED)?;
    write_whole(path, hdr::ASKED, |writer| std::io::Write::write_all(writer, &hdr::encode(image)))
}

/// A Radiance HDR file in memory.
pub fn encode_hdr(image: &RgbImage) -> Vec<u8> {
    hdr::encode(image)
}

fn check_pixels(path: &Path, image: &RgbImage, asked: &str) -> Result<(), SaveError> {
    let RgbImage { width, height, .. } = *image;
    if width > 0 && height > 0 && image.pixels.len() == width * height {
        return Ok(());
    }
    let found = format!("the picture has {} pixels for {width} × {height}", image.pixels.len());
    Err(SaveError { asked: asked.into(), path: path.to_path_buf(), found, hint: None })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_srgb_curve_is_faithful_below_white_and_clips_above() {
        let mapping = ToneMapping::default();
        assert_eq!(mapping.apply(0.18), srgb_encode(0.18));
        assert_eq!([mapping.apply(7.0), mapping.apply(-1.0), mapping.apply(f32::NAN)], [1.0, 0.0, 0.0]);
    }

    #[test]
    fn a_stop_doubles_the_light() {
        let brighter = ToneMapping { exposure_ev: 1.0, ..Default::default() };
        assert!((brighter.apply(0.1) - ToneMapping::default().apply(0.2)).abs() < 1e-6);
    }

    #[test]
    fn the_filmic_curve_rises_everywhere_and_ends_at_white() {
        let mapping = ToneMapping { exposure_ev: 0.0, curve: ToneCurve::Filmic };
        let values: Vec<f32> = (0..400).map(|i| mapping.apply((i as f32 / 20.0 - 10.0).exp2())).collect();
        assert!(values.windows(2).all(|w| w[0] <= w[1]));
        assert_eq!([mapping.apply(0.0), mapping.apply(f32::INFINITY)], [0.0, 1.0]);
    }
}
