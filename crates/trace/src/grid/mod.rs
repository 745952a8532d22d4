//! What a pinhole camera sees through a regular grid of points: rasterised where that is cheaper than rays.
//!
//! Neighbouring rays of one origin meet neighbouring triangles. Instead of asking for each ray which triangle it meets,
//! each triangle is asked which rays meet it: its corners are projected onto the grid, edge functions tell the points
//! inside, and the nearest triangle of each point is kept, with the weights of its corners there. A hit is where
//! [`World::closest`] finds it to a thousandth of the distance between rays; where a ray passes that close to an edge, the
//! two may find different triangles.
//!
//! Meshes and height fields are rasterised as long as they have no more than a few triangles a ray, and so are spheres (see
//! [`balls`]); other geometry is asked by rays, within the part of the picture that its box covers. A world of much else is asked by rays altogether.
//!
//! `cargo run --release -p halflight-trace --example grid_rate` prints the cost beside that of tracing the same rays.
//! Source of the edge functions: Pineda, A Parallel Algorithm for Polygon Rasterization, 1988; those of triangles that
//! reach behind the eye: Olano & Greer, Triangle Scan Conversion using 2D Homogeneous Coordinates, 1997.

mod balls;
mod band;
mod fill;
mod points;
mod project;
#[cfg(test)]
mod tests;

use glam::Vec3;
use rayon::prelude::*;

use crate::spheres::is_usable;
use crate::world::World;
use crate::{Geometry, Hit, Ray, Sphere};
pub use band::GridRows;
pub use points::GridPoints;
use project::{Extent, Projection};

/// Most triangles for a ray: with more, tracing the ray is cheaper.
const TRIANGLES_PER_RAY: usize = 4;
/// Most instances that are asked by rays one after another.
const TRACED: usize = 8;
/// Leaves of a mesh's tree in a piece of work, of eight triangles each.
const LEAVES: usize = 16;

/// Rays of one origin through the points `corner + x · across + y · down`, for whole x and y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayGrid {
    /// Where all rays start.
    pub origin: Vec3,
    /// From the origin to the point (0, 0).
    pub corner: Vec3,
    /// From a point to the next of its row.
    pub across: Vec3,
    /// From a point to the next of its column.
    pub down: Vec3,
    /// Points in a row.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
}

impl RayGrid {
    /// The ray through point (x, y), of unit direction, as the shutter opens.
    #[inline(always)]
    #[must_use]
    pub fn ray(&self, x: usize, y: usize) -> Ray {
        Ray::new(self.origin, self.point(x, y).normalize())
    }

    /// From the origin to point (x, y).
    #[inline(always)]
    fn point(&self, x: usize, y: usize) -> Vec3 {
        self.corner + self.across * x as f32 + self.down * y as f32
    }
}

/// A world made ready for a grid of rays; see [`World::grid`].
#[derive(Debug)]
pub struct GridTracer<'a> {
    world: &'a World,
    grid: RayGrid,
    /// Parts of what is rasterised, in the order of instances.
    pieces: Vec<Piece>,
    /// How the points of each instance are seen, and whether it is a height field.
    projections: Vec<Projection>,
    is_field: Vec<bool>,
    /// Whether it is rasterised as spheres.
    are_balls: Vec<bool>,
    /// Instances that are asked by rays, with the part of the grid that they may be seen in.
    traced: Vec<(u32, Extent)>,
    /// Whether all rays are traced through the whole world.
    by_rays: bool,
}

/// Neighbouring triangles of one instance.
#[derive(Clone, Copy, Debug)]
struct Piece {
    instance: u32,
    /// The first leaf of a mesh, the node of a height field, or the sphere.
    first: u32,
    extent: Extent,
}

/// How an instance is seen.
enum Way {
    Rasterise,
    Trace,
}

impl World {
    /// Prepares to answer the rays of a grid, as the shutter opens. Takes a part of a millisecond for half a million
    /// triangles; rows may then be asked for in any order and by any thread.
    #[must_use]
    pub fn grid(&self, grid: RayGrid) -> GridTracer<'_> {
        let mut tracer = GridTracer {
            world: self,
            grid,
            pieces: Vec::new(),
            projections: Vec::new(),
            is_field: Vec::new(),
            are_balls: Vec::new(),
            traced: Vec::new(),
            by_rays: true,
        };
        let Some(of_world) = Projection::of_grid(&grid) else { return tracer };
        let mut triangles = 0;
        for (number, instance) in (0..).zip(self.instances()) {
            tracer.is_field.push(matches!(instance.geometry.as_ref(), Geometry::HeightField(_)));
            tracer.are_balls.push(balls::are_balls(instance, grid.origin));
            let Some(transform) = self.placed(number) else {
                tracer.projections.push(of_world);
                continue;
            };
            let projection = of_world.after(&transform);
            tracer.projections.push(projection);
            let extent = projection.of_box(instance.geometry.as_rays().bounds(), &grid);
            if extent.is_empty() {
                continue;
            }
            match tracer.way(number) {
                Way::Rasterise => triangles += instance.geometry.as_rays().primitives(),
                Way::Trace => tracer.traced.push((number, extent)),
            }
        }
        tracer.by_rays =
            tracer.traced.len() > TRACED || triangles > TRIANGLES_PER_RAY * grid.columns * grid.rows;
        if !tracer.by_rays {
            tracer.pieces = tracer.cut_up();
        }
        tracer
    }
}

impl GridTracer<'_> {
    fn way(&self, number: u32) -> Way {
        let geometry = self.world.instances()[number as usize].geometry.as_ref();
        let few = geometry.as_rays().primitives() <= TRIANGLES_PER_RAY * self.grid.columns * self.grid.rows;
        match geometry {
            Geometry::Mesh(_) | Geometry::HeightField(_) if few => Way::Rasterise,
            Geometry::Spheres(_) if few && self.are_balls[number as usize] => Way::Rasterise,
            _ => Way::Trace,
        }
    }

    /// The pieces of all instances that are rasterised, without those that are out of sight.
    fn cut_up(&self) -> Vec<Piece> {
        let mut pieces = Vec::new();
        for (number, instance) in (0..).zip(self.world.instances()) {
            if self.world.placed(number).is_none() || matches!(self.way(number), Way::Trace) {
                continue;
            }
            let projection = &self.projections[number as usize];
            let piece = |first: usize, extent: Extent| {
                (!extent.is_empty()).then_some(Piece { instance: number, first: first as u32, extent })
            };
            match instance.geometry.as_ref() {
                Geometry::Mesh(mesh) => {
                    let chunks = mesh.blocks().par_chunks(LEAVES).enumerate();
                    let seen = |(i, leaves)| piece(i * LEAVES, projection.of_leaves(leaves, &self.grid));
                    pieces.extend(chunks.filter_map(seen).collect::<Vec<_>>());
                }
                Geometry::HeightField(field) => {
                    let nodes = (0..field.blocks()).into_par_iter().with_min_len(64);
                    let seen = |i| piece(i, projection.of_box(field.block_bounds(i), &self.grid));
                    pieces.extend(nodes.filter_map(seen).collect::<Vec<_>>());
                }
                Geometry::Spheres(tracer) => {
                    let spheres = tracer.spheres().par_iter().with_min_len(64).enumerate();
                    let usable = spheres.filter(|(_, sphere)| is_usable(sphere));
                    let around =
                        |sphere: &Sphere| (sphere.center - sphere.radius, sphere.center + sphere.radius);
                    let seen = |(i, sphere)| piece(i, projection.of_box(around(sphere), &self.grid));
                    pieces.extend(usable.filter_map(seen).collect::<Vec<_>>());
                }
                _ => {}
            }
        }
        pieces
    }

    /// The nearest hits of whole rows from `top` on, as many as `hits` has room for.
    ///
    /// # Panics
    /// If `hits` is not whole rows of the grid.
    pub fn rows(&self, top: usize, room: &mut GridRows, hits: &mut [Option<Hit>]) {
        let columns = self.grid.columns;
        assert!(hits.len().is_multiple_of(columns), "rows of {columns} rays, not {} rays", hits.len());
        if self.by_rays {
            self.trace_all(top, hits);
        } else {
            room.run(self, top, hits);
        }
    }
}
