//! What the fast field learns from: parts of lines near the surface, cast against the mesh as they are needed.
//!
//! A point is drawn uniformly by area, half of the time moved by up to a cell in any direction, past rims too; through it a line in a
//! uniform direction. Its free stretch, between the surface behind and the surface ahead (or as far as is looked), gives
//! samples in both directions: the cell of the point, the cells of the two hits, and one more that it passes. Each starts
//! where a ray from outside would enter the cell or anywhere before the hit: the marched copies of one ray, whose
//! distances differ by exactly the march, which is what makes the field agree with itself.

use std::ops::ControlFlow;
use std::sync::Arc;

use glam::Vec3;
use halflight_shape::TriangleMesh;
use halflight_trace::{MeshTracer, Ray, RayGeometry};

use crate::fast::encode::{Move, Part, face_axes};
use crate::fast::network::{LocalSample, Slope};
use crate::grid::{Cells, Chord};
use crate::random::Random;

/// How far along a line is looked, in cells: further cells are sampled from points of their own.
const HORIZON: f32 = 6.0;
/// Rays that start on the surface start this far off it, in cells: about the rounding of coordinates in grid space.
const LIFT: f32 = 2e-4;
/// Most cells that a line of twice the horizon can pass.
const MOST_CHORDS: usize = 64;

/// Draws lines of a mesh in grid space.
#[derive(Debug)]
pub(crate) struct LineSampler {
    mesh: Arc<TriangleMesh>,
    tracer: MeshTracer,
    /// Area of all triangles up to each, over the whole.
    areas: Vec<f64>,
    /// The triangle at each of equal steps of area, where the search begins.
    guide: Vec<u32>,
    margin: f32,
}

/// The free stretch of a line about its point.
pub(super) struct Free {
    pub(super) from: f32,
    pub(super) to: f32,
    /// Normals at the two ends, where they are hits; zero where they are not known.
    pub(super) from_hit: Option<Vec3>,
    pub(super) to_hit: Option<Vec3>,
}

#[inline(always)]
fn corners(mesh: &TriangleMesh, index: usize) -> [Vec3; 3] {
    mesh.triangles[index].map(|vertex| mesh.positions[vertex as usize])
}

impl LineSampler {
    /// `None` for a mesh without area.
    pub(crate) fn new(mesh: Arc<TriangleMesh>, margin: f32) -> Option<LineSampler> {
        let mut sum = 0.0;
        let mut areas: Vec<f64> = (0..mesh.triangles.len())
            .map(|index| {
                let [a, b, c] = mesh.corners(index).map(Vec3::as_dvec3);
                sum += 0.5 * (b - a).cross(c - a).length();
                sum
            })
            .collect();
        if !(sum > 0.0 && sum.is_finite()) {
            return None;
        }
        areas.iter_mut().for_each(|area| *area /= sum);
        let steps = areas.len();
        let mut index = 0;
        let guide = (0..steps)
            .map(|step| {
                while index + 1 < areas.len() && areas[index] <= step as f64 / steps as f64 {
                    index += 1;
                }
                index as u32
            })
            .collect();
        let tracer = MeshTracer::build(Arc::clone(&mesh));
        Some(LineSampler { mesh, tracer, areas, guide, margin })
    }

    /// A point of the surface, uniform by area, and the normal of its triangle.
    pub(crate) fn point(&self, random: &mut Random) -> (Vec3, Vec3) {
        loop {
            let at = random.double();
            let step = (at * self.guide.len() as f64) as usize;
            let mut index = self.guide[step.min(self.guide.len() - 1)] as usize;
            while index + 1 < self.areas.len() && self.areas[index] <= at {
                index += 1;
            }
            let [a, b, c] = corners(&self.mesh, index);
            let (u, v) = random.barycentric();
            let normal = (b - a).cross(c - a).normalize_or_zero();
            if normal != Vec3::ZERO {
                return (a + u * (b - a) + v * (c - a), normal);
            }
        }
    }

    fn cast(&self, origin: Vec3, direction: Vec3) -> (f32, Option<Vec3>) {
        let ray = Ray { origin, direction, t_max: HORIZON, time: 0.0 };
        match self.tracer.closest(&ray) {
            Some(hit) => {
                let [a, b, c] = corners(&self.mesh, hit.primitive as usize);
                (hit.t, Some((b - a).cross(c - a).normalize_or_zero()))
            }
            None => (HORIZON, None),
        }
    }

    /// Adds the samples of one line.
    pub(crate) fn draw(&self, cells: &Cells, random: &mut Random, to: &mut Vec<LocalSample>) {
        let (point, normal) = self.point(random);
        let direction = random.direction();
        let cosine = normal.dot(direction);
        let (origin, free) = if random.float() < 0.5 {
            let origin = point + normal * LIFT.copysign(cosine);
            let (t, hit) = self.cast(origin, direction);
            (origin, Free { from: 0.0, to: t, from_hit: Some(normal), to_hit: hit })
        } else {
            // Near the surface, as many within each tenth of a cell's logarithm.
            let away = (random.float() * 100f32.ln()).exp() * 0.01;
            let origin = point + away * random.direction();
            let (ahead, ahead_hit) = self.cast(origin, direction);
            let (behind, behind_hit) = self.cast(origin, -direction);
            (origin, Free { from: -behind, to: ahead, from_hit: behind_hit, to_hit: ahead_hit })
        };
        let mut chords = [Chord { cell: glam::UVec3::ZERO, enter: 0.0, leave: 0.0 }; MOST_CHORDS];
        let mut count = 0;
        // Two cells beyond the ends: the parts of the last cells that lie behind the surface.
        let back = free.from - 2.0;
        let _: Option<()> =
            cells.walk(origin + direction * back, direction, 0.0, free.to + 2.0 - back, |chord| {
                chords[count] =
                    Chord { cell: chord.cell, enter: chord.enter + back, leave: chord.leave + back };
                count += 1;
                if count == MOST_CHORDS { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            });
        let chords = &chords[..count];
        let holds = |chord: &&Chord, t: f32| chord.enter <= t && t <= chord.leave;
        // A hit near the border of two cells is seen by both: either learns it.
        let margin = self.margin;
        let sees = |chord: &&Chord, t: f32| chord.enter - margin <= t && t <= chord.leave + margin;
        let backward = random.bits() & 1 == 0;
        let seeing = |t: f32| {
            if backward {
                chords.iter().rev().find(|chord| sees(chord, t))
            } else {
                chords.iter().find(|chord| sees(chord, t))
            }
        };
        let line = Line { origin, direction, free: &free, margin: self.margin };
        if let Some(chord) = chords.iter().find(|chord| holds(chord, 0.0)) {
            line.add(chord, random.bits() & 1 == 0, random, to);
        }
        if free.to_hit.is_some()
            && let Some(chord) = seeing(free.to)
        {
            line.add(chord, true, random, to);
        }
        if free.from_hit.is_some()
            && let Some(chord) = seeing(free.from)
        {
            line.add(chord, false, random, to);
        }
        if !chords.is_empty() {
            let chord = &chords[random.below(chords.len())];
            line.add(chord, random.bits() & 1 == 0, random, to);
        }
    }
}

pub(super) struct Line<'a> {
    pub(super) origin: Vec3,
    pub(super) direction: Vec3,
    pub(super) free: &'a Free,
    pub(super) margin: f32,
}

impl Line<'_> {
    /// Adds two samples of a cell, seen along the line or against it; nothing where the line is not free.
    pub(super) fn add(&self, chord: &Chord, along: bool, random: &mut Random, to: &mut Vec<LocalSample>) {
        let free = self.free;
        // Everything as seen by a ray that goes up: t → −t against the line.
        let (enter, leave, from, until, from_hit, to_hit, sign) = if along {
            (chord.enter, chord.leave, free.from, free.to, free.from_hit, free.to_hit, 1.0)
        } else {
            (-chord.leave, -chord.enter, -free.to, -free.from, free.to_hit, free.from_hit, -1.0)
        };
        let end = leave + self.margin;
        // A ray that leaves a surface starts off it, by a random part of a cell along the normal.
        let least = match from_hit {
            Some(normal) => {
                let cosine = cosine(normal, self.direction);
                from + 0.01 * (random.float() * 30f32.ln()).exp() / cosine.max(0.05)
            }
            None => from,
        };
        let first = (enter - self.margin).max(least);
        let last = until.min(leave);
        // Free only as far as was looked.
        if first >= last || (to_hit.is_none() && until < end) {
            return;
        }
        let hit = to_hit.filter(|_| until <= end);
        let direction = self.direction * sign;
        // As a ray that comes from elsewhere, and a marched copy of it.
        for start in [first, first + random.float() * (last - first)] {
            let part = Part {
                cell: chord.cell,
                start: self.origin + direction * start,
                direction,
                length: end - start,
            };
            to.push(match hit {
                // An error along the ray is one of |n · ω| across the surface.
                Some(normal) => LocalSample {
                    part,
                    hit: until - start,
                    weight: cosine(normal, direction).max(0.1),
                    slope: slope(&part, normal, start == enter - self.margin, random),
                    side: side(normal, direction),
                },
                None => LocalSample { part, hit: -1.0, weight: 0.0, slope: Slope::default(), side: 0.0 },
            });
        }
    }
}

/// |n · ω|, or its mean over directions where the normal is not known.
fn cosine(normal: Vec3, direction: Vec3) -> f32 {
    if normal == Vec3::ZERO { 0.5 } else { normal.dot(direction).abs() }
}

/// Whether a direction meets the front (1) or the back (−1) of a surface, 0 where its normal is not known.
fn side(normal: Vec3, direction: Vec3) -> f32 {
    if normal == Vec3::ZERO { 0.0 } else { 1f32.copysign(-normal.dot(direction)) }
}

/// Hits that graze the surface more than this have slopes without bound.
const LEAST_COSINE: f32 = 0.05;

/// How the distance changes as a part is moved across its ray, with its start kept on the face by which it entered if
/// it lies there, as a query's does. Moves are scaled so that start and end move by 1 together.
fn slope(part: &Part, normal: Vec3, starts_on_face: bool, random: &mut Random) -> Slope {
    let d = part.direction;
    let facing = normal.dot(d);
    if facing.abs() < LEAST_COSINE {
        return Slope::default();
    }
    let (u, v) = d.any_orthonormal_pair();
    let (sin, cos) = (std::f32::consts::TAU * random.float()).sin_cos();
    let mut start = cos * u + sin * v;
    let (enter, leave) = face_axes(part);
    if starts_on_face && d[enter].abs() > 1e-3 {
        start -= d * (start[enter] / d[enter]);
    }
    let length = if d[leave].abs() > 1e-3 { -start[leave] / d[leave] } else { 0.0 };
    let scale = (start.length_squared() + length * length).sqrt().recip();
    let (start, length) = (start * scale, length * scale);
    Slope { by: Move { start, length }, change: -normal.dot(start) / facing, weight: facing.abs() }
}
