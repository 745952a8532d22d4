use std::io::Cursor;

use halflight_file::LoadError;
use image::codecs::{jpeg::JpegDecoder, png::PngDecoder};
use image::{ColorType, ImageDecoder, ImageResult};

use super::{Raster, Samples};
use crate::source::{DEFLATE_RATIO, Source};

pub(crate) const PNG_ASKED: &str = "PNG picture";
pub(crate) const JPEG_ASKED: &str = "JPEG picture";

/// PNG of any kind: palettes, low bit depths and transparent colours are expanded. Gamma and colour profiles are
/// not applied.
pub(crate) fn decode_png(source: &Source) -> Result<Raster, LoadError> {
    source.guarded(|| decode(source, PngDecoder::new(Cursor::new(source.bytes))))
}

/// Baseline and progressive JPEG, grey, YCbCr or CMYK, as 8-bit grey or RGB.
pub(crate) fn decode_jpeg(source: &Source) -> Result<Raster, LoadError> {
    source.guarded(|| decode(source, JpegDecoder::new(Cursor::new(source.bytes))))
}

fn decode<D: ImageDecoder>(source: &Source, decoder: ImageResult<D>) -> Result<Raster, LoadError> {
    let damaged = |e: image::ImageError| source.error(e.to_string());
    let decoder = decoder.map_err(damaged)?;
    let (width, height) = decoder.dimensions();
    let color = decoder.color_type();
    source.check_size([width.into(), height.into()], color.bytes_per_pixel().into(), DEFLATE_RATIO)?;
    let mut bytes = vec![0; width as usize * height as usize * usize::from(color.bytes_per_pixel())];
    decoder.read_image(&mut bytes).map_err(damaged)?;
    let samples = match color {
        ColorType::L8 | ColorType::La8 | ColorType::Rgb8 | ColorType::Rgba8 => Samples::Bytes(bytes),
        ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16 => {
            Samples::Words(bytes.as_chunks::<2>().0.iter().map(|&b| u16::from_ne_bytes(b)).collect())
        }
        other => return Err(source.error(format!("pixels of an unknown kind, {other:?}"))),
    };
    Ok(Raster {
        width: width as usize,
        height: height as usize,
        channels: usize::from(color.channel_count()),
        samples,
    })
}
