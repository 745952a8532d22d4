//! Claims about fits, poses and balance; files and trees have their own.

use glam::{Affine3A, Quat, Vec2, Vec3};

use super::*;
use crate::TriangleMesh;
use crate::mesh::samples::{grid, octahedron};
use crate::procedural::mesh;

fn options(spheres: usize) -> SphereFitOptions {
    SphereFitOptions { spheres, resolution: 64, teleports: 10 }
}

fn fit(mesh: &TriangleMesh, spheres: usize) -> (SphereSet, SphereFitReport) {
    let (set, report) = SphereSet::fit("mesh", mesh, &options(spheres)).expect("it can be fitted");
    assert_eq!((set.len(), set.radii.len()), (spheres, spheres));
    assert!(set.centers.iter().all(|c| c.is_finite()) && set.radii.iter().all(|r| *r > 0.0 && r.is_finite()));
    assert!(report.measure.coverage.uncovered < 0.01, "{report:?}");
    for &vertex in mesh.triangles.iter().flatten() {
        let p = mesh.positions[vertex as usize];
        assert!(set.spheres().any(|(c, r)| p.distance(c) <= r), "vertex {vertex} at {p} is uncovered");
    }
    (set, report)
}

#[test]
fn one_sphere_for_a_sphere_is_that_sphere() {
    let place = Vec3::new(3.0, -20.0, 0.5);
    let ball = mesh::ico_sphere(2.0, 4).transformed(&Affine3A::from_translation(place));
    let (set, report) = fit(&ball, 1);
    assert!((set.radii[0] - 2.0).abs() < 0.02, "{}", set.radii[0]);
    assert!(set.centers[0].distance(place) < 0.02, "{}", set.centers[0]);
    assert!(report.measure.outside_fraction().expect("it has an inside") < 0.03, "{report:?}");
    assert!(report.has_interior && report.warnings.is_empty());
    assert!(set.silhouettes(&ball).least_iou > 0.97);
}

#[test]
fn a_capsule_gets_spheres_of_its_own_radius() {
    let capsule = mesh::capsule(Vec3::ZERO, Vec3::new(0.0, 2.0, 0.0), 0.5, 32);
    let (set, report) = fit(&capsule, 6);
    for (center, radius) in set.spheres() {
        assert!((0.45..0.68).contains(&radius), "{radius}");
        assert!(center.x.hypot(center.z) < 0.1, "{center}");
    }
    assert!(report.measure.outside_fraction().expect("it has an inside") < 0.4, "{report:?}");
    assert!(set.silhouettes(&capsule).mean_iou > 0.8);
}

#[test]
fn more_spheres_leave_less_volume_outside() {
    for solid in [mesh::cuboid(Vec3::new(1.0, 0.5, 2.0)), mesh::torus(1.0, 0.3, 48, 24)] {
        let outside = [2, 8, 32].map(|n| fit(&solid, n).1.measure.outside_volume);
        assert!(outside[0] > outside[1] && outside[1] > outside[2], "{outside:?}");
    }
}

#[test]
fn a_torus_keeps_its_hole() {
    let (set, _) = fit(&mesh::torus(1.0, 0.25, 48, 24), 16);
    assert!(set.spheres().all(|(c, r)| c.length() > r), "a sphere closes the hole: {set:?}");
}

#[test]
fn volumes_are_those_of_geometry() {
    let cuboid = mesh::cuboid(Vec3::new(1.0, 2.0, 3.0));
    let (low, high) = cuboid.bounds().expect("it has triangles");
    let set = SphereSet { centers: vec![0.5 * (low + high)], radii: vec![0.5], ..SphereSet::default() };
    let measure = set.measure(&cuboid);
    assert!((measure.mesh_volume - 6.0).abs() < 0.12, "{measure:?}");
    assert!((measure.union_volume - 4.0 / 3.0 * std::f64::consts::PI * 0.125).abs() < 0.005, "{measure:?}");
    assert!(measure.outside_volume < 0.002, "{measure:?}");
    assert_eq!(measure.coverage.uncovered, 1.0);
    // Two spheres side by side, one of them half outside.
    let set = SphereSet { centers: vec![high - Vec3::new(0.5, 1.0, 0.0)], ..set };
    let measure = set.measure(&cuboid);
    assert!((measure.outside_volume - 0.5 * measure.union_volume).abs() < 0.03 * measure.union_volume);
}

#[test]
fn sheets_are_covered_though_they_enclose_nothing() {
    let hills = mesh::plane(Vec2::splat(4.0), 24, 24);
    let hills = TriangleMesh {
        positions: hills
            .positions
            .iter()
            .map(|p| *p + 0.3 * Vec3::Y * (3.0 * p.x).sin() * p.z.cos())
            .collect(),
        ..hills
    };
    for sheet in [grid(1), hills] {
        let (set, report) = fit(&sheet, 9);
        assert!(!report.has_interior && report.warnings.len() == 1, "{report:?}");
        let extent = sheet.bounds().map(|(a, b)| (b - a).max_element()).expect("it has triangles");
        assert!(set.radii.iter().all(|r| *r < 0.5 * extent), "{:?}", set.radii);
    }
}

#[test]
fn many_parts_get_spheres_each() {
    let ball = mesh::ico_sphere(0.4, 3);
    let at = |x: f32, y: f32| Affine3A::from_translation(Vec3::new(x, y, 0.0));
    let parts = [
        (&ball, at(0.0, 0.0), 0),
        (&ball, at(2.0, 0.0), 0),
        (&ball, at(0.0, 3.0), 0),
        (&ball, at(5.0, 1.0), 0),
    ];
    let (set, report) = fit(&mesh::merge(&parts), 4);
    assert!(set.radii.iter().all(|r| (r - 0.4).abs() < 0.02), "{:?}", set.radii);
    assert!(report.has_interior);
    // Overlapping parts are inside one as well as two.
    let (_, report) = fit(&mesh::merge(&[(&ball, at(0.0, 0.0), 0), (&ball, at(0.3, 0.0), 0)]), 2);
    assert!(report.measure.outside_fraction().expect("it has an inside") < 0.1, "{report:?}");
}

#[test]
fn meshes_turned_inside_out_and_meshes_with_holes_have_the_same_inside() {
    let ball = mesh::ico_sphere(1.0, 3);
    let volume = 4.0 / 3.0 * std::f64::consts::PI;
    let turned = ball.triangles.iter().map(|t| [t[0], t[2], t[1]]).collect();
    let holes = ball.triangles.iter().enumerate().filter(|(i, _)| i % 40 != 0).map(|(_, t)| *t).collect();
    for triangles in [turned, holes] {
        let (_, report) = SphereSet::fit("ball", &TriangleMesh { triangles, ..ball.clone() }, &options(1))
            .expect("it can be fitted");
        assert!((report.measure.mesh_volume / volume - 1.0).abs() < 0.03, "{report:?}");
    }
}

#[test]
fn more_spheres_than_vertices_cover_a_triangle() {
    let triangle = TriangleMesh { triangles: vec![[0, 1, 2]], ..grid(1) };
    let (set, _) = fit(&triangle, 20);
    assert!(set.radii.iter().all(|r| *r < 0.4), "{:?}", set.radii);
    fit(&octahedron(), 12);
}

#[test]
fn what_cannot_be_fitted_is_said() {
    let error =
        |mesh: &TriangleMesh, n| SphereSet::fit("thing", mesh, &options(n)).expect_err("it cannot be");
    assert_eq!(error(&octahedron(), 0), SphereFitError::NoSpheres);
    assert_eq!(error(&octahedron(), 5000), SphereFitError::TooManySpheres { asked: 5000 });
    assert!(matches!(error(&TriangleMesh::default(), 3), SphereFitError::NoSurface { triangles: 0, .. }));
    for flat in [[0, 0, 0], [0, 1, 1]] {
        let line = TriangleMesh { triangles: vec![flat], ..octahedron() };
        assert!(error(&line, 3).to_string().contains("no surface"), "{:?}", error(&line, 3));
    }
    let broken = TriangleMesh { triangles: vec![[0, 1, 99]], ..octahedron() };
    assert!(error(&broken, 3).to_string().contains("99"));
    let nan = TriangleMesh { positions: vec![Vec3::NAN; 6], ..octahedron() };
    assert!(matches!(error(&nan, 3), SphereFitError::Mesh { .. }));
}

#[test]
fn scale_does_not_matter() {
    let shape = mesh::cuboid(Vec3::new(1.0, 2.0, 1.0));
    let reference = fit(&shape, 3).1.measure.outside_fraction().expect("it has an inside");
    for scale in [1e-12, 1e12] {
        let scaled = shape.transformed(&Affine3A::from_scale(Vec3::splat(scale)));
        let (set, report) = SphereSet::fit("scaled", &scaled, &options(3)).expect("it can be fitted");
        assert!((set.radii[0] / scale).is_finite() && set.radii[0] > 0.0);
        let outside = report.measure.outside_fraction().expect("it has an inside");
        assert!((outside - reference).abs() < 0.05 * reference, "{outside} is not {reference}");
    }
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let shape = mesh::blob(1.0, 3, 4);
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| fit(&shape, 7))
    };
    assert_eq!(on(1), on(2));
}

#[test]
fn balance_gives_the_shadow_of_the_mesh() {
    let torus = mesh::torus(1.0, 0.3, 48, 24);
    let (set, _) = fit(&torus, 12);
    let before = set.silhouettes(&torus);
    let (balanced, factor) = set.balanced(&torus);
    let after = balanced.silhouettes(&torus);
    assert!(before.area_ratio > 1.02 && (after.area_ratio - 1.0).abs() < 0.005, "{before:?} {after:?}");
    assert!(factor < 1.0 && after.mean_iou > before.mean_iou);
}

#[test]
fn spheres_move_with_rigid_and_uniformly_scaled_transforms() {
    let (set, _) = fit(&mesh::cuboid(Vec3::ONE), 2);
    let transform =
        Affine3A::from_scale_rotation_translation(Vec3::splat(2.0), Quat::from_rotation_y(1.0), Vec3::X);
    let moved = set.transformed(&transform);
    for i in 0..2 {
        assert!((moved.radii[i] - 2.0 * set.radii[i]).abs() < 1e-5);
        assert!(moved.centers[i].distance(transform.transform_point3(set.centers[i])) < 1e-5);
    }
    // One joint with that matrix does the same.
    let influences = vec![SphereInfluences { joints: [1, 0, 0, 0], weights: [1.0, 0.0, 0.0, 0.0] }; 2];
    let jointed = SphereSet { influences, ..set.clone() };
    let posed = jointed.posed(&[Affine3A::IDENTITY, transform]);
    assert_eq!((posed.centers, posed.radii), (moved.centers, moved.radii));
    // A joint that is missing, or has left the finite numbers, moves nothing.
    assert_eq!(jointed.posed(&[]), jointed);
    assert_eq!(jointed.posed(&[transform, Affine3A::from_translation(Vec3::INFINITY)]), jointed);
}

#[test]
fn a_blend_of_rotations_does_not_shrink_a_sphere() {
    let set = SphereSet {
        centers: vec![Vec3::ZERO],
        radii: vec![0.5],
        influences: vec![SphereInfluences { joints: [0, 1, 0, 0], weights: [0.5, 0.5, 0.0, 0.0] }],
        ..SphereSet::default()
    };
    let turned = Affine3A::from_rotation_x(3.0);
    assert!((set.posed(&[Affine3A::IDENTITY, turned]).radii[0] - 0.5).abs() < 1e-6);
}
