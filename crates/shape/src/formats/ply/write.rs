//! Writing PLY, binary, little-endian.

use std::io::{self, Write};
use std::path::Path;

use halflight_file::{SaveError, write_whole};

use crate::TriangleMesh;

/// Writes a mesh with its normals, texture coordinates and colours (as linear fractions); the file is whole or
/// absent. What PLY has no common name for, tangents and material slots, is left out. Reading it back gives
/// the same numbers, but for the rounding of turning v round.
///
/// # Errors
/// Whatever the file system says.
pub fn write_ply(path: &Path, mesh: &TriangleMesh) -> Result<(), SaveError> {
    write_whole(path, super::ASKED, |writer| write_to(writer, mesh))
}

fn write_to(writer: &mut impl Write, mesh: &TriangleMesh) -> io::Result<()> {
    writeln!(writer, "ply\nformat binary_little_endian 1.0\ncomment written by halflight")?;
    writeln!(writer, "element vertex {}", mesh.positions.len())?;
    let mut properties = vec!["x", "y", "z"];
    if !mesh.normals.is_empty() {
        properties.extend(["nx", "ny", "nz"]);
    }
    if !mesh.uvs.is_empty() {
        properties.extend(["s", "t"]);
    }
    if !mesh.colors.is_empty() {
        properties.extend(["red", "green", "blue"]);
    }
    for property in properties {
        writeln!(writer, "property float {property}")?;
    }
    writeln!(writer, "element face {}", mesh.triangles.len())?;
    writeln!(writer, "property list uchar uint vertex_indices\nend_header")?;
    let mut write_floats =
        |values: &[f32]| values.iter().try_for_each(|value| writer.write_all(&value.to_le_bytes()));
    for (i, position) in mesh.positions.iter().enumerate() {
        write_floats(&position.to_array())?;
        if let Some(normal) = mesh.normals.get(i) {
            write_floats(&normal.to_array())?;
        }
        if let Some(uv) = mesh.uvs.get(i) {
            write_floats(&[uv.x, 1.0 - uv.y])?;
        }
        if let Some(color) = mesh.colors.get(i) {
            write_floats(&color.to_array())?;
        }
    }
    for triangle in &mesh.triangles {
        writer.write_all(&[3])?;
        for vertex in triangle {
            writer.write_all(&vertex.to_le_bytes())?;
        }
    }
    Ok(())
}
