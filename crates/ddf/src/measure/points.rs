//! Point clouds of a mesh and of a field, and the distances between them.
//!
//! Chamfer distance [002 eq. 14], w₁ = w₂ = 1: the mean squared distance from each point of one cloud to the nearest of
//! the other, both ways added; printed × 10³, of clouds in the unit sphere (radius 1).
//!
//! Two clouds of n points of one surface of area A are not at distance 0: the expected value is about 2A/(πn), which is
//! printed beside as the floor.

use glam::Vec3;
use rayon::prelude::*;

/// Points sorted for nearest-neighbour search: a k-d tree without pointers, each middle the root of its part.
#[derive(Debug)]
pub struct Cloud {
    points: Vec<Vec3>,
}

/// Parts of so few points are searched one by one.
const LEAF: usize = 8;

impl Cloud {
    /// Sorts the points.
    #[must_use]
    pub fn new(mut points: Vec<Vec3>) -> Cloud {
        points.retain(|p| p.is_finite());
        sort_by_depth(&mut points, 0);
        Cloud { points }
    }

    /// How many points there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// The points, in no order that means anything.
    #[must_use]
    pub fn points(&self) -> &[Vec3] {
        &self.points
    }

    /// Those points that have at least a third as many others within a radius as is usual: a rim has half as many, a
    /// corner of a sheet a quarter, and stays by its other points.
    #[must_use]
    pub fn without_loners(self, radius: f32) -> Cloud {
        let count = |p: Vec3, most: usize| {
            let mut found = 0;
            count_within(&self.points, 0, p, radius * radius, most, &mut found);
            found
        };
        let step = (self.points.len() / 2000).max(1);
        let mut usual: Vec<usize> = self.points.iter().step_by(step).map(|&p| count(p, usize::MAX)).collect();
        usual.sort_unstable();
        let least = usual.get(usual.len() / 2).map_or(1, |&usual| usual.div_ceil(3)).max(2);
        Cloud::new(self.points.par_iter().copied().filter(|&p| count(p, least) >= least).collect())
    }

    /// Squared distance to the nearest point [002 eq. 15]; infinite if there is none.
    #[must_use]
    pub fn squared_distance(&self, to: Vec3) -> f32 {
        let mut best = f32::INFINITY;
        search(&self.points, 0, to, &mut best);
        best
    }

    /// The squared distance of each point to the nearest of another cloud.
    #[must_use]
    pub fn sided_distances(&self, other: &Cloud) -> Vec<f32> {
        self.points.par_iter().map(|&p| other.squared_distance(p)).collect()
    }
}

/// The axis of a part follows from its depth.
fn sort_by_depth(points: &mut [Vec3], axis: usize) {
    if points.len() <= LEAF {
        return;
    }
    let middle = points.len() / 2;
    points.select_nth_unstable_by(middle, |a, b| a[axis].total_cmp(&b[axis]));
    let (left, right) = points.split_at_mut(middle);
    let next = (axis + 1) % 3;
    rayon::join(|| sort_by_depth(left, next), || sort_by_depth(&mut right[1..], next));
}

fn search(points: &[Vec3], axis: usize, to: Vec3, best: &mut f32) {
    if points.len() <= LEAF {
        for p in points {
            *best = best.min(p.distance_squared(to));
        }
        return;
    }
    let middle = points.len() / 2;
    let at = points[middle];
    *best = best.min(at.distance_squared(to));
    let aside = to[axis] - at[axis];
    let next = (axis + 1) % 3;
    let (near, far) = if aside < 0.0 {
        (&points[..middle], &points[middle + 1..])
    } else {
        (&points[middle + 1..], &points[..middle])
    };
    search(near, next, to, best);
    if aside * aside < *best {
        search(far, next, to, best);
    }
}

/// Counts the points about one, itself with them, up to `most`.
fn count_within(points: &[Vec3], axis: usize, about: Vec3, squared: f32, most: usize, found: &mut usize) {
    if *found >= most {
        return;
    }
    if points.len() <= LEAF {
        *found += points.iter().filter(|p| p.distance_squared(about) <= squared).count();
        return;
    }
    let middle = points.len() / 2;
    let at = points[middle];
    *found += usize::from(at.distance_squared(about) <= squared);
    let aside = about[axis] - at[axis];
    let next = (axis + 1) % 3;
    if aside <= 0.0 || aside * aside <= squared {
        count_within(&points[..middle], next, about, squared, most, found);
    }
    if aside >= 0.0 || aside * aside <= squared {
        count_within(&points[middle + 1..], next, about, squared, most, found);
    }
}

/// What two clouds say of each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CloudDistance {
    /// Chamfer distance × 10³.
    pub chamfer_e3: f64,
    /// Mean squared distance from the first to the second × 10³ (sided distance, accuracy).
    pub first_to_second_e3: f64,
    /// Mean squared distance from the second to the first × 10³ (sided distance, completeness).
    pub second_to_first_e3: f64,
    /// Harmonic mean of the parts of both clouds that have a neighbour within the threshold.
    pub f_score: f64,
}

/// The distance within which a point counts as matched by the f-score: a hundredth of the sphere's diameter.
pub const F_SCORE_THRESHOLD: f32 = 0.02;

/// Chamfer distance, sided distances and f-score of two clouds.
#[must_use]
pub fn compare_clouds(first: &Cloud, second: &Cloud) -> CloudDistance {
    let mean = |values: &[f32]| {
        if values.is_empty() {
            f64::INFINITY
        } else {
            values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len() as f64
        }
    };
    let within = |values: &[f32]| {
        let near = values.iter().filter(|&&v| v <= F_SCORE_THRESHOLD * F_SCORE_THRESHOLD).count();
        if values.is_empty() { 0.0 } else { near as f64 / values.len() as f64 }
    };
    let (forth, back) = (first.sided_distances(second), second.sided_distances(first));
    let (a, b) = (1e3 * mean(&forth), 1e3 * mean(&back));
    let (p, r) = (within(&forth), within(&back));
    let f_score = if p + r > 0.0 { 2.0 * p * r / (p + r) } else { 0.0 };
    CloudDistance { chamfer_e3: a + b, first_to_second_e3: a, second_to_first_e3: b, f_score }
}

/// Chamfer distance × 10³ of two clouds.
#[must_use]
pub fn chamfer_e3(first: &Cloud, second: &Cloud) -> f64 {
    compare_clouds(first, second).chamfer_e3
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    fn cloud(seed: u64, count: usize) -> Vec<Vec3> {
        let mut random = Random::new(seed, 0, 0);
        (0..count).map(|_| Vec3::new(random.float(), random.float(), random.float())).collect()
    }

    #[test]
    fn the_tree_finds_the_nearest_point_that_a_plain_search_finds() {
        let (a, b) = (cloud(1, 1000), cloud(2, 300));
        let tree = Cloud::new(a.clone());
        for &p in &b {
            let plain = a.iter().map(|q| q.distance_squared(p)).fold(f32::INFINITY, f32::min);
            assert_eq!(tree.squared_distance(p), plain);
        }
        assert_eq!(Cloud::new(Vec::new()).squared_distance(Vec3::ZERO), f32::INFINITY);
    }

    #[test]
    fn eq_14_of_002_for_two_clouds_of_two_points() {
        let first = Cloud::new(vec![Vec3::ZERO, Vec3::X]);
        let second = Cloud::new(vec![0.1 * Vec3::Z, Vec3::X + 0.3 * Vec3::Y]);
        // Both ways (0.01 + 0.09)/2.
        let found = compare_clouds(&first, &second);
        assert!((found.chamfer_e3 - 100.0).abs() < 1e-4, "{found:?}");
        assert_eq!(found.f_score, 0.0);
        assert_eq!(compare_clouds(&first, &first).chamfer_e3, 0.0);
        assert_eq!(compare_clouds(&first, &first).f_score, 1.0);
    }
}
