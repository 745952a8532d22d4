//! Midpoint subdivision.
//!
//! Every edge that is cut is cut at its midpoint, and whether it is cut depends on the edge alone, so that the
//! triangles on its two sides agree: no cracks and no T-junctions, also where the two sides have vertices of
//! their own at the same places (midpoints of equal positions are equal, bit for bit). The surface does not
//! change; attributes are interpolated, normals and tangents normalised.
//!
//! A triangle of which all edges are cut becomes four; two edges, three (the remaining quadrilateral is cut
//! along its shorter diagonal); one edge, two.

use glam::Vec3;

use super::weld::WordMap;
use super::{MeshError, TriangleMesh};

/// Passes of [`TriangleMesh::subdivide_to_edge`]: each halves the longest edge, and 40 halvings take the
/// largest allowed coordinate to a millimetre.
const MAX_PASSES: usize = 64;

impl TriangleMesh {
    /// Every triangle cut into four.
    #[must_use]
    pub fn subdivide(&self) -> Self {
        let mut fine = self.clone();
        fine.split_edges(|_, _| true);
        fine
    }

    /// Cuts edges until none is longer than `longest_edge` (metres, in the mesh's own frame).
    ///
    /// # Errors
    /// [`MeshError::TooManyTriangles`] if that takes more than `most_triangles`; the mesh is then as fine as
    /// the passes before made it, and still without cracks.
    pub fn subdivide_to_edge(&mut self, longest_edge: f32, most_triangles: usize) -> Result<(), MeshError> {
        let limit = f64::from(longest_edge.max(0.0)).powi(2);
        let too_long = |a: Vec3, b: Vec3| a.as_dvec3().distance_squared(b.as_dvec3()) > limit;
        for _ in 0..MAX_PASSES {
            let cuts = |t: usize| {
                let [a, b, c] = self.corners(t);
                [(a, b), (b, c), (c, a)].into_iter().filter(|(p, q)| too_long(*p, *q)).count()
            };
            let extra: usize = (0..self.triangles.len()).map(cuts).sum();
            if extra == 0 {
                return Ok(());
            }
            let needed = self.triangles.len() + extra;
            if needed > most_triangles {
                return Err(MeshError::TooManyTriangles { longest_edge, needed, allowed: most_triangles });
            }
            self.split_edges(too_long);
        }
        Ok(())
    }

    /// Cuts the edges for which `cut` says so. It must not depend on the order of its arguments.
    fn split_edges(&mut self, cut: impl Fn(Vec3, Vec3) -> bool) {
        let mut midpoints = WordMap::default();
        let slots = std::mem::take(&mut self.material_slots);
        let coarse = std::mem::take(&mut self.triangles);
        let mut fine = Vec::with_capacity(coarse.len() * 2);
        let mut fine_slots = Vec::new();
        for (i, &[a, b, c]) in coarse.iter().enumerate() {
            let before = fine.len();
            let mut middle = |p: u32, q: u32| {
                let (low, high) = (p.min(q), p.max(q));
                let (from, to) = (self.positions[low as usize], self.positions[high as usize]);
                cut(from, to).then(|| {
                    *midpoints
                        .entry(u64::from(low) << 32 | u64::from(high))
                        .or_insert_with(|| self.push_midpoint(low as usize, high as usize))
                })
            };
            let middles = (middle(a, b), middle(b, c), middle(c, a));
            match middles {
                (None, None, None) => fine.push([a, b, c]),
                (Some(ab), Some(bc), Some(ca)) => {
                    fine.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
                }
                (Some(m), None, None) => fine.extend([[a, m, c], [m, b, c]]),
                (None, Some(m), None) => fine.extend([[b, m, a], [m, c, a]]),
                (None, None, Some(m)) => fine.extend([[c, m, b], [m, a, b]]),
                (Some(ab), Some(bc), None) => self.cut_corner(&mut fine, [b, c, a], bc, ab),
                (None, Some(bc), Some(ca)) => self.cut_corner(&mut fine, [c, a, b], ca, bc),
                (Some(ab), None, Some(ca)) => self.cut_corner(&mut fine, [a, b, c], ab, ca),
            }
            if let Some(&slot) = slots.get(i) {
                fine_slots.resize(fine_slots.len() + fine.len() - before, slot);
            }
        }
        self.triangles = fine;
        self.material_slots = fine_slots;
    }

    /// The triangle `[tip, right, left]` with midpoints on tip–right and left–tip.
    fn cut_corner(
        &self,
        fine: &mut Vec<[u32; 3]>,
        [tip, right, left]: [u32; 3],
        to_right: u32,
        to_left: u32,
    ) {
        fine.push([tip, to_right, to_left]);
        let at = |vertex: u32| self.positions[vertex as usize];
        let one = at(to_right).distance_squared(at(left));
        let other = at(to_left).distance_squared(at(right));
        if one <= other {
            fine.extend([[to_right, right, left], [to_right, left, to_left]]);
        } else {
            fine.extend([[to_right, right, to_left], [to_left, right, left]]);
        }
    }

    fn push_midpoint(&mut self, p: usize, q: usize) -> u32 {
        let index = self.positions.len() as u32;
        self.positions.push(0.5 * self.positions[p] + 0.5 * self.positions[q]);
        if !self.normals.is_empty() {
            let normal = (self.normals[p] + self.normals[q]).try_normalize();
            self.normals.push(normal.unwrap_or(self.normals[p]));
        }
        if !self.uvs.is_empty() {
            self.uvs.push(0.5 * (self.uvs[p] + self.uvs[q]));
        }
        if !self.tangents.is_empty() {
            let (t, s) = (self.tangents[p], self.tangents[q]);
            let direction = (t + s).truncate().try_normalize().unwrap_or(t.truncate());
            self.tangents.push(direction.extend(t.w));
        }
        if !self.colors.is_empty() {
            self.colors.push(0.5 * (self.colors[p] + self.colors[q]));
        }
        index
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::samples::{grid, octahedron};
    use super::*;

    /// Edges that do not have a partner running the other way, by position: 0 for a closed surface.
    pub(crate) fn open_edges(mesh: &TriangleMesh) -> usize {
        let places = mesh.places();
        let mut count = std::collections::HashMap::new();
        for t in &mesh.triangles {
            for k in 0..3 {
                let (a, b) = (places[t[k] as usize], places[t[(k + 1) % 3] as usize]);
                *count.entry((a.min(b), a.max(b))).or_insert(0i32) += if a < b { 1 } else { -1 };
            }
        }
        count.values().filter(|c| **c != 0).count()
    }

    #[test]
    fn subdividing_makes_four_of_each_and_keeps_the_surface() {
        let mut mesh = octahedron();
        mesh.material_slots = (0..8).collect();
        let fine = mesh.subdivide();
        assert_eq!((fine.triangles.len(), fine.positions.len()), (32, 18));
        assert_eq!(fine.material_slots[4..8], [1; 4]);
        assert!((fine.surface_area() - mesh.surface_area()).abs() < 1e-5);
        assert_eq!(open_edges(&fine), 0);
    }

    #[test]
    fn edges_are_cut_down_to_a_length_without_cracks() {
        let mut mesh = octahedron().faceted();
        // Stretched, so that triangles have one, two or three long edges.
        mesh.positions.iter_mut().for_each(|p| *p *= Vec3::new(5.0, 1.0, 0.2));
        mesh.repair().expect("usable");
        let area = mesh.surface_area();
        mesh.subdivide_to_edge(0.3, 100_000).expect("fits");
        assert_eq!(open_edges(&mesh), 0);
        assert!((mesh.surface_area() - area).abs() < 1e-4 * area);
        for t in 0..mesh.triangles.len() {
            let [a, b, c] = mesh.corners(t);
            assert!(a.distance(b).max(b.distance(c)).max(c.distance(a)) <= 0.3);
        }
        assert_eq!(mesh.validate().expect("usable"), Default::default());
    }

    #[test]
    fn too_fine_a_subdivision_is_refused_before_it_is_made() {
        let mut mesh = grid(4);
        let error = mesh.subdivide_to_edge(1e-6, 10_000).expect_err("too fine");
        assert!(matches!(error, MeshError::TooManyTriangles { allowed: 10_000, .. }));
        assert!(mesh.triangles.len() <= 10_000);
        mesh.subdivide_to_edge(0.0, 10_000).expect_err("never fine enough");
    }
}
