//! Polygons to triangles.
//!
//! A polygon of n corners becomes n − 2 triangles. A triangle fan does if every triangle of it turns like the
//! polygon as a whole; otherwise ears are clipped in the plane of the polygon's normal (Newell's:
//! Σ p_i × p_{i+1}). What even that cannot cut (polygons that cross themselves) becomes a fan.

use glam::{DVec2, DVec3, Vec3};

/// Ear clipping looks at all corners for each ear; polygons with more corners than this are fans.
const MOST_EARS: usize = 512;

/// Appends the triangles of a polygon, as positions in `corners`, to `triangles`.
pub(super) fn triangulate(corners: &[Vec3], triangles: &mut Vec<[usize; 3]>) {
    let n = corners.len();
    if n < 3 {
        return;
    }
    if n > 3 && n <= MOST_EARS {
        let origin = corners[0].as_dvec3();
        let relative: Vec<DVec3> = corners.iter().map(|p| p.as_dvec3() - origin).collect();
        let normal: DVec3 = (0..n).map(|i| relative[i].cross(relative[(i + 1) % n])).sum();
        let turns_back = |i: usize| relative[i].cross(relative[i + 1]).dot(normal) < 0.0;
        if (1..n - 1).any(turns_back) && clip_ears(&relative, normal, triangles) {
            return;
        }
    }
    triangles.extend((1..n - 1).map(|i| [0, i, i + 1]));
}

/// Clips ears until three corners are left; `false` (and nothing appended) if no ear can be found.
fn clip_ears(corners: &[DVec3], normal: DVec3, triangles: &mut Vec<[usize; 3]>) -> bool {
    let (along, across) = normal.normalize_or_zero().any_orthonormal_pair();
    let flat: Vec<DVec2> = corners.iter().map(|p| DVec2::new(p.dot(along), p.dot(across))).collect();
    let turn = |a: usize, b: usize, c: usize| (flat[b] - flat[a]).perp_dot(flat[c] - flat[a]);
    let mut left: Vec<usize> = (0..corners.len()).collect();
    let before = triangles.len();
    while left.len() > 3 {
        let n = left.len();
        let is_ear = |i: &usize| {
            let (a, b, c) = (left[(i + n - 1) % n], left[*i], left[(i + 1) % n]);
            let inside = |&p: &usize| turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0;
            let apart = |p: &usize| ![a, b, c].contains(p) && flat[*p] != flat[a] && flat[*p] != flat[c];
            turn(a, b, c) > 0.0 && !left.iter().filter(|p| apart(p)).any(inside)
        };
        let Some(ear) = (0..n).find(is_ear) else {
            triangles.truncate(before);
            return false;
        };
        triangles.push([left[(ear + n - 1) % n], left[ear], left[(ear + 1) % n]]);
        left.remove(ear);
    }
    triangles.push([left[0], left[1], left[2]]);
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(corners: &[Vec3], triangles: &[[usize; 3]]) -> f32 {
        triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| corners[i]);
                let normal = (b - a).cross(c - a);
                assert!(normal.z >= 0.0, "a triangle turns back");
                0.5 * normal.length()
            })
            .sum()
    }

    #[test]
    fn convex_polygons_become_fans() {
        let corners: Vec<Vec3> = (0..7).map(|i| Vec3::new((i as f32).cos(), (i as f32).sin(), 0.0)).collect();
        let mut triangles = Vec::new();
        triangulate(&corners[..6], &mut triangles);
        assert_eq!(triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]]);
        triangulate(&corners[..2], &mut triangles);
        assert_eq!(triangles.len(), 4);
    }

    #[test]
    fn concave_polygons_are_covered_exactly() {
        // An arrow head, and a letter U.
        let arrow = [(0.0, 0.0), (2.0, -2.0), (0.0, 3.0), (-2.0, -2.0)];
        let letter =
            [(0.0, 0.0), (3.0, 0.0), (3.0, 3.0), (2.0, 3.0), (2.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0)];
        for (outline, expected) in [(&arrow[..], 6.0), (&letter[..], 7.0)] {
            for start in 0..outline.len() {
                let mut corners: Vec<Vec3> = outline.iter().map(|(x, y)| Vec3::new(*x, *y, 5.0)).collect();
                corners.rotate_left(start);
                let mut triangles = Vec::new();
                triangulate(&corners, &mut triangles);
                assert_eq!(triangles.len(), corners.len() - 2);
                assert!((area(&corners, &triangles) - expected).abs() < 1e-5, "from {start}");
            }
        }
    }

    #[test]
    fn polygons_without_a_plane_still_become_triangles() {
        for corners in [vec![Vec3::ZERO; 6], vec![Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::X]] {
            let mut triangles = Vec::new();
            triangulate(&corners, &mut triangles);
            assert_eq!(triangles.len(), corners.len() - 2);
        }
    }
}
