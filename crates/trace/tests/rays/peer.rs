//! Against the crate `obvhs`.

use obvhs::BvhBuildParams;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::{Ray as PeerRay, RayHit};
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;

use halflight_shape::TriangleMesh;

use crate::common::{levels, rays_around, soup, sphere, world};

fn check(mesh: TriangleMesh) {
    let corners = |i: usize| mesh.triangles[i].map(|v| glam::Vec3A::from(mesh.positions[v as usize]));
    let triangles: Vec<Triangle> = (0..mesh.triangles.len())
        .map(|i| {
            let [v0, v1, v2] = corners(i);
            Triangle { v0, v1, v2 }
        })
        .collect();
    let mut time = std::time::Duration::default();
    let bvh = build_cwbvh_from_tris(&triangles, BvhBuildParams::medium_build(), &mut time);
    let in_order: Vec<RtTriangle> =
        bvh.primitive_indices.iter().map(|&i| RtTriangle::from(&triangles[i as usize])).collect();
    // The peer divides by direction components of zero; `brute` covers those.
    let mut rays = rays_around(20_000, 1.0, 42);
    rays.retain(|ray| ray.direction.abs().min_element() > 0.0);
    for simd in levels() {
        let world = world(mesh.clone(), simd);
        let mut different = 0;
        for ray in &rays {
            let peer_ray = PeerRay::new_inf(ray.origin.into(), ray.direction.into());
            let mut found = RayHit::none();
            let hit = bvh.ray_traverse(peer_ray, &mut found, |ray, id| in_order[id].intersect(ray));
            match (hit, world.closest(ray)) {
                (true, Some(ours)) => {
                    different += usize::from((ours.t - found.t).abs() > 1e-3 * (1.0 + ours.t))
                }
                (false, None) => {}
                _ => different += 1,
            }
        }
        assert!(different * 1000 < rays.len(), "{simd:?}: {different} of {} rays differ", rays.len());
    }
}

#[test]
fn a_soup_answers_as_the_peer_does() {
    check(soup(20_000, 0.05, 41));
}

#[test]
fn a_sphere_answers_as_the_peer_does() {
    check(sphere(5));
}
