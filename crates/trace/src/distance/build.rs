//! Marks, the distance transform, bricks.

use std::sync::atomic::{AtomicU64, Ordering};

use glam::Vec3;
use rayon::prelude::*;

use super::mark::{Frame, primitives};
use super::{BRICK, Coarse, DistanceGrid};
use crate::World;

/// Primitives that a thread marks at once.
const PART: usize = 4096;

pub(super) fn build(world: &World, (low, high): (Vec3, Vec3), resolution: usize) -> DistanceGrid {
    let extent = (high - low).max_element();
    if !(extent.is_finite() && extent > 0.0) {
        // Nothing, or a point: everything is far or near by its own.
        let nothing = world.instances().is_empty();
        let coarse = vec![Coarse::Far(if nothing { f32::INFINITY } else { 0.0 })];
        let low = if low.is_finite() { low } else { Vec3::ZERO };
        return DistanceGrid { low, voxel: 1.0, bricks: [1; 3], coarse, fine: Vec::new() };
    }
    let voxel = extent / resolution as f32 * 1.001;
    let bricks: [usize; 3] =
        std::array::from_fn(|axis| ((((high - low)[axis] / voxel).ceil() as usize).max(1)).div_ceil(BRICK));
    let size = bricks.map(|n| n * BRICK);
    let frame = Frame { low, voxel, size };
    let marked = mark(world, &frame);
    let distances = transform(&marked, size);
    let slack = 3f32.sqrt();
    let metres = |squared: f32| ((squared.sqrt() - slack) * voxel).max(0.0);
    cut(&distances, size, bricks, low, voxel, metres)
}

/// One bit for each voxel.
fn mark(world: &World, frame: &Frame) -> Vec<u64> {
    let count = frame.size.iter().product::<usize>();
    let bits: Vec<AtomicU64> = (0..count.div_ceil(64)).map(|_| AtomicU64::new(0)).collect();
    let jobs: Vec<(usize, f32, [usize; 2])> = world
        .instances()
        .iter()
        .enumerate()
        .flat_map(|(index, instance)| {
            let total = primitives(&instance.geometry);
            let steps = steps(instance, frame.voxel);
            (0..=steps).flat_map(move |step| {
                let time = step as f32 / steps.max(1) as f32;
                (0..total).step_by(PART).map(move |first| (index, time, [first, (first + PART).min(total)]))
            })
        })
        .collect();
    jobs.par_iter().for_each(|&(index, time, part)| {
        let mut set = |at: usize| {
            bits[at / 64].fetch_or(1 << (at % 64), Ordering::Relaxed);
        };
        frame.instance(&world.instances()[index], time, part, &mut set);
    });
    bits.into_iter().map(AtomicU64::into_inner).collect()
}

/// Steps between which nothing of an instance moves by more than half a voxel: 0 for what stands still.
fn steps(instance: &crate::Instance, voxel: f32) -> usize {
    let (low, high) = instance.geometry.as_rays().bounds();
    let moved = |i: usize| {
        let pick = |bit: usize, axis: usize| if i >> bit & 1 == 0 { low[axis] } else { high[axis] };
        let corner = Vec3::new(pick(0, 0), pick(1, 1), pick(2, 2));
        let [a, b] = [0.0, 1.0].map(|time| instance.transform.at(time).transform_point3(corner));
        a.distance(b)
    };
    let most = (0..8).map(moved).fold(0.0, f32::max);
    // Vertices that move by themselves go in straight lines too.
    let deformed = match &*instance.geometry {
        crate::Geometry::Mesh(mesh) if mesh.is_moving() => {
            let corner = |triangle: u32, k: usize| {
                let [a, b] = [0.0, 1.0].map(|time| {
                    instance.transform.at(time).transform_point3(mesh.corners(triangle, time)[k])
                });
                a.distance(b)
            };
            let triangles = mesh.mesh().triangles.len() as u32;
            (0..triangles)
                .flat_map(|t| (0..3).map(move |k| (t, k)))
                .map(|(t, k)| corner(t, k))
                .fold(0.0, f32::max)
        }
        _ => 0.0,
    };
    (2.0 * most.max(deformed) / voxel).ceil().min(4096.0) as usize
}

/// Squared distances between middles, in voxels.
fn transform(marked: &[u64], [nx, ny, nz]: [usize; 3]) -> Vec<f32> {
    const FAR: f32 = 1e12;
    let mut distances = vec![0.0f32; nx * ny * nz];
    distances.par_chunks_mut(nx).enumerate().for_each(|(row, line)| {
        for (x, value) in line.iter_mut().enumerate() {
            let at = row * nx + x;
            *value = if marked[at / 64] >> (at % 64) & 1 == 1 { 0.0 } else { FAR };
        }
        lower_envelope(line, &mut Envelope::new(nx));
    });
    // Along y, one slab of z after another.
    distances.par_chunks_mut(nx * ny).for_each(|slab| {
        let (mut envelope, mut line) = (Envelope::new(ny), vec![0.0; ny]);
        for x in 0..nx {
            for y in 0..ny {
                line[y] = slab[y * nx + x];
            }
            lower_envelope(&mut line, &mut envelope);
            for y in 0..ny {
                slab[y * nx + x] = line[y];
            }
        }
    });
    // Along z: turned, so that threads have lines of their own.
    let mut turned = vec![0.0f32; distances.len()];
    turned.par_chunks_mut(nz * nx).enumerate().for_each(|(y, slab)| {
        let mut envelope = Envelope::new(nz);
        for x in 0..nx {
            let line = &mut slab[x * nz..(x + 1) * nz];
            for (z, value) in line.iter_mut().enumerate() {
                *value = distances[(z * ny + y) * nx + x];
            }
            lower_envelope(line, &mut envelope);
        }
    });
    distances.par_chunks_mut(nx * ny).enumerate().for_each(|(z, slab)| {
        for y in 0..ny {
            for x in 0..nx {
                slab[y * nx + x] = turned[(y * nx + x) * nz + z];
            }
        }
    });
    distances
}

/// Room for the parabolas of a line.
struct Envelope {
    at: Vec<usize>,
    begin: Vec<f32>,
    line: Vec<f32>,
}

impl Envelope {
    fn new(n: usize) -> Self {
        Self { at: vec![0; n], begin: vec![0.0; n + 1], line: vec![0.0; n] }
    }
}

/// min over q of (p − q)² + f(q), in place.
fn lower_envelope(f: &mut [f32], room: &mut Envelope) {
    let n = f.len();
    room.line[..n].copy_from_slice(f);
    let line = &room.line;
    let crossing = |q: usize, v: usize| {
        let (q_, v_) = (q as f32, v as f32);
        ((line[q] - line[v]) + (q_ * q_ - v_ * v_)) / (2.0 * (q_ - v_))
    };
    let mut k = 0;
    room.at[0] = 0;
    (room.begin[0], room.begin[1]) = (f32::NEG_INFINITY, f32::INFINITY);
    for q in 1..n {
        let mut s = crossing(q, room.at[k]);
        while s <= room.begin[k] && k > 0 {
            k -= 1;
            s = crossing(q, room.at[k]);
        }
        k += 1;
        room.at[k] = q;
        room.begin[k] = s;
        room.begin[k + 1] = f32::INFINITY;
    }
    k = 0;
    for (p, value) in f.iter_mut().enumerate() {
        while room.begin[k + 1] < p as f32 {
            k += 1;
        }
        let d = p as f32 - room.at[k] as f32;
        *value = d * d + line[room.at[k]];
    }
}

/// Keeps the voxels of bricks in which distances differ much from their least.
fn cut(
    distances: &[f32],
    [nx, ny, _]: [usize; 3],
    bricks: [usize; 3],
    low: Vec3,
    voxel: f32,
    metres: impl Fn(f32) -> f32 + Sync,
) -> DistanceGrid {
    /// Bricks whose least distance is above this many sides are kept as one number: a tenth is lost at most.
    const NEAR: f32 = 12.0;
    let read = |brick: usize, inner: usize| {
        let [bx, by, bz] = [brick % bricks[0], brick / bricks[0] % bricks[1], brick / bricks[0] / bricks[1]];
        let [x, y, z] = [inner % BRICK, inner / BRICK % BRICK, inner / BRICK / BRICK];
        metres(distances[((bz * BRICK + z) * ny + by * BRICK + y) * nx + bx * BRICK + x])
    };
    let all = BRICK * BRICK * BRICK;
    let least: Vec<f32> = (0..bricks.iter().product::<usize>())
        .into_par_iter()
        .map(|brick| (0..all).map(|inner| read(brick, inner)).fold(f32::INFINITY, f32::min))
        .collect();
    let (mut coarse, mut fine) = (Vec::with_capacity(least.len()), Vec::new());
    for (brick, &least) in least.iter().enumerate() {
        if least > NEAR * BRICK as f32 * voxel {
            coarse.push(Coarse::Far(least));
        } else {
            coarse.push(Coarse::Near(fine.len() as u32));
            fine.extend((0..all).map(|inner| read(brick, inner)));
        }
    }
    DistanceGrid { low, voxel, bricks, coarse, fine }
}
