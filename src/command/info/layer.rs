//! `halflight info PICTURE --layer NAME -o FILE.png`: one layer in false colour.

use std::path::Path;

use halflight_file::{extension, nearest_name};
use halflight_image::Picture;
use halflight_image::report::FalseColor;
use serde_json::json;

use crate::command::console::Console;
use crate::command::failure::Failure;
use crate::command::parse::finite;

pub(super) fn show(
    path: &Path,
    name: &str,
    range: Option<&str>,
    output: &Path,
    console: Console,
) -> Result<(), Failure> {
    let range = range.map(ends).transpose()?;
    if extension(output) != "png" {
        return Err(Failure::usage(format!("cannot write {}: a layer is shown as .png", output.display())));
    }
    if extension(path) != "exr" {
        return Err(Failure::usage(format!("{} has no layers: only .exr pictures do", path.display())));
    }
    let picture = Picture::load_exr(path)?;
    let names = || picture.channels.iter().map(|channel| channel.name.as_str());
    // A layer of one channel goes by its own name as well: depth for depth.Z.
    let is_asked = |found: &str| found == name || found.rsplit_once('.').is_some_and(|(of, _)| of == name);
    let found: Vec<_> = picture.channels.iter().filter(|channel| is_asked(&channel.name)).collect();
    let channel = match found.as_slice() {
        [channel] => channel,
        [] => {
            let hint = match nearest_name(name, names()) {
                Some(near) => format!("did you mean {near}?"),
                None => format!("there are {}", names().collect::<Vec<_>>().join(", ")),
            };
            return Err(Failure::usage(format!("{} has no layer {name:?} ({hint})", path.display())));
        }
        several => {
            let names: Vec<&str> = several.iter().map(|channel| channel.name.as_str()).collect();
            return Err(Failure::usage(format!(
                "{name} has {} channels: choose one of {}",
                several.len(),
                names.join(", ")
            )));
        }
    };
    let shown = FalseColor::new(&channel.values, [picture.width, picture.height], range);
    shown.save_png(output)?;
    let gaps = if shown.has_gaps { ", grey where there is none" } else { "" };
    console.answer(&format!(
        "{}: {} from {} (dark) to {} (yellow){gaps}",
        output.display(),
        channel.name,
        shown.low,
        shown.high
    ));
    console.event(
        "layer",
        json!({ "file": path, "output": output, "layer": channel.name, "low": shown.low, "high": shown.high }),
    );
    Ok(())
}

/// `LOW,HIGH`.
fn ends(text: &str) -> Result<[f32; 2], Failure> {
    let shape = || Failure::usage(format!("--range takes LOW,HIGH with LOW below HIGH, found {text:?}"));
    let (low, high) = text.split_once(',').ok_or_else(shape)?;
    let number = |text: &str| finite(text.trim()).map_err(|_| shape());
    let ends = [number(low)? as f32, number(high)? as f32];
    if ends[0] < ends[1] && ends.iter().all(|end| end.is_finite()) { Ok(ends) } else { Err(shape()) }
}
