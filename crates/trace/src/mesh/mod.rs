//! Triangles.

mod bins;
mod block;
pub(crate) mod build;
pub(crate) mod columns;
pub(crate) mod levels;
pub(crate) mod node;
pub(crate) mod packet;
pub(crate) mod packet_walk;
mod refit;
mod surface;
mod triangle;
pub(crate) mod walk;

use std::sync::Arc;

use glam::Vec3;
use rayon::prelude::*;

use halflight_shape::TriangleMesh;

use crate::geometry::{LocalHit, LocalSurface, RayGeometry};
use crate::{Ray, Simd};
pub(crate) use bins::{item, number as item_number};
pub(crate) use block::Block;
use block::{Corners, NO_CORNERS};
use node::Tree;
pub(crate) use refit::node_rows;
use walk::Reach;

/// A triangle mesh that answers rays.
///
/// Both sides of a triangle are met; the winding only decides where the geometric normal points. Triangles with a corner
/// that is not finite, or beyond 1e18, or whose vertex does not exist, are left out; triangles without area are never
/// met.
#[derive(Clone, Debug)]
pub struct MeshTracer {
    mesh: Arc<TriangleMesh>,
    positions_at_close: Option<Vec<Vec3>>,
    tree: Tree,
    blocks: Vec<Block>,
    /// Corners as the shutter closes, one for each block; empty if nothing moves.
    close: Vec<Corners>,
    bounds: (Vec3, Vec3),
    reach: Reach,
}

impl MeshTracer {
    /// Builds the tree of a mesh that stands still.
    #[must_use]
    pub fn build(mesh: Arc<TriangleMesh>) -> MeshTracer {
        MeshTracer::build_any(mesh, None)
    }

    /// Builds the tree of a mesh whose vertices move in straight lines from their positions to `positions_at_close`
    /// while the shutter is open. If there are not as many of these as of those, the mesh stands still.
    #[must_use]
    pub fn build_moving(mesh: Arc<TriangleMesh>, positions_at_close: Vec<Vec3>) -> MeshTracer {
        let fits = positions_at_close.len() == mesh.positions.len();
        MeshTracer::build_any(mesh, fits.then_some(positions_at_close))
    }

    fn build_any(mesh: Arc<TriangleMesh>, positions_at_close: Option<Vec<Vec3>>) -> MeshTracer {
        let items = items_of(&mesh, positions_at_close.as_deref());
        let built = build::build(Simd::detect(), items, build::LEAF_SIZE);
        let moving = positions_at_close.is_some();
        let blocks = built
            .leaves
            .into_par_iter()
            .with_min_len(512)
            .map(|triangles| {
                let mut block = Block { corners: NO_CORNERS, triangles };
                block::gather(&triangles, &mesh.triangles, &mesh.positions, &mut block.corners);
                block
            })
            .collect();
        let mut tracer = MeshTracer {
            mesh,
            positions_at_close,
            tree: built.tree,
            blocks,
            close: Vec::new(),
            bounds: (Vec3::ZERO, Vec3::ZERO),
            reach: Reach::default(),
        };
        if moving {
            tracer.fit();
        }
        tracer.measure();
        tracer
    }

    /// Takes over new vertex positions (and the other attributes) of the same triangles, keeping the shape of the tree:
    /// several times cheaper than building, and rays are as fast as long as neighbours stay neighbours. A mesh of other
    /// triangles is built anew.
    pub fn refit(&mut self, mesh: Arc<TriangleMesh>, positions_at_close: Option<Vec<Vec3>>) {
        let close = positions_at_close.filter(|close| close.len() == mesh.positions.len());
        let same = Arc::ptr_eq(&mesh, &self.mesh) || mesh.triangles == self.mesh.triangles;
        let all_fit = same && mesh.positions.len() == self.mesh.positions.len();
        if !all_fit {
            *self = MeshTracer::build_any(mesh, close);
            return;
        }
        self.mesh = mesh;
        self.positions_at_close = close;
        self.fit();
        self.measure();
    }

    /// The mesh.
    #[must_use]
    pub fn mesh(&self) -> &Arc<TriangleMesh> {
        &self.mesh
    }

    /// Vertex positions as the shutter closes, if they move.
    #[must_use]
    pub fn positions_at_close(&self) -> Option<&[Vec3]> {
        self.positions_at_close.as_deref()
    }

    /// Whether vertices move while the shutter is open.
    #[must_use]
    pub fn is_moving(&self) -> bool {
        self.positions_at_close.is_some()
    }

    /// Corners of a triangle at a time from 0 to 1.
    #[must_use]
    pub fn corners(&self, triangle: u32, time: f32) -> [Vec3; 3] {
        let triangle = self.mesh.triangles[triangle as usize];
        surface::corners_at(&self.mesh, self.positions_at_close.as_deref(), triangle, time)
    }

    /// The leaves of the tree: triangles with their corners as the shutter opens.
    pub(crate) fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// Corners and boxes from the positions as they are now.
    fn fit(&mut self) {
        let leaves = refit::fill_open(&mut self.blocks, &self.mesh);
        let rows = node_rows(&self.tree.nodes, &leaves);
        for (node, rows) in self.tree.nodes.iter_mut().zip(rows) {
            node.rows = rows;
        }
        self.close.clear();
        self.tree.close.clear();
        if let Some(positions) = &self.positions_at_close {
            let leaves = refit::fill_close(&self.blocks, &self.mesh, positions, &mut self.close);
            self.tree.close = node_rows(&self.tree.nodes, &leaves);
        }
    }

    fn measure(&mut self) {
        let [open, close] = self.tree.bounds();
        self.bounds = (open.0.min(close.0), open.1.max(close.1));
        self.reach = Reach::new(self.bounds.0, self.bounds.1);
    }
}

/// The boxes of all triangles that can take part, over the shutter interval, in the order of the triangles.
fn items_of(mesh: &TriangleMesh, close: Option<&[Vec3]>) -> Vec<bins::Item> {
    let box_of = |number: usize| {
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for &vertex in &mesh.triangles[number] {
            let open = *mesh.positions.get(vertex as usize)?;
            let shut = close.map_or(open, |close| close[vertex as usize]);
            if !block::usable(open) || !block::usable(shut) {
                return None;
            }
            low = low.min(open).min(shut);
            high = high.max(open).max(shut);
        }
        Some(item(low, high, number as u32))
    };
    // A number with the top bit set could not be told from a leaf's.
    let count = mesh.triangles.len().min(node::LEAF as usize - 1);
    (0..count).into_par_iter().with_min_len(4096).filter_map(box_of).collect()
}

impl RayGeometry for MeshTracer {
    fn bounds(&self) -> (Vec3, Vec3) {
        self.bounds
    }

    fn closest(&self, ray: &Ray) -> Option<LocalHit> {
        if ray.is_usable() { levels::closest(Simd::detect(), self, ray) } else { None }
    }

    fn occluded(&self, ray: &Ray) -> bool {
        ray.is_usable() && levels::occluded(Simd::detect(), self, ray)
    }

    fn surface(&self, ray: &Ray, hit: &LocalHit) -> LocalSurface {
        surface::surface(&self.mesh, self.positions_at_close.as_deref(), ray.time, hit)
    }

    fn primitives(&self) -> usize {
        self.mesh.triangles.len()
    }

    fn memory_bytes(&self) -> usize {
        self.tree.memory_bytes()
            + size_of_val(self.blocks.as_slice())
            + size_of_val(self.close.as_slice())
            + self.positions_at_close.as_ref().map_or(0, |close| size_of_val(close.as_slice()))
    }
}
