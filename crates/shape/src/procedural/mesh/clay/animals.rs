//! A sitting rabbit and a winding dragon.

use glam::{Quat, Vec3};

use super::{Clay, Lump, egg, limb};
use crate::TriangleMesh;
use crate::procedural::noise::noise3;

/// A sitting rabbit with uneven fur, facing +z.
pub fn rabbit(height: f32, detail: usize) -> TriangleMesh {
    let mut clay = Clay::new();
    clay.add(egg([0.0, 0.33, -0.08], [0.26, 0.31, 0.36]), 0.0);
    clay.add(egg([0.0, 0.36, 0.18], [0.18, 0.27, 0.19]), 0.12);
    clay.add_both_sides(egg([0.19, 0.20, -0.16], [0.13, 0.20, 0.22]), 0.06);
    clay.add(egg([0.0, 0.66, 0.30], [0.15, 0.145, 0.18]), 0.10);
    clay.add(egg([0.0, 0.625, 0.43], [0.085, 0.072, 0.085]), 0.06);
    clay.add_both_sides(egg([0.065, 0.615, 0.38], [0.075, 0.07, 0.07]), 0.04);
    clay.add_both_sides(egg([0.098, 0.70, 0.405], [0.026, 0.028, 0.026]), 0.012);
    // Ears: flat spoons, leaning back and outwards.
    let lean = Quat::from_rotation_z(-0.28) * Quat::from_rotation_x(-0.42);
    clay.add_both_sides(egg([0.12, 0.93, 0.15], [0.062, 0.21, 0.034]).turned(lean), 0.05);
    let hollow = egg([0.125, 0.95, 0.178], [0.036, 0.15, 0.022]).turned(lean);
    clay.holes.extend([hollow, hollow.mirrored()].map(|lump| (lump, 0.02)));
    clay.add_both_sides(egg([0.17, 0.05, 0.08], [0.075, 0.055, 0.21]), 0.05);
    clay.add_both_sides(limb([0.10, 0.28, 0.27], [0.09, 0.06, 0.36], 0.075, 0.055), 0.05);
    clay.add_both_sides(egg([0.09, 0.045, 0.40], [0.058, 0.045, 0.09]), 0.03);
    clay.add(egg([0.0, 0.20, -0.45], [0.10, 0.10, 0.09]), 0.04);
    clay.relief = |p| 0.006 * noise3(p * 16.0, 3) + 0.003 * noise3(p * 37.0, 4);
    clay.mesh(detail, height)
}

/// The spine of the dragon from the tip of its tail to the head: places and radii.
const SPINE: [([f32; 3], f32); 13] = [
    ([-0.66, 0.46, 0.06], 0.008),
    ([-0.60, 0.34, 0.10], 0.022),
    ([-0.50, 0.22, 0.06], 0.040),
    ([-0.38, 0.19, -0.03], 0.060),
    ([-0.26, 0.28, -0.08], 0.082),
    ([-0.14, 0.40, -0.04], 0.100),
    ([-0.02, 0.38, 0.05], 0.108),
    ([0.10, 0.28, 0.09], 0.110),
    ([0.22, 0.27, 0.05], 0.108),
    ([0.32, 0.37, -0.02], 0.094),
    ([0.34, 0.50, -0.05], 0.076),
    ([0.36, 0.61, -0.03], 0.066),
    ([0.44, 0.67, 0.0], 0.066),
];

/// A winding dragon on four legs, scaled and spiked, along the x axis with its head at +x.
pub fn dragon(height: f32, detail: usize) -> TriangleMesh {
    let mut clay = Clay::new();
    let spine: Vec<(Vec3, f32)> = (0..=48).map(|i| along_spine(i as f32 / 48.0)).collect();
    for pair in spine.windows(2) {
        let [(from, start), (to, end)] = [pair[0], pair[1]];
        clay.add(Lump::Limb { from, to, start, end }, 0.02);
    }
    for i in 3..42 {
        let t = (i as f32 + 0.5) / 46.0;
        let (place, radius) = along_spine(t);
        let (ahead, _) = along_spine((t + 0.02).min(1.0));
        let along = (ahead - place).normalize_or(Vec3::X);
        // What is up, off the spine.
        let up = (Vec3::Y - along * along.y).normalize_or(Vec3::X);
        let tip = place + up * (radius * 1.55 + 0.012) - along * (0.35 * radius);
        let root = place + up * (radius * 0.75);
        clay.add(Lump::Limb { from: root, to: tip, start: 0.016 + 0.12 * radius, end: 0.003 }, 0.012);
    }
    head(&mut clay);
    for side in [-1.0f32, 1.0] {
        leg(&mut clay, [-0.20, 0.31, -0.06], [-0.30, 0.16, 0.12 * side], [-0.22, 0.035, 0.16 * side]);
        leg(
            &mut clay,
            [0.20, 0.26, 0.05],
            [0.16, 0.14, 0.05 + 0.13 * side],
            [0.25, 0.035, 0.05 + 0.15 * side],
        );
    }
    // Scales: bumps in rows that are shifted against each other.
    clay.relief = |p| {
        let q = p * 62.0;
        let scales = (q.x + 0.5 * q.y).sin() * (q.y - 0.4 * q.x).sin() * (q.z + 0.3 * q.x).cos();
        0.0022 * scales + 0.003 * noise3(p * 14.0, 9)
    };
    clay.mesh(detail, height)
}

fn head(clay: &mut Clay) {
    clay.add(egg([0.47, 0.675, 0.0], [0.085, 0.066, 0.064]), 0.04);
    clay.add(limb([0.50, 0.668, 0.0], [0.62, 0.640, 0.0], 0.050, 0.030), 0.03);
    clay.add(limb([0.48, 0.625, 0.0], [0.59, 0.582, 0.0], 0.030, 0.016), 0.015);
    clay.add(egg([0.635, 0.655, 0.0], [0.026, 0.024, 0.034]), 0.015);
    for side in [-1.0f32, 1.0] {
        clay.add(limb([0.45, 0.725, 0.035 * side], [0.33, 0.83, 0.085 * side], 0.018, 0.004), 0.012);
        clay.add(limb([0.36, 0.803, 0.072 * side], [0.37, 0.845, 0.095 * side], 0.010, 0.004), 0.008);
        clay.add(egg([0.525, 0.708, 0.036 * side], [0.028, 0.018, 0.018]), 0.012);
        clay.add(limb([0.43, 0.64, 0.05 * side], [0.33, 0.615, 0.125 * side], 0.026, 0.004), 0.015);
        clay.add(limb([0.43, 0.67, 0.05 * side], [0.33, 0.69, 0.125 * side], 0.024, 0.004), 0.015);
        clay.add(limb([0.61, 0.635, 0.028 * side], [0.66, 0.59, 0.09 * side], 0.009, 0.003), 0.008);
    }
    clay.add(limb([0.46, 0.60, 0.0], [0.44, 0.53, 0.0], 0.022, 0.004), 0.015);
}

fn leg(clay: &mut Clay, hip: [f32; 3], knee: [f32; 3], foot: [f32; 3]) {
    clay.add(limb(hip, knee, 0.072, 0.044), 0.05);
    clay.add(limb(knee, foot, 0.042, 0.028), 0.02);
    let [x, y, z] = foot;
    clay.add(egg([x + 0.02, y - 0.008, z], [0.052, 0.026, 0.040]), 0.02);
    for toe in [-1.0f32, 0.0, 1.0] {
        let root = [x + 0.05, y - 0.010, z + 0.024 * toe];
        clay.add(limb(root, [x + 0.095, y - 0.026, z + 0.040 * toe], 0.014, 0.004), 0.008);
    }
}

/// The spine at a part of its length: Catmull and Rom's curve through its places.
fn along_spine(t: f32) -> (Vec3, f32) {
    let last = SPINE.len() - 1;
    let at = t.clamp(0.0, 1.0) * last as f32;
    let first = (at as usize).min(last - 1);
    let f = at - first as f32;
    let knot = |offset: isize| {
        let (place, radius) = SPINE[(first as isize + offset).clamp(0, last as isize) as usize];
        Vec3::from_array(place).extend(radius)
    };
    let [a, b, c, d] = [knot(-1), knot(0), knot(1), knot(2)];
    let curve = 0.5
        * (2.0 * b
            + (c - a) * f
            + (2.0 * a - 5.0 * b + 4.0 * c - d) * f * f
            + (3.0 * (b - c) + d - a) * f * f * f);
    (curve.truncate(), curve.w.max(0.006))
}
