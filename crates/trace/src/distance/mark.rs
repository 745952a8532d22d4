//! Voxels that surfaces may pass.

use glam::{Affine3A, Vec3};

use crate::{Geometry, Instance};

/// The grid while it is marked.
pub(super) struct Frame {
    pub(super) low: Vec3,
    pub(super) voxel: f32,
    pub(super) size: [usize; 3],
}

/// By how much more a voxel's middle may be off what moves: a quarter of a voxel, as steps are half of one.
const STEP: f32 = 0.26;

impl Frame {
    /// The voxels that a box meets, lower and upper; none if it is not finite.
    fn span(&self, low: Vec3, high: Vec3) -> Option<[[usize; 3]; 2]> {
        if !(low.is_finite() && high.is_finite()) {
            return None;
        }
        // A hair more than the box: its corners are rounded.
        let hair = STEP * self.voxel;
        let (a, b) = ((low - self.low - hair) / self.voxel, (high - self.low + hair) / self.voxel);
        // Beyond the border of a grid of a part of the world.
        let size = Vec3::from(self.size.map(|n| n as f32));
        if a.cmpgt(size).any() || b.cmplt(Vec3::ZERO).any() {
            return None;
        }
        let at = |v: f32, n: usize| (v.max(0.0) as usize).min(n - 1);
        Some([
            std::array::from_fn(|axis| at(a[axis], self.size[axis])),
            std::array::from_fn(|axis| at(b[axis], self.size[axis])),
        ])
    }

    fn middle(&self, index: [usize; 3]) -> Vec3 {
        self.low + (Vec3::from(index.map(|i| i as f32)) + 0.5) * self.voxel
    }

    /// Marks the voxels of a span that may hold a surface.
    fn fill(&self, span: [[usize; 3]; 2], marks: &mut dyn FnMut(usize), may: impl Fn(Vec3) -> bool) {
        let [low, high] = span;
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                for x in low[0]..=high[0] {
                    if may(self.middle([x, y, z])) {
                        marks((z * self.size[1] + y) * self.size[0] + x);
                    }
                }
            }
        }
    }

    fn triangle(&self, corners: [Vec3; 3], marks: &mut dyn FnMut(usize)) {
        let [a, b, c] = corners;
        let Some(span) = self.span(a.min(b).min(c), a.max(b).max(c)) else { return };
        let normal = (b - a).cross(c - a).normalize_or_zero();
        // Half a diagonal, and what rounding adds. A triangle without area is marked with its box.
        let reach = (0.867 + STEP) * self.voxel;
        self.fill(span, marks, |middle| (middle - a).dot(normal).abs() <= reach);
    }

    fn sphere(&self, to_world: &Affine3A, center: Vec3, radius: f32, marks: &mut dyn FnMut(usize)) {
        let matrix = to_world.matrix3;
        let scales = [matrix.x_axis.length(), matrix.y_axis.length(), matrix.z_axis.length()];
        let (least, most) =
            (scales.iter().copied().fold(f32::MAX, f32::min), scales.iter().copied().fold(0.0, f32::max));
        let middle = to_world.transform_point3(center);
        let Some(span) = self.span(middle - radius * most * 1.001, middle + radius * most * 1.001) else {
            return;
        };
        let reach = (0.867 + STEP) * self.voxel;
        // Sheared ones are filled; round ones have a hollow.
        let inner = if most - least <= 1e-3 * most { radius * least - reach } else { -1.0 };
        self.fill(span, marks, |point| {
            let distance = point.distance(middle);
            distance >= inner && distance <= radius * most + reach
        });
    }

    /// Marks everything of an instance at one time of the shutter.
    pub(super) fn instance(
        &self,
        instance: &Instance,
        time: f32,
        part: [usize; 2],
        marks: &mut dyn FnMut(usize),
    ) {
        let to_world = instance.transform.at(time);
        let world = |corners: [Vec3; 3]| corners.map(|p| to_world.transform_point3(p));
        let square = |corners: [[f32; 2]; 4]| corners.map(|[x, y]| Vec3::new(x, y, 0.0));
        match &*instance.geometry {
            Geometry::Mesh(mesh) => {
                for triangle in part[0]..part[1] {
                    self.triangle(world(mesh.corners(triangle as u32, time)), marks);
                }
            }
            Geometry::HeightField(field) => {
                for primitive in part[0]..part[1] {
                    self.triangle(world(field.corners(primitive as u32, time).map(|(p, _)| p)), marks);
                }
            }
            Geometry::Spheres(spheres) => {
                for sphere in &spheres.spheres()[part[0]..part[1]] {
                    self.sphere(&to_world, sphere.center, sphere.radius, marks);
                }
            }
            Geometry::Rectangle(_) | Geometry::Disk(_) => {
                // The unit square holds the unit disk.
                let [a, b, c, d] = square([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]);
                self.triangle(world([a, b, c]), marks);
                self.triangle(world([a, c, d]), marks);
            }
            Geometry::Custom(custom) => {
                let (low, high) = custom.bounds();
                let corner = |i: usize| {
                    let pick =
                        |bit: usize, axis: usize| if i >> bit & 1 == 0 { low[axis] } else { high[axis] };
                    to_world.transform_point3(Vec3::new(pick(0, 0), pick(1, 1), pick(2, 2)))
                };
                let corners: [Vec3; 8] = std::array::from_fn(corner);
                let low = corners.into_iter().reduce(Vec3::min).unwrap_or_default();
                let high = corners.into_iter().reduce(Vec3::max).unwrap_or_default();
                if let Some(span) = self.span(low, high) {
                    self.fill(span, marks, |_| true);
                }
            }
        }
    }
}

/// How many primitives an instance is marked by.
pub(super) fn primitives(geometry: &Geometry) -> usize {
    match geometry {
        Geometry::Mesh(mesh) => mesh.mesh().triangles.len(),
        Geometry::Spheres(spheres) => spheres.spheres().len(),
        Geometry::HeightField(_) => geometry.as_rays().primitives(),
        Geometry::Rectangle(_) | Geometry::Disk(_) | Geometry::Custom(_) => 1,
    }
}
