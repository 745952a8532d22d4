//! How far `shexp` is from the path tracer under the same light, which its bands hold.

use std::path::Path;

use halflight::job::Stage;
use halflight_image::RgbImage;
use halflight_render::{Budget, Film};
use halflight_scene::Frame;

use super::scenes::{FRAMES_A_SECOND, SCENES};
use crate::command::bench::{BenchArgs, Findings};
use crate::command::failure::Failure;
use crate::command::progress::silent;
use crate::command::stage::{self, SceneArgs};
use crate::command::table::Table;
use crate::command::techniques::{self, TechniqueSpec};
use crate::command::{interrupt, words};

const WIDTH: usize = 320;
const HEIGHT: usize = 180;
/// The frames that the documentation shows.
const FRAMES: [u32; 2] = [24, 45];

pub(in crate::command::bench) fn measure(args: &BenchArgs) -> Result<Findings, Failure> {
    let (samples, truth_samples) = if args.quick { (1, 16) } else { (16, 1024) };
    let frames = if args.quick { &FRAMES[..1] } else { &FRAMES };
    let mut table = Table::new(["scene", "frame", "mean error", "95 %", "brightness"]);
    for (name, _) in SCENES {
        let stage = stage::load(Path::new(&format!("demo:{name}")), &SceneArgs::default(), &args.machine)?;
        for &number in frames {
            let frame = stage.frame(f64::from(number) / FRAMES_A_SECOND)?;
            let picture = picture("shexp", &[], &stage, &frame, samples)?;
            let truth = self::picture("path", &["max_depth=1"], &stage, &frame, truth_samples)?;
            let error = Error::between(&picture, &truth);
            table.row([
                name.to_string(),
                number.to_string(),
                format!("{} %", words::figure(100.0 * error.mean)),
                format!("{} %", words::figure(100.0 * error.most)),
                format!("{:+.2} %", 100.0 * error.brightness),
            ]);
            if interrupt::is_asked_to_stop() {
                return Err(Failure::Interrupted);
            }
        }
    }
    let notes = vec![
        format!(
            "luminance of pixels, relative to path:max_depth=1 with {truth_samples} samples a pixel, whose noise is in it"
        ),
        format!(
            "{WIDTH} × {HEIGHT} pixels; relative to a hundredth of the picture's mean where it is darker than that"
        ),
    ];
    Ok(Findings { title: "Spherical-harmonic exponentiation, error", table, notes })
}

fn picture(
    technique: &str,
    settings: &[&str],
    stage: &Stage,
    frame: &Frame,
    samples: u32,
) -> Result<RgbImage, Failure> {
    let settings = settings.iter().map(ToString::to_string).collect();
    let spec = TechniqueSpec { name: technique.into(), settings };
    let mut technique = techniques::create(&spec, stage)?.technique;
    technique.prepare(stage.scene(), &silent())?;
    let mut film = Film::new(WIDTH, HEIGHT);
    technique.render(frame, &mut film, &Budget { samples: Some(samples), ..Budget::default() }, &silent())?;
    Ok(film.image())
}

/// Relative errors over the pixels of a picture.
struct Error {
    mean: f64,
    /// What 95 % of the pixels stay below.
    most: f64,
    /// Of the whole picture.
    brightness: f64,
}

impl Error {
    fn between(picture: &RgbImage, truth: &RgbImage) -> Self {
        let luminance = |p: &[f32; 3]| f64::from(0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2]);
        let mean =
            |image: &RgbImage| image.pixels.iter().map(luminance).sum::<f64>() / image.pixels.len() as f64;
        let level = mean(truth);
        let mut errors: Vec<f64> = picture
            .pixels
            .iter()
            .zip(&truth.pixels)
            .map(|(a, b)| (luminance(a) - luminance(b)).abs() / luminance(b).max(0.01 * level))
            .collect();
        errors.sort_by(f64::total_cmp);
        Self {
            mean: errors.iter().sum::<f64>() / errors.len() as f64,
            most: errors[errors.len() * 95 / 100],
            brightness: mean(picture) / level - 1.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_a_tenth_brighter_errs_by_a_tenth_everywhere() {
        let truth = RgbImage::from_fn(8, 8, |x, _| [1.0 + x as f32; 3]);
        let picture = RgbImage::from_fn(8, 8, |x, _| [1.1 * (1.0 + x as f32); 3]);
        let error = Error::between(&picture, &truth);
        for figure in [error.mean, error.most, error.brightness] {
            assert!((figure - 0.1).abs() < 1e-5);
        }
    }
}
