//! The learned field: what it answers, that it repeats, that its files are safe.

use std::path::Path;
use std::sync::Arc;

use glam::Vec3;
use halflight_ddf::{
    Cloud, DdfError, DirectedField, DistanceGrid, FastShape, FastTrainer, FieldShape, FieldTracer,
    SampleScheme, SeedOptions, SeedTrainer, TrainOptions, UnitSpace, draw_samples, evaluate, even_directions,
    mesh_points,
};
use halflight_sh::Sh;
use halflight_shape::TriangleMesh;
use halflight_shape::procedural::mesh::{ico_sphere, torus};
use halflight_trace::{MeshTracer, Ray, RayGeometry};

fn options() -> TrainOptions {
    TrainOptions {
        shape: FastShape { resolution: 24, ..FastShape::default() },
        lines_per_step: 512,
        ..TrainOptions::default()
    }
}

fn ring() -> TriangleMesh {
    let mut mesh = torus(3.0, 1.0, 48, 24);
    mesh.positions.iter_mut().for_each(|p| *p += Vec3::new(10.0, 0.0, -5.0));
    mesh
}

fn trained(steps: u64) -> (FastTrainer, DirectedField) {
    let mut trainer = FastTrainer::new(&ring(), options()).expect("a ring can be learned");
    for step in 0..steps {
        trainer.step(step as f32 / steps as f32).expect("training goes on");
    }
    let field = trainer.field();
    (trainer, field)
}

#[test]
fn a_ring_is_learned_in_seconds_and_its_identities_hold() {
    let (trainer, mut field) = trained(2000);
    let found = evaluate(&field, trainer.unit_mesh(), 5000, 3);
    field.error = found.measured();
    assert!(found.clouds.chamfer_e3 < 1.1 * found.floor_e3, "{found:?}");
    assert!(found.primary.visibility > 0.985, "{found:?}");
    assert!(found.primary.depth_median < 0.005, "{found:?}");
    assert!(found.primary.normal_median_degrees < 12.0, "{found:?}");
    // The directed eikonal, on rays from outside: exact but for rounding.
    let mut checked = 0;
    for i in 0..400 {
        let angle = i as f32 * 0.7;
        let x = Vec3::new(10.0 + 8.0 * angle.cos(), 3.0, -5.0 + 8.0 * angle.sin());
        let target = Vec3::new(10.0 + 3.0 * (angle * 3.1).cos(), 0.4, -5.0 + 3.0 * (angle * 3.1).sin());
        let omega = (target - x).normalize();
        let Some(hit) = field.query(x, omega, f32::INFINITY) else { continue };
        let on = field.query(x + 0.5 * omega, omega, f32::INFINITY).expect("the same hit, nearer");
        assert!((hit.distance - on.distance - 0.5).abs() < 2e-3, "{hit:?} {on:?}");
        let gradient = field.gradient(x, omega, &hit);
        assert!((gradient.dot(omega) + 1.0).abs() < 1e-3, "{gradient}");
        checked += 1;
    }
    assert!(checked > 200, "{checked}");
}

#[test]
fn the_gradient_is_that_of_the_answers() {
    let (_, field) = trained(300);
    let (mut good, mut all) = (0, 0);
    for i in 0..300 {
        let angle = i as f32 * 0.37;
        let x = Vec3::new(10.0 + 7.0 * angle.cos(), 2.0, -5.0 + 7.0 * angle.sin());
        let target = Vec3::new(10.0 - 3.0 * (angle * 2.3).cos(), 0.2, -5.0 + 3.0 * (angle * 2.3).sin());
        let omega = (target - x).normalize();
        let Some(hit) = field.query(x, omega, f32::INFINITY) else { continue };
        let gradient = field.gradient(x, omega, &hit);
        let h = 2e-3;
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            let [a, b] = [h, -h].map(|s| field.query(x + s * axis, omega, f32::INFINITY));
            let (Some(a), Some(b)) = (a, b) else { continue };
            // Across a cell's border or a corner of ReLU there is no one slope.
            if a.cell_number() != b.cell_number() {
                continue;
            }
            let slope = (a.distance - b.distance) / (2.0 * h);
            all += 1;
            good += usize::from((slope - gradient.dot(axis)).abs() < 0.05 * (1.0 + gradient.length()));
        }
    }
    assert!(all > 300 && good as f32 > 0.93 * all as f32, "{good} of {all}");
}

#[test]
fn training_does_not_depend_on_the_number_of_threads() {
    let files: Vec<Vec<u8>> = [1, 3]
        .into_iter()
        .map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            pool.install(|| trained(12).1.encode())
        })
        .collect();
    assert!(files[0] == files[1]);
}

#[test]
fn a_training_that_was_interrupted_ends_as_one_that_was_not() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("ring.checkpoint");
    let mut whole = FastTrainer::new(&ring(), options()).expect("a trainer");
    for step in 0..6 {
        whole.step(step as f32 / 10.0).expect("a step");
    }
    whole.save_checkpoint(&path).expect("saved");
    let mut other = FastTrainer::new(&ring(), options()).expect("a trainer");
    other.resume(&path).expect("resumed");
    assert_eq!(other.steps_done(), 6);
    for trainer in [&mut whole, &mut other] {
        trainer.step(0.6).expect("a step");
    }
    assert!(whole.field().encode() == other.field().encode());
    // What does not fit is refused.
    let mut bytes = std::fs::read(&path).expect("a checkpoint");
    bytes.truncate(bytes.len() - 5);
    std::fs::write(&path, &bytes).expect("written");
    assert!(other.resume(&path).expect_err("cut off").to_string().contains("bytes of numbers"));
    let mut seeded = FastTrainer::new(&ring(), TrainOptions { seed: 9, ..options() }).expect("a trainer");
    assert!(seeded.resume(&path).expect_err("another seed").to_string().contains("other options"));
}

fn story(bytes: &[u8]) -> String {
    DirectedField::decode(bytes, Path::new("x.ddf")).expect_err("this is no field").to_string()
}

#[test]
fn files_come_back_as_they_were_and_broken_ones_are_refused() {
    let (_, field) = trained(3);
    let bytes = field.encode();
    let again = DirectedField::decode(&bytes, Path::new("x.ddf")).expect("what was written can be read");
    assert!(again.encode() == bytes);
    let (x, omega) = (Vec3::new(10.0, 0.1, 20.0), Vec3::new(0.1, 0.0, -1.0));
    assert_eq!(again.query(x, omega, 100.0), field.query(x, omega, 100.0));
    // Cut off anywhere: an error, never a panic.
    for length in [0, 4, 8, 100, 600, bytes.len() / 2, bytes.len() - 1] {
        story(&bytes[..length]);
    }
    assert!(story(&bytes[..bytes.len() - 1]).contains("not a whole safetensors file"));
    let replaced = |from: &str, to: &str| {
        let at = bytes.windows(from.len()).position(|w| w == from.as_bytes()).expect("the text is there");
        let mut bytes = bytes.clone();
        bytes[at..at + from.len()].copy_from_slice(to.as_bytes());
        bytes
    };
    assert!(story(&replaced("\\\"version\\\":1", "\\\"version\\\":7")).contains("version 7"));
    assert!(
        story(&replaced("\\\"resolution\\\":24", "\\\"resolution\\\":28")).contains("where the header asks")
    );
    assert!(story(&replaced("\\\"hidden\\\":32", "\\\"hidden\\\":33")).contains("`hidden` must be"));
    assert!(story(&replaced("\"halflight-ddf\"", "\"halflight-daf\"")).contains("no field"));
    // NaN among the weights: the network is the one tensor of floats.
    let header = u64::from_le_bytes(bytes[..8].try_into().expect("eight bytes")) as usize + 8;
    let at = (header..bytes.len() - 4).step_by(4).find(|&at| {
        let value = f32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"));
        let mut changed = bytes.clone();
        changed[at..at + 4].copy_from_slice(&f32::NAN.to_le_bytes());
        value != 0.0 && DirectedField::decode(&changed, Path::new("x.ddf")).is_err()
    });
    assert!(at.is_some(), "NaN is refused somewhere in the file");
}

/// A field's file with other words in its header.
fn with_header(bytes: &[u8], from: &str, to: &str) -> Vec<u8> {
    let length = u64::from_le_bytes(bytes[..8].try_into().expect("eight bytes")) as usize;
    let text = std::str::from_utf8(&bytes[8..8 + length]).expect("a header of text");
    assert!(text.contains(from), "{text}");
    let text = text.replacen(from, to, 1);
    [&(text.len() as u64).to_le_bytes()[..], text.as_bytes(), &bytes[8 + length..]].concat()
}

#[test]
fn headers_with_absurd_numbers_or_more_tensors_than_asked_for_are_refused() {
    let (_, mut field) = trained(3);
    field.error.across_p95 = 0.125;
    let bytes = field.encode();
    let (scale, center) = (field.unit().scale, field.unit().center);
    for absurd in ["1e30", "1e-30", "-1.0", "0.0"] {
        let changed =
            with_header(&bytes, &format!("\\\"scale\\\":{scale}"), &format!("\\\"scale\\\":{absurd}"));
        assert!(story(&changed).contains("bounds that cannot be"), "{absurd}");
    }
    let far = with_header(&bytes, &format!("[{:?},", center[0]), "[1e30,");
    assert!(story(&far).contains("bounds that cannot be"));
    for absurd in ["1e30", "-0.5", "5.0"] {
        let changed = with_header(&bytes, "across_p95\\\":0.125", &format!("across_p95\\\":{absurd}"));
        assert!(story(&changed).contains("`across_p95`"), "{absurd}");
    }
    let length = bytes.len() - 8 - u64::from_le_bytes(bytes[..8].try_into().expect("eight bytes")) as usize;
    let more =
        format!(r#""extra":{{"dtype":"U8","shape":[4],"data_offsets":[{length},{}]}},"cells":"#, length + 4);
    let mut changed = with_header(&bytes, "\"cells\":", &more);
    changed.extend([0; 4]);
    assert!(story(&changed).contains("extra"), "{}", story(&changed));
}

#[test]
fn front_and_back_are_told_apart_as_the_mesh_has_them() {
    let (trainer, mut field) = trained(1500);
    assert!(field.knows_sides());
    field.error = evaluate(&field, trainer.unit_mesh(), 3000, 3).measured();
    let again =
        DirectedField::decode(&field.encode(), Path::new("x.ddf")).expect("what was written can be read");
    assert!(again.knows_sides());
    let old = with_header(&field.encode(), ",\\\"sides\\\":true", "");
    assert!(!DirectedField::decode(&old, Path::new("x.ddf")).expect("files of before").knows_sides());
    let tracer = FieldTracer::new(Arc::new(again));
    let mesh = MeshTracer::build(Arc::new(ring()));
    let (mut right, mut all, mut from_within) = (0, 0, 0);
    for (i, direction) in even_directions(4000).into_iter().enumerate() {
        let angle = i as f32 * 0.37;
        let ring = Vec3::new(10.0 + 3.0 * angle.cos(), 0.0, -5.0 + 3.0 * angle.sin());
        // From the middle of the tube, and from far away.
        let within = i % 2 == 0;
        let x = if within { ring } else { ring - 12.0 * direction };
        let ray = Ray::new(x, direction);
        let (Some(truth), Some(found)) = (mesh.closest(&ray), tracer.closest(&ray)) else { continue };
        let (truth, found) = (mesh.surface(&ray, &truth), tracer.surface(&ray, &found));
        all += 1;
        from_within += usize::from(within);
        right += usize::from(
            truth.geometric_normal.dot(direction).signum() == found.geometric_normal.dot(direction).signum(),
        );
    }
    assert!(all > 3500 && from_within > 1900 && right as f32 > 0.985 * all as f32, "{right} of {all}");
}

#[test]
fn rays_that_leave_the_surface_rarely_meet_it_again() {
    let (trainer, mut field) = trained(1500);
    field.error = evaluate(&field, trainer.unit_mesh(), 3000, 3).measured();
    let tracer = FieldTracer::new(Arc::new(field));
    let mesh = MeshTracer::build(Arc::new(ring()));
    let (mut free, mut stopped, mut hidden, mut lost) = (0, 0, 0, 0);
    let views = even_directions(997);
    for (i, aside) in even_directions(20_000).into_iter().enumerate() {
        let angle = i as f32 * 0.37;
        let target = Vec3::new(10.0 + 3.0 * angle.cos(), 0.0, -5.0 + 3.0 * angle.sin());
        let direction = views[i % 997];
        let ray = Ray::new(target - 12.0 * direction, direction);
        let (Some(truth), Some(found)) = (mesh.closest(&ray), tracer.closest(&ray)) else { continue };
        let (t, f) = (mesh.surface(&ray, &truth), tracer.surface(&ray, &found));
        let onwards = (f.geometric_normal + aside).normalize();
        if t.geometric_normal.dot(onwards) <= 0.0 || t.position.distance(f.position) > 0.2 {
            continue;
        }
        let truth = mesh.occluded(&Ray::new(t.position + 1e-4 * t.geometric_normal, onwards));
        let said = tracer.occluded(&Ray::new(f.position + f.position_error * f.geometric_normal, onwards));
        if truth {
            hidden += 1;
            lost += usize::from(!said);
        } else {
            free += 1;
            stopped += usize::from(said);
        }
    }
    assert!(free > 10_000 && stopped as f32 <= 0.012 * free as f32, "{stopped} of {free}");
    assert!(hidden > 500 && lost as f32 <= 0.03 * hidden as f32, "{lost} of {hidden}");
}

#[test]
fn the_free_sky_of_points_is_that_which_rays_against_the_mesh_find() {
    let (_, field) = trained(1500);
    let mesh = MeshTracer::build(Arc::new(ring()));
    let points: Vec<Vec3> = even_directions(40)
        .into_iter()
        .map(|d| Vec3::new(10.0, 0.0, -5.0) + 4.6 * d)
        .chain([Vec3::new(10.0, 0.0, -5.0), Vec3::new(10.0, 1.5, -5.0)])
        .collect();
    let found: Vec<Sh<4>> = field.free_sky(&points, 2000);
    let around = even_directions(2000);
    let weight = 4.0 * std::f32::consts::PI / 2000.0;
    for (x, found) in points.into_iter().zip(found) {
        let mut truth = [0.0f32; 16];
        for &omega in &around {
            if !mesh.occluded(&Ray::new(x, omega)) {
                let basis = Sh::<4>::basis(omega.to_array());
                truth.iter_mut().zip(basis.coefficients()).for_each(|(sum, y)| *sum += weight * y);
            }
        }
        // The whole sky is √4π = 3.54.
        let error: f32 = truth.iter().zip(found.coefficients()).map(|(a, b)| (a - b).powi(2)).sum();
        assert!(error.sqrt() < 0.08, "{x}: {error} {truth:?} {found:?}");
    }
}

#[test]
fn a_mesh_far_from_the_origin_is_answered_where_it_stands() {
    let away = Vec3::new(65536.0, -32768.0, 0.0);
    let mut mesh = ring();
    mesh.positions.iter_mut().for_each(|p| *p += away);
    let mut trainer = FastTrainer::new(&mesh, options()).expect("a ring can be learned");
    for step in 0..600 {
        trainer.step(step as f32 / 600.0).expect("training goes on");
    }
    let field = trainer.field();
    assert!(field.unit().rounding() > 1e-4 && UnitSpace::of_mesh(&ring()).expect("a size").rounding() < 1e-6);
    let mut off: Vec<f32> = (0..400)
        .filter_map(|i| {
            let angle = i as f32 * 0.37;
            let x = away + Vec3::new(10.0 + 3.0 * angle.cos(), 8.0, -5.0 + 3.0 * angle.sin());
            // The top of the tube is 1 above its middle.
            Some((field.query(x, Vec3::NEG_Y, f32::INFINITY)?.distance - 7.0).abs())
        })
        .collect();
    off.sort_by(f32::total_cmp);
    assert!(off.len() > 390 && off[off.len() * 9 / 10] < 0.06, "{} {}", off.len(), off[off.len() / 2]);
}

/// How far the vertices of a converted mesh are from where they should be, in steps of its grid: 99th percentile, and most;
/// of a field, and of the exact distances at the same posts, which creases keep from being 0.
fn pits(mesh: &TriangleMesh, posts: u32) -> [(f32, f32); 2] {
    // Cells of about a step of the grid.
    let options = TrainOptions { shape: FastShape { resolution: 48, ..FastShape::default() }, ..options() };
    let mut trainer = FastTrainer::new(mesh, options).expect("a mesh to learn");
    for step in 0..1200 {
        trainer.step(step as f32 / 1200.0).expect("training goes on");
    }
    let grid = trainer.field().surface_grid(posts, &|_| true).expect("nobody said no");
    let truth = Cloud::new(mesh_points(mesh, 200_000, 1));
    let place =
        |i: u32| Vec3::new((i % posts) as f32, (i / posts % posts) as f32, (i / (posts * posts)) as f32);
    let distances = (0..posts.pow(3)).map(|i| truth.squared_distance(grid.low + grid.step * place(i)).sqrt());
    let exact = DistanceGrid { values: distances.collect(), ..grid.clone() };
    [grid, exact].map(|grid| {
        let shell = 0.8 * grid.step;
        let surface = grid.surface(shell);
        assert!(surface.triangles.len() > 1000);
        let away = |&p: &Vec3| (truth.squared_distance(p).sqrt() - shell).abs() / grid.step;
        let mut off: Vec<f32> = surface.positions.iter().map(away).collect();
        off.sort_by(f32::total_cmp);
        (off[off.len() * 99 / 100], off[off.len() - 1])
    })
}

#[test]
fn a_field_becomes_a_mesh_without_pits() {
    // A ball, and a head: balls that stand in one another, with a ring about them.
    let ball = ico_sphere(1.0, 4);
    let (mut positions, mut triangles) = (ball.positions.clone(), ball.triangles.clone());
    for (part, by) in [
        (ico_sphere(0.3, 3), Vec3::new(0.4, 0.2, 0.8)),
        (ico_sphere(0.3, 3), Vec3::new(-0.4, 0.2, 0.8)),
        (torus(0.8, 0.15, 48, 16), Vec3::new(0.0, -0.7, 0.0)),
    ] {
        let first = positions.len() as u32;
        positions.extend(part.positions.iter().map(|&p| p + by));
        triangles.extend(part.triangles.iter().map(|t| t.map(|v| v + first)));
    }
    let head = TriangleMesh { positions, triangles, ..TriangleMesh::default() };
    for (name, mesh) in [("ball", &ball), ("head", &head)] {
        let [field, exact] = pits(mesh, 40);
        println!("{name}: {field:?}, exact {exact:?}");
        assert!(field.0 < exact.0 + 0.15 && field.1 < exact.1 + 1.0, "{name}: {field:?}, exact {exact:?}");
    }
}

#[test]
fn meshes_without_a_surface_are_refused_with_a_story() {
    let empty = FastTrainer::new(&TriangleMesh::default(), options());
    assert!(empty.is_err());
    let point =
        TriangleMesh { positions: vec![Vec3::ONE; 3], triangles: vec![[0, 1, 2]], ..TriangleMesh::default() };
    assert!(matches!(FastTrainer::new(&point, options()), Err(DdfError::NoSurface { triangles: 1 })));
    let needle = TriangleMesh {
        positions: vec![Vec3::ZERO, Vec3::X, 2.0 * Vec3::X],
        triangles: vec![[0, 1, 2]],
        ..TriangleMesh::default()
    };
    assert!(matches!(FastTrainer::new(&needle, options()), Err(DdfError::NoSurface { .. })));
    let mut broken = ring();
    broken.positions[5].x = f32::NAN;
    assert!(FastTrainer::new(&broken, options()).is_err());
    let mut lost = ring();
    lost.triangles.push([0, 1, 999_999]);
    assert!(FastTrainer::new(&lost, options()).is_err());
    let wide = TrainOptions { shape: FastShape { resolution: 1000, ..FastShape::default() }, ..options() };
    let error = FastTrainer::new(&ring(), wide).expect_err("too many cells");
    assert!(error.to_string().contains("resolution"), "{error}");
}

#[test]
fn non_manifold_and_open_meshes_are_learned_as_they_are() {
    // Three sheets along one edge, and a triangle that is there twice.
    let mesh = TriangleMesh {
        positions: vec![Vec3::ZERO, Vec3::Y, Vec3::X, Vec3::Z, Vec3::new(-1.0, 0.0, -1.0)],
        triangles: vec![[0, 1, 2], [0, 1, 3], [0, 1, 4], [0, 1, 4]],
        ..TriangleMesh::default()
    };
    let mut trainer = FastTrainer::new(&mesh, options()).expect("sheets can be learned");
    for step in 0..1200 {
        trainer.step(step as f32 / 1200.0).expect("training goes on");
    }
    let found = evaluate(&trainer.field(), trainer.unit_mesh(), 3000, 3);
    assert!(found.clouds.chamfer_e3 < 1.6 * found.floor_e3, "{found:?}");
}

#[test]
fn odd_rays_get_sound_answers() {
    let (_, field) = trained(100);
    let tracer = FieldTracer::new(Arc::new(field));
    let (x, omega) = (Vec3::new(10.0, 0.0, 20.0), Vec3::NEG_Z);
    let straight = tracer.closest(&Ray::new(x, omega)).expect("the ring is ahead");
    for (x, omega) in [
        (x, Vec3::ZERO),
        (x, Vec3::NAN),
        (Vec3::NAN, omega),
        (Vec3::INFINITY, omega),
        (x, Vec3::new(f32::INFINITY, 0.0, 0.0)),
        (x, -omega),
        (Vec3::new(1e30, 0.0, 0.0), omega),
    ] {
        assert_eq!(tracer.closest(&Ray::new(x, omega)), None, "{x} {omega}");
        assert!(!tracer.occluded(&Ray::new(x, omega)));
    }
    // Directions of any length: t counts in that length.
    let long = tracer.closest(&Ray::new(x, 4.0 * omega)).expect("the same ray");
    assert!((long.t * 4.0 - straight.t).abs() < 1e-3);
    // A ray that ends before the surface meets nothing, and one that ends behind it does.
    assert!(!tracer.occluded(&Ray { t_max: straight.t - 2.0, ..Ray::new(x, omega) }));
    assert!(tracer.occluded(&Ray { t_max: straight.t + 1.0, ..Ray::new(x, omega) }));
    assert!(tracer.closest(&Ray { t_max: -1.0, ..Ray::new(x, omega) }).is_none());
    // From within the tube the wall is ahead in every direction; from within the bounds, on the surface: finite answers.
    for start in [Vec3::new(13.0, 0.0, -5.0), Vec3::new(14.0, 0.0, -5.0), Vec3::new(10.0, 0.0, -5.0)] {
        for direction in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::Z] {
            let ray = Ray::new(start, direction);
            if let Some(hit) = tracer.closest(&ray) {
                assert!(hit.t > 0.0 && hit.t.is_finite());
                let surface = tracer.surface(&ray, &hit);
                assert!(surface.geometric_normal.is_finite() && surface.position.is_finite());
                assert!(surface.geometric_normal.dot(direction) != 0.0);
            }
        }
    }
}

#[test]
fn with_its_mesh_a_field_answers_as_the_mesh_does() {
    let (trainer, mut field) = trained(300);
    field.error = evaluate(&field, trainer.unit_mesh(), 3000, 3).measured();
    let mesh = Arc::new(MeshTracer::build(Arc::new(ring())));
    let tracer = FieldTracer::with_fallback(Arc::new(field), Arc::clone(&mesh));
    let (mut same, mut rays) = (0, 0);
    for i in 0..4000 {
        let (a, b) = (i as f32 * 0.11, i as f32 * 0.017);
        let x = Vec3::new(10.0 + 9.0 * a.cos(), 5.0 * b.sin(), -5.0 + 9.0 * a.sin());
        let target = Vec3::new(10.0 + 4.2 * b.cos(), (a * 1.7).sin(), -5.0 + 4.2 * (b * 2.0).sin());
        let ray = Ray::new(x, (target - x).normalize());
        let (truth, found) = (mesh.closest(&ray), tracer.closest(&ray));
        rays += 1;
        same += usize::from(match (truth, found) {
            (Some(a), Some(b)) => (a.t - b.t).abs() < 1e-3,
            (None, None) => true,
            _ => false,
        });
    }
    assert!(same as f32 > 0.998 * rays as f32, "{same} of {rays}");
    let counts = tracer.fallback_counts();
    assert!(counts.asked == 4000 && counts.fell_back > 0, "{counts:?}");
}

#[test]
fn a_ring_is_learned_from_samples_alone() {
    let mesh = ring();
    let unit = UnitSpace::of_mesh(&mesh).expect("a ring has a size");
    let unit_mesh = Arc::new(unit.mesh_to_unit(&mesh));
    let learned = |count: usize| {
        let samples = draw_samples(&unit_mesh, SampleScheme::Random { count }, 1);
        let mut trainer = FastTrainer::from_samples(&mesh, samples, options()).expect("samples to learn");
        for step in 0..600 {
            trainer.step(step as f32 / 600.0).expect("training goes on");
        }
        evaluate(&trainer.field(), &unit_mesh, 4000, 3)
    };
    let (few, many) = (learned(300), learned(200_000));
    assert!(many.primary.visibility > 0.96, "{many:?}");
    assert!(many.clouds.chamfer_e3 < 1.5 * many.floor_e3, "{many:?}");
    assert!(few.primary.visibility < many.primary.visibility, "{few:?}");
    assert!(FastTrainer::from_samples(&mesh, Vec::new(), options()).is_err());
}

#[test]
fn a_training_from_samples_resumes_with_the_same_samples_only() {
    let mesh = ring();
    let unit = UnitSpace::of_mesh(&mesh).expect("a ring has a size");
    let unit_mesh = Arc::new(unit.mesh_to_unit(&mesh));
    let from = |seed| {
        let samples = draw_samples(&unit_mesh, SampleScheme::Random { count: 2000 }, seed);
        FastTrainer::from_samples(&mesh, samples, options()).expect("samples to learn")
    };
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("ring.checkpoint");
    let mut first = from(1);
    first.step(0.0).expect("a step");
    first.save_checkpoint(&path).expect("saved");
    from(1).resume(&path).expect("the same samples");
    assert!(from(2).resume(&path).expect_err("others").to_string().contains("other samples"));
}

#[test]
fn the_network_of_002_is_a_field_like_any_other() {
    let mesh = ring();
    let unit = UnitSpace::of_mesh(&mesh).expect("a ring has a size");
    let unit_mesh = Arc::new(unit.mesh_to_unit(&mesh));
    let samples =
        draw_samples(&unit_mesh, SampleScheme::Surface { faces: 20, directions: 4, marching: 4 }, 1);
    let sizes = SeedOptions { layers: 3, width: 64, ..SeedOptions::default() };
    let mut trainer = SeedTrainer::new(samples, sizes).expect("samples to learn");
    for step in 0..900 {
        trainer.step(step as f32 / 900.0).expect("training goes on");
    }
    let field = DirectedField::of_seed(trainer.network(), unit);
    let found = evaluate(&field, &unit_mesh, 3000, 3);
    // A small one, trained for a second, has a rough idea of the ring.
    assert!(found.primary.visibility > 0.75 && found.primary.depth_median < 0.3, "{found:?}");
    // Its file, whole and broken.
    let bytes = field.encode();
    let again = DirectedField::decode(&bytes, Path::new("seed.ddf")).expect("what was written can be read");
    assert!(again.encode() == bytes && matches!(again.shape(), FieldShape::Seed(ref s) if s.width == 64));
    for length in [0, 8, 100, bytes.len() / 2, bytes.len() - 1] {
        story(&bytes[..length]);
    }
    let at = bytes.windows(14).position(|w| w == b"\\\"width\\\":64,\\").expect("the width is there");
    let mut wide = bytes.clone();
    wide[at + 10..at + 12].copy_from_slice(b"96");
    assert!(story(&wide).contains("where the header asks"));
    let mut broken = bytes.clone();
    let last = broken.len() - 4;
    broken[last..].copy_from_slice(&f32::NAN.to_le_bytes());
    assert!(story(&broken).contains("NaN"));
    // Rays, odd ones among them.
    let tracer = FieldTracer::new(Arc::new(again));
    let (x, omega) = (Vec3::new(13.0, 8.0, -5.0), Vec3::NEG_Y);
    let ray = Ray::new(x, omega);
    let hit = tracer.closest(&ray).expect("the tube is below");
    assert!((hit.t - 7.0).abs() < 3.0, "{hit:?}");
    let normal = tracer.surface(&ray, &hit).geometric_normal;
    assert!(normal.is_normalized() && normal.y > 0.0, "{normal}");
    assert!(tracer.occluded(&ray) && !tracer.occluded(&Ray { t_max: 2.0, ..ray }));
    for omega in [Vec3::ZERO, Vec3::NAN, Vec3::Y] {
        assert_eq!(tracer.closest(&Ray::new(x, omega)), None);
    }
}

#[test]
fn a_field_as_a_solid_is_closed_and_of_its_size() {
    let (_, field) = trained(600);
    let solid = field.solid(40);
    let mut edges = std::collections::HashMap::new();
    for t in &solid.triangles {
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            *edges.entry((a.min(b), a.max(b))).or_insert(0) += if a < b { 1 } else { -1 };
        }
    }
    assert!(edges.values().all(|&sum| sum == 0), "every edge is passed both ways");
    let volume: f32 =
        (0..solid.triangles.len()).map(|i| solid.corners(i)).map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum();
    let exact = 2.0 * std::f32::consts::PI.powi(2) * 3.0;
    assert!((volume / exact - 1.0).abs() < 0.1, "{volume} {exact}");
}
