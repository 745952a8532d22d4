//! A field against its mesh, ray by ray.

use std::sync::Arc;

use glam::Vec3;
use halflight_shape::TriangleMesh;
use halflight_trace::{MeshTracer, Ray, RayGeometry};
use rayon::prelude::*;

use super::points::{Cloud, CloudDistance, chamfer_e3, compare_clouds};
use crate::field::DirectedField;
use crate::random::Random;
use crate::train::lines::LineSampler;

/// Points of a mesh, uniform by area; none for a mesh without area.
#[must_use]
pub fn mesh_points(mesh: &TriangleMesh, count: usize, seed: u64) -> Vec<Vec3> {
    let Some(sampler) = LineSampler::new(Arc::new(mesh.clone()), 0.0) else { return Vec::new() };
    (0..count).map(|i| sampler.point(&mut Random::new(seed, 11, i as u64)).0).collect()
}

/// Lines of a batch that is cast in parallel.
const BATCH: usize = 4096;
/// Most lines that are cast for each point that is wanted, before a field counts as empty.
const MOST_LINES_PER_POINT: usize = 64;
/// Most hits of a line that are followed.
const MOST_HITS: usize = 64;
/// Of fields that are slow when asked ray by ray, the normal of each so-manieth ray is measured.
const SPARSE_NORMALS: usize = 16;

/// Points of the surface that a field describes, in the unit sphere, uniform by area.
///
/// Lines that are uniform over all lines through the sphere meet a surface in points that are uniform by area (Crofton).
/// Each is followed through all its hits, so that hidden parts count like others; nothing of the mesh is used. After a
/// hit the line goes on behind the surface by `skip`.
#[must_use]
pub fn field_points(field: &DirectedField, count: usize, seed: u64) -> Vec<Vec3> {
    field_points_while(field, count, seed, &|_| true).unwrap_or_default()
}

/// The same for fields that take long: `go_on` is told how much is done, 0 to 1, and says whether to go on; `None` if
/// it said no.
pub fn field_points_while(
    field: &DirectedField,
    count: usize,
    seed: u64,
    go_on: &dyn Fn(f32) -> bool,
) -> Option<Vec<Vec3>> {
    let unit = field.unit();
    let to_object = 1.0 / unit.scale;
    let cell = field.grain();
    // A line goes on a quarter of a cell behind a hit: what is thinner than that counts as one sheet.
    let skip = 0.25 * cell;
    let mut points = Vec::with_capacity(count);
    let mut batch = 0;
    // The few that a field of specks gives are not worth the wait.
    let most = |found: usize| if found == 0 { 64 * BATCH } else { count * MOST_LINES_PER_POINT };
    while points.len() < count && batch * BATCH < most(points.len()) {
        let lines: Vec<(Vec3, Vec3)> = (0..BATCH)
            .map(|index| uniform_line(&mut Random::new(seed, 12, (batch * BATCH + index) as u64)))
            .collect();
        let mut found: Vec<Vec<Vec3>> = vec![Vec::new(); BATCH];
        // The lines that go on, and from where.
        let mut going: Vec<(usize, f32)> = (0..BATCH).map(|index| (index, 0.0)).collect();
        for _ in 0..MOST_HITS {
            let asked: Vec<(Vec3, Vec3)> = going
                .iter()
                .map(|&(index, t)| {
                    let (origin, direction) = lines[index];
                    (unit.from_unit(origin + t * direction), direction * to_object)
                })
                .collect();
            if !go_on(points.len() as f32 / count as f32) {
                return None;
            }
            let said = field.query_many(&asked);
            let mut next = Vec::new();
            for (&(index, t), (hit, _)) in going.iter().zip(said) {
                let Some(hit) = hit else { continue };
                let (origin, direction) = lines[index];
                let at = t + hit.distance;
                found[index].push(origin + at * direction);
                next.push((index, at + skip));
            }
            going = next;
        }
        points.extend(found.into_iter().flatten());
        batch += 1;
    }
    points.truncate(count);
    Some(points)
}

/// Points of a field that are seen from outside, in the unit sphere: the first hits of uniform lines.
#[must_use]
pub fn seen_points(field: &DirectedField, count: usize, seed: u64) -> Vec<Vec3> {
    let unit = field.unit();
    first_hits(count, seed, |lines| {
        let asked: Vec<(Vec3, Vec3)> = lines
            .iter()
            .map(|&(origin, direction)| (unit.from_unit(origin), direction / unit.scale))
            .collect();
        field.query_many(&asked).into_iter().map(|(hit, _)| Some(hit?.distance)).collect()
    })
}

/// Points of a mesh, given in the unit sphere, that are seen from outside.
#[must_use]
pub fn mesh_seen_points(unit_mesh: &Arc<TriangleMesh>, count: usize, seed: u64) -> Vec<Vec3> {
    let tracer = MeshTracer::build(Arc::clone(unit_mesh));
    first_hits(count, seed, |lines| {
        let hit = |&(origin, direction): &(Vec3, Vec3)| Some(tracer.closest(&Ray::new(origin, direction))?.t);
        lines.par_iter().map(hit).collect()
    })
}

fn first_hits(count: usize, seed: u64, ask: impl Fn(&[(Vec3, Vec3)]) -> Vec<Option<f32>>) -> Vec<Vec3> {
    let mut points = Vec::with_capacity(count);
    let mut batch = 0;
    while points.len() < count && batch * BATCH < count * MOST_LINES_PER_POINT {
        let lines: Vec<(Vec3, Vec3)> = (0..BATCH)
            .map(|index| uniform_line(&mut Random::new(seed, 15, (batch * BATCH + index) as u64)))
            .collect();
        let hits = ask(&lines);
        points.extend(lines.iter().zip(hits).filter_map(|((o, d), t)| Some(*o + t? * *d)));
        batch += 1;
    }
    points.truncate(count);
    points
}

/// A line through the unit sphere, uniform by position and direction; its origin lies outside.
pub(crate) fn uniform_line(random: &mut Random) -> (Vec3, Vec3) {
    let direction = random.direction();
    let (u, v) = direction.any_orthonormal_pair();
    let (radius, angle) = (random.float().sqrt(), std::f32::consts::TAU * random.float());
    let aside = radius * (angle.cos() * u + angle.sin() * v);
    (aside * 1.01 - 1.5 * direction, direction)
}

/// Errors over a set of rays.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RayErrors {
    /// How many rays.
    pub rays: usize,
    /// How many of them hit both: what the errors of depth are of.
    pub hits: usize,
    /// How many normals were compared.
    pub normals: usize,
    /// Part of the rays for which hit or miss is right.
    pub visibility: f64,
    /// Part of the rays that hit the mesh but not the field.
    pub lost: f64,
    /// Part of the rays that hit the field but not the mesh.
    pub invented: f64,
    /// Mean of |predicted − true| distance where both hit, in units.
    pub depth_mean: f64,
    /// Median of the same.
    pub depth_median: f64,
    /// 95th percentile of the same.
    pub depth_p95: f64,
    /// 95th percentile of the same times |n · ω|.
    pub across_p95: f64,
    /// Mean angle between the normals where both hit and depths agree to a cell, in degrees.
    pub normal_mean_degrees: f64,
    /// Median of the same.
    pub normal_median_degrees: f64,
}

/// What is measured of a field.
#[derive(Clone, Copy, Debug)]
pub struct Evaluation {
    /// Clouds of the field (first) and of the mesh (second).
    pub clouds: CloudDistance,
    /// Chamfer distance × 10³ of two clouds of the mesh itself: what no field can be below.
    pub floor_e3: f64,
    /// Rays from outside, uniform over lines.
    pub primary: RayErrors,
    /// Rays that leave the mesh, cosine-distributed.
    pub secondary: RayErrors,
}

impl Evaluation {
    /// What a field file keeps.
    #[must_use]
    pub fn measured(&self) -> crate::field::MeasuredError {
        crate::field::MeasuredError {
            depth_mean: self.primary.depth_mean as f32,
            depth_p95: self.primary.depth_p95 as f32,
            across_p95: self.primary.across_p95 as f32,
            visibility: self.primary.visibility as f32,
            normal_mean_degrees: self.primary.normal_mean_degrees as f32,
            // Infinite where there is no surface, which a file cannot say.
            chamfer_e3: (self.clouds.chamfer_e3 as f32).min(crate::file::MOST_CHAMFER_E3),
        }
    }
}

/// Measures a field against its mesh, which is given in the unit sphere: clouds of `points`, and as many rays of each
/// kind.
#[must_use]
pub fn evaluate(
    field: &DirectedField,
    unit_mesh: &Arc<TriangleMesh>,
    points: usize,
    seed: u64,
) -> Evaluation {
    evaluate_while(field, unit_mesh, points, seed, &|_| true).unwrap_or_else(Evaluation::nothing)
}

/// The same for fields that take long: `go_on` is told how much is done, 0 to 1, and says whether to go on; `None` if
/// it said no.
pub fn evaluate_while(
    field: &DirectedField,
    unit_mesh: &Arc<TriangleMesh>,
    points: usize,
    seed: u64,
    go_on: &dyn Fn(f32) -> bool,
) -> Option<Evaluation> {
    let of_mesh = Cloud::new(mesh_points(unit_mesh, points, seed));
    let other = Cloud::new(mesh_points(unit_mesh, points, seed ^ 0x5555));
    let of_field = Cloud::new(field_points_while(field, points, seed, &|part| go_on(part / 3.0))?);
    let tracer = MeshTracer::build(Arc::clone(unit_mesh));
    let lines: Vec<(Vec3, Vec3)> = (0..points)
        .into_par_iter()
        .map(|index| uniform_line(&mut Random::new(seed, 13, index as u64)))
        .collect();
    let primary = ray_errors(field, &tracer, &lines, &|part| go_on((1.0 + part) / 3.0))?;
    let sampler = LineSampler::new(Arc::clone(unit_mesh), 0.0);
    let leaving: Vec<(Vec3, Vec3)> = match &sampler {
        Some(sampler) => (0..points)
            .map(|index| {
                let mut random = Random::new(seed, 14, index as u64);
                let (point, normal) = sampler.point(&mut random);
                let side = if random.bits() & 1 == 0 { normal } else { -normal };
                // Cosine-distributed: the normal plus a uniform direction.
                let direction = (side + random.direction()).normalize_or(side);
                // As a path tracer starts them: off the surface by the measured error.
                let off = (primary.across_p95 as f32).max(1e-4);
                (point + side * off, direction)
            })
            .collect(),
        None => Vec::new(),
    };
    Some(Evaluation {
        clouds: compare_clouds(&of_field, &of_mesh),
        floor_e3: chamfer_e3(&other, &of_mesh),
        primary,
        secondary: ray_errors(field, &tracer, &leaving, &|part| go_on((2.0 + part) / 3.0))?,
    })
}

impl Evaluation {
    /// Of no rays at all.
    fn nothing() -> Evaluation {
        let clouds = compare_clouds(&Cloud::new(Vec::new()), &Cloud::new(Vec::new()));
        let none = RayErrors::default();
        Evaluation { clouds, floor_e3: f64::INFINITY, primary: none, secondary: none }
    }
}

/// Rays that are asked between two looks at whether to go on.
const ASKED_AT_ONCE: usize = 2048;

fn ray_errors(
    field: &DirectedField,
    tracer: &MeshTracer,
    rays: &[(Vec3, Vec3)],
    go_on: &dyn Fn(f32) -> bool,
) -> Option<RayErrors> {
    let unit = field.unit();
    let cell = field.grain();
    let sparse = if field.prefers_many() { SPARSE_NORMALS } else { 1 };
    let asked: Vec<(Vec3, Vec3)> =
        rays.iter().map(|&(origin, direction)| (unit.from_unit(origin), direction / unit.scale)).collect();
    let mut answers = Vec::with_capacity(asked.len());
    for some in asked.chunks(ASKED_AT_ONCE) {
        if !go_on(answers.len() as f32 / asked.len() as f32) {
            return None;
        }
        answers.extend(field.query_many(some));
    }
    /// One ray: (true, predicted) distance, |n · ω|, angle of the normals.
    type One = (Option<f32>, Option<f32>, f32, Option<f32>);
    let one = |index: usize| -> One {
        let (origin, direction) = rays[index];
        let truth = tracer.closest(&Ray::new(origin, direction));
        let (x, omega) = asked[index];
        let said = answers[index].0;
        let (mut cosine, mut angle) = (0.0, None);
        if let Some(hit) = &truth {
            let [a, b, c] = tracer.mesh().corners(hit.primitive as usize);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
            cosine = normal.dot(direction).abs();
            if let Some(said) = said
                && index.is_multiple_of(sparse)
                && (said.distance - hit.t).abs() < cell
            {
                let found = field.normal(x, omega, &said);
                angle = Some(found.dot(normal).clamp(-1.0, 1.0).acos().to_degrees());
            }
        }
        (truth.map(|hit| hit.t), said.map(|said| said.distance), cosine, angle)
    };
    let all: Vec<One> = (0..rays.len()).into_par_iter().map(one).collect();
    let count = all.len().max(1) as f64;
    let part = |test: &dyn Fn(&One) -> bool| all.iter().filter(|o| test(o)).count() as f64 / count;
    let sorted = |mut values: Vec<f32>| {
        values.sort_by(f32::total_cmp);
        values
    };
    let both = |o: &One| Some(((o.0? - o.1?).abs(), o.2));
    let depths = sorted(all.iter().filter_map(both).map(|(error, _)| error).collect());
    let across = sorted(all.iter().filter_map(both).map(|(error, cosine)| error * cosine).collect());
    let angles = sorted(all.iter().filter_map(|o| o.3).collect());
    Some(RayErrors {
        rays: all.len(),
        hits: depths.len(),
        normals: angles.len(),
        visibility: part(&|o| o.0.is_some() == o.1.is_some()),
        lost: part(&|o| o.0.is_some() && o.1.is_none()),
        invented: part(&|o| o.0.is_none() && o.1.is_some()),
        depth_mean: mean(&depths),
        depth_median: quantile(&depths, 0.5),
        depth_p95: quantile(&depths, 0.95),
        across_p95: quantile(&across, 0.95),
        normal_mean_degrees: mean(&angles),
        normal_median_degrees: quantile(&angles, 0.5),
    })
}

fn mean(values: &[f32]) -> f64 {
    // From 0 on: a sum of nothing is −0.
    values.iter().fold(0.0, |sum, &v| sum + f64::from(v)) / values.len().max(1) as f64
}

fn quantile(sorted: &[f32], part: f64) -> f64 {
    let last = sorted.len().saturating_sub(1) as f64;
    sorted.get((part * last).round() as usize).map_or(0.0, |&v| f64::from(v))
}
