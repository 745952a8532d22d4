//! The bandwidth buffer: before anything is shaded, how fast the picture varies at each pixel and how noisy it will be.
//!
//! ```text
//! ν = Σ λ_i (ν_i⁻² + ρ_i⁻²)^(-1/2)/Σ λ_i   over n_b directions of the lobe, λ = L f cos θ/p        [001] eq. (5)
//! b = ν |2 c d'/cos θ + 1| · roundness · pixel angle + texture                                   eq. (4), (6), corrected
//! V = Var λ/p, N = V/(target · mean)²                                                            §2.4
//! ```
//!
//! The sums over directions vary slowly: they are judged at every fourth pixel of every fourth row, each takes the noisiest of
//! those beside it, and a pixel what lies between those around it that are of its own object and material, or makes its own.
//! Curvature, distance,
//! angle and texture are the pixel's own. For distant light one mean serves all of them, as the rest of the
//! chain is the same for all directions.
//!
//! The variance is that of importance sampling as the directions tell it, where L² is the mean over what a direction
//! stands for: a sun between the directions counts. What is told as the pixel's variance is twice that estimate.

use std::sync::Arc;

use glam::Vec3;
use halflight_frequency::bandwidth::{Exit, UNLIMITED, pixel};
use halflight_frequency::importance::point as sequence;
use halflight_material::SurfaceInput;
use halflight_scene::Frame;
use halflight_scene::lights::{Arrival, luminance};
use rayon::prelude::*;

use super::curvature::{self, Bend};
use super::light::FrameLight;
use super::lobes::{Directions, Lobe, Probe};
use super::samples::{GROUP, MOST_SAMPLES};
use super::settings::BandwidthSettings;
use super::shade::Way;
use super::surface::{SurfacePoint, Surfaces};

/// Pixels between judgements, along each axis.
const STRIDE: usize = 4;
/// Least cosine between normals that are judged alike.
const ALIKE: f32 = 0.5;
/// Points of local lights by which a pixel is judged, at most.
const LOCAL: u32 = 8;
/// Coarsest level: one pixel in 256 is shaded at least.
pub(super) const COARSEST: i32 = 4;
/// Fewest and most samples of each kind of light.
pub(super) const FEWEST: u32 = GROUP as u32;
/// Fewest of convolved light: all pixels take the same, and of fewer what they miss shows where the number changes.
const FEWEST_FILTERED: u32 = 128;
/// A pixel darker than this share of the mean needs no smaller error than one that has it.
const DARK: f32 = 0.1;
/// At an error of 4 % pixels are shaded this much more densely than Nyquist's rate: what lies between is interpolated
/// linearly, which needs more than a sinc does. Chosen by `halflight bench bandwidth`.
const DENSITY: f32 = 1.5;
/// Light that was convolved with the gaps between samples has hardly any noise that their even distribution leaves.
const STRATIFIED: f32 = 0.25;
/// The variance of the mean of N points of lamps falls with this power of N: they are those of a sequence that fills squares
/// evenly, and an edge across it, a shadow's or a panel's, still leaves this.
const LAMPS_FALL: f32 = 1.5;
/// The variance that is told is so many times what the directions tell, as they are few and neighbours of what they mean.
const CAUTION: f32 = 2.1;
/// Squared relative error of one sample of a lobe so sharp that it sees a sun or does not.
const FOUND: f32 = 4.0;
/// The error at which it is that.
const DENSITY_ERROR: f32 = 0.04;

/// What the directions of light at one place tell.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Judgement {
    /// Means of the luminance from the environment and from local lights.
    pub(super) mean: [f32; 2],
    /// Variance of one sample of each.
    pub(super) variance: [f32; 2],
    /// Mean of what the lobe passes of ν, cycles per radian.
    pub(super) limited: f32,
    /// The variances over the squares of the means.
    pub(super) relative: [f32; 2],
    /// ν_a at the eye from local lights, with the curvature of that place, cycles per radian.
    pub(super) local: f32,
}

impl Judgement {
    /// Of one kind of light alone.
    fn of(kind: usize, mean: f32, variance: f32) -> Self {
        let mut judged = Self::default();
        judged.mean[kind] = mean;
        judged.variance[kind] = variance;
        judged.relative[kind] = (variance / (mean * mean).max(f32::MIN_POSITIVE)).min(f32::MAX);
        judged
    }

    fn add(&mut self, other: &Self, weight: f32) {
        for kind in 0..2 {
            self.mean[kind] += weight * other.mean[kind];
            self.variance[kind] += weight * other.variance[kind];
            self.relative[kind] += weight * other.relative[kind];
        }
        self.limited += weight * other.limited;
        self.local += weight * other.local;
    }

    fn over(&self, weights: f32) -> Self {
        let mut mean = Self::default();
        mean.add(self, 1.0 / weights);
        mean
    }
}

/// What is predicted of a pixel.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Predicted {
    /// Cycles per pixel.
    pub(super) bandwidth: f32,
    /// Cautious variance of one sample over the squared mean, both lights together.
    pub(super) variance: f32,
    /// Samples of the environment and of local lights.
    pub(super) samples: [u16; 2],
    /// Level of the pyramid at which light asks for shading, 0 the picture itself, −1 and −2 below.
    pub(super) level: i8,
    /// The same with the pictures that are multiplied in afterwards: how finely the pixel itself is to be looked at.
    pub(super) detail: i8,
}

/// What a judge needs to know.
pub(super) struct Judge<'a> {
    pub(super) frame: &'a Frame,
    pub(super) light: &'a FrameLight<'a>,
    pub(super) lobes: &'a [Arc<Lobe>],
    pub(super) settings: &'a BandwidthSettings,
    /// Radians that a pixel spans at most.
    pub(super) pixel_angle: f32,
}

impl<'a> Judge<'a> {
    pub(super) fn new(
        frame: &'a Frame,
        light: &'a FrameLight<'a>,
        lobes: &'a [Arc<Lobe>],
        settings: &'a BandwidthSettings,
        [width, height]: [usize; 2],
    ) -> Self {
        let view = frame.camera.view(width, height);
        let middle = 0.5 * glam::Vec2::new(width as f32, height as f32);
        let towards = |at| view.ray(at, glam::Vec2::splat(0.5), 0.0).direction;
        let ahead = towards(middle);
        // Chords, not arcs: a pixel of a wide picture of few pixels may span more than a right angle.
        let angle = |step| (towards(middle + 0.5 * step) - towards(middle - 0.5 * step)).length();
        let pixel_angle = angle(glam::Vec2::X).max(angle(glam::Vec2::Y));
        debug_assert!(ahead.is_finite());
        Self { frame, light, lobes, settings, pixel_angle }
    }

    /// The surface and the way to the eye, without the texture.
    pub(super) fn exit(point: &SurfacePoint, bend: &Bend) -> Exit {
        let (curvature, distance) = (bend.curvature[0], point.distance);
        Exit { curvature, distance, cos_exit: point.cos_exit(), texture: 0.0 }
    }

    /// Judges what a pixel shows by n_b directions to the environment and a few to local lights.
    pub(super) fn judge(&self, surfaces: &Surfaces, pixel: [usize; 2]) -> Judgement {
        let point = surfaces.at(pixel[0], pixel[1]);
        let mut judged = Judgement::default();
        let lobe = &self.lobes[point.material as usize];
        let view = point.view();
        let [x, y, z] = turned(point.axes(), view).map(|axis| self.light.to_map * axis);
        let front = self.light.to_map * point.geometric_normal;
        if self.light.environment.is_some() {
            let way = Way::of(point, lobe, self.light, self.settings);
            judged = lobe
                .probes(view.z)
                .map(|probes| self.judge_distant(probes, way.filtered, [x, y, z], front))
                .reduce(|a, b| larger(&a, &b))
                .unwrap_or_default();
            self.judge_suns(point, lobe, way.suns, &mut judged);
        }
        if self.light.has_local() && !matches!(lobe.directions, Directions::Single | Directions::None) {
            let bend = curvature::measure(surfaces, lobe, pixel);
            let local = self.judge_local(point, &bend, lobe);
            judged.mean[1] = local.mean[1];
            judged.variance[1] = local.variance[1];
            judged.relative[1] = local.relative[1];
            judged.local = local.local;
        }
        judged
    }

    /// What a lobe brings to the eye of the environment.
    fn judge_distant(
        &self,
        probes: &[Probe],
        filtered: bool,
        [x, y, z]: [Vec3; 3],
        front: Vec3,
    ) -> Judgement {
        let target = self.settings.target_error();
        let (mut first, mut second, mut limited) = (0.0, 0.0, 0.0);
        for probe in probes {
            let direction = probe.direction.x * x + probe.direction.y * y + probe.direction.z * z;
            let leaks = direction.dot(front) * probe.direction.z <= 0.0;
            let gain = if leaks { 0.0 } else { probe.gain };
            let solid_angle =
                if filtered { probe.solid_angle.max(probe.blurred * target) } else { probe.solid_angle };
            let brought = self.light.brought(direction, solid_angle);
            let weight = gain * brought.mean;
            first += weight;
            second += gain * gain * if filtered { brought.mean * brought.mean } else { brought.mean_square };
            limited += weight * passed(brought.bandwidth, probe.lobe);
        }
        let mut judged = Judgement::of(0, first / probes.len() as f32, variance(first, second, probes.len()));
        judged.limited = if first > 0.0 { limited / first } else { 0.0 };
        judged
    }

    /// Adds what suns bring: they pass all that the lobe does, and have no noise where they are asked by themselves.
    fn judge_suns(&self, point: &SurfacePoint, lobe: &Lobe, asked: bool, judged: &mut Judgement) {
        if self.light.suns.is_empty() || matches!(lobe.directions, Directions::Single | Directions::None) {
            return;
        }
        let bsdf = point.bsdf(self.frame);
        let (axes, mut view) = (point.axes(), point.view());
        view.z *= point.side;
        let (mut mean, mut limited) = (0.0, 0.0);
        for sun in &self.light.suns {
            let (direction, power) = sun.whole();
            let [x, y, z] = axes.map(|axis| axis.dot(direction));
            if point.geometric_normal.dot(direction) * z <= 0.0 {
                continue;
            }
            let weight = luminance(bsdf.eval(view, Vec3::new(x, y, point.side * z)) * power);
            mean += weight;
            limited += weight * lobe.towards(point, direction);
        }
        let all = judged.mean[0] + mean;
        if !(all > 0.0 && all.is_finite()) {
            return;
        }
        let variance = judged.variance[0] + if asked { 0.0 } else { FOUND * mean * mean };
        let limited = (judged.mean[0] * judged.limited + limited) / all;
        *judged = Judgement { limited, ..Judgement::of(0, all, variance) };
    }

    /// What local lights bring to the eye, by the lobe at this place or by the part of a mix that asks for most.
    fn judge_local(&self, point: &SurfacePoint, bend: &Bend, lobe: &Lobe) -> Judgement {
        let exit = Self::exit(point, bend);
        let parts = lobe.parts.mixed();
        let here = SurfaceInput::default();
        let bsdfs = match parts {
            Some([first, second]) => [first.bsdf(&here), second.bsdf(&here)],
            None => [point.bsdf(self.frame); 2],
        };
        let number = if parts.is_some() { 2 } else { 1 };
        let (axes, mut view) = (point.axes(), point.view());
        view.z *= point.side;
        let mut sums = [[0.0f32; 3]; 2];
        let count = self.settings.directions.min(LOCAL);
        for i in 0..count {
            let choice = ((i as f32 + 0.5) * 0.618_034).fract();
            let u = sequence(i, 5);
            let Some((sample, lamp)) = self.light.local.sample_on(point.position, choice, u, 0.0) else {
                continue;
            };
            let Arrival::From { point: from, radiance } = sample.arrival else { continue };
            let cosine = point.normal.dot(sample.direction);
            if point.geometric_normal.dot(sample.direction) * cosine <= 0.0 {
                continue;
            }
            let [x, y, z] = axes.map(|axis| axis.dot(sample.direction));
            let local = Vec3::new(x, y, point.side * z);
            let rho = lobe.bandwidth.at(Vec3::new(x, y, z), point.view());
            let at_eye = match from {
                Some(from) => {
                    let distance = from.distance(point.position);
                    // A point has no limit.
                    let emitters = self.light.local.emitters();
                    let light = lamp.map_or(UNLIMITED, |(i, uv)| self.light.lamps.at(emitters, i, uv));
                    exit.local(light, distance, cosine.abs(), rho).angular
                }
                None => exit.distant(UNLIMITED, rho).angular,
            };
            for (bsdf, [first, second, angular]) in bsdfs.iter().zip(&mut sums).take(number) {
                let weight = luminance(bsdf.eval(view, local) * radiance) / sample.pdf;
                *first += weight;
                *second += weight * weight;
                *angular += weight * at_eye;
            }
        }
        let judged = |[first, second, angular]: [f32; 3]| {
            let judged = Judgement::of(1, first / count as f32, variance(first, second, count as usize));
            Judgement { local: if first > 0.0 { angular / first } else { 0.0 }, ..judged }
        };
        let [a, b] = sums.map(judged);
        if parts.is_some() { larger(&a, &b) } else { a }
    }

    /// What a judgement means for a pixel. `floor` is the luminance below which errors are not relative.
    pub(super) fn predict(
        &self,
        point: &SurfacePoint,
        bend: &Bend,
        judged: &Judgement,
        floor: f32,
    ) -> Predicted {
        let lobe = &self.lobes[point.material as usize];
        let filtered = Way::of(point, lobe, self.light, self.settings).filtered;
        let exit = Self::exit(point, bend);
        let stretched = exit.magnification().abs() * exit.roundness(bend.curvature[1]);
        let total = judged.mean[0] + judged.mean[1];
        let share = if total > 0.0 { judged.mean[1] / total } else { 0.0 };
        let angular = (1.0 - share) * judged.limited * stretched + share * judged.local;
        let lit = angular * self.pixel_angle + bend.pictures[0];
        let bandwidth = (lit + bend.pictures[1]).min(UNLIMITED);
        let target = self.settings.target_error();
        let density = DENSITY * (DENSITY_ERROR / target).sqrt();
        let level = pixel::level(lit.min(UNLIMITED) * density, -2, COARSEST) as i8;
        let detail = pixel::level(bandwidth * density, -2, COARSEST) as i8;
        let error = target * total.max(floor);
        // Two lights share the error; each has half of its square.
        let parts = if judged.mean[0] > 0.0 && judged.mean[1] > 0.0 { 2.0 } else { 1.0 };
        let count = |kind: usize| {
            let number = parts * judged.variance[kind] / (error * error);
            let number = match kind {
                0 if filtered => STRATIFIED * number,
                0 => number,
                _ => number.powf(1.0 / LAMPS_FALL),
            };
            // Converting saturates, NaN becomes 0.
            let least = if filtered && kind == 0 { FEWEST_FILTERED } else { FEWEST };
            let whole = (number.ceil() as u32).clamp(least, MOST_SAMPLES as u32);
            whole.next_multiple_of(FEWEST) as u16
        };
        let samples = match lobe.directions {
            Directions::None => [0, 0],
            Directions::Single => [1, 0],
            Directions::Table(_) | Directions::Own => [
                if self.light.environment.is_some() { count(0) } else { 0 },
                if self.light.has_local() { count(1) } else { 0 },
            ],
        };
        let square = total.max(floor) * total.max(floor);
        let variance =
            if square > 0.0 { CAUTION * (judged.variance[0] + judged.variance[1]) / square } else { 0.0 };
        Predicted { bandwidth, variance, samples, level, detail }
    }
}

/// The bandwidth of light of one bandwidth after a lobe of another: both spectra multiply, and of Gaussians the product has
/// 1/√(1/a² + 1/b²). The seed's min(a, b) is up to √2 more.
#[inline]
fn passed(light: f32, lobe: f32) -> f32 {
    let (less, more) = (light.min(lobe), light.max(lobe));
    let ratio = if more > 0.0 { less / more } else { 0.0 };
    less / (1.0 + ratio * ratio).sqrt()
}

/// The variance of one of `count` values, from their sum and that of their squares.
fn variance(sum: f32, squares: f32, count: usize) -> f32 {
    let n = count as f32;
    let spread = (squares / n - (sum / n) * (sum / n)).max(0.0);
    // Of one value nothing is known but itself.
    if count > 1 { (spread * n / (n - 1.0)).min(f32::MAX) } else { squares.min(f32::MAX) }
}

/// The axes turned about the normal so that the view, given in them, lies in the plane of the first and the third.
#[inline]
pub(super) fn turned([x, y, z]: [Vec3; 3], view: Vec3) -> [Vec3; 3] {
    let across = (view.x * view.x + view.y * view.y).sqrt();
    if across < 1e-6 {
        return [x, y, z];
    }
    let (c, s) = (view.x / across, view.y / across);
    [c * x + s * y, c * y - s * x, z]
}

/// The predictions of a picture.
pub(super) struct Buffer {
    pub(super) pixels: Vec<Predicted>,
    /// Luminance below which errors are not relative.
    pub(super) floor: f32,
}

impl Buffer {
    pub(super) fn new(judge: &Judge, surfaces: &Surfaces) -> Self {
        let (width, height) = (surfaces.width, surfaces.height);
        let columns = (width - 1) / STRIDE + 2;
        let rows = (height - 1) / STRIDE + 2;
        let lattice: Vec<Judgement> = (0..columns * rows)
            .into_par_iter()
            .with_min_len(columns)
            .map(|i| {
                let pixel = [place(i % columns, width), place(i / columns, height)];
                if surfaces.at(pixel[0], pixel[1]).is_there() {
                    judge.judge(surfaces, pixel)
                } else {
                    Judgement::default()
                }
            })
            .collect();
        let floor = DARK * mean(&lattice);
        let lattice = widened(&lattice, surfaces, columns);
        let mut pixels = vec![Predicted::default(); width * height];
        pixels.par_chunks_mut(width * STRIDE).enumerate().for_each(|(line, band)| {
            for column in 0..columns - 1 {
                let cell = Cell::new(surfaces, &lattice, columns, [column, line]);
                for (dy, row) in band.chunks_mut(width).enumerate() {
                    let left = column * STRIDE;
                    for (dx, predicted) in
                        row[left.min(width)..(left + STRIDE).min(width)].iter_mut().enumerate()
                    {
                        let pixel = [left + dx, line * STRIDE + dy];
                        let point = surfaces.at(pixel[0], pixel[1]);
                        if point.is_there() {
                            let judged =
                                cell.of(point, pixel).unwrap_or_else(|| judge.judge(surfaces, pixel));
                            let lobe = &judge.lobes[point.material as usize];
                            let bend = curvature::measure(surfaces, lobe, pixel);
                            *predicted = judge.predict(point, &bend, &judged, floor);
                        }
                    }
                }
            }
        });
        Self { pixels, floor }
    }
}

/// The pixel of point `i` of the lattice of judgements, along a side of so many.
fn place(i: usize, side: usize) -> usize {
    (i * STRIDE).min(side - 1)
}

/// Four judgements, and the pixels between them.
struct Cell<'a> {
    corners: [(&'a SurfacePoint, &'a Judgement); 4],
    /// Where the first and the last of them are.
    places: [[usize; 2]; 2],
}

impl<'a> Cell<'a> {
    fn new(
        surfaces: &'a Surfaces,
        lattice: &'a [Judgement],
        columns: usize,
        [column, line]: [usize; 2],
    ) -> Self {
        let across = [place(column, surfaces.width), place(column + 1, surfaces.width)];
        let down = [place(line, surfaces.height), place(line + 1, surfaces.height)];
        let corner = |dx: usize, dy: usize| {
            (surfaces.at(across[dx], down[dy]), &lattice[(line + dy) * columns + column + dx])
        };
        let corners = [corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)];
        Self { corners, places: [[across[0], down[0]], [across[1], down[1]]] }
    }

    /// What those around a pixel tell that are of its own surface, by their nearness: without steps from pixel to pixel, as
    /// convolved light is looked up by the number of samples.
    #[inline]
    fn of(&self, point: &SurfacePoint, pixel: [usize; 2]) -> Option<Judgement> {
        let [first, last] = self.places;
        let share =
            |axis: usize| (pixel[axis] - first[axis]) as f32 / (last[axis] - first[axis]).max(1) as f32;
        let (x, y) = (share(0), share(1));
        let near = [(1.0 - x) * (1.0 - y), x * (1.0 - y), (1.0 - x) * y, x * y];
        let (mut sum, mut weights) = (Judgement::default(), 0.0);
        for ((corner, judged), near) in self.corners.iter().zip(near) {
            if corner.is_of(point) && corner.normal.dot(point.normal) > ALIKE {
                // Enough for one that stands alone.
                let weight = near + 1e-4;
                sum.add(judged, weight);
                weights += weight;
            }
        }
        (weights > 0.0).then(|| sum.over(weights))
    }
}

/// Each judgement with the largest variance of those around it that are of its own surface: sixteen directions may miss
/// what their neighbours' do not.
fn widened(lattice: &[Judgement], surfaces: &Surfaces, columns: usize) -> Vec<Judgement> {
    let rows = lattice.len() / columns;
    let at = |i: usize| surfaces.at(place(i % columns, surfaces.width), place(i / columns, surfaces.height));
    let widen = |i: usize| {
        let mut judged = lattice[i];
        if !at(i).is_there() {
            return judged;
        }
        let (x, y) = (i % columns, i / columns);
        for row in y.saturating_sub(1)..(y + 2).min(rows) {
            for column in x.saturating_sub(1)..(x + 2).min(columns) {
                let other = row * columns + column;
                if at(other).is_of(at(i)) {
                    let wider = larger(&judged, &lattice[other]);
                    judged = Judgement {
                        mean: wider.mean,
                        variance: wider.variance,
                        relative: wider.relative,
                        ..judged
                    };
                }
            }
        }
        judged
    };
    (0..lattice.len()).into_par_iter().with_min_len(columns).map(widen).collect()
}

/// The more demanding of two judgements.
fn larger(a: &Judgement, b: &Judgement) -> Judgement {
    let pick = |kind: usize| if a.relative[kind] > b.relative[kind] { a } else { b };
    let (first, second) = (pick(0), pick(1));
    Judgement {
        mean: [first.mean[0], second.mean[1]],
        variance: [first.variance[0], second.variance[1]],
        relative: [first.relative[0], second.relative[1]],
        limited: a.limited.max(b.limited),
        local: a.local.max(b.local),
    }
}

/// Mean luminance of what was judged.
fn mean(lattice: &[Judgement]) -> f32 {
    let lit = lattice.iter().map(|j| j.mean[0] + j.mean[1]).filter(|&m| m > 0.0 && m.is_finite());
    let (sum, count) = lit.fold((0.0f64, 0u32), |(sum, count), m| (sum + f64::from(m), count + 1));
    if count > 0 { (sum / f64::from(count)) as f32 } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_two_gaussian_spectra_less_passes_than_the_smaller_bandwidth() {
        // 95 % of the power of a Gaussian in one dimension lies within 1.96 standard deviations; found by summing the product.
        let measured = |a: f32, b: f32| {
            let power =
                |f: f32| (-0.5 * (f * f) * (1.96 / a).powi(2) - 0.5 * (f * f) * (1.96 / b).powi(2)).exp();
            let step = a.min(b) / 2000.0;
            let all: f32 = (0..20_000).map(|i| power((i as f32 + 0.5) * step)).sum();
            let mut inside = 0.0;
            let reach = (0..20_000).find(|&i| {
                inside += power((i as f32 + 0.5) * step);
                inside >= 0.95 * all
            });
            reach.map_or(0.0, |i| i as f32 * step)
        };
        for (a, b) in [(1.0f32, 1.0f32), (1.0, 2.0), (3.0, 1.0), (1.0, 30.0)] {
            let (found, told) = (measured(a, b), passed(a, b));
            assert!((found - told).abs() < 0.01 * told, "{a} {b}: {found} {told}");
            assert!(told < a.min(b));
        }
        // A mirror passes all.
        assert!((passed(2.0, UNLIMITED) - 2.0).abs() < 1e-5 && passed(0.0, 0.0) == 0.0);
    }
}
