//! From films to what is sent: tone and exposure, layers in false colour, differences between sides.

use halflight_image::metrics::flip;
use halflight_image::report::colors::{NO_VALUE, magma, viridis};
use halflight_image::{RgbImage, ToneCurve, ToneMapping, to_srgb_bytes};
use halflight_render::Film;
use halflight_render::features::{FEATURE_LAYERS, add_layers};
use halflight_scene::Frame;

/// Quality of pictures that move and at rest, of 100.
const MOVING: u8 = 80;
const STILL: u8 = 94;
/// Part of the values at each end that the legend of a layer leaves out.
const OUTLIERS: f32 = 0.005;

/// A picture of 8 bits a colour, with the values of its legend if it has one.
pub(crate) struct Shot {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) bytes: Vec<u8>,
    pub(crate) legend: Option<[f32; 2]>,
}

pub(crate) fn tone_mapping(exposure_ev: f32, filmic: bool) -> ToneMapping {
    let curve = if filmic { ToneCurve::Filmic } else { ToneCurve::Srgb };
    ToneMapping { exposure_ev, curve }
}

/// As the eye sees it.
pub(crate) fn color(film: &Film, mapping: &ToneMapping) -> Shot {
    let image = film.image();
    Shot { width: image.width, height: image.height, bytes: to_srgb_bytes(&image, mapping), legend: None }
}

/// The names of the layers that can be shown, those that the technique left in its film included.
pub(crate) fn layer_names(film: &Film) -> Vec<String> {
    let mut names: Vec<String> = FEATURE_LAYERS.iter().map(|(name, _)| (*name).to_string()).collect();
    for channel in film.layers.keys() {
        let known = FEATURE_LAYERS.iter().any(|(_, channels)| channels.contains(&channel.as_str()));
        if !known {
            names.push(channel.clone());
        }
    }
    names
}

/// A layer in colours: normals as they are, colours as colours, everything else from dark to light.
pub(crate) fn layer(frame: &Frame, film: &mut Film, name: &str) -> Option<Shot> {
    let (width, height) = (film.width(), film.height());
    if let Some((_, channels)) = FEATURE_LAYERS.iter().find(|(known, _)| *known == name) {
        add_layers(frame, film, 0, &[name], 4);
        let planes: Vec<&Vec<f32>> =
            channels.iter().filter_map(|channel| film.layers.get(*channel)).collect();
        return match (name, planes.as_slice()) {
            ("normal", [x, y, z]) => Some(three([x, y, z], width, height, |v| 0.5 + 0.5 * v)),
            ("albedo", [r, g, b]) => Some(three([r, g, b], width, height, halflight_image::srgb_encode)),
            ("position", [x, y, z]) => Some(three([x, y, z], width, height, |v| v - v.floor())),
            (_, [values]) => Some(scalar(values, width, height)),
            _ => None,
        };
    }
    film.layers.get(name).map(|values| scalar(values, width, height))
}

fn three(planes: [&Vec<f32>; 3], width: usize, height: usize, to_display: impl Fn(f32) -> f32) -> Shot {
    let mut bytes = Vec::with_capacity(3 * width * height);
    for i in 0..width * height {
        bytes.extend(planes.map(|plane| (255.0 * to_display(plane[i])).clamp(0.0, 255.0).round() as u8));
    }
    Shot { width, height, bytes, legend: None }
}

/// Numbers in the colours of viridis, from the least to the greatest without a few outliers.
fn scalar(values: &[f32], width: usize, height: usize) -> Shot {
    let mut sorted: Vec<f32> = values.iter().copied().filter(|v| v.is_finite()).collect();
    sorted.sort_by(f32::total_cmp);
    let at =
        |part: f32| sorted.get((part * (sorted.len().max(1) - 1) as f32) as usize).copied().unwrap_or(0.0);
    let (low, high) = (at(OUTLIERS), at(1.0 - OUTLIERS));
    let table = viridis();
    let scale = if high > low { 255.0 / (high - low) } else { 0.0 };
    let color = |value: &f32| {
        if value.is_finite() { table[((value - low) * scale).clamp(0.0, 255.0) as usize] } else { NO_VALUE }
    };
    Shot { width, height, bytes: values.iter().flat_map(color).collect(), legend: Some([low, high]) }
}

/// How the two sides differ: FLIP as its authors show it, with its mean.
pub(crate) fn flip_map(a: &RgbImage, b: &RgbImage, exposure_ev: f32) -> Option<(Shot, f64)> {
    let map = flip(a, b, exposure_ev).ok()?;
    let table = magma();
    let bytes = map.map.values.iter().flat_map(|v| table[(255.0 * v).clamp(0.0, 255.0) as usize]).collect();
    Some((Shot { width: a.width, height: a.height, bytes, legend: Some([0.0, 1.0]) }, map.mean))
}

/// Relative difference of the sides, in the colours of viridis.
pub(crate) fn difference_map(a: &RgbImage, b: &RgbImage) -> Option<Shot> {
    let plane = halflight_image::metrics::relative_squared_error(a, b).ok()?;
    let roots: Vec<f32> = plane.values.iter().map(|v| v.max(0.0).sqrt()).collect();
    Some(scalar(&roots, a.width, a.height))
}

/// A picture as JPEG.
pub(crate) fn jpeg(shot: &Shot, moving: bool) -> Result<Vec<u8>, String> {
    let (Ok(width), Ok(height)) = (u16::try_from(shot.width), u16::try_from(shot.height)) else {
        return Err(format!("a picture of {} x {} is too large to be sent", shot.width, shot.height));
    };
    let mut bytes = Vec::with_capacity(shot.bytes.len() / 8);
    let mut encoder = jpeg_encoder::Encoder::new(&mut bytes, if moving { MOVING } else { STILL });
    if !moving {
        encoder.set_sampling_factor(jpeg_encoder::SamplingFactor::R_4_4_4);
    }
    encoder
        .encode(&shot.bytes, width, height, jpeg_encoder::ColorType::Rgb)
        .map_err(|error| error.to_string())?;
    Ok(bytes)
}
