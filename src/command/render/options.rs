//! The options of `halflight render`.

use std::path::PathBuf;

use clap::Args;
use halflight::job::Share;

use super::DEFAULT_FPS;
use crate::command::output::Tone;
use crate::command::parse::{FrameRange, Size, finite, positive, stops};
use crate::command::stage::{MachineArgs, SceneArgs};
use crate::command::techniques::TechniqueSpec;

#[derive(Args, Debug)]
pub(crate) struct RenderArgs {
    /// A scene file (.toml), a bare asset (a mesh, a height field, a measured material), or demo:NAME
    pub(super) scene: PathBuf,
    /// The picture: .exr (radiance and layers), .hdr (radiance) or .png (what a screen shows). In a sequence
    /// or with --frame `####` becomes the frame's number (frame 1.5: 0001.5). Missing folders are made [default: the
    /// scene's name with .png, in the current folder; with .render.png where the scene is made from that file]
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: Option<PathBuf>,
    /// How to render: a technique's name, with settings if you like (path:max_depth=2,clamp=10)
    #[arg(short, long, value_name = "TECHNIQUE", default_value = "path")]
    pub(super) technique: TechniqueSpec,
    /// Columns and rows of the picture [default: the scene's, or 1280x720]
    #[arg(long, value_name = "WxH")]
    pub(super) size: Option<Size>,

    /// Stop at this many samples a pixel [default: 64 if nothing else limits the work]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1 << 24), help_heading = "When to stop (at the first that is reached)")]
    pub(super) spp: Option<u32>,
    /// Stop after this many seconds of rendering
    #[arg(long, value_name = "SECONDS", value_parser = positive, allow_negative_numbers = true, help_heading = "When to stop (at the first that is reached)")]
    pub(super) time_limit: Option<f64>,
    /// Stop when the estimated relative error, averaged over pixels, is below this (0.02 is clean, 0.1 is noisy)
    #[arg(long, value_name = "E", value_parser = positive, allow_negative_numbers = true, help_heading = "When to stop (at the first that is reached)")]
    pub(super) error: Option<f64>,
    /// How often light may scatter on its way to the eye; 1 is direct light only. Short for --set path.max_depth=N
    #[arg(long, value_name = "N")]
    pub(super) max_depth: Option<u32>,

    /// The frame to render; may lie between two. Its time is frame / fps seconds [default: 0]
    #[arg(long, value_name = "T", value_parser = finite, allow_negative_numbers = true, conflicts_with = "frames", help_heading = "Animation")]
    pub(super) frame: Option<f64>,
    /// Render all frames from A to B, both included; they may be negative
    #[arg(long, value_name = "A..B", allow_hyphen_values = true, help_heading = "Animation")]
    pub(super) frames: Option<FrameRange>,
    /// Frames per second [default: 24]
    #[arg(long, value_name = "N", value_parser = positive, allow_negative_numbers = true, help_heading = "Animation")]
    pub(super) fps: Option<f64>,

    /// Render the I-th of N parts of each picture, as out.tileIofN.exr; `halflight merge` joins them to the bits of one
    /// machine's picture, if all have the same instruction set (--simd)
    #[arg(long, value_name = "I/N", help_heading = "Many machines")]
    pub(super) tile: Option<Share>,

    #[command(flatten)]
    pub(super) scene_args: SceneArgs,

    /// Layers of an .exr, with commas: alpha, depth, normal, position, albedo, material, samples, variance, all,
    /// none [default: all]
    #[arg(long, value_name = "LIST", help_heading = "Picture")]
    pub(super) layers: Option<String>,
    /// Store an .exr in half precision
    #[arg(long, help_heading = "Picture")]
    pub(super) half: bool,
    /// Exposure of a .png in stops: +1 doubles the light [default: the scene's; of a bare environment map, what brings
    /// the picture to middle grey]
    #[arg(long, value_name = "EV", value_parser = stops, allow_negative_numbers = true, help_heading = "Picture")]
    pub(super) exposure: Option<f64>,
    /// How a .png shows light that is brighter than white [default: the scene's]
    #[arg(long, value_name = "CURVE", value_enum, help_heading = "Picture")]
    pub(super) tone: Option<Tone>,

    /// Choose other random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(super) seed: u64,
    #[command(flatten)]
    pub(super) machine: MachineArgs,

    /// Save the work so far to this file every now and then
    #[arg(long, value_name = "FILE", help_heading = "Long renders")]
    pub(super) checkpoint: Option<PathBuf>,
    /// Seconds between two checkpoints
    #[arg(long, value_name = "SECONDS", value_parser = positive, allow_negative_numbers = true, default_value = "30", help_heading = "Long renders")]
    pub(super) checkpoint_every: f64,
    /// Go on from the checkpoint, if there is one; the picture is the same to the bit as without a break
    #[arg(long, help_heading = "Long renders")]
    pub(super) resume: bool,
    /// Write figures about the work to this file
    #[arg(long, value_name = "FILE.json", help_heading = "Long renders")]
    pub(super) stats: Option<PathBuf>,
}

impl RenderArgs {
    pub(super) fn fps(&self) -> f64 {
        self.fps.unwrap_or(DEFAULT_FPS)
    }

    /// What to change in the scene as it was written.
    pub(super) fn scene_options(&self) -> SceneArgs {
        SceneArgs { size: self.size, ..self.scene_args.clone() }
    }
}
