//! What [002] prints, beside what holds.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DVec3, Vec3};
use halflight_ddf::{
    FieldSample, Inside, SampleScheme, SeedOptions, SeedSchedule, SeedTrainer, UnitSpace, draw_samples,
    mesh_hash,
};
use halflight_shape::TriangleMesh;
use halflight_shape::procedural::mesh::{cuboid, ico_sphere, torus};
use halflight_trace::MeshTracer;

/// A sequence that fills the unit square.
fn square(count: usize) -> impl Iterator<Item = (f64, f64)> {
    (0..count).map(|i| {
        let i = i as f64 + 0.5;
        ((i * 0.754_877_666_246_692_7).fract(), (i * 0.569_840_290_998_053_3).fract())
    })
}

#[test]
fn eq_9_of_002_as_printed_puts_half_of_the_points_outside_the_triangle() {
    let outside = square(100_000).filter(|(a, b)| 1.0 - a - b < 0.0).count();
    assert!((outside as f64 / 1e5 - 0.5).abs() < 0.01, "{outside}");
    // Corrected, all samples of a mesh start on it: the march goes back to a point of the ball's facets.
    let ball = Arc::new(ico_sphere(1.0, 3));
    let scheme = SampleScheme::Surface { faces: 1, directions: 1, marching: 1 };
    for sample in draw_samples(&ball, scheme, 1).iter().filter(|s| s.distance.is_finite()) {
        let on = sample.origin + sample.distance * sample.direction;
        assert!((0.98..1.0001).contains(&on.length()), "{sample:?}");
    }
}

#[test]
fn eq_10_of_002_as_printed_crowds_the_poles() {
    // θ₀ = aπ: the polar caps of 30 degrees hold 13 % of the sphere and get a third of the directions.
    let in_caps = |cos: &dyn Fn(f64) -> f64| {
        square(100_000).filter(|&(a, _)| cos(a).abs() > (PI / 6.0).cos()).count() as f64 / 1e5
    };
    assert!((in_caps(&|a| (a * PI).cos()) - 1.0 / 3.0).abs() < 0.01);
    assert!((in_caps(&|a| 1.0 - 2.0 * a) - (1.0 - (PI / 6.0).cos())).abs() < 0.01);
    // And the samples that are drawn have no preferred axis.
    let ball = Arc::new(ico_sphere(1.0, 3));
    let samples = draw_samples(&ball, SampleScheme::Random { count: 50_000 }, 2);
    let second =
        samples.iter().fold(DVec3::ZERO, |sum, s| sum + s.direction.as_dvec3() * s.direction.as_dvec3());
    let mean = second / samples.len() as f64;
    assert!((mean - DVec3::splat(1.0 / 3.0)).abs().max_element() < 0.01, "{mean}");
}

#[test]
fn eq_12_of_002_under_eq_8_makes_a_miss_look_like_a_hit_at_delta() {
    // The loss of a hit at δ and of a miss is the same function of the output: no output can tell them apart.
    let delta = 0.1f32;
    let loss = |target: f32, said: f32| (target.clamp(-delta, delta) - said.clamp(-delta, delta)).abs();
    for said in [-1.0, 0.0, 0.05, 0.1, 3.0] {
        assert_eq!(loss(f32::INFINITY, said), loss(delta, said));
        assert_eq!(loss(f32::INFINITY, said), loss(7.0 * delta, said));
    }
}

#[test]
fn the_printed_learning_rate_of_002_moves_nothing_in_ten_thousand_steps() {
    // Adam moves a weight by at most its rate a step: 10⁴ · 10⁻⁷ = 10⁻³, a hundredth of an initial weight.
    let ball = Arc::new(ico_sphere(1.0, 2));
    let samples = draw_samples(&ball, SampleScheme::Surface { faces: 2, directions: 2, marching: 2 }, 1);
    let run = |schedule| {
        let options = SeedOptions { layers: 2, width: 32, batch: 128, schedule, ..SeedOptions::default() };
        let mut trainer = SeedTrainer::new(samples.clone(), options).expect("samples to learn");
        let mut last = 0.0;
        for step in 0..400 {
            let loss = trainer.step(step as f32 / 400.0).expect("a step");
            last = if step < 350 { 0.0 } else { last + loss / 50.0 };
        }
        last
    };
    let (printed, ours) = (run(SeedSchedule::Printed), run(SeedSchedule::Ours));
    assert!(ours < 0.5 * printed, "{ours} {printed}");
}

#[test]
fn samples_of_the_surface_are_true() {
    // Against the exact ball: origins outside or (never) inside, distances to the surface along the ray.
    let ball = Arc::new(ico_sphere(0.8, 4));
    let scheme = SampleScheme::Surface { faces: 1, directions: 3, marching: 2 };
    let samples = draw_samples(&ball, scheme, 5);
    assert!(samples.len() > 10_000);
    let exact = halflight_ddf::AnalyticField::Sphere { center: DVec3::ZERO, radius: 0.8 };
    let (mut far, mut wrong) = (0, 0);
    for s in &samples {
        assert!(s.origin.length() > 0.79, "inside: {s:?}");
        let truth = exact.query(s.origin.as_dvec3(), s.direction.as_dvec3());
        match truth {
            Some(hit) if s.distance.is_finite() && hit.distance > 0.02 => {
                far += usize::from((hit.distance - f64::from(s.distance)).abs() > 0.05);
            }
            // Facets lie within the ball: grazing rays may tell them apart.
            Some(hit) if s.distance.is_infinite() && hit.distance > 0.02 => wrong += 1,
            _ => {}
        }
    }
    assert!(far * 50 < samples.len() && wrong * 50 < samples.len(), "{far} {wrong} of {}", samples.len());
}

#[test]
fn the_rule_of_odd_and_even_holds_for_closed_open_and_many_part_meshes() {
    let shells = |mesh: TriangleMesh| MeshTracer::build(Arc::new(mesh));
    let ring = shells(torus(1.0, 0.3, 32, 16));
    assert!(Inside::new(&ring).contains(Vec3::new(1.0, 0.0, 0.0)));
    assert!(!Inside::new(&ring).contains(Vec3::ZERO));
    assert!(!Inside::new(&ring).contains(Vec3::new(9.0, 0.0, 0.0)));
    // A box without its lid, seen from within: most directions still meet a wall.
    let mut open = cuboid(Vec3::splat(2.0));
    let top = open.bounds().expect("a box").1.y;
    let all = open.triangles.len();
    let positions = open.positions.clone();
    open.triangles.retain(|t| t.iter().any(|&v| positions[v as usize].y < top - 0.1));
    assert_eq!(open.triangles.len(), all - 2);
    let (low, high) = open.bounds().expect("a box");
    let open = shells(open);
    assert!(Inside::new(&open).contains(low + (high - low) * Vec3::new(0.5, 0.2, 0.45)));
    // Two boxes side by side in one mesh.
    let mut two = cuboid(Vec3::ONE);
    let mut other = cuboid(Vec3::ONE);
    other.positions.iter_mut().for_each(|p| p.x += 3.0);
    let within = {
        let (low, high) = two.bounds().expect("a box");
        0.5 * (low + high)
    };
    two.merge(&other);
    let two = shells(two);
    assert!(Inside::new(&two).contains(within + Vec3::splat(0.01)));
    assert!(Inside::new(&two).contains(within + Vec3::new(3.01, 0.02, 0.03)));
    assert!(!Inside::new(&two).contains(within + Vec3::new(1.5, 0.02, 0.03)));
}

#[test]
fn files_of_samples_come_back_as_they_were_and_broken_ones_are_refused() {
    let ring = torus(1.0, 0.3, 16, 8);
    let unit = UnitSpace::of_mesh(&ring).expect("a ring has a size");
    let mesh = Arc::new(unit.mesh_to_unit(&ring));
    let samples = draw_samples(&mesh, SampleScheme::PointOfView { azimuths: 3, polars: 2, pixels: 8 }, 1);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("ring.samples");
    let hash = mesh_hash(&ring);
    FieldSample::save(&samples, &hash, &path).expect("written");
    assert_eq!(FieldSample::load(&path, &hash).expect("read"), samples);
    let bytes = std::fs::read(&path).expect("bytes");
    let other = FieldSample::load(&path, "0123456789abcdef").expect_err("of another mesh").to_string();
    assert!(other.contains("another mesh") && other.contains("0123456789abcdef"), "{other}");
    let mut flipped = bytes.clone();
    let last = flipped.len() - 28;
    flipped[last] ^= 1;
    let lines = |text: &str| format!("halflight-ddf-samples {text}\n").replace("HASH", &hash).into_bytes();
    for (broken, story) in [
        (bytes[..bytes.len() - 3].to_vec(), "whole samples"),
        (flipped, "whose sum is"),
        (lines("9 0"), "version 9"),
        (lines("2 99999999999999999 HASH 0"), "whole samples"),
        (lines("2 -1 HASH 0"), "as the number of samples"),
        (lines("2 1"), "the first line"),
        (b"something else\n".to_vec(), "the first line"),
        (Vec::new(), "no header line"),
        ([&lines("2 1 HASH 0")[..], &[0xff; 28]].concat(), "sample 0"),
    ] {
        std::fs::write(&path, broken).expect("written");
        let error = FieldSample::load(&path, &hash).expect_err("broken").to_string();
        assert!(error.contains(story), "{error}");
    }
}
