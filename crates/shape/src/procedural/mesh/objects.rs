//! Objects to look at: for demo scenes, and wherever a handsome shape is wanted without a file.

use glam::{Affine3A, Vec2, Vec3};

use super::{capsule, ico_sphere, lathe, merge, rounded_box, smooth_across_seams, torus, uv_sphere};
use crate::TriangleMesh;
use crate::procedural::noise::noise3;

fn profile(points: &[(f32, f32)]) -> Vec<Vec2> {
    points.iter().map(|&(radius, height)| Vec2::new(radius, height)).collect()
}

/// A slender vase, 1 m tall, with a wall that has thickness and is open at the top.
pub fn vase(around_count: usize) -> TriangleMesh {
    let points = profile(&[
        (0.0, 0.0),
        (0.15, 0.0),
        (0.15, 0.0),
        (0.17, 0.012),
        (0.16, 0.03),
        (0.2, 0.12),
        (0.285, 0.3),
        (0.3, 0.45),
        (0.245, 0.62),
        (0.13, 0.77),
        (0.098, 0.86),
        (0.125, 0.95),
        (0.165, 0.99),
        (0.168, 1.0),
        (0.155, 0.995),
        (0.105, 0.945),
        (0.08, 0.86),
        (0.112, 0.77),
        (0.225, 0.61),
        (0.28, 0.45),
        (0.265, 0.3),
        (0.18, 0.13),
        (0.1, 0.045),
        (0.0, 0.035),
    ]);
    lathe(&points, 8, around_count)
}

/// A round pot with a lid and a knob, 0.8 m tall. Slot 0 is the body, slot 1 the lid.
pub fn pot(around_count: usize) -> TriangleMesh {
    let body = profile(&[
        (0.0, 0.0),
        (0.26, 0.0),
        (0.26, 0.0),
        (0.29, 0.015),
        (0.29, 0.04),
        (0.35, 0.1),
        (0.46, 0.25),
        (0.47, 0.38),
        (0.4, 0.51),
        (0.34, 0.56),
        (0.345, 0.585),
        (0.32, 0.59),
        (0.315, 0.56),
        (0.38, 0.49),
        (0.44, 0.37),
        (0.43, 0.25),
        (0.33, 0.11),
        (0.2, 0.05),
        (0.0, 0.045),
    ]);
    let lid = profile(&[
        (0.0, 0.566),
        (0.31, 0.566),
        (0.31, 0.566),
        (0.313, 0.585),
        (0.29, 0.61),
        (0.18, 0.66),
        (0.07, 0.69),
        (0.04, 0.71),
        (0.065, 0.745),
        (0.075, 0.77),
        (0.05, 0.795),
        (0.0, 0.8),
    ]);
    let (body, lid) = (lathe(&body, 8, around_count), lathe(&lid, 8, around_count));
    merge(&[(&body, Affine3A::IDENTITY, 0), (&lid, Affine3A::IDENTITY, 1)])
}

/// A tall slab with softly rounded edges, 0.45 × 1 × 0.18 m: something to catch highlights on edges.
pub fn monolith() -> TriangleMesh {
    rounded_box(Vec3::new(0.45, 1.0, 0.18), 0.025, 8)
}

/// A pebble-like blob: a sphere of a radius pushed in and out by noise of a seed, standing on y = 0.
/// 20 · 4ⁿ triangles for n = `subdivisions` (at most 8).
pub fn blob(radius: f32, seed: u32, subdivisions: u32) -> TriangleMesh {
    let mut mesh = ico_sphere(1.0, subdivisions);
    for position in &mut mesh.positions {
        let p = *position;
        let swell = 0.34 * noise3(1.25 * p + Vec3::splat(10.0), seed) + 0.1 * noise3(2.9 * p, seed ^ 0x55);
        *position = radius * (1.0 + swell) * p;
    }
    let low = mesh.positions.iter().fold(f32::INFINITY, |low, p| low.min(p.y));
    for position in &mut mesh.positions {
        position.y -= low;
    }
    smooth_across_seams(&mut mesh);
    mesh
}

/// A ball to judge materials by, 1.25 m tall: a ball with a groove that shows an inner ball (slot 0 the outer,
/// slot 1 the inner), on a pedestal (slot 1) with a ring (slot 2).
pub fn shader_ball(around_count: usize) -> TriangleMesh {
    let (radius, center) = (0.5f32, 0.75f32);
    let at = |degrees: f32, radius: f32| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        (radius * cos, center + radius * sin)
    };
    let arc = |from: f32, to: f32, radius: f32| {
        (0..=12).map(move |i| at(from + (to - from) * i as f32 / 12.0, radius))
    };
    // The shell up to the groove: outside upwards, over the rim, inside downwards, and back at the bottom.
    let (bottom, rim, wall) = (-62.0, 24.0, 0.93 * radius);
    let mut shell: Vec<_> = arc(bottom, rim, radius).collect();
    shell.extend([at(rim, radius), at(rim, wall)]);
    shell.extend(arc(rim, bottom, wall));
    shell.extend([at(bottom, wall), at(bottom, radius)]);
    let shell = lathe(&profile(&shell), 3, around_count);
    // The cap above it, closed from below by a flat cone.
    let mut cap = vec![(0.0, center + 0.4 * radius), at(31.0, radius)];
    cap.extend(arc(31.0, 90.0, radius));
    let top = cap.len() - 1;
    cap[top].0 = 0.0;
    let cap = lathe(&profile(&cap), 3, around_count);
    let inner = uv_sphere(0.88 * radius, around_count, around_count / 2);
    let pedestal = profile(&[
        (0.0, 0.0),
        (0.4, 0.0),
        (0.4, 0.0),
        (0.42, 0.01),
        (0.42, 0.05),
        (0.4, 0.065),
        (0.33, 0.08),
        (0.27, 0.13),
        (0.25, 0.22),
        (0.26, 0.34),
        (0.26, 0.34),
        (0.0, 0.34),
    ]);
    let pedestal = lathe(&pedestal, 6, around_count);
    let ring = torus(0.285, 0.035, around_count, around_count / 3);
    let lift = |y: f32| Affine3A::from_translation(Vec3::new(0.0, y, 0.0));
    merge(&[
        (&shell, Affine3A::IDENTITY, 0),
        (&cap, Affine3A::IDENTITY, 0),
        (&inner, lift(center), 1),
        (&pedestal, Affine3A::IDENTITY, 1),
        (&ring, lift(0.3), 2),
    ])
}

/// A simple standing figure of capsules, of the given height, facing +z.
pub fn figure(height: f32) -> TriangleMesh {
    let limb = |from: (f32, f32, f32), to: (f32, f32, f32), radius: f32| {
        capsule(Vec3::from(from), Vec3::from(to), radius, 32)
    };
    let mut parts = vec![
        limb((0.0, 0.56, 0.0), (0.0, 0.76, 0.0), 0.1),
        limb((0.0, 0.8, 0.0), (0.0, 0.86, 0.0), 0.035),
        limb((0.0, 0.91, 0.005), (0.0, 0.94, 0.005), 0.06),
    ];
    for side in [-1.0, 1.0] {
        let out = |x: f32, y: f32, z: f32| (side * x, y, z);
        parts.extend([
            limb(out(0.055, 0.53, 0.0), out(0.065, 0.29, 0.015), 0.055),
            limb(out(0.065, 0.29, 0.015), out(0.07, 0.06, 0.0), 0.042),
            limb(out(0.07, 0.027, -0.01), out(0.078, 0.027, 0.08), 0.027),
            limb(out(0.115, 0.79, 0.0), out(0.16, 0.62, 0.0), 0.036),
            limb(out(0.16, 0.62, 0.0), out(0.175, 0.46, 0.04), 0.029),
        ]);
    }
    let scale = Affine3A::from_scale(Vec3::splat(height));
    let parts: Vec<_> = parts.iter().map(|part| (part, scale, 0)).collect();
    merge(&parts)
}
