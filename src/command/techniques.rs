//! The settings of techniques: from the scene, from `--set` and from the technique's own words on the command line.

pub(crate) use halflight::job::TechniqueSpec;
use halflight::job::{self, Stage};
use halflight_render::techniques::Made;

use super::failure::Failure;

/// The technique with its settings.
pub(crate) fn create(spec: &TechniqueSpec, stage: &Stage) -> Result<Made, Failure> {
    Ok(job::create(spec, stage)?)
}
