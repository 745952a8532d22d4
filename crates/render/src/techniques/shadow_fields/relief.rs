//! What a height field hides, from itself and from what stands on it: a lattice of points over it instead of shells.
//!
//! Columns stand on an even grid of posts; on each of them there are a point of the surface (with the mirror image of its
//! sky below the tangent plane, as on all surfaces) and eight levels above it, at 0 and from half a step of the grid to the
//! extent of the field. Between them vectors are mixed linearly; beyond the borders those of the border are taken. Hills
//! narrower than a step of the grid hide nothing; the heights are those of the time when the field was prepared.

use glam::{Vec2, Vec3};
use halflight_sh::Sh;
use halflight_shape::HeightField;
use rayon::prelude::*;

use super::cast::Caster;

/// Levels above the surface, the surface included.
const LEVELS: usize = 8;

/// A height field where it stood when it was prepared.
pub(super) struct Relief<const ORDER: usize> {
    /// From there into the field's own space.
    inverse: glam::Affine3A,
    min: Vec2,
    per_step: Vec2,
    posts: usize,
    heights: Vec<f32>,
    /// Heights of the levels above the surface.
    levels: [f32; LEVELS],
    /// Post by post: what is hidden above the surface, then the levels.
    hidden: Vec<Sh<ORDER>>,
}

impl<const ORDER: usize> Relief<ORDER> {
    pub(super) fn new(caster: &Caster, field: &HeightField, place: &glam::Affine3A, posts: usize) -> Self {
        let size = field.max - field.min;
        let step = size / (posts - 1) as f32;
        let (first, last) = (0.5 * step.min_element(), size.max_element());
        let ratio = (last / first).powf(1.0 / (LEVELS - 2) as f32);
        let levels = std::array::from_fn(|k| if k == 0 { 0.0 } else { first * ratio.powi(k as i32 - 1) });
        let at = |i: usize| field.min + step * Vec2::new((i % posts) as f32, (i / posts) as f32);
        let heights: Vec<f32> = (0..posts * posts).map(at).map(|p| field.height_at(p.x, p.y)).collect();
        let lift = 1e-4 * caster.radius;
        let vector = |i: usize| {
            let (post, level) = (i / (LEVELS + 1), i % (LEVELS + 1));
            // Just within the borders, where rays downwards meet the field.
            let p = at(post).clamp(field.min + 1e-3 * step, field.max - 1e-3 * step);
            let ground = Vec3::new(p.x, heights[post], p.y);
            if level == 0 {
                let slope = |along: Vec2| {
                    let height = |p: Vec2| {
                        let p = p.clamp(field.min, field.max);
                        field.height_at(p.x, p.y)
                    };
                    height(p + along) - height(p - along)
                };
                let normal = Vec3::new(
                    -slope(Vec2::new(0.5 * step.x, 0.0)) / step.x,
                    1.0,
                    -slope(Vec2::new(0.0, 0.5 * step.y)) / step.y,
                );
                let normal = place.inverse().matrix3.transpose() * glam::Vec3A::from(normal);
                let normal = Vec3::from(normal).normalize_or(Vec3::Y);
                return caster.hidden_above(place.transform_point3(ground), normal, caster.rays);
            }
            let above = place.transform_point3(ground + Vec3::Y * levels[level - 1]);
            caster.hidden(above + place.transform_vector3(Vec3::Y).normalize_or(Vec3::Y) * lift)
        };
        let hidden = (0..posts * posts * (LEVELS + 1)).into_par_iter().map(vector).collect();
        Self {
            inverse: place.inverse(),
            min: field.min,
            per_step: 1.0 / step,
            posts,
            heights,
            levels,
            hidden,
        }
    }

    /// Posts around a point of the field's own space, with their weights.
    fn around(&self, local: Vec3) -> [(usize, f32); 4] {
        let last = (self.posts - 1) as f32;
        let at =
            ((Vec2::new(local.x, local.z) - self.min) * self.per_step).clamp(Vec2::ZERO, Vec2::splat(last));
        let corner = |x: f32| (x as usize).min(self.posts - 2);
        let (column, row) = (corner(at.x), corner(at.y));
        let (s, t) = (at.x - column as f32, at.y - row as f32);
        let first = row * self.posts + column;
        [
            (first, (1.0 - s) * (1.0 - t)),
            (first + 1, s * (1.0 - t)),
            (first + self.posts, (1.0 - s) * t),
            (first + self.posts + 1, s * t),
        ]
    }

    /// What it hides from its own surface.
    pub(super) fn own(&self, point: Vec3) -> Sh<ORDER> {
        let mut sum = Sh::zero();
        for (post, weight) in self.around(self.inverse.transform_point3(point)) {
            sum += self.hidden[post * (LEVELS + 1)] * weight;
        }
        sum
    }

    /// What it hides from a point above.
    pub(super) fn at(&self, point: Vec3) -> Sh<ORDER> {
        let local = self.inverse.transform_point3(point);
        let around = self.around(local);
        let ground: f32 = around.iter().map(|(post, weight)| self.heights[*post] * weight).sum();
        let height = (local.y - ground).clamp(0.0, self.levels[LEVELS - 1]);
        let below = self.levels[1..LEVELS - 1].iter().filter(|level| **level <= height).count();
        let t = (height - self.levels[below]) / (self.levels[below + 1] - self.levels[below]);
        let mut sum = Sh::zero();
        for (post, weight) in around {
            let first = post * (LEVELS + 1) + 1 + below;
            sum += self.hidden[first] * (weight * (1.0 - t)) + self.hidden[first + 1] * (weight * t);
        }
        sum
    }

    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(self.hidden.as_slice())
    }
}
