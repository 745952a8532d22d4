//! `covariance`: path tracing that knows how fast its light varies.
//!
//! A few pilot paths of each pixel carry a covariance matrix from the light to the film, over position, angle and time (see
//! `halflight_frequency::covariance`). From it follow where samples are needed and how wide a filter may be; what the samples
//! measure then corrects both. So what lens, shutter, gloss and fog blur takes few samples, and a picture of many goes to that
//! of `path`: the estimator is the same.
//!
//! | file | what it does |
//! |---|---|
//! | `look` | what the middle of the lens sees, and the nearest edges |
//! | `lamps` | how fast lights vary |
//! | `pilot`, `trail` | paths, and the walk of their light to the film |
//! | `products` | textures and media that multiply light |
//! | `film_axes` | the camera as the last operator |
//! | `allocate`, `gather` | how many samples, and taking them |
//! | `guides`, `regress` | what pixels show at first sight, and filters that follow it |
//! | `reconstruct` | filters |
//! | `spread` | footprints of textures at every vertex |
//! | `photons` | density estimation, another method than all this |
//! | `explain` | the chain of one pixel, in words |
//!
//! Source: seed \[003\] (Belcour et al. 2013, 2014), corrected as `docs/errata.md` says. Costs: `halflight bench covariance`.

mod allocate;
mod explain;
mod film_axes;
mod gather;
mod guides;
mod lamps;
mod look;
mod photons;
mod pilot;
mod products;
mod reconstruct;
mod regress;
mod settings;
mod spread;
#[cfg(test)]
mod tests;
mod trail;

use std::time::{Duration, Instant};

use halflight_scene::Frame;
use rayon::prelude::*;

pub use settings::{CovarianceSettings, Kernel, Method, Reconstruction, Sampling, Textures};

use super::path::integrator::Integrator;
use super::path::{DEFAULT_SAMPLES, MAX_SAMPLES};
use crate::camera_sample::CameraSampler;
use crate::film::{Film, Pixel};
use crate::looks::Stages;
use crate::technique::{Budget, Deadline, Progress, RenderReport, Technique, TechniqueError};
use allocate::Known;
use film_axes::FilmAxes;
use gather::{HALF, Halves, Square, fill, flat};
use lamps::Lamps;
use look::Look;
use photons::Averaged;
use pilot::{Forecast, Found, Group, Pilots, forecast};
use reconstruct::{Filters, Shape, reconstruct};

/// Side of the cells, in pixels, that share their pilots.
const CELL: usize = 4;
/// Samples that every pixel has before any has more.
const FIRST: u32 = 4;
/// Passes of the rest, each with what the ones before have shown.
const PASSES: u32 = 3;

/// The technique `covariance`.
#[derive(Clone, Debug, Default)]
pub struct Covariance {
    settings: CovarianceSettings,
}

impl Covariance {
    /// With settings other than the default.
    pub fn new(settings: CovarianceSettings) -> Self {
        Self { settings }
    }
}

/// Traces the pilots of every cell, and says what follows for each pixel from those of the cells around it and from its own
/// nearest edge. Also returns how many rays it took, roughly: about four for each vertex of two.
fn foretell(pilots: &Pilots, look: &Look, camera: &CameraSampler, count: u32) -> (Vec<Forecast>, u64) {
    let (width, height) = (look.width, look.height);
    let (columns, rows) = (width.div_ceil(CELL), height.div_ceil(CELL));
    let cells: Vec<Found> = (0..columns * rows)
        .into_par_iter()
        .with_min_len(16)
        .map_init(Group::default, |group, cell| {
            let mut found = Found::default();
            for pilot in 0..count {
                // At pixels of the cell in turn, the middle ones first.
                const ORDER: [[usize; 2]; 4] = [[1, 1], [2, 2], [2, 1], [1, 2]];
                let [dx, dy] = ORDER[pilot as usize % ORDER.len()];
                let x = (cell % columns * CELL + dx).min(width - 1);
                let y = (cell / columns * CELL + dy).min(height - 1);
                let (ray, mut sampler) = camera.ray(x, y, pilot / ORDER.len() as u32);
                pilots.trace(ray, &mut sampler, group, None);
            }
            pilots.walk(group, &mut found);
            found
        })
        .collect();
    let mut forecasts = vec![Forecast::default(); width * height];
    forecasts.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        for (x, out) in row.iter_mut().enumerate() {
            let found = around(&cells, [columns, rows], [x, y]);
            let ray = pilots.axes.direction(x, y);
            let edge = trail::edge(&look.edges[y * width + x], ray, pilots.axes);
            *out = forecast(&found, &edge, pilots.axes);
        }
    });
    (forecasts, cells.len() as u64 * u64::from(count) * 8)
}

/// The four cells about a pixel together.
fn around(cells: &[Found], [columns, rows]: [usize; 2], [x, y]: [usize; 2]) -> Found {
    let half = CELL / 2;
    let pair = |at: usize, count: usize| {
        let first = (at + half) / CELL;
        [first.saturating_sub(1), first.min(count - 1)]
    };
    let mut all = Found::default();
    for v in pair(y, rows) {
        for u in pair(x, columns) {
            all.merge(&cells[v * columns + u]);
        }
    }
    all
}

impl Technique for Covariance {
    fn render(
        &self,
        frame: &Frame,
        film: &mut Film,
        budget: &Budget,
        progress: &dyn Progress,
    ) -> Result<RenderReport, TechniqueError> {
        if self.settings.method == Method::Photons {
            return photons::render(self.settings, frame, film, budget, progress);
        }
        let deadline = Deadline::new(budget.seconds);
        let unlimited = budget.seconds.is_none() && budget.error.is_none();
        let target = budget.samples.unwrap_or(if unlimited { DEFAULT_SAMPLES } else { MAX_SAMPLES });
        let mut report = RenderReport::default();
        if target == 0 || film.mean_samples() >= f64::from(target) {
            return Ok(report);
        }
        let mut stages = Stages::default();
        let (width, height) = (film.width(), film.height());
        let cameras =
            [budget.seed, budget.seed ^ HALF].map(|seed| CameraSampler::new(frame, width, height, seed));
        let integrator = Integrator::new(frame, self.settings.of_paths());
        let averaged = (self.settings.textures != Textures::Points)
            .then(|| Averaged::new(&integrator, self.settings.textures));
        let axes = FilmAxes::new(frame, width, height);
        let look = stages.time("edges", || Look::new(frame, &axes, width, height));
        let mut squares: Vec<Square<Halves>> = Square::cover(width, height);
        let lamps = Lamps::new(frame);
        let pilots = Pilots {
            integrator: Integrator::new(frame, self.settings.of_paths()),
            axes: &axes,
            lamps: &lamps,
            carry: true,
        };
        let (forecasts, rays) =
            stages.time("pilots", || foretell(&pilots, &look, &cameras[0], self.settings.pilots));
        report.rays += rays + (width * height) as u64;
        let shape = |precision| Shape::new(precision, self.settings.widest_filter);
        let shapes: Vec<Shape> = forecasts.iter().map(|f| shape(f.precision)).collect();
        let filtered = self.settings.reconstruction == Reconstruction::Filtered;
        let open: Vec<Shape> = forecasts.iter().map(|f| shape(f.open)).collect();
        // Between what filters that heed edges gather and what guided ones do.
        let gathered = |(shape, open): (&Shape, &Shape)| (shape.area(0.4) * open.area(0.4)).sqrt();
        let area: Vec<f32> =
            if filtered { shapes.iter().zip(&open).map(gathered).collect() } else { vec![1.0; shapes.len()] };
        let both = |squares: &[Square<Halves>]| flat(squares, width, Halves::both);
        let stop = || progress.stop() || deadline.passed();
        let pixels = (width * height) as u64;
        let (mut done, mut taken) = (0, 0);
        let mut known = Known::empty(width, height);
        while done < target && !(stop() && done > 0) {
            let next = self.next_pass(done, target, taken);
            let now = both(&squares);
            let goal = u64::from(next) * pixels;
            let targets = if self.settings.sampling == Sampling::Uniform || next <= FIRST {
                vec![next; now.len()]
            } else {
                known.measure(&now);
                known.targets(&now, &area, goal)
            };
            for square in &mut squares {
                for i in 0..square.pixels.len() {
                    let [x, y] = square.place(i);
                    square.pixels[i].target = targets[y * width + x];
                }
            }
            let (rays, lost) = stages.time("samples", || {
                fill(&integrator, &cameras, averaged.as_ref(), &mut squares, &|| progress.stop())
            });
            report.rays += rays;
            report.non_finite += lost;
            if taken == 0 {
                known = Known::predict(&both(&squares), &forecasts, width);
            }
            done = next;
            taken += 1;
            progress.report("samples", u64::from(done), u64::from(target));
        }
        report.interrupted = progress.stop();
        let halves = flat(&squares, width, |pixel| *pixel);
        let samples = both(&squares);
        known.measure(&samples);
        let picture = filtered.then(|| {
            let camera = CameraSampler::new(frame, width, height, budget.seed ^ guides::SEED);
            let (guides, rays) = stages.time("guides", || guides::guides(frame, &axes, &look, &camera, done));
            report.rays += rays;
            stages.time("filters", || {
                let filters =
                    Filters { shapes: &shapes, open: &open, guides: &guides, size: [width, height] };
                reconstruct(&halves, &filters, frame.world.simd())
            })
        });
        put(film, &samples, picture.as_ref());
        film.set_samples_elsewhere(samples.iter().map(|pixel| pixel.samples).min().unwrap_or(0));
        add_layers(film, &known, &forecasts, &shapes, picture.as_ref());
        progress.pass(film);
        report.elapsed = deadline.elapsed();
        report.stages = stages.into_times();
        report.relative_error = film.relative_error();
        if filtered {
            report
                .notes
                .push("filtered: pixels share samples as far as covariance and their own noise allow".into());
        }
        Ok(report)
    }
}

impl Covariance {
    /// Samples a pixel after the next pass.
    fn next_pass(&self, done: u32, target: u32, taken: u32) -> u32 {
        if done < FIRST.min(target) {
            return FIRST.min(target);
        }
        if self.settings.sampling == Sampling::Uniform {
            return target;
        }
        let left = target - done;
        let of = PASSES.saturating_sub(taken.saturating_sub(1)).max(1);
        // Without a limit of samples: twice as many each time, for seconds to end it.
        (done + (left / of).max(1)).min(done.saturating_mul(4).max(FIRST)).min(target)
    }
}

/// The samples into the film, and the filtered picture in their place.
fn put(film: &mut Film, samples: &[Pixel], picture: Option<&reconstruct::Picture>) {
    let width = film.width();
    for tile in film.tiles_mut() {
        for i in 0..tile.pixels.len() {
            let at = (tile.y + i / tile.width) * width + tile.x + i % tile.width;
            let mut pixel = samples[at];
            if let Some(picture) = picture {
                // The filtered mean, with the variance that the samples have.
                let n = f64::from(pixel.samples.max(1));
                let luminance = |sum: [f64; 3]| (0.2126 * sum[0] + 0.7152 * sum[1] + 0.0722 * sum[2]) / n;
                let before = luminance(pixel.sum);
                pixel.sum = picture.radiance[at].to_array().map(|c| f64::from(c) * n);
                let after = luminance(pixel.sum);
                pixel.sum_squares = (pixel.sum_squares - n * before * before).max(0.0) + n * after * after;
            }
            tile.pixels[i] = pixel;
        }
    }
}

/// What was predicted and done, as layers of the picture.
fn add_layers(
    film: &mut Film,
    known: &Known,
    forecasts: &[Forecast],
    shapes: &[Shape],
    picture: Option<&reconstruct::Picture>,
) {
    // Both as densities of mean 1, so that they can be compared.
    let unit = |values: &[f32]| {
        let mean = values.iter().map(|v| f64::from(*v)).sum::<f64>() / values.len().max(1) as f64;
        let scale = if mean > 0.0 { 1.0 / mean as f32 } else { 0.0 };
        values.iter().map(|v| v * scale).collect::<Vec<f32>>()
    };
    // Of all that samples differ by, what neither pixel, lens nor shutter are answerable for is the light's.
    let light = known.predicted.iter().zip(forecasts);
    let light = light.map(|(p, f)| (1.0 + p * p * (1.0 - f.varies).max(0.0)).sqrt()).collect();
    let (predicted, measured) = (unit(&known.predicted), unit(&known.measured));
    let disagreement =
        predicted.iter().zip(&measured).map(|(p, m)| (p.max(1e-3) / m.max(1e-3)).log2()).collect();
    let mut add = |name: &str, values: Vec<f32>| film.layers.insert(name.to_string(), values);
    add("predicted-density", predicted);
    add("measured-density", measured);
    add("density-disagreement", disagreement);
    add("covariance-density", forecasts.iter().map(|f| f.density).collect());
    add("lens-density", forecasts.iter().map(|f| f.lens).collect());
    add("shutter-density", forecasts.iter().map(|f| f.shutter).collect());
    add("light-density", light);
    add("filter.narrow", shapes.iter().map(|s| s.deviations[0]).collect());
    add("filter.wide", shapes.iter().map(|s| s.deviations[1]).collect());
    if let Some(picture) = picture {
        add("filter.scale", picture.scale.clone());
        add("filter.guided", picture.guided.clone());
    }
}

impl Covariance {
    /// The time that `count` paths of each pixel take, with or without covariance, for measuring what it costs: in groups of as
    /// many as are pilots of a cell.
    pub fn pilots_alone(
        &self,
        frame: &Frame,
        [width, height]: [usize; 2],
        count: u32,
        carry: bool,
    ) -> Duration {
        let axes = FilmAxes::new(frame, width, height);
        let camera = CameraSampler::new(frame, width, height, 0);
        let integrator = Integrator::new(frame, self.settings.of_paths());
        let lamps = Lamps::new(frame);
        let pilots = Pilots { integrator, axes: &axes, lamps: &lamps, carry };
        let start = Instant::now();
        let together = self.settings.pilots.max(1);
        (0..width * height).into_par_iter().with_min_len(64).for_each_init(Group::default, |group, i| {
            let mut found = Found::default();
            for sample in 0..count {
                let (ray, mut sampler) = camera.ray(i % width, i / width, sample);
                std::hint::black_box(pilots.trace(ray, &mut sampler, group, None));
                if (sample + 1) % together == 0 || sample + 1 == count {
                    pilots.walk(group, &mut found);
                }
            }
            std::hint::black_box(found);
        });
        start.elapsed()
    }
}
