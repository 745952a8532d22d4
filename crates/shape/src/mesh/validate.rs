//! What must hold of a mesh before anything is computed with it.
//!
//! Refused: indices out of range, attributes that do not match the vertices, numbers that are not finite or
//! larger than [`MAX_COORDINATE`]. Repaired and counted: normals and tangents of no length or not of unit
//! length. Counted and kept: triangles without area. They are harmless to rays (nothing hits them), and
//! keeping them keeps the numbers of the triangles, which deforming meshes and file formats refer to.

use glam::{Vec3, Vec4};

use super::TriangleMesh;

/// The largest magnitude of a coordinate, in metres. Its square, in areas and dot products, and the products
/// with transforms still fit in an `f32` with room to spare.
pub const MAX_COORDINATE: f32 = 1e15;

/// How far the squared length of a normal may be from one before it is normalised anew: what 8-bit
/// components leave (each off by 1/254, the sum by 2√3/254), and a little more.
const UNIT_TOLERANCE: f32 = 0.02;

/// Why a mesh cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// A triangle refers to a vertex that does not exist.
    #[error(
        "triangle {triangle} refers to vertex {vertex}, but there are {vertices} vertices, counted from 0"
    )]
    IndexOutOfRange {
        /// The triangle.
        triangle: usize,
        /// The index it holds.
        vertex: u32,
        /// How many vertices there are.
        vertices: usize,
    },
    /// An attribute has too few or too many entries.
    #[error("there are {found} {attribute}, but {expected} were expected")]
    AttributeLength {
        /// The attribute, in the plural.
        attribute: &'static str,
        /// Its entries.
        found: usize,
        /// The entries it should have.
        expected: usize,
    },
    /// A number is NaN or infinite.
    #[error("the {attribute} of vertex {vertex} is not finite: {value}")]
    NotFinite {
        /// The attribute, in the singular.
        attribute: &'static str,
        /// The vertex.
        vertex: usize,
        /// What stands there.
        value: String,
    },
    /// A coordinate is beyond [`MAX_COORDINATE`].
    #[error("vertex {vertex} lies at {value}, further out than {MAX_COORDINATE:e} m")]
    TooFar {
        /// The vertex.
        vertex: usize,
        /// Where it lies.
        value: String,
    },
    /// More vertices than indices can name.
    #[error("there are {0} vertices, more than 32-bit indices can name")]
    TooManyVertices(usize),
    /// Subdivision would make more triangles than the caller allows.
    #[error(
        "edges of at most {longest_edge} m would take {needed} triangles, more than the {allowed} allowed"
    )]
    TooManyTriangles {
        /// The edge length that was asked for.
        longest_edge: f32,
        /// Triangles of the pass that would have gone too far.
        needed: usize,
        /// The caller's limit.
        allowed: usize,
    },
}

/// What is wrong with a mesh that can be used all the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MeshFlaws {
    /// Triangles without area. They are kept.
    pub degenerate_triangles: usize,
    /// Normals of no length, NaN, or not of unit length.
    pub bad_normals: usize,
    /// Tangents of no length, NaN, not of unit length, or without handedness.
    pub bad_tangents: usize,
}

impl MeshFlaws {
    /// One sentence for each kind of flaw that there is, about the mesh called `name`.
    pub fn sentences(&self, name: &str) -> Vec<String> {
        let mut sentences = Vec::new();
        let mut tell = |count: usize, what: &str| {
            if count > 0 {
                sentences.push(format!("{name}: {count} {what}"));
            }
        };
        tell(self.degenerate_triangles, "triangles have no area; they are kept, and no ray hits them");
        tell(self.bad_normals, "normals had no unit length and were replaced");
        tell(self.bad_tangents, "tangents had no unit length and were replaced");
        sentences
    }
}

impl TriangleMesh {
    /// Checks the mesh and counts its flaws without changing it. One pass over vertices and triangles.
    ///
    /// # Errors
    /// The first thing that makes the mesh unusable.
    pub fn validate(&self) -> Result<MeshFlaws, MeshError> {
        self.check_lengths()?;
        self.check_numbers()?;
        let vertices = self.positions.len();
        let mut degenerate_triangles = 0;
        for (triangle, indices) in self.triangles.iter().enumerate() {
            for &vertex in indices {
                if vertex as usize >= vertices {
                    return Err(MeshError::IndexOutOfRange { triangle, vertex, vertices });
                }
            }
            degenerate_triangles += usize::from(has_no_area(self.corners(triangle)));
        }
        Ok(MeshFlaws {
            degenerate_triangles,
            bad_normals: self.normals.iter().filter(|n| !is_unit(**n)).count(),
            bad_tangents: self.tangents.iter().filter(|t| !is_tangent(**t)).count(),
        })
    }

    /// Checks the mesh like [`TriangleMesh::validate`] and repairs what can be repaired: normals are
    /// normalised, or taken from the triangles around where they have no length; likewise tangents.
    ///
    /// # Errors
    /// The first thing that makes the mesh unusable.
    pub fn repair(&mut self) -> Result<MeshFlaws, MeshError> {
        let flaws = self.validate()?;
        if flaws.bad_normals > 0 {
            self.replace_bad_normals();
        }
        if flaws.bad_tangents > 0 {
            self.replace_bad_tangents();
        }
        Ok(flaws)
    }

    fn check_lengths(&self) -> Result<(), MeshError> {
        let vertices = self.positions.len();
        if u32::try_from(vertices).is_err() {
            return Err(MeshError::TooManyVertices(vertices));
        }
        let check = |attribute, found: usize, expected: usize| {
            if found == 0 || found == expected {
                Ok(())
            } else {
                Err(MeshError::AttributeLength { attribute, found, expected })
            }
        };
        check("normals", self.normals.len(), vertices)?;
        check("texture coordinates", self.uvs.len(), vertices)?;
        check("tangents", self.tangents.len(), vertices)?;
        check("colours", self.colors.len(), vertices)?;
        check("material slots", self.material_slots.len(), self.triangles.len())
    }

    fn check_numbers(&self) -> Result<(), MeshError> {
        let not_finite = |attribute, vertex, value| Err(MeshError::NotFinite { attribute, vertex, value });
        for (vertex, p) in self.positions.iter().enumerate() {
            // NaN fails this comparison too.
            if !(p.abs().max_element() <= MAX_COORDINATE && p.is_finite()) {
                if p.is_finite() {
                    return Err(MeshError::TooFar { vertex, value: p.to_string() });
                }
                return not_finite("position", vertex, p.to_string());
            }
        }
        if let Some(vertex) = self.uvs.iter().position(|uv| !uv.is_finite()) {
            return not_finite("texture coordinate", vertex, self.uvs[vertex].to_string());
        }
        if let Some(vertex) = self.colors.iter().position(|c| !c.is_finite()) {
            return not_finite("colour", vertex, self.colors[vertex].to_string());
        }
        Ok(())
    }

    fn replace_bad_normals(&mut self) {
        let from_triangles = self.smooth_normals();
        for (normal, fallback) in self.normals.iter_mut().zip(from_triangles) {
            if !is_unit(*normal) {
                // A direction can be kept even if its length is wrong; the division avoids overflow.
                let largest = normal.abs().max_element();
                *normal = if normal.is_finite() && largest > 0.0 {
                    (*normal / largest).try_normalize().unwrap_or(fallback)
                } else {
                    fallback
                };
            }
        }
    }

    fn replace_bad_tangents(&mut self) {
        for i in 0..self.tangents.len() {
            let tangent = self.tangents[i];
            if !is_tangent(tangent) {
                let normal = self.normals.get(i).copied().unwrap_or(Vec3::Z);
                let direction = tangent.truncate();
                let largest = direction.abs().max_element();
                let direction = if direction.is_finite() && largest > 0.0 {
                    (direction / largest).try_normalize()
                } else {
                    None
                };
                let handedness = if tangent.w < 0.0 { -1.0 } else { 1.0 };
                self.tangents[i] =
                    direction.unwrap_or_else(|| normal.any_orthonormal_vector()).extend(handedness);
            }
        }
    }
}

fn is_unit(v: Vec3) -> bool {
    (v.length_squared() - 1.0).abs() <= UNIT_TOLERANCE
}

fn is_tangent(t: Vec4) -> bool {
    is_unit(t.truncate()) && t.w.abs() == 1.0
}

/// In f64, so that triangles with edges of 1e-20 m still have an area.
fn has_no_area(corners: [Vec3; 3]) -> bool {
    let [a, b, c] = corners.map(|p| p.as_dvec3());
    (b - a).cross(c - a).length_squared() <= 0.0
}

#[cfg(test)]
mod tests {
    use glam::Vec2;

    use super::super::samples::{grid, octahedron};
    use super::*;

    #[test]
    fn sound_meshes_have_no_flaws() {
        assert_eq!(grid(3).validate(), Ok(MeshFlaws::default()));
        assert_eq!(octahedron().validate(), Ok(MeshFlaws::default()));
        assert_eq!(TriangleMesh::default().validate(), Ok(MeshFlaws::default()));
    }

    #[test]
    fn an_index_out_of_range_is_named() {
        let mut mesh = octahedron();
        mesh.triangles[2][1] = 6;
        assert_eq!(mesh.validate(), Err(MeshError::IndexOutOfRange { triangle: 2, vertex: 6, vertices: 6 }));
    }

    #[test]
    fn numbers_that_are_not_finite_are_refused() {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut mesh = octahedron();
            mesh.positions[4].y = bad;
            assert!(matches!(mesh.validate(), Err(MeshError::NotFinite { vertex: 4, .. })));
            let mut mesh = grid(1);
            mesh.uvs[3].x = bad;
            assert!(matches!(mesh.validate(), Err(MeshError::NotFinite { vertex: 3, .. })));
        }
        let mut mesh = octahedron();
        mesh.positions[1].x = 1e20;
        assert!(matches!(mesh.validate(), Err(MeshError::TooFar { vertex: 1, .. })));
    }

    #[test]
    fn attributes_must_match_the_vertices() {
        let mut mesh = grid(1);
        mesh.uvs.push(Vec2::ZERO);
        assert!(matches!(mesh.validate(), Err(MeshError::AttributeLength { found: 5, expected: 4, .. })));
        let mut mesh = grid(1);
        mesh.material_slots = vec![0];
        assert!(matches!(mesh.validate(), Err(MeshError::AttributeLength { .. })));
    }

    #[test]
    fn degenerate_triangles_are_counted_and_kept() {
        let mut mesh = octahedron();
        mesh.triangles.push([0, 0, 1]);
        mesh.triangles.push([0, 1, 0]);
        assert_eq!(mesh.repair().expect("usable").degenerate_triangles, 2);
        assert_eq!(mesh.triangles.len(), 10);
        mesh.positions.iter_mut().for_each(|p| *p *= 1e-20);
        assert_eq!(mesh.validate().expect("usable").degenerate_triangles, 2);
    }

    #[test]
    fn bad_normals_are_replaced_and_counted() {
        let mut mesh = octahedron();
        mesh.compute_smooth_normals();
        mesh.normals[0] = Vec3::ZERO;
        mesh.normals[2] = Vec3::NAN;
        mesh.normals[4] = Vec3::new(0.0, 0.0, 1e30);
        let flaws = mesh.repair().expect("usable");
        assert_eq!(flaws.bad_normals, 3);
        assert!((mesh.normals[0] - Vec3::X).length() < 1e-6);
        assert!((mesh.normals[2] - Vec3::Y).length() < 1e-6);
        assert!((mesh.normals[4] - Vec3::Z).length() < 1e-6);
        assert_eq!(flaws.sentences("it").len(), 1);
    }
}
