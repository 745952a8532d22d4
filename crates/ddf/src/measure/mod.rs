//! How good a field is.

mod points;
mod rays;

pub use points::{Cloud, CloudDistance, F_SCORE_THRESHOLD, chamfer_e3, compare_clouds};
pub use rays::{
    Evaluation, RayErrors, evaluate, evaluate_while, field_points, field_points_while, mesh_points,
    mesh_seen_points, seen_points,
};
