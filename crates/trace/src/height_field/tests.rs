//! The march against every triangle of the equivalent mesh, one by one.

use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3};
use halflight_shape::HeightField;

use super::HeightFieldTracer;
use crate::{Ray, RayGeometry, Simd};

/// Numbers that are as good as random, and the same everywhere.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }
    fn point(&mut self, low: Vec3, high: Vec3) -> Vec3 {
        low + (high - low) * Vec3::new(self.next(), self.next(), self.next())
    }
    fn direction(&mut self) -> Vec3 {
        loop {
            let p = self.point(Vec3::splat(-1.0), Vec3::ONE);
            if (0.01..1.0).contains(&p.length_squared()) {
                return p.normalize();
            }
        }
    }
}

fn hills(columns: usize, rows: usize, seed: u64) -> HeightField {
    let mut numbers = Numbers(seed);
    let (min, max) = (Vec2::new(-3.0, 1.0), Vec2::new(5.0, 7.0));
    let heights = (0..columns * rows)
        .map(|p| {
            let (x, z) = ((p % columns) as f32 / columns as f32, (p / columns) as f32 / rows as f32);
            (7.0 * x + 2.0).sin() * (5.0 * z).cos() + 0.2 * numbers.next()
        })
        .collect();
    HeightField::new(columns, rows, min, max, heights).unwrap()
}

/// Every crossing of the ray with a triangle of the mesh, in f64: (t, primitive, how far inside the triangle's edges).
fn crossings(field: &HeightField, ray: &Ray) -> Vec<(f64, u32, f64)> {
    let mesh = field.to_mesh();
    let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let mut found = Vec::new();
    for (primitive, triangle) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = triangle.map(|v| mesh.positions[v as usize].as_dvec3());
        let (ab, ac): (DVec3, DVec3) = (b - a, c - a);
        let p = direction.cross(ac);
        let determinant = ab.dot(p);
        if determinant.abs() < 1e-14 {
            continue;
        }
        let s = origin - a;
        let u = s.dot(p) / determinant;
        let q = s.cross(ab);
        let v = direction.dot(q) / determinant;
        let inside = u.min(v).min(1.0 - u - v);
        if inside > -1e-3 {
            found.push((ac.dot(q) / determinant, primitive as u32, inside));
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found
}

fn levels() -> Vec<Simd> {
    [Simd::Baseline, Simd::Avx2, Simd::Avx512].into_iter().filter(|&level| level <= Simd::detect()).collect()
}

/// Holds the tracer to the mesh for one ray. What is closer to an edge, to the ray's start or to grazing than f32 can
/// tell is left undecided; a crossing that is clear must be found, and what is found must be there.
fn check(tracer: &HeightFieldTracer, field: &HeightField, ray: &Ray) {
    let all = crossings(field, ray);
    let near = |t: f64| 2e-4 * (1.0 + t.abs());
    let clear = all.iter().find(|c| {
        c.2 > 1e-3
            && c.0 > near(c.0)
            && c.0 < f64::from(ray.t_max) - near(c.0)
            && steepness(field, c.1, ray) > 1e-2
    });
    match tracer.closest(ray) {
        Some(hit) => {
            assert!(hit.t > 0.0 && hit.t <= ray.t_max);
            let crossing = all
                .iter()
                .any(|c| (c.0 - f64::from(hit.t)).abs() < near(c.0) / steepness(field, c.1, ray).max(1e-6));
            // A ray along an edge or through a post may miss all triangles of the mesh by a rounding.
            let point = ray.origin + ray.direction * hit.t;
            let touches = (field.height_at(point.x, point.z) - point.y).abs() < 2e-6 * (1.0 + hit.t);
            assert!(crossing || touches, "{ray:?} {hit:?} {all:?}");
            if let Some(clear) = clear {
                assert!(f64::from(hit.t) < clear.0 + near(clear.0), "{ray:?}: {hit:?} behind {clear:?}");
                if (f64::from(hit.t) - clear.0).abs() < 1e-6 {
                    assert_eq!(hit.primitive, clear.1, "{ray:?}");
                }
            }
            let surface = tracer.surface(ray, &hit);
            let off = surface.position.distance(ray.origin + ray.direction * hit.t);
            assert!(off < 3e-4 * (1.0 + hit.t), "{ray:?} {hit:?}: {off}");
            assert!(surface.geometric_normal.y > 0.0);
        }
        None => assert!(clear.is_none(), "{ray:?} passes {clear:?}"),
    }
    assert_eq!(tracer.occluded(ray), tracer.closest(ray).is_some());
}

/// Sine of the angle between the ray and a triangle.
fn steepness(field: &HeightField, primitive: u32, ray: &Ray) -> f64 {
    let mesh = field.to_mesh();
    let [a, b, c] = mesh.triangles[primitive as usize].map(|v| mesh.positions[v as usize].as_dvec3());
    (b - a).cross(c - a).normalize().dot(ray.direction.as_dvec3().normalize()).abs()
}

#[test]
fn random_rays_hit_what_they_hit_in_the_mesh() {
    for (columns, rows) in [(2, 2), (3, 7), (9, 5), (22, 19)] {
        let field = Arc::new(hills(columns, rows, 5));
        for simd in levels() {
            let tracer = HeightFieldTracer::with_simd(field.clone(), None, simd);
            let mut numbers = Numbers(99);
            let (low, high) = tracer.bounds();
            let wide = Vec3::splat(1.5);
            for k in 0..600 {
                let mut ray = Ray::new(numbers.point(low - wide, high + wide), numbers.direction());
                if k % 5 == 0 {
                    ray.t_max = 3.0 * numbers.next();
                }
                if k % 7 == 0 {
                    // Any length of direction.
                    ray.direction *= 0.01 + 20.0 * numbers.next();
                }
                check(&tracer, &field, &ray);
            }
        }
    }
}

#[test]
fn rays_along_axes_through_posts_along_edges_and_grazing_hit_what_they_hit_in_the_mesh() {
    let field = Arc::new(hills(14, 11, 3));
    for simd in levels() {
        let tracer = HeightFieldTracer::with_simd(field.clone(), None, simd);
        let mut numbers = Numbers(7);
        let (low, high) = tracer.bounds();
        let axes = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
        for _ in 0..150 {
            for axis in axes {
                check(&tracer, &field, &Ray::new(numbers.point(low, high) - 10.0 * axis, axis));
                check(&tracer, &field, &Ray::new(numbers.point(low, high), axis));
            }
            let post = field.post((numbers.next() * 13.9) as usize, (numbers.next() * 10.9) as usize);
            let other = field.post((numbers.next() * 13.9) as usize, (numbers.next() * 10.9) as usize);
            for direction in [numbers.direction(), Vec3::NEG_Y, (other - post).normalize_or(Vec3::Y)] {
                check(&tracer, &field, &Ray::new(post - 4.0 * direction, direction));
            }
            let mut flat = numbers.direction();
            flat.y *= 0.01;
            check(&tracer, &field, &Ray::new(numbers.point(low, high) - 9.0 * flat, flat));
        }
    }
}

#[test]
fn no_ray_passes_through_posts_edges_or_diagonals() {
    // From above the whole field to below it, aimed exactly at posts, at edges, and along the lines of the grid.
    let field = Arc::new(hills(33, 30, 11));
    for simd in levels() {
        let tracer = HeightFieldTracer::with_simd(field.clone(), None, simd);
        let mut numbers = Numbers(1);
        for k in 0..20_000 {
            let (i, j) = (1 + (numbers.next() * 30.0) as usize, 1 + (numbers.next() * 27.0) as usize);
            let corners =
                [field.post(i, j), field.post(i + 1, j), field.post(i, j + 1), field.post(i + 1, j + 1)];
            let along = numbers.next();
            let target = match k % 4 {
                0 => corners[0],
                1 => corners[0].lerp(corners[1], along),
                2 => corners[0].lerp(corners[2], along),
                _ => corners[0].lerp(corners[3], along),
            };
            // Steeper than the field anywhere: the ray ends up on the other side.
            let aside = Vec3::new(0.6 * (numbers.next() - 0.5), 3.0, 0.6 * (numbers.next() - 0.5));
            let aside = match k % 3 {
                0 => aside.with_x(0.0),
                1 => aside.with_z(0.0),
                _ => aside,
            };
            for from in [target + aside, target - aside] {
                let ray = Ray::new(from, (target - from).normalize());
                let hit = tracer.closest(&ray);
                assert!(
                    hit.is_some_and(|hit| (hit.t - from.distance(target)).abs() < 1e-5),
                    "{ray:?} {hit:?}"
                );
            }
        }
    }
}

#[test]
fn what_lies_far_away_or_is_tiny_or_huge_is_hit_just_as_well() {
    for scale in [1e-3f32, 1.0, 1e5] {
        let mut field = hills(40, 40, 2);
        (field.min, field.max) = (field.min * scale, field.max * scale);
        field.heights.iter_mut().for_each(|h| *h *= scale);
        let field = Arc::new(field);
        let tracer = HeightFieldTracer::build(field.clone());
        let mut numbers = Numbers(12);
        for _ in 0..2000 {
            let (x, z) = (scale * (-2.9 + 7.8 * numbers.next()), scale * (1.1 + 5.8 * numbers.next()));
            let target = Vec3::new(x, field.height_at(x, z), z);
            for distance in [10.0 * scale, 1e4 * scale] {
                let direction = Vec3::new(numbers.next() - 0.5, -1.5, numbers.next() - 0.5).normalize();
                let ray = Ray::new(target - direction * distance, direction);
                let hit = tracer.closest(&ray).expect("the ray is aimed at the surface");
                let position = tracer.surface(&ray, &hit).position;
                assert!((field.height_at(position.x, position.z) - position.y).abs() < 1e-5 * scale);
                assert!(hit.t <= distance + 1e-5 * scale + 4e-7 * distance, "{scale} {distance} {}", hit.t);
            }
        }
    }
}

#[test]
fn rays_leave_a_wide_field_at_its_origin_as_anywhere_else() {
    // Near the origin positions are small, but the field is wide: what the march cannot resolve is not.
    let columns = 768;
    let height = |x: f32, z: f32| 0.05 * (1.3 * x).sin() + 0.05 * (1.1 * z).sin();
    let at = |i: usize| i as f32 / (columns - 1) as f32 * 96.0 - 48.0;
    let heights = (0..columns * columns).map(|post| height(at(post % columns), at(post / columns))).collect();
    let field = HeightField::new(columns, columns, Vec2::splat(-48.0), Vec2::splat(48.0), heights).unwrap();
    let tracer = HeightFieldTracer::build(Arc::new(field));
    let mut numbers = Numbers(3);
    for _ in 0..20_000 {
        let from = numbers.point(Vec3::new(-1.0, 4.0, -1.0), Vec3::new(1.0, 5.0, 1.0));
        let down = Ray::new(from, Vec3::NEG_Y);
        let hit = tracer.closest(&down).expect("the field is below");
        let surface = tracer.surface(&down, &hit);
        let normal = surface.geometric_normal;
        let offset = surface.position_error * normal.abs().element_sum();
        let out = Ray { t_max: 1e-2, ..Ray::new(surface.position + normal * offset, normal) };
        assert!(!tracer.occluded(&out), "{hit:?}");
    }
}

#[test]
fn a_ray_leaves_the_surface_that_it_starts_from() {
    let field = Arc::new(hills(64, 64, 4));
    let tracer = HeightFieldTracer::build(field.clone());
    let mut numbers = Numbers(8);
    for _ in 0..20_000 {
        let down = Ray::new(numbers.point(Vec3::new(-3.0, 4.0, 1.0), Vec3::new(5.0, 4.0, 7.0)), Vec3::NEG_Y);
        let hit = tracer.closest(&down).expect("the field is below");
        let edge = hit.u.min(hit.v).min(1.0 - hit.u.max(hit.v)).min((hit.u - hit.v).abs());
        if edge < 1e-2 {
            // A fold may be nearer than the ends of these rays.
            continue;
        }
        let surface = tracer.surface(&down, &hit);
        let normal = surface.geometric_normal;
        let offset = surface.position_error * normal.abs().element_sum() * 1.5;
        let up = Ray { t_max: 1e-4, ..Ray::new(surface.position + normal * offset, normal) };
        assert!(!tracer.occluded(&up), "{hit:?}");
        let into = Ray::new(surface.position + normal * offset, -normal);
        let back = tracer.closest(&into);
        assert!(back.is_some_and(|hit| hit.t < 4.0 * offset), "{hit:?} {back:?}");
    }
}

#[test]
fn a_moving_field_is_the_interpolated_field_at_every_time() {
    let (open, close) = (Arc::new(hills(13, 9, 1)), Arc::new(hills(13, 9, 77)));
    for simd in levels() {
        let tracer = HeightFieldTracer::with_simd(open.clone(), Some(close.clone()), simd);
        let mut numbers = Numbers(3);
        for time in [0.0, 0.3, 1.0] {
            let heights = open.heights.iter().zip(&close.heights).map(|(a, b)| a + (b - a) * time).collect();
            let field = HeightField::new(13, 9, open.min, open.max, heights).unwrap();
            for _ in 0..300 {
                let origin = numbers.point(Vec3::new(-4.0, -2.0, 0.0), Vec3::new(6.0, 3.0, 8.0));
                check(&tracer, &field, &Ray { time, ..Ray::new(origin, numbers.direction()) });
            }
        }
    }
}

#[test]
fn flat_ground_is_hit_from_both_sides_and_never_along_itself() {
    let field = Arc::new(HeightField::new(40, 40, Vec2::splat(-1.0), Vec2::ONE, vec![0.0; 1600]).unwrap());
    let tracer = HeightFieldTracer::build(field);
    for direction in [Vec3::NEG_Y, Vec3::Y, Vec3::new(0.3, -0.9, 0.1), Vec3::new(-0.02, 0.9, -0.3)] {
        let hit = tracer.closest(&Ray::new(Vec3::new(0.01, 0.0, 0.02) - 0.5 * direction, direction));
        assert!((hit.expect("the ground is in the way").t - 0.5).abs() < 1e-6);
    }
    assert!(!tracer.occluded(&Ray::new(Vec3::new(0.0, 1e-6, 0.0), Vec3::X)));
    assert!(!tracer.occluded(&Ray::new(Vec3::ZERO, Vec3::Y)));
    let nan = Ray::new(Vec3::splat(f32::NAN), Vec3::X);
    assert!(tracer.closest(&nan).is_none());
}
