//! Points that stand for the surface and the inside of a mesh.

use glam::Vec3;

use super::solid::Solid;

/// 1/ρ and 1/ρ² of the plastic number ρ: steps of Roberts' R₂ sequence, which fills the square evenly.
const R2: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];

/// A point on the surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfacePoint {
    pub(super) position: Vec3,
    pub(super) triangle: u32,
    /// Of the triangle's corners.
    pub(super) weights: [f32; 3],
}

/// The area of all triangles, in f64.
pub(super) fn area(positions: &[Vec3], triangles: &[[u32; 3]]) -> f64 {
    triangles.iter().map(|t| triangle_area(t.map(|v| positions[v as usize]))).sum()
}

fn triangle_area([a, b, c]: [Vec3; 3]) -> f64 {
    let [a, b, c] = [a, b, c].map(|p| p.as_dvec3());
    0.5 * (b - a).cross(c - a).length()
}

/// `count` points, each for an equal share of the area, in the order of the triangles; none if there is no area.
pub(super) fn on_surface(positions: &[Vec3], triangles: &[[u32; 3]], count: usize) -> Vec<SurfacePoint> {
    let total = area(positions, triangles);
    let mut points = Vec::with_capacity(count);
    if !(total > 0.0 && total.is_finite()) {
        return points;
    }
    let step = total / count as f64;
    let mut passed = 0.0;
    for (index, triangle) in triangles.iter().enumerate() {
        let corners = triangle.map(|v| positions[v as usize]);
        passed += triangle_area(corners);
        while points.len() < count && (points.len() as f64 + 0.5) * step < passed {
            let k = points.len() as f64 + 0.5;
            let [u, v] = R2.map(|r| (k * r).fract() as f32);
            // The square folded onto the triangle keeps the sequence even.
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let weights = [1.0 - u - v, u, v];
            let position = weights[0] * corners[0] + weights[1] * corners[1] + weights[2] * corners[2];
            points.push(SurfacePoint { position, triangle: index as u32, weights });
        }
    }
    points
}

/// About `count` centres of inside cells at equal steps through their list; fewer if there are fewer.
pub(super) fn within(solid: &Solid, count: usize) -> Vec<Vec3> {
    let cells = solid.cells();
    if cells.is_empty() || count == 0 {
        return Vec::new();
    }
    let step = (cells.len() as f64 / count as f64).max(1.0);
    let picks = (cells.len() as f64 / step) as usize;
    (0..picks).map(|k| solid.center(cells[((k as f64 + 0.5) * step) as usize % cells.len()])).collect()
}
