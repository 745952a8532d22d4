//! Bodies modelled like clay: rounded lumps that melt into each other, as the zero set of one distance.
//!
//! Lumps are united by the quadratic smooth minimum, min(a, b) − max(k − |a − b|, 0)²/(4k) for a softness k; holes are
//! cut the same way. The distance is negative inside, nearly true near the surface, and never much steeper than 1, so
//! blocks of a lattice that lie far from the surface are asked once. The surface net of the lattice is then drawn
//! onto the zero set, which also gives the normals.

mod animals;
mod car;
mod statue;

use std::f32::consts::TAU;

use glam::{Quat, Vec2, Vec3, Vec3Swizzles};
use rayon::prelude::*;

use crate::{Lattice, TriangleMesh};

pub use animals::{dragon, rabbit};
pub use car::car_body;
pub use statue::seated;

/// A lump of clay.
#[derive(Clone, Copy)]
enum Lump {
    /// |p/radii|_power = 1 around a centre, turned; power 2 is an ellipsoid, larger ones are boxes with round edges.
    Egg { center: Vec3, radii: Vec3, turn: Quat, power: f32 },
    /// From a point to another, with a radius at each.
    Limb { from: Vec3, to: Vec3, start: f32, end: f32 },
    /// A disk about the x axis, with round edges.
    Wheel { center: Vec3, radius: f32, half_width: f32, edge: f32 },
}

fn egg(center: [f32; 3], radii: [f32; 3]) -> Lump {
    Lump::Egg { center: center.into(), radii: radii.into(), turn: Quat::IDENTITY, power: 2.0 }
}

fn limb(from: [f32; 3], to: [f32; 3], start: f32, end: f32) -> Lump {
    Lump::Limb { from: from.into(), to: to.into(), start, end }
}

impl Lump {
    /// The same lump, turned about its middle; only eggs turn.
    fn turned(self, by: Quat) -> Self {
        match self {
            Self::Egg { center, radii, power, .. } => Self::Egg { center, radii, turn: by, power },
            round @ (Self::Limb { .. } | Self::Wheel { .. }) => round,
        }
    }

    /// The lump as a mirror in the plane x = 0 shows it.
    fn mirrored(self) -> Self {
        let flip = Vec3::new(-1.0, 1.0, 1.0);
        match self {
            Self::Egg { center, radii, turn, power } => {
                let turn = Quat::from_xyzw(turn.x, -turn.y, -turn.z, turn.w);
                Self::Egg { center: center * flip, radii, turn, power }
            }
            Self::Limb { from, to, start, end } => {
                Self::Limb { from: from * flip, to: to * flip, start, end }
            }
            Self::Wheel { center, radius, half_width, edge } => {
                Self::Wheel { center: center * flip, radius, half_width, edge }
            }
        }
    }

    fn distance(&self, p: Vec3) -> f32 {
        match *self {
            Self::Egg { center, radii, turn, power } => {
                let local = turn.inverse() * (p - center) / radii;
                if power == 2.0 {
                    // First order: value over gradient.
                    let (value, slope) = (local.length(), (local / radii).length());
                    return value * (value - 1.0) / slope.max(1e-9);
                }
                let norm = local.abs().powf(power).element_sum().powf(1.0 / power);
                (norm - 1.0) * radii.min_element()
            }
            Self::Limb { from, to, start, end } => {
                let (along, towards) = (to - from, p - from);
                let t = (towards.dot(along) / along.length_squared().max(1e-12)).clamp(0.0, 1.0);
                (towards - along * t).length() - (start + (end - start) * t)
            }
            Self::Wheel { center, radius, half_width, edge } => {
                let local = p - center;
                let beyond =
                    Vec2::new(local.yz().length() - radius, local.x.abs() - half_width) + Vec2::splat(edge);
                beyond.max_element().min(0.0) + beyond.max(Vec2::ZERO).length() - edge
            }
        }
    }

    /// The corners of a box around it.
    fn bounds(&self) -> (Vec3, Vec3) {
        match *self {
            // A turned one lies in the ball around it.
            Self::Egg { center, radii, turn, .. } => {
                let reach = if turn == Quat::IDENTITY { radii } else { Vec3::splat(radii.max_element()) };
                (center - reach, center + reach)
            }
            Self::Limb { from, to, start, end } => {
                (from.min(to) - start.max(end), from.max(to) + start.max(end))
            }
            Self::Wheel { center, radius, half_width, .. } => {
                let reach = Vec3::new(half_width, radius, radius);
                (center - reach, center + reach)
            }
        }
    }
}

/// A body of lumps.
struct Clay {
    /// Lumps, and how far each melts into those before it.
    lumps: Vec<(Lump, f32)>,
    /// What is cut out of all lumps, and how rounded the edge is.
    holes: Vec<(Lump, f32)>,
    /// What is put on after that.
    fittings: Vec<(Lump, f32)>,
    /// What is added to the distance: relief of the surface, small.
    relief: fn(Vec3) -> f32,
}

impl Clay {
    fn new() -> Self {
        Self { lumps: Vec::new(), holes: Vec::new(), fittings: Vec::new(), relief: |_| 0.0 }
    }

    fn add(&mut self, lump: Lump, softness: f32) {
        self.lumps.push((lump, softness));
    }

    fn add_both_sides(&mut self, lump: Lump, softness: f32) {
        self.add(lump, softness);
        self.add(lump.mirrored(), softness);
    }

    fn distance(&self, p: Vec3) -> f32 {
        let add = |whole: f32, (lump, softness): &(Lump, f32)| melt(whole, lump.distance(p), *softness);
        let cut = |whole: f32, (hole, softness): &(Lump, f32)| -melt(-whole, hole.distance(p), *softness);
        let cast = self.holes.iter().fold(self.lumps.iter().fold(1e9, add), cut);
        self.fittings.iter().fold(cast, add) + (self.relief)(p)
    }

    fn gradient(&self, p: Vec3, reach: f32) -> Vec3 {
        let along = |axis: Vec3| self.distance(p + axis * reach) - self.distance(p - axis * reach);
        Vec3::new(along(Vec3::X), along(Vec3::Y), along(Vec3::Z)) / (2.0 * reach)
    }

    /// The surface, with `detail` posts along its longest side, `height` tall and standing on y = 0.
    fn mesh(&self, detail: usize, height: f32) -> TriangleMesh {
        const BLOCK: usize = 8;
        let boxes = self.lumps.iter().chain(&self.fittings).map(|(lump, _)| lump.bounds());
        let (low, high) = boxes.fold((Vec3::MAX, Vec3::MIN), |a, b| (a.0.min(b.0), a.1.max(b.1)));
        let step = (high - low).max_element() / detail.max(8) as f32;
        let low = low - 4.0 * step;
        let posts = ((high + 4.0 * step - low) / step).ceil().to_array().map(|n| n as usize + 1);
        let lattice = Lattice { posts, low, step };
        let blocks = posts.map(|n| n.div_ceil(BLOCK));
        let place = |post: [usize; 3]| low + step * Vec3::from_array(post.map(|c| c as f32));
        let sign: Vec<Vec<f32>> = (0..blocks.iter().product())
            .into_par_iter()
            .map(|block: usize| {
                let first =
                    [block % blocks[0], block / blocks[0] % blocks[1], block / (blocks[0] * blocks[1])];
                let first = first.map(|c| c * BLOCK);
                let middle = self.distance(place(first) + 0.5 * (BLOCK - 1) as f32 * step);
                // Half of the diagonal is 0.87 sides; first-order distances may be off by half.
                if middle.abs() > 1.5 * 0.87 * BLOCK as f32 * step {
                    return vec![middle];
                }
                let post = |i: usize| {
                    let within = [i % BLOCK, i / BLOCK % BLOCK, i / (BLOCK * BLOCK)];
                    std::array::from_fn(|axis| first[axis] + within[axis])
                };
                (0..BLOCK.pow(3)).map(|i| self.distance(place(post(i)))).collect()
            })
            .collect();
        let mut mesh = lattice.surface_net(|post| {
            let [x, y, z] = [post % posts[0], post / posts[0] % posts[1], post / (posts[0] * posts[1])];
            let block = &sign[(z / BLOCK * blocks[1] + y / BLOCK) * blocks[0] + x / BLOCK];
            let within = (z % BLOCK * BLOCK + y % BLOCK) * BLOCK + x % BLOCK;
            if block.len() == 1 { block[0] } else { block[within] }
        });
        let reach = 0.25 * step;
        mesh.normals = mesh
            .positions
            .par_iter_mut()
            .map(|p| {
                for _ in 0..2 {
                    let gradient = self.gradient(*p, reach);
                    let onto = gradient * (self.distance(*p) / gradient.length_squared().max(0.01));
                    // Not across the cell: folds would cross there.
                    *p -= onto.clamp_length_max(0.5 * step);
                }
                self.gradient(*p, reach).normalize_or(Vec3::Y)
            })
            .collect();
        stand(&mut mesh, height);
        wrap(&mut mesh);
        mesh
    }
}

/// The quadratic smooth minimum.
fn melt(a: f32, b: f32, softness: f32) -> f32 {
    let near = (softness - (a - b).abs()).max(0.0);
    a.min(b) - near * near / (4.0 * softness.max(1e-9))
}

/// Scales a body to a height and sets it on y = 0.
fn stand(mesh: &mut TriangleMesh, height: f32) {
    let Some((low, high)) = mesh.bounds() else { return };
    let scale = height / (high.y - low.y).max(1e-9);
    mesh.positions.iter_mut().for_each(|p| *p = Vec3::new(p.x, p.y - low.y, p.z) * scale);
}

/// Texture coordinates around the y axis, u against the turn so that pictures are not mirrored; cut where they meet.
fn wrap(mesh: &mut TriangleMesh) {
    let height = mesh.bounds().map_or(1.0, |(_, high)| high.y.max(1e-9));
    let around = |p: &Vec3| Vec2::new(0.5 + p.x.atan2(p.z) / TAU, 1.0 - p.y / height);
    mesh.uvs = mesh.positions.iter().map(around).collect();
    let mut beyond = vec![u32::MAX; mesh.positions.len()];
    for t in 0..mesh.triangles.len() {
        let triangle = mesh.triangles[t];
        let most = triangle.iter().map(|&v| mesh.uvs[v as usize].x).fold(0.0, f32::max);
        for (corner, &v) in triangle.iter().enumerate() {
            let v = v as usize;
            if most - mesh.uvs[v].x <= 0.5 {
                continue;
            }
            if beyond[v] == u32::MAX {
                beyond[v] = mesh.positions.len() as u32;
                mesh.positions.push(mesh.positions[v]);
                mesh.normals.push(mesh.normals[v]);
                mesh.uvs.push(mesh.uvs[v] + Vec2::X);
            }
            mesh.triangles[t][corner] = beyond[v];
        }
    }
}
