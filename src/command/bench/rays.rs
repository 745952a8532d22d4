//! Rays per second.
//!
//! Three sets of rays: *primary* rays of a picture in tiles of 8 × 8; *bounce* rays, which leave the points that the
//! primary ones hit with the density of the cosine; *random* rays, from a sphere of twice the mesh's radius to points
//! in a ball of its radius. Each set is asked for the closest and for any hit, ray by ray and 64 at a time.

use glam::{Vec2, Vec3};
use halflight_scene::camera::{Camera, FieldOfView};
use halflight_trace::{Geometry, Instance, MeshTracer, Ray, World};
use rayon::prelude::*;

use super::clock::{self, Timing};
use super::subjects::{Subject, subjects};
use super::{BenchArgs, Findings};
use crate::command::failure::Failure;
use crate::command::table::Table;

/// Rays that are asked together: a tile.
const PACKET: usize = 64;
/// Tiles that a thread takes at a time.
const CHUNK: usize = 64 * PACKET;

pub(super) fn measure(args: &BenchArgs) -> Result<Findings, Failure> {
    let (side, seconds) = if args.quick { (128, 0.02) } else { (1024, 0.5) };
    let simd = args.machine.simd()?;
    let (subjects, mut notes) = subjects(args)?;
    let mut table = Table::new(HEADING);
    for subject in &subjects {
        let world = World::build(
            vec![Instance::at_origin(Geometry::Mesh(MeshTracer::build(subject.mesh.clone())))],
            simd,
        );
        for (name, rays) in ray_sets(&world, subject, side) {
            let rate = |threads, query| rate(&world, &rays, seconds, threads, query).map_err(Failure::failed);
            let single = [Query::Closest, Query::ClosestPacket, Query::Any, Query::AnyPacket]
                .map(|query| rate(1, query));
            let double = [Query::ClosestPacket, Query::AnyPacket].map(|query| rate(2, query));
            let mut cells =
                vec![subject.name.to_string(), subject.mesh.triangles.len().to_string(), name.to_string()];
            for timing in single {
                cells.push(mrays(rays.len(), timing?.cpu));
            }
            for timing in double {
                cells.push(mrays(rays.len(), timing?.wall));
            }
            table.row(cells);
        }
    }
    notes.push(format!(
        "millions of rays a second, {side} × {side} rays a set; 1 thread: per second of processor time, 2 threads: of wall time; median of 3 runs of {seconds} s"
    ));
    notes.push("bounce rays are those that leave a hit of a primary ray, so there are fewer".into());
    Ok(Findings { title: "Rays", table, notes })
}

const HEADING: [&str; 9] = [
    "mesh",
    "triangles",
    "rays",
    "closest",
    "closest ×64",
    "any",
    "any ×64",
    "2 threads: closest ×64",
    "2 threads: any ×64",
];

fn mrays(rays: usize, seconds: f64) -> String {
    format!("{:.2}", rays as f64 / seconds / 1e6)
}

#[derive(Clone, Copy)]
enum Query {
    Closest,
    ClosestPacket,
    Any,
    AnyPacket,
}

fn rate(world: &World, rays: &[Ray], seconds: f64, threads: usize, query: Query) -> Result<Timing, String> {
    clock::on_threads(threads, || {
        clock::time(seconds, || {
            let hits: usize = rays.par_chunks(CHUNK).map(|chunk| count_hits(world, chunk, query)).sum();
            std::hint::black_box(hits);
        })
    })
}

fn count_hits(world: &World, rays: &[Ray], query: Query) -> usize {
    let packets = rays.chunks(PACKET);
    match query {
        Query::Closest => rays.iter().filter(|ray| world.closest(ray).is_some()).count(),
        Query::Any => rays.iter().filter(|ray| world.occluded(ray)).count(),
        Query::ClosestPacket => packets
            .map(|packet| {
                let mut hits = [None; PACKET];
                world.closest_packet(packet, &mut hits[..packet.len()]);
                hits.iter().flatten().count()
            })
            .sum(),
        Query::AnyPacket => packets
            .map(|packet| {
                let mut blocked = [false; PACKET];
                world.occluded_packet(packet, &mut blocked[..packet.len()]);
                blocked.iter().filter(|&&b| b).count()
            })
            .sum(),
    }
}

pub(super) fn ray_sets(world: &World, subject: &Subject, side: usize) -> [(&'static str, Vec<Ray>); 3] {
    let primary = primary_rays(subject, side);
    let mut random = Random(1);
    let bounce: Vec<Ray> = primary.iter().filter_map(|ray| bounce_ray(world, ray, &mut random)).collect();
    let (center, radius) = subject.sphere();
    let crossing = (0..side * side).map(|_| {
        let origin = center + 2.0 * radius * random.direction();
        let target = center + radius * random.next().cbrt() * random.direction();
        Ray { origin, direction: (target - origin).normalize_or(Vec3::X), t_max: f32::INFINITY, time: 0.0 }
    });
    let crossing = crossing.collect();
    [("primary", primary), ("bounce", bounce), ("random", crossing)]
}

/// Through the centres of the pixels, tile by tile.
fn primary_rays(subject: &Subject, side: usize) -> Vec<Ray> {
    let camera = Camera {
        pose: [Camera::look_at(subject.eye, subject.target, Vec3::Y); 2],
        field_of_view: FieldOfView::Vertical(50f32.to_radians()),
        aperture_radius: 0.0,
        focus_distance: 1.0,
    };
    let view = camera.view(side, side);
    let tiles = side / 8;
    (0..side * side)
        .map(|i| {
            let (tile, within) = (i / PACKET, i % PACKET);
            let (x, y) = (tile % tiles * 8 + within % 8, tile / tiles * 8 + within / 8);
            view.ray(Vec2::new(x as f32 + 0.5, y as f32 + 0.5), Vec2::splat(0.5), 0.0)
        })
        .collect()
}

fn bounce_ray(world: &World, ray: &Ray, random: &mut Random) -> Option<Ray> {
    let surface = world.surface(ray, &world.closest(ray)?);
    let normal = surface.geometric_normal * -ray.direction.dot(surface.geometric_normal).signum();
    let direction = (normal + random.direction()).normalize_or(normal);
    Some(surface.spawn(direction, 0.0))
}

/// A small generator of numbers; splitmix64.
struct Random(u64);

impl Random {
    /// In [0, 1).
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
    }

    /// Uniform on the sphere.
    fn direction(&mut self) -> Vec3 {
        let (z, angle) = (1.0 - 2.0 * self.next(), std::f32::consts::TAU * self.next());
        let r = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(r * angle.cos(), r * angle.sin(), z)
    }
}
