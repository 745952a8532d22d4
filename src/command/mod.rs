//! The command: what was asked, done, and the one place where errors become words and exit codes.

mod args;
mod bench;
mod brdf;
mod compare;
mod completions;
mod console;
mod ddf;
mod demo;
mod examples;
mod explain;
mod failure;
mod info;
mod interrupt;
mod merge;
mod output;
mod parse;
mod plot;
mod progress;
mod render;
mod resources;
mod sequence;
mod sh;
mod spheres;
mod stage;
mod table;
mod techniques;
mod view;
mod welcome;
mod words;

use std::ffi::OsString;
use std::process::ExitCode;

use clap::Parser;

use args::{Cli, Command};
use console::Console;
use failure::{DONE, Failure};

/// Runs the command line; the answer is the exit code of the process.
pub(crate) fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    tell_bugs_apart();
    interrupt::survive_large_files();
    let cli = match Cli::try_parse_from(arguments) {
        Ok(cli) => cli,
        Err(error) => {
            // Help and version come this way too, with exit code 0. A closed pipe is no reason to fail.
            let _ = error.print();
            return ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(failure::USAGE));
        }
    };
    let console = Console::new(cli.global.quiet, cli.global.json);
    match execute(cli, console) {
        Ok(()) => ExitCode::from(DONE),
        Err(failure) => {
            if let Some(message) = failure.message() {
                console.error(message);
            }
            if matches!(failure, Failure::Usage(_)) {
                console::line(std::io::stderr(), "see `halflight help` for the usage");
            }
            ExitCode::from(failure.exit_code())
        }
    }
}

fn execute(cli: Cli, console: Console) -> Result<(), Failure> {
    let Some(command) = cli.command else {
        welcome::welcome(console);
        return Ok(());
    };
    match command {
        Command::Render(args) => render::run(&args, console),
        Command::Merge(args) => merge::run(&args, console),
        Command::Compare(args) => compare::run(&args, console),
        Command::Info(args) => info::run(&args, console),
        Command::Brdf(args) => brdf::run(&args, console),
        Command::Sh(args) => sh::run(&args, console),
        Command::Spheres(args) => spheres::run(&args, console),
        Command::Ddf(args) => ddf::run(&args, console),
        Command::Demo(args) => demo::run(&args, console),
        Command::View(args) => view::run(&args, console),
        Command::Explain(args) => explain::run(&args, console),
        Command::Bench(args) => bench::run(&args, console),
        Command::Completions(args) => completions::run(&args, console),
    }
}

/// A panic is a broken invariant of halflight itself: say so, and what would help to mend it.
fn tell_bugs_apart() {
    std::panic::set_hook(Box::new(|panic| {
        let arguments: Vec<String> = std::env::args_os().map(|a| a.to_string_lossy().into_owned()).collect();
        console::line(
            std::io::stderr(),
            &format!(
                "error: this is a bug in halflight {}: {panic}\nthe command was: {}\nplease report it with the files it needs",
                env!("CARGO_PKG_VERSION"),
                arguments.join(" ")
            ),
        );
    }));
}
