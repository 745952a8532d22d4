//! The two large meshes: counts, time and memory. `cargo test --release -p halflight-shape --test large_meshes -- --nocapture`
//! prints the figures.

use std::path::{Path, PathBuf};
use std::time::Instant;

use halflight_shape::{Resolver, decode_obj, decode_ply, load_model};

fn data(name: &str) -> Option<PathBuf> {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/meshes")).join(name);
    if !path.exists() {
        eprintln!("skipped: {} is not there", path.display());
        return None;
    }
    Some(path)
}

/// The most memory that this process has held, in MB, where the system tells.
fn peak_megabytes() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<f64>().ok()? / 1024.0)
}

#[test]
fn the_kitchen_and_the_car_load_within_their_memory() {
    for (name, triangles, vertices) in
        [("kitchen_1443k.ply.xz", 1_443_509, 731_690), ("car_pontiac_gto_820k.ply.xz", 820_036, 418_321)]
    {
        let Some(path) = data(name) else { return };
        let start = Instant::now();
        let model = load_model(&path).expect("the mesh loads");
        let whole = start.elapsed();
        let mesh = &model.meshes[0].mesh;
        assert_eq!((mesh.triangles.len(), mesh.positions.len()), (triangles, vertices));
        // Read, unpacked and parsed: the unpacked file, the mesh, and little else.
        if let Some(peak) = peak_megabytes() {
            eprintln!("{name}: peak {peak:.0} MB");
            assert!(peak < 200.0, "{peak} MB");
        }
        let bytes = halflight_file::read(&path, "mesh").expect("it unpacks");
        let start = Instant::now();
        decode_ply(&bytes, &path).expect("it parses");
        let parsed = start.elapsed();
        eprintln!("{name}: {whole:?} with unpacking, {parsed:?} without; {:?}", model.warnings);
        assert!(parsed.as_secs_f64() < 1.0 || cfg!(debug_assertions));
    }
}

/// The least CPU-bound time of several runs, which other work on the machine disturbs least.
fn best_of(runs: usize, mut run: impl FnMut()) -> f64 {
    let times = (0..runs).map(|_| {
        let start = Instant::now();
        run();
        start.elapsed().as_secs_f64()
    });
    times.fold(f64::INFINITY, f64::min)
}

#[test]
fn rates_of_reading_text_and_of_posing_are_printed() {
    if let Some(path) = data("armadillo.obj") {
        let bytes = halflight_file::read(&path, "mesh").expect("it reads");
        let seconds = best_of(5, || {
            decode_obj(&bytes, &path, &Resolver::memory()).expect("it parses");
        });
        eprintln!("armadillo.obj: {:.0} MB/s", bytes.len() as f64 / seconds / 1e6);
    }
    if let Some(path) = data("../animated/BrainStem.glb") {
        let model = load_model(&path).expect("it loads");
        let vertices: usize = model.pose(0.0).iter().map(|p| p.mesh.positions.len()).sum();
        let seconds = best_of(10, || {
            model.pose(3.0);
        });
        eprintln!("BrainStem.glb: {vertices} vertices posed in {:.2} ms", seconds * 1e3);
    }
}
