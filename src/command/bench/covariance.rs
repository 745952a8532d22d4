//! The technique `covariance`: samples and seconds to the error that `path` has, how well it foretells where samples are
//! needed, and what carrying covariance costs.
//!
//! The truth is a picture of `path` with four times the samples; its own error adds the same to
//! both sides. `covariance` is
//! rendered at growing numbers of samples until it is at most as wrong as `path` at 256 a pixel; between two numbers the one
//! that is needed follows on a straight line of the logarithms. The prediction is the map after the pilots and the first four samples a
//! pixel, ranked against √(V/(L² + 0.01)) of the truth's own samples, as the mean of three by three pixels.

use std::path::Path as FilePath;

use halflight_image::{RgbImage, ToneMapping, metrics, save_png};
use halflight_render::techniques::covariance::Covariance;
use halflight_render::techniques::path::Path;
use halflight_render::{Budget, Film, Technique};
use halflight_scene::Frame;

use super::{BenchArgs, Findings};
use crate::command::failure::Failure;
use crate::command::progress::silent;
use crate::command::stage::{self, SceneArgs};
use crate::command::table::Table;
use crate::command::{interrupt, resources};

/// The five scenes, and the factors in samples and time that they are to reach.
const SCENES: [(&str, f64, f64); 5] = [
    ("depth-of-field", 8.0, 5.0),
    ("wheel", 8.0, 5.0),
    ("glossy-floor", 4.0, 4.0),
    ("caustic-glass", 4.0, 4.0),
    ("fog-lamp", 4.0, 4.0),
];
/// Samples a pixel that the prediction is made from.
const FIRST: u32 = 4;
/// Samples of `path` that are to be equalled.
const GOAL: u32 = 256;

struct Subject {
    frame: Frame,
    size: [usize; 2],
}

impl Subject {
    fn new(name: &str, args: &BenchArgs) -> Result<Self, Failure> {
        let stage =
            stage::load(FilePath::new(&format!("demo:{name}")), &SceneArgs::default(), &args.machine)?;
        let frame = stage.frame(0.0)?;
        Ok(Self { frame, size: if args.quick { [160, 90] } else { [240, 135] } })
    }

    /// The film, and the processor time of all threads that it took.
    fn render(&self, technique: &dyn Technique, samples: u32, seed: u64) -> Result<(Film, f64), Failure> {
        let mut film = Film::new(self.size[0], self.size[1]);
        let budget = Budget { samples: Some(samples), seed, ..Budget::default() };
        let before = resources::cpu_seconds();
        let report = technique.render(&self.frame, &mut film, &budget, &silent())?;
        let after = resources::cpu_seconds();
        let took = before.zip(after).map_or(report.elapsed.as_secs_f64(), |(before, after)| after - before);
        Ok((film, took.max(1e-3)))
    }
}

fn relative_error(image: &RgbImage, truth: &RgbImage) -> Result<f64, Failure> {
    metrics::relative_mse(image, truth).map_err(Failure::failed)
}

pub(super) fn equal_error(args: &BenchArgs) -> Result<Findings, Failure> {
    let mut table = Table::new([
        "scene",
        "relMSE of path",
        "seconds",
        "samples needed",
        "seconds needed",
        "fewer samples",
        "goal",
        "less time",
        "goal",
        "rank correlation",
        "of a second map",
    ]);
    let mut notes = Vec::new();
    let (truth_samples, goal) = if args.quick { (256, 64) } else { (1024, GOAL) };
    for (name, fewer, faster) in SCENES {
        let subject = Subject::new(name, args)?;
        let (truth, _) = subject.render(&Path::default(), truth_samples, 1234)?;
        let needed = optimal(&variances(&truth), subject.size);
        let truth = truth.image();
        let (film, seconds) = subject.render(&Path::default(), goal, 0)?;
        let error = relative_error(&film.image(), &truth)?;
        // What a map as good as the truth but for its noise would have.
        let ceiling = rank_correlation(&optimal(&variances(&film), subject.size), &needed);
        let (film, _) = subject.render(&Covariance::default(), FIRST, 0)?;
        let correlation =
            film.layers.get("predicted-density").map_or(0.0, |map| rank_correlation(map, &needed));
        if let Some(folder) = &args.maps {
            let maps = Maps { folder, name, size: subject.size };
            maps.densities(film.layers.get("predicted-density").map_or(&[], |map| map), &needed)?;
            let (path, _) = subject.render(&Path::default(), 16, 0)?;
            let (ours, _) = subject.render(&Covariance::default(), 16, 0)?;
            maps.save("truth", &truth)?;
            maps.save("path", &path.image())?;
            maps.save("covariance", &ours.image())?;
            maps.save("path-error", &error_map(&path.image(), &truth))?;
            maps.save("covariance-error", &error_map(&ours.image(), &truth))?;
            let layer = |name: &str, scale: f32| -> Vec<f32> {
                ours.layers.get(name).map(|l| l.iter().map(|v| v * scale).collect()).unwrap_or_default()
            };
            maps.save("filter-scale", &maps.grey(&layer("filter.scale", 1.0)))?;
            maps.save("filter-widest", &maps.grey(&layer("filter.wide", 0.25)))?;
            maps.save("samples", &maps.grey(&ours.map(|p| p.samples as f32 / 64.0)))?;
        }
        let mut last: Option<(f64, f64, f64)> = None;
        let (mut found, mut curve) = (None, Vec::new());
        for samples in [4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384] {
            if interrupt::is_asked_to_stop() {
                break;
            }
            let (film, took) = subject.render(&Covariance::default(), samples, 0)?;
            let here = (film.mean_samples(), took, relative_error(&film.image(), &truth)?);
            curve.push(format!("{:.0}: {:.5} in {:.2} s", here.0, here.2, here.1));
            if here.2 <= error {
                // Between this number and the one before.
                let part = last.map_or(1.0, |l| ((l.2 / error).ln() / (l.2 / here.2).ln()).clamp(0.0, 1.0));
                let between = |a: f64, b: f64| (a.ln() + (b.ln() - a.ln()) * part).exp();
                found = Some(last.map_or((here.0, here.1), |l| (between(l.0, here.0), between(l.1, here.1))));
                break;
            }
            last = Some(here);
        }
        notes.push(format!("{name}: {}", curve.join(", ")));
        let (samples, took) = found.unwrap_or((f64::INFINITY, f64::INFINITY));
        table.row([
            name.into(),
            format!("{error:.5}"),
            format!("{seconds:.2}"),
            format!("{samples:.1}"),
            format!("{took:.2}"),
            format!("{:.1}", f64::from(goal) / samples),
            format!("{fewer}"),
            format!("{:.1}", seconds / took),
            format!("{faster}"),
            format!("{correlation:.3}"),
            format!("{ceiling:.3}"),
        ]);
    }
    notes.extend([
        format!("truth: path at {truth_samples} samples a pixel; path at {goal} is to be equalled"),
        "seconds are of the processor, all threads; goal of the rank correlation: 0.8".into(),
        "of a second map: the rank correlation of two maps of `path`, which noise alone tells apart".into(),
    ]);
    Ok(Findings { title: "covariance against path at equal error", table, notes })
}

pub(super) fn overhead(args: &BenchArgs) -> Result<Findings, Failure> {
    let mut table = Table::new([
        "scene",
        "plain paths s",
        "with covariance s",
        "overhead",
        "stages of a picture of 32 samples, s",
    ]);
    for (name, ..) in SCENES {
        let subject = Subject::new(name, args)?;
        let technique = Covariance::default();
        let repeats = if args.quick { 1 } else { 3 };
        let mut best = [f64::INFINITY; 2];
        for _ in 0..repeats {
            for (carry, best) in [false, true].into_iter().zip(&mut best) {
                let took = technique.pilots_alone(&subject.frame, subject.size, 8, carry);
                *best = best.min(took.as_secs_f64());
            }
        }
        let [plain, carried] = best;
        let mut film = Film::new(subject.size[0], subject.size[1]);
        let budget = Budget { samples: Some(32), ..Budget::default() };
        let report = technique.render(&subject.frame, &mut film, &budget, &silent())?;
        let stages = report.stages.iter().map(|(name, time)| format!("{name} {:.2}", time.as_secs_f64()));
        table.row([
            name.into(),
            format!("{plain:.3}"),
            format!("{carried:.3}"),
            format!("{:.0} %", 100.0 * (carried / plain - 1.0)),
            stages.collect::<Vec<_>>().join(", "),
        ]);
    }
    let notes = vec![
        "eight paths a pixel, one at a time, the fastest of three".into(),
        "plain paths remember nothing; pilots are four for sixteen pixels, of which one is walked".into(),
        "`pilots` has what follows from them for each pixel too".into(),
    ];
    Ok(Findings { title: "what carrying covariance costs a path", table, notes })
}

/// Relative variances of one sample.
fn variances(film: &Film) -> Vec<f32> {
    film.map(|p| {
        let n = f64::from(p.samples);
        let [r, g, b] = p.mean();
        let mean = 0.2126 * r + 0.7152 * g + 0.0722 * b;
        ((p.sum_squares / n - mean * mean).max(0.0) / (mean * mean + 0.01)) as f32
    })
}

/// √ of relative variances, which single bright samples make noisy even with many: the mean of three by three pixels.
fn optimal(variances: &[f32], [width, height]: [usize; 2]) -> Vec<f32> {
    let around = |i: usize, n: usize| i.saturating_sub(1)..=(i + 1).min(n - 1);
    (0..variances.len())
        .map(|i| {
            let (mut sum, mut count) = (0.0f32, 0.0f32);
            for v in around(i / width, height) {
                for u in around(i % width, width) {
                    sum += variances[v * width + u].sqrt();
                    count += 1.0;
                }
            }
            sum / count
        })
        .collect()
}

/// Pictures of what the tables say.
struct Maps<'a> {
    folder: &'a FilePath,
    name: &'a str,
    size: [usize; 2],
}

impl Maps<'_> {
    fn save(&self, what: &str, picture: &RgbImage) -> Result<(), Failure> {
        std::fs::create_dir_all(self.folder).map_err(Failure::failed)?;
        let path = self.folder.join(format!("{}-{what}.png", self.name));
        save_png(&path, picture, &ToneMapping::default()).map_err(Failure::failed)
    }

    /// Both densities, as ranks, which is what is correlated: dark for few samples.
    fn densities(&self, predicted: &[f32], optimal: &[f32]) -> Result<(), Failure> {
        for (what, values) in [("predicted", predicted), ("optimal", optimal)] {
            let count = values.len().max(1) as f64;
            let ranks: Vec<f32> = ranks(values).iter().map(|rank| (rank / count) as f32).collect();
            self.save(what, &self.grey(&ranks))?;
        }
        Ok(())
    }

    fn grey(&self, values: &[f32]) -> RgbImage {
        let [width, height] = self.size;
        RgbImage::from_fn(width, height, |x, y| [values.get(y * width + x).copied().unwrap_or(0.0); 3])
    }
}

/// Where a picture is wrong: four times the root of the relative squared error.
fn error_map(picture: &RgbImage, truth: &RgbImage) -> RgbImage {
    RgbImage::from_fn(picture.width, picture.height, |x, y| {
        let i = y * picture.width + x;
        let (a, b) = (picture.pixels[i], truth.pixels[i]);
        std::array::from_fn(|c| 4.0 * ((a[c] - b[c]) * (a[c] - b[c]) / (b[c] * b[c] + 0.01)).sqrt())
    })
}

/// Spearman's: the correlation of ranks, ties with their mean rank.
fn rank_correlation(a: &[f32], b: &[f32]) -> f64 {
    let (a, b) = (ranks(a), ranks(b));
    let n = a.len() as f64;
    let mean = (n - 1.0) / 2.0;
    let (mut product, mut squares) = (0.0, [0.0; 2]);
    for (x, y) in a.iter().zip(&b) {
        let (x, y) = (x - mean, y - mean);
        product += x * y;
        squares[0] += x * x;
        squares[1] += y * y;
    }
    product / (squares[0] * squares[1]).sqrt().max(f64::MIN_POSITIVE)
}

fn ranks(values: &[f32]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&i, &j| values[i].total_cmp(&values[j]));
    let mut ranks = vec![0.0; values.len()];
    let mut begin = 0;
    while begin < order.len() {
        let mut end = begin + 1;
        while end < order.len() && values[order[end]] == values[order[begin]] {
            end += 1;
        }
        for &i in &order[begin..end] {
            ranks[i] = 0.5 * (begin + end - 1) as f64;
        }
        begin = end;
    }
    ranks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_of_what_rises_together_agree_whatever_the_scale() {
        let a: Vec<f32> = (0..100).map(|i| i as f32).collect();
        let b: Vec<f32> = a.iter().map(|v| v.exp().min(1e30)).collect();
        let c: Vec<f32> = a.iter().map(|v| -v).collect();
        assert!(rank_correlation(&a, &a) > 0.999 && rank_correlation(&a, &c) < -0.999);
        assert!(rank_correlation(&a, &b) > 0.9);
        assert!(rank_correlation(&a, &vec![1.0; 100]).abs() < 1e-9);
    }
}
