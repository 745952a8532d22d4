//! The body of a car.

use glam::Quat;

use super::{Clay, Lump, egg};
use crate::TriangleMesh;

/// A box with round edges.
fn shell(center: [f32; 3], radii: [f32; 3], power: f32) -> Lump {
    Lump::Egg { center: center.into(), radii: radii.into(), turn: Quat::IDENTITY, power }
}

fn wheel(center: [f32; 3], radius: f32, half_width: f32, edge: f32) -> Lump {
    Lump::Wheel { center: center.into(), radius, half_width, edge }
}

/// A small car on its wheels, nose at +z, nearly three times as long as it is tall.
pub fn car_body(height: f32, detail: usize) -> TriangleMesh {
    let mut clay = Clay::new();
    // Belt, bonnet, boot and cabin.
    clay.add(shell([0.0, 0.37, 0.0], [0.60, 0.19, 1.42], 4.5), 0.0);
    clay.add(shell([0.0, 0.47, 0.80], [0.54, 0.16, 0.56], 3.0), 0.10);
    clay.add(shell([0.0, 0.50, -1.00], [0.53, 0.16, 0.38], 3.0), 0.10);
    clay.add(shell([0.0, 0.66, -0.18], [0.49, 0.33, 0.84], 2.6), 0.09);
    clay.add(shell([0.0, 0.28, 1.36], [0.52, 0.07, 0.10], 4.0), 0.05);
    clay.add(shell([0.0, 0.30, -1.36], [0.52, 0.07, 0.10], 4.0), 0.05);
    for z in [0.90, -0.88] {
        for side in [-1.0, 1.0] {
            clay.holes.push((wheel([0.62 * side, 0.22, z], 0.27, 0.26, 0.03), 0.03));
            clay.fittings.push((wheel([0.49 * side, 0.205, z], 0.205, 0.10, 0.035), 0.004));
            clay.fittings.push((wheel([0.585 * side, 0.205, z], 0.11, 0.02, 0.012), 0.008));
        }
    }
    // The line under the windows, and windows that lie deeper than the frame.
    let pane = |center: [f32; 3], radii: [f32; 3]| (shell(center, radii, 4.0), 0.02);
    for side in [-1.0, 1.0] {
        clay.holes.push(pane([0.53 * side, 0.75, 0.12], [0.12, 0.13, 0.26]));
        clay.holes.push(pane([0.53 * side, 0.75, -0.46], [0.12, 0.13, 0.26]));
    }
    for lump in [egg([0.40, 0.47, 1.31], [0.10, 0.06, 0.08]), egg([0.53, 0.62, 0.46], [0.095, 0.038, 0.04])] {
        clay.fittings.extend([lump, lump.mirrored()].map(|lump| (lump, 0.025)));
    }
    clay.holes.push((shell([0.0, 0.36, 1.46], [0.24, 0.035, 0.06], 4.0), 0.012));
    clay.mesh(detail, height)
}
