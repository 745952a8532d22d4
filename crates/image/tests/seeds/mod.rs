//! Small valid files of every format, made here; the tests and the fuzzers start from them.
#![allow(dead_code, missing_docs, clippy::unwrap_used)]

use std::io::Cursor;
use std::path::{Path, PathBuf};

use exr::image::{AnyChannel, AnyChannels, Blocks, Encoding, FlatSamples, Image, Layer};
use exr::meta::attribute::{IntegerBounds, LineOrder};
use exr::meta::header::{ImageAttributes, LayerAttributes};
use exr::prelude::{Compression, Vec2, WritableImage};
use half::f16;
use halflight_image::{
    ColorSpace, Picture, Precision, RgbImage, ToneMapping, decode_height, decode_rgb, decode_texture,
    encode_hdr, encode_png,
};
use image::codecs::{jpeg::JpegEncoder, png::PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use tiff::encoder::{TiffEncoder, colortype};
use tiff::tags::Tag;

/// A file in memory: the fuzz target that it belongs to, and its name.
pub(crate) struct Seed {
    pub(crate) target: &'static str,
    pub(crate) name: &'static str,
    pub(crate) bytes: Vec<u8>,
}

pub(crate) const FORMATS: [&str; 5] = ["image_exr", "image_hdr", "image_png", "image_jpeg", "image_tiff"];

/// What every fuzz target of this crate does with its bytes: whatever comes out must be finite and of one size.
pub(crate) fn drive(bytes: &[u8]) {
    let name = Path::new("seed");
    let _ = Picture::decode_exr(bytes, name);
    if let Ok(image) = decode_rgb(bytes, name) {
        assert_eq!(image.pixels.len(), image.width * image.height);
        assert!(image.pixels.as_flattened().iter().all(|v| v.is_finite()));
    }
    let _ = decode_texture(bytes, name, ColorSpace::Srgb);
    if let Ok(height) = decode_height(bytes, name) {
        assert!(height.plane.values.iter().all(|v| v.is_finite()));
    }
}

pub(crate) fn all() -> Vec<Seed> {
    let seed = |target, name, bytes| Seed { target, name, bytes };
    vec![
        seed("image_exr", "layers_float.exr", layered().encode_exr(Precision::Float).unwrap()),
        seed("image_exr", "layers_half.exr", layered().encode_exr(Precision::Half).unwrap()),
        seed("image_exr", "tiles_piz.exr", exr_with(Compression::PIZ, tiles(), &["B", "G", "R"])),
        seed("image_exr", "lines_rle.exr", exr_with(Compression::RLE, Blocks::ScanLines, &["B", "G", "R"])),
        seed("image_exr", "lines_pxr24.exr", exr_with(Compression::PXR24, Blocks::ScanLines, &["Y"])),
        seed("image_exr", "lines_b44.exr", exr_with(Compression::B44, Blocks::ScanLines, &["Y"])),
        seed("image_exr", "plain.exr", exr_with(Compression::Uncompressed, Blocks::ScanLines, &["A", "Y"])),
        seed("image_exr", "windows.exr", exr_windows()),
        seed("image_exr", "parts.exr", exr_parts()),
        seed("image_hdr", "runs.hdr", encode_hdr(&picture(17, 5))),
        seed("image_hdr", "flat.hdr", encode_hdr(&picture(5, 3))),
        seed("image_hdr", "old_runs_turned.hdr", hdr_old()),
        seed("image_png", "rgb8.png", encode_png(&picture(9, 7), &ToneMapping::default()).unwrap()),
        seed("image_png", "gray16.png", png(ExtendedColorType::L16, 2)),
        seed("image_png", "rgba16.png", png(ExtendedColorType::Rgba16, 8)),
        seed("image_png", "gray_alpha8.png", png(ExtendedColorType::La8, 2)),
        seed("image_jpeg", "rgb.jpg", jpeg(ExtendedColorType::Rgb8, 3)),
        seed("image_jpeg", "gray.jpg", jpeg(ExtendedColorType::L8, 1)),
        seed("image_tiff", "elevation.tif", elevation(12, 9)),
        seed("image_tiff", "float_lzw.tif", tiff_float()),
        seed("image_tiff", "rgb8_deflate.tif", tiff_rgb8()),
        seed("image_tiff", "gray16_big.tif", tiff_gray16_big()),
    ]
}

/// Smooth, with a bright spot and repeated pixels.
pub(crate) fn picture(width: usize, height: usize) -> RgbImage {
    RgbImage::from_fn(width, height, |x, y| {
        if (x, y) == (2, 1) { [900.0, 450.0, 0.25] } else { [0.1 * (x / 4) as f32, 0.05 * y as f32, 0.5] }
    })
}

pub(crate) fn layered() -> Picture {
    let (width, height) = (7, 5);
    let mut picture = Picture::new(width, height);
    let ramp = |scale: f32| (0..width * height).map(|i| i as f32 * scale).collect::<Vec<f32>>();
    for (name, scale) in
        [("R", 0.1), ("G", 0.2), ("B", 0.3), ("A", 0.01), ("depth.Z", 1000.1), ("normal.X", 0.03)]
    {
        picture.push(name, ramp(scale));
    }
    picture.push("material.id", ramp(4097.0));
    picture.push("samples", ramp(3001.0));
    picture.metadata.insert("command".into(), "render Zürich.toml -o 図.exr".into());
    picture.metadata.insert("type".into(), "a key that the format uses itself".into());
    picture
}

fn tiles() -> Blocks {
    Blocks::Tiles(Vec2(4, 4))
}

/// Half-float channels, 9 × 6.
fn exr_with(compression: Compression, blocks: Blocks, channels: &[&str]) -> Vec<u8> {
    let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
    let layer = Layer::new((9, 6), LayerAttributes::default(), encoding, any(channels, 54));
    to_bytes(&Image::from_layer(layer))
}

fn any(names: &[&str], count: usize) -> AnyChannels<FlatSamples> {
    let samples = |k: usize| {
        FlatSamples::F16((0..count).map(|i| f16::from_f32((i * (k + 1)) as f32 * 0.125)).collect())
    };
    AnyChannels::sort(names.iter().enumerate().map(|(k, &name)| AnyChannel::new(name, samples(k))).collect())
}

fn to_bytes<'a, L>(image: &'a Image<L>) -> Vec<u8>
where
    L: exr::image::write::layers::WritableLayers<'a>,
{
    let mut bytes = Cursor::new(Vec::new());
    image.write().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

/// A data window of 3 × 2 at (2, 1) in a display window of 6 × 4 at (1, 1), whose pixels count from zero by 1/8.
fn exr_windows() -> Vec<u8> {
    let attributes = LayerAttributes::default().with_position(Vec2(2, 1));
    let encoding = Encoding {
        compression: Compression::ZIP1,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let layer = Layer::new((3, 2), attributes, encoding, any(&["Y"], 6));
    let mut image = Image::from_layer(layer);
    image.attributes = ImageAttributes::new(IntegerBounds::new((1, 1), (6, 4)));
    to_bytes(&image)
}

/// Parts: depth alone, then colour, then a smaller one.
fn exr_parts() -> Vec<u8> {
    let part = |name: &str, size: (usize, usize), channels: AnyChannels<FlatSamples>| {
        let encoding = Encoding {
            compression: Compression::ZIP16,
            blocks: Blocks::ScanLines,
            line_order: LineOrder::Increasing,
        };
        Layer::new(size, LayerAttributes::named(name), encoding, channels)
    };
    let ids = FlatSamples::U32((0..20).collect());
    let ids = AnyChannels::sort(std::iter::once(AnyChannel::new("id", ids)).collect());
    let mut layers = exr::image::Layers::new();
    layers.push(part("depth", (5, 4), any(&["Z"], 20)));
    layers.push(part("beauty", (5, 4), any(&["B", "G", "R"], 20)));
    layers.push(part("objects", (5, 4), ids));
    layers.push(part("thumbnail", (2, 2), any(&["B", "G", "R"], 4)));
    to_bytes(&Image::from_layers(ImageAttributes::with_size((5, 4)), layers))
}

fn hdr_old() -> Vec<u8> {
    let mut bytes =
        b"#?RGBE\nVIEW= -vtv -vp 0 0 0\nan odd line\nFORMAT=32-bit_rle_rgbe\n\n+X 3 -Y 20\n".to_vec();
    for _ in 0..3 {
        bytes.extend([[90, 80, 70, 129], [1, 1, 1, 18], [200, 100, 50, 128]].as_flattened());
    }
    bytes
}

fn png(color: ExtendedColorType, bytes_per_pixel: usize) -> Vec<u8> {
    let data: Vec<u8> = (0..6 * 4 * bytes_per_pixel).map(|i| (i * 7) as u8).collect();
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes).write_image(&data, 6, 4, color).unwrap();
    bytes
}

fn jpeg(color: ExtendedColorType, channels: usize) -> Vec<u8> {
    let data: Vec<u8> = (0..20 * 12 * channels).map(|i| (i / channels * 3) as u8).collect();
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, 95).write_image(&data, 20, 12, color).unwrap();
    bytes
}

/// An elevation GeoTIFF in UTM, 30 m, of the plane 100 + 3 x − 2 y with a declared void of −9999 in its middle and
/// one of −32768 in a corner.
pub(crate) fn elevation(width: usize, height: usize) -> Vec<u8> {
    let at = |i: usize| match (i % width, i / width) {
        (0, 0) => -32768,
        (x, y) if x == width / 2 && y == height / 2 => -9999,
        (x, y) => 100 + 3 * x as i16 - 2 * y as i16,
    };
    let heights: Vec<i16> = (0..width * height).map(at).collect();
    let mut bytes = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut bytes).unwrap();
    let mut image = encoder.new_image::<colortype::GrayI16>(width as u32, height as u32).unwrap();
    let tags = image.encoder();
    tags.write_tag(Tag::from_u16_exhaustive(33550), &[30.0_f64, 30.0, 0.0][..]).unwrap();
    tags.write_tag(Tag::from_u16_exhaustive(33922), &[0.0_f64, 0.0, 0.0, 4e5, 3.8e6, 0.0][..]).unwrap();
    tags.write_tag(Tag::from_u16_exhaustive(34735), &[1_u16, 1, 0, 1, 1024, 0, 1, 1][..]).unwrap();
    tags.write_tag(Tag::from_u16_exhaustive(42113), "-9999").unwrap();
    image.write_data(&heights).unwrap();
    bytes.into_inner()
}

pub(crate) fn tiff_floats(values: &[f32], width: u32, height: u32) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    TiffEncoder::new(&mut bytes)
        .unwrap()
        .write_image::<colortype::Gray32Float>(width, height, values)
        .unwrap();
    bytes.into_inner()
}

fn tiff_float() -> Vec<u8> {
    let values: Vec<f32> = (0..24 * 3).map(|i| i as f32 * 0.5 - 3.0).collect();
    let mut bytes = Cursor::new(Vec::new());
    let encoder = TiffEncoder::new(&mut bytes).unwrap().with_compression(tiff::encoder::Compression::Lzw);
    let mut encoder = encoder.with_predictor(tiff::tags::Predictor::None);
    encoder.write_image::<colortype::RGB32Float>(6, 4, &values).unwrap();
    bytes.into_inner()
}

fn tiff_rgb8() -> Vec<u8> {
    let values: Vec<u8> = (0..24 * 3).map(|i| i * 3).collect();
    let mut bytes = Cursor::new(Vec::new());
    let compression = tiff::encoder::Compression::Deflate(tiff::encoder::DeflateLevel::Balanced);
    let encoder = TiffEncoder::new(&mut bytes).unwrap().with_compression(compression);
    let mut encoder = encoder.with_predictor(tiff::tags::Predictor::Horizontal);
    encoder.write_image::<colortype::RGB8>(6, 4, &values).unwrap();
    bytes.into_inner()
}

fn tiff_gray16_big() -> Vec<u8> {
    let values: Vec<u16> = (0..24).map(|i| i * 2000).collect();
    let mut bytes = Cursor::new(Vec::new());
    TiffEncoder::new_big(&mut bytes).unwrap().write_image::<colortype::Gray16>(6, 4, &values).unwrap();
    bytes.into_inner()
}

/// A folder of the data that is shared beside the project, or none.
pub(crate) fn shared(file: &str) -> Option<PathBuf> {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data")).join(file);
    if path.exists() {
        return Some(path);
    }
    eprintln!("skipped: {} is not here", path.display());
    None
}

/// A sequence that is the same on every run (PCG's output function over a Weyl sequence).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn below(&mut self, bound: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((mixed ^ (mixed >> 31)) % bound.max(1) as u64) as usize
    }
}
