//! Meshes, random numbers and worlds for the tests.

use std::sync::Arc;

use glam::{Affine3A, Vec3};

use halflight_shape::TriangleMesh;
use halflight_trace::{Geometry, Instance, MeshTracer, Motion, Ray, Simd, World};

/// Random numbers from a counter (splitmix64).
pub(crate) struct Numbers(pub u64);

impl Numbers {
    pub(crate) fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((x ^ (x >> 31)) >> 40) as f32 / 16_777_216.0
    }

    pub(crate) fn in_cube(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next()) * 2.0 - 1.0
    }

    pub(crate) fn direction(&mut self) -> Vec3 {
        loop {
            let v = self.in_cube();
            if v.length_squared() > 1e-3 && v.length_squared() <= 1.0 {
                return v.normalize();
            }
        }
    }
}

/// An icosahedron divided `levels` times and pushed out to the unit sphere: closed, without a boundary.
pub(crate) fn sphere(levels: u32) -> TriangleMesh {
    let g = (1.0 + 5.0_f32.sqrt()) / 2.0;
    let mut positions: Vec<Vec3> = [
        (-1.0, g, 0.0),
        (1.0, g, 0.0),
        (-1.0, -g, 0.0),
        (1.0, -g, 0.0),
        (0.0, -1.0, g),
        (0.0, 1.0, g),
        (0.0, -1.0, -g),
        (0.0, 1.0, -g),
        (g, 0.0, -1.0),
        (g, 0.0, 1.0),
        (-g, 0.0, -1.0),
        (-g, 0.0, 1.0),
    ]
    .map(|(x, y, z)| Vec3::new(x, y, z).normalize())
    .to_vec();
    let mut triangles: Vec<[u32; 3]> = vec![
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    for _ in 0..levels {
        let mut middles = std::collections::HashMap::new();
        let mut next = Vec::new();
        for [a, b, c] in triangles {
            let mut middle = |p: u32, q: u32| {
                *middles.entry((p.min(q), p.max(q))).or_insert_with(|| {
                    positions.push((positions[p as usize] + positions[q as usize]).normalize());
                    positions.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            next.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        triangles = next;
    }
    TriangleMesh { positions, triangles, ..TriangleMesh::default() }
}

/// Triangles anywhere in the cube from −1 to 1, with edges of up to `size`.
pub(crate) fn soup(count: usize, size: f32, seed: u64) -> TriangleMesh {
    let mut numbers = Numbers(seed);
    let mut mesh = TriangleMesh::default();
    for i in 0..count as u32 {
        let corner = numbers.in_cube();
        mesh.positions.extend([corner, corner + numbers.in_cube() * size, corner + numbers.in_cube() * size]);
        mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    mesh
}

pub(crate) fn scaled(mut mesh: TriangleMesh, scale: f32, offset: Vec3) -> TriangleMesh {
    mesh.positions.iter_mut().for_each(|p| *p = *p * scale + offset);
    mesh
}

pub(crate) fn tracer(mesh: TriangleMesh) -> Arc<Geometry> {
    Arc::new(Geometry::Mesh(MeshTracer::build(Arc::new(mesh))))
}

pub(crate) fn world(mesh: TriangleMesh, simd: Simd) -> World {
    placed(mesh, Affine3A::IDENTITY, simd)
}

pub(crate) fn placed(mesh: TriangleMesh, transform: Affine3A, simd: Simd) -> World {
    World::build(vec![Instance { geometry: tracer(mesh), transform: Motion::fixed(transform) }], simd)
}

/// The levels of this machine.
pub(crate) fn levels() -> Vec<Simd> {
    [Simd::Baseline, Simd::Avx2, Simd::Avx512].into_iter().filter(|&level| level <= Simd::detect()).collect()
}

/// Rays from around a cube of half width `size` into it, some along an axis or with zero components.
pub(crate) fn rays_around(count: usize, size: f32, seed: u64) -> Vec<Ray> {
    let mut numbers = Numbers(seed);
    (0..count)
        .map(|i| {
            let origin = numbers.in_cube() * (2.0 * size);
            let mut direction = (numbers.in_cube() * size - origin).normalize_or(Vec3::X);
            match i % 10 {
                0 => direction = Vec3::new(direction.x, 0.0, direction.z).normalize_or(Vec3::Z),
                1 => direction = Vec3::Y * direction.y.signum(),
                2 => direction = Vec3::new(-0.0, direction.y, direction.z).normalize_or(Vec3::Z),
                _ => {}
            }
            Ray::new(origin, direction)
        })
        .collect()
}
