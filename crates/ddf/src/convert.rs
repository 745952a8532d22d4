//! Fields as other forms: distances on a grid, a mesh, visibility in spherical harmonics.

use std::f32::consts::{PI, TAU};

use glam::{UVec3, Vec3};
use halflight_sh::Sh;
use halflight_shape::{Lattice, TriangleMesh};
use rayon::prelude::*;

use crate::field::{DirectedField, FieldHit};
use crate::measure::{Cloud, field_points_while};

/// Directions spread evenly over the sphere (Fibonacci's spiral).
#[must_use]
pub fn even_directions(count: usize) -> Vec<Vec3> {
    let golden = PI * (3.0 - 5f32.sqrt());
    (0..count)
        .map(|i| {
            let z = 1.0 - (2 * i + 1) as f32 / count as f32;
            let radius = (1.0 - z * z).max(0.0).sqrt();
            let (sin, cos) = (golden * i as f32 % TAU).sin_cos();
            Vec3::new(radius * cos, radius * sin, z)
        })
        .collect()
}

/// Unsigned distances at the posts of a grid.
#[derive(Clone, Debug)]
pub struct DistanceGrid {
    /// Posts along each side.
    pub posts: u32,
    /// The first post, in the field's own space.
    pub low: Vec3,
    /// From post to post.
    pub step: f32,
    /// Distances in the field's own space, x fastest.
    pub values: Vec<f32>,
}

impl DirectedField {
    /// The unsigned distance: the least φ over directions [002 eq. 5], at posts of a cube around the field.
    ///
    /// Even directions find the nearest surface up to their spacing; the best one is then turned towards the normal at
    /// its hit, twice.
    #[must_use]
    pub fn distance_grid(&self, posts: u32, directions: usize) -> DistanceGrid {
        let posts = posts.max(2);
        let (low, high) = self.bounds();
        let size = (high - low).max_element() * 1.1;
        let (low, step) = (0.5 * (low + high) - 0.5 * size, size / (posts - 1) as f32);
        let around = even_directions(directions.max(1));
        let count = (posts as usize).pow(3);
        let place = |index: usize| {
            let index = index as u32;
            low + UVec3::new(index % posts, index / posts % posts, index / (posts * posts)).as_vec3() * step
        };
        let values = if self.prefers_many() {
            let mut values = Vec::with_capacity(count);
            for plane in (0..count).step_by((posts * posts) as usize) {
                let places = plane..plane + (posts * posts) as usize;
                let rays: Vec<(Vec3, Vec3)> =
                    places.flat_map(|index| around.iter().map(move |&omega| (place(index), omega))).collect();
                let said = self.query_many(&rays);
                let least = |hits: &[(Option<FieldHit>, f32)]| {
                    hits.iter()
                        .filter_map(|(hit, _)| Some(hit.as_ref()?.distance))
                        .fold(f32::INFINITY, f32::min)
                };
                values.extend(said.chunks(around.len()).map(least));
            }
            values
        } else {
            let one = |index| self.unsigned_distance(place(index), &around);
            (0..count).into_par_iter().with_min_len(64).map(one).collect()
        };
        DistanceGrid { posts, low, step, values }
    }

    /// Unsigned distances at posts of the same cube, to points of the surface that the field's own rays meet: one for each
    /// quarter of a step and more, so that shells of a step are smooth to a few hundredths of it.
    ///
    /// [`DirectedField::distance_grid`] has a pit wherever the one direction that points at the surface is answered
    /// wrongly, and a bump wherever any is; here a surface is met from all sides, and a wrong hit stands alone: points
    /// with much fewer others about them than is usual do not count. `go_on` is told how much is done, 0 to 1; `None` if it
    /// says no.
    pub fn surface_grid(&self, posts: u32, go_on: &(dyn Fn(f32) -> bool + Sync)) -> Option<DistanceGrid> {
        let posts = posts.max(2);
        let (low, high) = self.bounds();
        let size = (high - low).max_element() * 1.1;
        let (low, step) = (0.5 * (low + high) - 0.5 * size, size / (posts - 1) as f32);
        let unit = self.unit();
        let unit_step = step * unit.scale;
        let spacing = 0.25 * unit_step;
        let most = if self.prefers_many() { MOST_POINTS / 8 } else { MOST_POINTS };
        let count = ((POINTS_FOR_EACH_SPACING * AREA / (spacing * spacing)) as usize).clamp(10_000, most);
        let cloud = Cloud::new(field_points_while(self, count, 5, &|part| go_on(0.8 * part))?);
        // The radius within which as many are looked for, of an area of so many points.
        let radius = (COMPANY * AREA / count as f32).sqrt();
        let cloud = cloud.without_loners(radius);
        let place = |index: usize| {
            let index = index as u32;
            low + UVec3::new(index % posts, index / posts % posts, index / (posts * posts)).as_vec3() * step
        };
        let mut values = Vec::with_capacity((posts as usize).pow(3));
        let plane = (posts * posts) as usize;
        for z in 0..posts as usize {
            if !go_on(0.8 + 0.2 * z as f32 / posts as f32) {
                return None;
            }
            let one = |index| cloud.squared_distance(unit.to_unit(place(index))).sqrt() / unit.scale;
            values.par_extend((z * plane..(z + 1) * plane).into_par_iter().with_min_len(64).map(one));
        }
        Some(DistanceGrid { posts, low, step, values })
    }

    /// The field as a solid: the surface that is seen from far away, hollows within closed, as a mesh.
    ///
    /// The shell around the surface at a distance d of the [`DirectedField::surface_grid`], its outer side alone, moved in
    /// by d along its normals. What is thinner than a step of the grid comes out about as thick.
    #[must_use]
    pub fn solid(&self, posts: u32) -> TriangleMesh {
        self.surface_grid(posts, &|_| true).map_or_else(TriangleMesh::default, |grid| grid.solid())
    }

    /// The least φ over some directions, refined; infinite where none sees anything.
    #[must_use]
    pub fn unsigned_distance(&self, x: Vec3, directions: &[Vec3]) -> f32 {
        let mut best = (f32::INFINITY, None);
        for &omega in directions {
            if let Some(hit) = self.query(x, omega, best.0) {
                best = (hit.distance, Some((omega, hit)));
            }
        }
        for _ in 0..2 {
            let Some((omega, hit)) = best.1 else { break };
            let towards = -self.normal(x, omega, &hit);
            match self.query(x, towards, best.0) {
                Some(nearer) if nearer.distance < best.0 => best = (nearer.distance, Some((towards, nearer))),
                _ => break,
            }
        }
        best.0
    }

    /// Visibility of points in spherical harmonics: the projection of 1 − ξ(x, ω), the part of the sphere that is free,
    /// by `directions` even directions, all points asked together.
    #[must_use]
    pub fn free_sky<const ORDER: usize>(&self, points: &[Vec3], directions: usize) -> Vec<Sh<ORDER>> {
        let around = even_directions(directions.max(1));
        let basis: Vec<Sh<ORDER>> = around.iter().map(|omega| Sh::basis(omega.to_array())).collect();
        let weight = 4.0 * PI / around.len() as f32;
        points
            .par_iter()
            .map(|&x| {
                let mut sum = [0.0f64; 64];
                for (omega, basis) in around.iter().zip(&basis) {
                    if !self.is_visible(x, *omega) {
                        sum.iter_mut().zip(basis.coefficients()).for_each(|(to, y)| *to += f64::from(*y));
                    }
                }
                Sh::from_fn(|i| sum.get(i).map_or(0.0, |v| (v * f64::from(weight)) as f32))
            })
            .collect()
    }
}

/// Points for each square of a quarter of a step: so many that few such squares stay empty.
const POINTS_FOR_EACH_SPACING: f32 = 3.0;
/// The area of a surface in the unit sphere, about: that of the sphere is 12.6, but there are hidden parts.
const AREA: f32 = 12.0;
/// Most points that are kept: 12 bytes each, and a microsecond or two to find.
const MOST_POINTS: usize = 3_000_000;
/// A point of the surface has about so many others around it, among which a wrong one shows.
const COMPANY: f32 = 12.0;

impl DistanceGrid {
    /// The outer side of a shell of these distances, moved in to the surface, see [`DirectedField::solid`].
    #[must_use]
    pub fn solid(self) -> TriangleMesh {
        // Less than a step would leave holes between posts.
        let shell = 0.8 * self.step;
        let mut mesh = self.filled(shell).surface(shell);
        let mut normals = vec![Vec3::ZERO; mesh.positions.len()];
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize]);
            let normal = (b - a).cross(c - a);
            triangle.iter().for_each(|&vertex| normals[vertex as usize] += normal);
        }
        for (position, normal) in mesh.positions.iter_mut().zip(normals) {
            *position -= shell * normal.normalize_or_zero();
        }
        mesh
    }

    /// The same grid with 0 wherever no way of posts farther from the surface than `distance` leads to the border.
    #[must_use]
    pub fn filled(mut self, distance: f32) -> DistanceGrid {
        let n = self.posts as usize;
        let mut open = vec![false; self.values.len()];
        let on_border = |i: usize| [i % n, i / n % n, i / (n * n)].iter().any(|&c| c == 0 || c == n - 1);
        let mut going: Vec<usize> = (0..open.len()).filter(|&i| on_border(i)).collect();
        going.iter().for_each(|&i| open[i] = true);
        while let Some(i) = going.pop() {
            for (axis, step) in [1, n, n * n].into_iter().enumerate() {
                let along = [i % n, i / n % n, i / (n * n)][axis];
                let next = [(along > 0).then(|| i - step), (along + 1 < n).then(|| i + step)];
                for j in next.into_iter().flatten() {
                    if !open[j] && self.values[j] > distance {
                        open[j] = true;
                        going.push(j);
                    }
                }
            }
        }
        self.values.iter_mut().zip(open).for_each(|(value, open)| *value = if open { *value } else { 0.0 });
        self
    }

    /// The surface at a distance, as a mesh. Around an unsigned distance it is a shell on both sides of the surface.
    #[must_use]
    pub fn surface(&self, distance: f32) -> TriangleMesh {
        let lattice = Lattice { posts: [self.posts as usize; 3], low: self.low, step: self.step };
        // Where nothing was seen the field counts as far.
        lattice.surface_net(|post| self.values[post].min(1e6 * self.step) - distance)
    }
}
