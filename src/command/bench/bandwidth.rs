//! The technique `bandwidth`: time to the error that forward shading has, stage by stage, and how its cost grows.
//!
//! The truth has many samples of lobe and light together in every pixel. Forward shading by a fixed number of samples of
//! the lobe errs by noise alone, so the samples that it would need for another PSNR follow from those of one picture:
//! N = n · 10^((PSNR − PSNR_n)/10), and its time is proportional to them.

use std::path::Path;
use std::time::Duration;

use halflight::job::Stage;
use halflight_image::{RgbImage, metrics};
use halflight_render::techniques::bandwidth::{Antialias, BandwidthSettings, BandwidthTechnique, Mode};
use halflight_render::techniques::path::{Path as PathTechnique, PathSettings};
use halflight_render::{Budget, Film, RenderReport, Technique};
use halflight_scene::Frame;

use super::{BenchArgs, Findings};
use crate::command::failure::Failure;
use crate::command::progress::silent;
use crate::command::stage::{self, SceneArgs};
use crate::command::table::Table;
use crate::command::{interrupt, resources, words};

/// A scene, and the seed's milliseconds for forward shading and its own on a GTX 560 Ti, by the row of its table.
const SCENES: [(&str, &str); 4] = [
    ("three-paints", "2056/229"),
    ("red-whale", "1628/419"),
    ("hammered", "2634/390"),
    ("lamp-lit", "1739/205"),
];
/// Samples of the truth, of lobe and light each.
const TRUTH: u32 = 384;
/// Samples of the forward-shaded picture.
const FORWARD: u32 = 64;
/// Renders of which the fastest counts.
const REPEATS: u32 = 5;

struct Subject {
    name: &'static str,
    seed: &'static str,
    stage: Stage,
    frame: Frame,
    truth: RgbImage,
    size: usize,
}

impl Subject {
    fn new((name, seed): (&'static str, &'static str), args: &BenchArgs) -> Result<Self, Failure> {
        let stage = stage::load(Path::new(&format!("demo:{name}")), &SceneArgs::default(), &args.machine)?;
        let frame = stage.frame(0.0)?;
        let (size, samples) = if args.quick { (64, 16) } else { (512, TRUTH) };
        let truth = RgbImage::new(0, 0);
        let mut subject = Self { name, seed, stage, frame, truth, size };
        let settings = BandwidthSettings { mode: Mode::Reference, samples, ..BandwidthSettings::default() };
        subject.truth = subject.render(settings, 1)?.0;
        Ok(subject)
    }

    /// The picture, and the report of the fastest of some renders.
    fn render(&self, settings: BandwidthSettings, repeats: u32) -> Result<(RgbImage, RenderReport), Failure> {
        let mut technique = BandwidthTechnique::new(settings);
        technique.prepare(self.stage.scene(), &silent())?;
        let budget = Budget { samples: Some(1), ..Budget::default() };
        let mut best: Option<(RgbImage, RenderReport)> = None;
        for _ in 0..repeats {
            let mut film = Film::new(self.size, self.size);
            let report = technique.render(&self.frame, &mut film, &budget, &silent())?;
            if best.as_ref().is_none_or(|(_, known)| report.elapsed < known.elapsed) {
                best = Some((film.image(), report));
            }
        }
        best.ok_or_else(|| Failure::failed("nothing was rendered"))
    }

    /// The noise of the technique `path` with one bounce, as PSNR, and its milliseconds.
    fn path(&self, args: &BenchArgs) -> Result<(f64, f64), Failure> {
        let settings = PathSettings { max_depth: 1, ..PathSettings::default() };
        let samples = if args.quick { 2 } else { 32 };
        let render = |seed: u64| -> Result<(RgbImage, RenderReport), Failure> {
            let mut technique = PathTechnique::new(settings);
            technique.prepare(self.stage.scene(), &silent())?;
            let budget = Budget { samples: Some(samples), seed, ..Budget::default() };
            let mut film = Film::new(self.size, self.size);
            let report = technique.render(&self.frame, &mut film, &budget, &silent())?;
            Ok((film.image(), report))
        };
        let ((first, report), (second, _)) = (render(1)?, render(2)?);
        let psnr = metrics::psnr(&first, &second, self.stage.exposure_ev()).map_err(Failure::failed)?;
        // Two pictures differ by twice the variance of one.
        Ok((psnr + 10.0 * 2f64.log10(), milliseconds(report.elapsed)))
    }

    fn psnr(&self, image: &RgbImage) -> Result<f64, Failure> {
        metrics::psnr(image, &self.truth, self.stage.exposure_ev()).map_err(Failure::failed)
    }
}

fn milliseconds(time: Duration) -> f64 {
    1e3 * time.as_secs_f64()
}

pub(super) fn equal_quality(args: &BenchArgs) -> Result<Findings, Failure> {
    let mut table = Table::new([
        "scene",
        "light",
        "PSNR dB",
        "ms",
        "g-buffer",
        "bandwidth",
        "shading",
        "of all",
        "forward ms",
        "samples",
        "times",
        "path ms",
        "times",
        "seed's ms, GTX 560 Ti",
    ]);
    let mut notes = Vec::new();
    resources::reset_peak_memory();
    for scene in SCENES {
        let subject = Subject::new(scene, args)?;
        let forward =
            BandwidthSettings { mode: Mode::Forward, samples: FORWARD, ..BandwidthSettings::default() };
        let (image, forward) = subject.render(forward, 1)?;
        let noise = subject.psnr(&image)?;
        let (path_noise, path_ms) = subject.path(args)?;
        for (light, mode) in [("as it is", Mode::Plain), ("convolved", Mode::Preconvolved)] {
            let settings = BandwidthSettings { mode, ..BandwidthSettings::default() };
            let (image, report) = subject.render(settings, REPEATS)?;
            let psnr = subject.psnr(&image)?;
            let needed = f64::from(FORWARD) * 10f64.powf((psnr - noise) / 10.0);
            let shading = |report: &RenderReport| {
                report
                    .stages
                    .iter()
                    .filter(|(name, _)| *name == "shading")
                    .map(|s| milliseconds(s.1))
                    .sum::<f64>()
            };
            let rest = milliseconds(forward.elapsed) - shading(&forward);
            let expected = rest + shading(&forward) * needed / f64::from(FORWARD);
            let stage = |wanted: &str| {
                let found = report.stages.iter().find(|(name, _)| *name == wanted);
                found.map_or_else(|| "–".into(), |(_, time)| format!("{:.1}", milliseconds(*time)))
            };
            let ours = milliseconds(report.elapsed);
            let path = path_ms * 10f64.powf((psnr - path_noise) / 10.0);
            let predicting = report.stages.iter().find(|(name, _)| *name == "bandwidth");
            let share = predicting.map_or(0.0, |(_, time)| milliseconds(*time) / ours);
            table.row([
                subject.name.to_string(),
                light.to_string(),
                format!("{psnr:.1}"),
                format!("{ours:.0}"),
                stage("g-buffer"),
                stage("bandwidth"),
                stage("shading"),
                format!("{:.1} %", 100.0 * share),
                format!("{expected:.0}"),
                words::figure(needed),
                format!("{:.1}", expected / ours),
                format!("{path:.0}"),
                format!("{:.1}", path / ours),
                subject.seed.to_string(),
            ]);
            notes.extend(report.notes.get(1).map(|note| format!("{}, light {light}: {note}", subject.name)));
        }
        if interrupt::is_asked_to_stop() {
            break;
        }
    }
    notes.push(
        "path: --max-depth 1, at the same PSNR against itself; it traces shadows and smooths edges, ours does not".into(),
    );
    if let Some(peak) = resources::peak_memory_bytes() {
        notes.push(format!("resident memory at its highest, all four scenes: {}", words::bytes(peak)));
    }
    notes.push(format!(
        "forward shading was measured with {FORWARD} samples a pixel; its time at our PSNR follows by 10 dB for ten times the samples"
    ));
    notes.push("the seed's are its car body, bunny, buddha and dragon: other objects, by row only".into());
    Ok(Findings { title: "Bandwidth: time at equal error", table, notes })
}

pub(super) fn growth(args: &BenchArgs) -> Result<Findings, Failure> {
    let subject = Subject::new(SCENES[0], args)?;
    let mut table = Table::new([
        "directions",
        "antialiasing",
        "error",
        "PSNR dB",
        "ms",
        "bandwidth",
        "shading",
        "antialiasing ms",
    ]);
    let base = BandwidthSettings { mode: Mode::Preconvolved, ..BandwidthSettings::default() };
    let mut antialiased = Vec::new();
    let mut run = |settings: BandwidthSettings| -> Result<f64, Failure> {
        let (image, report) = subject.render(settings, 3)?;
        let stage = |wanted: &str| {
            let found = report.stages.iter().find(|(name, _)| *name == wanted);
            found.map_or_else(|| "–".into(), |(_, time)| format!("{:.1}", milliseconds(*time)))
        };
        let side = match settings.antialias {
            Antialias::One => "1x",
            Antialias::Four => "4x",
            Antialias::Sixteen => "16x",
        };
        table.row([
            settings.directions.to_string(),
            side.to_string(),
            format!("{} %", words::figure(f64::from(100.0 * settings.target_error()))),
            format!("{:.2}", subject.psnr(&image)?),
            format!("{:.0}", milliseconds(report.elapsed)),
            stage("bandwidth"),
            stage("shading"),
            stage("antialiasing"),
        ]);
        Ok(report.elapsed.as_secs_f64())
    };
    for directions in [16, 64, 256, 1024] {
        run(BandwidthSettings { directions, ..base })?;
    }
    for antialias in [Antialias::One, Antialias::Four, Antialias::Sixteen] {
        antialiased.push(run(BandwidthSettings { antialias, ..base })?);
    }
    for error in [0.16, 0.08, 0.04, 0.02] {
        run(BandwidthSettings { error: Some(error), ..base })?;
    }
    let mut memory = Vec::new();
    for size in [subject.size, 4 * subject.size] {
        resources::reset_peak_memory();
        let mut technique = BandwidthTechnique::new(base);
        technique.prepare(subject.stage.scene(), &silent())?;
        let mut film = Film::new(size, size);
        let budget = Budget { samples: Some(1), ..Budget::default() };
        technique.render(&subject.frame, &mut film, &budget, &silent())?;
        if let Some(peak) = resources::peak_memory_bytes() {
            memory.push(format!("{} at {size} × {size}", words::bytes(peak)));
        }
    }
    let exponent = (antialiased[2] / antialiased[0]).ln() / 16f64.ln();
    let mut notes = vec![
        format!(
            "scene {}, light convolved; cost of antialiasing grows with the {exponent:.2}th power of the places a pixel (seed: 0.7)",
            subject.name
        ),
        "the truth has one place a pixel, so that PSNR says nothing of antialiasing".into(),
    ];
    if !memory.is_empty() {
        notes.push(format!("resident memory at its highest: {}", memory.join(", ")));
    }
    Ok(Findings { title: "Bandwidth: how cost and quality grow", table, notes })
}
