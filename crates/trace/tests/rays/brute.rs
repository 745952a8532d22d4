//! Against every triangle in turn, in doubles.

use glam::{DVec3, Vec3};

use halflight_shape::TriangleMesh;
use halflight_trace::{MeshTracer, Ray, RayGeometry, Simd};

use crate::common::{levels, rays_around, scaled, soup, sphere, tracer, world};

/// Möller–Trumbore in doubles: distance and how far inside (least barycentric weight), also for near misses.
fn intersect(corners: [Vec3; 3], ray: &Ray) -> Option<(f64, f64)> {
    let [a, b, c] = corners.map(|p| p.as_dvec3());
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let (e1, e2) = (b - a, c - a);
    let p = d.cross(e2);
    let determinant = e1.dot(p);
    if determinant == 0.0 {
        return None;
    }
    let s: DVec3 = o - a;
    let u = s.dot(p) / determinant;
    let q = s.cross(e1);
    let v = d.dot(q) / determinant;
    Some((e2.dot(q) / determinant, u.min(v).min(1.0 - u - v)))
}

/// The nearest triangle hit well inside, and the nearest hit at all counting those missed by a hair.
fn brute(mesh: &TriangleMesh, ray: &Ray, hair: f64) -> (f64, f64) {
    let (mut sure, mut perhaps) = (f64::INFINITY, f64::INFINITY);
    for triangle in &mesh.triangles {
        if let Some((t, inside)) = intersect(triangle.map(|i| mesh.positions[i as usize]), ray) {
            if t > hair && inside > -hair {
                perhaps = perhaps.min(t);
            }
            if t > hair && inside > hair {
                sure = sure.min(t);
            }
        }
    }
    (sure, perhaps)
}

fn check(mesh: TriangleMesh, rays: &[Ray], scale: f64) {
    for simd in levels() {
        let world = world(mesh.clone(), simd);
        for ray in rays {
            let (sure, perhaps) = brute(&mesh, ray, 1e-5);
            let tolerance = 1e-4 * scale;
            match world.closest(ray) {
                None => assert!(sure.is_infinite(), "{simd:?}: missed a hit at {sure} of {ray:?}"),
                Some(hit) => {
                    let t = f64::from(hit.t);
                    assert!(t >= perhaps - tolerance, "{simd:?}: {t} before {perhaps} of {ray:?}");
                    assert!(t <= sure + tolerance, "{simd:?}: {t} behind {sure} of {ray:?}");
                    let corners = mesh.triangles[hit.primitive as usize].map(|i| mesh.positions[i as usize]);
                    let weights = [1.0 - hit.u - hit.v, hit.u, hit.v];
                    let point: Vec3 = corners.iter().zip(weights).map(|(&p, w)| p * w).sum();
                    assert!(
                        (ray.at(hit.t) - point).length() < 1e-3 * scale as f32,
                        "{simd:?}: {ray:?} {hit:?}"
                    );
                }
            }
            assert_eq!(world.occluded(ray), world.closest(ray).is_some(), "{simd:?}: {ray:?}");
            // An end before the hit hides it, an end at the hit does not.
            if let Some(hit) = world.closest(ray) {
                assert_eq!(world.closest(&Ray { t_max: hit.t, ..*ray }), Some(hit));
                let before = Ray { t_max: hit.t.next_down(), ..*ray };
                assert!(world.closest(&before).is_none_or(|other| other.t < hit.t));
            }
        }
    }
}

#[test]
fn a_soup_of_triangles_answers_as_each_triangle_in_turn() {
    check(soup(700, 0.4, 1), &rays_around(1500, 1.0, 2), 1.0);
}

#[test]
fn a_closed_mesh_answers_as_each_triangle_in_turn() {
    check(sphere(3), &rays_around(1000, 1.0, 3), 1.0);
}

#[test]
fn scale_does_not_matter() {
    for scale in [1e-3_f32, 1e6] {
        let rays: Vec<Ray> = rays_around(400, 1.0, 4)
            .into_iter()
            .map(|ray| Ray { origin: ray.origin * scale, ..ray })
            .collect();
        check(scaled(soup(200, 0.5, 5), scale, Vec3::ZERO), &rays, f64::from(scale));
    }
}

#[test]
fn an_empty_mesh_is_never_met() {
    for simd in levels() {
        let world = world(TriangleMesh::default(), simd);
        assert_eq!(world.closest(&Ray::new(Vec3::ZERO, Vec3::X)), None);
        assert!(!world.occluded(&Ray::new(Vec3::ZERO, Vec3::X)));
        assert_eq!(world.bounds(), (Vec3::ZERO, Vec3::ZERO));
    }
}

#[test]
fn triangles_that_are_no_triangles_are_never_met() {
    let nan = f32::NAN;
    let mesh = TriangleMesh {
        positions: vec![
            Vec3::ZERO,
            Vec3::X,
            Vec3::X * 2.0,
            Vec3::new(nan, 0.0, 0.0),
            Vec3::Y,
            Vec3::splat(f32::INFINITY),
        ],
        triangles: vec![[0, 1, 2], [0, 0, 0], [3, 1, 4], [0, 5, 4], [0, 1, 77], [1, 1, 4]],
        ..TriangleMesh::default()
    };
    for simd in levels() {
        let world = world(mesh.clone(), simd);
        for ray in rays_around(500, 1.0, 6) {
            assert_eq!(world.closest(&ray), None, "{ray:?}");
        }
        for origin in [Vec3::NEG_X, Vec3::new(0.5, 1.0, 0.0), Vec3::new(0.0, 0.0, 1.0)] {
            let ray = Ray::new(origin, (Vec3::new(0.5, 0.0, 0.0) - origin).normalize());
            assert_eq!(world.closest(&ray), None, "{ray:?}");
        }
    }
}

#[test]
fn a_ray_in_the_plane_of_a_triangle_does_not_meet_it() {
    let mesh = TriangleMesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Z],
        triangles: vec![[0, 1, 2]],
        ..TriangleMesh::default()
    };
    for simd in levels() {
        let world = world(mesh.clone(), simd);
        let ray = Ray::new(Vec3::new(-1.0, 0.0, 0.2), Vec3::X);
        assert_eq!(world.closest(&ray), None);
        assert!(world.closest(&Ray::new(Vec3::new(0.2, 1.0, 0.2), Vec3::NEG_Y)).is_some());
    }
}

#[test]
fn rays_that_are_no_rays_meet_nothing() {
    for simd in levels() {
        let world = world(sphere(1), simd);
        let good = Ray::new(Vec3::new(0.0, 0.0, 3.0), Vec3::NEG_Z);
        assert!(world.occluded(&good));
        let bad = [
            Ray { direction: Vec3::ZERO, ..good },
            Ray { direction: Vec3::new(f32::NAN, 0.0, -1.0), ..good },
            Ray { direction: Vec3::new(0.0, 0.0, f32::NEG_INFINITY), ..good },
            Ray { origin: Vec3::new(f32::INFINITY, 0.0, 0.0), ..good },
            Ray { origin: Vec3::splat(f32::NAN), ..good },
            Ray { t_max: f32::NAN, ..good },
            Ray { t_max: 0.0, ..good },
            Ray { t_max: -1.0, ..good },
        ];
        let mut hits = [None; 8];
        let mut blocked = [true; 8];
        world.closest_packet(&bad, &mut hits);
        world.occluded_packet(&bad, &mut blocked);
        assert_eq!(hits, [None; 8]);
        assert_eq!(blocked, [false; 8]);
        blocked = [true; 8];
        world.occluded_scattered(&bad, &mut blocked);
        assert_eq!(blocked, [false; 8]);
        for ray in bad {
            assert_eq!(world.closest(&ray), None, "{ray:?}");
            assert!(!world.occluded(&ray));
        }
    }
}

#[test]
fn many_triangles_in_one_place_are_all_there() {
    let mut mesh = TriangleMesh { positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y], ..TriangleMesh::default() };
    mesh.triangles = vec![[0, 1, 2]; 5000];
    let geometry = MeshTracer::build(std::sync::Arc::new(mesh));
    let ray = Ray::new(Vec3::new(0.2, 0.2, 1.0), Vec3::NEG_Z);
    let hit = geometry.closest(&ray).expect("all of them are in the way");
    assert_eq!(hit.primitive, 0, "of equal hits the first triangle wins");
    assert!((hit.t - 1.0).abs() < 1e-6);
}

#[test]
fn the_tree_does_not_depend_on_the_number_of_threads() {
    let mesh = std::sync::Arc::new(soup(30_000, 0.05, 7));
    let rays = rays_around(2000, 1.0, 8);
    let answers = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool of threads");
        let tracer = pool.install(|| MeshTracer::build(mesh.clone()));
        (tracer.memory_bytes(), rays.iter().map(|ray| tracer.closest(ray)).collect::<Vec<_>>())
    };
    assert_eq!(answers(1), answers(3));
}

#[test]
fn refitting_answers_as_building_anew() {
    let before = soup(3000, 0.1, 9);
    let mut after = before.clone();
    after.positions.iter_mut().for_each(|p| *p = Vec3::new(p.z, p.x * 1.5, p.y + 0.3 * p.x));
    let mut refitted = MeshTracer::build(std::sync::Arc::new(before));
    refitted.refit(std::sync::Arc::new(after.clone()), None);
    let built = tracer(after);
    for ray in rays_around(3000, 1.5, 10) {
        let expected = built.as_rays().closest(&ray);
        let found = refitted.closest(&ray);
        assert_eq!(found.map(|hit| hit.primitive), expected.map(|hit| hit.primitive), "{ray:?}");
        // Boxes of leaves differ, and with them the last bits of t.
        if let (Some(found), Some(expected)) = (found, expected) {
            assert!((found.t - expected.t).abs() < 1e-5);
        }
    }
}

#[test]
fn levels_of_instructions_agree() {
    let mesh = soup(5000, 0.1, 11);
    let worlds: Vec<_> = levels().into_iter().map(|simd| (simd, world(mesh.clone(), simd))).collect();
    let mut different = 0;
    let rays = rays_around(5000, 1.0, 12);
    for ray in &rays {
        let first = worlds[0].1.closest(ray);
        for (simd, world) in &worlds[1..] {
            let hit = world.closest(ray);
            match (first, hit) {
                (Some(a), Some(b)) if a.primitive == b.primitive => {
                    assert!((a.t - b.t).abs() < 1e-4, "{ray:?}")
                }
                (None, None) => {}
                _ => different += 1,
            }
            if *simd == Simd::Avx512 {
                assert_eq!(hit, worlds[1].1.closest(ray), "AVX2 and AVX-512 give the same bits");
            }
        }
    }
    // Rays that pass an edge by less than rounding may fall to either side.
    assert!(different * 500 < rays.len(), "{different} rays of {} differ", rays.len());
}
