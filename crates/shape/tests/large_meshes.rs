//! The two large meshes: counts, time and memory. `cargo test --release -p halflight-shape --test large_meshes -- --nocapture`
//! prints the figures.

use std::path::{Path, PathBuf};
use std::time::Instant;

use halflight_shape::{decode_ply, load_model};

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
