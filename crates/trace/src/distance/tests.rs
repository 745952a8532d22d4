use std::sync::Arc;

use glam::Affine3A;
use halflight_shape::TriangleMesh;

use super::*;
use crate::{Geometry, Instance, MeshTracer, Motion, Simd, Sphere, SphereTracer};

fn world(instances: Vec<Instance>) -> World {
    World::build(instances, Simd::detect())
}

fn ball(center: Vec3, radius: f32, motion: Motion) -> Instance {
    let tracer = SphereTracer::build(vec![Sphere { center, radius }]);
    Instance { geometry: Arc::new(Geometry::Spheres(tracer)), transform: motion }
}

fn numbers(n: usize) -> impl Iterator<Item = Vec3> {
    let part = |i: usize, a: f32| (i as f32 * a).fract();
    (0..n).map(move |i| Vec3::new(part(i, 0.754_877_7), part(i, 0.569_840_3), part(i, 0.430_159_7)))
}

#[test]
fn the_grid_never_says_more_than_the_truth_and_is_near_it() {
    let balls = [
        (Vec3::new(-1.0, 0.0, 0.3), 0.4),
        (Vec3::new(1.2, 0.5, -0.6), 0.7),
        (Vec3::new(0.1, -0.9, 0.2), 0.1),
    ];
    let world = world(balls.iter().map(|&(c, r)| ball(c, r, Motion::IDENTITY)).collect());
    let grid = DistanceGrid::build(&world, 96);
    for u in numbers(20_000) {
        let point = (u - 0.5) * 5.0;
        let truth = balls.iter().map(|(c, r)| (point.distance(*c) - r).abs()).fold(f32::INFINITY, f32::min);
        let said = grid.distance(point);
        assert!(said <= truth + 1e-5, "{point}: {said} > {truth}");
        // Inside the grid near the truth, outside at least the way to it.
        let (low, high) = world.bounds();
        if point.cmpge(low).all() && point.cmple(high).all() {
            assert!(said >= truth - 4.5 * grid.voxel() - 0.2 * truth, "{point}: {said} << {truth}");
        }
    }
    assert_eq!(grid.distance(Vec3::NAN), 0.0);
}

#[test]
fn triangles_are_as_near_as_they_are() {
    let mesh = TriangleMesh {
        positions: vec![Vec3::new(-1.0, 0.0, -1.0), Vec3::new(1.0, 0.2, -1.0), Vec3::new(0.0, 0.4, 1.0)],
        triangles: vec![[0, 1, 2]],
        ..TriangleMesh::default()
    };
    let corners = [0, 1, 2].map(|i| mesh.positions[i]);
    let geometry = Arc::new(Geometry::Mesh(MeshTracer::build(Arc::new(mesh))));
    let world = world(vec![Instance { geometry, transform: Motion::IDENTITY }]);
    let grid = DistanceGrid::build(&world, 64);
    // Points of the triangle itself: nothing is free there, and a point beside it is not further than they are.
    for u in numbers(2000) {
        let (a, b) = if u.x + u.y > 1.0 { (1.0 - u.x, 1.0 - u.y) } else { (u.x, u.y) };
        let on = corners[0] * (1.0 - a - b) + corners[1] * a + corners[2] * b;
        assert_eq!(grid.distance(on), 0.0, "{on}");
        let off = (u.z - 0.5) * 0.4;
        assert!(grid.distance(on + Vec3::Y * off) <= off.abs() + 1e-6);
    }
}

#[test]
fn what_moves_is_near_wherever_it_passes() {
    let motion = Motion::between(Affine3A::IDENTITY, Affine3A::from_translation(Vec3::new(2.0, 0.0, 0.0)));
    let grid = DistanceGrid::build(&world(vec![ball(Vec3::ZERO, 0.2, motion)]), 64);
    for i in 0..=100 {
        let center = Vec3::new(0.02 * i as f32, 0.0, 0.0);
        assert_eq!(grid.distance(center + Vec3::Y * 0.2), 0.0);
    }
}

#[test]
fn a_disc_about_a_ray_is_as_wide_as_near_misses_leave_it() {
    let near = ball(Vec3::new(0.0, 0.5, 0.0), 0.2, Motion::IDENTITY);
    let ends = [-2.0f32, 2.0].map(|x| ball(Vec3::new(x, 0.0, 0.0), 0.05, Motion::IDENTITY));
    let [left, right] = ends;
    let grid = DistanceGrid::build(&world(vec![near, left, right]), 256);
    let ray = Ray::new(Vec3::new(-1.95, 0.0, 0.0), Vec3::X);
    let (radius, t) = grid.open_disc(&ray, 0.0, 3.9);
    assert!(radius <= 0.3 && radius > 0.2, "{radius}");
    assert!((t - 1.95).abs() < 0.3, "{t}");
    assert_eq!(DistanceGrid::build(&world(Vec::new()), 64).distance(Vec3::ONE), f32::INFINITY);
}

#[test]
fn the_grid_of_a_part_of_a_world_is_as_right_within_it_and_finer() {
    let balls = [(Vec3::new(-1.0, 0.0, 0.3), 0.4), (Vec3::new(90.0, 0.5, -0.6), 0.7)];
    let world = world(balls.iter().map(|&(c, r)| ball(c, r, Motion::IDENTITY)).collect());
    let (low, high) = (Vec3::splat(-2.0), Vec3::splat(2.0));
    let grid = DistanceGrid::build_within(&world, low, high, 64);
    assert!(grid.voxel() < 0.07);
    for u in numbers(5000) {
        let point = (u - 0.5) * 4.0;
        let truth = (point.distance(balls[0].0) - balls[0].1).abs();
        let said = grid.distance(point);
        assert!(said <= truth + 1e-5 && said >= truth - 4.5 * grid.voxel() - 0.2 * truth, "{point}");
    }
}
