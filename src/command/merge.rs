//! `halflight merge`: tiles joined to pictures.

use std::path::PathBuf;

use clap::Args;
use halflight::job::Format;
use halflight::job::merge::{self, Wishes};
use serde_json::json;

use super::console::Console;
use super::failure::Failure;
use super::output::{self, Tone};
use super::parse::stops;
use super::{sequence, words};

#[derive(Args, Debug)]
pub(crate) struct MergeArgs {
    /// What `halflight render --tile I/N` has written: all N tiles, of one frame or of several
    #[arg(required = true, value_name = "TILE")]
    tiles: Vec<PathBuf>,
    /// The picture: .exr, .hdr or .png. Where the tiles are of several frames, `####` becomes the frame's number
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Exposure of a .png in stops [default: as without tiles]
    #[arg(long, value_name = "EV", value_parser = stops, allow_negative_numbers = true)]
    exposure: Option<f64>,
    /// How a .png shows light that is brighter than white [default: the scene's]
    #[arg(long, value_name = "CURVE", value_enum)]
    tone: Option<Tone>,
}

pub(crate) fn run(args: &MergeArgs, console: Console) -> Result<(), Failure> {
    Format::of(&args.output)?;
    let joints = merge::gather(&args.tiles)?;
    let wishes = Wishes { exposure_ev: args.exposure.map(|ev| ev as f32), tone: args.tone.map(Into::into) };
    let is_pattern = args.output.file_name().is_some_and(|name| name.to_string_lossy().contains('#'));
    let outputs: Vec<PathBuf> = joints
        .iter()
        .map(|joint| match joints.len() > 1 || is_pattern {
            true => sequence::numbered(&args.output, joint.frame),
            false => args.output.clone(),
        })
        .collect();
    let canonical = |path: &PathBuf| path.canonicalize().ok();
    for output in &outputs {
        output::check_writable(output)?;
        if canonical(output)
            .is_some_and(|path| args.tiles.iter().any(|tile| canonical(tile) == Some(path.clone())))
        {
            return Err(Failure::usage(format!(
                "cannot write the picture to {}: this is one of the tiles (write elsewhere: -o other.exr)",
                output.display()
            )));
        }
    }
    let command: Vec<String> = std::env::args_os().map(|a| a.to_string_lossy().into_owned()).collect();
    for (joint, output) in joints.iter().zip(&outputs) {
        joint.write(output, &wishes, &command.join(" "))?;
        let tiles = words::count(joint.part_count() as f64, "tile");
        console.note(&format!("wrote {}: {tiles}", output.display()));
        console
            .event("merged", json!({ "frame": joint.frame, "output": output, "tiles": joint.part_count() }));
    }
    console.event("done", json!({ "outputs": outputs }));
    Ok(())
}
