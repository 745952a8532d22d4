//! `path`: the reference path tracer that every other technique is measured against.
//!
//! Unidirectional paths from the eye, next-event estimation and material sampling joined by multiple importance
//! sampling, Russian roulette. Unbiased unless `clamp` is set. Cost: about three rays a vertex; error falls with the
//! square root of the samples. It is slow where light reaches the eye through small specular openings (caustics).

#[cfg(test)]
mod alone;
pub(super) mod block;
pub(super) mod integrator;
mod settings;
mod shadows;
#[cfg(test)]
mod tests;

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use halflight_scene::Frame;
use rayon::prelude::*;

pub use settings::PathSettings;

use crate::camera_sample::CameraSampler;
use crate::film::{Film, Tile};
use crate::technique::{Budget, Deadline, Progress, RenderReport, Technique, TechniqueError};
use block::Block;
use integrator::Integrator;

/// Columns and rows of the block of pixels whose camera rays are traced together.
const BLOCK: usize = 8;
/// Samples a pixel when neither samples, seconds nor error limit the work.
pub(super) const DEFAULT_SAMPLES: u32 = 64;
/// Most samples a pixel when only seconds or error limit the work.
pub(super) const MAX_SAMPLES: u32 = 1 << 24;
/// Samples in a pass once the first passes have shown the picture; also how often the error is looked at.
const PASS_SAMPLES: u32 = 16;

/// The technique `path`.
#[derive(Clone, Debug, Default)]
pub struct Path {
    settings: PathSettings,
}

impl Path {
    /// With settings other than the default.
    pub fn new(settings: PathSettings) -> Self {
        Self { settings }
    }
}

impl Technique for Path {
    fn divides(&self) -> bool {
        true
    }

    fn render(
        &self,
        frame: &Frame,
        film: &mut Film,
        budget: &Budget,
        progress: &dyn Progress,
    ) -> Result<RenderReport, TechniqueError> {
        let deadline = Deadline::new(budget.seconds);
        let unlimited = budget.seconds.is_none() && budget.error.is_none();
        let target = budget.samples.unwrap_or(if unlimited { DEFAULT_SAMPLES } else { MAX_SAMPLES });
        let camera = CameraSampler::new(frame, film.width(), film.height(), budget.seed);
        let integrator = Integrator::new(frame, self.settings);
        let rays = AtomicU64::new(0);
        let interrupted = AtomicBool::new(false);
        let mut report = RenderReport::default();
        loop {
            let done = film.min_samples();
            if done >= target || (done > 0 && deadline.passed()) || interrupted.load(Ordering::Relaxed) {
                break;
            }
            if done.is_multiple_of(PASS_SAMPLES)
                && budget.error.is_some_and(|limit| film.relative_error().is_some_and(|e| e <= limit))
            {
                break;
            }
            // Whole powers of two first, so that a picture is there early and the sequence is cut where it is best.
            let pass_end =
                if done < PASS_SAMPLES { (2 * done).max(1) } else { done + PASS_SAMPLES }.min(target);
            let tiles_done = AtomicU64::new(0);
            let tile_count = film.tiles().len() as u64;
            film.tiles_mut().par_iter_mut().for_each(|tile| {
                if progress.stop() {
                    interrupted.store(true, Ordering::Relaxed);
                }
                let late = done > 0 && deadline.passed();
                if late || interrupted.load(Ordering::Relaxed) {
                    return;
                }
                rays.fetch_add(render_tile(&integrator, &camera, tile, pass_end), Ordering::Relaxed);
                let tiles = tiles_done.fetch_add(1, Ordering::Relaxed) + 1;
                let samples = u64::from(done) * tile_count + tiles * u64::from(pass_end - done);
                progress.report("samples", samples, u64::from(target) * tile_count);
            });
            progress.pass(film);
        }
        report.elapsed = deadline.elapsed();
        report.rays = rays.into_inner();
        report.non_finite = film.non_finite();
        report.interrupted = interrupted.into_inner();
        report.relative_error = film.relative_error();
        Ok(report)
    }
}

/// Adds samples to every pixel of a tile until it has `target` of them; returns how many rays that took.
fn render_tile(integrator: &Integrator, camera: &CameraSampler, tile: &mut Tile, target: u32) -> u64 {
    let mut rays = 0;
    let mut block = Block::new();
    for top in (0..tile.height).step_by(BLOCK) {
        for left in (0..tile.width).step_by(BLOCK) {
            let columns = BLOCK.min(tile.width - left);
            let rows = BLOCK.min(tile.height - top);
            let first = tile.pixels[top * tile.width + left].samples;
            for sample in first..target {
                let place = [left, top, columns, rows];
                rays += render_block(integrator, camera, &mut block, tile, place, sample);
            }
        }
    }
    rays
}

/// One sample for each pixel of a block.
fn render_block<'a>(
    integrator: &Integrator<'a>,
    camera: &CameraSampler,
    block: &mut Block<'a>,
    tile: &mut Tile,
    [left, top, columns, rows]: [usize; 4],
    sample: u32,
) -> u64 {
    let place = |i: usize| [left + i % columns, top + i / columns];
    let in_film = |i: usize| [tile.x + place(i)[0], tile.y + place(i)[1]];
    let simd = integrator.frame.world.simd();
    let pixels = (0..columns * rows).map(in_film);
    let (count, samplers) = camera.rays(pixels, sample, simd, &mut block.rays);
    let mut rays = 0;
    integrator.radiance_of_block(block, count, samplers, &mut rays);
    for (i, &radiance) in block.radiance[..count].iter().enumerate() {
        let [x, y] = place(i);
        let pixel = &mut tile.pixels[y * tile.width + x];
        tile.non_finite += u64::from(!pixel.add(radiance));
    }
    rays
}
