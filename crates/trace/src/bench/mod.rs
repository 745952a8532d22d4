//! How fast rays are: plain numbers for programs that print them.
//!
//! Three sets of rays on a mesh: *primary*, the 1024² rays of a camera in tiles of 8 × 8 pixels; *random*, from a sphere
//! of twice the mesh's radius to points in the ball around it; *bounce*, cosine-distributed around the normal where the
//! primary rays hit. Rates count rays by the processor time of the threads that trace them, so that other work on the
//! machine disturbs them little. The sets depend on nothing but the mesh, and can be written to files for other ray
//! tracers to be timed on (`tools/peers`).

mod clock;
mod rays;

use std::sync::Arc;

use halflight_shape::TriangleMesh;

use crate::{Geometry, Hit, Instance, MeshTracer, Ray, RayGeometry, Simd, World};
pub use clock::{cpu_seconds_of_process, cpu_seconds_of_thread};
pub use rays::{View, bounce_rays, primary_rays, random_rays};

/// What is asked of each ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Question {
    /// The nearest hit, one ray at a time.
    Closest,
    /// The nearest hit, 1024 rays at a time.
    ClosestPacket,
    /// Any hit, one ray at a time.
    Occluded,
    /// Any hit, 1024 rays at a time.
    OccludedPacket,
}

impl Question {
    /// All of them.
    pub const ALL: [Question; 4] =
        [Question::Closest, Question::ClosestPacket, Question::Occluded, Question::OccludedPacket];

    /// A name for tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Question::Closest => "closest",
            Question::ClosestPacket => "closest-together",
            Question::Occluded => "any",
            Question::OccludedPacket => "any-together",
        }
    }
}

/// One measurement.
#[derive(Clone, Copy, Debug)]
pub struct Rate {
    /// Million rays for each second of processor time, median of the runs.
    pub mrays_per_cpu_second: f64,
    /// Million rays for each second of the clock on the wall, median of the runs.
    pub mrays_per_wall_second: f64,
    /// Part of the rays that hit something.
    pub hit_fraction: f64,
    /// Mean distance of the hits (0 for [`Question::Occluded`]).
    pub mean_distance: f64,
}

/// Time and memory that a tree takes.
#[derive(Clone, Copy, Debug)]
pub struct BuildCost {
    /// Wall seconds to build, median of the runs.
    pub build_wall_seconds: f64,
    /// Processor seconds to build, median of the runs.
    pub build_cpu_seconds: f64,
    /// Wall seconds to refit, median of the runs.
    pub refit_wall_seconds: f64,
    /// Processor seconds to refit, median of the runs.
    pub refit_cpu_seconds: f64,
    /// Bytes of the tree with its own copy of the corners.
    pub memory_bytes: usize,
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// Builds and refits the tree of a mesh several times, with the threads of the current rayon pool.
#[must_use]
pub fn measure_build(mesh: &Arc<TriangleMesh>, runs: usize) -> BuildCost {
    let (mut wall, mut cpu, mut refit_wall, mut refit_cpu) = (vec![], vec![], vec![], vec![]);
    let mut memory_bytes = 0;
    for _ in 0..runs.max(1) {
        let timer = clock::Timer::start();
        let mut tracer = MeshTracer::build(mesh.clone());
        let (w, c) = timer.stop();
        wall.push(w);
        cpu.push(c);
        memory_bytes = tracer.memory_bytes();
        let timer = clock::Timer::start();
        tracer.refit(mesh.clone(), None);
        let (w, c) = timer.stop();
        refit_wall.push(w);
        refit_cpu.push(c);
    }
    BuildCost {
        build_wall_seconds: median(wall),
        build_cpu_seconds: median(cpu),
        refit_wall_seconds: median(refit_wall),
        refit_cpu_seconds: median(refit_cpu),
        memory_bytes,
    }
}

/// A world of one mesh where it stands.
#[must_use]
pub fn world_of(mesh: &Arc<TriangleMesh>, simd: Simd) -> World {
    World::build(vec![Instance::at_origin(Geometry::Mesh(MeshTracer::build(mesh.clone())))], simd)
}

/// Hits and summed distances of some rays.
fn ask(world: &World, rays: &[Ray], question: Question) -> (usize, f64) {
    let (mut hits, mut sum) = (0, 0.0);
    let mut note = |hit: &Option<Hit>| {
        if let Some(hit) = hit {
            hits += 1;
            sum += f64::from(hit.t);
        }
    };
    match question {
        Question::Closest => rays.iter().for_each(|ray| note(&world.closest(ray))),
        Question::ClosestPacket => {
            let mut found = [None; 1024];
            for chunk in rays.chunks(1024) {
                world.closest_packet(chunk, &mut found);
                found[..chunk.len()].iter().for_each(&mut note);
            }
        }
        Question::Occluded => hits = rays.iter().filter(|ray| world.occluded(ray)).count(),
        Question::OccludedPacket => {
            let mut blocked = [false; 1024];
            for chunk in rays.chunks(1024) {
                world.occluded_packet(chunk, &mut blocked);
                hits += blocked[..chunk.len()].iter().filter(|&&blocked| blocked).count();
            }
        }
    }
    (hits, sum)
}

/// Times a question on a set of rays: `runs` runs of at least a quarter of a second each, on `threads` threads that take
/// equal parts of the set.
#[must_use]
pub fn measure(world: &World, rays: &[Ray], question: Question, threads: usize, runs: usize) -> Rate {
    let threads = threads.max(1);
    let part = rays.len().div_ceil(threads).max(1);
    let run = |repeats: usize| -> (f64, f64, usize, f64) {
        let begun = std::time::Instant::now();
        let results: Vec<(f64, usize, f64)> = std::thread::scope(|scope| {
            let handles: Vec<_> = rays
                .chunks(part)
                .map(|rays| {
                    scope.spawn(move || {
                        let begun = cpu_seconds_of_thread();
                        let mut counted = (0, 0.0);
                        for _ in 0..repeats {
                            counted = ask(world, rays, question);
                        }
                        (cpu_seconds_of_thread() - begun, counted.0, counted.1)
                    })
                })
                .collect();
            handles.into_iter().filter_map(|handle| handle.join().ok()).collect()
        });
        let wall = begun.elapsed().as_secs_f64();
        let cpu = results.iter().map(|result| result.0).sum();
        (wall, cpu, results.iter().map(|r| r.1).sum(), results.iter().map(|r| r.2).sum())
    };
    let (_, first_cpu, hits, sum) = run(1);
    let repeats = (0.25 * threads as f64 / first_cpu.max(1e-3)).ceil() as usize;
    let million = rays.len() as f64 * repeats as f64 * 1e-6;
    let (mut by_wall, mut by_cpu) = (vec![], vec![]);
    for _ in 0..runs.max(1) {
        let (wall, cpu, _, _) = run(repeats);
        by_wall.push(million / wall);
        by_cpu.push(million / cpu);
    }
    Rate {
        mrays_per_cpu_second: median(by_cpu),
        mrays_per_wall_second: median(by_wall),
        hit_fraction: hits as f64 / rays.len().max(1) as f64,
        mean_distance: if hits > 0 { sum / hits as f64 } else { 0.0 },
    }
}
