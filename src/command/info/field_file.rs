//! What is in a field of directed distances.

use std::path::Path;

use halflight_ddf::{DirectedField, FieldShape};
use serde_json::json;

use super::{Description, field as line, numbers};
use crate::command::failure::Failure;
use crate::command::words;

pub(super) fn describe(path: &Path) -> Result<Description, Failure> {
    let field = DirectedField::load(path)?;
    let (from, error) = (&field.provenance, &field.error);
    let (network, resolution) = match field.shape() {
        FieldShape::Fast(shape) => (
            format!(
                "{} of {}³ cells, {} features, {} × {} neurons",
                field.occupied_cells(),
                shape.resolution,
                shape.features,
                shape.layers,
                shape.hidden
            ),
            Some(shape.resolution),
        ),
        FieldShape::Seed(shape) => {
            (format!("the seed's, {} × {} neurons, δ = {}", shape.layers, shape.width, shape.delta), None)
        }
    };
    let (low, high) = field.bounds();
    let mut text = format!("{}: field of directed distances\n", path.display());
    line(
        &mut text,
        "learned from",
        format!("{} ({} triangles, {})", from.source, from.source_triangles, from.source_hash),
    );
    line(&mut text, "training", format!("{} steps, seed {}", from.steps, from.seed));
    line(&mut text, "from", numbers(low.as_dvec3().to_array()));
    line(&mut text, "to", numbers(high.as_dvec3().to_array()));
    line(&mut text, "network", &network);
    line(&mut text, "parameters", field.parameters());
    line(&mut text, "memory", words::bytes(field.memory_bytes() as u64));
    line(
        &mut text,
        "measured",
        format!(
            "Chamfer × 10³ {}, depth {} (95 %: {}), {:.2} % of hits and misses right, normals {:.1}°",
            words::figure(error.chamfer_e3.into()),
            words::figure(error.depth_mean.into()),
            words::figure(error.depth_p95.into()),
            100.0 * error.visibility,
            error.normal_mean_degrees
        ),
    );
    let json = json!({
        "kind": "field", "source": from.source, "source_hash": from.source_hash, "source_triangles": from.source_triangles,
        "steps": from.steps, "seed": from.seed, "bounds": [low.to_array(), high.to_array()],
        "network": network, "resolution": resolution, "cells": field.occupied_cells(), "parameters": field.parameters(),
        "memory_bytes": field.memory_bytes(), "chamfer_e3": error.chamfer_e3, "depth_mean": error.depth_mean,
        "depth_p95": error.depth_p95, "visibility": error.visibility,
        "normal_mean_degrees": error.normal_mean_degrees,
    });
    Ok(Description { text, json })
}
