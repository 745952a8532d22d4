//! Peak memory of loading and rendering a large mesh.

use super::subjects::peak_file;
use super::{BenchArgs, Findings};
use crate::command::failure::Failure;
use crate::command::progress::silent;
use crate::command::stage::{self, SceneArgs};
use crate::command::table::Table;
use crate::command::techniques::{self, TechniqueSpec};
use crate::command::{resources, words};

use halflight_render::{Budget, Film};

pub(super) fn measure(args: &BenchArgs) -> Result<Findings, Failure> {
    let (width, height) = (640, 360);
    let mut table = Table::new(["scene", "after loading", "peak"]);
    let mut notes = Vec::new();
    let (name, path) =
        if args.quick { ("still-life", "demo:still-life".into()) } else { ("kitchen", peak_file(args)) };
    if !args.quick && !path.exists() {
        notes.push(format!("skipped {name}: there is no {}", path.display()));
        return Ok(Findings { title: "Memory", table, notes });
    }
    resources::reset_peak_memory();
    let stage = stage::load(&path, &SceneArgs::default(), &args.machine)?;
    let loaded = resources::peak_memory_bytes();
    let frame = stage.frame(0.0)?;
    let technique = techniques::create(&TechniqueSpec::default(), &stage)?.technique;
    let mut film = Film::new(width, height);
    technique.render(&frame, &mut film, &Budget { samples: Some(4), ..Budget::default() }, &silent())?;
    let peak = resources::peak_memory_bytes();
    let text = |bytes: Option<u64>| bytes.map_or_else(|| "–".into(), words::bytes);
    table.row([name.to_string(), text(loaded), text(peak)]);
    notes.push(format!("resident memory at its highest, {width} × {height} pixels, 4 samples a pixel"));
    notes.push(
        "the peak can be started anew on Linux only; run `halflight bench memory` alone elsewhere".into(),
    );
    Ok(Findings { title: "Memory", table, notes })
}
