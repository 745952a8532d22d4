//! How the cost grows with blockers, pixels and order: powers fitted by least squares on logarithmic axes.
//!
//! The scene is spheres strewn over a fractal land, the smaller the more there are, so that they cover about the same
//! part of it.

use std::path::Path;
use std::time::Instant;

use halflight_render::{Budget, Film};

use crate::command::bench::{BenchArgs, Findings};
use crate::command::failure::Failure;
use crate::command::progress::silent;
use crate::command::stage::{self, SceneArgs};
use crate::command::table::Table;
use crate::command::techniques::{self, TechniqueSpec};
use crate::command::{interrupt, words};

/// One picture to time.
#[derive(Clone, Copy)]
struct Case {
    blockers: u32,
    /// Its pixels, at 16 to 9.
    pixels: f64,
    order: u32,
}

/// Sets one of the numbers of a case.
type Change = fn(Case, f64) -> Case;

/// What stays while another changes.
const MIDDLE: Case = Case { blockers: 100, pixels: 0.5e6, order: 4 };

pub(in crate::command::bench) fn measure(args: &BenchArgs) -> Result<Findings, Failure> {
    let middle = if args.quick { Case { pixels: 2e4, ..MIDDLE } } else { MIDDLE };
    let all = |full: &[f64], quick: &[f64]| if args.quick { quick.to_vec() } else { full.to_vec() };
    let blockers = all(&[25.0, 100.0, 400.0, 1600.0, 6400.0], &[25.0, 100.0]);
    let pixels = all(&[0.25e6, 0.5e6, 1e6, 2e6, 4e6], &[1e4, 4e4]);
    let orders = all(&[3.0, 4.0, 5.0, 6.0], &[3.0, 4.0]);
    let series: [(&str, Vec<f64>, Change); 3] = [
        ("blockers", blockers, |case, n| Case { blockers: n as u32, ..case }),
        ("pixels", pixels, |case, pixels| Case { pixels, ..case }),
        ("order", orders, |case, n| Case { order: n as u32, ..case }),
    ];
    let mut table = Table::new(["against", "from", "to", "ms a frame", "grows with the power"]);
    for (name, values, set) in series {
        let mut points = Vec::new();
        for &value in &values {
            points.push((value, time(set(middle, value), args)?));
            if interrupt::is_asked_to_stop() {
                return Err(Failure::Interrupted);
            }
        }
        let times: Vec<String> = points.iter().map(|(_, t)| format!("{:.1}", 1e3 * t)).collect();
        table.row([
            name.to_string(),
            words::figure(values[0]),
            words::figure(values[values.len() - 1]),
            times.join(" · "),
            format!("{:.2}", power(&points)),
        ]);
    }
    let notes = vec![
        format!(
            "spheres over fractal land; {} blockers, {} pixels, order {} unless said otherwise; steps by factors (orders one by one)",
            middle.blockers,
            words::figure(middle.pixels),
            middle.order
        ),
        "least wall time of three pictures at one sample a pixel, without posing; powers by least squares on logarithmic axes".into(),
    ];
    Ok(Findings { title: "Spherical-harmonic exponentiation, growth of the cost", table, notes })
}

/// Seconds for one picture.
fn time(case: Case, args: &BenchArgs) -> Result<f64, Failure> {
    let folder =
        tempfile::tempdir().map_err(|e| Failure::failed(format!("cannot make a temporary folder: {e}")))?;
    let path = folder.path().join("strewn.toml");
    std::fs::write(&path, scene(case.blockers))
        .map_err(|e| Failure::failed(format!("cannot write {}: {e}", path.display())))?;
    let stage = stage::load(Path::new(&path), &SceneArgs::default(), &args.machine)?;
    let spec = TechniqueSpec { name: "shexp".into(), settings: vec![format!("order={}", case.order)] };
    let mut technique = techniques::create(&spec, &stage)?.technique;
    technique.prepare(stage.scene(), &silent())?;
    let frame = stage.frame(0.0)?;
    let height = (case.pixels * 9.0 / 16.0).sqrt().round();
    let width = (case.pixels / height).round();
    let budget = Budget { samples: Some(1), ..Budget::default() };
    let mut best = f64::INFINITY;
    // The first makes the tables.
    for _ in 0..4 {
        let begun = Instant::now();
        technique.render(&frame, &mut Film::new(width as usize, height as usize), &budget, &silent())?;
        best = best.min(begun.elapsed().as_secs_f64());
    }
    Ok(best)
}

/// Spheres of radius 3.2/√n over 16 × 16 metres of land.
fn scene(blockers: u32) -> String {
    let radius = 3.2 / f64::from(blockers).sqrt();
    // Points of two irrational steps: spread evenly, but not in rows.
    let sphere = |i: u32| {
        let part = |step: f64| (f64::from(i) * step).fract() * 14.0 - 7.0;
        format!("[{:.4}, {:.4}, {:.4}, {radius:.5}]", part(0.754_877_666), 1.1 * radius, part(0.569_840_296))
    };
    let spheres: Vec<String> = (0..blockers).map(sphere).collect();
    format!(
        "[camera]\norigin = [0, 9, 15]\ntarget = [0, 0, 0]\nvertical_fov_degrees = 40\n\
         [environment]\ntype = \"sky\"\nbands = 4\n\
         [[shape]]\ntype = \"height-field\"\nextent = [16, 16]\nposts = [256, 256]\n\
         heights = {{ type = \"fractal\", amplitude = 0.4, wavelength = 5 }}\n\
         [[shape]]\ntype = \"spheres\"\nspheres = [{}]\n",
        spheres.join(", ")
    )
}

/// The exponent p of the power law y = c xᵖ nearest to the points in logarithms.
fn power(points: &[(f64, f64)]) -> f64 {
    let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let n = logs.len() as f64;
    let mean = |f: fn(&(f64, f64)) -> f64| logs.iter().map(f).sum::<f64>() / n;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let shared: f64 = logs.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    shared / logs.iter().map(|p| (p.0 - x).powi(2)).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_power_of_a_power_law_is_found() {
        let points: Vec<(f64, f64)> = [1.0f64, 3.0, 10.0].iter().map(|&x| (x, 0.2 * x.powf(1.5))).collect();
        assert!((power(&points) - 1.5).abs() < 1e-9);
    }
}
