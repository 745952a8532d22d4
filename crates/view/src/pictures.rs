//! From films to what is sent: tone and exposure, layers in false colour, differences between sides.

use halflight_image::metrics::flip;
use halflight_image::report::FalseColor;
use halflight_image::report::colors::magma;
use halflight_image::{RgbImage, ToneCurve, ToneMapping, to_srgb_bytes};
use halflight_render::Film;
use halflight_render::features::{FEATURE_LAYERS, add_layers};
use halflight_scene::Frame;
use serde_json::{Value, json};

/// Quality of pictures that move and at rest, of 100.
const MOVING: u8 = 80;
const STILL: u8 = 94;
/// A picture of 8 bits a colour, with its legend if it has one.
pub(crate) struct Shot {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) bytes: Vec<u8>,
    /// What the colours say, for the page.
    pub(crate) legend: Value,
}

pub(crate) fn tone_mapping(exposure_ev: f32, filmic: bool) -> ToneMapping {
    let curve = if filmic { ToneCurve::Filmic } else { ToneCurve::Srgb };
    ToneMapping { exposure_ev, curve }
}

/// As the eye sees it.
pub(crate) fn color(film: &Film, mapping: &ToneMapping) -> Shot {
    of_image(&film.image(), mapping)
}

/// A stored picture as the eye sees it.
pub(crate) fn of_image(image: &RgbImage, mapping: &ToneMapping) -> Shot {
    let bytes = to_srgb_bytes(image, mapping);
    Shot { width: image.width, height: image.height, bytes, legend: Value::Null }
}

/// The names of the layers that can be shown of a frame, those that the technique left in its film included.
pub(crate) fn layer_names(frame: &Frame, own: &[String]) -> Vec<String> {
    let can_fall_back =
        frame.world.instances().iter().any(|instance| instance.geometry.as_rays().fallback().is_some());
    let features = FEATURE_LAYERS.iter().map(|(name, _)| (*name).to_string());
    features.filter(|name| name != "fallback" || can_fall_back).chain(own.iter().cloned()).collect()
}

/// The layers that a technique left in its film.
pub(crate) fn own_layers(film: &Film) -> Vec<String> {
    let known = |channel: &str| FEATURE_LAYERS.iter().any(|(_, channels)| channels.contains(&channel));
    film.layers.keys().filter(|channel| !known(channel)).cloned().collect()
}

/// A layer in colours: normals as they are, colours as colours, everything else from dark to light.
pub(crate) fn layer(frame: &Frame, film: &mut Film, name: &str) -> Option<Shot> {
    let (width, height) = (film.width(), film.height());
    if let Some((_, channels)) = FEATURE_LAYERS.iter().find(|(known, _)| *known == name) {
        add_layers(frame, film, 0, &[name], 4);
        let planes: Vec<&Vec<f32>> =
            channels.iter().filter_map(|channel| film.layers.get(*channel)).collect();
        return match (name, planes.as_slice()) {
            ("normal", [x, y, z]) => {
                let words = "x, y and z of the normal as red, green and blue; −1 is dark, 1 bright";
                Some(three([x, y, z], width, height, words, |v| 0.5 + 0.5 * v))
            }
            ("albedo", [r, g, b]) => {
                let words = "the share of the light that is given back, as a colour";
                Some(three([r, g, b], width, height, words, halflight_image::srgb_encode))
            }
            ("position", [x, y, z]) => {
                let words = "x, y and z as red, green and blue, from dark to bright within each metre";
                Some(three([x, y, z], width, height, words, |v| v - v.floor()))
            }
            (name, [values]) => Some(scalar(values, width, height, unit(name))),
            _ => None,
        };
    }
    film.layers.get(name).map(|values| scalar(values, width, height, unit(name)))
}

/// What the numbers of a layer count.
fn unit(name: &str) -> &'static str {
    match name {
        "depth" => "m",
        "alpha" => "share that hits something",
        "material" => "number of the material",
        "samples" => "samples a pixel",
        "variance" => "variance of radiance",
        "fallback" => "share of hits by the mesh",
        _ => "",
    }
}

fn three(
    planes: [&Vec<f32>; 3],
    width: usize,
    height: usize,
    words: &str,
    to_display: impl Fn(f32) -> f32,
) -> Shot {
    let mut bytes = Vec::with_capacity(3 * width * height);
    for i in 0..width * height {
        bytes.extend(planes.map(|plane| (255.0 * to_display(plane[i])).clamp(0.0, 255.0).round() as u8));
    }
    Shot { width, height, bytes, legend: json!({ "words": words }) }
}

/// Numbers in false colour, from the least to the greatest without a few outliers.
fn scalar(values: &[f32], width: usize, height: usize, unit: &str) -> Shot {
    let FalseColor { bytes, low, high, has_gaps, .. } = FalseColor::new(values, [width, height], None);
    let legend = json!({ "low": low, "high": high, "unit": unit, "map": "viridis", "nothing": has_gaps });
    Shot { width, height, bytes, legend }
}

/// How the two sides differ: FLIP as its authors show it, with its mean.
pub(crate) fn flip_map(a: &RgbImage, b: &RgbImage, exposure_ev: f32) -> Option<(Shot, f64)> {
    let map = flip(a, b, exposure_ev).ok()?;
    let table = magma();
    let bytes = map.map.values.iter().flat_map(|v| table[(255.0 * v).clamp(0.0, 255.0) as usize]).collect();
    let legend = json!({ "low": 0, "high": 1, "unit": "FLIP", "map": "magma", "nothing": false });
    Some((Shot { width: a.width, height: a.height, bytes, legend }, map.mean))
}

/// Relative difference of the sides, in the colours of viridis.
pub(crate) fn difference_map(a: &RgbImage, b: &RgbImage) -> Option<Shot> {
    let plane = halflight_image::metrics::relative_squared_error(a, b).ok()?;
    let roots: Vec<f32> = plane.values.iter().map(|v| v.max(0.0).sqrt()).collect();
    Some(scalar(&roots, a.width, a.height, "difference, in parts of the right side"))
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
