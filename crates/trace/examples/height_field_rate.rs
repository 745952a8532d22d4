//! Rays per second of CPU time against a height field of 512 × 512 posts, on one thread.
//!
//! `cargo run --release -p halflight-trace --example height_field_rate [-- baseline|avx2|avx512]`

use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

use glam::{Vec2, Vec3};
use halflight_shape::procedural::{ProceduralHeight, SineTerm, SumOfSines};
use halflight_trace::{HeightFieldTracer, Ray, RayGeometry, Simd};

/// Seconds of CPU time that this thread has used: other programs on the machine do not count. Wall time where the
/// system does not tell.
fn cpu_seconds(since: Instant) -> f64 {
    let nanoseconds = std::fs::read_to_string("/proc/thread-self/schedstat")
        .ok()
        .and_then(|line| line.split_whitespace().next().and_then(|field| field.parse::<f64>().ok()));
    nanoseconds.map_or_else(|| since.elapsed().as_secs_f64(), |n| n * 1e-9)
}

/// The best of several runs, in seconds.
fn best(mut run: impl FnMut()) -> f64 {
    let start = Instant::now();
    let mut least = f64::INFINITY;
    for _ in 0..7 {
        let before = cpu_seconds(start);
        run();
        least = least.min(cpu_seconds(start) - before);
    }
    least
}

fn main() {
    let level = std::env::args().nth(1).unwrap_or_else(|| "auto".to_owned());
    let simd = match Simd::from_name(&level) {
        Ok(simd) => simd,
        Err(error) => {
            eprintln!("{error}");
            std::process::exit(2);
        }
    };
    let terms = [
        (0.35, 0.55, 0.3, 0.3),
        (0.28, -0.4, 0.75, 1.1),
        (0.16, 1.1, -0.9, 2.0),
        (0.11, 1.7, 1.3, 0.4),
        (0.06, -2.9, 2.2, 1.7),
        (0.035, 4.1, 3.7, 2.9),
        (0.02, -6.3, 7.1, 0.8),
        (0.01, 11.3, -9.7, 1.9),
    ];
    let terms = terms
        .map(|(amplitude, kx, kz, phase)| SineTerm { amplitude, kx, kz, phase, angular_speed: 0.0 })
        .to_vec();
    let terrain = ProceduralHeight::SumOfSines(SumOfSines { terms });
    let field = terrain.evaluate(512, 512, Vec2::splat(-6.0), Vec2::splat(6.0), 0.0).expect("a valid field");
    let field = Arc::new(field);
    let build = best(|| {
        black_box(HeightFieldTracer::with_simd(field.clone(), None, simd));
    });
    let tracer = HeightFieldTracer::with_simd(field, None, simd);
    println!("{}: build {:.2} ms, {} bytes", simd.name(), 1e3 * build, tracer.memory_bytes());

    // The camera of the reference picture, from above the near edge over the hills.
    let (width, height) = (960, 540);
    let origin = Vec3::new(0.0, 3.4, 8.4);
    let forward = (Vec3::new(0.0, 1.2, 0.0) - origin).normalize();
    let right = forward.cross(Vec3::Y).normalize();
    let up = right.cross(forward);
    let reach = 25f32.to_radians().tan();
    let rays: Vec<Ray> = (0..width * height)
        .map(|p| {
            let x = ((p % width) as f32 + 0.5) / width as f32 * 2.0 - 1.0;
            let y = (1.0 - ((p / width) as f32 + 0.5) / height as f32 * 2.0) * height as f32 / width as f32;
            Ray::new(origin, (forward + reach * (x * right + y * up)).normalize())
        })
        .collect();
    let mut state = 1u64;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1u64 << 24) as f32
    };
    let mut shadow = Vec::new();
    for ray in &rays {
        if let Some(hit) = tracer.closest(ray) {
            let surface = tracer.surface(ray, &hit);
            let normal = surface.geometric_normal;
            let (z, turn) = (next(), std::f32::consts::TAU * next());
            let ring = (1.0 - z * z).sqrt();
            let side = normal.any_orthonormal_pair();
            let direction = side.0 * (ring * turn.cos()) + side.1 * (ring * turn.sin()) + normal * z;
            shadow.push(Ray::new(surface.position + normal * (4.0 * surface.position_error), direction));
        }
    }
    let rate = |name: &str, rays: &[Ray], ask: &dyn Fn(&Ray) -> bool| {
        let mut hits = 0;
        let seconds = best(|| hits = rays.iter().filter(|ray| ask(ray)).count());
        let share = 100.0 * hits as f64 / rays.len() as f64;
        println!("{name}: {:.2} million rays a second, {share:.1} % hit", rays.len() as f64 / seconds * 1e-6);
    };
    rate("primary, closest   ", &rays, &|ray| tracer.closest(ray).is_some());
    rate("primary, occluded  ", &rays, &|ray| tracer.occluded(ray));
    rate("hemisphere, closest", &shadow, &|ray| tracer.closest(ray).is_some());
    rate("hemisphere, occluded", &shadow, &|ray| tracer.occluded(ray));
}
