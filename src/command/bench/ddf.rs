//! Fields of directed distances against the meshes that they were learned from: rays per second, memory, accuracy.
//!
//! The same rays through the mesh's tree and through the field, one at a time, closest hit for primary, random and bounce
//! rays, any hit for bounce rays (as shadow rays are asked).

use std::sync::Arc;
use std::time::Instant;

use glam::Vec3;
use halflight_ddf::{
    Cloud, DirectedField, FastShape, FastTrainer, FieldTracer, SampleScheme, SeedOptions, SeedTrainer,
    TrainOptions, UnitSpace, chamfer_e3, draw_samples, evaluate, field_points, mesh_points,
};
use halflight_trace::bench::{View, cpu_seconds_of_process, primary_rays};
use halflight_trace::{Geometry, Instance, MeshTracer, Ray, RayGeometry, World};
use rayon::prelude::*;

use super::clock;
use super::rays::ray_sets;
use super::subjects::subjects;
use super::{BenchArgs, Findings};
use crate::command::failure::Failure;
use crate::command::table::Table;
use crate::command::words;

/// Rays that a thread takes at a time.
const CHUNK: usize = 4096;

pub(super) fn measure(args: &BenchArgs) -> Result<Findings, Failure> {
    let (side, seconds, steps) = if args.quick { (96, 0.02, 40) } else { (512, 0.5, 3000) };
    let simd = args.machine.simd()?;
    let (subjects, mut notes) = subjects(args)?;
    let mut table = Table::new([
        "mesh",
        "triangles",
        "rays",
        "mesh closest",
        "field closest",
        "mesh any",
        "field any",
        "mesh memory",
        "field memory",
        "right",
        "Chamfer × 10³",
    ]);
    for subject in &subjects {
        let mut mesh = (*subject.mesh).clone();
        mesh.repair().map_err(|error| Failure::failed(format!("{}: {error}", subject.name)))?;
        let resolution = if args.quick { 32 } else { FastShape::default().resolution };
        let options = TrainOptions {
            shape: FastShape { resolution, ..FastShape::default() },
            ..TrainOptions::default()
        };
        let fail = |error| Failure::failed(format!("{}: {error}", subject.name));
        let mut trainer = FastTrainer::new(&mesh, options).map_err(fail)?;
        let (start, mut samples) = (Instant::now(), 0);
        for step in 0..steps {
            samples += trainer.step(step as f32 / steps as f32).map_err(fail)?.samples;
        }
        let rate = samples as f64 / start.elapsed().as_secs_f64();
        let mut field = trainer.field();
        let found = evaluate(&field, trainer.unit_mesh(), if args.quick { 1000 } else { 30_000 }, 1);
        field.error = found.measured();
        field.set_simd(simd);
        notes.push(format!(
            "{}: {steps} steps of training, {:.2} M samples a second",
            subject.name,
            rate * 1e-6
        ));
        let tracer = MeshTracer::build(Arc::new(mesh));
        let (mesh_bytes, field_bytes) = (tracer.memory_bytes(), field.memory_bytes());
        let of_mesh = World::build(vec![Instance::at_origin(Geometry::Mesh(tracer))], simd);
        let geometry = Geometry::Custom(Arc::new(FieldTracer::new(Arc::new(field))));
        let of_field = World::build(vec![Instance::at_origin(geometry)], simd);
        for (name, rays) in ray_sets(&of_mesh, subject, side) {
            let agree = rays
                .par_iter()
                .filter(|ray| of_mesh.closest(ray).is_some() == of_field.closest(ray).is_some())
                .count();
            let rate = |world: &World, any: bool| -> Result<String, Failure> {
                let timing = clock::on_threads(1, || clock::time(seconds, || ask(world, &rays, any)));
                let cpu = timing.map_err(Failure::failed)?.cpu;
                Ok(format!("{:.2}", rays.len() as f64 / cpu * 1e-6))
            };
            table.row([
                subject.name.to_string(),
                subject.mesh.triangles.len().to_string(),
                name.to_string(),
                rate(&of_mesh, false)?,
                rate(&of_field, false)?,
                rate(&of_mesh, true)?,
                rate(&of_field, true)?,
                words::bytes(mesh_bytes as u64),
                words::bytes(field_bytes as u64),
                format!("{:.2} %", 100.0 * agree as f64 / rays.len().max(1) as f64),
                format!("{} ({})", words::figure(found.clouds.chamfer_e3), words::figure(found.floor_e3)),
            ]);
        }
    }
    notes.push("millions of rays for each second of processor time, one thread, ray by ray".into());
    notes.push("bounce rays start on the mesh, not off it by the field's error: many meet the field where they start".into());
    notes.push("right: rays for which hit or miss is that of the mesh; in brackets the Chamfer distance of two clouds of the mesh itself".into());
    Ok(Findings { title: "Fields of directed distances", table, notes })
}

/// Milliseconds of a picture of 512 × 512 of distances, of normals, and of one path a pixel with up to four diffuse
/// bounces, through the mesh's tree and through the field [002 Fig. 5].
pub(super) fn pictures(args: &BenchArgs) -> Result<Findings, Failure> {
    let (side, seconds, steps) = if args.quick { (64, 0.02, 40) } else { (512, 0.5, 3000) };
    let (subjects, _) = subjects(args)?;
    let subject = subjects.get(1).unwrap_or(&subjects[0]);
    let mut mesh = (*subject.mesh).clone();
    mesh.repair().map_err(|error| Failure::failed(format!("{}: {error}", subject.name)))?;
    let fail = |error| Failure::failed(format!("{}: {error}", subject.name));
    let mut trainer = FastTrainer::new(&mesh, TrainOptions::default()).map_err(fail)?;
    for step in 0..steps {
        trainer.step(step as f32 / steps as f32).map_err(fail)?;
    }
    let mut field = trainer.field();
    field.error = evaluate(&field, trainer.unit_mesh(), if args.quick { 1000 } else { 10_000 }, 1).measured();
    field.set_simd(args.machine.simd()?);
    let tree = MeshTracer::build(Arc::new(mesh));
    let rays = primary_rays(&View::outside(tree.bounds()), side);
    let field = FieldTracer::new(Arc::new(field));
    let mut table = Table::new(["picture", "mesh, ms", "field, ms"]);
    /// What is worked out for a pixel, as one number that cannot be left out.
    type Pixel = fn(&dyn RayGeometry, &Ray, u32) -> f32;
    let kinds: [(&str, Pixel); 3] = [
        ("distance", |form, ray, _| form.closest(ray).map_or(0.0, |hit| hit.t)),
        ("normal", |form, ray, _| {
            form.closest(ray).map_or(0.0, |hit| form.surface(ray, &hit).geometric_normal.x)
        }),
        ("path-traced, 1 path", |form, ray, pixel| super::super::ddf::radiance(form, ray, pixel, 0).x),
    ];
    for (name, pixel) in kinds {
        let time = |form: &dyn RayGeometry| -> Result<String, Failure> {
            let picture = || {
                let of_chunk = |(number, chunk): (usize, &[Ray])| -> f32 {
                    let first = (number * CHUNK) as u32;
                    (first..).zip(chunk).map(|(index, ray)| pixel(form, ray, index)).sum()
                };
                std::hint::black_box(rays.par_chunks(CHUNK).enumerate().map(of_chunk).sum::<f32>());
            };
            let timing = clock::on_threads(1, || clock::time(seconds, picture)).map_err(Failure::failed)?;
            Ok(format!("{:.1}", 1e3 * timing.cpu))
        };
        table.row([name.to_string(), time(&tree)?, time(&field)?]);
    }
    let notes = vec![format!(
        "{}, {side} × {side}, milliseconds of processor time on one thread, ray by ray; field of {steps} steps",
        subject.name
    )];
    Ok(Findings { title: "Pictures of directed distances", table, notes })
}

/// The seed's network and the fast one, trained on one mesh for the same processor time.
pub(super) fn networks(args: &BenchArgs) -> Result<Findings, Failure> {
    let (budget, count) = if args.quick { (0.5, 500) } else { (30.0, 30_000) };
    let (subjects, mut notes) = subjects(args)?;
    // The first mesh from the data folder, or else the one made of formulas.
    let subject = subjects.get(1).unwrap_or(&subjects[0]);
    let mut mesh = (*subject.mesh).clone();
    mesh.repair().map_err(|error| Failure::failed(format!("{}: {error}", subject.name)))?;
    let fail = |error| Failure::failed(format!("{}: {error}", subject.name));
    let mut table = Table::new([
        "network",
        "parameters",
        "steps",
        "M samples trained / CPU s",
        "M rays asked / CPU s",
        "Chamfer × 10³",
        "right",
    ]);
    let mut trainer = FastTrainer::new(&mesh, TrainOptions::default()).map_err(fail)?;
    let unit_mesh = Arc::clone(trainer.unit_mesh());
    let of_mesh = Cloud::new(mesh_points(&unit_mesh, count, 1));
    let tracer = MeshTracer::build(Arc::clone(&unit_mesh));
    let view = View::outside(tracer.bounds());
    let rays = primary_rays(&view, if args.quick { 64 } else { 512 });
    let share = |right: usize| format!("{:.2} %", 100.0 * right as f64 / rays.len() as f64);
    let (start, mut samples) = (cpu_seconds_of_process(), 0);
    let mut spent = 0.0;
    while spent < budget {
        samples += trainer.step((spent / budget) as f32).map_err(fail)?.samples;
        spent = cpu_seconds_of_process() - start;
    }
    let field = trainer.field();
    let unit: UnitSpace = field.unit();
    let start = cpu_seconds_of_process();
    let right = rays
        .par_iter()
        .filter(|ray| {
            let said = field.query(unit.from_unit(ray.origin), ray.direction / unit.scale, f32::INFINITY);
            said.is_some() == tracer.closest(ray).is_some()
        })
        .count();
    let asked = cpu_seconds_of_process() - start;
    let cloud = Cloud::new(field_points(&field, count, 2));
    table.row([
        "fast".to_string(),
        field.parameters().to_string(),
        trainer.steps_done().to_string(),
        format!("{:.3}", samples as f64 / spent * 1e-6),
        format!("{:.3}", rays.len() as f64 / asked * 1e-6),
        words::figure(chamfer_e3(&cloud, &of_mesh)),
        share(right),
    ]);
    let scheme = SampleScheme::Surface { faces: 2, directions: 4, marching: 4 };
    let data = draw_samples(&unit_mesh, scheme, 1);
    let options = SeedOptions::default();
    let batch = options.batch;
    let mut trainer = SeedTrainer::new(data, options).map_err(fail)?;
    let start = cpu_seconds_of_process();
    spent = 0.0;
    while spent < budget {
        trainer.step((spent / budget) as f32).map_err(fail)?;
        spent = cpu_seconds_of_process() - start;
    }
    let seeds = DirectedField::of_seed(trainer.network(), unit);
    let asked_rays: Vec<(Vec3, Vec3)> =
        rays.iter().map(|ray| (unit.from_unit(ray.origin), ray.direction / unit.scale)).collect();
    let start = cpu_seconds_of_process();
    let said = seeds.query_many(&asked_rays);
    let asked = cpu_seconds_of_process() - start;
    let right = rays
        .iter()
        .zip(&said)
        .filter(|(ray, said)| said.0.is_some() == tracer.closest(ray).is_some())
        .count();
    let cloud = Cloud::new(field_points(&seeds, count, 2));
    table.row([
        "002, 8 × 512".to_string(),
        seeds.parameters().to_string(),
        trainer.steps_done().to_string(),
        format!("{:.4}", (trainer.steps_done() as usize * batch) as f64 / spent * 1e-6),
        format!("{:.3}", rays.len() as f64 / asked * 1e-6),
        words::figure(chamfer_e3(&cloud, &of_mesh)),
        share(right),
    ]);
    notes.clear();
    notes.push(format!(
        "{}, {budget} s of processor time for each; asked: the rays of a picture, all threads",
        subject.name
    ));
    notes.push("a sample of the fast network is a ray's part in one cell; one of 002 is a whole ray".into());
    Ok(Findings { title: "Networks of directed distances", table, notes })
}

fn ask(world: &World, rays: &[Ray], any: bool) {
    let one = |ray: &&Ray| if any { world.occluded(ray) } else { world.closest(ray).is_some() };
    let hits: usize = rays.par_chunks(CHUNK).map(|chunk| chunk.iter().filter(one).count()).sum();
    std::hint::black_box(hits);
}
