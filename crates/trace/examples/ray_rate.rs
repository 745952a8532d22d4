//! Prints how fast rays are on one mesh or several.
//!
//! `cargo run --release --example ray_rate -- [--dump DIR] [--runs N] [--simd LEVEL] FILE...`
//!
//! A mesh whose file name contains `kitchen` is seen from the inside. With `--dump` each mesh and its sets of rays are
//! written as raw little-endian floats for `tools/peers/embree.py`.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use halflight_shape::TriangleMesh;
use halflight_trace::bench::{self, Question, View};
use halflight_trace::{Ray, Simd, World};

fn load(path: &Path) -> Result<TriangleMesh, Box<dyn std::error::Error>> {
    let model = halflight_shape::load_model(path)?;
    let mut whole = TriangleMesh::default();
    for posed in model.pose(0.0) {
        let base = whole.positions.len() as u32;
        whole.positions.extend(posed.mesh.positions.iter().map(|&p| posed.transform.transform_point3(p)));
        whole.triangles.extend(posed.mesh.triangles.iter().map(|t| t.map(|vertex| vertex + base)));
    }
    Ok(whole)
}

fn dump(folder: &Path, name: &str, kind: &str, bytes: impl Iterator<Item = [u8; 4]>) -> std::io::Result<()> {
    let mut file = std::io::BufWriter::new(std::fs::File::create(folder.join(format!("{name}.{kind}")))?);
    for word in bytes {
        file.write_all(&word)?;
    }
    file.flush()
}

fn ray_words(rays: &[Ray]) -> impl Iterator<Item = [u8; 4]> {
    rays.iter().flat_map(|ray| {
        let (o, d) = (ray.origin, ray.direction);
        [o.x, o.y, o.z, d.x, d.y, d.z].map(f32::to_le_bytes)
    })
}

fn print_rates(world: &World, name: &str, set: &str, rays: &[Ray], runs: usize) {
    for question in Question::ALL {
        let coherent = set == "primary";
        if !coherent && matches!(question, Question::ClosestPacket | Question::OccludedPacket) {
            continue;
        }
        let one = bench::measure(world, rays, question, 1, runs);
        let two = bench::measure(world, rays, question, 2, runs);
        println!(
            "{name:<20} {set:<8} {:<17} {:>8.1} {:>8.1} {:>8.1} {:>8.3} {:>10.4}",
            question.name(),
            one.mrays_per_cpu_second,
            two.mrays_per_cpu_second,
            two.mrays_per_wall_second,
            one.hit_fraction,
            one.mean_distance
        );
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut files = Vec::new();
    let (mut folder, mut runs, mut simd) = (None, 3, Simd::detect());
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--dump" => folder = arguments.next().map(PathBuf::from),
            "--runs" => runs = arguments.next().map_or(Ok(runs), |n| n.parse())?,
            "--simd" => simd = Simd::from_name(&arguments.next().unwrap_or_default())?,
            _ => files.push(PathBuf::from(argument)),
        }
    }
    println!(
        "rays: million per second; together: asked in slices of 1024, which are traced in packets of 64; instructions: {}",
        simd.name()
    );
    println!(
        "{:<20} {:<8} {:<17} {:>8} {:>8} {:>8} {:>8} {:>10}",
        "mesh", "rays", "question", "1t /cpu", "2t /cpu", "2t wall", "hits", "mean t"
    );
    for file in &files {
        let name = file.file_name().map_or(String::new(), |name| name.to_string_lossy().into_owned());
        let name = name.split('.').next().unwrap_or_default();
        let mesh = Arc::new(load(file)?);
        let world = bench::world_of(&mesh, simd);
        let bounds = world.bounds();
        let view = if name.contains("kitchen") { View::inside(bounds) } else { View::outside(bounds) };
        let primary = bench::primary_rays(&view, 1024);
        let random = bench::random_rays(bounds, 1 << 20);
        let bounce = bench::bounce_rays(&world, &primary);
        let cost = bench::measure_build(&mesh, runs);
        println!(
            "{name:<20} {} triangles: build {:.1} ms ({:.1} cpu), refit {:.1} ms ({:.1} cpu), {:.1} MB",
            mesh.triangles.len(),
            cost.build_wall_seconds * 1e3,
            cost.build_cpu_seconds * 1e3,
            cost.refit_wall_seconds * 1e3,
            cost.refit_cpu_seconds * 1e3,
            cost.memory_bytes as f64 * 1e-6
        );
        for (set, rays) in [("primary", &primary), ("random", &random), ("bounce", &bounce)] {
            if let Some(folder) = &folder {
                std::fs::create_dir_all(folder)?;
                dump(folder, name, set, ray_words(rays))?;
            }
            print_rates(&world, name, set, rays, runs);
        }
        if let Some(folder) = &folder {
            dump(
                folder,
                name,
                "positions",
                mesh.positions.iter().flat_map(|p| p.to_array().map(f32::to_le_bytes)),
            )?;
            dump(folder, name, "triangles", mesh.triangles.iter().flat_map(|t| t.map(u32::to_le_bytes)))?;
        }
    }
    Ok(())
}
