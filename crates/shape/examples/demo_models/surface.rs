//! Closed surfaces around a line of sections.

use glam::Vec3;
use halflight_shape::TriangleMesh;

/// An ellipse across a body: its middle and two half axes, at right angles; `across` × `up` points along the body.
#[derive(Clone, Copy)]
pub(crate) struct Section {
    pub(crate) middle: Vec3,
    pub(crate) across: Vec3,
    pub(crate) up: Vec3,
}

/// A surface through the sections, closed at both ends by a point in the middle of the end sections.
pub(crate) fn loft(sections: &[Section], around: usize) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    for section in sections {
        for i in 0..around {
            let (sin, cos) = (std::f32::consts::TAU * i as f32 / around as f32).sin_cos();
            mesh.positions.push(section.middle + cos * section.across + sin * section.up);
        }
    }
    let n = around as u32;
    for ring in 0..sections.len() as u32 - 1 {
        for i in 0..n {
            let (a, b) = (ring * n + i, ring * n + (i + 1) % n);
            mesh.triangles.push([a, b, b + n]);
            mesh.triangles.push([a, b + n, a + n]);
        }
    }
    let last = (sections.len() as u32 - 1) * n;
    for (ring, middle) in [(0, sections[0].middle), (last, sections[sections.len() - 1].middle)] {
        let pole = mesh.positions.len() as u32;
        mesh.positions.push(middle);
        for i in 0..n {
            let (a, b) = (ring + i, ring + (i + 1) % n);
            mesh.triangles.push(if ring == 0 { [pole, b, a] } else { [pole, a, b] });
        }
    }
    mesh.compute_smooth_normals();
    mesh
}

/// A cone from a point to another with round ends; `flat` is how far the first one bulges, in its radius.
pub(crate) fn tapered(from: Vec3, to: Vec3, start: f32, end: f32, flat: f32, around: usize) -> TriangleMesh {
    const CAP: usize = 4;
    let axis = (to - from).normalize();
    let (across, up) = axis.any_orthonormal_pair();
    let (across, up) = if across.cross(up).dot(axis) > 0.0 { (across, up) } else { (up, across) };
    let mut sections = Vec::new();
    let mut ring = |place: Vec3, radius: f32| {
        let radius = radius.max(1e-3 * start.max(end));
        sections.push(Section { middle: place, across: across * radius, up: up * radius });
    };
    for i in 0..=CAP {
        let (sin, cos) = (std::f32::consts::FRAC_PI_2 * i as f32 / CAP as f32).sin_cos();
        ring(from - axis * (flat * start * cos), start * sin);
    }
    for i in 1..4 {
        let t = i as f32 / 4.0;
        ring(from.lerp(to, t), start + (end - start) * t);
    }
    for i in 0..=CAP {
        let (sin, cos) = (std::f32::consts::FRAC_PI_2 * i as f32 / CAP as f32).sin_cos();
        ring(to + axis * (end * sin), end * cos);
    }
    loft(&sections, around)
}

/// Several surfaces as one.
pub(crate) fn append(whole: &mut TriangleMesh, part: &TriangleMesh) {
    let first = whole.positions.len() as u32;
    whole.positions.extend(&part.positions);
    whole.normals.extend(&part.normals);
    whole.triangles.extend(part.triangles.iter().map(|t| t.map(|v| v + first)));
}
