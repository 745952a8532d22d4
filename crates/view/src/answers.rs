//! Answers to questions about a picture: why a pixel is as it is, and the picture as a file.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{Vec2, Vec3};
use halflight_image::{Picture, Precision, ToneMapping, encode_png};
use halflight_render::Quiet;
use halflight_render::features::{FEATURE_LAYERS, add_layers};
use halflight_render::techniques::explain::{EXPLAIN, explain as explain_chain};
use halflight_render::vertex::Vertex;
use halflight_scene::Frame;
use serde_json::json;

use crate::hub::{Hub, Reply};
use crate::side::{Shown, identity, table_of};
use crate::{Stage, Swap};

/// Rays a pixel for the layers of a saved picture, at most: a person waits for it.
const SAVED_RAYS: u32 = 16;

/// Why is this pixel as it is?
pub(crate) struct Question {
    pub(crate) client: u64,
    /// Where, from 0 to 1.
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) side: usize,
    pub(crate) pixel: [usize; 2],
}

/// Answers with what is known, and with the chain that `halflight explain` prints once that has been worked out.
pub(crate) fn explain(
    question: &Question,
    side: &Shown,
    (stage, frame): (&Arc<Stage>, &Arc<Frame>),
    size: [usize; 2],
    hub: &Arc<Hub>,
) {
    let Question { client, x, y, side: number, pixel } = *question;
    let reply = move |text: &str, more: bool| {
        let side = if number == 0 { "a" } else { "b" };
        let reply = json!({ "kind": "explain", "text": text, "x": x, "y": y, "side": side, "more": more });
        Reply::Text(reply.to_string())
    };
    let text = known(question, side, frame, size);
    let chain = side.reference.is_none() && EXPLAIN.contains(&side.name.as_str());
    hub.reply(client, reply(&text, chain));
    if !chain {
        return;
    }
    let settings = match table_of(&side.name, stage, &side.settings) {
        Ok(settings) => settings,
        Err(reason) => return hub.reply(client, reply(&format!("{text}\n{reason}"), false)),
    };
    let (stage, frame, name) = (Arc::clone(stage), Arc::clone(frame), side.name.clone());
    let of_thread = Arc::clone(hub);
    let work = move || {
        let asked = (name.as_str(), &settings);
        let found = explain_chain(asked, &stage.scene, &frame, size, pixel, &Quiet);
        let chain = match found {
            Ok(Some(found)) => found.text.trim_end().to_string(),
            Ok(None) => String::new(),
            Err(reason) => reason,
        };
        of_thread.reply(client, reply(&format!("{text}\n\n{chain}"), false));
    };
    if std::thread::Builder::new().name("viewer explain".into()).spawn(work).is_err() {
        hub.reply_to_holder(Reply::Text(crate::server::error("cannot start a thread")));
    }
}

/// What the picture and the scene say of a pixel.
fn known(question: &Question, side: &Shown, frame: &Frame, size: [usize; 2]) -> String {
    let [column, row] = question.pixel;
    let of = if question.side == 0 { "left" } else { "right" };
    let mut lines =
        vec![format!("pixel {column}, {row} of {} × {}, {of}: {}", size[0], size[1], side.title())];
    let view = frame.camera.view(size[0], size[1]);
    let place = Vec2::new(column as f32 + 0.5, row as f32 + 0.5);
    let ray = view.ray(place, Vec2::splat(0.5), 0.0);
    match frame.world.closest(&ray) {
        None => lines
            .push(format!("nothing but the environment, {}", triple(frame.lights.escaped(ray.direction)))),
        Some(hit) => {
            let vertex = Vertex::new(frame, &ray, &hit);
            lines.push(format!("{} · material {}", frame.shape_name(hit.instance), vertex.material.name));
            lines.push(format!("position {} m", triple(vertex.surface.position)));
            lines.push(format!("normal {}", triple(vertex.shading_normal())));
            lines.push(format!("depth {:.4} m", view.depth(vertex.surface.position, 0.0)));
            lines.push(format!("albedo {}", triple(vertex.bsdf.albedo())));
        }
    }
    if let Some(reference) = &side.reference {
        let image = &reference.image;
        let (x, y) = (column * image.width / size[0], row * image.height / size[1]);
        lines.push(format!(
            "radiance {} in the stored picture",
            triple(Vec3::from(image.pixels[y * image.width + x]))
        ));
    } else if side.is_out() || side.film.min_samples() == 0 {
        lines.push("no radiance yet: the picture is being prepared".into());
    } else {
        let film = &side.film;
        let (x, y) = (column * film.width() / size[0], row * film.height() / size[1]);
        let found = film.map(|pixel| *pixel)[y * film.width() + x];
        let [r, g, b] = found.mean();
        lines.push(format!("radiance {}", triple(Vec3::new(r as f32, g as f32, b as f32))));
        let error = found.variance_of_mean().map(|variance| variance.sqrt());
        let error = error.map_or(String::new(), |error| format!(", standard error {error:.3e}"));
        let coarse = if [film.width(), film.height()] == size {
            String::new()
        } else {
            format!(", of a coarse picture of {} × {}", film.width(), film.height())
        };
        let plural = if found.samples == 1 { "" } else { "s" };
        lines.push(format!("{} sample{plural}{error}{coarse}", found.samples));
    }
    lines.extend(side.notes.iter().map(|note| format!("{}: {note}", side.name)));
    lines.join("\n")
}

/// What is said in a saved picture of how it was made.
pub(crate) struct Facts<'a> {
    pub(crate) stage: &'a Stage,
    pub(crate) frame: &'a Frame,
    /// Origin, target, up.
    pub(crate) camera: [Vec3; 3],
    pub(crate) seconds: f64,
    pub(crate) turn_degrees: f64,
    pub(crate) swap: &'a Swap,
    pub(crate) moved: &'a BTreeMap<String, Vec3>,
    pub(crate) exposure_ev: f32,
    pub(crate) vertical_fov_degrees: f32,
}

impl Facts<'_> {
    fn entries(&self, side: &Shown) -> Vec<(&'static str, String)> {
        let [origin, target, up] = self.camera.map(plain);
        let lens = &self.frame.camera;
        let identity = identity(&side.name, self.stage, &side.settings);
        let mut entries = vec![
            ("version", format!("halflight {}", env!("CARGO_PKG_VERSION"))),
            ("technique", identity.unwrap_or_else(|_| side.name.clone())),
            ("samples", side.film.min_samples().to_string()),
            ("scene", self.stage.name.clone()),
            ("time_seconds", self.seconds.to_string()),
            (
                "camera",
                format!(
                    "origin={origin} target={target} up={up} vertical_fov_degrees={} aperture_radius={} focus_distance={}",
                    self.vertical_fov_degrees, lens.aperture_radius, lens.focus_distance
                ),
            ),
            ("light_turn_degrees", self.turn_degrees.to_string()),
            ("exposure_ev", self.exposure_ev.to_string()),
        ];
        if !self.swap.environment.is_empty() {
            entries.push(("environment", self.swap.environment.clone()));
        }
        if !self.swap.materials.is_empty() {
            let materials =
                self.swap.materials.iter().map(|(number, text)| format!("shape {number}: {text}"));
            entries.push(("materials", materials.collect::<Vec<_>>().join("; ")));
        }
        if !self.moved.is_empty() {
            let moved = self.moved.iter().map(|(name, by)| format!("{name} {}", plain(*by)));
            entries.push(("moved", moved.collect::<Vec<_>>().join("; ")));
        }
        entries
    }
}

/// A picture of a side as a file: its name and bytes.
pub(crate) fn save(
    side: &mut Shown,
    format: &str,
    mapping: &ToneMapping,
    facts: &Facts<'_>,
) -> Result<(String, Vec<u8>), String> {
    let name = format!("{}.{format}", file_name(&facts.stage.name));
    if format == "png" {
        return Ok((name, encode_png(&side.film.image(), mapping)?));
    }
    let all: Vec<&str> = FEATURE_LAYERS.iter().map(|(name, _)| *name).collect();
    add_layers(facts.frame, &mut side.film, 0, &all, SAVED_RAYS);
    let mut picture: Picture = side.film.picture();
    let entries = facts.entries(side).into_iter().map(|(key, value)| (key.to_string(), value));
    picture.metadata.extend(entries);
    Ok((name, picture.encode_exr(Precision::Float)?))
}

fn triple(v: Vec3) -> String {
    format!("({:.4}, {:.4}, {:.4})", v.x, v.y, v.z)
}

fn plain(v: Vec3) -> String {
    format!("[{}, {}, {}]", v.x, v.y, v.z)
}

/// Letters, digits and dashes of a name.
fn file_name(name: &str) -> String {
    let last = name.rsplit(['/', '\\', ':']).next().unwrap_or(name);
    let stem = last.split('.').next().unwrap_or(last);
    let plain: String =
        stem.chars().filter(|c| c.is_ascii_alphanumeric() || *c == '-' || *c == '_').take(64).collect();
    if plain.is_empty() { "picture".into() } else { plain }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_files_hold_nothing_but_letters() {
        assert_eq!(file_name("demo:cone-man"), "cone-man");
        assert_eq!(file_name("../../etc/passwd"), "passwd");
        assert_eq!(file_name("…"), "picture");
    }
}
