//! Vectors on concentric shells around a middle: the field of occlusion or of radiance of an entity.
//!
//! Shell k has the radius R r₀ (r₁/r₀)^(k/(n−1)), r₀ = 0.2, r₁ = 8, R the bounding radius. Its points stand where a square
//! grid of (d + 1)² knots folds onto the octahedron: knots on the fold coincide, so that bilinear interpolation has no
//! seam. Between shells vectors are mixed linearly in 1/r², which is exact for the first band of anything small or far;
//! beyond the last they fall with 1/r², within the first they stay. Axes and origin are those of the entity when the
//! field was made.
//!
//! Source: Zhou et al. 2005 and seed \[004\], which have the shells and the trilinear interpolation; the octahedral grid and
//! the weight in 1/r² are ours. Cost: eight vectors are read and mixed, about 30 ns at order 4.

use glam::{Vec2, Vec3};
use halflight_sh::Sh;
use rayon::prelude::*;

/// Radii of the innermost and the outermost shell, in bounding radii.
pub(super) const INNERMOST: f32 = 0.2;
/// See [`INNERMOST`].
pub(super) const OUTERMOST: f32 = 8.0;

/// How fine a field is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fineness {
    pub(super) shells: usize,
    pub(super) directions: usize,
}

/// A field of `CHANNELS` functions: one for occlusion, three for radiance.
pub(super) struct Shells<const ORDER: usize, const CHANNELS: usize> {
    pub(super) center: Vec3,
    pub(super) radius: f32,
    fine: Fineness,
    /// 1/r² of each shell, r in bounding radii.
    falls: Vec<f32>,
    /// 1/ln of the ratio of neighbouring radii.
    per_log: f32,
    /// Shell by shell, row by row.
    vectors: Vec<[Sh<ORDER>; CHANNELS]>,
}

impl<const ORDER: usize, const CHANNELS: usize> Shells<ORDER, CHANNELS> {
    /// The field that a function of the point has.
    pub(super) fn new(
        (center, radius): (Vec3, f32),
        fine: Fineness,
        at: impl Fn(Vec3) -> [Sh<ORDER>; CHANNELS] + Sync,
    ) -> Self {
        let Fineness { shells, directions } = fine;
        let step = (OUTERMOST / INNERMOST).ln() / (shells - 1) as f32;
        let radii: Vec<f32> = (0..shells).map(|k| INNERMOST * (step * k as f32).exp()).collect();
        let side = directions + 1;
        let vectors = (0..shells * side * side)
            .into_par_iter()
            .map(|i| {
                let (column, row) = (i % side, i / side % side);
                let knot = Vec2::new(column as f32, row as f32) / directions as f32;
                at(center + unfold(knot) * (radii[i / (side * side)] * radius))
            })
            .collect();
        let falls = radii.iter().map(|r| 1.0 / (r * r)).collect();
        Self { center, radius, fine, falls, per_log: 1.0 / step, vectors }
    }

    /// The vectors at a point, in the axes of the field.
    #[inline]
    pub(super) fn at(&self, point: Vec3) -> [Sh<ORDER>; CHANNELS] {
        let Fineness { shells, directions } = self.fine;
        let from_center = (point - self.center) / self.radius;
        let squared = from_center.length_squared();
        let place = 0.5 * (squared / (INNERMOST * INNERMOST)).ln() * self.per_log;
        // NaN and −∞ of the very middle give the first shell.
        let below = (place.max(0.0) as usize).min(shells - 2);
        let (near, far) = (self.falls[below], self.falls[below + 1]);
        let fall = 1.0 / squared;
        let outer = ((near - fall) / (near - far)).clamp(0.0, 1.0);
        let beyond = (fall * OUTERMOST * OUTERMOST).min(1.0);
        let knot = fold(from_center) * directions as f32;
        let corner = |x: f32| (x as usize).min(directions - 1);
        let (column, row) = (corner(knot.x), corner(knot.y));
        let (s, t) = (knot.x - column as f32, knot.y - row as f32);
        let side = directions + 1;
        let mut sum = [Sh::zero(); CHANNELS];
        for (shell, weight) in [(below, (1.0 - outer) * beyond), (below + 1, outer * beyond)] {
            let first = (shell * side + row) * side + column;
            let weights = [(1.0 - s) * (1.0 - t), s * (1.0 - t), (1.0 - s) * t, s * t];
            for (index, share) in [first, first + 1, first + side, first + side + 1].into_iter().zip(weights)
            {
                for (sum, vector) in sum.iter_mut().zip(&self.vectors[index]) {
                    *sum += *vector * (weight * share);
                }
            }
        }
        sum
    }

    /// Bytes that the vectors take.
    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(self.vectors.as_slice())
    }
}

/// From the square \[0, 1\]² to directions.
pub(super) fn unfold(knot: Vec2) -> Vec3 {
    let flat = 2.0 * knot - Vec2::ONE;
    let height = 1.0 - flat.x.abs() - flat.y.abs();
    let lower = (-height).max(0.0);
    let inwards = |x: f32| if x < 0.0 { x + lower } else { x - lower };
    Vec3::new(inwards(flat.x), height, inwards(flat.y)).normalize_or(Vec3::Y)
}

/// From directions, of any length above 0, to the square.
#[inline]
pub(super) fn fold(direction: Vec3) -> Vec2 {
    let flat = direction / direction.abs().element_sum().max(f32::MIN_POSITIVE);
    let (x, z) = if flat.y < 0.0 {
        ((1.0 - flat.z.abs()).copysign(flat.x), (1.0 - flat.x.abs()).copysign(flat.z))
    } else {
        (flat.x, flat.z)
    };
    (0.5 * Vec2::new(x, z) + 0.5).clamp(Vec2::ZERO, Vec2::ONE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folding_undoes_unfolding() {
        for i in 0..=20 {
            for j in 0..=20 {
                let direction = unfold(Vec2::new(i as f32, j as f32) / 20.0);
                assert!(unfold(fold(direction)).abs_diff_eq(direction, 1e-5), "{i} {j}");
            }
        }
    }

    #[test]
    fn a_field_has_no_seam_and_its_knots_are_met() {
        let fine = Fineness { shells: 5, directions: 6 };
        let value = |p: Vec3| [Sh::<3>::basis(p.normalize().to_array()) * p.length().sqrt()];
        let field = Shells::new((Vec3::X, 2.0), fine, |p| value(p - Vec3::X));
        let knot = unfold(Vec2::new(2.0, 5.0) / 6.0) * (2.0 * INNERMOST);
        assert!((field.at(Vec3::X + knot)[0] - value(knot)[0]).norm() < 1e-5);
        // Both sides of the equator, and of the fold on the lower half.
        for (a, b) in [(Vec3::new(1.0, 1e-6, 0.3), Vec3::new(1.0, -1e-6, 0.3)), {
            (Vec3::new(1e-6, -1.0, -0.4), Vec3::new(-1e-6, -1.0, -0.4))
        }] {
            assert!((field.at(Vec3::X + a)[0] - field.at(Vec3::X + b)[0]).norm() < 1e-4);
        }
    }

    #[test]
    fn the_middle_itself_and_points_far_away_have_sound_vectors() {
        let fine = Fineness { shells: 2, directions: 2 };
        let field = Shells::new((Vec3::ZERO, 1.0), fine, |_| [Sh::<3>::one()]);
        for point in [Vec3::ZERO, Vec3::splat(1e-30), Vec3::X * 0.1, Vec3::Y] {
            assert!((field.at(point)[0] - Sh::one()).norm() < 1e-5, "{point}");
        }
        let far = field.at(Vec3::X * 16.0)[0];
        assert!((far - Sh::one() * 0.25).norm() < 1e-5);
        assert!(field.at(Vec3::X * 1e18)[0].norm() < 1e-6);
    }
}
