//! How well any set stands for any mesh: volume outside, surface left uncovered.

use glam::Vec3;
use rayon::prelude::*;

use super::SphereSet;
use super::solid::Solid;
use crate::TriangleMesh;

/// Cells along the longest side for volumes: a sphere of the same extent is then measured to about 0.1 %.
const RESOLUTION: usize = 160;
/// Pieces of surface that no single sphere holds are divided down to this share of the longest side.
const SMALLEST_PIECE: f32 = 1.0 / 256.0;
/// Triangles a thread takes at a time.
const CHUNK: usize = 256;

/// Volumes and coverage of a set against a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphereMeasure {
    /// The volume that the mesh encloses, m³; 0 if it encloses none.
    pub mesh_volume: f64,
    /// The volume of the union of all spheres, m³.
    pub union_volume: f64,
    /// The part of it that is outside the mesh, m³.
    pub outside_volume: f64,
    /// How much of the surface is in no sphere.
    pub coverage: SphereCoverage,
}

/// Shares of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphereCoverage {
    /// The share of the area whose small pieces have their middle in no sphere.
    pub uncovered: f64,
    /// The share of the area that no single sphere was seen to hold as a whole: an upper bound of what is uncovered.
    pub uncertain: f64,
}

impl SphereMeasure {
    /// The outside volume by the volume of the mesh; `None` for a mesh that encloses nothing.
    pub fn outside_fraction(&self) -> Option<f64> {
        (self.mesh_volume > 0.0).then(|| self.outside_volume / self.mesh_volume)
    }
}

impl SphereSet {
    /// Measures the set against a mesh in the same frame and pose. Volumes are counted on rows of voxels, coverage by
    /// dividing triangles until a sphere holds them whole. About 0.3 s for 70,000 triangles and 50 spheres.
    ///
    /// # Panics
    /// If the mesh's indices are out of range: see [`TriangleMesh::validate`].
    pub fn measure(&self, mesh: &TriangleMesh) -> SphereMeasure {
        let coverage = self.coverage(mesh);
        let none = SphereMeasure { mesh_volume: 0.0, union_volume: 0.0, outside_volume: 0.0, coverage };
        let bounds = match (mesh.bounds(), self.bounds()) {
            (Some(a), Some(b)) => (a.0.min(b.0), a.1.max(b.1)),
            (Some(only), None) | (None, Some(only)) => only,
            (None, None) => return none,
        };
        // Volumes of tiny and huge scenes leave f32; those of the scaled one do not.
        let scale = (bounds.1 - bounds.0).max_element();
        if scale.is_nan() || scale < f32::MIN_POSITIVE {
            return none;
        }
        let to_unit = |p: Vec3| (p - bounds.0) / scale;
        let positions: Vec<Vec3> = mesh.positions.iter().map(|p| to_unit(*p)).collect();
        let solid = Solid::build(&positions, &mesh.triangles, (Vec3::ZERO, to_unit(bounds.1)), RESOLUTION);
        let balls: Vec<(Vec3, f32)> = self.spheres().map(|(c, r)| (to_unit(c), r / scale)).collect();
        let (union, inside) = solid.union_of(&balls);
        let cubic = f64::from(scale).powi(3);
        SphereMeasure {
            mesh_volume: solid.volume * cubic,
            union_volume: union * cubic,
            outside_volume: (union - inside).max(0.0) * cubic,
            coverage,
        }
    }

    /// How much of the surface of a mesh is in no sphere.
    fn coverage(&self, mesh: &TriangleMesh) -> SphereCoverage {
        let extent = mesh.bounds().map_or(0.0, |(low, high)| (high - low).max_element());
        let spheres: Vec<(Vec3, f32)> = self.spheres().collect();
        let pieces: Vec<[f64; 3]> = mesh
            .triangles
            .par_chunks(CHUNK)
            .map(|chunk| {
                let mut sums = [0.0; 3];
                for triangle in chunk {
                    let corners = triangle.map(|v| mesh.positions[v as usize]);
                    let near = nearby(&spheres, corners);
                    add(corners, &near, SMALLEST_PIECE * extent, &mut sums);
                }
                sums
            })
            .collect();
        let [all, uncovered, uncertain] =
            pieces.into_iter().fold([0.0; 3], |a, b| std::array::from_fn(|k| a[k] + b[k]));
        let share = |part: f64| if all > 0.0 { part / all } else { 0.0 };
        SphereCoverage { uncovered: share(uncovered), uncertain: share(uncertain) }
    }
}

/// The spheres that reach the ball around a triangle.
fn nearby(spheres: &[(Vec3, f32)], [a, b, c]: [Vec3; 3]) -> Vec<(Vec3, f32)> {
    let middle = (a + b + c) / 3.0;
    let reach = [a, b, c].map(|p| p.distance(middle)).into_iter().fold(0.0, f32::max);
    spheres.iter().copied().filter(|(center, r)| center.distance(middle) <= r + reach).collect()
}

/// Adds a triangle's [area, uncovered area, uncertain area].
fn add([a, b, c]: [Vec3; 3], spheres: &[(Vec3, f32)], smallest: f32, sums: &mut [f64; 3]) {
    let area = || 0.5 * f64::from((b - a).cross(c - a).length());
    let holds = |p: Vec3, (center, r): &(Vec3, f32)| p.distance_squared(*center) <= r * r;
    if spheres.iter().any(|s| holds(a, s) && holds(b, s) && holds(c, s)) {
        sums[0] += area();
        return;
    }
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    if longest <= smallest || spheres.is_empty() {
        let area = area();
        sums[0] += area;
        sums[2] += area;
        if !spheres.iter().any(|s| holds((a + b + c) / 3.0, s)) {
            sums[1] += area;
        }
        return;
    }
    let (ab, bc, ca) = (0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a));
    for piece in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
        add(piece, spheres, smallest, sums);
    }
}
