//! `halflight ddf eval`.

use std::cell::Cell;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use halflight_ddf::{DirectedField, F_SCORE_THRESHOLD, RayErrors, evaluate_while};
use serde_json::json;

use super::super::console::Console;
use super::super::failure::Failure;
use super::super::info::field as line;
use super::super::table::Table;
use super::super::{interrupt, words};

/// A figure, or a dash where there was nothing to measure.
fn of(count: usize, figure: String) -> String {
    if count == 0 { "–".into() } else { figure }
}

/// How long a field was trained; a training of so many steps keeps no time, so that its file is the same each time.
fn training(steps: u64, seconds: f64) -> String {
    let steps = words::count(steps as f64, "step");
    if seconds > 0.0 { format!("{steps}, {}", words::seconds(seconds)) } else { steps }
}

pub(super) fn run(path: &Path, mesh_path: &Path, points: usize, console: Console) -> Result<(), Failure> {
    let field = DirectedField::load(path)?;
    let mesh = super::load_mesh(mesh_path, console)?;
    super::warn_of_other_mesh((path, &field), (mesh_path, &mesh), console);
    let unit_mesh = Arc::new(field.unit().mesh_to_unit(&mesh));
    let start = Instant::now();
    interrupt::listen();
    let shown = Cell::new(Instant::now());
    let go_on = |part: f32| {
        if shown.get().elapsed() > Duration::from_secs(5) {
            shown.set(Instant::now());
            super::tell(console, "measured", part);
        }
        !interrupt::is_asked_to_stop()
    };
    let found = evaluate_while(&field, &unit_mesh, points, 1, &go_on).ok_or(Failure::Interrupted)?;
    let seconds = start.elapsed().as_secs_f64();
    let bytes = std::fs::metadata(path).map(|m| m.len()).unwrap_or(0);
    let figure = words::figure;
    let mut text = format!(
        "{}: against {} triangles of {}, in the unit sphere (radius 1), {points} points a side and rays a kind\n",
        path.display(),
        mesh.triangles.len(),
        mesh_path.display()
    );
    let clouds = &found.clouds;
    line(
        &mut text,
        "Chamfer × 10³",
        format!(
            "{} (sum of both mean squared distances; two clouds of the mesh itself: {})",
            figure(clouds.chamfer_e3),
            figure(found.floor_e3)
        ),
    );
    line(
        &mut text,
        "sided × 10³",
        format!(
            "field to mesh {}, mesh to field {}",
            figure(clouds.first_to_second_e3),
            figure(clouds.second_to_first_e3)
        ),
    );
    line(&mut text, "f-score", format!("{} (within {F_SCORE_THRESHOLD})", figure(clouds.f_score)));
    line(
        &mut text,
        "size",
        format!(
            "{} in the file, {} in memory, {} parameters",
            words::bytes(bytes),
            words::bytes(field.memory_bytes() as u64),
            field.parameters()
        ),
    );
    let from = &field.provenance;
    line(&mut text, "training", training(from.steps, from.seconds));
    let mut table = Table::new([
        "rays",
        "right",
        "lost",
        "invented",
        "depth, mean",
        "median",
        "95 %",
        "normal, mean",
        "median",
    ]);
    for (name, errors) in [("from outside", &found.primary), ("leaving", &found.secondary)] {
        table.row([
            name.to_string(),
            format!("{:.2} %", 100.0 * errors.visibility),
            format!("{:.2} %", 100.0 * errors.lost),
            format!("{:.2} %", 100.0 * errors.invented),
            of(errors.hits, figure(errors.depth_mean)),
            of(errors.hits, figure(errors.depth_median)),
            of(errors.hits, figure(errors.depth_p95)),
            of(errors.normals, format!("{:.1}°", errors.normal_mean_degrees)),
            of(errors.normals, format!("{:.1}°", errors.normal_median_degrees)),
        ]);
    }
    text += &table.to_text();
    console.answer(text.trim_end());
    let rays = |e: &RayErrors| {
        json!({
            "visibility": e.visibility, "lost": e.lost, "invented": e.invented, "depth_mean": e.depth_mean,
            "depth_median": e.depth_median, "depth_p95": e.depth_p95, "across_p95": e.across_p95,
            "normal_mean_degrees": e.normal_mean_degrees, "normal_median_degrees": e.normal_median_degrees, "hits": e.hits, "normals": e.normals,
        })
    };
    console.event(
        "eval",
        json!({
            "points": points, "chamfer_e3": clouds.chamfer_e3, "floor_e3": found.floor_e3,
            "field_to_mesh_e3": clouds.first_to_second_e3, "mesh_to_field_e3": clouds.second_to_first_e3,
            "f_score": clouds.f_score, "bytes": bytes, "memory_bytes": field.memory_bytes(),
            "parameters": field.parameters(), "steps": from.steps, "training_seconds": from.seconds,
            "seconds": seconds, "from_outside": rays(&found.primary), "leaving": rays(&found.secondary),
        }),
    );
    Ok(())
}
