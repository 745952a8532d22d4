//! Photons in a tree of boxes, each about the kernels in it: which of them reach a point or meet a ray.
//!
//! Cut at the middle photon along the longest side until eight are left; those eight also tell how dense photons are about them.
//! Cost: 65,536 photons 25 ms on one core; a look-up a few boxes more than the kernels that it finds.

use std::f32::consts::PI;

use glam::Vec3;

use super::borders::Borders;
use super::flight::Landed;
use super::kernel::{Photon, Rule};

/// Photons of a leaf.
const LEAF: usize = 12;

#[derive(Clone, Copy, Debug)]
struct Node {
    low: Vec3,
    high: Vec3,
    /// Of the photons under it.
    begin: u32,
    end: u32,
    /// The second child; the first is the next node. 0 in leaves.
    second: u32,
}

/// Photons ready to be looked up.
#[derive(Debug, Default)]
pub(super) struct Tree {
    pub(super) photons: Vec<Photon>,
    nodes: Vec<Node>,
}

impl Tree {
    pub(super) fn new(mut landed: Vec<Landed>, rule: Rule, borders: Option<&Borders>) -> Self {
        let mut tree = Self { photons: Vec::with_capacity(landed.len()), nodes: Vec::new() };
        if !landed.is_empty() {
            let count = landed.len();
            tree.cut(&mut landed, 0, count, rule, borders);
        }
        tree
    }

    /// The node of some photons, and its box.
    fn cut(
        &mut self,
        all: &mut [Landed],
        begin: usize,
        end: usize,
        rule: Rule,
        borders: Option<&Borders>,
    ) -> [Vec3; 2] {
        let place = self.nodes.len();
        let nothing =
            Node { low: Vec3::ZERO, high: Vec3::ZERO, begin: begin as u32, end: end as u32, second: 0 };
        self.nodes.push(nothing);
        let part = &mut all[begin..end];
        let [low, high] = if part.len() <= LEAF {
            let density = match rule {
                Rule::Covariance { .. } => density(part),
                Rule::Fixed(_) => 1.0,
            };
            let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
            for landed in part {
                let photon = Photon::new(landed, density, rule, borders);
                (low, high) =
                    (low.min(photon.position - photon.extent), high.max(photon.position + photon.extent));
                self.photons.push(photon);
            }
            [low, high]
        } else {
            let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
            for landed in &*part {
                (low, high) = (low.min(landed.position), high.max(landed.position));
            }
            let sides = high - low;
            let axis = if sides.x >= sides.max_element() {
                0
            } else if sides.y >= sides.z {
                1
            } else {
                2
            };
            let half = part.len() / 2;
            part.select_nth_unstable_by(half, |a, b| {
                a.position[axis].total_cmp(&b.position[axis]).then(a.number.cmp(&b.number))
            });
            let first = self.cut(all, begin, begin + half, rule, borders);
            self.nodes[place].second = self.nodes.len() as u32;
            let second = self.cut(all, begin + half, end, rule, borders);
            [first[0].min(second[0]), first[1].max(second[1])]
        };
        (self.nodes[place].low, self.nodes[place].high) = (low, high);
        [low, high]
    }

    /// All photons whose kernels may reach a point, in the order of the tree.
    #[inline]
    pub(super) fn about(&self, point: Vec3, mut found: impl FnMut(&Photon)) {
        self.walk(
            |node| point.cmpge(node.low).all() && point.cmple(node.high).all(),
            |photon| {
                if photon.at(point) > 0.0 {
                    found(photon);
                }
            },
        );
    }

    /// All photons whose kernels a ray passes through in the intervals given, in order of distance: with the kernel's integral
    /// along them and two places that stand for them.
    #[inline]
    pub(super) fn beside(
        &self,
        origin: Vec3,
        direction: Vec3,
        within: &[[f32; 2]],
        mut found: impl FnMut(&Photon, f32, [f32; 2]),
    ) {
        let (Some([begin, _]), Some([_, end])) = (within.first(), within.last()) else { return };
        let inverse = direction.recip();
        self.walk(
            |node| {
                let (a, b) = ((node.low - origin) * inverse, (node.high - origin) * inverse);
                // min and max pass over NaN, of a ray within a side.
                let enter = a.min(b).max_element().max(*begin);
                let leave = a.max(b).min_element().min(*end);
                enter <= leave * 1.000_01
            },
            |photon| {
                if let Some((amount, places)) = photon.along(origin, direction, within) {
                    found(photon, amount, places);
                }
            },
        );
    }

    #[inline]
    fn walk(&self, enters: impl Fn(&Node) -> bool, mut photon: impl FnMut(&Photon)) {
        if self.nodes.is_empty() {
            return;
        }
        let mut stack = [0u32; 64];
        let (mut height, mut place) = (0, 0u32);
        loop {
            let node = &self.nodes[place as usize];
            if enters(node) {
                if node.second != 0 {
                    stack[height] = node.second;
                    height += 1;
                    place += 1;
                    continue;
                }
                self.photons[node.begin as usize..node.end as usize].iter().for_each(&mut photon);
            }
            if height == 0 {
                return;
            }
            height -= 1;
            place = stack[height];
        }
    }
}

/// Photons per square metre on surfaces, per cubic metre in media, from how they are spread: a square of side a has the variance
/// a²/12 along it.
fn density(part: &[Landed]) -> f32 {
    let n = part.len() as f32;
    let mean = part.iter().map(|p| p.position).sum::<Vec3>() / n;
    let normal = part.first().map_or(Vec3::ZERO, |p| p.normal);
    let mut m = glam::Mat3::ZERO;
    for landed in part {
        let d = landed.position - mean;
        m += glam::Mat3::from_cols(d * d.x, d * d.y, d * d.z) * (1.0 / n);
    }
    let size = if normal == Vec3::ZERO {
        (12.0f32).powf(1.5) * m.determinant().max(0.0).sqrt()
    } else {
        let (x, y) = normal.any_orthonormal_pair();
        let (xx, xy, yy) = (x.dot(m * x), x.dot(m * y), y.dot(m * y));
        // Few photons in a line do not tell how wide the line is: no less than an eighth of its length.
        let long = 0.5 * (xx + yy) + (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt();
        12.0 * (xx * yy - xy * xy).max(long * long / 64.0).sqrt()
    };
    // Few photons look nearer to each other than they are: one is lost for the mean.
    let corrected = (n - 1.0).max(0.5);
    let density = corrected / size.max(1e-12);
    if density.is_finite() { density.min(1e12) } else { 1.0 / PI }
}
