//! Curves over logarithmic axes, as an SVG file of its own.
//!
//! The axes end at the decades around all points; each curve has a colour and a marker of its own, and its name beside
//! its last point.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use halflight_file::write_whole;

use super::failure::Failure;

/// A named line through points; what is not positive and finite is left out.
pub(crate) struct Line {
    pub(crate) name: String,
    pub(crate) points: Vec<(f64, f64)>,
}

/// One set of axes.
pub(crate) struct Panel {
    pub(crate) across: String,
    pub(crate) up: String,
    pub(crate) lines: Vec<Line>,
    /// A height that is drawn as a dotted line, and its name.
    pub(crate) mark: Option<(f64, String)>,
}

const WIDTH: f64 = 520.0;
const HEIGHT: f64 = 360.0;
/// Left, top, right, bottom.
const MARGIN: [f64; 4] = [70.0, 16.0, 104.0, 48.0];
/// Colours that stay apart for the common kinds of colour blindness (Okabe and Ito 2008), dark enough for a white ground.
const COLORS: [&str; 6] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#b08a00", "#555555"];

/// Writes panels side by side.
pub(crate) fn save(path: &Path, panels: &[Panel]) -> Result<(), Failure> {
    let text = svg(panels);
    Ok(write_whole(path, "plot", |to| to.write_all(text.as_bytes()))?)
}

fn svg(panels: &[Panel]) -> String {
    let width = WIDTH * panels.len().max(1) as f64;
    let mut to = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {HEIGHT}\" width=\"{width}\" height=\"{HEIGHT}\" \
         font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n"
    );
    for (number, panel) in panels.iter().enumerate() {
        let _ = writeln!(to, "<g transform=\"translate({} 0)\">", number as f64 * WIDTH);
        draw(&mut to, panel);
        to += "</g>\n";
    }
    to + "</svg>\n"
}

/// Logarithms from `low` to `high` on the screen from `start` to `end`.
struct Axis {
    low: f64,
    high: f64,
    start: f64,
    end: f64,
}

impl Axis {
    /// With some room around the values, and at least a factor of two long.
    fn around(values: impl Iterator<Item = f64>, start: f64, end: f64) -> Axis {
        let (low, high) = values
            .map(f64::log10)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
        let (low, high) = if low <= high { (low, high) } else { (0.0, 1.0) };
        let room = 0.06 * (high - low) + (0.3 - (high - low)).max(0.0) / 2.0;
        Axis { low: low - room, high: high + room, start, end }
    }

    fn place(&self, value: f64) -> f64 {
        self.start + (value.log10() - self.low) / (self.high - self.low) * (self.end - self.start)
    }

    /// Values that are labelled: decades, and between them 2 and 5, or each digit, where there are few.
    fn lines(&self) -> Vec<f64> {
        let of = |steps: &[f64]| -> Vec<f64> {
            let decades = self.low.floor() as i32..=self.high.ceil() as i32;
            let all = decades.flat_map(|decade| steps.iter().map(move |step| step * 10f64.powi(decade)));
            all.filter(|v| (self.low..=self.high).contains(&v.log10())).collect()
        };
        let sets: [&[f64]; 3] = [&[1.0], &[1.0, 2.0, 5.0], &[1.0, 1.2, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0]];
        sets.into_iter().map(of).find(|lines| lines.len() >= 3).unwrap_or_else(|| of(sets[2]))
    }
}

/// A number without digits that say nothing.
fn label(value: f64) -> String {
    match value {
        v if v >= 1e6 => format!("{} M", round(v / 1e6)),
        v if v >= 1e3 => format!("{} k", round(v / 1e3)),
        v => round(v),
    }
}

fn round(value: f64) -> String {
    let digits = (2.0 - value.abs().log10().floor()).clamp(0.0, 6.0) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_string() } else { text }
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

fn draw(to: &mut String, panel: &Panel) {
    let drawable = |&&(x, y): &&(f64, f64)| x > 0.0 && y > 0.0 && x.is_finite() && y.is_finite();
    let points = || panel.lines.iter().flat_map(|line| line.points.iter().filter(drawable));
    let marked = panel.mark.iter().map(|mark| mark.0);
    let x = Axis::around(points().map(|p| p.0), MARGIN[0], WIDTH - MARGIN[2]);
    let y = Axis::around(points().map(|p| p.1).chain(marked), HEIGHT - MARGIN[3], MARGIN[1]);
    for value in x.lines() {
        let at = x.place(value);
        let _ = writeln!(
            to,
            "<path stroke=\"#ddd\" d=\"M{at:.1} {:.1}V{:.1}\"/><text x=\"{at:.1}\" y=\"{:.1}\" \
             text-anchor=\"middle\">{}</text>",
            y.start,
            y.end,
            y.start + 18.0,
            label(value)
        );
    }
    for value in y.lines() {
        let at = y.place(value);
        let _ = writeln!(
            to,
            "<path stroke=\"#ddd\" d=\"M{:.1} {at:.1}H{:.1}\"/><text x=\"{:.1}\" y=\"{:.1}\" \
             text-anchor=\"end\">{}</text>",
            x.start,
            x.end,
            x.start - 7.0,
            at + 4.0,
            label(value)
        );
    }
    let _ = writeln!(
        to,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>\
         <text transform=\"translate(16 {:.1}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
        0.5 * (x.start + x.end),
        HEIGHT - 10.0,
        escape(&panel.across),
        0.5 * (y.start + y.end),
        escape(&panel.up)
    );
    if let Some((height, name)) = &panel.mark {
        let at = y.place(*height);
        let _ = writeln!(
            to,
            "<path stroke=\"#888\" stroke-dasharray=\"3 4\" d=\"M{:.1} {at:.1}H{:.1}\"/>\
             <text fill=\"#666\" x=\"{:.1}\" y=\"{:.1}\">{}</text>",
            x.start,
            x.end,
            x.end + 8.0,
            at + 4.0,
            escape(name)
        );
    }
    // Names beside the last points, pushed apart where they are close.
    let mut names: Vec<(f64, usize)> = Vec::new();
    for (number, line) in panel.lines.iter().enumerate() {
        let color = COLORS[number % COLORS.len()];
        let places: Vec<(f64, f64)> =
            line.points.iter().filter(drawable).map(|p| (x.place(p.0), y.place(p.1))).collect();
        let Some(last) = places.last() else { continue };
        let path: Vec<String> = places.iter().map(|(x, y)| format!("{x:.1} {y:.1}")).collect();
        let _ = writeln!(
            to,
            "<path fill=\"none\" stroke=\"{color}\" stroke-width=\"2\" d=\"M{}\"/>",
            path.join("L")
        );
        for (x, y) in &places {
            let shape = match number % 3 {
                0 => format!("M{:.1} {y:.1}a4 4 0 1 0 8 0a4 4 0 1 0 -8 0z", x - 4.0),
                1 => format!("M{:.1} {:.1}h7v7h-7z", x - 3.5, y - 3.5),
                _ => format!("M{x:.1} {:.1}l5 8.5h-10z", y - 5.0),
            };
            let _ = writeln!(to, "<path fill=\"{color}\" d=\"{shape}\"/>");
        }
        names.push((last.1, number));
    }
    names.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mark = panel.mark.as_ref().map(|mark| y.place(mark.0));
    let mut above = f64::NEG_INFINITY;
    for (height, number) in names {
        let mut at = height.max(above + 15.0);
        // Above the dotted line's own name.
        if let Some(mark) = mark.filter(|mark| (at - mark).abs() < 15.0) {
            at = if above + 15.0 <= mark - 15.0 { mark - 15.0 } else { mark + 15.0 };
        }
        above = at;
        let _ = writeln!(
            to,
            "<text fill=\"{}\" x=\"{:.1}\" y=\"{:.1}\">{}</text>",
            COLORS[number % COLORS.len()],
            x.end + 8.0,
            at + 4.0,
            escape(&panel.lines[number].name)
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plot_holds_each_curve_and_leaves_out_what_has_no_logarithm() {
        let line = |name: &str, points: &[(f64, f64)]| Line { name: name.into(), points: points.to_vec() };
        let panel = Panel {
            across: "samples".into(),
            up: "a < b".into(),
            lines: vec![
                line("one", &[(1e3, 0.5), (1e4, 0.0), (1e6, 0.2)]),
                line("none", &[(0.0, 1.0), (f64::NAN, 2.0)]),
            ],
            mark: Some((0.1, "floor".into())),
        };
        let text = svg(&[panel]);
        assert!(text.contains(">one</text>") && text.contains(">floor</text>") && !text.contains(">none<"));
        assert!(text.contains("a &lt; b") && !text.contains("NaN") && !text.contains("inf"));
        assert_eq!(text.matches("a4 4 0 1 0 8 0").count(), 2);
        assert!(svg(&[]).ends_with("</svg>\n"));
    }

    #[test]
    fn labels_are_short() {
        for (value, text) in [(1e3, "1 k"), (2e6, "2 M"), (0.12, "0.12"), (0.5, "0.5"), (30.0, "30")] {
            assert_eq!(label(value), text);
        }
    }
}
