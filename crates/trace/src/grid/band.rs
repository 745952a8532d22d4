//! A few rows of a grid: rasterised, then turned into hits.

use super::balls::{self, Ball};
use super::fill::{Batch, NOTHING, Rows};
use super::project::Projection;
use super::{GridTracer, LEAVES, Piece};
use glam::Vec3;
use halflight_shape::HeightField;

use crate::height_field::{BLOCK_CELLS, HeightFieldTracer};
use crate::mesh::MeshTracer;
use crate::{Geometry, Hit, Kernel, Ray};

/// Columns and rows of the blocks of rays that are traced together.
const TOGETHER: usize = 8;
/// Neighbours of eight that show something where a ray passed between triangles.
const SURROUNDED: usize = 5;

/// Room to work in, kept from call to call.
#[derive(Debug, Default)]
pub struct GridRows {
    rows: Rows,
}

impl GridRows {
    pub(super) fn run(&mut self, tracer: &GridTracer<'_>, top: usize, hits: &mut [Option<Hit>]) {
        let columns = tracer.grid.columns;
        self.rows.clear(columns, top, hits.len() / columns);
        tracer.world.simd().run(Band { tracer, rows: &mut self.rows, hits });
        tracer.trace_instances(top, hits);
        if self.rows.any_apart {
            tracer.close_holes(top, hits);
        }
    }
}

struct Band<'a> {
    tracer: &'a GridTracer<'a>,
    rows: &'a mut Rows,
    hits: &'a mut [Option<Hit>],
}

impl Kernel for Band<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Band { tracer, rows, hits } = self;
        for piece in &tracer.pieces {
            if piece.extent.meets_rows(rows.top, rows.count) {
                let projection = &tracer.projections[piece.instance as usize];
                match tracer.world.instances()[piece.instance as usize].geometry.as_ref() {
                    Geometry::Mesh(mesh) => leaves(rows, mesh, projection, piece),
                    Geometry::HeightField(field) => block(rows, field, projection, piece),
                    Geometry::Spheres(spheres) => {
                        let transform = &tracer.world.instances()[piece.instance as usize].transform.open;
                        let sphere = &spheres.spheres()[piece.first as usize];
                        let ball = Ball::new(sphere, transform, tracer.grid.origin);
                        balls::fill(rows, &tracer.grid, &ball, &piece.extent, piece.instance, piece.first);
                    }
                    _ => {}
                }
            }
        }
        for (y, (nearest, hits)) in
            rows.nearest.chunks(rows.columns).zip(hits.chunks_mut(rows.columns)).enumerate()
        {
            for (x, (nearest, hit)) in nearest.iter().zip(hits).enumerate() {
                let length = tracer.grid.point(x, rows.top + y).length();
                let mut found = Hit { t: length / nearest.t, ..*nearest };
                *hit = None;
                if nearest.instance != NOTHING {
                    if tracer.is_field[nearest.instance as usize] {
                        found = in_cell(&found);
                    }
                    *hit = Some(found);
                }
            }
        }
    }
}

/// From weights of the second and third corner of a height field's triangle, in the order of
/// [`HeightFieldTracer::corners`], to the place in its cell.
#[inline(always)]
fn in_cell(hit: &Hit) -> Hit {
    let both = (hit.u + hit.v).min(1.0);
    if hit.primitive & 1 == 0 { Hit { u: both, v: hit.u, ..*hit } } else { Hit { u: hit.v, v: both, ..*hit } }
}

/// The triangles of a piece of a mesh's tree.
#[inline(always)]
fn leaves(rows: &mut Rows, mesh: &MeshTracer, projection: &Projection, piece: &Piece) {
    let first = piece.first as usize;
    let all = mesh.blocks();
    for leaf in &all[first..(first + LEAVES).min(all.len())] {
        let none = [[0.0; 8]; 3];
        let mut batch = Batch { x: none, y: none, nearness: none };
        for (corner, [x, y, z]) in leaf.corners.iter().enumerate() {
            for lane in 0..8 {
                let [over_x, over_y, t] = projection.of(x[lane], y[lane], z[lane]);
                let nearness = 1.0 / t;
                batch.nearness[corner][lane] = nearness;
                batch.x[corner][lane] = over_x * nearness;
                batch.y[corner][lane] = over_y * nearness;
            }
        }
        let mut apart = rows.fill(&batch, 8, piece.instance, &leaf.triangles);
        while apart != 0 {
            let lane = apart.trailing_zeros() as usize;
            apart &= apart - 1;
            let corner = |k: usize| {
                let [x, y, z] = &leaf.corners[k];
                projection.exactly(Vec3::new(x[lane], y[lane], z[lane]))
            };
            let corners = [corner(0), corner(1), corner(2)];
            rows.across_the_eye(corners, piece.instance, leaf.triangles[lane]);
        }
    }
}

/// Places for a row of a block's posts, a whole number of vectors.
const POSTS: usize = 2 * BLOCK_CELLS;

/// A row of posts as the grid sees them.
struct Posts {
    x: [f32; POSTS],
    y: [f32; POSTS],
    nearness: [f32; POSTS],
}

/// The triangles of a block of a height field's cells.
#[inline(always)]
fn block(rows: &mut Rows, tracer: &HeightFieldTracer, projection: &Projection, piece: &Piece) {
    let field = tracer.field();
    let ([left, far], [across, along]) = tracer.block_cells(piece.first as usize);
    let mut xs = [0.0; POSTS];
    for (i, x) in xs[..=across].iter_mut().enumerate() {
        *x = field.post(left + i, far).x;
    }
    let mut here = Posts::of(field, projection, &xs, [left, far], across);
    for row in far..far + along {
        let next = Posts::of(field, projection, &xs, [left, row + 1], across);
        let first = 2 * (row * (field.columns - 1) + left) as u32;
        for w in 0..2 {
            let batch = batch(&here, &next, w);
            let mut primitives = [0; BLOCK_CELLS];
            for (i, primitive) in primitives.iter_mut().enumerate() {
                *primitive = first + 2 * i as u32 + w;
            }
            let mut apart = rows.fill(&batch, across, piece.instance, &primitives);
            while apart != 0 {
                let primitive = primitives[apart.trailing_zeros() as usize];
                apart &= apart - 1;
                let [a, b, c] = tracer.corners(primitive, 0.0);
                let corners = [projection.exactly(a.0), projection.exactly(b.0), projection.exactly(c.0)];
                rows.across_the_eye(corners, piece.instance, primitive);
            }
        }
        here = next;
    }
}

impl Posts {
    /// `across` + 1 posts from (left, row) on.
    #[inline(always)]
    fn of(
        field: &HeightField,
        projection: &Projection,
        xs: &[f32; POSTS],
        [left, row]: [usize; 2],
        across: usize,
    ) -> Self {
        let z = field.post(left, row).z;
        let none = [0.0; POSTS];
        let mut posts = Posts { x: none, y: none, nearness: none };
        let mut heights = none;
        heights[..=across].copy_from_slice(&field.heights[row * field.columns + left..][..=across]);
        for i in 0..POSTS {
            let [over_x, over_y, t] = projection.of(xs[i], heights[i], z);
            let nearness = 1.0 / t;
            posts.nearness[i] = nearness;
            posts.x[i] = over_x * nearness;
            posts.y[i] = over_y * nearness;
        }
        posts
    }
}

/// Triangles w of the cells between two rows of posts, with the corners of [`HeightFieldTracer::corners`].
#[inline(always)]
fn batch(here: &Posts, next: &Posts, w: u32) -> Batch<BLOCK_CELLS> {
    let none = [[0.0; BLOCK_CELLS]; 3];
    let mut batch = Batch { x: none, y: none, nearness: none };
    if w == 0 {
        batch.set::<0>(0, here);
        batch.set::<1>(1, next);
        batch.set::<1>(2, here);
    } else {
        batch.set::<0>(0, here);
        batch.set::<0>(1, next);
        batch.set::<1>(2, next);
    }
    batch
}

impl Batch<BLOCK_CELLS> {
    /// Sets a corner of all triangles to the posts that are `FROM` places farther.
    #[inline(always)]
    fn set<const FROM: usize>(&mut self, corner: usize, posts: &Posts) {
        self.x[corner].copy_from_slice(&posts.x[FROM..FROM + BLOCK_CELLS]);
        self.y[corner].copy_from_slice(&posts.y[FROM..FROM + BLOCK_CELLS]);
        self.nearness[corner].copy_from_slice(&posts.nearness[FROM..FROM + BLOCK_CELLS]);
    }
}

impl GridTracer<'_> {
    /// Asks the instances that are not rasterised, in blocks of neighbouring rays that may see them.
    fn trace_instances(&self, top: usize, hits: &mut [Option<Hit>]) {
        let count = hits.len() / self.grid.columns;
        for (instance, extent) in self.traced.iter().filter(|(_, extent)| extent.meets_rows(top, count)) {
            let columns = extent.low[0].ceil() as usize..extent.high[0] as usize + 1;
            let rows =
                (extent.low[1].ceil() as usize).max(top)..(extent.high[1] as usize + 1).min(top + count);
            self.in_blocks(columns, rows, |places, rays, found| {
                for (ray, &place) in rays.iter_mut().zip(places) {
                    ray.t_max = hits[self.place(place, top)].map_or(f32::INFINITY, |hit| hit.t);
                }
                self.world.closest_of(*instance, rays, found);
                for (found, &place) in found.iter().zip(places) {
                    let best = &mut hits[self.place(place, top)];
                    if let Some(found) = found {
                        crate::world::keep(best, *found, 0.0);
                    }
                }
            });
        }
    }

    /// Asks the whole world.
    pub(super) fn trace_all(&self, top: usize, hits: &mut [Option<Hit>]) {
        let count = hits.len() / self.grid.columns;
        self.in_blocks(0..self.grid.columns, top..top + count, |places, rays, found| {
            self.world.closest_packet(rays, found);
            for (found, &place) in found.iter().zip(places) {
                hits[self.place(place, top)] = *found;
            }
        });
    }

    /// Where a ray (x, y) stands in rows from `top` on.
    fn place(&self, [x, y]: [usize; 2], top: usize) -> usize {
        (y - top) * self.grid.columns + x
    }

    /// Calls `ask` with blocks of neighbouring rays.
    fn in_blocks(
        &self,
        columns: std::ops::Range<usize>,
        rows: std::ops::Range<usize>,
        mut ask: impl FnMut(&[[usize; 2]], &mut [Ray], &mut [Option<Hit>]),
    ) {
        let mut places = [[0; 2]; TOGETHER * TOGETHER];
        let mut rays = [self.grid.ray(0, 0); TOGETHER * TOGETHER];
        let mut found = [None; TOGETHER * TOGETHER];
        for y in rows.clone().step_by(TOGETHER) {
            for x in columns.clone().step_by(TOGETHER) {
                let mut count = 0;
                for y in y..(y + TOGETHER).min(rows.end) {
                    for x in x..(x + TOGETHER).min(columns.end) {
                        places[count] = [x, y];
                        rays[count] = self.grid.ray(x, y);
                        count += 1;
                    }
                }
                ask(&places[..count], &mut rays[..count], &mut found[..count]);
            }
        }
    }

    /// Traces the rays that meet nothing although most of their neighbours do: an edge that is shared by a triangle
    /// rasterised here and one that reaches behind the eye may leave a point between them.
    fn close_holes(&self, top: usize, hits: &mut [Option<Hit>]) {
        let columns = self.grid.columns;
        let count = hits.len() / columns;
        for place in 0..hits.len() {
            if hits[place].is_some() {
                continue;
            }
            let (x, y) = (place % columns, place / columns);
            let mut around = 0;
            for v in y.saturating_sub(1)..(y + 2).min(count) {
                let row = &hits[v * columns..][..columns];
                around += row[x.saturating_sub(1)..(x + 2).min(columns)].iter().flatten().count();
            }
            if around >= SURROUNDED {
                hits[place] = self.world.closest(&self.grid.ray(x, top + y));
            }
        }
    }
}
