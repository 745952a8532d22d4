//! What an object hides from its own surface, at points of the surface.
//!
//! Vertices carry vectors; a triangle whose edges are longer than the spacing carries a lattice of n(n + 3)/2 + 1 points
//! more finely, so that coarse meshes need no subdivision and hits keep their primitives. A vertex is shared by the
//! triangles whose normals are near its own (cosine above 0.7); at sharper edges each triangle has points of its own, a
//! hundredth of the way towards its middle, where they do not start in the neighbour's plane. Each sphere of a set has
//! the folded grid of its directions. Flat shapes and single spheres are convex: nothing is kept for them.

use std::collections::HashMap;

use glam::{Affine3A, Vec2, Vec3};
use halflight_sh::Sh;
use halflight_shape::TriangleMesh;
use halflight_trace::{Geometry, Hit, Sphere};
use rayon::prelude::*;

use super::cast::Caster;
use super::shells::{fold, unfold};

/// Points along an edge of a triangle at most.
const MAX_STEPS: usize = 32;
/// Cosine from which on a triangle takes part in a vertex.
const SMOOTH: f32 = 0.7;
/// Steps of the grid of a sphere.
const SPHERE_STEPS: usize = 6;
/// Rays for a point are this part of those for a point of a shell: the hemisphere is half of all directions.
const RAYS: usize = 2;

/// For a part of an entity, that is one geometry.
pub(super) enum Own<const ORDER: usize> {
    /// Nothing is hidden.
    Convex,
    Mesh(OwnMesh<ORDER>),
    Spheres(Vec<Sh<ORDER>>),
}

pub(super) struct OwnMesh<const ORDER: usize> {
    /// What is hidden at the points: on their front, then on their back if the mesh is open.
    hidden: Vec<Sh<ORDER>>,
    /// Where the backs begin; 0 if there are none.
    backs: usize,
    /// Points of the lattice of each triangle.
    points: Vec<u32>,
    /// For each triangle the first of its points and the steps along its edges.
    lattices: Vec<(u32, u32)>,
}

impl<const ORDER: usize> Own<ORDER> {
    /// For the geometry of a part that stands at `place`.
    pub(super) fn new(caster: &Caster, geometry: &Geometry, place: &Affine3A, spacing: f32) -> Self {
        let rays = (caster.rays / RAYS).max(1);
        match geometry {
            Geometry::Mesh(tracer) => {
                let mesh = tracer.mesh();
                let moved = mesh.positions.iter().map(|p| place.transform_point3(*p)).collect();
                let front = if place.matrix3.determinant() < 0.0 { -1.0 } else { 1.0 };
                Self::Mesh(OwnMesh::new(caster, mesh, moved, front, spacing, rays))
            }
            Geometry::Spheres(tracer) if tracer.spheres().len() > 1 => {
                let side = SPHERE_STEPS + 1;
                let at = |sphere: &Sphere, i: usize| {
                    let knot = Vec2::new((i % side) as f32, (i / side) as f32) / SPHERE_STEPS as f32;
                    // Of an ellipsoid the normal is not the way outwards, but near.
                    let point = place.transform_point3(sphere.center + sphere.radius * unfold(knot));
                    let normal = place.transform_vector3(unfold(knot)).normalize_or(Vec3::Y);
                    caster.hidden_above(point, normal, rays)
                };
                let of_one = |sphere: &Sphere| (0..side * side).map(|i| at(sphere, i)).collect::<Vec<_>>();
                Self::Spheres(tracer.spheres().par_iter().flat_map_iter(of_one).collect())
            }
            _ => Self::Convex,
        }
    }

    /// What is hidden at a hit, on its front or back; `outwards` is the unit normal, both in the axes of the entity.
    pub(super) fn at(&self, hit: &Hit, outwards: Vec3, front: bool) -> Option<Sh<ORDER>> {
        match self {
            Self::Convex => None,
            Self::Mesh(mesh) => Some(mesh.at(hit, front)),
            Self::Spheres(hidden) => {
                let side = SPHERE_STEPS + 1;
                let knot = fold(outwards) * SPHERE_STEPS as f32;
                let (column, row) =
                    ((knot.x as usize).min(SPHERE_STEPS - 1), (knot.y as usize).min(SPHERE_STEPS - 1));
                let (s, t) = (knot.x - column as f32, knot.y - row as f32);
                let first = hit.primitive as usize * side * side + row * side + column;
                Some(
                    (hidden[first] * (1.0 - s) + hidden[first + 1] * s) * (1.0 - t)
                        + (hidden[first + side] * (1.0 - s) + hidden[first + side + 1] * s) * t,
                )
            }
        }
    }

    pub(super) fn memory_bytes(&self) -> usize {
        match self {
            Self::Convex => 0,
            Self::Mesh(mesh) => {
                size_of_val(mesh.hidden.as_slice())
                    + size_of_val(mesh.points.as_slice())
                    + size_of_val(mesh.lattices.as_slice())
            }
            Self::Spheres(hidden) => size_of_val(hidden.as_slice()),
        }
    }
}

/// Place of the point with i steps towards the second vertex and j towards the third.
fn index(steps: usize, i: usize, j: usize) -> usize {
    j * (steps + 1) - j * j.saturating_sub(1) / 2 + i
}

impl<const ORDER: usize> OwnMesh<ORDER> {
    /// `front` is −1 where the place mirrors the mesh, whose fronts stay fronts.
    fn new(
        caster: &Caster,
        mesh: &TriangleMesh,
        positions: Vec<Vec3>,
        front: f32,
        spacing: f32,
        rays: usize,
    ) -> Self {
        let corners = |t: &[u32; 3]| t.map(|v| positions.get(v as usize).copied().unwrap_or_default());
        let cross = |[a, b, c]: [Vec3; 3]| front * (b - a).cross(c - a);
        let mut normals = vec![Vec3::ZERO; positions.len()];
        for triangle in &mesh.triangles {
            let area = cross(corners(triangle));
            for &v in triangle {
                if let Some(normal) = normals.get_mut(v as usize) {
                    *normal += area;
                }
            }
        }
        let mut places: Vec<(Vec3, Vec3)> = Vec::new();
        let (mut points, mut lattices) = (Vec::new(), Vec::with_capacity(mesh.triangles.len()));
        let mut shared: HashMap<u32, u32> = HashMap::new();
        for triangle in &mesh.triangles {
            let [a, b, c] = corners(triangle);
            let normal = cross([a, b, c]).normalize_or_zero();
            let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
            let steps = (longest / (spacing * caster.radius)).ceil().clamp(1.0, MAX_STEPS as f32) as usize;
            lattices.push((points.len() as u32, steps as u32));
            let middle = (a + b + c) / 3.0;
            for j in 0..=steps {
                for i in 0..=steps - j {
                    let vertex = match (i, j) {
                        (0, 0) => Some(triangle[0]),
                        (i, 0) if i == steps => Some(triangle[1]),
                        (0, j) if j == steps => Some(triangle[2]),
                        _ => None,
                    };
                    let smooth = vertex.and_then(|v| {
                        let mean = normals.get(v as usize)?.normalize_or_zero();
                        (mean.dot(normal) > SMOOTH).then_some((v, mean))
                    });
                    points.push(match smooth {
                        Some((v, mean)) => *shared.entry(v).or_insert_with(|| {
                            places.push((positions[v as usize], mean));
                            places.len() as u32 - 1
                        }),
                        None => {
                            let point =
                                a + (b - a) * (i as f32 / steps as f32) + (c - a) * (j as f32 / steps as f32);
                            places.push((point.lerp(middle, 0.01 / steps as f32), normal));
                            places.len() as u32 - 1
                        }
                    });
                }
            }
        }
        let side = |sign: f32| {
            places.par_iter().map(move |(p, n)| caster.hidden_above::<ORDER>(*p, sign * *n, rays))
        };
        let mut hidden: Vec<Sh<ORDER>> = side(1.0).collect();
        let mut backs = 0;
        if is_open(&mesh.triangles, &positions) {
            backs = hidden.len();
            hidden.par_extend(side(-1.0));
        }
        Self { hidden, backs, points, lattices }
    }

    fn at(&self, hit: &Hit, front: bool) -> Sh<ORDER> {
        let (first, steps) = self.lattices[hit.primitive as usize];
        let steps = steps as usize;
        let (a, b) = (hit.u * steps as f32, hit.v * steps as f32);
        let i = (a as usize).min(steps - 1);
        let j = (b as usize).min(steps - 1 - i);
        let (s, t) = ((a - i as f32).clamp(0.0, 1.0), (b - j as f32).clamp(0.0, 1.0));
        let upper = s + t > 1.0 && i + j + 2 <= steps;
        let corners = if upper {
            [((i + 1, j + 1), s + t - 1.0), ((i, j + 1), 1.0 - s), ((i + 1, j), 1.0 - t)]
        } else {
            [((i, j), (1.0 - s - t).max(0.0)), ((i + 1, j), s), ((i, j + 1), t)]
        };
        let offset = if front { 0 } else { self.backs };
        let mut sum = Sh::zero();
        for ((i, j), weight) in corners {
            let point = self.points[first as usize + index(steps, i, j)] as usize;
            sum += self.hidden[offset + point] * weight;
        }
        sum
    }
}

/// Whether some edge of a mesh has no partner that runs the other way, so that its backs can be seen.
fn is_open(triangles: &[[u32; 3]], positions: &[Vec3]) -> bool {
    let place = |v: u32| positions.get(v as usize).copied().unwrap_or_default().to_array().map(f32::to_bits);
    let mut edges: HashMap<([u32; 3], [u32; 3]), i32> = HashMap::new();
    for t in triangles {
        for k in 0..3 {
            let (a, b) = (place(t[k]), place(t[(k + 1) % 3]));
            let (key, turn) = if a < b { ((a, b), 1) } else { ((b, a), -1) };
            if a != b {
                *edges.entry(key).or_insert(0) += turn;
            }
        }
    }
    edges.values().any(|sum| *sum != 0)
}
