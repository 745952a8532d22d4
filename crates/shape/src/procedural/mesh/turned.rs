//! Turned shapes: a profile rotated about the y axis.

use glam::{Vec2, Vec3};

use super::grid;
use super::round::around;
use crate::TriangleMesh;

/// Points on a smooth curve through the profile, each with its outward normal (in radius and height). A point that
/// is given twice in a row is a crease: the curve ends and starts anew there.
fn smooth_profile(profile: &[Vec2], steps: usize) -> Vec<(Vec2, Vec2)> {
    let mut curve = Vec::new();
    for piece in profile.chunk_by(|a, b| a != b).filter(|piece| piece.len() > 1) {
        let at = |i: isize| {
            // Beyond its ends the piece goes on straight.
            let last = piece.len() as isize - 1;
            if i < 0 {
                2.0 * piece[0] - piece[1]
            } else if i > last {
                2.0 * piece[last as usize] - piece[last as usize - 1]
            } else {
                piece[i as usize]
            }
        };
        let spans = piece.len() - 1;
        let steps = if spans == 1 { 1 } else { steps.max(1) };
        for step in 0..=spans * steps {
            let span = (step / steps).min(spans - 1) as isize;
            let t = (step as f32 - span as f32 * steps as f32) / steps as f32;
            let [a, b, c, d] = [at(span - 1), at(span), at(span + 1), at(span + 2)];
            // The end is taken as it was given: rounding would leave a hole at the axis and between pieces.
            let bend = 2.0 * a - 5.0 * b + 4.0 * c - d;
            let inner = b + 0.5 * t * (c - a + t * (bend + t * (3.0 * (b - c) + d - a)));
            let point = if step == spans * steps { piece[spans] } else { inner };
            let slope = 0.5 * (c - a + t * (2.0 * bend + 3.0 * t * (3.0 * (b - c) + d - a)));
            let normal = Vec2::new(slope.y, -slope.x).normalize_or(Vec2::X);
            curve.push((Vec2::new(point.x.max(0.0), point.y), normal));
        }
    }
    curve
}

/// Turns a profile of (radius, height) about the y axis. The profile runs with the outside on its right: upwards
/// along the outer wall. A curve (Catmull–Rom, `steps` pieces a span) goes smoothly through its points; a point
/// given twice in a row makes a crease, and two points alone a straight line. Closed if it begins and ends on the
/// axis (radius 0). Texture u goes around, v down along the profile's length.
pub fn lathe(profile: &[Vec2], steps: usize, around_count: usize) -> TriangleMesh {
    let curve = smooth_profile(profile, steps);
    if curve.len() < 2 {
        return TriangleMesh::default();
    }
    let mut lengths = vec![0.0];
    for pair in curve.windows(2) {
        lengths.push(lengths[lengths.len() - 1] + pair[0].0.distance(pair[1].0));
    }
    let total = lengths[lengths.len() - 1].max(f32::MIN_POSITIVE);
    let last = curve.len() - 1;
    let around_count = around_count.max(3);
    let mut mesh = grid(around_count, last, |u, v| {
        let (point, normal) = curve[(v * last as f32).round() as usize];
        let circle = around(u);
        let turn = |p: Vec2| Vec3::new(p.x * circle.x, p.y, p.x * circle.y);
        (turn(point), turn(normal))
    });
    for (vertex, uv) in mesh.uvs.iter_mut().enumerate() {
        uv.y = 1.0 - lengths[vertex / (around_count + 1)] / total;
    }
    mesh
}

/// A closed cylinder on y = 0 about the y axis.
pub fn cylinder(radius: f32, height: f32, around_count: usize) -> TriangleMesh {
    let (low, high) = (Vec2::new(radius, 0.0), Vec2::new(radius, height));
    lathe(&[Vec2::ZERO, low, low, high, high, Vec2::new(0.0, height)], 1, around_count)
}

/// A closed cone on y = 0 about the y axis, its tip up.
pub fn cone(radius: f32, height: f32, around_count: usize) -> TriangleMesh {
    let rim = Vec2::new(radius, 0.0);
    lathe(&[Vec2::ZERO, rim, rim, Vec2::new(0.0, height)], 1, around_count)
}

/// A round ground in the plane y = 0 about the origin, facing up; texture as a picture seen from above.
pub fn disk(radius: f32, around_count: usize) -> TriangleMesh {
    let mut mesh = lathe(&[Vec2::new(radius, 0.0), Vec2::ZERO], 1, around_count);
    for (uv, position) in mesh.uvs.iter_mut().zip(&mesh.positions) {
        *uv = 0.5 + 0.5 * Vec2::new(position.x, position.z) / radius;
    }
    mesh
}
