//! What is in a mesh or a model.

use std::path::Path;

use halflight_shape::{Model, load_model};
use serde_json::json;

use super::{Description, field, numbers};
use crate::command::failure::Failure;
use crate::command::words;

/// Longer lists are cut.
const LISTED: usize = 12;

pub(super) fn describe(path: &Path) -> Result<Description, Failure> {
    let model = load_model(path)?;
    let vertices: usize = model.meshes.iter().map(|m| m.mesh.positions.len()).sum();
    let stored: usize = model.meshes.iter().map(|m| m.mesh.triangles.len()).sum();
    let drawn = model.triangle_count();
    let bounds = model.bounds(0.0);
    let mut text = format!("{}: model\n", path.display());
    field(
        &mut text,
        "triangles",
        if drawn == stored { drawn.to_string() } else { format!("{drawn} drawn, {stored} stored") },
    );
    field(&mut text, "vertices", vertices);
    if let Some((low, high)) = bounds {
        let [low, high] = [low, high].map(|v| v.as_dvec3().to_array());
        field(&mut text, "from", numbers(low));
        field(&mut text, "to", numbers(high));
    }
    field(&mut text, "attributes", attributes(&model));
    field(&mut text, "meshes", words::count(model.meshes.len() as f64, "mesh").replace("meshs", "meshes"));
    list(&mut text, "materials", model.materials.iter().map(|m| m.name.clone()));
    list(&mut text, "animations", model.animations.iter().map(|a| a.name.clone()));
    if let Some(duration) = model.duration() {
        field(&mut text, "duration", words::seconds(f64::from(duration)));
    }
    for (label, count) in [
        ("skins", model.skins.len()),
        ("pictures", model.images.len()),
        ("cameras", model.cameras.len()),
        ("lights", model.lights.len()),
    ] {
        if count > 0 {
            field(&mut text, label, count);
        }
    }
    for warning in &model.warnings {
        field(&mut text, "warning", warning);
    }
    let json = json!({
        "kind": "model", "triangles": drawn, "stored_triangles": stored, "vertices": vertices,
        "bounds": bounds.map(|(low, high)| [low.to_array(), high.to_array()]),
        "materials": model.materials.iter().map(|m| &m.name).collect::<Vec<_>>(),
        "animations": model.animations.len(), "duration_seconds": model.duration(), "skins": model.skins.len(),
        "warnings": model.warnings,
    });
    Ok(Description { text, json })
}

fn attributes(model: &Model) -> String {
    let has = |f: &dyn Fn(&halflight_shape::TriangleMesh) -> bool| model.meshes.iter().any(|m| f(&m.mesh));
    let all = [
        (has(&|m| !m.normals.is_empty()), "normals"),
        (has(&|m| !m.uvs.is_empty()), "texture coordinates"),
        (has(&|m| !m.tangents.is_empty()), "tangents"),
        (has(&|m| !m.colors.is_empty()), "colours"),
    ];
    let found: Vec<&str> = all.iter().filter(|(there, _)| *there).map(|(_, name)| *name).collect();
    if found.is_empty() { "positions only".into() } else { found.join(", ") }
}

fn list(text: &mut String, label: &str, names: impl ExactSizeIterator<Item = String>) {
    let count = names.len();
    if count == 0 {
        return;
    }
    let shown: Vec<String> =
        names.take(LISTED).map(|name| if name.is_empty() { "unnamed".into() } else { name }).collect();
    let more = if count > LISTED { format!(" and {} more", count - LISTED) } else { String::new() };
    field(text, label, format!("{count}: {}{more}", shown.join(", ")));
}
