//! A seated figure in a robe, as carved of stone.

use glam::Vec3;

use super::{Clay, egg, limb};
use crate::TriangleMesh;

/// A robed figure that sits with crossed legs on a round base, facing +z.
pub fn seated(height: f32, detail: usize) -> TriangleMesh {
    let mut clay = Clay::new();
    clay.add(egg([0.0, 0.045, 0.05], [0.36, 0.05, 0.28]), 0.0);
    clay.add(egg([0.0, 0.105, 0.05], [0.32, 0.05, 0.245]), 0.012);
    clay.add_both_sides(limb([0.06, 0.19, 0.0], [0.27, 0.175, 0.10], 0.10, 0.075), 0.04);
    clay.add_both_sides(limb([0.27, 0.17, 0.10], [0.04, 0.155, 0.235], 0.068, 0.05), 0.03);
    clay.add(egg([0.0, 0.34, 0.02], [0.195, 0.20, 0.16]), 0.05);
    clay.add(egg([0.0, 0.51, -0.01], [0.185, 0.14, 0.115]), 0.07);
    clay.add_both_sides(egg([0.165, 0.575, -0.01], [0.075, 0.07, 0.075]), 0.05);
    clay.add_both_sides(limb([0.205, 0.56, -0.01], [0.255, 0.37, 0.04], 0.062, 0.054), 0.03);
    clay.add_both_sides(limb([0.255, 0.37, 0.04], [0.06, 0.265, 0.20], 0.058, 0.036), 0.02);
    clay.add(egg([0.0, 0.258, 0.215], [0.085, 0.035, 0.05]), 0.02);
    clay.add(limb([0.0, 0.60, -0.01], [0.0, 0.70, 0.0], 0.066, 0.056), 0.04);
    clay.add(egg([0.0, 0.775, 0.01], [0.095, 0.118, 0.105]), 0.03);
    clay.add(egg([0.0, 0.82, -0.008], [0.101, 0.085, 0.107]), 0.008);
    clay.add(egg([0.0, 0.915, -0.01], [0.045, 0.042, 0.045]), 0.025);
    clay.add_both_sides(egg([0.098, 0.745, 0.0], [0.017, 0.062, 0.03]), 0.012);
    // The face.
    clay.add(limb([0.0, 0.80, 0.108], [0.0, 0.752, 0.124], 0.011, 0.018), 0.012);
    clay.add_both_sides(egg([0.038, 0.792, 0.098], [0.024, 0.009, 0.014]), 0.010);
    clay.add_both_sides(limb([0.018, 0.814, 0.106], [0.064, 0.812, 0.086], 0.007, 0.005), 0.010);
    clay.add(egg([0.0, 0.722, 0.100], [0.030, 0.008, 0.016]), 0.008);
    clay.add(egg([0.0, 0.694, 0.088], [0.030, 0.022, 0.022]), 0.025);
    clay.relief = relief;
    clay.mesh(detail, height)
}

/// Petals around the base, folds that hang over the chest and arms, curls on the head.
fn relief(p: Vec3) -> f32 {
    let petals = 0.008 * (14.0 * p.x.atan2(p.z - 0.05)).cos() * window(p.y, 0.02, 0.13);
    let drape = p.y + 0.45 * (p.x + 0.10).abs();
    let folds = 0.0035 * (95.0 * drape).sin() * window(p.y, 0.28, 0.60);
    let curls = 0.004 * (120.0 * p.x).sin() * (120.0 * p.y).sin() * (120.0 * p.z).sin();
    petals + folds + curls * window(p.y, 0.825, 0.99)
}

/// From 0 to 1 and back between two heights, smoothly.
fn window(y: f32, low: f32, high: f32) -> f32 {
    let rise = |t: f32| {
        let t = t.clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    };
    rise((y - low) / 0.02) * rise((high - y) / 0.02)
}
