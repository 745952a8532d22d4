//! What spheres, height fields and plates leave visible from points, for techniques that shade by samples: soft shadows
//! without shadow rays.

use std::sync::Arc;

use halflight_scene::{Frame, Scene};
use halflight_sh::Sh;

use super::blockers::{Blockers, Bodies};
use super::horizon::FieldVisibility;
use super::plate::Plate;
use super::solve::{Receiver, Scratch, Solver, Tables};
use super::{Prepared, ShexpSettings, fields, plates};
use crate::sh_light::simd;
use crate::technique::{Progress, TechniqueError};

/// Bands of the visibility.
pub(crate) const ORDER: usize = 4;

/// What outlives a frame.
pub(crate) struct Openness {
    settings: ShexpSettings,
    bodies: Bodies,
    tables: Arc<Tables<ORDER>>,
}

/// All that blocks light in one frame.
pub(crate) struct FrameOpenness<'a> {
    known: &'a Openness,
    simd: halflight_sh::Simd,
    blockers: Blockers,
    fields: Vec<FieldVisibility>,
    plates: Vec<Plate>,
}

/// Memory to work in, kept by each thread.
#[derive(Default)]
pub(crate) struct OpennessRoom(Scratch<ORDER>);

impl Openness {
    /// Fits spheres to the meshes of a scene, or takes those that are stored beside them, as `shexp` does by default.
    pub(crate) fn learn(scene: &Scene, progress: &dyn Progress) -> Result<Self, TechniqueError> {
        let settings = ShexpSettings::default();
        let bodies = super::learn(scene, &settings, progress)?;
        let tables = Prepared::default().tables(&settings);
        Ok(Self { settings, bodies, tables })
    }

    /// The blockers where they are in a frame.
    pub(crate) fn of(&self, frame: &Frame) -> FrameOpenness<'_> {
        FrameOpenness {
            known: self,
            simd: simd(frame.world.simd()),
            blockers: self.bodies.pose(frame, self.settings.attenuation),
            fields: fields(frame),
            plates: plates(frame),
        }
    }

    /// What the spheres do not tell.
    pub(crate) fn notes(&self) -> &[String] {
        &self.bodies.notes
    }
}

impl FrameOpenness<'_> {
    /// The body that a primitive of an instance belongs to, as [`Receiver::owner`] has it.
    pub(crate) fn owner(&self, instance: u32, primitive: u32) -> f32 {
        self.blockers.owner(instance, primitive)
    }

    /// The visibility at each of a group of neighbouring points, in the frame of [`crate::sh_light::axes`]; `out` has a
    /// place for each. Some microseconds for each sixteen points.
    pub(crate) fn visible(&self, receivers: &[Receiver], room: &mut OpennessRoom, out: &mut [Sh<ORDER>]) {
        let settings = &self.known.settings;
        let solver = Solver {
            simd: self.simd,
            tables: &self.known.tables,
            blockers: &self.blockers,
            fields: &self.fields,
            plates: &self.plates,
            // Only visibility is asked for.
            light: &[Sh::zero(); 3],
            attenuation: settings.attenuation,
            composition: settings.composition,
            exponential: settings.exponential(),
            cut: settings.cut_degrees.to_radians().sin(),
        };
        solver.visible(receivers, &mut room.0, out);
    }
}
