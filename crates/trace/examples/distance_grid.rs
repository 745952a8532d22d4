//! What a distance grid costs: a million triangles at three resolutions.

use std::sync::Arc;
use std::time::Instant;

use glam::Vec3;
use halflight_trace::{DistanceGrid, Geometry, Instance, MeshTracer, Motion, Simd, World};

fn main() {
    let mesh = halflight_shape::procedural::mesh::ico_sphere(1.0, 8);
    let triangles = mesh.triangles.len();
    let geometry = Arc::new(Geometry::Mesh(MeshTracer::build(Arc::new(mesh))));
    let world = World::build(vec![Instance { geometry, transform: Motion::IDENTITY }], Simd::detect());
    for resolution in [64, 128, 256] {
        let start = Instant::now();
        let grid = DistanceGrid::build(&world, resolution);
        let built = start.elapsed().as_secs_f64();
        let start = Instant::now();
        let mut sum = 0.0;
        for i in 0..1_000_000u32 {
            let part = |k: u32| (i.wrapping_mul(k) >> 8) as f32 / (1u32 << 23) as f32 - 1.0;
            sum += grid.distance(Vec3::new(part(0x9e37_79b9), part(0x85eb_ca6b), part(0xc2b2_ae35)));
        }
        println!(
            "{triangles} triangles, {resolution} voxels: {built:.2} s, {:.1} MB, {:.0} ns a query ({sum:.0})",
            grid.memory_bytes() as f64 / 1e6,
            start.elapsed().as_secs_f64() * 1e3
        );
    }
}
