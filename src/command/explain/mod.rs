//! `halflight explain`: why a pixel is shaded as it is.

mod plot;

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use halflight_render::techniques::explain::explain;
use serde_json::json;

use crate::command::console::Console;
use crate::command::failure::Failure;
use crate::command::parse::{Size, finite};
use crate::command::progress::silent;
use crate::command::stage::{self, MachineArgs, SceneArgs};

#[derive(Args, Debug)]
pub(crate) struct ExplainArgs {
    /// A scene file, `demo:NAME` or a bare asset
    scene: PathBuf,
    /// Column and row of the pixel, from 0 at the top left
    #[arg(long, value_name = "X,Y", value_parser = pixel, allow_hyphen_values = true)]
    pixel: [usize; 2],
    /// The technique that is to explain itself
    #[arg(short, long, value_enum, default_value_t)]
    technique: Explains,
    /// Columns and rows of the picture [default: the scene's]
    #[arg(long, value_name = "WxH")]
    size: Option<Size>,
    /// Seconds of the scene
    #[arg(long, value_name = "T", default_value_t = 0.0, value_parser = finite, allow_negative_numbers = true)]
    time: f64,
    /// Draw the ellipse of the spectrum after each event into this PNG; for -t covariance
    #[arg(long, value_name = "FILE.png")]
    plot: Option<PathBuf>,
    #[command(flatten)]
    changes: SceneArgs,
    #[command(flatten)]
    machine: MachineArgs,
}

/// The techniques that can say why.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Explains {
    /// Bandwidth of light, lobe and curvature
    #[default]
    Bandwidth,
    /// Covariance from the light to the film
    Covariance,
}

impl Explains {
    fn name(self) -> &'static str {
        match self {
            Self::Bandwidth => "bandwidth",
            Self::Covariance => "covariance",
        }
    }
}

fn pixel(text: &str) -> Result<[usize; 2], String> {
    let parts = text.split_once(',').map(|(x, y)| (x.trim().parse(), y.trim().parse()));
    match parts {
        Some((Ok(x), Ok(y))) => Ok([x, y]),
        _ => Err("a pixel is two whole numbers: 320,180".into()),
    }
}

pub(crate) fn run(args: &ExplainArgs, console: Console) -> Result<(), Failure> {
    args.machine.apply()?;
    let changes = SceneArgs { size: args.size, ..args.changes.clone() };
    let stage = stage::load(&args.scene, &changes, &args.machine)?;
    let size = args.size.unwrap_or_else(|| stage.size());
    let frame = stage.frame(args.time)?;
    let [x, y] = args.pixel;
    let name = args.technique.name();
    let settings = stage.technique_settings(name)?;
    let size_of = [size.width, size.height];
    let found = explain((name, &settings), stage.scene(), &frame, size_of, args.pixel, &silent())
        .map_err(Failure::failed)?;
    if let (Some(steps), Some(path)) = (found.as_ref().and_then(|found| found.steps.as_ref()), &args.plot) {
        plot::save(steps, path)?;
    }
    let text = found.map(|found| found.text);
    let text = text.ok_or_else(|| {
        let (w, h) = (size.width, size.height);
        Failure::usage(format!(
            "there is no pixel {x},{y}: the picture has {w} x {h}, counted from 0,0 at the top left"
        ))
    })?;
    console.answer(text.trim_end());
    console.event("explain", json!({ "pixel": args.pixel, "text": text }));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_is_two_whole_numbers() {
        assert_eq!(pixel("320, 180"), Ok([320, 180]));
        for text in ["", "1", "1,", "-1,2", "1.5,2", "1,2,3"] {
            assert!(pixel(text).is_err(), "{text}");
        }
    }
}
