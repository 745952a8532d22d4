//! What the benchmarks work on: meshes from the data folder, and one made of formulas that is always there.

use std::path::Path;
use std::sync::Arc;

use glam::Vec3;
use halflight_shape::{TriangleMesh, load_model, procedural};

use super::BenchArgs;
use crate::command::failure::Failure;

/// A mesh to trace.
pub(super) struct Subject {
    pub(super) name: &'static str,
    pub(super) mesh: Arc<TriangleMesh>,
    /// Where primary rays start.
    pub(super) eye: Vec3,
    pub(super) target: Vec3,
}

/// Name, file below the data folder, and whether the camera stands inside.
const FILES: [(&str, &str, bool); 3] = [
    ("bunny", "data/meshes/stanford_bunny.ply", false),
    ("car", "data/meshes/car_pontiac_gto_820k.ply.xz", false),
    ("kitchen", "data/meshes/kitchen_1443k.ply.xz", true),
];

/// The subjects, and a note about each that is missing.
pub(super) fn subjects(args: &BenchArgs) -> Result<(Vec<Subject>, Vec<String>), Failure> {
    let (mut subjects, mut notes) = (vec![knot(args.quick)], Vec::new());
    if args.quick {
        return Ok((subjects, notes));
    }
    for (name, file, inside) in FILES {
        let path = args.data.join(file);
        if path.exists() {
            subjects.push(subject(name, merged(&path)?, inside));
        } else {
            notes.push(format!("skipped {name}: there is no {}", path.display()));
        }
    }
    Ok((subjects, notes))
}

/// A knot of 73,728 triangles, about as many as the bunny has.
fn knot(quick: bool) -> Subject {
    let (along, around) = if quick { (192, 24) } else { (768, 48) };
    subject("knot", procedural::mesh::knot(2, 3, 1.0, 0.35, along, around), false)
}

fn merged(path: &Path) -> Result<TriangleMesh, Failure> {
    let mut all = TriangleMesh::default();
    for posed in load_model(path)?.pose(0.0) {
        all.merge(&posed.mesh.transformed(&posed.transform));
    }
    Ok(all)
}

fn subject(name: &'static str, mesh: TriangleMesh, inside: bool) -> Subject {
    let (low, high) = mesh.bounds().unwrap_or((Vec3::ZERO, Vec3::ONE));
    let (target, size) = (0.5 * (low + high), high - low);
    // Outside, the mesh fills a view of 50 degrees; inside, the eye stands a quarter into the room.
    let offset = if inside {
        0.25 * size * Vec3::new(-1.0, 0.0, 1.0)
    } else {
        0.5 * size.length() * Vec3::new(0.7, 0.5, 1.8)
    };
    Subject { name, mesh: Arc::new(mesh), eye: target + offset, target }
}

impl Subject {
    /// Centre, and radius of a sphere around everything.
    pub(super) fn sphere(&self) -> (Vec3, f32) {
        let (low, high) = self.mesh.bounds().unwrap_or((Vec3::ZERO, Vec3::ONE));
        (0.5 * (low + high), 0.5 * (high - low).length())
    }
}

/// The largest of the meshes.
pub(super) fn peak_file(args: &BenchArgs) -> std::path::PathBuf {
    args.data.join(FILES[2].1)
}
