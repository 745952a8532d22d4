//! `halflight view`: a scene in the browser, live.

mod keep;
mod shelf;

use std::net::IpAddr;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::Instant;

use clap::Args;
use halflight::demos::{self, Demo};
use halflight_render::techniques::TECHNIQUES;
use halflight_view::Address;
use serde_json::json;

use self::shelf::Shelf;
use super::console::Console;
use super::failure::Failure;
use super::interrupt;
use super::parse::positive;
use super::stage::{self, MachineArgs, SceneArgs};

#[derive(Args, Debug)]
pub(crate) struct ViewArgs {
    /// A scene file, `demo:NAME` or a bare asset
    #[arg(default_value = "demo:cone-man")]
    scene: PathBuf,
    /// The technique that is shown first [default: what the demo is for, or path]
    #[arg(long, short, value_name = "NAME")]
    technique: Option<String>,
    /// The port to listen on; 0 for any that is free
    #[arg(long, value_name = "N", default_value_t = 8642)]
    port: u16,
    /// The address to listen on. Any but this machine's own lets others in who know the token in the address
    #[arg(long, value_name = "IP", default_value = "127.0.0.1")]
    address: IpAddr,
    /// Only print the address
    #[arg(long)]
    no_browser: bool,
    /// Files may be opened and written in this folder and below it [default: the scene's]
    #[arg(long, value_name = "DIR")]
    folder: Option<PathBuf>,
    /// End after so many seconds [default: when interrupted]
    #[arg(long, value_name = "SECONDS", value_parser = positive, allow_negative_numbers = true)]
    seconds: Option<f64>,
    #[command(flatten)]
    changes: SceneArgs,
    #[command(flatten)]
    machine: MachineArgs,
}

pub(crate) fn run(args: &ViewArgs, console: Console) -> Result<(), Failure> {
    args.machine.apply()?;
    interrupt::listen();
    let built_in = demos::built_in(&args.scene)?;
    let technique = args.technique.as_deref().or(built_in.map(Demo::technique)).unwrap_or(TECHNIQUES[0].name);
    halflight_render::techniques::find(technique).map_err(Failure::usage)?;
    let folder = folder_of(args, built_in.is_some())?;
    let name = match args.scene.canonicalize() {
        Ok(path) if built_in.is_none() => match path.strip_prefix(&folder) {
            Ok(below) => below.display().to_string(),
            Err(_) => {
                let (scene, folder) = (args.scene.display(), folder.display());
                return Err(Failure::usage(format!(
                    "{scene} is not below the folder {folder} (see --folder)"
                )));
            }
        },
        _ => args.scene.display().to_string(),
    };
    let mut shelf = Shelf::new(folder, args.changes.clone(), args.machine.clone());
    let stage = stage::load(&args.scene, &args.changes, &args.machine)?;
    stage.warnings().iter().for_each(|warning| console.warn(warning));
    let first = shelf.show(name, stage)?;
    let begun = Instant::now();
    let over =
        || interrupt::is_asked_to_stop() || args.seconds.is_some_and(|s| begun.elapsed().as_secs_f64() >= s);
    let ready = |urls: &[String], address: std::net::SocketAddr| {
        console.answer(&format!("{}\nCtrl-C ends", urls.join("\n")));
        let url = urls.first().map_or("", String::as_str);
        console.event("view", json!({ "url": url, "urls": urls, "port": address.port() }));
        if !args.no_browser && !open_browser(url) {
            console.note("no browser was found: open the address in one");
        }
    };
    let address = Address { ip: args.address, port: args.port };
    halflight_view::view(address, Box::new(shelf), first, technique, ready, &over).map_err(Failure::failed)
}

/// The folder that may be read and written.
fn folder_of(args: &ViewArgs, built_in: bool) -> Result<PathBuf, Failure> {
    let folder = match (&args.folder, args.scene.parent()) {
        (Some(folder), _) => folder.clone(),
        (None, Some(parent)) if !built_in && !parent.as_os_str().is_empty() => parent.to_path_buf(),
        _ => PathBuf::from("."),
    };
    folder
        .canonicalize()
        .map_err(|error| Failure::usage(format!("cannot use the folder {}: {error}", folder.display())))
}

/// Asks the desktop to show an address.
fn open_browser(url: &str) -> bool {
    let program = if cfg!(target_os = "macos") {
        "open"
    } else if cfg!(windows) {
        "explorer"
    } else {
        "xdg-open"
    };
    let quiet = Command::new(program)
        .arg(url)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn();
    quiet.is_ok()
}
