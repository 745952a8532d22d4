//! No ray gets between two triangles that share an edge.

use glam::{Affine3A, Vec3};

use halflight_trace::Ray;

use crate::common::{Numbers, levels, placed, scaled, sphere, world};

/// Rays from inside a closed mesh at its vertices and at points on its edges: each must hit.
#[test]
fn nothing_leaks_at_vertices_and_edges_of_a_closed_mesh() {
    let mut numbers = Numbers(1);
    for (scale, offset) in
        [(1.0, Vec3::ZERO), (1e-3, Vec3::ZERO), (1e5, Vec3::ZERO), (1.0, Vec3::new(1000.0, -300.0, 77.0))]
    {
        let mesh = scaled(sphere(3), scale, offset);
        let mut targets = mesh.positions.clone();
        for triangle in &mesh.triangles {
            for side in 0..3 {
                let [a, b] = [triangle[side], triangle[(side + 1) % 3]].map(|i| mesh.positions[i as usize]);
                targets.push((a + b) * 0.5);
                targets.push(a.lerp(b, numbers.next()));
            }
        }
        for simd in levels() {
            let world = world(mesh.clone(), simd);
            for origin in
                [Vec3::ZERO, Vec3::new(0.3, 0.2, -0.4), Vec3::new(0.0, 0.5, 0.0)].map(|p| p * scale + offset)
            {
                for &target in &targets {
                    let ray = Ray::new(origin, (target - origin).normalize());
                    assert!(world.closest(&ray).is_some(), "{simd:?}, scale {scale}: leak towards {target}");
                    assert!(world.occluded(&ray));
                }
            }
        }
    }
}

/// A grid whose vertices and edges line up with the axes, and rays that run exactly along them: products are exact
/// zeros here, and boxes are flat.
#[test]
fn nothing_leaks_through_a_grid_met_exactly_at_its_lines() {
    let size = 16;
    let mut mesh = halflight_shape::TriangleMesh::default();
    for j in 0..=size {
        for i in 0..=size {
            mesh.positions.push(Vec3::new(i as f32, 0.0, j as f32));
        }
    }
    for j in 0..size {
        for i in 0..size {
            let corner = |di: u32, dj: u32| (j + dj) * (size + 1) + i + di;
            mesh.triangles.push([corner(0, 0), corner(0, 1), corner(1, 1)]);
            mesh.triangles.push([corner(0, 0), corner(1, 1), corner(1, 0)]);
        }
    }
    for simd in levels() {
        for shift in [Vec3::ZERO, Vec3::new(-8.0, 3.0, -8.0), Vec3::new(1000.0, 0.0, 4000.0)] {
            let world = world(scaled(mesh.clone(), 1.0, shift), simd);
            for j in 0..=2 * size {
                for i in 0..=2 * size {
                    let target = Vec3::new(i as f32 * 0.5, 0.0, j as f32 * 0.5) + shift;
                    for direction in
                        [Vec3::NEG_Y, Vec3::Y, Vec3::new(0.0, -1.0, 1.0), Vec3::new(1.0, -2.0, 0.0)]
                    {
                        let direction = direction.normalize();
                        let ray = Ray::new(target - direction * 4.0, direction);
                        // At the border a slanted ray may pass by a rounding.
                        let inside = i > 0 && j > 0 && i < 2 * size && j < 2 * size;
                        if inside || direction.y.abs() == 1.0 {
                            let hit = world.closest(&ray);
                            assert!(hit.is_some(), "{simd:?}: leak at {target} along {direction}");
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn nothing_leaks_out_of_an_instance() {
    let mut numbers = Numbers(2);
    let transform = Affine3A::from_translation(Vec3::new(500.0, -20.0, 90.0))
        * Affine3A::from_axis_angle(Vec3::new(1.0, 2.0, 3.0).normalize(), 0.7)
        * Affine3A::from_scale(Vec3::new(3.0, 0.2, 1.0));
    for simd in levels() {
        let world = placed(sphere(4), transform, simd);
        let inside = transform.transform_point3(Vec3::ZERO);
        for _ in 0..20_000 {
            assert!(world.occluded(&Ray::new(inside, numbers.direction())));
        }
    }
}
