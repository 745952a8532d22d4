//! How the two sides differ: relMSE, PSNR and FLIP, and maps of the difference, worked out beside everything else.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};

use halflight_image::RgbImage;
use serde_json::{Value, json};

use crate::hub::Hub;
use crate::pictures::{self, Shot};

/// Pixels beyond which pictures are made smaller before they are compared: FLIP takes about a second for so many.
const MAX_COMPARED: usize = 1 << 20;

/// What is compared with what.
pub(crate) struct Pair {
    pub(crate) a: Arc<RgbImage>,
    pub(crate) b: Arc<RgbImage>,
    pub(crate) exposure_ev: f32,
    /// The layer that is shown, which may be a map.
    pub(crate) layer: String,
    /// The state of the scene that the pictures show.
    pub(crate) moment: u64,
}

/// How they differ.
pub(crate) struct Compared {
    pub(crate) errors: Value,
    pub(crate) map: Option<Shot>,
    pub(crate) layer: String,
    pub(crate) moment: u64,
}

/// Begins to compare; the answer arrives some time later, and the hub wakes.
pub(crate) fn start(pair: Pair, hub: Arc<Hub>) -> Option<Receiver<Compared>> {
    let (sender, receiver) = channel();
    let work = move || {
        let _ = sender.send(compare(&pair));
        hub.wake();
    };
    std::thread::Builder::new().name("viewer compare".into()).spawn(work).ok()?;
    Some(receiver)
}

/// Works it out.
pub(crate) fn compare(pair: &Pair) -> Compared {
    let (a, b) = (&pair.a, &pair.b);
    let nothing = |reason: String| Compared {
        errors: json!({ "reason": reason }),
        map: None,
        layer: pair.layer.clone(),
        moment: pair.moment,
    };
    if (a.width, a.height) != (b.width, b.height) {
        return nothing(format!(
            "not measured: the pictures have {} × {} and {} × {} pixels (choose the size of the stored one)",
            a.width, a.height, b.width, b.height
        ));
    }
    // Errors of radiance are of all pixels; FLIP, which looks at neighbourhoods, of a smaller picture if need be.
    let factor = (1..).find(|f| (a.width / f) * (a.height / f) <= MAX_COMPARED).unwrap_or(1);
    let (small_a, small_b);
    let (fa, fb): (&RgbImage, &RgbImage) = if factor > 1 {
        (small_a, small_b) = (smaller(a, factor), smaller(b, factor));
        (&small_a, &small_b)
    } else {
        (a, b)
    };
    let relative = halflight_image::metrics::relative_mse(a, b).ok();
    let psnr = halflight_image::metrics::psnr(a, b, pair.exposure_ev).ok();
    let flip = pictures::flip_map(fa, fb, pair.exposure_ev);
    let note = (factor > 1).then(|| {
        format!("FLIP and its map of a picture made smaller by {factor}: {} × {}", fa.width, fa.height)
    });
    let finite = |value: Option<f64>| value.filter(|value| value.is_finite());
    let same = a.pixels == b.pixels;
    Compared {
        errors: json!({
            "relative_mse": finite(relative), "psnr": finite(psnr), "same": same,
            "flip": finite(flip.as_ref().map(|(_, mean)| *mean)), "note": note,
        }),
        map: match pair.layer.as_str() {
            "flip" => flip.map(|(shot, _)| shot),
            "difference" => pictures::difference_map(fa, fb),
            _ => None,
        },
        layer: pair.layer.clone(),
        moment: pair.moment,
    }
}

/// The means of squares of `factor` × `factor` pixels; what is left over at the edges is left out.
fn smaller(image: &RgbImage, factor: usize) -> RgbImage {
    let weight = 1.0 / (factor * factor) as f32;
    RgbImage::from_fn(image.width / factor, image.height / factor, |x, y| {
        let mut sum = [0.0; 3];
        for row in 0..factor {
            let start = (y * factor + row) * image.width + x * factor;
            for pixel in &image.pixels[start..start + factor] {
                sum.iter_mut().zip(pixel).for_each(|(sum, value)| *sum += value * weight);
            }
        }
        sum
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pair(width: usize, height: usize, other: f32) -> Pair {
        Pair {
            a: Arc::new(RgbImage::from_fn(width, height, |_, _| [0.5; 3])),
            b: Arc::new(RgbImage::from_fn(width, height, |_, _| [other; 3])),
            exposure_ev: 0.0,
            layer: "flip".into(),
            moment: 3,
        }
    }

    #[test]
    fn large_pictures_are_compared_smaller_and_it_is_said() {
        let compared = compare(&pair(2048, 1024, 0.6));
        let note = compared.errors["note"].as_str().unwrap_or_default();
        assert!(note.contains("1024 × 512"), "{note}");
        assert!(compared.errors["flip"].as_f64().is_some_and(|flip| flip > 0.0));
        assert_eq!(compared.map.map(|map| (map.width, map.height)), Some((1024, 512)));
        assert!(compare(&pair(64, 32, 0.6)).errors["note"].is_null());
    }

    #[test]
    fn sizes_that_differ_are_said() {
        let other = Arc::new(RgbImage::from_fn(8, 8, |_, _| [0.0; 3]));
        let compared = compare(&Pair { b: other, ..pair(16, 8, 0.5) });
        assert!(compared.errors["reason"].as_str().is_some_and(|reason| reason.contains("16 × 8")));
    }
}
