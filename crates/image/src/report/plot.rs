//! Error over time and over samples, as inline SVG on logarithmic axes.

use super::text::{error, escape, plain};
use super::{Curve, CurvePoint};

/// Eight colours that stay apart for the common kinds of colour blindness, light enough for a dark ground (after
/// Okabe and Ito, 2008). Markers tell curves apart as well, so that nothing hangs on colour alone.
const COLORS: [&str; 8] =
    ["#56b4e9", "#f0a22e", "#2fc49b", "#f0e442", "#e58fc0", "#ee7340", "#a9a4ff", "#c3c7cb"];

const WIDTH: f64 = 620.0;
const HEIGHT: f64 = 400.0;
/// Left, top, right, bottom: room for axis labels, and on the right for the names of the curves.
const MARGIN: [f64; 4] = [66.0, 14.0, 142.0, 50.0];

/// What runs along an axis.
#[derive(Clone, Copy)]
struct Quantity {
    label: &'static str,
    of: fn(&CurvePoint) -> f64,
    text: fn(f64) -> String,
}

const SECONDS: Quantity = Quantity { label: "time in seconds", of: |p| p.seconds, text: plain };
const SAMPLES: Quantity = Quantity { label: "samples per pixel", of: |p| p.samples, text: plain };
const ERROR: Quantity = Quantity { label: "relMSE", of: |p| p.relative_mse, text: error };

/// A logarithmic axis from `low` to `high` (decimal logarithms), on the screen from `start` to `end`.
struct Axis {
    low: f64,
    high: f64,
    start: f64,
    end: f64,
}

/// The section with both plots; empty if there is nothing to draw a line through.
pub(super) fn section(curves: &[Curve]) -> String {
    let plots: String =
        [SECONDS, SAMPLES].iter().enumerate().filter_map(|(i, along)| plot(curves, *along, i)).collect();
    if plots.is_empty() {
        return plots;
    }
    format!(
        "<section aria-labelledby=\"plots-title\">\n<h2 id=\"plots-title\">Error over time</h2>\n\
         <div class=\"plots\">\n{plots}</div>\n\
         <p class=\"note\">Both axes are logarithmic. The dotted line falls as fast as independent samples do: \
         twice the work, half the error.</p>\n</section>"
    )
}

fn plot(curves: &[Curve], along: Quantity, number: usize) -> Option<String> {
    // A logarithm needs a positive value; the color of a curve does not depend on what the others hold.
    let drawable = |p: &CurvePoint| [(along.of)(p), p.relative_mse].iter().all(|v| *v > 0.0 && v.is_finite());
    let curves: Vec<(usize, &str, Vec<CurvePoint>)> = curves
        .iter()
        .enumerate()
        .map(|(i, c)| (i, c.name.as_str(), c.points.iter().copied().filter(drawable).collect::<Vec<_>>()))
        .filter(|(_, _, points)| !points.is_empty())
        .collect();
    if curves.iter().all(|(_, _, points)| points.len() < 2) {
        return None;
    }
    let points = || curves.iter().flat_map(|(_, _, points)| points);
    let x = Axis::around(points().map(along.of), MARGIN[0], WIDTH - MARGIN[2]);
    let y = Axis::around(points().map(ERROR.of), HEIGHT - MARGIN[3], MARGIN[1]);

    let mut svg = format!(
        "<figure class=\"plot\"><svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-labelledby=\"plot-{number}\">\
         <title id=\"plot-{number}\">relMSE against {}, {}</title>\n",
        along.label,
        escape(&curves.iter().map(|(_, name, _)| *name).collect::<Vec<_>>().join(", "))
    );
    svg += &grid(&x, &y, along);
    svg += &guide(&x, &y, points(), along);
    for (i, name, points) in &curves {
        svg += &curve(*i, name, points, &x, &y, along);
    }
    svg += &names(&curves, &x, &y, along);
    svg += "</svg></figure>\n";
    Some(svg)
}

impl Axis {
    /// An axis with room for all values: from a tenth of a decade below to as much above, at least a decade long.
    fn around(values: impl Iterator<Item = f64>, start: f64, end: f64) -> Self {
        let (low, high) = values
            .map(f64::log10)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
        let widen = (1.0 - (high - low)).max(0.0) / 2.0;
        Self { low: low - widen - 0.1, high: high + widen + 0.1, start, end }
    }

    fn place(&self, value: f64) -> f64 {
        self.start + (value.log10() - self.low) / (self.high - self.low) * (self.end - self.start)
    }

    /// The values of the lines of the grid, and whether each is a whole decade.
    fn lines(&self) -> Vec<(f64, bool)> {
        let decades = (self.low.floor() as i32)..=(self.high.ceil() as i32);
        // Over many decades the lines between would run together.
        let steps: &[f64] = if self.high - self.low <= 5.0 { &[1.0, 2.0, 5.0] } else { &[1.0] };
        decades
            .flat_map(|decade| steps.iter().map(move |step| (step * 10_f64.powi(decade), *step == 1.0)))
            .filter(|(value, _)| (self.low..=self.high).contains(&value.log10()))
            .collect()
    }

    /// Whether the lines between decades need labels too, since there are too few decades.
    fn labels_all(&self) -> bool {
        self.lines().iter().filter(|(_, decade)| *decade).count() < 3
    }
}

fn grid(x: &Axis, y: &Axis, along: Quantity) -> String {
    let mut svg = String::new();
    for (value, decade) in x.lines() {
        let at = x.place(value);
        let class = if decade { "grid" } else { "minor" };
        svg += &format!("<path class=\"{class}\" d=\"M{at:.1} {:.1}V{:.1}\"/>", y.start, y.end);
        if decade || x.labels_all() {
            let text = (along.text)(value);
            svg += &format!(
                "<text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{text}</text>",
                y.start + 18.0
            );
        }
    }
    for (value, decade) in y.lines() {
        let at = y.place(value);
        let class = if decade { "grid" } else { "minor" };
        svg += &format!("<path class=\"{class}\" d=\"M{:.1} {at:.1}H{:.1}\"/>", x.start, x.end);
        if decade || y.labels_all() {
            let text = format!("{value:.0e}");
            svg += &format!(
                "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{text}</text>",
                x.start - 8.0,
                at + 4.0
            );
        }
    }
    let (middle, below) = ((x.start + x.end) / 2.0, HEIGHT - 10.0);
    svg += &format!("<text x=\"{middle:.1}\" y=\"{below}\" text-anchor=\"middle\">{}</text>", along.label);
    let middle = (y.start + y.end) / 2.0;
    svg + &format!(
        "<text transform=\"translate(14 {middle:.1}) rotate(-90)\" text-anchor=\"middle\">relMSE</text>\n"
    )
}

/// The slope of −1 through the first point of all, as far as it stays in the plot.
fn guide<'a>(x: &Axis, y: &Axis, points: impl Iterator<Item = &'a CurvePoint>, along: Quantity) -> String {
    let Some(first) = points.min_by(|a, b| (along.of)(a).total_cmp(&(along.of)(b))) else {
        return String::new();
    };
    let product = (along.of)(first) * first.relative_mse;
    let from = (along.of)(first).log10();
    let to = x.high.min(product.log10() - y.low);
    if to <= from {
        return String::new();
    }
    let at = |log: f64| {
        let value = 10_f64.powf(log);
        format!("{:.1} {:.1}", x.place(value), y.place(product / value))
    };
    format!("<path class=\"guide\" d=\"M{}L{}\"/>\n", at(from), at(to))
}

fn curve(number: usize, name: &str, points: &[CurvePoint], x: &Axis, y: &Axis, along: Quantity) -> String {
    let color = COLORS[number % COLORS.len()];
    // When the colours begin again, the lines are dashed.
    let dash = if number >= COLORS.len() { " stroke-dasharray=\"7 4\"" } else { "" };
    let places: Vec<(f64, f64)> =
        points.iter().map(|p| (x.place((along.of)(p)), y.place(p.relative_mse))).collect();
    let line: Vec<String> = places.iter().map(|(x, y)| format!("{x:.1} {y:.1}")).collect();
    let mut svg = format!(
        "<path d=\"M{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"2\" stroke-linejoin=\"round\"{dash}/>",
        line.join("L")
    );
    for (p, &(x, y)) in points.iter().zip(&places) {
        let tip = format!(
            "{}: {} s, {} samples per pixel, relMSE {}",
            escape(name),
            plain(p.seconds),
            plain(p.samples),
            error(p.relative_mse)
        );
        svg += &format!(
            "<path d=\"{}\" fill=\"{color}\" stroke=\"#1c1e21\" stroke-width=\"1.5\"><title>{tip}</title></path>",
            marker(number, x, y)
        );
    }
    svg + "\n"
}

/// The outline of a marker around a point: a disk, a square, a triangle, a diamond, a triangle on its tip.
fn marker(number: usize, x: f64, y: f64) -> String {
    match number % 5 {
        0 => format!("M{:.1} {y:.1}a5 5 0 1 0 10 0a5 5 0 1 0 -10 0z", x - 5.0),
        1 => format!("M{:.1} {:.1}h9v9h-9z", x - 4.5, y - 4.5),
        2 => format!("M{x:.1} {:.1}l5.8 10h-11.6z", y - 6.2),
        3 => format!("M{x:.1} {:.1}l6 6l-6 6l-6 -6z", y - 6.0),
        _ => format!("M{x:.1} {:.1}l5.8 -10h-11.6z", y + 6.2),
    }
}

/// The names, beside the ends of the curves and pushed apart where those are close.
fn names(curves: &[(usize, &str, Vec<CurvePoint>)], x: &Axis, y: &Axis, along: Quantity) -> String {
    const LINE: f64 = 16.0;
    const LONGEST: usize = 17;
    let mut ends: Vec<(usize, &str, f64, f64)> = curves
        .iter()
        .filter_map(|(i, name, points)| {
            let last = points.iter().max_by(|a, b| (along.of)(a).total_cmp(&(along.of)(b)))?;
            Some((*i, *name, x.place((along.of)(last)), y.place(last.relative_mse)))
        })
        .collect();
    ends.sort_by(|a, b| a.3.total_cmp(&b.3));
    // Downwards each below the last, then upwards from the bottom if that went too far.
    let mut at: Vec<f64> = ends.iter().map(|end| end.3.max(y.end + 6.0)).collect();
    for i in 1..at.len() {
        at[i] = at[i].max(at[i - 1] + LINE);
    }
    let mut bottom = y.start;
    for label in at.iter_mut().rev() {
        *label = label.min(bottom);
        bottom = *label - LINE;
    }
    let mut svg = String::new();
    for ((i, name, end_x, end_y), label) in ends.iter().zip(at) {
        let color = COLORS[i % COLORS.len()];
        let short: String = match name.chars().count() > LONGEST {
            true => name.chars().take(LONGEST - 1).chain(['…']).collect(),
            false => (*name).to_owned(),
        };
        let left = x.end + 14.0;
        svg += &format!(
            "<path d=\"M{:.1} {end_y:.1}L{:.1} {label:.1}\" stroke=\"{color}\" stroke-opacity=\"0.45\" fill=\"none\"/>\
             <text class=\"label\" x=\"{left:.1}\" y=\"{:.1}\" style=\"fill:{color}\">{}<title>{}</title></text>",
            end_x + 7.0,
            left - 3.0,
            label + 4.0,
            escape(&short),
            escape(name)
        );
    }
    svg + "\n"
}
