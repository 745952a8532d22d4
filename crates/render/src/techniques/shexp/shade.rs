//! From light with visibility to radiance, and from the points where it is known to the pixels between.
//!
//! Diffuse: (ρ/π) ∫ L·V·max(n·ω, 0); Phong: ρ_s (n + 2)/(n + 1) ∫ L·V·lobe(r)·max(n·ω, 0), the lobe of integral 1 about the
//! mirror direction r and the cosine joined by a product. Both are dot products with the light that arrives, of which the
//! harmonics are interpolated between points of a lattice of pixels, weighed by how much a pixel's surface is
//! like the point's. A pixel is worked out by itself where no point is like it, or where what the points say of the
//! irradiance on its own normal differs by more than the tolerance: at contacts and at the edges of things.

use glam::Vec3;
use halflight_scene::Frame;
use halflight_sh::{Sh, Zh};
use rayon::prelude::*;

use super::settings::ShexpSettings;
use super::solve::{Receiver, Scratch, Solver};
use crate::gbuffer::{GBuffer, Visible, VisiblePoint};
use crate::sh_light::{Colors, axes};

/// Lattice points, or pixels, along the side of a group that is solved together.
const GROUP: usize = 8;

/// Light with visibility at every `stride`th pixel of every `stride`th row, the last ones included.
pub(super) struct Lattice<const ORDER: usize> {
    stride: usize,
    columns: usize,
    /// Point by point; `None` where nothing is seen.
    light: Vec<Option<Colors<ORDER>>>,
    /// By how much the irradiances that surround a pixel may differ.
    tolerance: f32,
    kernels: Kernels<ORDER>,
}

impl<const ORDER: usize> Lattice<ORDER> {
    /// Works out the light at the points of the lattice.
    pub(super) fn solve(solver: &Solver<ORDER>, view: &GBuffer, settings: &ShexpSettings) -> Self {
        let stride = settings.stride.max(1) as usize;
        let columns = (view.width - 1).div_ceil(stride) + 1;
        let rows = (view.height - 1).div_ceil(stride) + 1;
        let mut light = vec![None; columns * rows];
        light.par_chunks_mut(columns * GROUP).enumerate().for_each_init(
            Room::default,
            |room, (band, light)| {
                let lines = light.len() / columns;
                for left in (0..columns).step_by(GROUP) {
                    let wide = GROUP.min(columns - left);
                    room.start();
                    for i in 0..wide * lines {
                        let (column, line) = (left + i % wide, i / wide);
                        let x = (column * stride).min(view.width - 1);
                        let y = ((band * GROUP + line) * stride).min(view.height - 1);
                        if let Visible::Point(point) = &view.pixels[y * view.width + x] {
                            room.push(solver, point, (column, line));
                        }
                    }
                    room.finish(solver, |(column, line), _, colors| {
                        light[line * columns + column] = Some(*colors)
                    });
                }
            },
        );
        let tolerance = settings.tolerance * unshadowed(solver.light);
        Self { stride, columns, light, tolerance, kernels: Kernels::new() }
    }

    /// The radiance of every pixel.
    pub(super) fn shade(&self, solver: &Solver<ORDER>, view: &GBuffer, frame: &Frame) -> Vec<Vec3> {
        let (width, height) = (view.width, view.height);
        let mut picture = vec![Vec3::ZERO; width * height];
        picture.par_chunks_mut(width * GROUP).enumerate().for_each_init(
            Room::default,
            |room, (band, rows)| {
                let top = band * GROUP;
                for left in (0..width).step_by(GROUP) {
                    room.start();
                    for y in top..(top + GROUP).min(height) {
                        for x in left..(left + GROUP).min(width) {
                            let radiance = match &view.pixels[y * width + x] {
                                Visible::Nothing(direction) => frame.lights.escaped(*direction),
                                Visible::Point(point) => match self.between(view, [x, y], point) {
                                    Some(radiance) => radiance,
                                    None => {
                                        room.push(solver, point, (x, y));
                                        continue;
                                    }
                                },
                            };
                            rows[(y - top) * width + x] = radiance;
                        }
                    }
                    room.finish(solver, |(x, y), point, light| {
                        rows[(y - top) * width + x] = self.kernels.reflected(point, &[(1.0, light)]);
                    });
                }
            },
        );
        picture
    }

    /// Radiance of a pixel from the four lattice points around it; `None` where they do not tell.
    fn between(&self, view: &GBuffer, [x, y]: [usize; 2], point: &VisiblePoint) -> Option<Vec3> {
        let (column, line) = (x / self.stride, y / self.stride);
        let fraction = [x % self.stride, y % self.stride].map(|r| r as f32 / self.stride as f32);
        let first = line * self.columns + column;
        if fraction == [0.0; 2] {
            return Some(self.kernels.reflected(point, &[(1.0, self.light[first].as_ref()?)]));
        }
        let mut corners = [(0.0, self.light[first].as_ref()?); 4];
        let mut count = 0;
        for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let share = (if dx == 1 { fraction[0] } else { 1.0 - fraction[0] })
                * if dy == 1 { fraction[1] } else { 1.0 - fraction[1] };
            if share == 0.0 {
                continue;
            }
            let light = self.light.get(first + dy * self.columns + dx)?.as_ref()?;
            let at = ((column + dx) * self.stride).min(view.width - 1);
            let row = ((line + dy) * self.stride).min(view.height - 1);
            let Visible::Point(other) = &view.pixels[row * view.width + at] else { return None };
            if !alike(point, other) {
                return None;
            }
            corners[count] = (share, light);
            count += 1;
        }
        self.kernels.if_smooth(point, &corners[..count], self.tolerance)
    }
}

/// Irradiance without any blockers, averaged over normals and colours.
fn unshadowed<const ORDER: usize>(light: &Colors<ORDER>) -> f32 {
    // The mean of a function is its first coefficient times y_00; a normal sees π times the mean radiance.
    let mean = light.iter().map(|l| l[0]).sum::<f32>() / 3.0 * 0.282_094_8;
    (mean * std::f32::consts::PI).max(f32::MIN_POSITIVE)
}

/// What light is integrated with.
struct Kernels<const ORDER: usize> {
    cosine: Zh<ORDER>,
}

impl<const ORDER: usize> Kernels<ORDER> {
    fn new() -> Self {
        Self { cosine: Zh::clamped_cosine() }
    }

    /// Radiance towards the eye of a mixture of lights, given with their shares.
    fn reflected(&self, point: &VisiblePoint, lights: &[(f32, &Colors<ORDER>)]) -> Vec3 {
        let cosine = self.cosine.to_direction(axes(point.normal));
        let irradiances = lights.iter().map(|(share, light)| *share * integral(light, &cosine));
        self.of_irradiance(point, &cosine, irradiances.sum(), lights)
    }

    /// The same, unless the irradiances under the lights differ by more than `tolerance`.
    fn if_smooth(
        &self,
        point: &VisiblePoint,
        lights: &[(f32, &Colors<ORDER>)],
        tolerance: f32,
    ) -> Option<Vec3> {
        let cosine = self.cosine.to_direction(axes(point.normal));
        let (mut least, mut most) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let mut irradiance = Vec3::ZERO;
        for (share, light) in lights {
            let here = integral(light, &cosine);
            (least, most) = (least.min(here), most.max(here));
            irradiance += *share * here;
        }
        let smooth = (most - least).element_sum() <= 3.0 * tolerance;
        smooth.then(|| self.of_irradiance(point, &cosine, irradiance, lights))
    }

    fn of_irradiance(
        &self,
        point: &VisiblePoint,
        cosine: &Sh<ORDER>,
        irradiance: Vec3,
        lights: &[(f32, &Colors<ORDER>)],
    ) -> Vec3 {
        let material = &point.material;
        let mut radiance =
            point.emitted + material.diffuse * std::f32::consts::FRAC_1_PI * irradiance.max(Vec3::ZERO);
        if material.specular != Vec3::ZERO {
            let mirrored = 2.0 * point.normal.dot(point.towards_eye) * point.normal - point.towards_eye;
            let n = material.exponent;
            let lobe = Zh::<ORDER>::phong(f64::from(n)).to_direction(axes(mirrored)).product(cosine);
            let gathered: Vec3 = lights.iter().map(|(share, light)| *share * integral(light, &lobe)).sum();
            radiance += material.specular * ((n + 2.0) / (n + 1.0)) * gathered.max(Vec3::ZERO);
        }
        radiance
    }
}

/// ∫ L·V times a kernel, for the three colours.
#[inline]
fn integral<const ORDER: usize>(light: &Colors<ORDER>, kernel: &Sh<ORDER>) -> Vec3 {
    Vec3::new(light[0].dot(kernel), light[1].dot(kernel), light[2].dot(kernel))
}

/// Whether light at one point may stand for light at another: on the same body, and nearly in its tangent plane.
fn alike(a: &VisiblePoint, b: &VisiblePoint) -> bool {
    /// Distance from the plane, in parts of the distance between the points.
    const OFF_PLANE: f32 = 0.35;
    /// Cosine between the normals.
    const TURNED: f32 = 0.8;
    let between = b.position - a.position;
    let off = between.dot(a.geometric_normal).abs();
    a.hit.instance == b.hit.instance
        && a.geometric_normal.dot(b.geometric_normal) > TURNED
        && off * off <= OFF_PLANE * OFF_PLANE * between.length_squared()
}

/// A group of points that is being solved, with room to do it.
struct Room<const ORDER: usize> {
    receivers: Vec<Receiver>,
    places: Vec<(usize, usize)>,
    points: Vec<VisiblePoint>,
    scratch: Scratch<ORDER>,
    light: Vec<Colors<ORDER>>,
}

impl<const ORDER: usize> Default for Room<ORDER> {
    fn default() -> Self {
        Self {
            receivers: Vec::new(),
            places: Vec::new(),
            points: Vec::new(),
            scratch: Scratch::default(),
            light: Vec::new(),
        }
    }
}

impl<const ORDER: usize> Room<ORDER> {
    fn start(&mut self) {
        self.receivers.clear();
        self.places.clear();
        self.points.clear();
    }

    fn push(&mut self, solver: &Solver<ORDER>, point: &VisiblePoint, place: (usize, usize)) {
        self.receivers.push(Receiver {
            position: point.position,
            normal: point.geometric_normal,
            owner: solver.blockers.owner(&point.hit),
            instance: point.hit.instance,
        });
        self.places.push(place);
        self.points.push(*point);
    }

    fn finish(
        &mut self,
        solver: &Solver<ORDER>,
        mut take: impl FnMut((usize, usize), &VisiblePoint, &Colors<ORDER>),
    ) {
        solver.solve(&self.receivers, &mut self.scratch, &mut self.light);
        for ((place, point), light) in self.places.iter().zip(&self.points).zip(&self.light) {
            take(*place, point, light);
        }
    }
}
