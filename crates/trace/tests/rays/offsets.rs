//! Rays that leave a surface do not meet it where they left, and do not skip what is close.

use glam::{Affine3A, Quat, Vec3};

use halflight_shape::TriangleMesh;
use halflight_trace::{Geometry, Instance, MeshTracer, Motion, Ray, Simd, World};

use crate::common::{Numbers, placed, scaled, sphere, tracer};

/// Spawns rays outwards from hits on a convex mesh; counts those that meet it again. From outside of a convex body
/// no ray that goes outwards can.
fn false_hits(world: &World, centre: Vec3, radius: f32, count: usize) -> (usize, usize) {
    let mut numbers = Numbers(5);
    let (mut bad, mut asked) = (0, 0);
    for i in 0..count {
        let from = centre + numbers.direction() * (radius * 3.0);
        let towards = centre + numbers.in_cube() * (radius * 0.55);
        let ray = Ray::new(from, (towards - from).normalize());
        let Some(hit) = world.closest(&ray) else { continue };
        let surface = world.surface(&ray, &hit);
        let normal = surface.geometric_normal;
        let mut direction = numbers.direction();
        if direction.dot(normal) < 0.0 {
            direction = -direction;
        }
        // Every third ray nearly grazes.
        if i % 3 == 0 {
            direction = (direction - normal * direction.dot(normal) * 0.999).normalize();
        }
        asked += 1;
        if world.closest(&surface.spawn(direction, 0.0)).is_some() {
            bad += 1;
        }
    }
    (bad, asked)
}

#[test]
fn no_ray_meets_the_surface_it_left_at_any_scale() {
    for scale in [1e-3_f32, 1e-1, 1.0, 1e3, 1e5] {
        for levels in [0, 4] {
            for offset in [Vec3::ZERO, Vec3::new(30.0, -10.0, 70.0), Vec3::new(1e5, 3e4, -2e4)] {
                let offset = if scale < 1.0 { offset.min(Vec3::splat(100.0)) * 0.01 } else { offset };
                let world = World::build(
                    vec![Instance {
                        geometry: tracer(scaled(sphere(levels), scale, offset)),
                        transform: Motion::IDENTITY,
                    }],
                    Simd::detect(),
                );
                let (bad, asked) = false_hits(&world, offset, scale, 4000);
                assert!(asked > 2000);
                assert_eq!(bad, 0, "scale {scale}, {levels} levels, offset {offset}: {bad} of {asked}");
            }
        }
    }
}

#[test]
fn no_ray_meets_the_instance_it_left_at_any_scale() {
    for scale in [1e-3_f32, 1.0, 1e5] {
        for offset in [Vec3::ZERO, Vec3::new(200.0, 1.0, -50.0), Vec3::new(-1e5, 1e4, 3e4)] {
            if scale < 1.0 && offset.length() > 1000.0 {
                continue;
            }
            for local in [1e-2_f32, 1.0, 100.0] {
                let transform = Affine3A::from_scale_rotation_translation(
                    Vec3::splat(scale / local),
                    Quat::from_euler(glam::EulerRot::XYZ, 0.3, 1.2, -0.5),
                    offset,
                );
                let world = placed(scaled(sphere(3), local, Vec3::ZERO), transform, Simd::detect());
                let (bad, asked) = false_hits(&world, offset, scale, 3000);
                assert_eq!(bad, 0, "scale {scale}, local {local}, offset {offset}: {bad} of {asked}");
            }
        }
    }
}

fn quad(half: f32, height: f32, rotation: Quat) -> TriangleMesh {
    TriangleMesh {
        positions: [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, z)| rotation * Vec3::new(x * half, height, z * half))
            .to_vec(),
        triangles: vec![[0, 2, 1], [0, 3, 2]],
        ..TriangleMesh::default()
    }
}

/// Spawns rays from a quad to both sides of it and asserts that none meets it again.
fn assert_plane_is_left(world: &World, to_world: &Affine3A, half: f32, height: f32, what: &str) {
    let mut numbers = Numbers(8);
    let up = to_world.transform_vector3(Vec3::Y).normalize();
    let mut asked = 0;
    for i in 0..2000 {
        let foot = numbers.in_cube() * Vec3::new(half, 0.0, half) + Vec3::Y * height;
        let from = to_world.transform_point3(foot + (Vec3::Y + numbers.in_cube() * 0.7) * half);
        let foot = to_world.transform_point3(foot);
        let ray = Ray::new(from, (foot - from).normalize());
        let Some(hit) = world.closest(&ray) else { continue };
        let surface = world.surface(&ray, &hit);
        assert!(surface.geometric_normal.dot(up).abs() > 0.999, "{what}");
        let mut direction = numbers.direction();
        direction *= direction.dot(up).signum();
        if i % 2 == 0 {
            direction = (direction - up * (direction.dot(up) * 0.9999)).normalize();
        }
        asked += 1;
        // Upwards, and on the other side downwards.
        for direction in [direction, -direction] {
            assert_eq!(world.closest(&surface.spawn(direction, 0.0)), None, "{what}, {direction}");
        }
    }
    assert!(asked > 1000, "{what}: {asked}");
}

#[test]
fn no_ray_meets_the_plane_it_left() {
    let turns = [
        Quat::IDENTITY,
        Quat::from_rotation_x(std::f32::consts::FRAC_PI_2),
        Quat::from_rotation_z(1e-3),
        Quat::from_euler(glam::EulerRot::XYZ, 0.5, 0.2, 0.9),
    ];
    for turn in turns {
        for half in [1e-3_f32, 1.0, 10.0, 1e5] {
            // In planes through the origin, where the point's own rounding vanishes, and just beside them.
            for height in [0.0, 1e-6, 1e-3, 0.3, 10.0].map(|h| h * half) {
                let here = Affine3A::from_quat(turn);
                let world = placed(quad(half, height, turn), Affine3A::IDENTITY, Simd::detect());
                let what = format!("{turn}, half width {half}, height {height}");
                assert_plane_is_left(&world, &here, half, height, &what);
                for shift in [Vec3::ZERO, Vec3::new(0.0, -0.01, 0.0), Vec3::new(3.0, 0.0, -7.0)] {
                    let there = Affine3A::from_scale_rotation_translation(
                        Vec3::new(1.0, 2.0, 0.5),
                        turn,
                        shift * half,
                    );
                    let world = placed(quad(half, height, Quat::IDENTITY), there, Simd::detect());
                    assert_plane_is_left(&world, &there, half, height, &format!("{what}, moved by {shift}"));
                }
            }
        }
    }
}

#[test]
fn a_thin_gap_is_not_skipped() {
    // Two sheets of a metre, a hundredth of a millimetre apart: a ray from the lower one meets the upper one.
    for (half, gap) in [(0.5_f32, 1e-5_f32), (50.0, 1e-3), (5e-4, 1e-8)] {
        let world = World::build(
            vec![
                Instance { geometry: tracer(quad(half, 0.0, Quat::IDENTITY)), transform: Motion::IDENTITY },
                Instance { geometry: tracer(quad(half, gap, Quat::IDENTITY)), transform: Motion::IDENTITY },
            ],
            Simd::detect(),
        );
        let below = Ray::new(Vec3::new(0.1, -1.0, 0.05) * half, Vec3::Y);
        let hit = world.closest(&below).expect("the lower sheet is in the way");
        let surface = world.surface(&below, &hit);
        assert_eq!(hit.instance, 0);
        let next = world.closest(&surface.spawn(Vec3::Y, 0.0)).expect("the upper sheet is in the way");
        assert_eq!(next.instance, 1);
    }
}

#[test]
fn a_ray_to_a_point_ends_just_short_of_it() {
    let world = World::build(
        vec![
            Instance { geometry: tracer(quad(1.0, 0.0, Quat::IDENTITY)), transform: Motion::IDENTITY },
            Instance { geometry: tracer(quad(1.0, 2.0, Quat::IDENTITY)), transform: Motion::IDENTITY },
        ],
        Simd::detect(),
    );
    let down = Ray::new(Vec3::new(0.2, 1.0, 0.1), Vec3::NEG_Y);
    let hit = world.closest(&down).expect("the lower sheet is in the way");
    let lower = world.surface(&down, &hit);
    let to_upper = lower.spawn_to(Vec3::new(-0.3, 2.0, 0.4), 0.0);
    assert!(!world.occluded(&to_upper), "the point itself is not in its own way");
    assert!((to_upper.at(to_upper.t_max) - Vec3::new(-0.3, 2.0, 0.4)).length() < 1e-3);
    assert!(world.occluded(&lower.spawn_to(Vec3::new(-0.3, 2.1, 0.4), 0.0)), "what is before the point is");
    let up = Ray::new(Vec3::new(-0.3, 1.0, 0.4), Vec3::Y);
    let upper = world.surface(&up, &world.closest(&up).expect("the upper sheet is in the way"));
    assert!(!world.occluded(&lower.spawn_to_surface(&upper, 0.0)));
    assert_eq!(world.closest(&lower.spawn_to(lower.position, 0.0)), None, "a ray of no length meets nothing");
}

#[test]
fn shadow_rays_between_convex_bodies_far_from_the_origin_are_free() {
    let offset = Vec3::new(1e5, 2e4, -7e4);
    let geometry = std::sync::Arc::new(Geometry::Mesh(MeshTracer::build(std::sync::Arc::new(sphere(3)))));
    let at = |shift: Vec3| Instance {
        geometry: geometry.clone(),
        transform: Motion::fixed(Affine3A::from_translation(offset + shift)),
    };
    let world = World::build(vec![at(Vec3::ZERO), at(Vec3::X * 5.0)], Simd::detect());
    let mut numbers = Numbers(11);
    for _ in 0..2000 {
        // From a point halfway to one on each of the facing sides.
        let middle = offset + Vec3::X * 2.5;
        let mut pick = |side: f32| {
            let target = middle + Vec3::X * (2.5 * side) + numbers.in_cube() * 0.5;
            let ray = Ray::new(middle, (target - middle).normalize());
            world.closest(&ray).map(|hit| world.surface(&ray, &hit))
        };
        if let (Some(left), Some(right)) = (pick(-1.0), pick(1.0)) {
            let across = right.position - left.position;
            let facing = across
                .normalize()
                .dot(left.geometric_normal)
                .min(-across.normalize().dot(right.geometric_normal));
            if facing > 0.05 {
                assert!(!world.occluded(&left.spawn_to_surface(&right, 0.0)));
            }
        }
    }
}
