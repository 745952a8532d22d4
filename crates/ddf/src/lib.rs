//! Geometry as a field of directed distances: φ(x, ω) is how far a ray goes before it meets the surface, ξ(x, ω) whether
//! it does (seed 002).
//!
//! [`AnalyticField`] knows fields of simple shapes exactly. [`FastTrainer`] learns the field of a mesh, or
//! [`SeedTrainer`] as the seed has it; [`DirectedField`] answers for both.

mod analytic;
mod convert;
mod error;
mod fast;
mod field;
mod file;
mod grid;
mod measure;
mod random;
mod samples;
mod seed;
mod tracer;
mod train;
mod unit;

pub use analytic::{AnalyticField, AnalyticHit};
pub use convert::{DistanceGrid, even_directions};
pub use error::DdfError;
pub use fast::shape::FastShape;
pub use field::{DirectedField, FieldHit, FieldShape, MeasuredError, Provenance};
pub use file::FIELD_VERSION;
pub use halflight_trace::FallbackCounts;
pub use measure::{
    Cloud, CloudDistance, Evaluation, F_SCORE_THRESHOLD, RayErrors, chamfer_e3, compare_clouds, evaluate,
    evaluate_while, field_points, field_points_while, mesh_points, mesh_seen_points, seen_points,
};
pub use samples::{FieldSample, Inside, SAMPLES_VERSION, SampleScheme, draw_samples};
pub use seed::{SeedNetwork, SeedOptions, SeedSchedule, SeedShape, SeedTrainer};
pub use tracer::{Answered, FieldTracer};
pub use train::{FastTrainer, StepReport, TrainOptions};
pub use unit::{UnitSpace, mesh_hash};
