//! What the fast field learns from when samples are given: the cells that each recorded ray passes.
//!
//! A sample (x, ω, φ) [002 eq. 11–13] says of each cell on the ray before φ that nothing is met there, and of the cell at φ
//! that the surface is; of one drawn sample the cell of the hit is taken and one other, each with a marched copy of the
//! ray. Only what the sample says is used: the mesh gives the cells, and nothing else.

use std::ops::ControlFlow;

use glam::Vec3;

use super::lines::{Free, Line};
use crate::fast::network::LocalSample;
use crate::grid::{Cells, Chord};
use crate::random::Random;
use crate::samples::FieldSample;
use crate::unit::{UnitSpace, unit_to_grid};

/// Samples that were drawn before, in the unit sphere.
#[derive(Debug)]
pub(crate) struct Recorded {
    samples: Vec<FieldSample>,
    /// What identifies them in a checkpoint.
    pub(crate) sum: u64,
    resolution: u32,
    margin: f32,
}

impl Recorded {
    /// `None` for no samples.
    pub(crate) fn new(samples: Vec<FieldSample>, resolution: u32, margin: f32) -> Option<Recorded> {
        let sum = FieldSample::sum(&samples);
        (!samples.is_empty()).then_some(Recorded { samples, sum, resolution, margin })
    }

    /// Adds what one sample says.
    pub(crate) fn draw(&self, cells: &Cells, random: &mut Random, to: &mut Vec<LocalSample>) {
        let sample = &self.samples[random.below(self.samples.len())];
        let origin = unit_to_grid(sample.origin, self.resolution);
        let hit = sample.distance * UnitSpace::cells_per_unit(self.resolution);
        let free = Free {
            from: 0.0,
            to: hit,
            from_hit: None,
            to_hit: sample.distance.is_finite().then_some(Vec3::ZERO),
        };
        let line = Line { origin, direction: sample.direction, free: &free, margin: self.margin };
        // Either of two cells that see the hit, and of the others each with the same chance.
        let (mut seeing, mut other): (Option<Chord>, Option<Chord>) = (None, None);
        let (mut seen, mut passed) = (0, 0);
        let mut keep = |kept: &mut Option<Chord>, count: &mut usize, chord: Chord| {
            *count += 1;
            if random.below(*count) == 0 {
                *kept = Some(chord);
            }
        };
        // As long as any ray within the cube of cells, and beyond it nothing is looked up.
        let most = 2.0 * self.resolution as f32 + origin.distance(Vec3::splat(self.resolution as f32));
        // Two cells beyond the hit, so that the cell that holds it is whole.
        let until = (hit + 2.0).min(most);
        let _: Option<()> = cells.walk(origin, sample.direction, 0.0, until, |chord| {
            if chord.enter - self.margin <= hit && hit <= chord.leave + self.margin {
                keep(&mut seeing, &mut seen, chord);
            } else if chord.enter < hit {
                keep(&mut other, &mut passed, chord);
            }
            ControlFlow::Continue(())
        });
        for chord in [seeing, other].iter().flatten() {
            line.add(chord, true, random, to);
        }
    }
}
