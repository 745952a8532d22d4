//! A hierarchy over a sphere set: from afar a few nodes stand for all spheres.
//!
//! Each node has a ball that bounds its spheres, and a *blocker*: one sphere that blocks as much as they do together.
//! Its cross-section is the mean area of the union of their shadows over 13 directions, so overlap is not counted twice:
//! π r² = ρ Σ π r_i², ρ ≤ 1 measured when the tree is built; its centre is Σ r_i² c_i / Σ r_i². Seen from d ≫ r both
//! cover the solid angle π r²/d². Posing keeps the tree and ρ and moves all balls bottom-up, in time linear in n.
//!
//! A cut takes each branch down to the first node whose bounding ball is seen under less than a given half-angle, or to
//! the sphere itself. For spheres spread over a distance L, the number of nodes grows with log n beyond what is near.
//!
//! Nodes lie in depth-first order with the index where their subtree ends, so a walk needs no stack: a node is
//! followed by its first child, and `end` leads past it.

use glam::{Vec2, Vec3};

use super::SphereSet;
use super::solid::for_each_union;

/// Rows on which the union of shadows is measured: a disk comes out within 0.3 %.
const ROWS: usize = 48;
/// A node with more spheres is measured by as many of its inner nodes.
const MOST_SHADOWS: usize = 64;

/// A hierarchy over a [`SphereSet`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SphereTree {
    /// In depth-first order; the first is the root. Empty for an empty set.
    pub nodes: Vec<SphereTreeNode>,
}

/// A node: what bounds its spheres, and what stands for them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphereTreeNode {
    /// Centre of the bounding ball.
    pub bound_center: Vec3,
    /// Its radius.
    pub bound_radius: f32,
    /// Centre of the blocker that stands for all spheres below.
    pub center: Vec3,
    /// Its radius.
    pub radius: f32,
    /// Index of the first node after this node and all below it.
    pub end: u32,
    /// The sphere, if the node is a leaf.
    pub sphere: Option<u32>,
    /// ρ: the union's shadow by the sum of the spheres' shadows.
    union_share: f32,
    /// Σ r_i² over the spheres below.
    square_sum: f32,
}

impl SphereTree {
    /// Builds the tree of a set by halving at the median along the axis of most spread.
    pub fn build(set: &SphereSet) -> Self {
        let mut tree = Self::default();
        let mut order: Vec<u32> = (0..set.len() as u32).collect();
        if !order.is_empty() {
            tree.add(set, &mut order);
            tree.pose(&set.centers, &set.radii);
            for node in (0..tree.nodes.len()).rev() {
                if tree.nodes[node].sphere.is_none() {
                    tree.nodes[node].union_share = tree.shadow_share(node);
                    tree.combine(node);
                }
            }
        }
        tree
    }

    fn add(&mut self, set: &SphereSet, order: &mut [u32]) {
        let index = self.nodes.len();
        let sphere = (order.len() == 1).then(|| order[0]);
        self.nodes.push(SphereTreeNode {
            bound_center: Vec3::ZERO,
            bound_radius: 0.0,
            center: Vec3::ZERO,
            radius: 0.0,
            end: 0,
            sphere,
            union_share: 1.0,
            square_sum: 0.0,
        });
        if sphere.is_none() {
            let center = |i: &u32| set.centers[*i as usize];
            let mean = order.iter().map(center).sum::<Vec3>() / order.len() as f32;
            let spread: Vec3 = order.iter().map(|i| (center(i) - mean).powf(2.0)).sum();
            let axis = spread.max_position();
            order.sort_by(|a, b| center(a)[axis].total_cmp(&center(b)[axis]).then(a.cmp(b)));
            let (left, right) = order.split_at_mut(order.len() / 2);
            self.add(set, left);
            self.add(set, right);
        }
        self.nodes[index].end = self.nodes.len() as u32;
    }

    /// Moves all nodes to spheres that have moved; as many as the tree was built over, in the same order.
    ///
    /// # Panics
    /// If there are fewer spheres than that.
    pub fn pose(&mut self, centers: &[Vec3], radii: &[f32]) {
        // Children stand behind their parents.
        for index in (0..self.nodes.len()).rev() {
            match self.nodes[index].sphere {
                Some(sphere) => {
                    let node = &mut self.nodes[index];
                    (node.center, node.radius) = (centers[sphere as usize], radii[sphere as usize]);
                    (node.bound_center, node.bound_radius) = (node.center, node.radius);
                    node.square_sum = node.radius * node.radius;
                }
                None => self.combine(index),
            }
        }
    }

    /// A node from its two children.
    fn combine(&mut self, index: usize) {
        let left = self.nodes[index + 1];
        let right = self.nodes[left.end as usize];
        let node = &mut self.nodes[index];
        (node.bound_center, node.bound_radius) =
            enclosing((left.bound_center, left.bound_radius), (right.bound_center, right.bound_radius));
        node.square_sum = left.square_sum + right.square_sum;
        let share = right.square_sum / node.square_sum.max(f32::MIN_POSITIVE);
        node.center = left.center.lerp(right.center, share);
        node.radius = (node.union_share * node.square_sum).sqrt();
    }

    /// Visits the blockers that stand for all spheres as seen from `point`: each is the first on its branch whose
    /// bounding ball is seen under a half-angle of at most asin(`sin_half_angle`), or a sphere. 0 visits all spheres.
    #[inline]
    pub fn cut(&self, point: Vec3, sin_half_angle: f32, visit: impl FnMut(&SphereTreeNode)) {
        self.cut_around(point, 0.0, sin_half_angle, visit);
    }

    /// [`SphereTree::cut`] for all points of a ball: what is visited is seen under no more from any of them.
    #[inline]
    pub fn cut_around(
        &self,
        middle: Vec3,
        radius: f32,
        sin_half_angle: f32,
        mut visit: impl FnMut(&SphereTreeNode),
    ) {
        let mut index = 0;
        while let Some(node) = self.nodes.get(index) {
            let nearest = (middle.distance(node.bound_center) - radius).max(0.0);
            if node.sphere.is_some() || node.bound_radius <= sin_half_angle * nearest {
                visit(node);
                index = node.end as usize;
            } else {
                index += 1;
            }
        }
    }

    /// The mean area of the union of shadows below a node by the sum of its spheres' shadows.
    fn shadow_share(&self, index: usize) -> f32 {
        let mut below = vec![index];
        // The largest inner node is opened until there are enough, or only spheres.
        while below.len() < MOST_SHADOWS {
            let opened =
                (0..below.len()).filter(|&i| self.nodes[below[i]].sphere.is_none()).max_by(|&a, &b| {
                    self.nodes[below[a]].bound_radius.total_cmp(&self.nodes[below[b]].bound_radius)
                });
            let Some(opened) = opened else { break };
            let left = below[opened] + 1;
            below[opened] = left;
            below.push(self.nodes[left].end as usize);
        }
        let balls: Vec<(Vec3, f32)> =
            below.iter().map(|&n| (self.nodes[n].center, self.nodes[n].radius)).collect();
        let mean = directions().map(|d| shadow(&balls, d)).sum::<f32>() / 13.0;
        let sum = std::f32::consts::PI * self.nodes[index].square_sum;
        if sum > 0.0 { (mean / sum).clamp(0.0, 1.0) } else { 1.0 }
    }
}

/// The smallest ball around two.
fn enclosing(a: (Vec3, f32), b: (Vec3, f32)) -> (Vec3, f32) {
    let distance = a.0.distance(b.0);
    if distance + b.1 <= a.1 {
        return a;
    }
    if distance + a.1 <= b.1 {
        return b;
    }
    let radius = 0.5 * (distance + a.1 + b.1);
    (a.0 + (b.0 - a.0) * ((radius - a.1) / distance), radius)
}

/// The directions to the neighbours in a cubic grid, one of each opposite pair.
fn directions() -> impl Iterator<Item = Vec3> {
    (14..27)
        .map(|i| Vec3::new((i % 3) as f32 - 1.0, (i / 3 % 3) as f32 - 1.0, (i / 9) as f32 - 1.0).normalize())
}

/// The area of the union of balls' shadows along a direction, by rows of chords.
fn shadow(balls: &[(Vec3, f32)], direction: Vec3) -> f32 {
    let (right, up) = direction.any_orthonormal_pair();
    let disks: Vec<(Vec2, f32)> =
        balls.iter().map(|(c, r)| (Vec2::new(c.dot(right), c.dot(up)), *r)).collect();
    let low = disks.iter().map(|(c, r)| c.y - r).fold(f32::INFINITY, f32::min);
    let high = disks.iter().map(|(c, r)| c.y + r).fold(f32::NEG_INFINITY, f32::max);
    let step = (high - low) / ROWS as f32;
    let mut area = 0.0;
    let mut chords = Vec::with_capacity(disks.len());
    for row in 0..ROWS {
        let y = low + (row as f32 + 0.5) * step;
        chords.clear();
        for (c, r) in &disks {
            let half = r * r - (c.y - y).powi(2);
            if half > 0.0 {
                chords.push((c.x - half.sqrt(), c.x + half.sqrt()));
            }
        }
        for_each_union(&mut chords, |from, to| area += (to - from) * step);
    }
    area
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A spiral of overlapping spheres.
    fn spiral(count: usize) -> SphereSet {
        let center = |i: usize| {
            let t = i as f32 * 0.1;
            Vec3::new(t.cos() * (1.0 + t), 0.3 * t, t.sin() * (1.0 + t))
        };
        SphereSet {
            centers: (0..count).map(center).collect(),
            radii: (0..count).map(|i| 0.2 + 0.1 * (i % 3) as f32).collect(),
            ..SphereSet::default()
        }
    }

    #[test]
    fn every_node_bounds_its_spheres_and_each_sphere_is_one_leaf() {
        let set = spiral(100);
        let tree = SphereTree::build(&set);
        assert_eq!(tree.nodes.len(), 199);
        let mut leaves = vec![0; 100];
        for (index, node) in tree.nodes.iter().enumerate() {
            if let Some(sphere) = node.sphere {
                leaves[sphere as usize] += 1;
            }
            for below in &tree.nodes[index..node.end as usize] {
                let reach = node.bound_center.distance(below.center)
                    + if below.sphere.is_some() { below.radius } else { 0.0 };
                assert!(reach <= node.bound_radius * 1.0001, "{index}");
            }
        }
        assert!(leaves.iter().all(|n| *n == 1));
        assert!(SphereTree::build(&SphereSet::default()).nodes.is_empty());
        assert_eq!(SphereTree::build(&spiral(1)).nodes.len(), 1);
    }

    #[test]
    fn cuts_take_every_sphere_once_and_fewer_nodes_from_afar() {
        let set = spiral(200);
        let tree = SphereTree::build(&set);
        let count = |point, sine| {
            let (mut nodes, mut spheres) = (0, 0);
            tree.cut(point, sine, |node| {
                nodes += 1;
                let index =
                    tree.nodes.iter().position(|n| std::ptr::eq(n, node)).expect("a node of the tree");
                spheres += tree.nodes[index..node.end as usize].iter().filter(|n| n.sphere.is_some()).count();
            });
            assert_eq!(spheres, 200);
            nodes
        };
        assert_eq!(count(Vec3::ZERO, 0.0), 200);
        let (near, far) = (count(Vec3::ZERO, 0.1), count(Vec3::splat(100.0), 0.1));
        assert!(near < 200 && far < near / 2, "{near} {far}");
        assert_eq!(count(Vec3::splat(1e4), 0.1), 1);
    }

    #[test]
    fn a_blocker_has_the_mean_shadow_of_its_spheres() {
        let apart = SphereSet {
            centers: vec![Vec3::ZERO, 9.0 * Vec3::ONE],
            radii: vec![1.0; 2],
            ..SphereSet::default()
        };
        // Along one of the 13 directions (the diagonal) one hides the other.
        let expected = (2.0f32 * 25.0 / 26.0).sqrt();
        assert!((SphereTree::build(&apart).nodes[0].radius - expected).abs() < 0.01);
        let same = SphereSet { centers: vec![Vec3::X; 5], radii: vec![2.0; 5], ..SphereSet::default() };
        let root = SphereTree::build(&same).nodes[0];
        assert!((root.radius - 2.0).abs() < 0.01 && root.center.distance(Vec3::X) < 1e-6, "{root:?}");
    }

    #[test]
    fn a_posed_tree_is_the_tree_of_the_posed_set() {
        let set = spiral(60);
        let transform = glam::Affine3A::from_scale_rotation_translation(
            Vec3::splat(3.0),
            glam::Quat::from_rotation_z(0.4),
            Vec3::new(1.0, 2.0, 3.0),
        );
        let moved = set.transformed(&transform);
        let mut tree = SphereTree::build(&set);
        let root = tree.nodes[0];
        tree.pose(&moved.centers, &moved.radii);
        assert!((tree.nodes[0].radius - 3.0 * root.radius).abs() < 1e-3);
        assert!(tree.nodes[0].center.distance(transform.transform_point3(root.center)) < 1e-3);
    }
}
