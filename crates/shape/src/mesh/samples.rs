//! Small meshes for tests.

use glam::{Vec2, Vec3};

use super::TriangleMesh;

/// A square of `n` × `n` cells over [0, 1]² at z = 0, facing +z; u follows x and v falls with y.
pub(crate) fn grid(n: u32) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    for j in 0..=n {
        for i in 0..=n {
            let (x, y) = (i as f32 / n as f32, j as f32 / n as f32);
            mesh.positions.push(Vec3::new(x, y, 0.0));
            mesh.uvs.push(Vec2::new(x, 1.0 - y));
        }
    }
    for j in 0..n {
        for i in 0..n {
            let a = j * (n + 1) + i;
            mesh.triangles.push([a, a + 1, a + n + 2]);
            mesh.triangles.push([a, a + n + 2, a + n + 1]);
        }
    }
    mesh
}

/// A closed unit octahedron with outward faces.
pub(crate) fn octahedron() -> TriangleMesh {
    TriangleMesh {
        positions: vec![Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z],
        triangles: vec![
            [0, 2, 4],
            [2, 1, 4],
            [1, 3, 4],
            [3, 0, 4],
            [2, 0, 5],
            [1, 2, 5],
            [3, 1, 5],
            [0, 3, 5],
        ],
        ..TriangleMesh::default()
    }
}
