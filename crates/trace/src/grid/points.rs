//! Where the rays of a grid met surfaces, and how these lie there: the part of a [`Surface`](crate::Surface) that
//! surfaces without textures are shaded by, side by side.
//!
//! Height fields, of which neighbours show neighbouring cells, are done sixteen at a time, spheres row by row; all else as
//! [`World::surface`](crate::World::surface) does.

use glam::{Affine3A, Vec3};

use super::GridTracer;
use super::balls::OnBalls;
use crate::height_field::HeightFieldTracer;
use crate::{Geometry, Hit, Kernel};

/// Points that are done at once.
const LANES: usize = 16;
/// Slopes beyond this are as good as vertical.
const STEEP: f32 = 1e15;

/// What rays found, `[axis][ray]`; of rays that met nothing it holds anything.
#[derive(Clone, Debug, Default)]
pub struct GridPoints {
    /// The point of the surface.
    pub position: [Vec<f32>; 3],
    /// Unit normal of the geometry, on the side that its winding calls front.
    pub geometric_normal: [Vec<f32>; 3],
    /// Unit interpolated normal, in the hemisphere of the other.
    pub shading_normal: [Vec<f32>; 3],
    /// The material slot of the geometry.
    pub material_slot: Vec<u32>,
}

/// A vector that is kept as columns.
#[inline(always)]
fn vector(columns: &[Vec<f32>; 3], i: usize) -> Vec3 {
    Vec3::new(columns[0][i], columns[1][i], columns[2][i])
}

#[inline(always)]
fn set(columns: &mut [Vec<f32>; 3], i: usize, value: Vec3) {
    columns[0][i] = value.x;
    columns[1][i] = value.y;
    columns[2][i] = value.z;
}

impl GridPoints {
    /// The point of ray `i`.
    #[inline(always)]
    #[must_use]
    pub fn position(&self, i: usize) -> Vec3 {
        vector(&self.position, i)
    }

    /// The normal of the geometry at ray `i`.
    #[inline(always)]
    #[must_use]
    pub fn geometric_normal(&self, i: usize) -> Vec3 {
        vector(&self.geometric_normal, i)
    }

    /// The interpolated normal at ray `i`.
    #[inline(always)]
    #[must_use]
    pub fn shading_normal(&self, i: usize) -> Vec3 {
        vector(&self.shading_normal, i)
    }

    fn resize(&mut self, count: usize) {
        for columns in [&mut self.position, &mut self.geometric_normal, &mut self.shading_normal] {
            columns.iter_mut().for_each(|column| column.resize(count, 0.0));
        }
        self.material_slot.resize(count, 0);
    }
}

impl GridTracer<'_> {
    /// What the rays of rows from `top` on found, given the hits of [`GridTracer::rows`].
    pub fn points(&self, top: usize, hits: &[Option<Hit>], points: &mut GridPoints) {
        points.resize(hits.len());
        let mut i = 0;
        while i < hits.len() {
            let Some(hit) = hits[i] else {
                i += 1;
                continue;
            };
            let instance = &self.world.instances()[hit.instance as usize];
            if let Geometry::HeightField(tracer) = instance.geometry.as_ref() {
                let mut run = [hit; LANES];
                let mut count = 1;
                while count < LANES {
                    match hits.get(i + count) {
                        Some(Some(next)) if next.instance == hit.instance => run[count] = *next,
                        _ => break,
                    }
                    count += 1;
                }
                let transform = &instance.transform.open;
                self.world.simd().run(OfField { tracer, transform, hits: &run, first: i, count, points });
                i += count;
            } else if let (Geometry::Spheres(tracer), true) =
                (instance.geometry.as_ref(), self.are_balls[hit.instance as usize])
            {
                let place = [i % self.grid.columns, top + i / self.grid.columns];
                let row = &hits[i..hits.len().min(i + self.grid.columns - place[0])];
                let others = |next: &Option<Hit>| next.is_none_or(|next| next.instance != hit.instance);
                let hits = &row[..row.iter().position(others).unwrap_or(row.len())];
                let (spheres, transform) = (tracer.spheres(), &instance.transform.open);
                let count = hits.len();
                let on = OnBalls { grid: &self.grid, spheres, transform, hits, place, first: i, points };
                self.world.simd().run(on);
                i += count;
            } else {
                let (x, y) = (i % self.grid.columns, top + i / self.grid.columns);
                let surface = self.world.surface(&self.grid.ray(x, y), &hit);
                set(&mut points.position, i, surface.position);
                set(&mut points.geometric_normal, i, surface.geometric_normal);
                set(&mut points.shading_normal, i, surface.shading_normal);
                points.material_slot[i] = surface.material_slot;
                i += 1;
            }
        }
    }
}

/// Points on one height field.
struct OfField<'a> {
    tracer: &'a HeightFieldTracer,
    transform: &'a Affine3A,
    hits: &'a [Hit; LANES],
    first: usize,
    count: usize,
    points: &'a mut GridPoints,
}

impl Kernel for OfField<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self { tracer, transform, hits, first, count, points } = self;
        let field = &**tracer.field();
        let (cells_x, per_metre) = (field.columns - 1, tracer.per_metre());
        let zero = [0.0; LANES];
        let (mut u, mut v, mut h00, mut rise_x, mut rise_z) = (zero, zero, zero, zero, zero);
        let (mut low, mut step) = ([zero; 2], [zero; 2]);
        // Of the posts (0, 0), (1, 1) and the one between: slopes along x and z, and their weights.
        let (mut slopes, mut weights) = ([[zero; 2]; 3], [zero; 3]);
        for lane in 0..LANES {
            let hit = &hits[lane];
            let cell = hit.primitive as usize / 2;
            let (i, j) = (cell % cells_x, cell / cells_x);
            let lower = hit.primitive & 1 == 0;
            let (a, b) = (field.post(i, j), field.post(i + 1, j + 1));
            let middle = if lower { [i + 1, j] } else { [i, j + 1] };
            let between = field.heights[middle[1] * field.columns + middle[0]];
            (u[lane], v[lane], h00[lane]) = (hit.u, hit.v, a.y);
            (rise_x[lane], rise_z[lane]) =
                if lower { (between - a.y, b.y - between) } else { (b.y - between, between - a.y) };
            (low[0][lane], low[1][lane]) = (a.x, a.z);
            (step[0][lane], step[1][lane]) = (b.x - a.x, b.z - a.z);
            (weights[0][lane], weights[1][lane], weights[2][lane]) =
                if lower { (1.0 - hit.u, hit.v, hit.u - hit.v) } else { (1.0 - hit.v, hit.u, hit.v - hit.u) };
            if field.smooth {
                let corners = [[i, j], [i + 1, j + 1], middle];
                for k in 0..3 {
                    let [along_x, along_z] = slopes_at(field, per_metre, corners[k]);
                    (slopes[k][0][lane], slopes[k][1][lane]) = (along_x, along_z);
                }
            }
        }
        let (mut flat, mut shading, mut at) = ([zero; 3], [zero; 3], [zero; 3]);
        let inverse = transform.matrix3.inverse();
        let (m, moved) = (transform.matrix3, transform.translation);
        for lane in 0..LANES {
            let position = Vec3::new(
                low[0][lane] + u[lane] * step[0][lane],
                h00[lane] + u[lane] * rise_x[lane] + v[lane] * rise_z[lane],
                low[1][lane] + v[lane] * step[1][lane],
            );
            let normal = up_from(rise_x[lane] * per_metre[0][0], rise_z[lane] * per_metre[1][0]);
            let mut sum = normal;
            if field.smooth {
                sum = up_from(slopes[0][0][lane], slopes[0][1][lane]) * weights[0][lane]
                    + up_from(slopes[1][0][lane], slopes[1][1][lane]) * weights[1][lane]
                    + up_from(slopes[2][0][lane], slopes[2][1][lane]) * weights[2][lane];
            }
            // Both point up, but a steep triangle's normal may still be beyond a right angle from its posts'.
            let smooth = if sum.dot(normal) > 0.0 { sum } else { normal };
            let flat_there = through(&inverse, normal);
            let smooth_there = through(&inverse, smooth);
            let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis];
            for axis in 0..3 {
                flat[axis][lane] = flat_there[axis];
                shading[axis][lane] = smooth_there[axis];
                at[axis][lane] =
                    x[axis] * position.x + y[axis] * position.y + (z[axis] * position.z + moved[axis]);
            }
        }
        for axis in 0..3 {
            points.position[axis][first..first + count].copy_from_slice(&at[axis][..count]);
            points.geometric_normal[axis][first..first + count].copy_from_slice(&flat[axis][..count]);
            points.shading_normal[axis][first..first + count].copy_from_slice(&shading[axis][..count]);
        }
        points.material_slot[first..first + count].fill(0);
    }
}

/// Metres of height a metre, along x and z, from the neighbours of a post.
#[inline(always)]
fn slopes_at(
    field: &halflight_shape::HeightField,
    per_metre: &[[f32; 2]; 2],
    [i, j]: [usize; 2],
) -> [f32; 2] {
    let (left, right) = (i.saturating_sub(1), (i + 1).min(field.columns - 1));
    let (far, near) = (j.saturating_sub(1), (j + 1).min(field.rows - 1));
    let row = &field.heights[j * field.columns..][..field.columns];
    let across = row[right] - row[left];
    let along = field.heights[near * field.columns + i] - field.heights[far * field.columns + i];
    [across * per_metre[0][right - left - 1], along * per_metre[1][near - far - 1]]
}

/// The unit normal of a plane that rises by so much per metre.
#[inline(always)]
fn up_from(along_x: f32, along_z: f32) -> Vec3 {
    let (x, z) = (along_x.clamp(-STEEP, STEEP), along_z.clamp(-STEEP, STEEP));
    let scale = 1.0 / (x * x + z * z + 1.0).sqrt();
    Vec3::new(-x * scale, scale, -z * scale)
}

/// The unit normal M⁻ᵀ n, given M⁻¹.
#[inline(always)]
fn through(inverse: &glam::Mat3A, normal: Vec3) -> Vec3 {
    let (x, y, z) = (inverse.x_axis, inverse.y_axis, inverse.z_axis);
    let turned = Vec3::new(
        x.x * normal.x + x.y * normal.y + x.z * normal.z,
        y.x * normal.x + y.y * normal.y + y.z * normal.z,
        z.x * normal.x + z.y * normal.y + z.z * normal.z,
    );
    let squared = turned.x * turned.x + turned.y * turned.y + turned.z * turned.z;
    turned * (1.0 / squared.sqrt())
}
