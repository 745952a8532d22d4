//! Transfer at points, by rays.
//!
//! Diffuse: T_i = ∫ y_i V max(n·ω, 0) dω, so that the irradiance of any light of the order is L·T. It is what it would be
//! without shadows, in closed form, less the sum over the directions that are blocked: where nothing is in the way it is
//! exact. Glossy: M_ij = ∫ y_i y_j V max(n·ω, 0) dω, so that L M are the harmonics of the light that arrives, weighed by
//! the cosine, of which every lobe about a mirror direction is a dot product. Source: Sloan, Kautz & Snyder 2002 (seed
//! \[004\]); the matrix, in place of a product with the visibility, because that product loses the bands of visibility
//! above the order.
//!
//! Cost: a shadow ray for each direction above each point, 64 neighbours together.

use std::sync::atomic::{AtomicU64, Ordering};

use glam::Vec3;
use halflight_trace::{Ray, World};
use rayon::prelude::*;

use super::directions::{Cosine, Directions};
use super::receivers::Point;
use crate::technique::Progress;

/// Points that look together.
pub(super) const GROUP: usize = 64;

/// What points see.
#[derive(Clone, Debug, Default)]
pub(super) struct Seen {
    /// `n` coefficients for each point.
    pub(super) transfer: Vec<f32>,
    /// The share of the cosine's integral that is not blocked, for each point.
    pub(super) visible: Vec<f32>,
    /// `n`² coefficients for each glossy point, light first.
    pub(super) matrices: Vec<f32>,
    pub(super) rays: u64,
}

impl Seen {
    pub(super) fn append(&mut self, mut other: Seen) {
        self.transfer.append(&mut other.transfer);
        self.visible.append(&mut other.visible);
        self.matrices.append(&mut other.matrices);
        self.rays += other.rays;
    }
}

/// What looks, and how.
pub(super) struct Caster<'a> {
    pub(super) world: &'a World,
    pub(super) directions: &'a Directions,
    pub(super) cosine: &'a Cosine,
    /// Coefficients: the order squared.
    pub(super) n: usize,
    pub(super) is_shadowed: bool,
    /// Whether glossy points get their matrices.
    pub(super) with_matrices: bool,
}

impl Caster<'_> {
    /// Transfer at points; `None` if told to stop.
    pub(super) fn cast(&self, points: &[Point], what: &str, progress: &dyn Progress) -> Option<Seen> {
        let done = AtomicU64::new(0);
        let groups: Vec<Option<Seen>> = points
            .par_chunks(GROUP)
            .map(|group| {
                if progress.stop() {
                    return None;
                }
                let seen = self.cast_group(group);
                let sum = done.fetch_add(group.len() as u64, Ordering::Relaxed) + group.len() as u64;
                progress.report(what, sum, points.len() as u64);
                Some(seen)
            })
            .collect();
        let mut all = Seen::default();
        for group in groups {
            all.append(group?);
        }
        Some(all)
    }

    /// Transfer at up to [`GROUP`] points.
    pub(super) fn cast_group(&self, points: &[Point]) -> Seen {
        let n = self.n;
        let mut seen = Seen { transfer: Vec::with_capacity(points.len() * n), ..Seen::default() };
        // Where each point's matrix starts.
        let mut matrix_of = [None; GROUP];
        let mut glossy = 0;
        for (point, matrix) in points.iter().zip(&mut matrix_of) {
            seen.transfer
                .extend_from_slice(&self.cosine.about(point.surface.shading_normal).coefficients()[..n]);
            if point.is_glossy && self.with_matrices {
                *matrix = Some(glossy * n * n);
                glossy += 1;
            }
        }
        seen.matrices = vec![0.0; glossy * n * n];
        if !self.is_shadowed && glossy == 0 {
            seen.visible = vec![1.0; points.len()];
            return seen;
        }
        let mut rays = [Ray::new(Vec3::ZERO, Vec3::Y); GROUP];
        let mut looking = [(0usize, 0.0f32); GROUP];
        let mut blocked = [false; GROUP];
        for (d, &direction) in self.directions.vectors.iter().enumerate() {
            let harmonics = self.directions.harmonics(d);
            let mut count = 0;
            for (i, point) in points.iter().enumerate() {
                let cosine = direction.dot(point.surface.shading_normal);
                if cosine <= 0.0 {
                    continue;
                }
                let weight = cosine * self.directions.weight;
                if self.is_shadowed {
                    if direction.dot(point.surface.geometric_normal) <= 0.0 {
                        subtract(&mut seen.transfer[i * n..(i + 1) * n], harmonics, weight);
                        continue;
                    }
                    rays[count] = point.surface.spawn(direction, 0.0);
                }
                looking[count] = (i, weight);
                count += 1;
            }
            if self.is_shadowed {
                self.world.occluded_packet(&rays[..count], &mut blocked[..count]);
                seen.rays += count as u64;
            }
            for (&(i, weight), &blocked) in looking[..count].iter().zip(&blocked) {
                if blocked {
                    subtract(&mut seen.transfer[i * n..(i + 1) * n], harmonics, weight);
                } else if let Some(start) = matrix_of[i] {
                    let matrix = &mut seen.matrices[start..start + n * n];
                    for (row, &y) in matrix.chunks_exact_mut(n).zip(harmonics) {
                        subtract(row, harmonics, -weight * y);
                    }
                }
            }
        }
        let whole = self.cosine.about(Vec3::Y)[0];
        seen.visible = seen.transfer.chunks_exact(n).map(|t| (t[0] / whole).clamp(0.0, 1.0)).collect();
        seen
    }
}

/// sum −= weight · harmonics.
#[inline]
pub(super) fn subtract(sum: &mut [f32], harmonics: &[f32], weight: f32) {
    for (sum, &y) in sum.iter_mut().zip(harmonics) {
        *sum = y.mul_add(-weight, *sum);
    }
}
