use std::sync::Arc;

use glam::{Affine3A, Quat, Vec2, Vec3};
use halflight_shape::{HeightField, TriangleMesh};

use super::*;
use crate::{HeightFieldTracer, Instance, MeshTracer, Motion, Simd, Sphere, SphereTracer};

const COLUMNS: usize = 150;
const ROWS: usize = 101;

/// A camera at `eye` that looks at `target`, a picture of an angle whose half has this tangent.
fn camera(eye: Vec3, target: Vec3, tangent: f32) -> RayGrid {
    let forward = (target - eye).normalize();
    let right = forward.cross(Vec3::Y).try_normalize().unwrap_or(Vec3::X);
    let (across, down) =
        (right * (2.0 * tangent / COLUMNS as f32), -right.cross(forward) * (2.0 * tangent / COLUMNS as f32));
    let corner = forward - across * (COLUMNS as f32 * 0.5 - 0.5) - down * (ROWS as f32 * 0.5 - 0.5);
    RayGrid { origin: eye, corner, across, down, columns: COLUMNS, rows: ROWS }
}

fn land(posts: [usize; 2], height: impl Fn(f32, f32) -> f32) -> Geometry {
    let heights = (0..posts[0] * posts[1]).map(|post| {
        let (x, z) = ((post % posts[0]) as f32 / posts[0] as f32, (post / posts[0]) as f32 / posts[1] as f32);
        height(20.0 * x - 10.0, 20.0 * z - 10.0)
    });
    let field =
        HeightField::new(posts[0], posts[1], Vec2::splat(-10.0), Vec2::splat(10.0), heights.collect());
    Geometry::HeightField(HeightFieldTracer::build(Arc::new(field.unwrap())))
}

fn hills(posts: [usize; 2]) -> Geometry {
    land(posts, |x, z| (1.3 * x).sin() * (0.9 * z).cos() + 0.3 * (5.0 * x + 2.0 * z).sin())
}

/// A ball of triangles of radius 1.
fn ball(rings: u32) -> Geometry {
    let around = 2 * rings;
    let mut mesh = TriangleMesh::default();
    for ring in 0..=rings {
        for step in 0..=around {
            let (theta, phi) = (
                ring as f32 / rings as f32 * std::f32::consts::PI,
                (step % around) as f32 / around as f32 * std::f32::consts::TAU,
            );
            mesh.positions.push(Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()));
        }
    }
    let at = |ring: u32, step: u32| ring * (around + 1) + step;
    for ring in 0..rings {
        for step in 0..around {
            mesh.triangles.push([at(ring, step), at(ring + 1, step), at(ring + 1, step + 1)]);
            mesh.triangles.push([at(ring, step), at(ring + 1, step + 1), at(ring, step + 1)]);
        }
    }
    Geometry::Mesh(MeshTracer::build(Arc::new(mesh)))
}

fn floor(half: f32) -> Geometry {
    let corner = |x: f32, z: f32| Vec3::new(half * x, -1.7, half * z);
    let positions = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    let mesh = TriangleMesh { positions, triangles: vec![[0, 2, 1], [0, 3, 2]], ..TriangleMesh::default() };
    Geometry::Mesh(MeshTracer::build(Arc::new(mesh)))
}

fn spheres() -> Geometry {
    Geometry::Spheres(SphereTracer::build(vec![Sphere { center: Vec3::new(0.0, 2.0, 1.0), radius: 0.7 }]))
}

/// Spheres side by side and within one another, large, small, and none at all.
fn many_spheres() -> Geometry {
    let sphere = |i: u32| {
        let at = |step: f32| (i as f32 * step).fract();
        let center = Vec3::new(8.0 * at(0.618) - 4.0, 2.0 * at(0.414), 8.0 * at(0.732) - 4.0);
        Sphere { center, radius: if i % 50 == 7 { -1.0 } else { 0.02 + 0.4 * at(0.317) } }
    };
    Geometry::Spheres(SphereTracer::build((0..300).map(sphere).collect()))
}

fn placed(geometry: Geometry, at: Vec3, turned: f32, scale: Vec3) -> Instance {
    let transform = Affine3A::from_scale_rotation_translation(scale, Quat::from_rotation_y(turned), at);
    Instance { geometry: Arc::new(geometry), transform: Motion::fixed(transform) }
}

fn hits_of(world: &World, grid: &RayGrid, rows_at_once: usize) -> (Vec<Option<Hit>>, bool) {
    let tracer = world.grid(*grid);
    let mut hits = vec![None; grid.columns * grid.rows];
    let mut room = GridRows::default();
    for (band, hits) in hits.chunks_mut(grid.columns * rows_at_once).enumerate() {
        tracer.rows(band * rows_at_once, &mut room, hits);
    }
    (hits, tracer.by_rays)
}

/// Rays for which the grid finds something else than the ray alone: nothing instead of something or the other way
/// round, and a hit at another place.
fn differences(world: &World, grid: &RayGrid) -> (usize, usize) {
    let (hits, by_rays) = hits_of(world, grid, 16);
    assert!(!by_rays);
    let (mut other, mut elsewhere, mut seen) = (0, 0, 0);
    for (place, found) in hits.iter().enumerate() {
        let ray = grid.ray(place % grid.columns, place / grid.columns);
        let truth = world.closest(&ray);
        seen += usize::from(truth.is_some());
        match (found, truth) {
            (None, None) => {}
            (Some(found), Some(truth)) => {
                let apart = (found.t - truth.t).abs() > 1e-4 * truth.t || found.instance != truth.instance;
                let surfaces = [world.surface(&ray, found), world.surface(&ray, &truth)];
                let normals = surfaces[0].geometric_normal.dot(surfaces[1].geometric_normal) > 0.9;
                elsewhere += usize::from(apart || !normals);
            }
            _ => other += 1,
        }
    }
    assert!(seen > 1000, "the view shows something: {seen}");
    (other, elsewhere)
}

/// The views of a test: from above, along the ground, from between, and from within.
fn views() -> [RayGrid; 5] {
    [
        camera(Vec3::new(4.0, 6.0, 9.0), Vec3::ZERO, 0.5),
        camera(Vec3::new(-9.0, 1.5, 0.5), Vec3::new(9.0, 1.0, 0.0), 0.7),
        camera(Vec3::new(0.3, 1.9, 0.2), Vec3::new(3.0, 0.0, -4.0), 1.5),
        camera(Vec3::new(0.5, 30.0, 0.1), Vec3::ZERO, 0.3),
        camera(Vec3::new(200.0, 90.0, 300.0), Vec3::ZERO, 0.03),
    ]
}

#[test]
fn the_grid_finds_what_its_rays_find() {
    let worlds = [
        vec![placed(hills([97, 130]), Vec3::ZERO, 0.0, Vec3::ONE)],
        vec![
            placed(hills([60, 33]), Vec3::new(0.3, -0.2, 0.1), 0.4, Vec3::new(1.0, 0.8, 1.2)),
            placed(ball(20), Vec3::new(1.0, 1.0, 0.0), 0.0, Vec3::new(1.0, 1.5, 0.7)),
            placed(ball(9), Vec3::new(-2.0, 0.7, -3.0), 1.0, Vec3::ONE),
            placed(spheres(), Vec3::ZERO, 0.0, Vec3::ONE),
            placed(floor(400.0), Vec3::ZERO, 0.2, Vec3::ONE),
        ],
        vec![
            placed(floor(5.0), Vec3::ZERO, 0.0, Vec3::ONE),
            placed(ball(40), Vec3::ZERO, 0.0, Vec3::splat(2.0)),
        ],
        vec![
            placed(many_spheres(), Vec3::ZERO, 0.0, Vec3::ONE),
            placed(many_spheres(), Vec3::new(0.5, 0.3, -0.2), 1.1, Vec3::splat(1.7)),
            placed(floor(5.0), Vec3::ZERO, 0.0, Vec3::ONE),
        ],
    ];
    for (number, instances) in worlds.into_iter().enumerate() {
        for simd in [Simd::Baseline, Simd::detect()] {
            let world = World::build(instances.clone(), simd);
            for (view, grid) in views().iter().enumerate() {
                let (other, elsewhere) = differences(&world, grid);
                // What is left are rays within a rounding of a silhouette.
                assert!(other <= 2 && elsewhere <= 6, "world {number}, view {view}: {other}, {elsewhere}");
            }
        }
    }
}

#[test]
fn ground_far_larger_than_the_height_of_the_eye_is_there() {
    for half in [1e5, 1e6, 1e7] {
        for height in [0.05, 0.5, 1.7] {
            let world = World::build(
                vec![placed(floor(half), Vec3::new(0.0, 1.7, 0.0), 0.3, Vec3::ONE)],
                Simd::detect(),
            );
            let grid = camera(Vec3::new(0.0, height, 0.0), Vec3::new(0.0, 0.0, -height), 0.8);
            let hits = hits_of(&world, &grid, 16).0;
            // The lowest rays look at the ground just before the eye.
            for (i, hit) in hits[COLUMNS * (ROWS / 2)..].iter().enumerate() {
                let hit = hit.unwrap_or_else(|| panic!("{half}, {height}: ray {i} sees no ground"));
                let ray = grid.ray(i % COLUMNS, ROWS / 2 + i / COLUMNS);
                assert!((ray.at(hit.t).y).abs() < 1e-3 * hit.t, "{half}, {height}: {}", ray.at(hit.t));
            }
        }
    }
}

#[test]
fn hits_lie_on_their_rays() {
    let world = World::build(
        vec![
            placed(hills([97, 130]), Vec3::ZERO, 0.0, Vec3::ONE),
            placed(ball(20), Vec3::new(1.0, 1.0, 0.0), 0.0, Vec3::new(1.0, 1.5, 0.7)),
        ],
        Simd::detect(),
    );
    for grid in views() {
        let (hits, _) = hits_of(&world, &grid, 7);
        for (place, hit) in hits.iter().enumerate() {
            let Some(hit) = hit else { continue };
            let ray = grid.ray(place % grid.columns, place / grid.columns);
            let surface = world.surface(&ray, hit);
            let between_rays = hit.t * grid.across.length();
            let off = surface.position.distance(ray.at(hit.t));
            assert!(off < 2e-3 * between_rays + 1e-5 * hit.t, "{place}: {hit:?} {off} {between_rays}");
        }
    }
}

#[test]
fn points_side_by_side_are_those_of_surfaces() {
    let mut steep = land([40, 57], |x, z| 3.0 * (2.0 * x).sin() + if z > 3.0 { 1e4 * z } else { 0.0 });
    let Geometry::HeightField(field) = &steep else { unreachable!() };
    let faceted = HeightField { smooth: false, ..(**field.field()).clone() };
    steep = Geometry::HeightField(HeightFieldTracer::build(Arc::new(faceted)));
    for instances in [
        vec![
            placed(hills([97, 130]), Vec3::ZERO, 0.0, Vec3::ONE),
            placed(spheres(), Vec3::ZERO, 0.0, Vec3::ONE),
        ],
        vec![
            placed(hills([60, 33]), Vec3::new(0.3, -0.2, 0.1), 0.4, Vec3::new(1.0, 0.8, -1.2)),
            placed(ball(20), Vec3::new(1.0, 1.0, 0.0), 0.0, Vec3::new(1.0, 1.5, 0.7)),
        ],
        vec![placed(steep, Vec3::ZERO, 0.3, Vec3::ONE)],
        vec![
            placed(many_spheres(), Vec3::ZERO, 0.0, Vec3::ONE),
            placed(floor(5.0), Vec3::ZERO, 0.0, Vec3::ONE),
        ],
    ] {
        let world = World::build(instances, Simd::detect());
        for grid in views() {
            let tracer = world.grid(grid);
            let (top, mut hits, mut points) = (30, vec![None; COLUMNS * 40], GridPoints::default());
            tracer.rows(top, &mut GridRows::default(), &mut hits);
            tracer.points(top, &hits, &mut points);
            for (i, hit) in hits.iter().enumerate() {
                let Some(hit) = hit else { continue };
                let surface = world.surface(&grid.ray(i % COLUMNS, top + i / COLUMNS), hit);
                let far = 1e-6 * surface.position.abs().max_element().max(1.0);
                assert!(points.position(i).distance(surface.position) < far, "{i}");
                assert!(points.geometric_normal(i).distance(surface.geometric_normal) < 1e-5, "{i}");
                assert!(points.shading_normal(i).distance(surface.shading_normal) < 1e-4, "{i}");
                assert_eq!(points.material_slot[i], surface.material_slot);
            }
        }
    }
}

#[test]
fn rows_may_be_asked_for_in_any_number_at_once() {
    let instances = vec![
        placed(hills([97, 130]), Vec3::ZERO, 0.0, Vec3::ONE),
        placed(spheres(), Vec3::ZERO, 0.0, Vec3::ONE),
    ];
    let world = World::build(instances, Simd::detect());
    let grid = views()[0];
    let all = hits_of(&world, &grid, ROWS).0;
    for rows in [1, 8, 50] {
        assert_eq!(hits_of(&world, &grid, rows).0, all);
    }
}

#[test]
fn many_small_things_and_dense_meshes_are_left_to_rays() {
    let grid = views()[0];
    let one = |at: f32| placed(Geometry::Disk(crate::Disk), Vec3::new(at, 1.5, 0.0), 0.5, Vec3::splat(0.3));
    let world = World::build((0..40).map(|i| one(i as f32 * 0.3)).collect(), Simd::detect());
    let (hits, by_rays) = hits_of(&world, &grid, 16);
    assert!(by_rays);
    for (place, hit) in hits.iter().enumerate() {
        assert_eq!(*hit, world.closest(&grid.ray(place % COLUMNS, place / COLUMNS)));
    }
    let world = World::build(vec![placed(hills([400, 400]), Vec3::ZERO, 0.0, Vec3::ONE)], Simd::detect());
    let tracer = world.grid(grid);
    assert!(tracer.pieces.is_empty() && tracer.traced.len() == 1);
    let hits = hits_of(&world, &grid, 16).0;
    for (place, hit) in hits.iter().enumerate() {
        let truth = world.closest(&grid.ray(place % COLUMNS, place / COLUMNS));
        assert_eq!(hit.map(|hit| hit.primitive), truth.map(|hit| hit.primitive));
    }
}

#[test]
fn a_world_of_nothing_and_a_grid_without_extent_show_nothing() {
    let empty = World::build(Vec::new(), Simd::detect());
    assert!(hits_of(&empty, &views()[0], 16).0.iter().all(Option::is_none));
    let world = World::build(vec![placed(hills([20, 20]), Vec3::ZERO, 0.0, Vec3::ONE)], Simd::detect());
    let flat = RayGrid { across: Vec3::ZERO, ..views()[0] };
    // All rays of a row are one: traced, they still answer.
    let (hits, by_rays) = hits_of(&world, &flat, 16);
    assert!(by_rays && hits.iter().flatten().count() > 0);
}
