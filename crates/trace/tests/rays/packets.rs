//! Many rays at once are the same rays one at a time, to the last bit.

use glam::{Affine3A, Quat, Vec3};

use halflight_trace::{Hit, Instance, Motion, Ray, World};

use crate::common::{Numbers, levels, rays_around, soup, sphere, tracer};

/// Rays of a camera, in tiles of 8 × 8.
fn camera(eye: Vec3, target: Vec3, spread: f32, size: u32) -> Vec<Ray> {
    let forward = (target - eye).normalize();
    let right = forward.cross(Vec3::Y).normalize();
    let up = right.cross(forward);
    let mut rays = Vec::new();
    for tile in 0..(size / 8) * (size / 8) {
        for pixel in 0..64 {
            let x = (tile % (size / 8)) * 8 + pixel % 8;
            let y = (tile / (size / 8)) * 8 + pixel / 8;
            let at = |i: u32| ((i as f32 + 0.5) / size as f32 * 2.0 - 1.0) * spread;
            rays.push(Ray::new(eye, (forward + right * at(x) + up * at(y)).normalize()));
        }
    }
    rays
}

fn same(world: &World, rays: &[Ray]) -> usize {
    let mut hits = vec![None; rays.len()];
    let mut blocked = vec![false; rays.len()];
    world.closest_packet(rays, &mut hits);
    world.occluded_packet(rays, &mut blocked);
    let mut scattered = vec![false; rays.len()];
    world.occluded_scattered(rays, &mut scattered);
    assert_eq!(scattered, blocked, "{:?}", world.simd());
    for (i, ray) in rays.iter().enumerate() {
        let alone: Option<Hit> = world.closest(ray);
        assert_eq!(hits[i], alone, "{:?}: ray {i}, {ray:?}", world.simd());
        assert_eq!(blocked[i], world.occluded(ray), "{:?}: ray {i}, {ray:?}", world.simd());
    }
    hits.iter().flatten().count()
}

fn scenes() -> Vec<Vec<Instance>> {
    let ball = tracer(sphere(4));
    let mess = tracer(soup(4000, 0.1, 31));
    let at = |transform: Affine3A| Instance { geometry: ball.clone(), transform: Motion::fixed(transform) };
    let many = (0..9)
        .map(|i| {
            at(Affine3A::from_scale_rotation_translation(
                Vec3::new(0.3, 0.2 + 0.02 * i as f32, 0.3),
                Quat::from_rotation_z(i as f32),
                Vec3::new((i % 3) as f32 - 1.0, (i / 3) as f32 - 1.0, 0.1 * i as f32) * 0.6,
            ))
        })
        .chain([Instance { geometry: mess.clone(), transform: Motion::IDENTITY }])
        .collect();
    let doubled = vec![at(Affine3A::IDENTITY), at(Affine3A::IDENTITY)];
    let moving = vec![
        Instance {
            geometry: ball.clone(),
            transform: Motion::between(Affine3A::IDENTITY, Affine3A::from_translation(Vec3::X)),
        },
        Instance { geometry: mess.clone(), transform: Motion::IDENTITY },
    ];
    let one = vec![at(Affine3A::from_scale_rotation_translation(
        Vec3::splat(1.3),
        Quat::from_rotation_x(0.4),
        Vec3::Y,
    ))];
    vec![vec![Instance { geometry: mess, transform: Motion::IDENTITY }], one, many, doubled, moving, vec![]]
}

#[test]
fn coherent_rays_together_are_the_same_rays_alone() {
    for instances in scenes() {
        for simd in levels() {
            let world = World::build(instances.clone(), simd);
            for (eye, spread) in [
                (Vec3::new(0.0, 0.3, 4.0), 0.4),
                (Vec3::new(0.1, 0.05, 0.02), 1.0),
                (Vec3::new(9.0, 30.0, 9.0), 0.03),
            ] {
                let found = same(&world, &camera(eye, Vec3::new(0.02, 0.1, -0.03), spread, 64));
                assert!(instances.is_empty() || found > 100);
            }
        }
    }
}

#[test]
fn rays_in_any_order_and_number_are_the_same_rays_alone() {
    let mut numbers = Numbers(32);
    for instances in scenes() {
        for simd in levels() {
            let world = World::build(instances.clone(), simd);
            let mut rays = rays_around(777, 1.0, 33);
            // Ends, shadow rays to a point, axis-parallel bundles, and unusable rays among them.
            for (i, ray) in rays.iter_mut().enumerate() {
                if i % 7 == 0 {
                    ray.t_max = numbers.next() * 3.0;
                }
                if (128..256).contains(&i) {
                    *ray = Ray::new(Vec3::new(0.01 * i as f32 - 2.0, 0.02, 3.0), Vec3::NEG_Z);
                }
                if (256..384).contains(&i) {
                    let from = Vec3::new(0.3, -1.0, 0.2) + numbers.in_cube() * 0.1;
                    let way = Vec3::new(0.2, 4.0, 0.1) - from;
                    *ray = Ray { t_max: way.length() * 0.9999, ..Ray::new(from, way.normalize()) };
                }
                if i % 31 == 0 {
                    ray.direction = Vec3::ZERO;
                }
            }
            same(&world, &rays);
        }
    }
}

#[test]
fn a_packet_at_vertices_and_edges_is_the_same_rays_alone() {
    let mesh = sphere(3);
    let mut rays = Vec::new();
    let mut targets = mesh.positions.clone();
    targets.sort_by(|a, b| (a.z, a.x, a.y).partial_cmp(&(b.z, b.x, b.y)).expect("finite"));
    for &target in &targets {
        rays.push(Ray::new(Vec3::new(0.0, 0.0, 5.0), (target - Vec3::new(0.0, 0.0, 5.0)).normalize()));
    }
    for simd in levels() {
        let world = crate::common::world(mesh.clone(), simd);
        assert!(same(&world, &rays) > rays.len() / 2);
    }
}
