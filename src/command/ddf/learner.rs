//! What learns: the fast field or the seed's network, from a mesh or from samples.

use std::path::Path;
use std::sync::Arc;

use clap::ValueEnum;
use halflight_ddf::{
    DdfError, DirectedField, FastTrainer, FieldSample, SampleScheme, SeedOptions, SeedSchedule, SeedTrainer,
    TrainOptions, UnitSpace, draw_samples,
};
use halflight_shape::TriangleMesh;
use serde_json::{Value, json};

use super::super::failure::Failure;

/// Which network learns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum Network {
    /// Features in cells and a narrow network
    #[default]
    Fast,
    /// The network of the seed: 8 layers of 512, weight-normalised
    Seed,
}

/// The rates of the seed's network.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum Schedule {
    /// 0.001 falling to 0.00001, no dropout, half of each batch from samples that hit
    #[default]
    Ours,
    /// 0.0000001 throughout, dropout of a half
    Printed,
}

pub(super) enum Learner {
    Fast(Box<FastTrainer>),
    Seed { trainer: Box<SeedTrainer>, unit: UnitSpace, mesh: Arc<TriangleMesh> },
}

/// How a step went.
pub(super) struct Said {
    pub(super) sentence: String,
    pub(super) figures: Value,
}

impl Learner {
    /// Prepares to learn a mesh, from samples if they are given; the seed's network draws its own otherwise.
    pub(super) fn new(
        mesh: &TriangleMesh,
        samples: Option<Vec<FieldSample>>,
        network: Network,
        schedule: Schedule,
        options: TrainOptions,
    ) -> Result<Learner, DdfError> {
        if network == Network::Fast {
            let trainer = match samples {
                Some(samples) => FastTrainer::from_samples(mesh, samples, options),
                None => FastTrainer::new(mesh, options),
            };
            return Ok(Learner::Fast(Box::new(trainer?)));
        }
        mesh.validate()?;
        let unit = UnitSpace::of_mesh(mesh).ok_or(DdfError::NoSurface { triangles: mesh.triangles.len() })?;
        let unit_mesh = Arc::new(unit.mesh_to_unit(mesh));
        let samples = samples
            .unwrap_or_else(|| draw_samples(&unit_mesh, own_scheme(mesh.triangles.len()), options.seed));
        let schedule = match schedule {
            Schedule::Ours => SeedSchedule::Ours,
            Schedule::Printed => SeedSchedule::Printed,
        };
        let options = SeedOptions { schedule, seed: options.seed, ..SeedOptions::default() };
        let trainer = Box::new(SeedTrainer::new(samples, options)?);
        Ok(Learner::Seed { trainer, unit, mesh: unit_mesh })
    }

    pub(super) fn steps_done(&self) -> u64 {
        match self {
            Learner::Fast(trainer) => trainer.steps_done(),
            Learner::Seed { trainer, .. } => trainer.steps_done(),
        }
    }

    pub(super) fn unit_mesh(&self) -> &Arc<TriangleMesh> {
        match self {
            Learner::Fast(trainer) => trainer.unit_mesh(),
            Learner::Seed { mesh, .. } => mesh,
        }
    }

    pub(super) fn step(&mut self, progress: f32) -> Result<Said, DdfError> {
        match self {
            Learner::Fast(trainer) => {
                let report = trainer.step(progress)?;
                let (visibility, wrong) = (report.visibility_loss, report.wrong);
                let sentence = format!(
                    "visibility {visibility:.4} ({:.2} % wrong), distance {:.4} cells, slopes {:.3}",
                    100.0 * wrong,
                    report.distance_loss,
                    report.slope_loss,
                );
                let figures = json!({
                    "visibility_loss": visibility, "wrong": wrong, "distance_loss": report.distance_loss,
                    "slope_loss": report.slope_loss,
                });
                Ok(Said { sentence, figures })
            }
            Learner::Seed { trainer, .. } => {
                let loss = trainer.step(progress)?;
                Ok(Said { sentence: format!("clamp loss {loss:.4}"), figures: json!({ "clamp_loss": loss }) })
            }
        }
    }

    pub(super) fn field(&self) -> DirectedField {
        match self {
            Learner::Fast(trainer) => trainer.field(),
            Learner::Seed { trainer, unit, .. } => DirectedField::of_seed(trainer.network(), *unit),
        }
    }

    pub(super) fn resume(&mut self, path: &Path) -> Result<(), Failure> {
        match self {
            Learner::Fast(trainer) => Ok(trainer.resume(path)?),
            Learner::Seed { .. } => Err(no_checkpoints()),
        }
    }

    pub(super) fn save_checkpoint(&self, path: &Path) -> Result<(), Failure> {
        match self {
            Learner::Fast(trainer) => Ok(trainer.save_checkpoint(path)?),
            Learner::Seed { .. } => Err(no_checkpoints()),
        }
    }
}

/// The seed's network has none.
pub(super) fn no_checkpoints() -> Failure {
    Failure::usage("cannot keep checkpoints of `--network seed`: they are kept of the fast network only")
}

/// Surface samples that suit a mesh: about a million, fewer steps and directions where there are many faces.
fn own_scheme(triangles: usize) -> SampleScheme {
    let faces = (150_000 / triangles.max(1)).clamp(1, 500);
    let along = match triangles {
        ..200_000 => 4,
        200_000..1_000_000 => 2,
        _ => 1,
    };
    SampleScheme::Surface { faces, directions: along, marching: along }
}
