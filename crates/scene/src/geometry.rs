//! From forms to geometry that answers rays.

use std::sync::Arc;

use glam::Vec3;
use halflight_shape::HeightField;
use halflight_trace::{Disk, Geometry, HeightFieldTracer, Rectangle, Sphere, SphereTracer};

/// Spheres, each a primitive, all of material slot 0.
pub(crate) fn spheres(list: &[(Vec3, f32)]) -> Geometry {
    let spheres = list.iter().map(|&(center, radius)| Sphere { center, radius }).collect();
    Geometry::Spheres(SphereTracer::build(spheres))
}

/// Heights.
pub(crate) fn height_field(field: Arc<HeightField>) -> Geometry {
    Geometry::HeightField(HeightFieldTracer::build(field))
}

/// Heights that go in straight lines from one field to another of the same posts.
pub(crate) fn moving_height_field(open: Arc<HeightField>, close: Arc<HeightField>) -> Geometry {
    Geometry::HeightField(HeightFieldTracer::build_moving(open, close))
}

/// The square [−1, 1]² of the xy-plane, facing +z.
pub(crate) fn rectangle() -> Geometry {
    Geometry::Rectangle(Rectangle)
}

/// The unit disk of the xy-plane, facing +z.
pub(crate) fn disk() -> Geometry {
    Geometry::Disk(Disk)
}

/// Points of a height field, enough to see how far it reaches.
pub(crate) fn outline(field: &HeightField) -> Vec<Vec3> {
    /// Posts along each side that are looked at.
    const POSTS: usize = 65;
    let along = |count: usize| (0..POSTS).map(move |i| i * (count - 1) / (POSTS - 1));
    let step = (field.max - field.min) / glam::Vec2::new((field.columns - 1) as f32, (field.rows - 1) as f32);
    along(field.rows)
        .flat_map(|j| {
            along(field.columns).map(move |i| {
                let height = field.heights[j * field.columns + i];
                Vec3::new(field.min.x + i as f32 * step.x, height, field.min.y + j as f32 * step.y)
            })
        })
        .collect()
}
