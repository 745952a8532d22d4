//! `halflight demo`: scenes that are built in, made of nothing but formulas.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::{Args, Parser};
use halflight_file::{nearest_name, write_whole};
use serde_json::json;

use super::args::{Cli, Command};
use super::console::Console;
use super::failure::Failure;
use super::parse::{FrameRange, Size, finite};
use super::{output, render};

/// A scene that is part of the program.
#[derive(Clone, Copy)]
pub(crate) struct Demo {
    pub(crate) name: &'static str,
    /// The scene file.
    text: &'static str,
    /// What renders it when the demo is asked for.
    technique: &'static str,
    /// Files that it names: paths below the scene file's folder, and what they hold.
    files: &'static [(&'static str, &'static [u8])],
}

/// A scene file that names no others.
const fn path_traced(name: &'static str, text: &'static str) -> Demo {
    Demo { name, text, technique: "path", files: &[] }
}

/// A scene file that names no others, for the technique `covariance`.
const fn covariant(name: &'static str, text: &'static str) -> Demo {
    Demo { name, text, technique: "covariance", files: &[] }
}

/// A model beside the scene files.
macro_rules! model {
    ($name:literal) => {
        (concat!("models/", $name), include_bytes!(concat!("../../scenes/models/", $name)).as_slice())
    };
}

/// The light of the scenes that harmonics are for.
const SOFT_SUN: (&str, &[u8]) = model!("soft-sun.hdr");

/// The scenes; the first is what `halflight demo` renders.
pub(crate) const DEMOS: &[Demo] = &[
    path_traced("still-life", include_str!("../../scenes/still-life.toml")),
    path_traced("terrain", include_str!("../../scenes/terrain.toml")),
    path_traced("cornell-box", include_str!("../../scenes/cornell-box.toml")),
    path_traced("depth-of-field", include_str!("../../scenes/depth-of-field.toml")),
    path_traced("moving", include_str!("../../scenes/moving.toml")),
    covariant("wheel", include_str!("../../scenes/wheel.toml")),
    covariant("glossy-floor", include_str!("../../scenes/glossy-floor.toml")),
    covariant("caustic-glass", include_str!("../../scenes/caustic-glass.toml")),
    covariant("fog-lamp", include_str!("../../scenes/fog-lamp.toml")),
    Demo {
        name: "wrecking-ball",
        text: include_str!("../../scenes/wrecking-ball.toml"),
        technique: "shexp",
        files: &[SOFT_SUN, model!("cannonballs.glb"), model!("wrecking-ball.glb")],
    },
    Demo {
        name: "whale-in-the-ocean",
        text: include_str!("../../scenes/whale-in-the-ocean.toml"),
        technique: "shexp",
        files: &[SOFT_SUN, model!("whale.glb")],
    },
    Demo {
        name: "cone-man",
        text: include_str!("../../scenes/cone-man.toml"),
        technique: "shexp",
        files: &[SOFT_SUN, model!("cone-man.glb")],
    },
    Demo {
        name: "three-paints",
        text: include_str!("../../scenes/three-paints.toml"),
        technique: "bandwidth",
        files: &[model!("marble.png")],
    },
    Demo {
        name: "lamp-lit",
        text: include_str!("../../scenes/lamp-lit.toml"),
        technique: "bandwidth",
        files: &[],
    },
    Demo {
        name: "red-whale",
        text: include_str!("../../scenes/red-whale.toml"),
        technique: "bandwidth",
        files: &[model!("whale.glb")],
    },
    Demo {
        name: "hammered",
        text: include_str!("../../scenes/hammered.toml"),
        technique: "bandwidth",
        files: &[model!("hammered.png"), model!("marble.png")],
    },
];

/// Before the name of a demo, wherever a scene file is expected: `demo:still-life`.
const PREFIX: &str = "demo:";
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
    let demo = args.name.as_deref().map_or(Ok(&DEMOS[0]), named)?;
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

/// The scene file that is built in under a name such as `demo:still-life`; `None` for ordinary paths.
pub(crate) fn built_in(path: &Path) -> Result<Option<&'static Demo>, Failure> {
    match path.to_str().and_then(|text| text.strip_prefix(PREFIX)) {
        Some(name) => named(name).map(Some),
        None => Ok(None),
    }
}

fn named(name: &str) -> Result<&'static Demo, Failure> {
    DEMOS.iter().find(|demo| demo.name == name).ok_or_else(|| {
        let names = || DEMOS.iter().map(|demo| demo.name);
        let hint = match nearest_name(name, names()) {
            Some(near) => format!("did you mean {near}?"),
            None => format!("there are {}", names().collect::<Vec<_>>().join(", ")),
        };
        Failure::usage(format!("there is no demo scene {name:?} ({hint})"))
    })
}

fn list(console: Console) {
    for demo in DEMOS {
        console.answer(&format!("{:<18} {}", demo.name, demo.description()));
        console.event("demo", json!({ "name": demo.name, "description": demo.description() }));
    }
}

impl Demo {
    /// Writes the scene file to a path, and the files that it names beside it.
    pub(crate) fn unpack(&self, path: &Path) -> Result<(), Failure> {
        self.unpack_files(path.parent().unwrap_or_else(|| Path::new("")))?;
        write_whole(path, "scene file", |writer| std::io::Write::write_all(writer, self.text.as_bytes()))?;
        Ok(())
    }

    /// The text of the scene file.
    pub(crate) fn text(&self) -> &'static str {
        self.text
    }

    /// What renders it when the demo is asked for.
    pub(crate) fn technique(&self) -> &'static str {
        self.technique
    }

    /// Writes the files that the scene names into a folder.
    pub(crate) fn unpack_files(&self, folder: &Path) -> Result<(), Failure> {
        for (name, bytes) in self.files {
            let file = folder.join(name);
            let made = file.parent().map_or(Ok(()), std::fs::create_dir_all);
            made.map_err(|e| Failure::failed(format!("cannot make a folder for {}: {e}", file.display())))?;
            write_whole(&file, "model", |writer| std::io::Write::write_all(writer, bytes))?;
        }
        Ok(())
    }

    /// What the scene file says of itself.
    fn description(&self) -> &'static str {
        let line = self.text.lines().find_map(|line| line.strip_prefix("description"));
        line.map_or("", |rest| rest.trim_matches([' ', '=', '"']))
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
        option("--technique", demo.technique.into());
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_demo_says_what_it_shows() {
        assert!(DEMOS.iter().all(|demo| demo.description().len() > 10));
    }

    #[test]
    fn a_demo_is_unpacked_with_the_files_that_it_names() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("man.toml");
        named("cone-man").unwrap().unpack(&path).unwrap();
        assert!(path.exists() && folder.path().join("models/cone-man.glb").exists());
    }

    #[test]
    fn a_demo_is_found_by_its_name_or_the_nearest_is_offered() {
        assert_eq!(built_in(Path::new("demo:terrain")).unwrap().map(|d| d.name), Some("terrain"));
        assert!(built_in(Path::new("scene.toml")).unwrap().is_none());
        let error = built_in(Path::new("demo:terain")).err().unwrap();
        assert!(error.message().unwrap().contains("did you mean terrain?"));
    }
}
