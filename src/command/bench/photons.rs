//! Kernels of photons from covariance against kernels of one radius, the best that a search finds.
//!
//! All pictures have as many photons and passes, and the same paths from the eye. The error of a picture x is
//! the mean of (x − a)(x − b)/(t² + 0.01) with a, b two independent pictures of `path` and t their mean: what noise they have
//! cancels, so that it is the squared error of x alone. The search takes radii in steps of 1.5 until the best is not the last of
//! them, and then at the best radius and its neighbours slower and faster narrowing.

use std::path::Path as FilePath;

use halflight_image::RgbImage;
use halflight_render::techniques::covariance::{Covariance, CovarianceSettings, Kernel, Method};
use halflight_render::techniques::path::Path;
use halflight_render::{Budget, Film, Technique};
use halflight_scene::Frame;

use super::{BenchArgs, Findings};
use crate::command::failure::Failure;
use crate::command::progress::silent;
use crate::command::stage::{self, SceneArgs};
use crate::command::table::Table;
use crate::command::{interrupt, resources};

/// What is narrowed with as α, beside 2/3.
const FALLOFFS: [f32; 3] = [0.5, 0.8, 1.0];
/// The factor between radii.
const STEP: f32 = 1.5;

struct Subject {
    frame: Frame,
    size: [usize; 2],
    truths: [RgbImage; 2],
    passes: u32,
    photons: u32,
}

impl Subject {
    fn picture(&self, technique: &dyn Technique, samples: u32, seed: u64) -> Result<(Film, f64), Failure> {
        let mut film = Film::new(self.size[0], self.size[1]);
        let budget = Budget { samples: Some(samples), seed, ..Budget::default() };
        let before = resources::cpu_seconds();
        let report = technique.render(&self.frame, &mut film, &budget, &silent())?;
        let took = before.zip(resources::cpu_seconds()).map(|(before, after)| after - before);
        Ok((film, took.unwrap_or(report.elapsed.as_secs_f64())))
    }

    fn new(name: &str, args: &BenchArgs) -> Result<Self, Failure> {
        let scene = format!("demo:{name}");
        let stage = stage::load(FilePath::new(&scene), &SceneArgs::default(), &args.machine)?;
        let (size, passes, photons) = if args.quick { ([64, 36], 4, 8192) } else { ([128, 72], 16, 16384) };
        let empty = || RgbImage::from_fn(1, 1, |_, _| [0.0; 3]);
        let truths = [empty(), empty()];
        let mut subject = Self { frame: stage.frame(0.0)?, size, truths, passes, photons };
        let samples = if args.quick { 256 } else { 2048 };
        for half in 0..2 {
            subject.truths[half] = subject.picture(&Path::default(), samples, 77 + half as u64)?.0.image();
        }
        Ok(subject)
    }

    fn error(&self, picture: &RgbImage) -> f64 {
        let [a, b] = &self.truths;
        let mut sum = 0.0;
        for ((x, a), b) in picture.pixels.iter().zip(&a.pixels).zip(&b.pixels) {
            for c in 0..3 {
                let (x, a, b) = (f64::from(x[c]), f64::from(a[c]), f64::from(b[c]));
                let t = 0.5 * (a + b);
                sum += (x - a) * (x - b) / (t * t + 0.01);
            }
        }
        sum / (3 * picture.pixels.len()) as f64
    }

    fn measure(&self, settings: CovarianceSettings) -> Result<(f64, f64, Film), Failure> {
        let settings = CovarianceSettings { method: Method::Photons, photons: self.photons, ..settings };
        let (film, seconds) = self.picture(&Covariance::new(settings), self.passes, 0)?;
        Ok((self.error(&film.image()), seconds, film))
    }
}

/// A fixed schedule and its error.
#[derive(Clone, Copy)]
struct Tried {
    radius: f32,
    falloff: f32,
    error: f64,
    seconds: f64,
}

fn search(subject: &Subject, first: f32, notes: &mut Vec<String>, name: &str) -> Result<Tried, Failure> {
    let mut tried: Vec<Tried> = Vec::new();
    let attempt = |tried: &mut Vec<Tried>, radius: f32, falloff: f32| -> Result<f64, Failure> {
        let settings = CovarianceSettings {
            kernel: Kernel::Fixed,
            radius: Some(radius),
            radius_falloff: falloff,
            ..CovarianceSettings::default()
        };
        let (error, seconds, _) = subject.measure(settings)?;
        tried.push(Tried { radius, falloff, error, seconds });
        Ok(error)
    };
    let usual = 2.0 / 3.0;
    attempt(&mut tried, first, usual)?;
    for factor in [STEP, 1.0 / STEP] {
        let (mut radius, mut last) = (first, tried[0].error);
        for _ in 0..8 {
            radius *= factor;
            let error = attempt(&mut tried, radius, usual)?;
            if error > last || interrupt::is_asked_to_stop() {
                break;
            }
            last = error;
        }
    }
    let best = |tried: &[Tried]| {
        tried.iter().copied().fold(tried[0], |best, t| if t.error < best.error { t } else { best })
    };
    let middle = best(&tried).radius;
    for falloff in FALLOFFS {
        // Slower narrowing ends at the same width if it begins narrower.
        let end = |falloff: f32| {
            (1..subject.passes).map(|i| (i as f32 + falloff) / (i as f32 + 1.0)).product::<f32>().sqrt()
        };
        for factor in [1.0, (end(usual) / end(falloff)).sqrt()] {
            attempt(&mut tried, middle * factor, falloff)?;
        }
    }
    let list: Vec<String> =
        tried.iter().map(|t| format!("{:.3} m α {:.2}: {:.5}", t.radius, t.falloff, t.error)).collect();
    notes.push(format!("{name}, fixed schedules tried: {}", list.join(", ")));
    Ok(best(&tried))
}

pub(super) fn kernels(args: &BenchArgs) -> Result<Findings, Failure> {
    let mut table = Table::new([
        "scene",
        "relMSE, covariance",
        "relMSE, best fixed",
        "ratio (goal 1)",
        "its radius m",
        "its α",
        "mean radius of covariance m",
        "seconds, covariance",
        "seconds, fixed",
    ]);
    let mut notes = Vec::new();
    let (mut passes, mut photons) = (0, 0);
    for (name, first) in [("caustic-glass", 0.03), ("fog-lamp", 0.1)] {
        let subject = Subject::new(name, args)?;
        (passes, photons) = (subject.passes, subject.photons);
        let (error, seconds, film) = subject.measure(CovarianceSettings::default())?;
        let best = search(&subject, first, &mut notes, name)?;
        let radii = film.layers.get("photon-radius").map_or(&[][..], |layer| &layer[..]);
        let there = radii.iter().filter(|r| **r > 0.0);
        let mean = there.clone().map(|r| f64::from(*r)).sum::<f64>() / there.count().max(1) as f64;
        if let Some(folder) = &args.maps {
            let settings = CovarianceSettings {
                method: Method::Photons,
                photons: subject.photons,
                kernel: Kernel::Fixed,
                radius: Some(best.radius),
                radius_falloff: best.falloff,
                ..CovarianceSettings::default()
            };
            let (.., fixed) = subject.measure(settings)?;
            let save = |what: &str, picture: &RgbImage| {
                let path = folder.join(format!("{name}-photons-{what}.png"));
                let tone = halflight_image::ToneMapping::default();
                halflight_image::save_png(&path, picture, &tone).map_err(Failure::failed)
            };
            std::fs::create_dir_all(folder).map_err(Failure::failed)?;
            save("truth", &subject.truths[0])?;
            save("covariance", &film.image())?;
            save("fixed", &fixed.image())?;
        }
        table.row([
            name.into(),
            format!("{error:.5}"),
            format!("{:.5}", best.error),
            format!("{:.2}", error / best.error),
            format!("{:.3}", best.radius),
            format!("{:.2}", best.falloff),
            format!("{mean:.3}"),
            format!("{seconds:.1}"),
            format!("{:.1}", best.seconds),
        ]);
        if interrupt::is_asked_to_stop() {
            break;
        }
    }
    notes.push(format!("{passes} passes of {photons} photons; seconds are of the processor, all threads"));
    Ok(Findings { title: "radius of photons: from covariance against the best fixed schedule", table, notes })
}
