//! A partition of the sphere into bins that a sampler fills about equally, and integrals over them.
//!
//! A direction has the coordinates q = z (kept exact near the poles by way of 1 − |z| = r²/(1 + |z|)) and φ; a bin
//! is a rectangle of both, so that its solid angle is its area. A training set of samples is halved at its median,
//! again and again, after a first cut along the horizon, where densities jump: bins shrink where the sampler looks.

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};

/// A rectangle of q and φ.
#[derive(Clone, Copy, Debug)]
struct Span {
    low: [f64; 2],
    high: [f64; 2],
}

/// A span with the training samples that fell into it.
pub(crate) struct Bin {
    span: Span,
    samples: Vec<[f64; 2]>,
}

enum Node {
    Cut { axis: usize, at: f64, children: [usize; 2] },
    Leaf(usize),
}

pub(crate) struct Partition {
    nodes: Vec<Node>,
    pub(crate) bins: Vec<Bin>,
}

impl Partition {
    /// About 2^depth bins on each side of the horizon that has samples.
    pub(crate) fn new(samples: &[Vec3], depth: usize) -> Self {
        let mut this =
            Self { nodes: vec![Node::Cut { axis: 0, at: 0.0, children: [0; 2] }], bins: Vec::new() };
        let (lower, upper): (Vec<_>, Vec<_>) =
            samples.iter().map(|&v| coordinates(v)).partition(|p| p[0] < 0.0);
        let children = [
            this.grow(lower, Span { low: [-1.0, -PI], high: [0.0, PI] }, depth),
            this.grow(upper, Span { low: [0.0, -PI], high: [1.0, PI] }, depth),
        ];
        this.nodes[0] = Node::Cut { axis: 0, at: 0.0, children };
        this
    }

    fn grow(&mut self, mut samples: Vec<[f64; 2]>, span: Span, depth: usize) -> usize {
        let node = self.nodes.len();
        let axis = depth % 2;
        let middle = samples.len() / 2;
        let median = (depth > 0 && samples.len() >= 16)
            .then(|| samples.select_nth_unstable_by(middle, |a, b| a[axis].total_cmp(&b[axis])).1[axis])
            .filter(|&at| at > span.low[axis] && at < span.high[axis]);
        let Some(at) = median else {
            self.nodes.push(Node::Leaf(self.bins.len()));
            self.bins.push(Bin { span, samples });
            return node;
        };
        self.nodes.push(Node::Leaf(0));
        let (lower, upper): (Vec<_>, Vec<_>) = samples.into_iter().partition(|p| p[axis] < at);
        let (mut below, mut above) = (span, span);
        below.high[axis] = at;
        above.low[axis] = at;
        let children = [self.grow(lower, below, depth - 1), self.grow(upper, above, depth - 1)];
        self.nodes[node] = Node::Cut { axis, at, children };
        node
    }

    /// The bin of a direction.
    pub(crate) fn find(&self, v: Vec3) -> usize {
        let p = coordinates(v);
        let mut node = 0;
        loop {
            match &self.nodes[node] {
                Node::Cut { axis, at, children } => node = children[usize::from(p[*axis] >= *at)],
                Node::Leaf(bin) => return *bin,
            }
        }
    }
}

/// A training sample with the density there.
#[derive(Clone, Copy)]
struct Witness {
    place: [f64; 2],
    density: f64,
}

/// A part of a bin in the course of its integration.
struct Part {
    span: Span,
    witnesses: Vec<Witness>,
    value: f64,
    error: f64,
}

/// How often a bin is cut for its integral: enough for the steps of a measured table, 0.2 million evaluations.
const MAX_CUTS: usize = 1000;

impl Bin {
    /// The integral of a density over the bin: Gauss's rule of 3 × 3 points, compared with the sum over quarters;
    /// the part with the largest difference is cut next, until all differences together are below the tolerance.
    /// Nine points would miss what is narrow: where training samples stand at many times the estimated mean, the
    /// difference counts as all they stand for. Returns the integral and what is left of the differences.
    pub(crate) fn integrate(&self, density: &impl Fn(Vec3) -> f64, tolerance: f64) -> (f64, f64) {
        let at = |p: &[f64; 2]| Witness { place: *p, density: density(direction(*p)) };
        let mut parts =
            BinaryHeap::from([Part::new(density, self.span, self.samples.iter().map(at).collect())]);
        let mut error: f64 = parts.iter().map(|part| part.error).sum();
        for _ in 0..MAX_CUTS {
            if error <= tolerance {
                break;
            }
            let Some(worst) = parts.pop() else { break };
            error -= worst.error;
            let cuts = match worst.span.sparse_axis(&worst.witnesses) {
                Some(axis) => worst.span.halves(axis).to_vec(),
                None => worst.span.quarters().to_vec(),
            };
            for span in cuts {
                let inside = worst.witnesses.iter().copied().filter(|p| span.contains(&p.place)).collect();
                let part = Part::new(density, span, inside);
                error += part.error;
                parts.push(part);
            }
        }
        (parts.iter().map(|part| part.value).sum(), error.max(0.0))
    }
}

impl Part {
    fn new(density: &impl Fn(Vec3) -> f64, span: Span, witnesses: Vec<Witness>) -> Self {
        let value: f64 = span.quarters().iter().map(|quarter| quarter.gauss(density)).sum();
        let highest = witnesses.iter().map(|p| p.density).fold(0.0, f64::max) * span.area();
        // A parabola's maximum is at most three times its mean.
        let unresolved = if highest > 6.0 * value { highest } else { 0.0 };
        Self { span, witnesses, value, error: (value - span.gauss(density)).abs().max(unresolved) }
    }
}

impl Ord for Part {
    fn cmp(&self, other: &Self) -> Ordering {
        self.error.total_cmp(&other.error)
    }
}

impl PartialOrd for Part {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Part {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Part {}

impl Span {
    fn area(&self) -> f64 {
        (self.high[0] - self.low[0]) * (self.high[1] - self.low[1])
    }

    fn contains(&self, p: &[f64; 2]) -> bool {
        (0..2).all(|axis| p[axis] >= self.low[axis] && p[axis] < self.high[axis])
    }

    /// An axis of which several samples crowd in less than a third.
    fn sparse_axis(&self, samples: &[Witness]) -> Option<usize> {
        let crowded = |&axis: &usize| {
            let ends =
                |(low, high): (f64, f64), p: &Witness| (low.min(p.place[axis]), high.max(p.place[axis]));
            let (low, high) = samples.iter().fold((f64::MAX, f64::MIN), ends);
            high - low < 0.3 * (self.high[axis] - self.low[axis])
        };
        (0..2).find(crowded).filter(|_| samples.len() >= 4)
    }

    fn quarters(&self) -> [Span; 4] {
        let [lower, upper] = self.halves(0);
        let ([a, b], [c, d]) = (lower.halves(1), upper.halves(1));
        [a, b, c, d]
    }

    fn halves(&self, axis: usize) -> [Span; 2] {
        let middle = 0.5 * (self.low[axis] + self.high[axis]);
        let (mut lower, mut upper) = (*self, *self);
        lower.high[axis] = middle;
        upper.low[axis] = middle;
        [lower, upper]
    }

    fn gauss(&self, density: &impl Fn(Vec3) -> f64) -> f64 {
        const POINTS: [(f64, f64); 3] =
            [(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];
        let size = [0, 1].map(|axis| self.high[axis] - self.low[axis]);
        let mut sum = 0.0;
        for (x, a) in POINTS {
            for (y, b) in POINTS {
                sum += a * b * density(direction([self.low[0] + x * size[0], self.low[1] + y * size[1]]));
            }
        }
        sum * size[0] * size[1]
    }
}

fn coordinates(v: Vec3) -> [f64; 2] {
    let v: DVec3 = v.as_dvec3().normalize_or(DVec3::Z);
    let versine = (v.x * v.x + v.y * v.y) / (1.0 + v.z.abs());
    let phi = v.y.atan2(v.x);
    [(1.0 - versine).copysign(v.z), if phi >= PI { phi - TAU } else { phi }]
}

fn direction([q, phi]: [f64; 2]) -> Vec3 {
    let versine = 1.0 - q.abs();
    let r = (versine * (2.0 - versine)).max(0.0).sqrt();
    DVec3::new(r * phi.cos(), r * phi.sin(), q).as_vec3()
}
