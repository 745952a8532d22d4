#![allow(clippy::unwrap_used)]

use std::sync::Arc;

use glam::{Affine3A, Quat, Vec2, Vec3};
use halflight_shape::TriangleMesh;

use crate::{Geometry, Instance, MeshTracer, Motion, Ray, Rectangle, Simd, Sphere, SphereTracer, World};

fn triangle() -> Geometry {
    let mesh = TriangleMesh {
        positions: vec![Vec3::new(-2.0, -2.0, 0.0), Vec3::new(2.0, -2.0, 0.3), Vec3::new(0.0, 3.0, -0.2)],
        triangles: vec![[0, 1, 2]],
        normals: vec![
            Vec3::new(-0.3, -0.2, 1.0).normalize(),
            Vec3::new(0.4, 0.1, 1.0).normalize(),
            Vec3::new(0.0, 0.3, 1.0).normalize(),
        ],
        uvs: vec![Vec2::new(0.1, 0.9), Vec2::new(0.8, 0.7), Vec2::new(0.4, 0.2)],
        ..TriangleMesh::default()
    };
    Geometry::Mesh(MeshTracer::build(Arc::new(mesh)))
}

#[test]
fn gradients_are_the_differences_of_neighbours() {
    let sphere = || {
        Geometry::Spheres(SphereTracer::build(vec![Sphere { center: Vec3::new(0.1, 0.2, 0.0), radius: 1.3 }]))
    };
    let turned = Affine3A::from_scale_rotation_translation(
        Vec3::splat(0.8),
        Quat::from_euler(glam::EulerRot::XYZ, 0.2, -0.3, 0.4),
        Vec3::new(0.1, -0.1, 0.2),
    );
    for geometry in [triangle(), sphere(), Geometry::Rectangle(Rectangle)] {
        let transform = Motion { open: turned, close: turned };
        let world = World::build(vec![Instance { geometry: Arc::new(geometry), transform }], Simd::detect());
        let origin = Vec3::new(0.15, 0.1, 5.0);
        let look = |x: f32, y: f32| {
            let ray = Ray::new(origin, Vec3::new(x, y, -1.0).normalize());
            let hit = world.closest(&ray).unwrap();
            (hit, world.surface(&ray, &hit))
        };
        let (hit, middle) = look(0.02, -0.015);
        let found = world.gradients(&hit, 0.0, &middle).unwrap();
        for (dx, dy) in [(2e-3, 0.0), (0.0, 2e-3), (-1e-3, 2e-3)] {
            let (_, other) = look(0.02 + dx, -0.015 + dy);
            let step = other.position - middle.position;
            let (u, v) = (found.u.dot(step), found.v.dot(step));
            let duv = other.uv - middle.uv;
            assert!((duv - Vec2::new(u, v)).length() < 0.02 * duv.length() + 1e-6, "{duv} {u} {v}");
            let turn = other.shading_normal - middle.shading_normal;
            let told = found.normal * step;
            assert!((turn - told).length() < 0.03 * turn.length() + 1e-5, "{turn} {told}");
        }
    }
}
