use std::collections::HashSet;
use std::io::Cursor;

use exr::block::lines::LineRefMut;
use exr::image::write::WritableImage;
use exr::image::write::samples::{SamplesWriter, WritableSamples};
use exr::image::{AnyChannel, AnyChannels, Blocks, Encoding, Image, Layer};
use exr::math::RoundingMode;
use exr::meta::attribute::{AttributeValue, IntegerBounds, LevelMode, LineOrder, SampleType, Text};
use exr::meta::header::{Header, LayerAttributes};
use exr::prelude::{Compression, Vec2};
use half::f16;

use super::Precision;
use crate::{Channel, Picture};

/// Stands before the keys of our metadata, so that none can collide with an attribute the format knows.
pub(super) const PREFIX: &str = "halflight.";

/// Layers whose values need more digits or range than half has: distances, places, counts, squares.
const FLOAT_LAYERS: [&str; 5] = ["depth", "position", "samples", "variance", "material"];

/// OpenEXR's own limit for names.
const LONGEST_NAME: usize = 255;

/// The first pixel of a part within a picture, and the size of that.
pub(super) type Place = ([usize; 2], [usize; 2]);

type ExrImage<'a> = Image<Layer<AnyChannels<Values<'a>>>>;

fn to_exr(picture: &Picture, precision: Precision) -> Result<ExrImage<'_>, String> {
    let Picture { width, height, channels, metadata } = picture;
    if channels.is_empty() || *width == 0 || *height == 0 {
        return Err(format!("nothing to write: {width} × {height} pixels of {} channels", channels.len()));
    }
    let mut names = HashSet::new();
    if let Some(twice) = channels.iter().find(|c| !names.insert(c.name.as_str())) {
        return Err(format!("two channels are called {}", twice.name));
    }
    if let Some(short) = channels.iter().find(|c| c.values.len() != width * height) {
        return Err(format!(
            "channel {} has {} values for {width} × {height} pixels",
            short.name,
            short.values.len()
        ));
    }
    let list = channels
        .iter()
        .map(|channel| Ok(AnyChannel::new(text(&channel.name)?, samples(channel, precision))))
        .collect::<Result<_, String>>()?;
    let mut attributes = LayerAttributes::default();
    for (key, value) in metadata {
        let value = AttributeValue::Text(Text::from_bytes_unchecked(value.bytes().collect()));
        attributes.other.insert(text(&format!("{PREFIX}{key}"))?, value);
    }
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    Ok(Image::from_layer(Layer::new(Vec2(*width, *height), attributes, encoding, AnyChannels::sort(list))))
}

/// The whole file in memory; the same picture gives the same bytes.
pub(super) fn to_bytes(
    picture: &Picture,
    precision: Precision,
    place: Option<Place>,
) -> Result<Vec<u8>, String> {
    let mut image = to_exr(picture, precision)?;
    if let Some((origin, whole)) = place {
        let [x, y] = origin.map(|at| at as i32);
        image.layer_data.attributes.layer_position = Vec2(x, y);
        image.attributes.display_window = IntegerBounds::new(Vec2(0, 0), Vec2(whole[0], whole[1]));
    }
    let mut bytes = Cursor::new(Vec::new());
    image.write().to_buffered(&mut bytes).map_err(|e| e.to_string())?;
    let mut bytes = bytes.into_inner();
    sort_attributes(&mut bytes);
    Ok(bytes)
}

/// Puts the attributes of the header in alphabetical order.
///
/// The crate keeps them in a hash map and writes them in a new order on every run. Attributes may stand in any
/// order, and moving them moves nothing else: the header keeps its length.
fn sort_attributes(bytes: &mut [u8]) {
    // After the magic number and the version: name, 0, type, 0, length, value, and so on to an empty name.
    const START: usize = 8;
    let text_end = |from: usize| Some(from + bytes.get(from..)?.iter().position(|&b| b == 0)?);
    let mut attributes = Vec::new();
    let mut position = START;
    while bytes.get(position).is_some_and(|&b| b != 0) {
        let next = (|| {
            let kind_end = text_end(text_end(position)? + 1)?;
            let length = u32::from_le_bytes(*bytes.get(kind_end + 1..)?.first_chunk()?);
            Some(kind_end + 5 + length as usize).filter(|&end| end <= bytes.len())
        })();
        // Our own file has a whole header; were it otherwise, its order is the least of its troubles.
        let Some(next) = next else { return };
        attributes.push(bytes[position..next].to_vec());
        position = next;
    }
    attributes.sort();
    bytes[START..position].copy_from_slice(&attributes.concat());
}

fn samples(channel: &Channel, precision: Precision) -> Values<'_> {
    let layer = channel.name.split('.').next().unwrap_or_default();
    let half = precision == Precision::Half && !FLOAT_LAYERS.contains(&layer);
    Values { values: &channel.values, half }
}

/// The values of a channel where they are: large pictures are not copied to be written.
struct Values<'a> {
    values: &'a [f32],
    half: bool,
}

/// Values row by row.
struct Rows<'a> {
    values: &'a [f32],
    half: bool,
    width: usize,
}

impl<'a> WritableSamples<'a> for Values<'_> {
    type Writer = Rows<'a>;

    fn sample_type(&self) -> SampleType {
        if self.half { SampleType::F16 } else { SampleType::F32 }
    }

    fn infer_level_modes(&self) -> (LevelMode, RoundingMode) {
        (LevelMode::Singular, RoundingMode::Down)
    }

    fn create_samples_writer(&'a self, header: &Header) -> Rows<'a> {
        Rows { values: self.values, half: self.half, width: header.layer_size.x() }
    }
}

impl SamplesWriter for Rows<'_> {
    fn extract_line(&self, line: LineRefMut<'_>) {
        let start = line.location.position.y() * self.width + line.location.position.x();
        let row = &self.values[start..start + line.location.sample_count];
        let written = if self.half {
            line.write_samples(|i| to_half(row[i]))
        } else {
            line.write_samples_from_slice(row)
        };
        // The crate has made room for just these bytes in memory.
        written.expect("memory takes what it has room for");
    }
}

fn to_half(value: f32) -> f16 {
    let limit = f16::MAX.to_f32();
    f16::from_f32(if value.is_finite() { value.clamp(-limit, limit) } else { value })
}

/// A name, whose bytes are UTF-8 as in every program that writes EXR today.
fn text(name: &str) -> Result<Text, String> {
    if name.is_empty() || name.len() > LONGEST_NAME || name.contains('\0') {
        return Err(format!(
            "{name:?} cannot be a name: it must have 1 to {LONGEST_NAME} bytes, none of them zero"
        ));
    }
    Ok(Text::from_bytes_unchecked(name.bytes().collect()))
}
