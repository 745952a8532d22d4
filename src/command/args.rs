//! The command line as a whole; each subcommand's options stand in its own file.

use clap::{Args, Parser, Subcommand};

use super::{
    bench, brdf, compare, completions, ddf, demo, examples, explain, info, merge, render, sh, spheres, view,
};

/// A renderer for scenes that move, lit from everywhere, made of measured materials.
#[derive(Debug, Parser)]
#[command(name = "halflight", version, max_term_width = 100, after_help = examples::after_help("halflight"))]
pub(crate) struct Cli {
    #[command(flatten)]
    pub(crate) global: Global,
    #[command(subcommand)]
    pub(crate) command: Option<Command>,
}

/// What every subcommand understands.
#[derive(Args, Debug)]
pub(crate) struct Global {
    /// Say nothing but answers, warnings and errors
    #[arg(long, short, global = true, help_heading = "Output of the command")]
    pub(crate) quiet: bool,
    /// Say everything as one JSON object a line, on standard output
    #[arg(long, global = true, help_heading = "Output of the command")]
    pub(crate) json: bool,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Render a scene or a bare asset to a picture or a sequence of pictures
    #[command(after_help = examples::after_help("render"))]
    Render(Box<render::RenderArgs>),
    /// Join the tiles of pictures that several machines have rendered
    #[command(after_help = examples::after_help("merge"))]
    Merge(merge::MergeArgs),
    /// Measure how far apart two pictures, or several techniques on one scene, are
    #[command(after_help = examples::after_help("compare"))]
    Compare(Box<compare::CompareArgs>),
    /// Say what is in a scene, a mesh, a picture or a measured material
    #[command(after_help = examples::after_help("info"))]
    Info(info::InfoArgs),
    /// Write a material as a file of the MERL database's format, or describe one
    #[command(after_help = examples::after_help("brdf"))]
    Brdf(brdf::BrdfArgs),
    /// Environment maps as spherical harmonics: project, rotate, convert, show
    #[command(after_help = examples::after_help("sh"))]
    Sh(sh::ShArgs),
    /// Fit spheres to a mesh for soft shadows, check how well they stand for it, show them
    #[command(after_help = examples::after_help("spheres"))]
    Spheres(spheres::SpheresArgs),
    /// Learn a mesh as a field of directed distances; measure, show and convert fields
    #[command(after_help = examples::after_help("ddf"))]
    Ddf(Box<ddf::DdfArgs>),
    /// Render the demo scenes that are built in
    #[command(after_help = examples::after_help("demo"))]
    Demo(demo::DemoArgs),
    /// Show a scene live in the browser
    #[command(after_help = examples::after_help("view"))]
    View(Box<view::ViewArgs>),
    /// Say why a pixel is shaded as it is
    #[command(after_help = examples::after_help("explain"))]
    Explain(explain::ExplainArgs),
    /// Measure speed and memory, and print tables
    #[command(after_help = examples::after_help("bench"))]
    Bench(bench::BenchArgs),
    /// Print a script that completes halflight's options in a shell
    #[command(after_help = examples::after_help("completions"))]
    Completions(completions::CompletionsArgs),
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_options_do_not_contradict_each_other() {
        Cli::command().debug_assert();
    }

    #[test]
    fn every_command_has_an_example() {
        let mut names: Vec<String> =
            Cli::command().get_subcommands().map(|c| c.get_name().to_string()).collect();
        names.push("halflight".into());
        for name in names {
            assert!(examples::EXAMPLES.iter().any(|e| e.command == name), "{name} has no example");
        }
    }
}
