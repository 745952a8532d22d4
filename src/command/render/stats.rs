//! Figures about a render, for programs.

use std::io::Write;
use std::path::Path;

use halflight_file::{SaveError, write_whole};
use serde_json::{Value, json};

use super::options::RenderArgs;
use super::shot::{Kept, Studio};
use crate::command::resources;
use crate::command::sequence::Shot;
use halflight::job::Stage;

/// Collects the figures of a command.
pub(super) struct Stats {
    head: Value,
    frames: Vec<Value>,
}

impl Stats {
    pub(super) fn new(args: &RenderArgs, stage: &Stage, studio: &Studio, load_seconds: f64) -> Self {
        let head = json!({
            "version": env!("CARGO_PKG_VERSION"),
            "scene": args.scene,
            "scene_hash": stage.hash(),
            "technique": studio.technique_text,
            "width": studio.size.width,
            "height": studio.size.height,
            "seed": args.seed,
            "threads": rayon::current_num_threads(),
            "simd": stage.simd_name(),
            "load_seconds": load_seconds,
        });
        Self { head, frames: Vec::new() }
    }

    pub(super) fn add(&mut self, shot: &Shot, kept: &Kept) {
        self.frames.push(json!({
            "frame": shot.frame,
            "time_seconds": shot.time,
            "output": kept.written.then_some(&shot.output),
            "samples": kept.samples,
            "interrupted": kept.interrupted,
            "build_seconds": kept.build_seconds,
            "seconds": kept.seconds,
            "cpu_seconds": kept.cpu_seconds,
            "rays": kept.rays,
            "non_finite_samples": kept.non_finite,
            "relative_error": kept.relative_error,
        }));
    }

    /// Everything, with the peak of memory so far.
    pub(super) fn finish(mut self) -> Value {
        self.head["peak_memory_bytes"] = json!(resources::peak_memory_bytes());
        self.head["frames"] = Value::Array(self.frames);
        self.head
    }
}

pub(super) fn save(path: &Path, stats: &Value) -> Result<(), SaveError> {
    write_whole(path, "figures", |writer| writeln!(writer, "{stats:#}"))
}
