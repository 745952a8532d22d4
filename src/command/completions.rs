//! `halflight completions`: scripts for shells.

use clap::{Args, CommandFactory};
use clap_complete::Shell;

use super::args::Cli;
use super::console::Console;
use super::failure::Failure;

#[derive(Args, Debug)]
pub(crate) struct CompletionsArgs {
    /// The shell
    shell: Shell,
}

pub(crate) fn run(args: &CompletionsArgs, console: Console) -> Result<(), Failure> {
    // Into memory first: the generator does not expect that its reader may go away.
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "halflight", &mut script);
    let script = String::from_utf8_lossy(&script).trim_end().to_string();
    console.answer(&script);
    console.event("completions", serde_json::json!({ "script": script }));
    Ok(())
}
