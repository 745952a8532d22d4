//! Density estimation: caustics and fog from photons, each with a kernel of its own.
//!
//! In every pass a set of photons sets out and each pixel has one path; passes are independent and their mean is the picture
//! (Knaus & Zwicker 2011, "Progressive photon mapping: a probabilistic approach"). Kernels shrink from pass to pass, so that bias
//! and noise both go to zero. How wide they are, and which way, is told by the covariance that photons carry; `kernel = "fixed"` takes one
//! radius for all instead, r² falling by (i + α)/(i + 1) (their eq. 20). A pass has one time of the shutter.
//!
//! | file | what it does |
//! |---|---|
//! | `emit` | where photons set out |
//! | `flight` | their way, with covariance |
//! | `borders` | how much of a kernel lies within its medium |
//! | `kernel`, `tree` | how wide they are, and who reaches what |
//! | `eye` | paths from the eye that leave out what photons bring |

mod borders;
mod emit;
mod eye;
mod flight;
mod kernel;
#[cfg(test)]
mod tests;
mod tree;

use glam::{Vec2, Vec3};
use halflight_frequency::covariance::Steps;
use halflight_scene::Frame;
use halflight_scene::camera::View;
use halflight_trace::DistanceGrid;
use rayon::prelude::*;

use super::film_axes::FilmAxes;
use super::settings::{CovarianceSettings, Kernel, Textures};
use super::spread::Spread;
use crate::camera_sample::CameraSampler;
use crate::film::Film;
use crate::looks::Stages;
use crate::sampler::Sampler;
use crate::technique::{Budget, Deadline, Progress, RenderReport, TechniqueError};
use crate::techniques::path::integrator::Integrator;
use crate::techniques::path::{DEFAULT_SAMPLES, MAX_SAMPLES};
use crate::tracking::Passage;
use borders::Borders;
use emit::Sources;
use eye::{Eye, Seen};
use flight::{Flights, Landed};
use kernel::Rule;
use tree::Tree;

/// What tells the random numbers of photons from those of pixels.
const OF_PHOTONS: u64 = 0x2545_f491_4f6c_dd1d;
/// Photons that a thread sends at once.
const PART: u32 = 512;
/// Voxels along the longest side of the grid of what is near in media.
const GRID: usize = 160;

/// The photons of a pass.
#[derive(Debug, Default)]
pub(super) struct Photons {
    on_surfaces: Tree,
    in_media: Tree,
    /// Whether there are lights that send any; else paths from the eye leave nothing out.
    complete: bool,
}

/// What all passes share.
pub(super) struct Method<'a> {
    frame: &'a Frame,
    settings: CovarianceSettings,
    integrator: Integrator<'a>,
    sources: Sources<'a>,
    near: Option<DistanceGrid>,
    /// The first radius of fixed kernels.
    radius: f32,
    /// Where the eye is, and the width of a pixel at a distance of 1.
    eye: Vec3,
    pixel: f32,
    seed: u64,
}

impl<'a> Method<'a> {
    pub(super) fn new(frame: &'a Frame, settings: CovarianceSettings, axes: &FilmAxes, seed: u64) -> Self {
        let integrator = Integrator::new(frame, settings.of_paths());
        let sources = Sources::new(frame);
        let carry = settings.kernel == Kernel::Covariance;
        let near = sources
            .region()
            .filter(|_| carry)
            .map(|(low, high)| DistanceGrid::build_within(&frame.world, low, high, GRID));
        // Four pixels where the camera is focused.
        let radius = settings.radius.unwrap_or(4.0 * axes.pixel * frame.camera.focus_distance.min(1e4));
        let eye = frame.camera.pose[0].translation.into();
        Self { frame, settings, integrator, sources, near, radius, eye, pixel: axes.pixel, seed }
    }

    /// The time of the shutter of a pass, the same for all that it traces.
    fn time(&self, pass: u32) -> f32 {
        if self.frame.shutter_is_open() {
            Sampler::new(self.seed ^ OF_PHOTONS, 1, 0, pass).next_four()[0]
        } else {
            0.0
        }
    }

    fn flights(&self) -> Flights<'_> {
        let (low, high) = self.frame.bounds;
        let size = 0.5 * low.distance(high);
        Flights {
            integrator: &self.integrator,
            sources: &self.sources,
            near: self.near.as_ref(),
            carry: self.settings.kernel == Kernel::Covariance,
            size: if size > 0.0 { size } else { 1.0 },
        }
    }

    /// The random numbers of a photon.
    fn sampler(&self, pass: u32, number: u32) -> Sampler {
        Sampler::new(self.seed ^ OF_PHOTONS, 0, pass, number)
    }

    /// The rule of a pass's kernels, passes counted from 0.
    fn rule(&self, pass: u32) -> Rule {
        match self.settings.kernel {
            Kernel::Covariance => {
                Rule::Covariance { pass: (pass + 1) as f32, eye: self.eye, pixel: self.pixel }
            }
            Kernel::Fixed => {
                let alpha = f64::from(self.settings.radius_falloff);
                let shrink: f64 = (1..=pass).map(|i| (f64::from(i) + alpha) / (f64::from(i) + 1.0)).product();
                Rule::Fixed(self.radius * shrink.sqrt() as f32)
            }
        }
    }

    /// The photons of a pass.
    pub(super) fn photons(&self, pass: u32) -> Photons {
        if !self.sources.are_of_use() {
            return Photons::default();
        }
        let (count, time, flights) = (self.settings.photons, self.time(pass), self.flights());
        let parts: Vec<Vec<Landed>> = (0..count.div_ceil(PART))
            .into_par_iter()
            .map(|part| {
                let mut landed = Vec::new();
                for number in part * PART..((part + 1) * PART).min(count) {
                    let mut sampler = self.sampler(pass, number);
                    flights.fly(number, count as f32, time, &mut sampler, &mut landed, None);
                }
                landed
            })
            .collect();
        let (mut on_surfaces, mut in_media) = (Vec::new(), Vec::new());
        for landed in parts.into_iter().flatten() {
            if landed.power.is_finite() && landed.position.is_finite() {
                if landed.normal == Vec3::ZERO { &mut in_media } else { &mut on_surfaces }.push(landed);
            }
        }
        let rule = self.rule(pass);
        let borders = Borders { frame: self.frame, near: self.near.as_ref(), time };
        let (on_surfaces, in_media) =
            rayon::join(|| Tree::new(on_surfaces, rule, None), || Tree::new(in_media, rule, Some(&borders)));
        Photons { on_surfaces, in_media, complete: true }
    }

    /// The events of a photon of a pass.
    pub(super) fn steps(&self, pass: u32, number: u32) -> Steps<5> {
        let mut steps = Steps::default();
        let count = self.settings.photons as f32;
        let (mut sampler, mut landed) = (self.sampler(pass, number), Vec::new());
        self.flights().fly(number, count, self.time(pass), &mut sampler, &mut landed, Some(&mut steps));
        steps
    }

    /// What pixel (x, y) sees in a pass; `told` hears of photons, by number and radius, and what each brought.
    pub(super) fn look(
        &self,
        photons: &Photons,
        view: &View,
        [x, y]: [usize; 2],
        pass: u32,
        passage: &mut Passage,
        mut told: impl FnMut(u32, f32, f32),
    ) -> Seen {
        let mut sampler = Sampler::new(self.seed, x as u32, y as u32, pass);
        let u = sampler.next_four();
        let pixel = Vec2::new(x as f32 + u[0], y as f32 + u[1]);
        let (lens, time) = (Vec2::new(u[2], u[3]), self.time(pass));
        let shutter = self.frame.shutter_is_open();
        let spread = Spread::of_camera(self.settings.textures, view, pixel, lens, time, shutter, pass);
        let eye = Eye { integrator: &self.integrator, photons };
        let told = |photon: &kernel::Photon, brought: f32| told(photon.number, photon.radius, brought);
        eye.look(view.ray(pixel, lens, time), &mut sampler, spread, passage, told)
    }
}

/// Paths without photons, whose textures are averaged over what they stand for.
pub(super) struct Averaged<'a> {
    integrator: &'a Integrator<'a>,
    nothing: Photons,
    textures: Textures,
}

impl<'a> Averaged<'a> {
    pub(super) fn new(integrator: &'a Integrator<'a>, textures: Textures) -> Self {
        Self { integrator, nothing: Photons::default(), textures }
    }

    /// The radiance of a sample of a pixel, which is number `index` of all of its pixel.
    pub(super) fn radiance(
        &self,
        camera: &CameraSampler,
        [x, y]: [usize; 2],
        sample: u32,
        index: u32,
    ) -> Vec3 {
        let ((pixel, lens, time), mut sampler) = camera.place(x, y, sample);
        let (view, shutter) = (camera.view(), self.integrator.frame.shutter_is_open());
        let spread = Spread::of_camera(self.textures, view, pixel, lens, time, shutter, index);
        let eye = Eye { integrator: self.integrator, photons: &self.nothing };
        let ray = view.ray(pixel, lens, time);
        eye.look(ray, &mut sampler, spread, &mut Passage::default(), |_, _| ()).radiance
    }
}

/// A picture by photons, pass after pass.
pub(super) fn render(
    settings: CovarianceSettings,
    frame: &Frame,
    film: &mut Film,
    budget: &Budget,
    progress: &dyn Progress,
) -> Result<RenderReport, TechniqueError> {
    let deadline = Deadline::new(budget.seconds);
    let unlimited = budget.seconds.is_none() && budget.error.is_none();
    let target = budget.samples.unwrap_or(if unlimited { DEFAULT_SAMPLES } else { MAX_SAMPLES });
    let (width, height) = (film.width(), film.height());
    let axes = FilmAxes::new(frame, width, height);
    let mut stages = Stages::default();
    let method = stages.time("lights", || Method::new(frame, settings, &axes, budget.seed));
    let view = frame.camera.view(width, height);
    let mut report = RenderReport::default();
    let mut radii = vec![[0.0f32; 2]; width * height];
    while film.min_samples() < target {
        let pass = film.min_samples();
        if pass > 0 && (progress.stop() || deadline.passed()) {
            report.interrupted = progress.stop();
            break;
        }
        if pass.is_multiple_of(16)
            && budget.error.is_some_and(|limit| film.relative_error().is_some_and(|e| e <= limit))
        {
            break;
        }
        let photons = stages.time("photons", || method.photons(pass));
        let mut picture = vec![Vec3::ZERO; width * height];
        stages.time("paths", || {
            picture.par_chunks_mut(width).zip(radii.par_chunks_mut(width)).enumerate().for_each(
                |(y, (row, radii))| {
                    let mut passage = Passage::default();
                    for (x, (out, radii)) in row.iter_mut().zip(radii).enumerate() {
                        let seen = method.look(&photons, &view, [x, y], pass, &mut passage, |_, _, _| ());
                        *out = seen.radiance;
                        radii[0] += seen.radii;
                        radii[1] += seen.of_photons;
                    }
                },
            );
        });
        report.rays += u64::from(settings.photons) * 3 + (width * height * 6) as u64;
        report.non_finite += film.add_picture(&picture);
        progress.report("passes", u64::from(pass + 1), u64::from(target));
        progress.pass(film);
    }
    if method.sources.are_of_use() {
        let radius = radii.iter().map(|[sum, weight]| if *weight > 0.0 { sum / weight } else { 0.0 });
        film.layers.insert("photon-radius".into(), radius.collect());
        report.notes.push(format!(
            "photons: {} a pass, kernels shrink with each; what they gather is exact in the limit alone",
            settings.photons
        ));
    } else {
        report
            .notes
            .push("nothing smooth and no medium: photons have nothing to bring, paths do it all".into());
    }
    report.elapsed = deadline.elapsed();
    report.stages = stages.into_times();
    report.relative_error = film.relative_error();
    Ok(report)
}
