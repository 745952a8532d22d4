//! Nanoseconds per call of every kind of material: `cargo run --release -p halflight-material --example material_speed`.

use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use glam::Vec3;
use halflight_material::test_kit::Random;
use halflight_material::{Lookup, Material, MaterialKind, MeasuredBrdf, SurfaceInput, merl_bytes};

const PAIRS: usize = 4096;

fn main() {
    let mut materials: Vec<(String, Material)> = [
        "diffuse",
        "phong:0.3,specular=0.5,exponent=50",
        "conductor:gold,roughness=0.3",
        "conductor:0.9,roughness=0.3",
        "glass",
        "glass:1.5,roughness=0.3",
        "metallic-roughness:0.8,roughness=0.4",
    ]
    .iter()
    .filter_map(|spec| Some((spec.to_string(), Material::from_spec(spec).ok()?)))
    .collect();
    let source = Material::from_spec("conductor:gold,roughness=0.3").ok();
    let Some(source) = source else { return };
    let bsdf = source.bsdf(&SurfaceInput::default());
    let start = Instant::now();
    let bytes = merl_bytes(|wo, wi| bsdf.eval(wo, wi) / wi.z);
    println!("a table written in {:.0} ms", start.elapsed().as_secs_f64() * 1e3);
    for lookup in [Lookup::Nearest, Lookup::Interpolated] {
        let start = Instant::now();
        let Ok(brdf) = MeasuredBrdf::decode(&bytes, Path::new("synthetic"), lookup) else { return };
        println!("a table decoded and prepared in {:.0} ms", start.elapsed().as_secs_f64() * 1e3);
        materials.push((
            format!("measured {lookup:?}"),
            Material::new("m", MaterialKind::Measured(Arc::new(brdf))),
        ));
    }
    println!("{:45} {:>8} {:>8} {:>8} {:>8}", "ns per call", "bsdf", "eval", "eval_pdf", "sample");
    let mut random = Random::new(1);
    let upper = |v: Vec3| Vec3::new(v.x, v.y, v.z.abs().max(1e-3)).normalize();
    let pairs: Vec<(Vec3, Vec3)> =
        (0..PAIRS).map(|_| (upper(random.direction()), upper(random.direction()))).collect();
    let numbers: Vec<_> = (0..PAIRS).map(|_| (random.unit(), random.square())).collect();
    for (name, material) in &materials {
        let bsdf = material.bsdf(&SurfaceInput::default());
        let resolved = time(|_| keep(black_box(material).bsdf(&SurfaceInput::default())));
        let eval = time(|i| keep(bsdf.eval(pairs[i].0, pairs[i].1)));
        let both = time(|i| keep(bsdf.eval_pdf(pairs[i].0, pairs[i].1)));
        let sample = time(|i| keep(bsdf.sample(pairs[i].0, numbers[i].0, numbers[i].1)));
        println!("{name:45} {resolved:8.1} {eval:8.1} {both:8.1} {sample:8.1}");
    }
}

fn keep<T>(value: T) {
    black_box(value);
}

/// The best of several rounds, in nanoseconds.
fn time(mut call: impl FnMut(usize)) -> f64 {
    let mut best = f64::MAX;
    for _ in 0..15 {
        let start = Instant::now();
        for round in 0..4 {
            for i in 0..PAIRS {
                call((i + round) % PAIRS);
            }
        }
        best = best.min(start.elapsed().as_secs_f64() * 1e9 / (4 * PAIRS) as f64);
    }
    best
}
