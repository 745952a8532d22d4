//! Light that is given back: T⁽ᵇ⁾_i(p) = ∫ (1 − V) max(n·ω, 0) ρ(q)/π T⁽ᵇ⁻¹⁾_i(q) dω, q what is met in direction ω.
//!
//! The sum over b of these is the transfer of light that was scattered up to b times on its way. What gives light back is
//! taken for diffuse, of an albedo interpolated between vertices. Cost: as casting, once more for each bounce.

use glam::Vec3;
use halflight_scene::Frame;
use halflight_trace::{Hit, Ray};
use rayon::prelude::*;

use super::cast::{GROUP, subtract};
use super::directions::Directions;
use super::receivers::{Point, Receivers};
use super::transfer::{NO_MATRIX, Transfer};
use crate::technique::Progress;

/// Red, green and blue.
const COLORS: usize = 3;

/// What light is thrown between.
pub(super) struct Surroundings<'a> {
    pub(super) frame: &'a Frame,
    pub(super) receivers: &'a Receivers,
    pub(super) points: &'a [Point],
    pub(super) directions: &'a Directions,
}

/// What a group of points gets from others.
struct Gathered {
    diffuse: Vec<f32>,
    glossy: Vec<f32>,
    rays: u64,
}

/// Adds so many bounces; `None` if told to stop.
pub(super) fn add_bounces(
    transfer: &mut Transfer,
    scene: &Surroundings,
    bounces: u32,
    progress: &dyn Progress,
) -> Option<()> {
    let n = transfer.n;
    let in_colors = |all: &[f32], each: usize| -> Vec<f32> {
        all.chunks_exact(each).flat_map(|one| [one; COLORS].concat()).collect()
    };
    transfer.diffuse = in_colors(&transfer.diffuse, n);
    transfer.glossy = in_colors(&transfer.glossy, n * n);
    transfer.channels = COLORS;
    let mut last = transfer.diffuse.clone();
    for bounce in 0..bounces {
        // What each vertex gives back of what it got last.
        for (vertex, point) in last.chunks_exact_mut(COLORS * n).zip(scene.points) {
            for (color, albedo) in vertex.chunks_exact_mut(n).zip(point.albedo.to_array()) {
                color.iter_mut().for_each(|t| *t *= albedo * std::f32::consts::FRAC_1_PI);
            }
        }
        let (given_back, known) = (&last, &*transfer);
        let groups: Vec<Option<Gathered>> = scene
            .points
            .par_chunks(GROUP)
            .enumerate()
            .map(|(number, group)| {
                progress.report("bounces", u64::from(bounce), u64::from(bounces));
                let first = number * GROUP;
                let with_matrix: Vec<bool> =
                    (first..first + group.len()).map(|v| known.matrix_of[v] != NO_MATRIX).collect();
                (!progress.stop()).then(|| gather(scene, group, &with_matrix, given_back, known))
            })
            .collect();
        let mut next = Vec::with_capacity(last.len());
        let mut at = 0;
        for group in groups {
            let group = group?;
            next.extend(group.diffuse);
            transfer.rays += group.rays;
            for more in group.glossy {
                transfer.glossy[at] += more;
                at += 1;
            }
        }
        last = next;
        transfer.diffuse.iter_mut().zip(&last).for_each(|(sum, more)| *sum += more);
    }
    Some(())
}

fn gather(
    scene: &Surroundings,
    points: &[Point],
    with_matrix: &[bool],
    given_back: &[f32],
    known: &Transfer,
) -> Gathered {
    let n = known.n;
    let glossy = with_matrix.iter().filter(|&&with| with).count();
    let mut gathered = Gathered {
        diffuse: vec![0.0; points.len() * COLORS * n],
        glossy: vec![0.0; glossy * COLORS * n * n],
        rays: 0,
    };
    let mut rays = [Ray::new(Vec3::ZERO, Vec3::Y); GROUP];
    let mut looking = [(0usize, 0.0f32); GROUP];
    let mut hits: [Option<Hit>; GROUP] = [None; GROUP];
    let mut arriving = vec![0.0; COLORS * n];
    for (d, &direction) in scene.directions.vectors.iter().enumerate() {
        let harmonics = scene.directions.harmonics(d);
        let mut count = 0;
        for (i, point) in points.iter().enumerate() {
            let cosine = direction.dot(point.surface.shading_normal);
            if cosine > 0.0 && direction.dot(point.surface.geometric_normal) > 0.0 {
                rays[count] = point.surface.spawn(direction, 0.0);
                looking[count] = (i, cosine * scene.directions.weight);
                count += 1;
            }
        }
        scene.frame.world.closest_packet(&rays[..count], &mut hits[..count]);
        gathered.rays += count as u64;
        for ((&(i, weight), hit), ray) in looking[..count].iter().zip(&hits).zip(&rays) {
            let Some(hit) = hit else { continue };
            let position = ray.at(hit.t);
            let Some((root, weights)) = scene.receivers.locate(scene.frame, hit, position, -direction) else {
                continue;
            };
            let (corners, weights) = known.locate(root, weights);
            arriving.fill(0.0);
            for (corner, share) in corners.into_iter().zip(weights) {
                let start = corner as usize * COLORS * n;
                subtract(&mut arriving, &given_back[start..start + COLORS * n], -share);
            }
            subtract(&mut gathered.diffuse[i * COLORS * n..(i + 1) * COLORS * n], &arriving, -weight);
            if with_matrix[i] {
                let before = with_matrix[..i].iter().filter(|&&with| with).count();
                let matrix = &mut gathered.glossy[before * COLORS * n * n..(before + 1) * COLORS * n * n];
                for (row, &light) in matrix.chunks_exact_mut(n).zip(&arriving) {
                    subtract(row, harmonics, -weight * light);
                }
            }
        }
    }
    gathered
}
