//! How long it takes to build the tree of a mesh, and to refit it to vertices that have moved.

use std::sync::Arc;

use glam::Vec3;
use halflight_shape::TriangleMesh;
use halflight_trace::{MeshTracer, RayGeometry};

use super::clock::{self, Timing};
use super::subjects::subjects;
use super::{BenchArgs, Findings};
use crate::command::failure::Failure;
use crate::command::table::Table;
use crate::command::words;

pub(super) fn measure(args: &BenchArgs) -> Result<Findings, Failure> {
    let seconds = if args.quick { 0.02 } else { 1.0 };
    let (subjects, mut notes) = subjects(args)?;
    let threads = rayon::current_num_threads();
    let mut table =
        Table::new(["mesh", "triangles", "build ms", "build CPU ms", "refit ms", "refit CPU ms", "memory"]);
    for subject in &subjects {
        let build = clock::time(seconds, || {
            std::hint::black_box(MeshTracer::build(subject.mesh.clone()));
        });
        let mut tracer = MeshTracer::build(subject.mesh.clone());
        let memory = tracer.memory_bytes();
        let (other, mesh) = (Arc::new(twisted(&subject.mesh)), subject.mesh.clone());
        let mut poses = [other, mesh].into_iter().cycle();
        let refit = clock::time(seconds, || {
            if let Some(pose) = poses.next() {
                tracer.refit(pose, None);
            }
        });
        let mut cells = vec![subject.name.to_string(), subject.mesh.triangles.len().to_string()];
        cells.extend([build, refit].iter().flat_map(milliseconds));
        cells.push(words::bytes(memory as u64));
        table.row(cells);
    }
    notes.push(format!("wall time on {threads} threads and processor time; medians of 3 runs of {seconds} s; memory without the mesh"));
    Ok(Findings { title: "Trees", table, notes })
}

fn milliseconds(timing: &Timing) -> [String; 2] {
    [timing.wall, timing.cpu].map(|s| format!("{:.1}", 1e3 * s))
}

/// The mesh turned about the vertical by an angle that grows with height: a tenth of a radian from foot to head.
fn twisted(mesh: &TriangleMesh) -> TriangleMesh {
    let (low, high) = mesh.bounds().unwrap_or((Vec3::ZERO, Vec3::ONE));
    let mut twisted = mesh.clone();
    for position in &mut twisted.positions {
        let angle = 0.1 * (position.y - low.y) / (high.y - low.y).max(f32::MIN_POSITIVE);
        *position = glam::Quat::from_rotation_y(angle) * *position;
    }
    twisted
}
