//! The page itself: `page.html` with its gaps filled.

use std::io::Write;
use std::path::Path;

use halflight_file::{SaveError, write_whole};

use super::text::{error, escape, percent, plain, script_json};
use super::{Figures, Note, Report, Row, plot};

const HTML: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

impl Report {
    /// The figures of the candidates, in their order.
    pub fn rows(&self) -> &[Row] {
        &self.figures.candidates
    }

    /// The page, whole.
    pub fn to_html(&self) -> String {
        let figures = &self.figures;
        let fill = |gap: &str| match gap {
            "title" => escape(&figures.title),
            "subtitle" => subtitle(figures),
            "style" => STYLE.to_owned(),
            "script" => SCRIPT.to_owned(),
            "data" => script_json(&self.shown),
            "exposure" => exposure(figures.exposure_ev),
            "warnings" => figures.candidates.iter().map(warning).collect(),
            "figures" => table(figures),
            "plots" => plot::section(&figures.curves),
            "notes" => notes(&figures.notes),
            unknown => unreachable!("page.html has a gap called {unknown}"),
        };
        fill_gaps(HTML, fill)
    }

    /// The figures as JSON.
    pub fn to_json(&self) -> String {
        // Strings, numbers and options of them: there is nothing that serde_json could refuse.
        serde_json::to_string_pretty(&self.figures).unwrap_or_default() + "\n"
    }

    /// Writes the page.
    ///
    /// # Errors
    /// Whatever the file system says.
    pub fn write_html(&self, path: impl AsRef<Path>) -> Result<(), SaveError> {
        write_whole(path.as_ref(), "comparison page", |out| out.write_all(self.to_html().as_bytes()))
    }

    /// Writes the figures.
    ///
    /// # Errors
    /// Whatever the file system says.
    pub fn write_json(&self, path: impl AsRef<Path>) -> Result<(), SaveError> {
        write_whole(path.as_ref(), "comparison figures", |out| out.write_all(self.to_json().as_bytes()))
    }
}

/// The template with `fill(name)` in place of each `{{name}}`; what is filled in is not looked at again.
fn fill_gaps(template: &str, fill: impl Fn(&str) -> String) -> String {
    let mut out = String::new();
    let mut rest = template;
    while let Some((before, (gap, after))) =
        rest.split_once("{{").and_then(|(before, from)| Some((before, from.split_once("}}")?)))
    {
        out.push_str(before);
        out.push_str(&fill(gap));
        rest = after;
    }
    out + rest
}

fn subtitle(figures: &Figures) -> String {
    let count = figures.candidates.len();
    let pictures = if count == 1 { "1 picture".into() } else { format!("{count} pictures") };
    let reference = escape(&figures.reference);
    format!("{pictures} against {reference} · {} × {} pixels", figures.width, figures.height)
}

fn exposure(ev: f32) -> String {
    let by = match ev {
        0.0 => "Shown as they are (0 EV)".into(),
        _ => {
            let sign = if ev < 0.0 { "−" } else { "+" };
            let times = plain(f64::from(ev.exp2()));
            format!("Exposed by {sign}{} EV (× {times})", plain(f64::from(ev.abs())))
        }
    };
    format!("{by}, clamped to [0, 1] and encoded as sRGB; so are PSNR and FLIP.")
}

fn warning(row: &Row) -> String {
    let n = row.non_finite;
    if n.left_out == 0 {
        return String::new();
    }
    let pixels = if n.left_out == 1 { "pixel was" } else { "pixels were" };
    format!(
        "<p class=\"warning\"><b>{}</b>: {} {pixels} left out of the figures, since a NaN or an infinity is there \
         ({} in the picture, {} in the reference). The maps show them in bright green.</p>\n",
        escape(&row.name),
        n.left_out,
        n.image,
        n.reference
    )
}

/// A column of the table.
struct Column {
    head: &'static str,
    value: fn(&Row) -> Option<f64>,
    text: fn(f64) -> String,
    better: Better,
}

/// Which of two values of a column is the better one.
#[derive(Clone, Copy, PartialEq)]
enum Better {
    Less,
    More,
    Neither,
}

const COLUMNS: [Column; 10] = [
    Column { head: "relMSE", value: |r| Some(r.relative_mse), text: error, better: Better::Less },
    Column {
        head: "relMSE<br>less noise",
        value: |r| r.relative_mse_without_noise,
        text: error,
        better: Better::Neither,
    },
    Column {
        head: "PSNR<br>dB",
        value: |r| Some(r.psnr_db.unwrap_or(f64::INFINITY)),
        text: decibels,
        better: Better::More,
    },
    Column { head: "FLIP<br>mean", value: |r| Some(r.flip), text: four, better: Better::Less },
    Column { head: "HDR-FLIP<br>mean", value: |r| r.hdr_flip, text: four, better: Better::Less },
    Column {
        head: "Brightness<br>error",
        value: |r| r.brightness_error,
        text: percent,
        better: Better::Neither,
    },
    Column { head: "Largest<br>error", value: |r| Some(r.max_error), text: plain, better: Better::Neither },
    Column { head: "Time<br>s", value: |r| r.seconds, text: plain, better: Better::Less },
    Column { head: "Samples<br>per pixel", value: |r| r.samples, text: plain, better: Better::Neither },
    Column { head: "Peak memory<br>MiB", value: |r| r.peak_memory_mib, text: plain, better: Better::Less },
];

fn decibels(value: f64) -> String {
    if value.is_finite() { format!("{value:.2}") } else { "∞".into() }
}

fn four(value: f64) -> String {
    format!("{value:.4}")
}

fn table(figures: &Figures) -> String {
    let rows = &figures.candidates;
    // A column of which nothing is known is left out.
    let columns: Vec<&Column> =
        COLUMNS.iter().filter(|column| rows.iter().any(|row| (column.value)(row).is_some())).collect();
    let heads: String = columns.iter().map(|c| format!("<th scope=\"col\">{}</th>", c.head)).collect();
    let body: String = rows
        .iter()
        .map(|row| {
            let cells: String = columns.iter().map(|column| cell(column, row, rows)).collect();
            let name = escape(&row.name);
            format!(
                "<tr><th scope=\"row\"><button type=\"button\" title=\"Show {name}\">{name}</button></th>{cells}</tr>\n"
            )
        })
        .collect();
    format!(
        "<section aria-labelledby=\"figures-title\">\n<h2 id=\"figures-title\">Figures</h2>\n\
         <div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-labelledby=\"figures-title\"><table>\n\
         <thead><tr><th scope=\"col\">Candidate</th>{heads}</tr></thead>\n<tbody>\n{body}</tbody>\n</table></div>\n</section>"
    )
}

fn cell(column: &Column, row: &Row, rows: &[Row]) -> String {
    let Some(value) = (column.value)(row) else {
        return "<td class=\"none\"><span aria-label=\"not known\">—</span></td>".into();
    };
    let others = rows.iter().filter_map(|r| (column.value)(r));
    let best = rows.len() > 1
        && match column.better {
            Better::Less => value <= others.fold(f64::INFINITY, f64::min),
            Better::More => value >= others.fold(f64::NEG_INFINITY, f64::max),
            Better::Neither => false,
        };
    let class = if best { " class=\"best\" title=\"The best of these\"" } else { "" };
    format!("<td{class}>{}</td>", (column.text)(value))
}

fn notes(notes: &[Note]) -> String {
    if notes.is_empty() {
        return String::new();
    }
    let lines: String = notes
        .iter()
        .map(|note| format!("<dt>{}</dt><dd>{}</dd>\n", escape(&note.label), escape(&note.value)))
        .collect();
    format!(
        "<section aria-labelledby=\"notes-title\">\n<h2 id=\"notes-title\">How it was made</h2>\n\
         <dl class=\"notes\">\n{lines}</dl>\n</section>"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_filled_once() {
        let filled = fill_gaps("a {{x}} b {{y}} c }} {{", |gap| format!("<{gap}{{{{x}}}}>"));
        assert_eq!(filled, "a <x{{x}}> b <y{{x}}> c }} {{");
    }
}
