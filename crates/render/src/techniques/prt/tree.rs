//! Triangles, halved where that helps: which three vertices stand for a point, and with what weights.
//!
//! Every triangle of a scene is a root. Edges are split for all triangles that share them, by a new vertex in the
//! middle: three split edges make four triangles, one makes two, two make three; so no vertex ever hangs on an
//! unsplit edge, and what is interpolated is continuous. A point goes down from its root with its barycentric weights.
//! Cost: a few multiplications for each time its triangle was split.

use std::collections::HashMap;

/// Weights of the three corners of a triangle, of sum 1.
pub(super) type Weights = [f32; 3];

/// What [`Node::split`] is where nothing is split.
const LEAF: u32 = u32::MAX;
/// The kind of split of all three edges; 0, 1, 2 split the edge that starts at that corner.
const FOUR: u32 = 3;

/// A triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Node {
    pub(super) corners: [u32; 3],
    /// Four times the first child's number plus the kind of the split, or [`LEAF`].
    pub(super) split: u32,
}

impl Node {
    pub(super) fn leaf(corners: [u32; 3]) -> Self {
        Self { corners, split: LEAF }
    }

    /// Its children, if they and its corners are where they can be: after it, and among so many nodes and vertices.
    fn is_sound(&self, own: usize, nodes: usize, vertices: usize) -> bool {
        let children = if self.split & 3 == FOUR { 4 } else { 2 };
        let first = (self.split >> 2) as usize;
        self.corners.iter().all(|&corner| (corner as usize) < vertices)
            && (self.split == LEAF || (first > own && first + children <= nodes))
    }
}

/// Roots first, then what they were split into.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Tree {
    pub(super) nodes: Vec<Node>,
}

/// A triangle that is not split, where it lies in its root, and how well interpolation did there when last looked at.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leaf {
    pub(super) node: u32,
    pub(super) root: u32,
    pub(super) weights: [Weights; 3],
    pub(super) error: f32,
}

/// An edge, from the smaller vertex to the larger one.
pub(super) type Edge = (u32, u32);

pub(super) fn edge(a: u32, b: u32) -> Edge {
    (a.min(b), a.max(b))
}

impl Leaf {
    /// The roots themselves.
    pub(super) fn roots(count: usize) -> Vec<Leaf> {
        let weights = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        (0..count as u32).map(|n| Leaf { node: n, root: n, weights, error: f32::INFINITY }).collect()
    }

    /// The weights of its middle in its root.
    pub(super) fn middle(&self) -> Weights {
        let [a, b, c] = self.weights;
        [0, 1, 2].map(|i| (a[i] + b[i] + c[i]) / 3.0)
    }
}

impl Tree {
    /// Whether every number in it leads somewhere.
    pub(super) fn is_sound(&self, roots: usize, vertices: usize) -> bool {
        let count = self.nodes.len();
        // Children come after their parents, so that no walk is without end.
        roots <= count && self.nodes.iter().enumerate().all(|(n, node)| node.is_sound(n, count, vertices))
    }

    /// Where each vertex is: a root that it is in, and its weights there.
    pub(super) fn places(&self, roots: usize, vertices: usize) -> Vec<(u32, Weights)> {
        let mut places = vec![None; vertices];
        for leaf in Leaf::roots(roots) {
            let mut pending = vec![leaf];
            while let Some(leaf) = pending.pop() {
                let node = &self.nodes[leaf.node as usize];
                for (&corner, &weights) in node.corners.iter().zip(&leaf.weights) {
                    places[corner as usize].get_or_insert((leaf.root, weights));
                }
                // Backwards, so that they come off in order.
                pending.extend(self.children(&leaf).into_iter().rev());
            }
        }
        places.into_iter().map(|place| place.unwrap_or_default()).collect()
    }

    /// What a triangle was split into.
    fn children(&self, leaf: &Leaf) -> Vec<Leaf> {
        let node = &self.nodes[leaf.node as usize];
        if node.split == LEAF {
            return Vec::new();
        }
        let weights = children_weights(node.split & 3, &leaf.weights);
        let numbers = (node.split >> 2)..;
        numbers.zip(weights).map(|(node, weights)| Leaf { node, weights, ..*leaf }).collect()
    }

    /// The vertices around a point of a root, and their weights.
    #[inline]
    pub(super) fn locate(&self, root: u32, weights: Weights) -> ([u32; 3], Weights) {
        let mut node = &self.nodes[root as usize];
        let [mut a, mut b, mut c] = weights;
        while node.split != LEAF {
            let (first, kind) = (node.split >> 2, node.split & 3);
            let child;
            if kind == FOUR {
                (child, [a, b, c]) = if a >= 0.5 {
                    (0, [2.0 * a - 1.0, 2.0 * b, 2.0 * c])
                } else if b >= 0.5 {
                    (1, [2.0 * a, 2.0 * b - 1.0, 2.0 * c])
                } else if c >= 0.5 {
                    (2, [2.0 * a, 2.0 * b, 2.0 * c - 1.0])
                } else {
                    (3, [1.0 - 2.0 * c, 1.0 - 2.0 * a, 1.0 - 2.0 * b])
                };
            } else {
                let [from, to, opposite] = match kind {
                    0 => [a, b, c],
                    1 => [b, c, a],
                    _ => [c, a, b],
                };
                (child, [a, b, c]) = if from >= to {
                    (0, [from - to, 2.0 * to, opposite])
                } else {
                    (1, [2.0 * from, to - from, opposite])
                };
            }
            node = &self.nodes[(first + child) as usize];
        }
        (node.corners, [a, b, c])
    }

    /// Splits the chosen edges of the leaves. `middles` gives the vertex in the middle of each edge that is split.
    /// The error of what comes of a leaf is the largest of those measured on its split edges.
    pub(super) fn split(&mut self, leaves: &[Leaf], middles: &HashMap<Edge, (u32, f32)>) -> Vec<Leaf> {
        let mut result = Vec::with_capacity(leaves.len());
        for leaf in leaves {
            self.split_leaf(*leaf, middles, &mut result);
        }
        result
    }

    fn split_leaf(&mut self, leaf: Leaf, middles: &HashMap<Edge, (u32, f32)>, result: &mut Vec<Leaf>) {
        let [a, b, c] = self.nodes[leaf.node as usize].corners;
        let found = [edge(a, b), edge(b, c), edge(c, a)].map(|edge| middles.get(&edge).copied());
        let first = self.nodes.len() as u32;
        let (kind, error, corners) = match found {
            [None, None, None] => {
                result.push(leaf);
                return;
            }
            [Some(ab), Some(bc), Some(ca)] => {
                let (m, n, o) = (ab.0, bc.0, ca.0);
                (FOUR, ab.1.max(bc.1).max(ca.1), vec![[a, m, o], [m, b, n], [o, n, c], [m, n, o]])
            }
            _ => {
                let kind = found.iter().position(Option::is_some).unwrap_or(0);
                let (middle, error) = found[kind].unwrap_or((a, 0.0));
                let at = |i: usize| [a, b, c][(kind + i) % 3];
                (kind as u32, error, vec![[at(0), middle, at(2)], [middle, at(1), at(2)]])
            }
        };
        self.nodes[leaf.node as usize].split = first << 2 | kind;
        self.nodes.extend(corners.into_iter().map(Node::leaf));
        for child in self.children(&leaf) {
            self.split_leaf(Leaf { error, ..child }, middles, result);
        }
    }
}

fn half(p: Weights, q: Weights) -> Weights {
    [0, 1, 2].map(|i| 0.5 * (p[i] + q[i]))
}

/// The corners of the children of a split in the weights of the root.
fn children_weights(kind: u32, weights: &[Weights; 3]) -> Vec<[Weights; 3]> {
    let [a, b, c] = [0, 1, 2].map(|i| weights[if kind == FOUR { i } else { (kind as usize + i) % 3 }]);
    let (ab, bc, ca) = (half(a, b), half(b, c), half(c, a));
    if kind == FOUR {
        vec![[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    } else {
        vec![[a, ab, c], [ab, b, c]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Splits edges that a rule chooses, a few times; vertices get their weights in root 0 of a pair that shares an edge.
    fn split_tree() -> (Tree, Vec<[f32; 2]>, Vec<Leaf>) {
        // The unit square as two roots.
        let mut at = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let mut tree = Tree { nodes: vec![Node::leaf([0, 1, 2]), Node::leaf([0, 2, 3])] };
        let mut leaves = Leaf::roots(2);
        for round in 0..7u32 {
            let mut middles = HashMap::new();
            for leaf in &leaves {
                let c = tree.nodes[leaf.node as usize].corners;
                for k in 0..3 {
                    let e = edge(c[k], c[(k + 1) % 3]);
                    if !(e.0 * 7 + e.1 * 13 + round).is_multiple_of(3) && !middles.contains_key(&e) {
                        let (p, q): ([f32; 2], [f32; 2]) = (at[e.0 as usize], at[e.1 as usize]);
                        at.push([0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])]);
                        middles.insert(e, (at.len() as u32 - 1, round as f32));
                    }
                }
            }
            leaves = tree.split(&leaves, &middles);
        }
        (tree, at, leaves)
    }

    fn point(root: u32, w: Weights) -> [f32; 2] {
        if root == 0 { [w[1] + w[2], w[2]] } else { [w[1], w[1] + w[2]] }
    }

    #[test]
    fn weights_found_on_the_way_down_give_the_point_back() {
        let (tree, at, leaves) = split_tree();
        assert!(leaves.len() > 200 && tree.is_sound(2, at.len()));
        for root in 0..2 {
            for i in 0..=40 {
                for j in 0..=40 - i {
                    let weights = [i as f32 / 40.0, j as f32 / 40.0, (40 - i - j) as f32 / 40.0];
                    let (corners, found) = tree.locate(root, weights);
                    assert!(found.iter().all(|w| (-1e-4..=1.0001).contains(w)), "{found:?}");
                    let expected = point(root, weights);
                    for axis in 0..2 {
                        let sum: f32 =
                            corners.iter().zip(found).map(|(&c, w)| at[c as usize][axis] * w).sum();
                        assert!((sum - expected[axis]).abs() < 1e-5);
                    }
                }
            }
        }
    }

    #[test]
    fn nothing_jumps_at_the_edge_of_two_roots() {
        let (tree, at, _) = split_tree();
        // Any function of the vertices.
        let value = |(corners, weights): ([u32; 3], Weights)| -> f32 {
            corners
                .iter()
                .zip(weights)
                .map(|(&c, w)| w * (f32::from(at[c as usize][0] > 0.4) + (c % 5) as f32))
                .sum()
        };
        for i in 0..=1000 {
            let t = i as f32 / 1000.0;
            let (one, other) = (tree.locate(0, [1.0 - t, 0.0, t]), tree.locate(1, [1.0 - t, t, 0.0]));
            assert!((value(one) - value(other)).abs() < 1e-2, "{t}");
        }
    }

    #[test]
    fn the_places_of_vertices_are_where_they_were_made() {
        let (tree, at, _) = split_tree();
        for (place, expected) in tree.places(2, at.len()).into_iter().zip(at) {
            assert_eq!(point(place.0, place.1), expected);
        }
    }
}
