//! Training of the fast field.
//!
//! A step draws lines ([`lines`]), splits them over a fixed number of lanes with a gradient of their own, adds the lanes
//! in order, and lets Adam move what was seen. What a lane does depends on (seed, step, lane) only, so that results do
//! not depend on the number of threads.

pub(crate) mod adam;
mod checkpoint;
pub(crate) mod lines;
mod recorded;

use std::sync::Arc;

use halflight_shape::TriangleMesh;
use halflight_trace::{Kernel, Simd};
use rayon::prelude::*;

use crate::error::DdfError;
use crate::fast::field::FastField;
use crate::fast::network::{LocalSample, Loss, Parameters, TILE, Tile, transpose};
use crate::fast::shape::FastShape;
use crate::field::DirectedField;
use crate::grid::{Cells, Level};
use crate::random::Random;
use crate::samples::FieldSample;
use crate::unit::UnitSpace;
use adam::{Adam, Rate};
use lines::LineSampler;
use recorded::Recorded;

/// Gradients that are held side by side. Fixed, because the order of sums must not depend on threads.
const LANES: usize = 4;
/// Meshes of more triangles than this are refused: indices of the ray tracer end here.
const MOST_TRIANGLES: usize = 1 << 27;

/// How the fast field is trained.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct TrainOptions {
    /// The sizes of the field.
    pub shape: FastShape,
    /// All random numbers derive from it.
    pub seed: u64,
    /// Lines that are drawn for a step; each gives up to four samples.
    pub lines_per_step: usize,
    /// Largest learning rate of the features.
    pub feature_rate: f32,
    /// Largest learning rate of the network.
    pub network_rate: f32,
    /// Weight of the error of distance, in cells, against the cross-entropy of visibility.
    pub distance_weight: f32,
    /// Weight of the error of the distance's slope, which normals are made of; 0 leaves it out.
    pub slope_weight: f32,
}

impl Default for TrainOptions {
    fn default() -> Self {
        TrainOptions {
            shape: FastShape::default(),
            seed: 1,
            lines_per_step: 2048,
            feature_rate: 3e-2,
            network_rate: 1e-2,
            distance_weight: 4.0,
            slope_weight: 2.0,
        }
    }
}

/// How a step went, averaged over its samples.
#[derive(Clone, Copy, Debug, Default)]
pub struct StepReport {
    /// Samples that the step saw.
    pub samples: u64,
    /// Binary cross-entropy of visibility.
    pub visibility_loss: f64,
    /// Part of the samples whose visibility was wrong.
    pub wrong: f64,
    /// Mean error of distance across the surface, in cells.
    pub distance_loss: f64,
    /// Mean error of the distance's slope across the surface.
    pub slope_loss: f64,
}

/// Learns a field from a mesh, step by step.
pub struct FastTrainer {
    options: TrainOptions,
    unit: UnitSpace,
    mesh: Arc<TriangleMesh>,
    cells: Cells,
    levels: Vec<Level>,
    sampler: LineSampler,
    /// Samples that take the place of lines, if any were given.
    recorded: Option<Recorded>,
    parameters: Parameters,
    moments: Vec<Adam>,
    transposed: Vec<f32>,
    lanes: Vec<Lane>,
    step: u64,
    simd: Simd,
    arch: pulp::Arch,
}

struct Lane {
    gradient: Parameters,
    tile: Tile,
    samples: Vec<LocalSample>,
}

impl std::fmt::Debug for FastTrainer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("FastTrainer").field("options", &self.options).field("step", &self.step).finish()
    }
}

impl FastTrainer {
    /// Prepares to learn a mesh.
    ///
    /// # Errors
    /// If the mesh is broken or has no surface, or an option is out of range.
    pub fn new(mesh: &TriangleMesh, options: TrainOptions) -> Result<FastTrainer, DdfError> {
        options.shape.check().map_err(DdfError::Setting)?;
        if options.lines_per_step == 0 || options.lines_per_step > 1 << 24 {
            return Err(DdfError::Setting("`lines_per_step` must be from 1 to 16777216".into()));
        }
        if mesh.triangles.len() > MOST_TRIANGLES {
            return Err(DdfError::TooLarge { triangles: mesh.triangles.len(), most: MOST_TRIANGLES });
        }
        mesh.validate()?;
        let none = || DdfError::NoSurface { triangles: mesh.triangles.len() };
        let unit = UnitSpace::of_mesh(mesh).ok_or_else(none)?;
        unit.check().map_err(DdfError::Setting)?;
        let shape = &options.shape;
        let in_grid = Arc::new(unit.mesh_to_grid(mesh, shape.resolution));
        let cells = Cells::of_mesh(&in_grid, shape.resolution);
        let levels: Vec<Level> = shape.levels.iter().map(|&shift| Level::new(&cells, shift)).collect();
        let sampler = LineSampler::new(in_grid, shape.margin).ok_or_else(none)?;
        let parameters = initial(shape, &levels, options.seed);
        let counts = parameters.tables.iter().map(Vec::len).chain([parameters.network.len()]);
        let moments = counts.map(Adam::new).collect();
        let lanes = (0..LANES)
            .map(|_| Lane {
                gradient: Parameters::zeros(shape, &levels),
                tile: Tile::new(shape),
                samples: Vec::new(),
            })
            .collect();
        let mesh = Arc::new(unit.mesh_to_unit(mesh));
        Ok(FastTrainer {
            options,
            unit,
            mesh,
            cells,
            levels,
            sampler,
            recorded: None,
            parameters,
            moments,
            transposed: Vec::new(),
            lanes,
            step: 0,
            simd: Simd::detect(),
            arch: pulp::Arch::new(),
        })
    }

    /// Prepares to learn from samples of a mesh, given in its unit sphere, instead of lines that are cast against it.
    ///
    /// # Errors
    /// As [`FastTrainer::new`], and if there are no samples.
    pub fn from_samples(
        mesh: &TriangleMesh,
        samples: Vec<FieldSample>,
        options: TrainOptions,
    ) -> Result<FastTrainer, DdfError> {
        let mut trainer = FastTrainer::new(mesh, options)?;
        let shape = &trainer.options.shape;
        let recorded = Recorded::new(samples, shape.resolution, shape.margin);
        trainer.recorded =
            Some(recorded.ok_or_else(|| DdfError::Setting("there are no samples to learn from".into()))?);
        Ok(trainer)
    }

    /// What it was made with.
    #[must_use]
    pub fn options(&self) -> &TrainOptions {
        &self.options
    }

    /// Steps done.
    #[must_use]
    pub fn steps_done(&self) -> u64 {
        self.step
    }

    /// The mesh in the unit sphere.
    #[must_use]
    pub fn unit_mesh(&self) -> &Arc<TriangleMesh> {
        &self.mesh
    }

    /// One step. `progress` is how much of the training is done, 0 to 1: rates fall along half a cosine to 1/50.
    ///
    /// # Errors
    /// If the numbers went out of range.
    pub fn step(&mut self, progress: f32) -> Result<StepReport, DdfError> {
        self.step += 1;
        transpose(&self.options.shape, &self.parameters.network, &mut self.transposed);
        let shared = Shared {
            options: &self.options,
            cells: &self.cells,
            levels: &self.levels,
            sampler: &self.sampler,
            recorded: self.recorded.as_ref(),
            parameters: &self.parameters,
            transposed: &self.transposed,
            step: self.step,
        };
        let arch = self.arch;
        let losses: Vec<Loss> = self
            .lanes
            .par_iter_mut()
            .enumerate()
            .map(|(number, lane)| {
                shared.draw(number, lane);
                arch.dispatch(Learn { shared: &shared, lane })
            })
            .collect();
        let mut loss = Loss::default();
        losses.into_iter().for_each(|part| loss += part);
        self.update(progress);
        if !loss.visibility.is_finite() || !loss.distance.is_finite() {
            return Err(DdfError::Diverged { step: self.step });
        }
        let mean = |sum: f64, count: f64| if count > 0.0 { sum / count } else { 0.0 };
        Ok(StepReport {
            samples: loss.samples as u64,
            visibility_loss: mean(loss.visibility, loss.samples),
            wrong: mean(loss.wrong, loss.samples),
            distance_loss: mean(loss.distance, loss.hits),
            slope_loss: mean(loss.slope, loss.slopes),
        })
    }

    fn update(&mut self, progress: f32) {
        let progress = progress.clamp(0.0, 1.0);
        let fall = 0.02 + 0.98 * 0.5 * (1.0 + (std::f32::consts::PI * progress).cos());
        let tables = self.parameters.tables.len();
        let simd = self.simd;
        for number in 0..=tables {
            let (base, parameters) = if number < tables {
                (self.options.feature_rate, &mut self.parameters.tables[number])
            } else {
                (self.options.network_rate, &mut self.parameters.network)
            };
            let rate = Rate::new(base * fall, self.step);
            let adam = &mut self.moments[number];
            let mut gradients = self.lanes.iter_mut().map(|lane| {
                if number < tables { &mut lane.gradient.tables[number] } else { &mut lane.gradient.network }
            });
            let [Some(a), Some(b), Some(c), Some(d)] =
                [gradients.next(), gradients.next(), gradients.next(), gradients.next()]
            else {
                return;
            };
            /// Parameters that are updated together: enough to outweigh handing them out.
            const PIECE: usize = 1 << 14;
            (
                parameters.par_chunks_mut(PIECE),
                adam.first.par_chunks_mut(PIECE),
                adam.second.par_chunks_mut(PIECE),
                a.par_chunks_mut(PIECE),
                b.par_chunks_mut(PIECE),
                c.par_chunks_mut(PIECE),
                d.par_chunks_mut(PIECE),
            )
                .into_par_iter()
                .for_each(|(w, m, v, a, b, c, d)| simd.run(Update { rate, w, m, v, lanes: [a, b, c, d] }));
        }
    }

    /// The field as it is now.
    #[must_use]
    pub fn field(&self) -> DirectedField {
        let mut fast = FastField::rounded(&self.options.shape, &self.cells, &self.parameters);
        // Samples know distances, not normals.
        fast.sides = self.recorded.is_none();
        DirectedField::new(fast, self.unit)
    }
}

fn initial(shape: &FastShape, levels: &[Level], seed: u64) -> Parameters {
    let mut parameters = Parameters::zeros(shape, levels);
    // Features: small, yet large enough that the network sees cells apart from the first step on.
    for (number, table) in parameters.tables.iter_mut().enumerate() {
        let mut random = Random::new(seed, 0, number as u64);
        table.iter_mut().for_each(|v| *v = 0.1 * random.normal());
    }
    // Weights: He et al. 2015, variance 2/inputs.
    let mut random = Random::new(seed, 0, u64::MAX);
    let mut at = 0;
    for (number, (rows, columns)) in shape.layer_sizes().into_iter().enumerate() {
        let inputs = if number == 0 { shape.used_inputs() } else { rows };
        let deviation = (2.0 / inputs as f32).sqrt();
        for w in &mut parameters.network[at..at + rows * columns] {
            *w = deviation * random.normal();
        }
        at += (rows + 1) * columns;
    }
    parameters
}

struct Shared<'a> {
    options: &'a TrainOptions,
    cells: &'a Cells,
    levels: &'a [Level],
    sampler: &'a LineSampler,
    recorded: Option<&'a Recorded>,
    parameters: &'a Parameters,
    transposed: &'a [f32],
    step: u64,
}

impl Shared<'_> {
    fn draw(&self, number: usize, lane: &mut Lane) {
        lane.samples.clear();
        let lines = self.options.lines_per_step;
        for line in (lines * number / LANES)..(lines * (number + 1) / LANES) {
            let mut random = Random::new(self.options.seed, self.step, line as u64);
            match self.recorded {
                Some(recorded) => recorded.draw(self.cells, &mut random, &mut lane.samples),
                None => self.sampler.draw(self.cells, &mut random, &mut lane.samples),
            }
        }
    }
}

struct Learn<'a> {
    shared: &'a Shared<'a>,
    lane: &'a mut Lane,
}

impl pulp::WithSimd for Learn<'_> {
    type Output = Loss;
    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) -> Loss {
        match (S::F32_LANES > 1, self.shared.options.shape.features) {
            (false, 4) => self.all::<S, false, 4>(simd),
            (false, _) => self.all::<S, false, 8>(simd),
            (true, 4) => self.all::<S, true, 4>(simd),
            (true, _) => self.all::<S, true, 8>(simd),
        }
    }
}

impl Learn<'_> {
    #[inline(always)]
    fn all<S: pulp::Simd, const FUSED: bool, const F: usize>(self, simd: S) -> Loss {
        let Shared { options, levels, parameters, transposed, .. } = *self.shared;
        let mut loss = Loss::default();
        let Lane { gradient, tile, samples } = self.lane;
        for part in samples.chunks(TILE) {
            loss += tile.learn::<S, FUSED, F>(
                simd,
                &options.shape,
                levels,
                parameters,
                transposed,
                part,
                [options.distance_weight, options.slope_weight],
                gradient,
            );
        }
        loss
    }
}

struct Update<'a> {
    rate: Rate,
    w: &'a mut [f32],
    m: &'a mut [f32],
    v: &'a mut [f32],
    lanes: [&'a mut [f32]; LANES],
}

impl Kernel for Update<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let [a, b, c, d] = self.lanes;
        let count = self.w.len();
        let (m, v) = (&mut self.m[..count], &mut self.v[..count]);
        let (a, b, c, d) = (&mut a[..count], &mut b[..count], &mut c[..count], &mut d[..count]);
        for i in 0..count {
            let g = (a[i] + b[i]) + (c[i] + d[i]);
            (a[i], b[i], c[i], d[i]) = (0.0, 0.0, 0.0, 0.0);
            self.rate.apply(&mut self.w[i], &mut m[i], &mut v[i], g);
        }
    }
}
