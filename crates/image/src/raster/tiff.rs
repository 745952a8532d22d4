use std::io::Cursor;

use halflight_file::LoadError;
use tiff::ColorType;
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::tags::{CompressionMethod, PlanarConfiguration, Tag};

use super::{Raster, Samples};
use crate::source::{DEFLATE_RATIO, Source};

pub(crate) const TIFF_ASKED: &str = "TIFF picture";

/// The most that LZW packs: its longest string, 4096 bytes, in a code of twelve bits.
const LZW_RATIO: u64 = 2731;

/// PackBits repeats a byte 128 times in two bytes.
const PACKBITS_RATIO: u64 = 64;

const GDAL_NODATA: u16 = 42113;
const MODEL_PIXEL_SCALE: u16 = 33550;
const MODEL_TIEPOINT: u16 = 33922;
const MODEL_TRANSFORMATION: u16 = 34264;
const GEO_KEY_DIRECTORY: u16 = 34735;

/// What a GeoTIFF says about its pixels, as it says it.
#[derive(Default)]
pub(crate) struct GeoTags {
    /// The number, as text, that stands for "nothing measured here".
    pub(crate) void: Option<String>,
    pub(crate) pixel_scale: Vec<f64>,
    pub(crate) tiepoint: Vec<f64>,
    pub(crate) transformation: Vec<f64>,
    pub(crate) keys: Vec<u64>,
}

/// The first picture of a TIFF or BigTIFF: grey or RGB, with or without alpha, 8 to 64 bits, integer or float,
/// strips or tiles, interleaved or in planes.
pub(crate) fn decode_tiff(source: &Source) -> Result<(Raster, GeoTags), LoadError> {
    source.guarded(|| decode(source))
}

fn decode(source: &Source) -> Result<(Raster, GeoTags), LoadError> {
    let damaged = |e: tiff::TiffError| match &e {
        tiff::TiffError::IoError(io) if io.kind() == std::io::ErrorKind::UnexpectedEof => source.cut_short(),
        _ => source.error(e.to_string()),
    };
    let mut decoder = Decoder::new(Cursor::new(source.bytes)).map_err(damaged)?;
    let (width, height) = decoder.dimensions().map_err(damaged)?;
    let color = decoder.colortype().map_err(damaged)?;
    let channels = channels(source, color)?;
    let depth = u64::from(color.bit_depth());
    if !matches!(depth, 8 | 16 | 32 | 64) {
        return Err(source.error(format!("{depth} bits a sample; 8, 16, 32 and 64 are supported")));
    }
    let packing = decoder.find_tag_unsigned::<u16>(Tag::Compression).map_err(damaged)?;
    let ratio = match packing.map(CompressionMethod::from_u16_exhaustive) {
        None | Some(CompressionMethod::None) => 1,
        Some(CompressionMethod::PackBits) => PACKBITS_RATIO,
        Some(CompressionMethod::LZW) => LZW_RATIO,
        Some(_) => DEFLATE_RATIO,
    };
    let sample_bytes = depth / 8;
    source.check_size([width.into(), height.into()], sample_bytes * channels as u64, ratio)?;
    // A tile or strip is decoded whole, even where it hangs over the edge of the picture.
    let (block_width, block_height) = decoder.chunk_dimensions();
    let block_height = u64::from(block_height).min(u64::from(height).next_multiple_of(1 << 12));
    source.check_size([block_width.into(), block_height], sample_bytes * channels as u64, ratio)?;

    let total = width as usize * height as usize * channels;
    let mut limits = Limits::default();
    // Also the limit for the values of a tag, for which the default is right.
    limits.decoding_buffer_size = limits.decoding_buffer_size.max(total * sample_bytes as usize);
    limits.intermediate_buffer_size = limits.intermediate_buffer_size.max(source.bytes.len());
    let mut decoder = decoder.with_limits(limits);
    let planar = decoder.find_tag_unsigned::<u16>(Tag::PlanarConfiguration).map_err(damaged)?
        == Some(PlanarConfiguration::Planar.to_u16())
        && channels > 1;
    let mut decoded = DecodingResult::U8(Vec::new());
    decoder.read_image_to_buffer(&mut decoded).map_err(damaged)?;
    let samples = samples(decoded, if planar { channels } else { 1 });
    if samples.len() != total {
        return Err(source.error(format!("{} samples where {total} belong", samples.len())));
    }
    let raster = Raster { width: width as usize, height: height as usize, channels, samples };
    Ok((raster, geo_tags(&mut decoder)))
}

fn channels(source: &Source, color: ColorType) -> Result<usize, LoadError> {
    match color {
        ColorType::Gray(_) => Ok(1),
        ColorType::GrayA(_) => Ok(2),
        ColorType::RGB(_) => Ok(3),
        ColorType::YCbCr(_) => Ok(3),
        ColorType::RGBA(_) => Ok(4),
        ColorType::Multiband { num_samples: n @ 1..=4, .. } => Ok(usize::from(n)),
        other => Err(source
            .error(format!("colours as {other:?} are not supported"))
            .hint("save it as RGB or grey")),
    }
}

impl Samples {
    fn len(&self) -> usize {
        match self {
            Samples::Bytes(values) => values.len(),
            Samples::Words(values) => values.len(),
            Samples::Floats(values) => values.len(),
            Samples::Numbers(values) => values.len(),
        }
    }
}

fn samples(decoded: DecodingResult, planes: usize) -> Samples {
    fn each<T: Copy, U>(values: Vec<T>, planes: usize, convert: impl Fn(T) -> U) -> Vec<U> {
        let pixels = values.len() / planes;
        // Planes stand one after another; the others are one plane.
        (0..pixels)
            .flat_map(|i| (0..planes).map(move |p| (i, p)))
            .map(|(i, p)| convert(values[p * pixels + i]))
            .collect()
    }
    match decoded {
        DecodingResult::U8(values) => Samples::Bytes(each(values, planes, |v| v)),
        DecodingResult::U16(values) => Samples::Words(each(values, planes, |v| v)),
        DecodingResult::F16(values) => Samples::Floats(each(values, planes, half::f16::to_f32)),
        DecodingResult::F32(values) => Samples::Floats(each(values, planes, |v| v)),
        DecodingResult::F64(values) => Samples::Numbers(each(values, planes, |v| v)),
        DecodingResult::I8(values) => Samples::Numbers(each(values, planes, f64::from)),
        DecodingResult::I16(values) => Samples::Numbers(each(values, planes, f64::from)),
        DecodingResult::I32(values) => Samples::Numbers(each(values, planes, f64::from)),
        DecodingResult::U32(values) => Samples::Numbers(each(values, planes, f64::from)),
        DecodingResult::I64(values) => Samples::Numbers(each(values, planes, |v| v as f64)),
        DecodingResult::U64(values) => Samples::Numbers(each(values, planes, |v| v as f64)),
    }
}

/// Tags that are absent, or not what they should be, are as good as none: the pixels do not depend on them.
fn geo_tags(decoder: &mut Decoder<Cursor<&[u8]>>) -> GeoTags {
    let mut doubles = |tag| decoder.get_tag_f64_vec(Tag::from_u16_exhaustive(tag)).unwrap_or_default();
    let pixel_scale = doubles(MODEL_PIXEL_SCALE);
    let tiepoint = doubles(MODEL_TIEPOINT);
    let transformation = doubles(MODEL_TRANSFORMATION);
    let keys = decoder.get_tag_u64_vec(Tag::from_u16_exhaustive(GEO_KEY_DIRECTORY)).unwrap_or_default();
    let void = decoder.get_tag_ascii_string(Tag::from_u16_exhaustive(GDAL_NODATA)).ok();
    GeoTags { void, pixel_scale, tiepoint, transformation, keys }
}
