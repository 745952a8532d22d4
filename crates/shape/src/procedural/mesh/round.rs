//! Spheres, tori and tubes.

use std::collections::HashMap;
use std::f32::consts::{PI, TAU};

use glam::{Affine3A, Quat, Vec2, Vec3};

use super::{grid, merge};
use crate::TriangleMesh;

/// A point on the circle of the angle 2π turn, in x and z; exactly closed at turn = 1.
pub(super) fn around(turn: f32) -> Vec2 {
    Vec2::from_angle(TAU * if turn >= 1.0 { 0.0 } else { turn })
}

/// A sphere about the origin, cut along meridians and parallels; u around, eastwards, v = 0 at the top.
pub fn uv_sphere(radius: f32, around_count: usize, along_count: usize) -> TriangleMesh {
    grid(around_count.max(3), along_count.max(2), |u, v| {
        let polar = PI * v;
        let ring = if v <= 0.0 || v >= 1.0 { 0.0 } else { polar.sin() };
        let circle = around(u) * ring;
        let normal = Vec3::new(circle.x, -polar.cos(), circle.y);
        (radius * normal, normal)
    })
}

/// A sphere about the origin from an icosahedron whose faces were cut in four `subdivisions` times (at most 8):
/// 20 · 4ⁿ nearly equal triangles. Texture coordinates as [`uv_sphere`], with the seam stretched over one triangle.
pub fn ico_sphere(radius: f32, subdivisions: u32) -> TriangleMesh {
    let golden = 0.5 + 0.5 * 5f32.sqrt();
    let mut points = Vec::new();
    for (a, b) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
        points.extend([Vec3::new(a, b, 0.0), Vec3::new(0.0, a, b), Vec3::new(b, 0.0, a)]);
    }
    for point in &mut points {
        *point = point.normalize();
    }
    // The faces are the triples at edge distance, turned to face outwards.
    let edge = 1.1 * points.iter().map(|p| p.distance(points[0])).filter(|d| *d > 0.1).fold(9.0, f32::min);
    let near = |a: usize, b: usize| points[a].distance(points[b]) < edge;
    let mut triangles = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(c, a) {
                    let outward = (points[b] - points[a]).cross(points[c] - points[a]).dot(points[a]) > 0.0;
                    triangles.push(if outward { [a, b, c] } else { [a, c, b] }.map(|v| v as u32));
                }
            }
        }
    }
    for _ in 0..subdivisions.min(8) {
        let mut middles = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                points.push((points[a as usize] + points[b as usize]).normalize());
                (points.len() - 1) as u32
            })
        };
        let mut finer = Vec::with_capacity(4 * triangles.len());
        for [a, b, c] in triangles {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    let uv = |p: &Vec3| Vec2::new(0.5 - p.z.atan2(p.x) / TAU, p.y.clamp(-1.0, 1.0).acos() / PI);
    TriangleMesh {
        positions: points.iter().map(|&p| radius * p).collect(),
        uvs: points.iter().map(uv).collect(),
        normals: points,
        triangles,
        ..TriangleMesh::default()
    }
}

/// A ring about the y axis: `radius` to the middle of the tube, `tube` the radius of the tube.
pub fn torus(radius: f32, tube: f32, around_count: usize, tube_count: usize) -> TriangleMesh {
    grid(around_count.max(3), tube_count.max(3), |u, v| {
        let (circle, section) = (around(u), around(v));
        let normal = Vec3::new(circle.x * section.x, section.y, circle.y * section.x);
        (Vec3::new(radius * circle.x, 0.0, radius * circle.y) + tube * normal, normal)
    })
}

/// A torus knot that winds p times around the y axis and q times around the ring, as a tube; `radius` is that of the
/// ring, half of it the reach of the windings. Centred on the origin.
pub fn knot(p: u32, q: u32, radius: f32, tube: f32, along_count: usize, tube_count: usize) -> TriangleMesh {
    let curve = |t: f32| {
        let (ring, winding) = (around((p as f32 * t).fract()), around((q as f32 * t).fract()));
        let reach = radius * (1.0 + 0.4 * winding.x);
        Vec3::new(reach * ring.x, 0.4 * radius * winding.y, reach * ring.y)
    };
    grid(tube_count.max(3), along_count.max(8), |u, v| {
        let at = if v >= 1.0 { 0.0 } else { v };
        let step = 1e-3;
        let (before, center, after) =
            (curve((at - step).rem_euclid(1.0)), curve(at), curve((at + step).fract()));
        let tangent = (after - before).normalize_or(Vec3::X);
        // The windings never run radially to the middle of the ring's section, so this frame never turns over.
        let ring = Vec3::new(center.x, 0.0, center.z).normalize_or(Vec3::X) * radius;
        let outward = (center - ring).reject_from_normalized(tangent).normalize_or(Vec3::Y);
        let sideways = tangent.cross(outward);
        let section = around(u);
        let normal = outward * section.x - sideways * section.y;
        (center + tube * normal, normal)
    })
}

/// A cylinder with round ends from `a` to `b` (the centres of the ends).
pub fn capsule(a: Vec3, b: Vec3, radius: f32, around_count: usize) -> TriangleMesh {
    let around_count = around_count.max(8);
    let along_count = around_count / 2 + 2;
    let length = a.distance(b);
    let upright = grid(around_count, along_count, |u, v| {
        // One row of quads is the straight part; the others are the ends.
        let row = (v * along_count as f32).round() as usize;
        let (steps, half) = (along_count - 1, (along_count - 1) / 2);
        let (polar, y) = if row <= half {
            (PI * row as f32 / (2 * half) as f32, 0.0)
        } else {
            (PI * (0.5 + 0.5 * (row - half - 1) as f32 / (steps - half) as f32), length)
        };
        let ring = if row == 0 || row == along_count { 0.0 } else { polar.sin() };
        let circle = around(u) * ring;
        let normal = Vec3::new(circle.x, -polar.cos(), circle.y);
        (radius * normal + Vec3::new(0.0, y, 0.0), normal)
    });
    let turn = Quat::from_rotation_arc(Vec3::Y, (b - a).normalize_or(Vec3::Y));
    merge(&[(&upright, Affine3A::from_rotation_translation(turn, a), 0)])
}
