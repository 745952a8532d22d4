//! From lists of numbers to vertices and triangles.

use super::parse::{Corner, NONE, Parsed};
use crate::TriangleMesh;
use crate::formats::polygon::triangulate;

/// The mesh, and how many faces have fewer than three corners.
pub(super) fn assemble(parsed: &Parsed) -> (TriangleMesh, usize) {
    let mut vertices = Vertices::new(parsed);
    let mut triangles = Vec::with_capacity(parsed.face_ends.len());
    let mut slots = Vec::new();
    let several = parsed.material_names.len() > 1;
    let (mut places, mut cut) = (Vec::new(), Vec::new());
    let (mut start, mut left_out) = (0, 0);
    let mut runs = parsed.runs.iter().peekable();
    let mut slot = 0;
    for (face, &end) in parsed.face_ends.iter().enumerate() {
        while let Some((_, next)) = runs.next_if(|(first, _)| *first <= face) {
            slot = *next;
        }
        let corners = &parsed.corners[start..end as usize];
        start = end as usize;
        if corners.len() < 3 {
            left_out += 1;
            continue;
        }
        cut.clear();
        if corners.len() == 3 {
            cut.push([0, 1, 2]);
        } else {
            places.clear();
            places.extend(corners.iter().map(|c| parsed.positions[c[0] as usize]));
            triangulate(&places, &mut cut);
        }
        triangles.extend(cut.iter().map(|t| t.map(|i| vertices.index(corners[i]))));
        if several {
            slots.resize(triangles.len(), slot);
        }
    }
    let mut mesh = vertices.finish();
    mesh.triangles = triangles;
    mesh.material_slots = slots;
    (mesh, left_out)
}

/// Vertices made of the combinations that occur.
struct Vertices<'a> {
    parsed: &'a Parsed,
    /// Whether a corner is more than its position.
    combined: bool,
    /// For each position the last vertex made of it.
    last_of_position: Vec<u32>,
    /// For each vertex the corner it was made of, and the vertex made of the same position before.
    made: Vec<(Corner, u32)>,
}

impl<'a> Vertices<'a> {
    fn new(parsed: &'a Parsed) -> Self {
        let combined = parsed.corners.iter().any(|[_, uv, normal]| *uv != NONE || *normal != NONE);
        let positions = if combined { parsed.positions.len() } else { 0 };
        Self { parsed, combined, last_of_position: vec![NONE; positions], made: Vec::new() }
    }

    fn index(&mut self, corner: Corner) -> u32 {
        if !self.combined {
            return corner[0];
        }
        let head = &mut self.last_of_position[corner[0] as usize];
        let mut vertex = *head;
        while let Some((known, before)) = self.made.get(vertex as usize) {
            if *known == corner {
                return vertex;
            }
            vertex = *before;
        }
        let new = self.made.len() as u32;
        self.made.push((corner, *head));
        *head = new;
        new
    }

    fn finish(self) -> TriangleMesh {
        let parsed = self.parsed;
        if !self.combined {
            return TriangleMesh {
                positions: parsed.positions.clone(),
                colors: parsed.colors.clone(),
                ..TriangleMesh::default()
            };
        }
        let gather = |kind: usize| self.made.iter().map(move |(corner, _)| corner[kind]);
        let optional = |kind: usize| gather(kind).any(|index| index != NONE);
        TriangleMesh {
            positions: gather(0).map(|i| parsed.positions[i as usize]).collect(),
            colors: if parsed.colors.is_empty() {
                Vec::new()
            } else {
                gather(0).map(|i| parsed.colors[i as usize]).collect()
            },
            uvs: if optional(1) { pick(&parsed.uvs, gather(1)) } else { Vec::new() },
            // Normals of no length are replaced when the mesh is repaired.
            normals: if optional(2) { pick(&parsed.normals, gather(2)) } else { Vec::new() },
            ..TriangleMesh::default()
        }
    }
}

fn pick<T: Copy + Default>(values: &[T], indices: impl Iterator<Item = u32>) -> Vec<T> {
    indices.map(|i| values.get(i as usize).copied().unwrap_or_default()).collect()
}
