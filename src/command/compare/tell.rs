//! The figures of a comparison as tables.

use halflight_image::report::{Figures, Row};
use serde_json::json;

use crate::command::console::Console;
use crate::command::table::Table;
use crate::command::words;

/// The size of a mebibyte.
const MIB: f64 = (1 << 20) as f64;

pub(super) fn tell(console: Console, figures: &Figures) {
    let mut text =
        format!("against {}, {} × {} pixels\n\n", figures.reference, figures.width, figures.height);
    text += &candidates(figures).to_text();
    if figures.curves.iter().any(|curve| curve.points.len() > 1) {
        text += &format!("\n\n{}", budgets(figures).to_text());
    }
    console.answer(&text);
    for row in &figures.candidates {
        if row.non_finite.left_out > 0 {
            console.warn(&format!(
                "{} pixels of {} or its reference are not finite and are left out",
                row.non_finite.left_out, row.name
            ));
        }
    }
    console.event("compared", json!({ "figures": serde_json::to_value(figures).unwrap_or_default() }));
}

fn candidates(figures: &Figures) -> Table {
    let timed = figures.candidates.iter().any(|row| row.seconds.is_some() || row.samples.is_some());
    let mut heading = vec!["picture", "relMSE", "PSNR dB", "FLIP", "HDR-FLIP", "max error", "brightness"];
    if timed {
        heading.extend(["samples", "seconds", "peak memory"]);
    }
    let mut table = Table::new(heading);
    for row in &figures.candidates {
        let mut cells = errors(row);
        if timed {
            cells.push(or_dash(row.samples.map(words::figure)));
            cells.push(or_dash(row.seconds.map(words::figure)));
            cells.push(or_dash(row.peak_memory_mib.map(|mib| words::bytes((mib * MIB) as u64))));
        }
        table.row(cells);
    }
    table
}

fn errors(row: &Row) -> Vec<String> {
    vec![
        row.name.clone(),
        words::figure(row.relative_mse),
        row.psnr_db.map_or_else(|| "∞".into(), |db| format!("{db:.2}")),
        words::figure(row.flip),
        or_dash(row.hdr_flip.map(words::figure)),
        words::figure(row.max_error),
        or_dash(row.brightness_error.map(|error| format!("{:+.2} %", 100.0 * error))),
    ]
}

fn budgets(figures: &Figures) -> Table {
    let mut table = Table::new(["technique", "samples", "seconds", "relMSE"]);
    for curve in &figures.curves {
        for point in &curve.points {
            table.row([
                curve.name.clone(),
                words::figure(point.samples),
                words::figure(point.seconds),
                words::figure(point.relative_mse),
            ]);
        }
    }
    table
}

fn or_dash(text: Option<String>) -> String {
    text.unwrap_or_else(|| "–".into())
}
