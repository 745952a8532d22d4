//! The options of `halflight compare`.

use std::path::PathBuf;

use clap::Args;

use super::judge::Limit;
use crate::command::parse::{Size, finite, positive};
use crate::command::stage::{MachineArgs, SceneArgs};
use crate::command::techniques::TechniqueSpec;

#[derive(Args, Debug)]
pub(crate) struct CompareArgs {
    /// The picture under test; or, alone, a scene that techniques are to render
    #[arg(value_name = "IMAGE|SCENE")]
    pub(super) input: PathBuf,
    /// The picture that is right
    #[arg(value_name = "REFERENCE")]
    pub(super) reference_picture: Option<PathBuf>,
    /// Folder for the page (index.html) and the figures (report.json) [default: report]
    #[arg(short, long, value_name = "FOLDER")]
    pub(super) output: Option<PathBuf>,
    /// Write no page, only print the table
    #[arg(long, conflicts_with = "output")]
    pub(super) no_report: bool,
    /// Exposure of what is seen and of FLIP and PSNR, in stops [default: the scene's, or 0]
    #[arg(long, value_name = "EV", value_parser = finite, allow_negative_numbers = true)]
    pub(super) exposure: Option<f64>,
    /// Exit with code 1 if a figure is above its limit: relmse=0.01, mse, flip, hdr-flip or max-error; repeatable
    #[arg(long, value_name = "FIGURE=LIMIT")]
    pub(super) fail_above: Vec<Limit>,
    /// Exit with code 1 if a figure is below its limit: psnr=30; repeatable
    #[arg(long, value_name = "FIGURE=LIMIT")]
    pub(super) fail_below: Vec<Limit>,

    /// relMSE of the noise of the reference itself, to be subtracted
    #[arg(long, value_name = "RELMSE", value_parser = positive, allow_negative_numbers = true)]
    pub(super) reference_noise: Option<f64>,

    /// A technique to compare, with settings if you like (path:max_depth=1); repeatable [default: path]
    #[arg(short, long, value_name = "TECHNIQUE", help_heading = "Techniques on a scene")]
    pub(super) technique: Vec<TechniqueSpec>,
    /// The truth: a technique, or a picture of the scene [default: path]
    #[arg(long, value_name = "TECHNIQUE|FILE", help_heading = "Techniques on a scene")]
    pub(super) reference: Option<String>,
    /// Samples a pixel of the reference
    #[arg(long, value_name = "N", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(1..=1 << 24), help_heading = "Techniques on a scene")]
    pub(super) reference_spp: u32,
    /// Equal samples: one or several budgets, with commas [default: 16]
    #[arg(long, value_name = "N,…", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..=1 << 24), conflicts_with = "time_limit", help_heading = "Techniques on a scene")]
    pub(super) spp: Vec<u32>,
    /// Equal time: one or several budgets in seconds, with commas
    #[arg(long, value_name = "SECONDS,…", value_delimiter = ',', value_parser = positive, allow_negative_numbers = true, help_heading = "Techniques on a scene")]
    pub(super) time_limit: Vec<f64>,
    /// Columns and rows [default: the scene's]
    #[arg(long, value_name = "WxH", help_heading = "Techniques on a scene")]
    pub(super) size: Option<Size>,
    /// Time of the frame in seconds
    #[arg(long, value_name = "SECONDS", value_parser = finite, default_value = "0", allow_negative_numbers = true, help_heading = "Techniques on a scene")]
    pub(super) time: f64,
    /// Choose other random numbers; the reference always has others
    #[arg(long, value_name = "N", default_value_t = 0, help_heading = "Techniques on a scene")]
    pub(super) seed: u64,
    #[command(flatten)]
    pub(super) scene: SceneArgs,
    #[command(flatten)]
    pub(super) machine: MachineArgs,
}
