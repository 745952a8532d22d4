use std::collections::HashSet;
use std::io::{self, Seek, Write};

use exr::image::{
    AnyChannel, AnyChannels, Blocks, Encoding, FlatSamples, Image, Layer, write::WritableImage,
};
use exr::meta::attribute::{AttributeValue, LineOrder, Text};
use exr::meta::header::LayerAttributes;
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

pub(super) type FlatImage = Image<Layer<AnyChannels<FlatSamples>>>;

pub(super) fn to_exr(picture: &Picture, precision: Precision) -> Result<FlatImage, String> {
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

pub(super) fn write(image: &FlatImage, writer: impl Write + Seek) -> io::Result<()> {
    image.write().to_buffered(writer).map_err(|e| match e {
        // Kept whole, because its kind tells a full disk from a missing folder.
        exr::error::Error::Io(error) => error,
        other => io::Error::other(other.to_string()),
    })
}

fn samples(channel: &Channel, precision: Precision) -> FlatSamples {
    let layer = channel.name.split('.').next().unwrap_or_default();
    if precision == Precision::Float || FLOAT_LAYERS.contains(&layer) {
        FlatSamples::F32(channel.values.clone())
    } else {
        FlatSamples::F16(channel.values.iter().map(|&value| to_half(value)).collect())
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
