//! What is in a picture.

use std::path::Path;

use halflight_file::extension;
use halflight_image::metrics::mean_rgb;
use halflight_image::{Picture, RgbImage, load_height, load_rgb};
use serde_json::{Value, json};

use super::{Description, field, numbers};
use crate::command::failure::Failure;

pub(super) fn describe(path: &Path) -> Result<Description, Failure> {
    if extension(path) == "exr" {
        return Ok(layered(path, &Picture::load_exr(path)?));
    }
    // A TIFF that tells its place on Earth or has voids holds elevations.
    if let "tif" | "tiff" = extension(path).as_str()
        && let Ok(height) = load_height(path)
        && (height.metres_per_pixel.is_some() || height.filled_voids > 0)
    {
        return Ok(elevation(path, &height));
    }
    match load_rgb(path) {
        Ok(image) => {
            let mut text = format!("{}: picture\n", path.display());
            let json = color(&mut text, &image);
            Ok(Description { text, json })
        }
        // Elevations are pictures too, but hold no colour.
        Err(error) => match load_height(path) {
            Ok(height) => Ok(elevation(path, &height)),
            Err(_) => Err(error.into()),
        },
    }
}

fn layered(path: &Path, picture: &Picture) -> Description {
    let mut text = format!("{}: EXR picture\n", path.display());
    let mut json = match picture.rgb() {
        Some(image) => color(&mut text, &image),
        None => {
            field(&mut text, "size", format!("{} × {}", picture.width, picture.height));
            json!({ "kind": "picture", "width": picture.width, "height": picture.height })
        }
    };
    let channels: Vec<&str> = picture.channels.iter().map(|c| c.name.as_str()).collect();
    field(&mut text, "channels", channels.join(" "));
    for (key, value) in &picture.metadata {
        field(&mut text, key, value);
    }
    json["channels"] = json!(channels);
    json["metadata"] = json!(picture.metadata);
    Description { text, json }
}

fn color(text: &mut String, image: &RgbImage) -> Value {
    let (mean, non_finite) = mean_rgb(image);
    let finite = || image.pixels.as_flattened().iter().copied().filter(|v| v.is_finite());
    let (low, high) = finite().fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    field(text, "size", format!("{} × {}", image.width, image.height));
    field(text, "mean", numbers(mean));
    if low <= high {
        field(text, "range", format!("{} to {}", numbers([f64::from(low)]), numbers([f64::from(high)])));
    }
    if non_finite > 0 {
        field(text, "not finite", format!("{non_finite} pixels"));
    }
    json!({
        "kind": "picture", "width": image.width, "height": image.height, "mean": mean,
        "range": (low <= high).then_some([low, high]), "non_finite_pixels": non_finite,
    })
}

fn elevation(path: &Path, height: &halflight_image::HeightImage) -> Description {
    let plane = &height.plane;
    let (low, high) =
        plane.values.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), &v| (l.min(v), h.max(v)));
    let mut text = format!("{}: heights\n", path.display());
    field(&mut text, "posts", format!("{} × {}", plane.width, plane.height));
    field(&mut text, "range", format!("{low} to {high}"));
    field(&mut text, "voids", format!("{} filled from their neighbours", height.filled_voids));
    if let Some(spacing) = height.metres_per_pixel {
        field(&mut text, "spacing", format!("{} m", numbers(spacing)));
    }
    let json = json!({
        "kind": "heights", "width": plane.width, "height": plane.height, "range": [low, high],
        "filled_voids": height.filled_voids, "metres_per_pixel": height.metres_per_pixel,
    });
    Description { text, json }
}
