//! Nanoseconds per call of a measured material: `cargo run --release -p halflight-material --example measured_rate`.
//!
//! "warm" asks for 4,096 pairs of directions over and over, so that the cells they need stay in the processor's
//! caches; "spread" goes through half a million pairs, which touch the whole table. "near the mirror" are pairs about
//! a highlight. Each figure is the best of several rounds.

use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use glam::{Vec2, Vec3};
use halflight_material::test_kit::Random;
use halflight_material::{Lookup, Material, MaterialKind, MeasuredBrdf, SurfaceInput, merl_bytes};

struct Ask {
    wo: Vec3,
    wi: Vec3,
    lobe: f32,
    square: Vec2,
}

fn main() {
    let Some(source) = Material::metal("gold", 0.3) else { return };
    let source = source.bsdf(&SurfaceInput::default());
    let bytes = merl_bytes(|wo, wi| source.eval(wo, wi) / wi.z);
    let mut random = Random::new(1);
    let sets = [
        ("warm", asks(4096, 2.0, &mut random), 200),
        ("near the mirror, warm", asks(4096, 0.05, &mut random), 200),
        ("spread", asks(1 << 19, 2.0, &mut random), 2),
    ];
    println!("{:36} {:>8} {:>8} {:>8}", "ns per call", "eval", "eval_pdf", "sample");
    for lookup in [Lookup::Nearest, Lookup::Interpolated] {
        let Ok(brdf) = MeasuredBrdf::decode(&bytes, Path::new("gold"), lookup) else { return };
        let material = Material::new("gold", MaterialKind::Measured(Arc::new(brdf)));
        let bsdf = material.bsdf(&SurfaceInput::default());
        for (name, asks, rounds) in &sets {
            let eval = time(asks, *rounds, |ask| keep(bsdf.eval(ask.wo, ask.wi)));
            let both = time(asks, *rounds, |ask| keep(bsdf.eval_pdf(ask.wo, ask.wi)));
            let sample = time(asks, *rounds, |ask| keep(bsdf.sample(ask.wo, ask.lobe, ask.square)));
            println!("{:36} {eval:8.1} {both:8.1} {sample:8.1}", format!("{lookup:?}, {name}"));
        }
    }
}

/// Pairs above the surface, the second about the mirror direction of the first within `spread`.
fn asks(count: usize, spread: f32, random: &mut Random) -> Vec<Ask> {
    let upper = |v: Vec3| Vec3::new(v.x, v.y, v.z.abs().max(1e-3)).normalize();
    (0..count)
        .map(|_| {
            let wo = upper(random.direction());
            let wi = upper(Vec3::new(-wo.x, -wo.y, wo.z) + spread * random.direction());
            Ask { wo, wi, lobe: random.unit(), square: random.square() }
        })
        .collect()
}

fn keep<T>(value: T) {
    black_box(value);
}

/// The best round, in nanoseconds per call.
fn time(asks: &[Ask], rounds: usize, call: impl Fn(&Ask)) -> f64 {
    let mut best = f64::MAX;
    for _ in 0..rounds {
        let start = Instant::now();
        asks.iter().for_each(&call);
        best = best.min(start.elapsed().as_secs_f64() * 1e9 / asks.len() as f64);
    }
    best
}
