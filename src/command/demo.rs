//! `halflight demo`: scenes that are built in, made of nothing but formulas.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::{Args, Parser};
use halflight::demos::{self, DEMOS, Demo, PREFIX};
use serde_json::json;

use super::args::{Cli, Command};
use super::console::Console;
use super::failure::Failure;
use super::parse::{FrameRange, Size, finite};
use super::{output, render};

/// Seconds that a demo may take unless samples are asked for: ten, less loading and writing.
const TIME_LIMIT: &str = "8";
/// Samples that make the demos clean.
const SAMPLES: &str = "64";

#[derive(Args, Debug)]
pub(crate) struct DemoArgs {
    /// The scene [default: the first]
    name: Option<String>,
    /// List the scenes and stop
    #[arg(long)]
    list: bool,
    /// Write the scene file instead, to look at and to change
    #[arg(long, value_name = "FILE.toml", conflicts_with_all = ["list", "output"])]
    save: Option<PathBuf>,
    /// The picture [default: the scene's name with .png, in the current folder]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Columns and rows [default: the scene's]
    #[arg(long, value_name = "WxH")]
    size: Option<Size>,
    /// Samples a pixel [default: 64, or what 8 seconds allow]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1 << 24))]
    spp: Option<u32>,
    /// The frame, at 24 a second
    #[arg(long, value_name = "T", value_parser = finite, conflicts_with = "frames", allow_negative_numbers = true)]
    frame: Option<f64>,
    /// All frames from A to B
    #[arg(long, value_name = "A..B", allow_hyphen_values = true)]
    frames: Option<FrameRange>,
}

pub(crate) fn run(args: &DemoArgs, console: Console) -> Result<(), Failure> {
    if args.list {
        list(console);
        return Ok(());
    }
    let demo = args.name.as_deref().map_or(Ok(&DEMOS[0]), demos::named)?;
    if let Some(path) = &args.save {
        output::check_writable(path)?;
        demo.unpack(path)?;
        console.note(&format!(
            "wrote {}: render it with `halflight render {}`",
            path.display(),
            path.display()
        ));
        console.event("done", json!({ "output": path }));
        return Ok(());
    }
    let cli = Cli::try_parse_from(args.as_render(demo)).map_err(Failure::failed)?;
    if let Some(Command::Render(render)) = cli.command {
        render::run(&render, console)?;
    }
    if args.name.is_none() {
        let others: Vec<&str> = DEMOS[1..].iter().map(|demo| demo.name).collect();
        console.note(&format!("other demo scenes: {}", others.join(", ")));
    }
    Ok(())
}

fn list(console: Console) {
    for demo in DEMOS {
        console.answer(&format!("{:<18} {}", demo.name, demo.description()));
        console.event("demo", json!({ "name": demo.name, "description": demo.description() }));
    }
}

impl DemoArgs {
    /// The command line that does the same with `halflight render`.
    fn as_render(&self, demo: &Demo) -> Vec<OsString> {
        let mut line: Vec<OsString> =
            vec!["halflight".into(), "render".into(), format!("{PREFIX}{}", demo.name).into()];
        let mut option = |name: &str, value: OsString| line.extend([name.into(), value]);
        let output = self.output.clone().unwrap_or_else(|| PathBuf::from(format!("{}.png", demo.name)));
        option("--output", output.into());
        option("--technique", demo.technique().into());
        match self.spp {
            Some(samples) => option("--spp", samples.to_string().into()),
            None => {
                option("--spp", SAMPLES.into());
                option("--time-limit", TIME_LIMIT.into());
            }
        }
        if let Some(Size { width, height }) = self.size {
            option("--size", format!("{width}x{height}").into());
        }
        if let Some(frame) = self.frame {
            option("--frame", frame.to_string().into());
        }
        if let Some(FrameRange { first, last }) = self.frames {
            option("--frames", format!("{first}..{last}").into());
        }
        line
    }
}
