//! What a picture of a height field costs, by the grid of its rays and by tracing them one block after another.
//!
//! `cargo run --release -p halflight-trace --example grid_rate`

use std::sync::Arc;
use std::time::Instant;

use glam::{Vec2, Vec3};
use halflight_shape::HeightField;
use halflight_trace::{Geometry, GridRows, HeightFieldTracer, Hit, Instance, Ray, RayGrid, Simd, World};
use rayon::prelude::*;

const COLUMNS: usize = 960;
const ROWS: usize = 540;
const BAND: usize = 16;

/// Rolling land of `posts` × `posts` posts, 24 metres wide.
fn land(posts: usize) -> World {
    let height = |post: usize| {
        let at = |i: usize| i as f32 / posts as f32 * 24.0 - 12.0;
        let (x, z) = (at(post % posts), at(post / posts));
        0.2 * (0.9 * x + 0.35 * z).sin()
            + 0.13 * (1.3 * z - 0.7 * x + 2.1).sin()
            + 0.06 * (2.3 * x - 1.1 * z).sin()
    };
    let heights = (0..posts * posts).map(height).collect();
    let field = HeightField::new(posts, posts, Vec2::splat(-12.0), Vec2::splat(12.0), heights)
        .expect("finite heights");
    let tracer = HeightFieldTracer::build(Arc::new(field));
    World::build(vec![Instance::at_origin(Geometry::HeightField(tracer))], Simd::detect())
}

fn view() -> RayGrid {
    let (eye, target) = (Vec3::new(1.1, 2.85, 6.15), Vec3::new(0.1, 0.72, 0.0));
    let forward = (target - eye).normalize();
    let right = forward.cross(Vec3::Y).normalize();
    let step = 2.0 * 16f32.to_radians().tan() / ROWS as f32;
    let (across, down) = (right * step, -right.cross(forward) * step);
    let corner = forward - across * (COLUMNS as f32 / 2.0) - down * (ROWS as f32 / 2.0);
    RayGrid { origin: eye, corner, across, down, columns: COLUMNS, rows: ROWS }
}

/// The least milliseconds of five.
fn least(mut work: impl FnMut() -> usize) -> (f64, usize) {
    let mut best = (f64::INFINITY, 0);
    for _ in 0..5 {
        let begun = Instant::now();
        let found = work();
        best = (best.0.min(1e3 * begun.elapsed().as_secs_f64()), found);
    }
    best
}

fn main() {
    println!("{COLUMNS} × {ROWS} rays, {} threads; milliseconds", rayon::current_num_threads());
    let grid = view();
    for posts in [128, 256, 512, 768] {
        let world = land(posts);
        let mut hits: Vec<Option<Hit>> = vec![None; COLUMNS * ROWS];
        let (rasterised, seen) = least(|| {
            let tracer = world.grid(grid);
            hits.par_chunks_mut(COLUMNS * BAND).enumerate().for_each_init(
                GridRows::default,
                |room, (band, hits)| {
                    tracer.rows(band * BAND, room, hits);
                },
            );
            hits.iter().flatten().count()
        });
        let (traced, _) = least(|| {
            hits.par_chunks_mut(COLUMNS).enumerate().for_each(|(y, hits)| {
                let rays: Vec<Ray> = (0..COLUMNS).map(|x| grid.ray(x, y)).collect();
                world.closest_packet(&rays, hits);
            });
            hits.iter().flatten().count()
        });
        println!("{posts}² posts, {seen} hits: grid {rasterised:.1}, traced {traced:.1}");
    }
}
