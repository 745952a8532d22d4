//! Nanoseconds per call of every kind of material: `cargo run --release -p halflight-material --example material_speed`.

use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use glam::Vec3;
use halflight_material::test_kit::Random;
use halflight_material::{
    ColorInput, ConductorColor, Lookup, Material, MaterialKind, MeasuredBrdf, SurfaceInput, merl_bytes,
};

const PAIRS: usize = 4096;

fn main() {
    let Some(source) = Material::metal("gold", 0.3) else { return };
    let white = || ColorInput::Constant(Vec3::splat(0.9));
    let colored = ConductorColor::Normal(white());
    let mut materials: Vec<(String, Material)> = vec![
        ("diffuse".into(), Material::diffuse(Vec3::splat(0.5))),
        ("phong".into(), Material::phong(Vec3::splat(0.3), Vec3::splat(0.5), 50.0)),
        ("metal of a complex index".into(), source.clone()),
        ("coloured metal".into(), {
            let kind = MaterialKind::Conductor { color: colored, roughness: 0.3.into(), anisotropy: 0.0 };
            Material::new("coloured metal", kind)
        }),
        ("glass".into(), Material::glass(1.5)),
        ("rough glass".into(), {
            let kind = MaterialKind::Dielectric { ior: 1.5, roughness: 0.3.into(), tint: Vec3::ONE.into() };
            Material::new("rough glass", kind)
        }),
        ("metallic-roughness".into(), {
            let kind = MaterialKind::MetallicRoughness {
                base_color: white(),
                metallic: 0.0.into(),
                roughness: 0.4.into(),
                transmission: 0.0.into(),
                ior: 1.5,
            };
            Material::new("metallic-roughness", kind)
        }),
    ];
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
