//! What shading is told.

use glam::{Affine3A, Vec2, Vec3, Vec4};

use halflight_shape::TriangleMesh;
use halflight_trace::{Ray, Simd, Surface};

use crate::common::{Numbers, placed, sphere};

fn triangle() -> TriangleMesh {
    TriangleMesh {
        positions: vec![Vec3::ZERO, Vec3::X * 2.0, Vec3::Y * 2.0],
        triangles: vec![[0, 1, 2]],
        ..TriangleMesh::default()
    }
}

fn ask(mesh: TriangleMesh, transform: Affine3A) -> Surface {
    let world = placed(mesh, transform, Simd::detect());
    let target = transform.transform_point3(Vec3::new(0.5, 1.0, 0.0));
    let side = transform.matrix3.inverse().transpose() * glam::Vec3A::Z;
    let ray = Ray::new(target + Vec3::from(side).normalize(), -Vec3::from(side).normalize());
    let hit = world.closest(&ray).expect("the triangle is in the way");
    world.surface(&ray, &hit)
}

#[test]
fn attributes_are_interpolated_with_the_weights_of_the_corners() {
    let mut mesh = triangle();
    mesh.uvs = vec![Vec2::new(0.1, 0.9), Vec2::new(1.1, 0.9), Vec2::new(0.1, -0.1)];
    mesh.colors = vec![Vec3::X, Vec3::Y, Vec3::Z];
    mesh.normals = vec![Vec3::Z, Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.0, 0.6, 0.8)];
    mesh.material_slots = vec![7];
    let surface = ask(mesh, Affine3A::IDENTITY);
    // (0.5, 1) has the weights ¼, ¼, ½.
    assert!((surface.position - Vec3::new(0.5, 1.0, 0.0)).length() < 1e-6);
    assert!((surface.uv - Vec2::new(0.35, 0.4)).length() < 1e-6);
    assert!((surface.color - Vec3::new(0.25, 0.25, 0.5)).length() < 1e-6);
    assert_eq!(surface.geometric_normal, Vec3::Z);
    let expected =
        (Vec3::Z * 0.25 + Vec3::new(0.6, 0.0, 0.8) * 0.25 + Vec3::new(0.0, 0.6, 0.8) * 0.5).normalize();
    assert!((surface.shading_normal - expected).length() < 1e-6);
    assert_eq!(surface.material_slot, 7);
    assert!(surface.tangent.dot(Vec3::X) > 0.8 && surface.tangent.dot(surface.shading_normal).abs() < 1e-5);
    // u grows along x and v along −y: the picture stands upright, and its up is n × t.
    assert_eq!(surface.handedness, 1.0);
}

#[test]
fn tangents_of_the_mesh_are_used_with_their_hand() {
    let mut mesh = triangle();
    mesh.tangents = vec![Vec4::new(0.0, 1.0, 0.0, -1.0); 3];
    let surface = ask(mesh.clone(), Affine3A::IDENTITY);
    assert_eq!((surface.tangent, surface.handedness), (Vec3::Y, -1.0));
    let mirrored = ask(mesh, Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0)));
    assert_eq!((mirrored.tangent, mirrored.handedness), (Vec3::Y, 1.0), "a mirror turns the hand");
}

#[test]
fn the_bitangent_points_where_the_picture_is_up_also_in_a_mirror() {
    let mut mesh = triangle();
    mesh.uvs = vec![Vec2::ZERO, Vec2::X, Vec2::Y];
    for scale in [Vec3::ONE, Vec3::new(-1.0, 1.0, 1.0), Vec3::new(2.0, 3.0, -0.5)] {
        let transform = Affine3A::from_rotation_x(0.4) * Affine3A::from_scale(scale);
        let surface = ask(mesh.clone(), transform);
        let bitangent = surface.shading_normal.cross(surface.tangent) * surface.handedness;
        assert!(bitangent.dot(transform.transform_vector3(Vec3::NEG_Y).normalize()) > 0.999, "scale {scale}");
        assert!(surface.tangent.dot(transform.transform_vector3(Vec3::X).normalize()) > 0.999);
    }
}

#[test]
fn normals_that_disagree_with_the_winding_shade_but_do_not_turn_the_geometry() {
    let mut mesh = triangle();
    mesh.normals = vec![Vec3::NEG_Z; 3];
    let surface = ask(mesh, Affine3A::IDENTITY);
    assert_eq!(surface.geometric_normal, Vec3::Z);
    assert_eq!(surface.shading_normal, Vec3::Z);
}

#[test]
fn normals_that_cancel_or_are_no_normals_leave_the_surface_flat() {
    for normals in [vec![Vec3::ZERO; 3], vec![Vec3::NAN; 3], vec![Vec3::X, Vec3::X, Vec3::NEG_X]] {
        let mut mesh = triangle();
        mesh.normals = normals;
        let surface = ask(mesh, Affine3A::IDENTITY);
        assert_eq!(surface.shading_normal, Vec3::Z);
    }
}

#[test]
fn normals_of_a_squeezed_instance_are_perpendicular_to_it() {
    let transform = Affine3A::from_translation(Vec3::new(3.0, 4.0, 5.0))
        * Affine3A::from_rotation_z(0.5)
        * Affine3A::from_scale(Vec3::new(1.0, 0.25, 2.0));
    let world = placed(sphere(5), transform, Simd::detect());
    let centre = Vec3::new(3.0, 4.0, 5.0);
    let mut numbers = Numbers(50);
    for _ in 0..500 {
        let ray = Ray::new(centre, numbers.direction());
        let hit = world.closest(&ray).expect("from inside a closed mesh");
        let surface = world.surface(&ray, &hit);
        let local = transform.inverse().transform_point3(surface.position);
        let expected =
            Vec3::from(transform.matrix3.inverse().transpose() * glam::Vec3A::from(local)).normalize();
        assert!(surface.geometric_normal.dot(expected) > 0.99, "{} {expected}", surface.geometric_normal);
        assert!((surface.position - ray.at(hit.t)).length() < 1e-4);
        assert!(surface.position_error > 0.0 && surface.position_error < 1e-4);
    }
}
