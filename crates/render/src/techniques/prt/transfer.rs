//! Transfer for a whole frame: where the vertices are, what they see, and how good that is between them.
//!
//! Triangles are first split until no edge is longer than the limit, then wherever transfer at the two ends of an edge
//! differs by more than twice the tolerance, unless interpolation was already found good there: the new vertex in the
//! middle says how good it was. Transfer is interpolated as if normals turned in the open: T ≈ Σ w_k T_k + v (C(n) −
//! Σ w_k C(n_k)), with C the unshadowed transfer and v the visible share, so that a sphere needs few vertices.
//!
//! Errors are norms of differences in parts of the norm of C.

use std::collections::HashMap;

use glam::Vec3;
use halflight_scene::Frame;
use rayon::prelude::*;

use super::bounce;
use super::cast::{Caster, Seen};
use super::directions::{Cosine, Directions};
use super::receivers::{Point, Receivers};
use super::settings::{PrtSettings, TransferKind};
use super::tree::{Edge, Leaf, Node, Tree, Weights, edge};
use crate::technique::Progress;

/// Parts of the diagonal of the scene that an edge may have if nothing else is said.
const DEFAULT_EDGES: f32 = 64.0;
/// Triangles at whose middles interpolation is compared with rays.
const PROBES: usize = 1024;
/// How many more directions than a vertex those rays have.
const PROBE_RAYS: usize = 4;
/// More rounds of halving than this turn metres into less than micrometres.
const MOST_ROUNDS: u32 = 24;
/// Marks vertices without a matrix.
pub(super) const NO_MATRIX: u32 = u32::MAX;

/// Transfer of a frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Transfer {
    /// Coefficients: the order squared.
    pub(super) n: usize,
    /// 1, or 3 where colours differ.
    pub(super) channels: usize,
    pub(super) roots: usize,
    pub(super) tree: Tree,
    /// Normals of the vertices.
    pub(super) normals: Vec<Vec3>,
    /// The visible share at each vertex.
    pub(super) visible: Vec<f32>,
    /// `channels` times `n` coefficients for each vertex.
    pub(super) diffuse: Vec<f32>,
    /// The number of each vertex's matrix.
    pub(super) matrix_of: Vec<u32>,
    /// `channels` times `n`² coefficients for each glossy vertex, light first.
    pub(super) glossy: Vec<f32>,
    /// Mean and 95th percentile of the error at the middles of triangles.
    pub(super) error: [f32; 2],
    /// Whether there were too many vertices to go on.
    pub(super) is_cut_short: bool,
    pub(super) rays: u64,
}

impl Transfer {
    /// The vertices around a point of a root, and their weights. Vertices that see nothing at all are as a rule within
    /// another body: they do not count where others do.
    #[inline]
    pub(super) fn locate(&self, root: u32, weights: Weights) -> ([u32; 3], Weights) {
        let (corners, weights) = self.tree.locate(root, weights);
        (corners, without_buried(corners.map(|corner| self.visible[corner as usize]), weights))
    }
}

/// Visible shares below this are those of no open place: it is less than one ray.
const BURIED: f32 = 1e-4;

#[inline]
fn without_buried(visible: [f32; 3], weights: Weights) -> Weights {
    if visible.iter().all(|&v| v > BURIED) {
        return weights;
    }
    let kept = [0, 1, 2].map(|i| if visible[i] > BURIED { weights[i].max(0.0) } else { 0.0 });
    let sum: f32 = kept.iter().sum();
    if sum > 1e-6 { kept.map(|w| w / sum) } else { weights }
}

/// The longest edge for a frame.
pub(super) fn longest_edge(frame: &Frame, settings: &PrtSettings) -> f32 {
    let diagonal = frame.bounds.0.distance(frame.bounds.1);
    settings.max_edge.unwrap_or(diagonal / DEFAULT_EDGES).max(1e-6 * diagonal).max(f32::MIN_POSITIVE)
}

/// A frame whose transfer is being worked out.
struct Work<'a> {
    frame: &'a Frame,
    receivers: &'a Receivers,
    caster: Caster<'a>,
    tree: Tree,
    leaves: Vec<Leaf>,
    places: Vec<(u32, Weights)>,
    points: Vec<Point>,
    seen: Seen,
    most: usize,
    is_cut_short: bool,
}

/// Works out transfer; `None` if told to stop.
pub(super) fn work_out(
    frame: &Frame,
    receivers: &Receivers,
    settings: &PrtSettings,
    progress: &dyn Progress,
) -> Option<Transfer> {
    let n = (settings.order * settings.order) as usize;
    let directions = Directions::new(2 * settings.rays as usize, n, 0.0);
    let cosine = Cosine::new();
    let (corners, places) = receivers.weld(frame);
    let caster = Caster {
        world: &frame.world,
        directions: &directions,
        cosine: &cosine,
        n,
        is_shadowed: settings.transfer != TransferKind::Unshadowed,
        with_matrices: true,
    };
    let mut work = Work {
        frame,
        receivers,
        caster,
        leaves: Leaf::roots(corners.len()),
        tree: Tree { nodes: corners.into_iter().map(Node::leaf).collect() },
        points: Vec::new(),
        places,
        seen: Seen::default(),
        most: settings.max_vertices as usize,
        is_cut_short: false,
    };
    work.shorten_edges(longest_edge(frame, settings));
    work.see("vertices", progress)?;
    for _ in 0..settings.subdivisions {
        if !work.refine(settings.tolerance, progress)? {
            break;
        }
    }
    let error = work.probe(settings, progress)?;
    let Work { tree, points, mut seen, is_cut_short, .. } = work;
    let mut matrices = 0;
    let matrix_of = points
        .iter()
        .map(|point| {
            matrices += u32::from(point.is_glossy);
            if point.is_glossy { matrices - 1 } else { NO_MATRIX }
        })
        .collect();
    let mut transfer = Transfer {
        n,
        channels: 1,
        roots: receivers.roots(),
        tree,
        normals: points.iter().map(|point| point.surface.shading_normal).collect(),
        visible: std::mem::take(&mut seen.visible),
        diffuse: seen.transfer,
        matrix_of,
        glossy: seen.matrices,
        error,
        is_cut_short,
        rays: seen.rays,
    };
    if settings.bounces() > 0 {
        let scene = bounce::Surroundings { frame, receivers, points: &points, directions: &directions };
        bounce::add_bounces(&mut transfer, &scene, settings.bounces(), progress)?;
    }
    Some(transfer)
}

impl Work<'_> {
    /// Makes a vertex in the middle of each of these edges of the leaves.
    fn split(
        &mut self,
        edges: &[Edge],
        measure: impl FnOnce(&mut Self, &HashMap<Edge, u32>) -> Option<Vec<f32>>,
    ) -> Option<()> {
        let mut wanted: HashMap<Edge, u32> = edges.iter().enumerate().map(|(i, &e)| (e, i as u32)).collect();
        let first = self.places.len() as u32;
        let mut places = vec![None; edges.len()];
        for leaf in &self.leaves {
            let c = self.tree.nodes[leaf.node as usize].corners;
            for k in 0..3 {
                let Some(&number) = wanted.get(&edge(c[k], c[(k + 1) % 3])) else { continue };
                let (p, q) = (leaf.weights[k], leaf.weights[(k + 1) % 3]);
                places[number as usize].get_or_insert((leaf.root, [0, 1, 2].map(|i| 0.5 * (p[i] + q[i]))));
            }
        }
        // Every edge is one of a leaf.
        self.places.extend(places.into_iter().flatten());
        wanted.values_mut().for_each(|number| *number += first);
        let errors = measure(self, &wanted)?;
        let middles: HashMap<Edge, (u32, f32)> =
            wanted.iter().map(|(&e, &v)| (e, (v, errors[(v - first) as usize]))).collect();
        self.leaves = self.tree.split(&self.leaves, &middles);
        Some(())
    }

    /// The edges of the leaves, each once, in the order of the leaves, with the largest error around it.
    fn edges(&self) -> Vec<(Edge, f32)> {
        let mut known: HashMap<Edge, usize> = HashMap::with_capacity(self.leaves.len() * 2);
        let mut edges = Vec::with_capacity(self.leaves.len() * 2);
        for leaf in &self.leaves {
            let [a, b, c] = self.tree.nodes[leaf.node as usize].corners;
            for e in [edge(a, b), edge(b, c), edge(c, a)] {
                let at = *known.entry(e).or_insert_with(|| {
                    edges.push((e, 0.0f32));
                    edges.len() - 1
                });
                edges[at].1 = edges[at].1.max(leaf.error);
            }
        }
        edges
    }

    /// Keeps as many of the edges as there may be vertices, those with the largest values.
    fn within_limit(&mut self, mut edges: Vec<(Edge, f32)>) -> Vec<Edge> {
        let room = self.most.saturating_sub(self.places.len());
        if edges.len() > room {
            self.is_cut_short = true;
            edges.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
            edges.truncate(room);
        }
        edges.into_iter().map(|(e, _)| e).collect()
    }

    fn shorten_edges(&mut self, longest: f32) {
        let position = |(root, weights): (u32, Weights)| self.receivers.position(self.frame, root, weights);
        let mut positions: Vec<Vec3> = self.places.par_iter().map(|&place| position(place)).collect();
        for _ in 0..MOST_ROUNDS {
            let length = |&(e, _): &(Edge, f32)| positions[e.0 as usize].distance(positions[e.1 as usize]);
            let long: Vec<(Edge, f32)> = self
                .edges()
                .iter()
                .filter_map(|e| Some((e.0, length(e))).filter(|&(_, length)| length > longest))
                .collect();
            let edges = self.within_limit(long);
            if edges.is_empty() {
                break;
            }
            let count = edges.len();
            let done = self.split(&edges, |_, _| Some(vec![f32::INFINITY; count]));
            debug_assert!(done.is_some());
            let new = &self.places[positions.len()..];
            let more: Vec<Vec3> = new
                .par_iter()
                .map(|&(root, weights)| self.receivers.position(self.frame, root, weights))
                .collect();
            positions.extend(more);
        }
    }

    /// Casts from all vertices that have not looked yet.
    fn see(&mut self, what: &str, progress: &dyn Progress) -> Option<()> {
        let new: Vec<Point> = self.places[self.points.len()..]
            .par_iter()
            .map(|&(root, weights)| self.receivers.point(self.frame, root, weights))
            .collect();
        let seen = self.caster.cast(&new, what, progress)?;
        self.seen.append(seen);
        self.points.extend(new);
        Some(())
    }

    /// Splits edges where that helps, once; whether there were any.
    fn refine(&mut self, tolerance: f32, progress: &dyn Progress) -> Option<bool> {
        let candidates: Vec<(Edge, f32)> = self
            .edges()
            .into_par_iter()
            .filter(|(_, error)| *error > tolerance)
            .map(|(e, _)| (e, self.difference(e)))
            // Between its ends a function that only rises strays from the line by no more than half its rise.
            .filter(|(_, difference)| *difference > 2.0 * tolerance)
            .collect();
        let edges = self.within_limit(candidates);
        if edges.is_empty() {
            return Some(false);
        }
        self.split(&edges, |work, middles| {
            work.see("new vertices", progress)?;
            let first = (work.places.len() - middles.len()) as u32;
            let mut errors = vec![0.0; middles.len()];
            for (&(a, b), &middle) in middles {
                errors[(middle - first) as usize] = work.error_between([(a, 0.5), (b, 0.5)], work.at(middle));
            }
            Some(errors)
        })?;
        Some(true)
    }

    fn at(&self, vertex: u32) -> (Vec3, &[f32]) {
        let n = self.caster.n;
        let v = vertex as usize;
        (self.points[v].surface.shading_normal, &self.seen.transfer[v * n..(v + 1) * n])
    }

    /// How far transfer at the two ends of an edge differs by more than the turn of the normal.
    fn difference(&self, (a, b): Edge) -> f32 {
        self.error_between([(a, 1.0), (a, 0.0)], self.at(b))
            .max(self.error_between([(b, 1.0), (b, 0.0)], self.at(a)))
    }

    /// The error of interpolation between vertices.
    fn error_between<const N: usize>(&self, from: [(u32, f32); N], (normal, truth): (Vec3, &[f32])) -> f32 {
        let there = self.caster.cosine.about(normal);
        let mut difference: Vec<f32> = truth.to_vec();
        let mut open = there;
        let mut visible = 0.0;
        for (vertex, weight) in from {
            let (normal, transfer) = self.at(vertex);
            super::cast::subtract(&mut difference, transfer, weight);
            open -= self.caster.cosine.about(normal) * weight;
            visible += weight * self.seen.visible[vertex as usize];
        }
        super::cast::subtract(&mut difference, &open.coefficients()[..self.caster.n], visible);
        let norm = |v: &[f32]| v.iter().map(|x| x * x).sum::<f32>().sqrt();
        norm(&difference) / norm(&there.coefficients()[..self.caster.n])
    }

    /// Compares with more rays at the middles of triangles.
    fn probe(&mut self, settings: &PrtSettings, progress: &dyn Progress) -> Option<[f32; 2]> {
        let step = (self.leaves.len() / PROBES).max(1);
        let probed: Vec<Leaf> = self.leaves.iter().copied().skip(step / 2).step_by(step).collect();
        let points: Vec<Point> = probed
            .par_iter()
            .map(|leaf| self.receivers.point(self.frame, leaf.root, leaf.middle()))
            .collect();
        // Other directions than those of the vertices.
        let directions = Directions::new(2 * PROBE_RAYS * settings.rays as usize, self.caster.n, 1.0);
        let caster = Caster { directions: &directions, with_matrices: false, ..self.caster };
        let seen = caster.cast(&points, "comparisons", progress)?;
        let mut errors: Vec<f32> = probed
            .iter()
            .zip(points.iter().zip(seen.transfer.chunks_exact(self.caster.n)))
            .map(|(leaf, (point, truth))| {
                let [a, b, c] = self.tree.nodes[leaf.node as usize].corners;
                let third = 1.0 / 3.0;
                self.error_between(
                    [(a, third), (b, third), (c, third)],
                    (point.surface.shading_normal, truth),
                )
            })
            .collect();
        errors.sort_by(f32::total_cmp);
        let mean = errors.iter().sum::<f32>() / errors.len().max(1) as f32;
        self.seen.rays += seen.rays;
        Some([mean, errors.get(errors.len() * 95 / 100).copied().unwrap_or(0.0)])
    }
}
