//! Light with visibility at points: what everything after it, of any material, is an integral of.
//!
//! For a point x the light that arrives, L·V_x, as harmonics: log-visibilities of the spheres are added, their sum is
//! exponentiated, multiplied by what each height field leaves visible, and by the light. Points are taken sixteen at a
//! time, in groups of neighbours that share the weights of ratio attenuation.

use glam::Vec3;
use halflight_sh::batch::{self, Lanes, PointLanes, SphereBlocker, WIDTH};
use halflight_sh::{BlockerTable, Exponential, Sh, Simd};

use super::blockers::Blockers;
use super::horizon::FieldVisibility;
use super::plate::Plate;
use super::settings::Composition;
use super::wedge::WedgeTable;
use crate::sh_light::{Colors, axes};

/// A point to be lit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Receiver {
    pub(crate) position: Vec3,
    /// Unit normal of the geometry, on the side that is lit.
    pub(crate) normal: Vec3,
    pub(crate) owner: f32,
    /// The instance that it lies on.
    pub(crate) instance: u32,
}

/// Tables for an order, made once.
pub(super) struct Tables<const ORDER: usize> {
    /// Log-visibility of a sphere by itself, and of one that fills a body with others.
    pub(super) single: BlockerTable<ORDER>,
    pub(super) body: BlockerTable<ORDER>,
    pub(super) wedges: WedgeTable<ORDER>,
}

/// What all points of a frame share.
pub(super) struct Solver<'a, const ORDER: usize> {
    pub(super) simd: Simd,
    pub(super) tables: &'a Tables<ORDER>,
    pub(super) blockers: &'a Blockers,
    pub(super) fields: &'a [FieldVisibility],
    pub(super) plates: &'a [Plate],
    pub(super) light: &'a Colors<ORDER>,
    pub(super) attenuation: bool,
    pub(super) composition: Composition,
    pub(super) exponential: Exponential,
    /// Sine of the half-angle under which a group of scattered spheres may be taken for one.
    pub(super) cut: f32,
}

/// Light and visibility apart, for lobes that are added as logarithms.
#[derive(Clone, Copy)]
pub(super) struct LogLight<const ORDER: usize> {
    /// Logarithm of what the spheres leave visible.
    pub(super) log: Sh<ORDER>,
    /// The light, without what height fields and plates hide.
    pub(super) lit: Colors<ORDER>,
}

impl<const ORDER: usize> Default for LogLight<ORDER> {
    fn default() -> Self {
        Self { log: Sh::zero(), lit: [Sh::zero(); 3] }
    }
}

/// ε of a field that is added as a logarithm: the best of those that verified mathematics §3 lists.
const FIELD_EPSILON: f32 = 0.2;

/// Room to work in, kept from group to group.
#[derive(Default)]
pub(super) struct Scratch<const ORDER: usize> {
    points: Vec<PointLanes>,
    spheres: Vec<SphereBlocker>,
    terms: Vec<Sh<ORDER, Lanes>>,
    logs: Vec<Sh<ORDER, Lanes>>,
    visible: Vec<Sh<ORDER, Lanes>>,
    other: Vec<Sh<ORDER, Lanes>>,
    next: Vec<Sh<ORDER, Lanes>>,
    /// What fields and plates together leave visible.
    open: Vec<Sh<ORDER, Lanes>>,
    /// What one height field leaves visible, point by point.
    seen: Vec<Sh<ORDER>>,
    multiplicities: Vec<f32>,
}

/// Vectors one after another into lanes.
fn spread<const ORDER: usize>(from: impl Iterator<Item = Sh<ORDER>>, to: &mut [Sh<ORDER, Lanes>]) {
    for (i, sh) in from.enumerate() {
        batch::set_lane(&mut to[i / WIDTH], i % WIDTH, &sh);
    }
}

impl<const ORDER: usize> Solver<'_, ORDER> {
    /// Leaves in `scratch` the logarithms of what spheres leave visible, and what all blockers leave visible; what fields
    /// and plates leave visible as well, if it is asked for.
    fn see(&self, receivers: &[Receiver], scratch: &mut Scratch<ORDER>, fields_apart: bool) {
        let blocks = receivers.len().div_ceil(WIDTH);
        self.pack(receivers, scratch);
        self.choose_spheres(receivers, scratch);
        for buffer in [&mut scratch.logs, &mut scratch.visible, &mut scratch.other, &mut scratch.next] {
            buffer.clear();
            buffer.resize(blocks, Sh::zero());
        }
        let Scratch { points, spheres, logs, visible, other, next, seen, open, .. } = scratch;
        batch::accumulate_spheres(self.simd, &self.tables.single, points, spheres, logs);
        batch::accumulate_spheres(self.simd, &self.tables.body, points, &self.blockers.bodies, logs);
        let primal = self.composition == Composition::Product;
        if !primal {
            for field in self.fields {
                self.past_field(field, receivers, seen);
                let log = |visible: &Sh<ORDER>| (Sh::one() - *visible) * FIELD_EPSILON.ln();
                spread(seen.iter().map(log), other);
                logs.iter_mut().zip(other.iter()).for_each(|(log, field)| *log += *field);
            }
        }
        batch::exponential(self.simd, self.exponential, logs, visible);
        open.clear();
        if fields_apart {
            open.resize(blocks, Sh::<ORDER>::one().map(Lanes::splat));
        }
        let multiply = |by: &[Sh<ORDER, Lanes>],
                        visible: &mut Vec<Sh<ORDER, Lanes>>,
                        next: &mut Vec<Sh<ORDER, Lanes>>| {
            batch::product(self.simd, visible, by, next);
            std::mem::swap(visible, next);
        };
        for field in self.fields.iter().filter(|_| primal) {
            self.past_field(field, receivers, seen);
            spread(seen.iter().copied(), other);
            multiply(other, visible, next);
            if !open.is_empty() {
                multiply(other, open, next);
            }
        }
        for plate in self.plates {
            let past = receivers.iter().map(|receiver| {
                if receiver.instance == plate.instance {
                    return Sh::one();
                }
                plate.visible(self.simd, &self.tables.wedges, receiver.position)
            });
            spread(past, other);
            multiply(other, visible, next);
            if !open.is_empty() {
                multiply(other, open, next);
            }
        }
    }

    /// What is visible from each of a group of neighbouring points; `out` has a place for each.
    pub(super) fn visible(
        &self,
        receivers: &[Receiver],
        scratch: &mut Scratch<ORDER>,
        out: &mut [Sh<ORDER>],
    ) {
        if receivers.is_empty() {
            return;
        }
        self.see(receivers, scratch, false);
        for (i, out) in out.iter_mut().enumerate() {
            *out = batch::lane(&scratch.visible[i / WIDTH], i % WIDTH);
        }
    }

    /// L·V at each of a group of neighbouring points, and the two apart where `apart` has places for them; `out` has a place
    /// for each point.
    pub(super) fn solve(
        &self,
        receivers: &[Receiver],
        scratch: &mut Scratch<ORDER>,
        out: &mut [Colors<ORDER>],
        apart: Option<&mut [LogLight<ORDER>]>,
    ) {
        if receivers.is_empty() {
            return;
        }
        self.see(receivers, scratch, apart.is_some());
        let Scratch { logs, visible, other, next, open, .. } = scratch;
        for (color, light) in self.light.iter().enumerate() {
            other.fill(light.map(Lanes::splat));
            batch::product(self.simd, visible, other, next);
            for (i, out) in out.iter_mut().enumerate() {
                out[color] = batch::lane(&next[i / WIDTH], i % WIDTH);
            }
        }
        let Some(apart) = apart else { return };
        for (i, apart) in apart.iter_mut().enumerate() {
            apart.log = batch::lane(&logs[i / WIDTH], i % WIDTH);
        }
        for (color, light) in self.light.iter().enumerate() {
            other.fill(light.map(Lanes::splat));
            batch::product(self.simd, open, other, next);
            for (i, apart) in apart.iter_mut().enumerate() {
                apart.lit[color] = batch::lane(&next[i / WIDTH], i % WIDTH);
            }
        }
    }

    /// What a field leaves visible, point by point.
    fn past_field(&self, field: &FieldVisibility, receivers: &[Receiver], seen: &mut Vec<Sh<ORDER>>) {
        let positions = receivers.iter().map(|receiver| receiver.position);
        field.visible(self.simd, &self.tables.wedges, positions, seen);
        for (receiver, seen) in receivers.iter().zip(seen) {
            if field.is_below(receiver.instance, receiver.normal) {
                *seen = Sh::one();
            }
        }
    }

    /// The scattered spheres, or what stands for groups of them, with their weights for a group of points.
    fn choose_spheres(&self, receivers: &[Receiver], scratch: &mut Scratch<ORDER>) {
        let middle = receivers.iter().map(|r| r.position).sum::<Vec3>() / receivers.len() as f32;
        let around = receivers.iter().map(|r| r.position.distance(middle)).fold(0.0, f32::max);
        let Scratch { spheres, multiplicities, terms, .. } = scratch;
        spheres.clear();
        for group in &self.blockers.groups {
            let first = spheres.len();
            multiplicities.clear();
            group.choose((middle, around), self.cut, spheres, multiplicities);
            if self.attenuation {
                let chosen = &mut spheres[first..];
                batch::attenuate_spheres(self.simd, axes(middle), chosen, multiplicities, terms);
            }
        }
    }

    /// The points as lanes; the last block is filled up with its last point.
    fn pack(&self, receivers: &[Receiver], scratch: &mut Scratch<ORDER>) {
        scratch.points.clear();
        for chunk in receivers.chunks(WIDTH) {
            let mut points = PointLanes::default();
            for lane in 0..WIDTH {
                let receiver = chunk[lane.min(chunk.len() - 1)];
                let (position, normal) = (axes(receiver.position), axes(receiver.normal));
                for axis in 0..3 {
                    points.position[axis].0[lane] = position[axis];
                    points.normal[axis].0[lane] = normal[axis];
                }
                points.owner.0[lane] = receiver.owner;
            }
            scratch.points.push(points);
        }
    }
}
