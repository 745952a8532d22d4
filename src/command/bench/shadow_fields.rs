//! How well precomputed shadow fields stand for their objects, and what they cost.

use std::sync::Arc;

use halflight_render::techniques::shadow_fields::field_accuracy;
use halflight_shape::procedural::mesh as shapes;

use super::super::failure::Failure;
use super::{BenchArgs, Findings};
use crate::command::table::Table;

/// Order, shells, directions: each varied about the default.
const SETTINGS: [[u32; 3]; 12] = [
    [3, 16, 16],
    [4, 16, 16],
    [5, 16, 16],
    [6, 16, 16],
    [4, 4, 16],
    [4, 8, 16],
    [4, 24, 16],
    [4, 32, 16],
    [4, 16, 4],
    [4, 16, 8],
    [4, 16, 24],
    [4, 16, 32],
];

pub(super) fn measure(args: &BenchArgs) -> Result<Findings, Failure> {
    let mesh = Arc::new(shapes::knot(2, 3, 0.4, 0.13, 128, 24));
    let settings = if args.quick { &SETTINGS[..2] } else { &SETTINGS[..] };
    let rays = if args.quick { 64 } else { 512 };
    let mut table =
        Table::new(["order", "shells", "directions", "memory", "seconds", "field", "shadow", "no shadows"]);
    for row in field_accuracy(&mesh, settings, rays, args.machine.simd()?) {
        table.row([
            row.order.to_string(),
            row.shells.to_string(),
            row.directions.to_string(),
            format!("{:.0} kB", row.memory_bytes as f64 / 1e3),
            format!("{:.2}", row.seconds),
            format!("{:.2} %", 100.0 * row.interpolation),
            format!("{:.2} %", 100.0 * row.irradiance),
            format!("{:.2} %", 100.0 * row.without),
        ]);
    }
    let notes = vec![
        format!("the field of a knot, {rays} rays a vector, at 256 points 1.05 to 6 bounding radii away"),
        "field: root mean square error of visibility against rays projected to the same order".into(),
        "shadow: mean error of the irradiance that is hidden of a lobe of light (exponent 8), in parts of all its light".into(),
    ];
    Ok(Findings { title: "Shadow fields", table, notes })
}
