//! Building the tree: binned surface area heuristic, eight children at a time.
//!
//! A range of boxes is divided where Σ (area of a side) · (leaves it needs) is least, over 16 bins of each axis; a wide
//! node divides its child of largest area until it has eight. A leaf takes what one eight-wide test can take, so its
//! cost is a step function, ⌈n / 8⌉.
//! Source: Wald, On fast Construction of SAH-based Bounding Volume Hierarchies, 2007; Wald, Benthin, Boulos, Getting
//! Rid of Packets, 2008 (wide nodes). Cost: see `halflight_trace::bench` for the measured figures.
//!
//! Large ranges are binned in chunks of fixed size by all threads, and their children are built side by side; the
//! result does not depend on the number of threads.

use rayon::prelude::*;

use super::bins::{self, BINS, Bins, Grid, Item, Span};
use super::node::{EMPTY, LEAF, Node, Tree, set_box};
use crate::simd::Simd;

/// Most items in a leaf.
pub(crate) const LEAF_SIZE: usize = 8;
/// Ranges up to this size are built by one thread: about a millisecond of work.
const SERIAL: usize = 4096;
/// A leaf is divided where there is room if its parts have less than this of its area together: then fewer leaves are
/// visited. Chosen with `ray_rate` among 0.7 … 1.1.
const WORTH_DIVIDING: f32 = 0.9;
/// Items that one thread bins at a time.
const CHUNK: usize = 16384;
/// Below this depth ranges are halved, so that the depth of the tree, and with it the stack of a walk, is bounded: 40
/// uneven divisions, then at most 32 halvings.
const DEEPEST_UNEVEN: u32 = 40;
/// No walk needs more places than this on its stack: at each level it leaves at most seven children behind, and has at
/// most eight on it before it takes one up.
pub(crate) const STACK: usize = 7 * (DEEPEST_UNEVEN as usize + 32) + 8;

/// A tree and the items of its leaves, `u32::MAX` where a leaf has fewer.
pub(crate) struct Built {
    pub(crate) tree: Tree,
    pub(crate) leaves: Vec<[u32; LEAF_SIZE]>,
}

/// Consecutive items.
#[derive(Clone, Copy)]
struct Range {
    start: usize,
    count: usize,
    span: Span,
    centres: Span,
    depth: u32,
}

impl Range {
    fn measure(simd: Simd, items: &[Item], start: usize, count: usize, depth: u32) -> Range {
        let part = &items[start..start + count];
        let (span, centres) = if count > 4 * CHUNK {
            part.par_chunks(CHUNK).map(|chunk| bins::extent(simd, chunk)).reduce(
                || (bins::NOTHING, bins::NOTHING),
                |a, b| (bins::join(&a.0, &b.0), bins::join(&a.1, &b.1)),
            )
        } else {
            bins::extent(simd, part)
        };
        Range { start, count, span, centres, depth }
    }
}

/// How many leaves a count needs.
fn leaves_for(count: u32, leaf_size: usize) -> f32 {
    count.div_ceil(leaf_size as u32) as f32
}

/// The axis and bin before which to divide, at least cost; none if all centres fall into one bin.
fn best_division(bins: &Bins, leaf_size: usize) -> Option<(usize, usize)> {
    let mut best = None;
    let mut least = f32::INFINITY;
    for axis in 0..3 {
        let (counts, spans) = (&bins.counts[axis], &bins.spans[axis]);
        let mut right_cost = [0.0; BINS];
        let (mut span, mut count) = (bins::NOTHING, 0);
        for bin in (1..BINS).rev() {
            span = bins::join(&span, &spans[bin]);
            count += counts[bin];
            right_cost[bin] = if count == 0 {
                f32::INFINITY
            } else {
                bins::half_area(&span) * leaves_for(count, leaf_size)
            };
        }
        (span, count) = (bins::NOTHING, 0);
        for bin in 1..BINS {
            span = bins::join(&span, &spans[bin - 1]);
            count += counts[bin - 1];
            if count == 0 {
                continue;
            }
            let cost = bins::half_area(&span) * leaves_for(count, leaf_size) + right_cost[bin];
            if cost < least {
                least = cost;
                best = Some((axis, bin));
            }
        }
    }
    best
}

/// Divides a range in two, neither empty.
fn divide(simd: Simd, items: &mut [Item], range: &Range, leaf_size: usize) -> (Range, Range) {
    let part = &mut items[range.start..range.start + range.count];
    let mut left = 0;
    if range.depth < DEEPEST_UNEVEN {
        let grid = Grid::over(&range.centres);
        let mut bins = Bins::EMPTY;
        if part.len() > 4 * CHUNK {
            bins = part
                .par_chunks(CHUNK)
                .map(|chunk| {
                    let mut bins = Bins::EMPTY;
                    bins::bin(simd, chunk, &grid, &mut bins);
                    bins
                })
                .reduce(|| Bins::EMPTY, |a, b| a.merge(&b));
        } else {
            bins::bin(simd, part, &grid, &mut bins);
        }
        if let Some((axis, bin)) = best_division(&bins, leaf_size) {
            left = bins::partition(simd, part, &grid, axis, bin);
        }
    }
    if left == 0 || left == part.len() {
        left = part.len() / 2;
    }
    let depth = range.depth + 1;
    (
        Range::measure(simd, items, range.start, left, depth),
        Range::measure(simd, items, range.start + left, range.count - left, depth),
    )
}

/// Divides a range into up to eight, the one of largest area first; gives them largest first, which is the order in which
/// rays look for any hit. Leaves are divided too, while the node has room, where that makes their area less.
fn expand(simd: Simd, items: &mut [Item], range: Range, leaf_size: usize) -> ([Range; 8], usize) {
    let mut children = [range; 8];
    let mut count = 1;
    while count < 8 {
        let largest = (0..count)
            .filter(|&i| children[i].count > leaf_size)
            .map(|i| (i, bins::half_area(&children[i].span)))
            .reduce(|a, b| if b.1 > a.1 { b } else { a });
        let Some((chosen, _)) = largest else { break };
        let (left, right) = divide(simd, items, &children[chosen], leaf_size);
        children[chosen] = left;
        children[count] = right;
        count += 1;
    }
    let mut next = 0;
    while next < count && count < 8 {
        let child = children[next];
        if child.count > 1 && leaf_size > 1 {
            let (left, right) = divide(simd, items, &child, 1);
            let divided = bins::half_area(&left.span) + bins::half_area(&right.span);
            if divided < WORTH_DIVIDING * bins::half_area(&child.span) {
                children[next] = left;
                children[count] = right;
                count += 1;
                continue;
            }
        }
        next += 1;
    }
    children[..count].sort_by(|a, b| bins::half_area(&b.span).total_cmp(&bins::half_area(&a.span)));
    (children, count)
}

/// A finished part of the tree, numbered from 0.
#[derive(Default)]
struct Part {
    nodes: Vec<Node>,
    leaves: Vec<[u32; LEAF_SIZE]>,
}

impl Part {
    /// Takes over another part; gives the word that names its root.
    fn append(&mut self, part: Part) -> u32 {
        let (node_base, leaf_base) = (self.nodes.len() as u32, self.leaves.len() as u32);
        self.nodes.extend(part.nodes.into_iter().map(|mut node| {
            for child in &mut node.children {
                if *child != EMPTY {
                    *child += if *child & LEAF != 0 { leaf_base } else { node_base };
                }
            }
            node
        }));
        self.leaves.extend(part.leaves);
        node_base
    }

    /// Adds a leaf; gives the word that names it.
    fn leaf(&mut self, items: &[Item]) -> u32 {
        let mut numbers = [u32::MAX; LEAF_SIZE];
        for (number, item) in numbers.iter_mut().zip(items) {
            *number = bins::number(item);
        }
        self.leaves.push(numbers);
        LEAF | (self.leaves.len() - 1) as u32
    }
}

fn put_box(node: &mut Node, slot: usize, span: &Span) {
    let low = glam::Vec3::new(-span[0], -span[1], -span[2]);
    set_box(&mut node.rows, slot, low, glam::Vec3::new(span[4], span[5], span[6]));
}

/// Builds the part of a small range; its root is node 0.
fn build_serial(simd: Simd, items: &mut [Item], range: Range, leaf_size: usize) -> Part {
    let mut part = Part::default();
    part.nodes.push(Node::NONE);
    let mut open = vec![(0_usize, range)];
    while let Some((index, range)) = open.pop() {
        let (children, count) = expand(simd, items, range, leaf_size);
        for (slot, child) in children[..count].iter().enumerate() {
            put_box(&mut part.nodes[index], slot, &child.span);
            part.nodes[index].children[slot] = if child.count <= leaf_size {
                part.leaf(&items[child.start..child.start + child.count])
            } else {
                part.nodes.push(Node::NONE);
                open.push((part.nodes.len() - 1, *child));
                (part.nodes.len() - 1) as u32
            };
        }
    }
    part
}

/// Builds the part of a range, its children side by side while they are large; its root is node 0.
fn build_range(simd: Simd, items: &mut [Item], range: Range, leaf_size: usize) -> Part {
    if range.count <= SERIAL {
        return build_serial(simd, items, range, leaf_size);
    }
    let (mut children, count) = expand(simd, items, range, leaf_size);
    let children = &mut children[..count];
    let mut in_place: Vec<usize> = (0..count).collect();
    in_place.sort_by_key(|&child| children[child].start);
    let mut rest = &mut items[range.start..range.start + range.count];
    let mut jobs: Vec<(usize, Range, &mut [Item])> = Vec::with_capacity(count);
    for index in in_place {
        let (mine, others) = rest.split_at_mut(children[index].count);
        rest = others;
        jobs.push((index, Range { start: 0, ..children[index] }, mine));
    }
    jobs.sort_by_key(|job| job.0);
    let parts: Vec<Part> = jobs
        .into_par_iter()
        .map(|(_, child, items)| {
            if child.count <= leaf_size {
                let mut part = Part::default();
                part.leaf(items);
                part
            } else {
                build_range(simd, items, child, leaf_size)
            }
        })
        .collect();
    let mut whole = Part::default();
    whole.nodes.reserve(1 + parts.iter().map(|part| part.nodes.len()).sum::<usize>());
    whole.leaves.reserve(parts.iter().map(|part| part.leaves.len()).sum());
    whole.nodes.push(Node::NONE);
    for (slot, (child, part)) in children.iter().zip(parts).enumerate() {
        put_box(&mut whole.nodes[0], slot, &child.span);
        let is_leaf = part.nodes.is_empty();
        let leaf = LEAF | whole.leaves.len() as u32;
        let node = whole.append(part);
        whole.nodes[0].children[slot] = if is_leaf { leaf } else { node };
    }
    whole
}

/// Builds a tree over boxes. `leaf_size` is at most [`LEAF_SIZE`].
pub(crate) fn build(simd: Simd, mut items: Vec<Item>, leaf_size: usize) -> Built {
    if items.is_empty() {
        return Built { tree: Tree::default(), leaves: Vec::new() };
    }
    let range = Range::measure(simd, &items, 0, items.len(), 0);
    let part = build_range(simd, &mut items, range, leaf_size);
    Built { tree: Tree { nodes: part.nodes, close: Vec::new() }, leaves: part.leaves }
}
