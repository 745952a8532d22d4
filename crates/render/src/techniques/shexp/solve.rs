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
use super::wedge::WedgeTable;
use crate::sh_light::{Colors, axes};

/// A point to be lit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Receiver {
    pub(super) position: Vec3,
    /// Unit normal of the geometry, on the side that is lit.
    pub(super) normal: Vec3,
    pub(super) owner: f32,
    /// The instance that it lies on.
    pub(super) instance: u32,
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
}

/// Room to work in, kept from group to group.
#[derive(Default)]
pub(super) struct Scratch<const ORDER: usize> {
    points: Vec<PointLanes>,
    spheres: Vec<SphereBlocker>,
    terms: Vec<Sh<ORDER, Lanes>>,
    logs: Vec<Sh<ORDER, Lanes>>,
    visible: Vec<Sh<ORDER, Lanes>>,
    other: Vec<Sh<ORDER, Lanes>>,
    /// What one height field leaves visible, point by point.
    seen: Vec<Sh<ORDER>>,
}

impl<const ORDER: usize> Solver<'_, ORDER> {
    /// L·V at each of a group of neighbouring points; `out` has a place for each.
    pub(super) fn solve(
        &self,
        receivers: &[Receiver],
        scratch: &mut Scratch<ORDER>,
        out: &mut [Colors<ORDER>],
    ) {
        if receivers.is_empty() {
            return;
        }
        let blocks = receivers.len().div_ceil(WIDTH);
        self.pack(receivers, scratch);
        let middle = receivers.iter().map(|r| r.position).sum::<Vec3>() / receivers.len() as f32;
        scratch.spheres.clear();
        scratch.spheres.extend_from_slice(&self.blockers.scattered);
        if self.attenuation {
            let Scratch { spheres, terms, .. } = scratch;
            for range in &self.blockers.groups {
                let multiplicities = &self.blockers.multiplicities[range.clone()];
                batch::attenuate_spheres(
                    self.simd,
                    axes(middle),
                    &mut spheres[range.clone()],
                    multiplicities,
                    terms,
                );
            }
        }
        for buffer in [&mut scratch.logs, &mut scratch.visible, &mut scratch.other] {
            buffer.clear();
            buffer.resize(blocks, Sh::zero());
        }
        let Scratch { points, spheres, logs, visible, other, seen, .. } = scratch;
        batch::accumulate_spheres(self.simd, &self.tables.single, points, spheres, logs);
        batch::accumulate_spheres(self.simd, &self.tables.body, points, &self.blockers.bodies, logs);
        batch::exponential(self.simd, Exponential::default(), logs, visible);
        for field in self.fields {
            let positions = receivers.iter().map(|receiver| receiver.position);
            field.visible(self.simd, &self.tables.wedges, positions, seen);
            for (i, visible) in seen.iter().enumerate() {
                batch::set_lane(&mut other[i / WIDTH], i % WIDTH, visible);
            }
            batch::product(self.simd, visible, other, logs);
            std::mem::swap(visible, logs);
        }
        for plate in self.plates {
            for (i, receiver) in receivers.iter().enumerate() {
                let on_it = receiver.instance == plate.instance;
                let open = || plate.visible(self.simd, &self.tables.wedges, receiver.position);
                batch::set_lane(&mut other[i / WIDTH], i % WIDTH, &if on_it { Sh::one() } else { open() });
            }
            batch::product(self.simd, visible, other, logs);
            std::mem::swap(visible, logs);
        }
        for (color, light) in self.light.iter().enumerate() {
            other.fill(light.map(Lanes::splat));
            batch::product(self.simd, visible, other, logs);
            for (i, out) in out.iter_mut().enumerate() {
                out[color] = batch::lane(&logs[i / WIDTH], i % WIDTH);
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
