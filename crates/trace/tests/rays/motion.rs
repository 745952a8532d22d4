//! A moving world at a time is the still world of that time.

use std::sync::Arc;

use glam::{Affine3A, Quat, Vec3};

use halflight_trace::{Geometry, Instance, MeshTracer, Motion, Ray, World};

use crate::common::{levels, rays_around, soup, sphere, tracer};

fn agree(moving: &World, still: &World, rays: &[Ray], time: f32) {
    let mut different = 0;
    for ray in rays {
        let ray = Ray { time, ..*ray };
        match (moving.closest(&ray), still.closest(&ray)) {
            (Some(a), Some(b)) => {
                different += usize::from(a.primitive != b.primitive || a.instance != b.instance);
                if a.primitive == b.primitive && a.instance == b.instance {
                    assert!((a.t - b.t).abs() < 1e-4 * (1.0 + b.t), "{a:?} {b:?}");
                    let (a, b) = (moving.surface(&ray, &a), still.surface(&ray, &b));
                    assert!((a.position - b.position).length() < 1e-4 * (1.0 + b.position.length()));
                    assert!((a.geometric_normal - b.geometric_normal).length() < 1e-2);
                }
            }
            (None, None) => {}
            _ => different += 1,
        }
        assert_eq!(moving.occluded(&ray), moving.closest(&ray).is_some());
    }
    assert!(different * 200 < rays.len(), "{different} of {} rays differ at time {time}", rays.len());
}

#[test]
fn a_deforming_mesh_at_a_time_is_the_mesh_of_that_time() {
    let open = soup(2000, 0.1, 21);
    let close: Vec<Vec3> =
        open.positions.iter().map(|p| Vec3::new(p.x + 0.5, p.y * 1.3 - 0.2 * p.z, p.z + 0.1 * p.x)).collect();
    for simd in levels() {
        let tracer = MeshTracer::build_moving(Arc::new(open.clone()), close.clone());
        assert!(tracer.is_moving());
        let moving = World::build(vec![Instance::at_origin(Geometry::Mesh(tracer))], simd);
        for time in [0.0, 0.3, 1.0] {
            let mut mesh = open.clone();
            for (p, q) in mesh.positions.iter_mut().zip(&close) {
                *p = *p * (1.0 - time) + *q * time;
            }
            let still = World::build(
                vec![Instance::at_origin(Geometry::Mesh(MeshTracer::build(Arc::new(mesh))))],
                simd,
            );
            agree(&moving, &still, &rays_around(1500, 1.5, 22), time);
        }
    }
}

#[test]
fn refitting_a_moving_mesh_makes_it_move_otherwise() {
    let open = Arc::new(soup(500, 0.2, 23));
    let mut tracer = MeshTracer::build(open.clone());
    let close: Vec<Vec3> = open.positions.iter().map(|p| *p + Vec3::X).collect();
    tracer.refit(open.clone(), Some(close.clone()));
    let refitted = World::build(vec![Instance::at_origin(Geometry::Mesh(tracer.clone()))], levels()[0]);
    let built = World::build(
        vec![Instance::at_origin(Geometry::Mesh(MeshTracer::build_moving(open.clone(), close)))],
        levels()[0],
    );
    agree(&refitted, &built, &rays_around(800, 1.5, 24), 0.7);
    tracer.refit(open.clone(), None);
    assert!(!tracer.is_moving());
}

#[test]
fn moving_instances_at_a_time_are_still_ones_of_that_time() {
    let ball = tracer(sphere(2));
    let motions: Vec<Motion> = (0..12)
        .map(|i| {
            let at = Vec3::new((i % 4) as f32 - 1.5, (i / 4) as f32 - 1.0, 0.2 * i as f32 - 1.0);
            let open = Affine3A::from_scale_rotation_translation(
                Vec3::splat(0.3),
                Quat::from_rotation_y(i as f32),
                at,
            );
            let to = Affine3A::from_scale_rotation_translation(
                Vec3::new(0.2, 0.4, 0.3),
                Quat::from_rotation_y(i as f32 + 0.5),
                at + Vec3::new(0.5, -0.3, 0.2 * i as f32),
            );
            if i % 3 == 0 { Motion::fixed(open) } else { Motion::between(open, to) }
        })
        .collect();
    for simd in levels() {
        let world_of = |motions: Vec<Motion>| {
            let instances =
                motions.into_iter().map(|transform| Instance { geometry: ball.clone(), transform });
            World::build(instances.collect(), simd)
        };
        let moving = world_of(motions.clone());
        for time in [0.0, 0.45, 1.0] {
            let still = world_of(motions.iter().map(|motion| Motion::fixed(motion.at(time))).collect());
            agree(&moving, &still, &rays_around(2000, 2.0, 25), time);
        }
    }
}

#[test]
fn instances_that_cannot_be_met_are_passed_over() {
    let ball = tracer(sphere(1));
    let flat = Affine3A::from_scale(Vec3::new(1.0, 0.0, 1.0));
    let nan = Affine3A::from_translation(Vec3::splat(f32::NAN));
    for simd in levels() {
        let instances = vec![
            Instance { geometry: ball.clone(), transform: Motion::fixed(flat) },
            Instance { geometry: ball.clone(), transform: Motion::fixed(nan) },
            Instance { geometry: ball.clone(), transform: Motion::between(Affine3A::IDENTITY, flat) },
            Instance {
                geometry: ball.clone(),
                transform: Motion::fixed(Affine3A::from_translation(Vec3::X * 4.0)),
            },
            Instance { geometry: tracer(Default::default()), transform: Motion::IDENTITY },
        ];
        let world = World::build(instances, simd);
        assert_eq!(world.instances().len(), 5);
        assert_eq!(world.closest(&Ray::new(Vec3::Z * 3.0, Vec3::NEG_Z)), None);
        let hit = world
            .closest(&Ray::new(Vec3::new(4.0, 0.0, 3.0), Vec3::NEG_Z))
            .expect("the good one is in the way");
        assert_eq!(hit.instance, 3);
        // A turn by half a circle is singular halfway: no answer then, and no NaN.
        let turning =
            Motion::between(Affine3A::from_scale(Vec3::ONE), Affine3A::from_rotation_y(std::f32::consts::PI));
        let world = World::build(vec![Instance { geometry: ball.clone(), transform: turning }], simd);
        let ray = Ray { time: 0.5, ..Ray::new(Vec3::Z * 3.0, Vec3::NEG_Z) };
        assert!(world.closest(&ray).is_none_or(|hit| hit.t.is_finite()));
    }
}
