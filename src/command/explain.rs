//! `halflight explain`: why a pixel is shaded as it is.

use std::path::PathBuf;

use clap::Args;
use halflight_render::Technique;
use halflight_render::techniques::bandwidth::BandwidthTechnique;
use halflight_scene::schema;
use serde_json::json;

use super::console::Console;
use super::failure::Failure;
use super::parse::{Size, finite};
use super::progress::silent;
use super::stage::{MachineArgs, SceneArgs, Stage};

#[derive(Args, Debug)]
pub(crate) struct ExplainArgs {
    /// A scene file, `demo:NAME` or a bare asset
    scene: PathBuf,
    /// Column and row of the pixel, from 0 at the top left
    #[arg(long, value_name = "X,Y", value_parser = pixel)]
    pixel: [usize; 2],
    /// Columns and rows of the picture [default: the scene's]
    #[arg(long, value_name = "WxH")]
    size: Option<Size>,
    /// Seconds of the scene
    #[arg(long, value_name = "T", default_value_t = 0.0, value_parser = finite, allow_negative_numbers = true)]
    time: f64,
    #[command(flatten)]
    changes: SceneArgs,
    #[command(flatten)]
    machine: MachineArgs,
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
    let stage = Stage::load(&args.scene, &changes, &args.machine)?;
    let settings = schema::read(&stage.technique_settings("bandwidth")?).map_err(Failure::failed)?;
    let mut technique = BandwidthTechnique::new(settings);
    technique.prepare(stage.scene(), &silent())?;
    let size = args.size.unwrap_or_else(|| stage.size());
    let frame = stage.frame(args.time)?;
    let [x, y] = args.pixel;
    let text = technique.explain(&frame, [size.width, size.height], args.pixel).ok_or_else(|| {
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
