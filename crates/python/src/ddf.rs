//! Fields of directed distances: trained, asked many rays at a time, measured.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::Vec3;
use halflight::Progress;
use halflight::ddf::{
    DirectedField, FastShape, FastTrainer, Provenance, RayErrors, StepReport, TrainOptions, evaluate,
    mesh_hash,
};
use halflight::shape::TriangleMesh;
use numpy::PyReadonlyArray2;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;

use crate::arrays::{Row, Table, row, rows3, vectors};
use crate::errors::{failed, usage};
use crate::meshes::NativeMesh;
use crate::work::{Watch, ended, watched};

/// Between two checkpoints.
const CHECKPOINT_INTERVAL: Duration = Duration::from_secs(30);
/// Points and rays by which a trained field is measured.
const POINTS: usize = 30_000;

pub(crate) fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<NativeField>()?;
    module.add_function(wrap_pyfunction!(ddf_train, module)?)
}

/// A learned field.
#[pyclass(frozen, module = "halflight._native", name = "Field")]
struct NativeField {
    field: DirectedField,
}

#[pymethods]
impl NativeField {
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        Ok(Self { field: py.detach(|| DirectedField::load(&path)).map_err(failed)? })
    }

    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| self.field.save(&path)).map_err(failed)
    }

    #[getter]
    fn parameters(&self) -> usize {
        self.field.parameters()
    }

    #[getter]
    fn memory_bytes(&self) -> usize {
        self.field.memory_bytes()
    }

    #[getter]
    fn bounds(&self) -> ([f32; 3], [f32; 3]) {
        let (low, high) = self.field.bounds();
        (low.to_array(), high.to_array())
    }

    #[getter]
    fn steps(&self) -> u64 {
        self.field.provenance.steps
    }

    /// Distances along rays, infinite where nothing is met, and unit normals there, zero where nothing is met.
    fn query<'py>(
        &self,
        py: Python<'py>,
        origins: PyReadonlyArray2<'py, f32>,
        directions: PyReadonlyArray2<'py, f32>,
    ) -> PyResult<(Row<'py, f32>, Table<'py, f32>)> {
        let (origins, directions) = (vectors(&origins)?, vectors(&directions)?);
        let (distances, normals): (Vec<f32>, Vec<Vec3>) = py.detach(|| {
            let one = |(&x, &omega): (&Vec3, &Vec3)| match self.field.query(x, omega, f32::INFINITY) {
                Some(hit) => (hit.distance, self.field.normal(x, omega, &hit)),
                None => (f32::INFINITY, Vec3::ZERO),
            };
            origins.par_iter().zip(&directions).with_min_len(256).map(one).unzip()
        });
        Ok((row(py, distances), rows3(py, normals)?))
    }

    /// How far it is from a mesh.
    fn evaluate<'py>(
        &self,
        py: Python<'py>,
        mesh: &Bound<'py, NativeMesh>,
        points: usize,
    ) -> PyResult<Bound<'py, PyDict>> {
        let mesh = &mesh.get().mesh;
        let found = py.detach(|| {
            let unit = Arc::new(self.field.unit().mesh_to_unit(mesh));
            evaluate(&self.field, &unit, points, 1)
        });
        let dict = PyDict::new(py);
        dict.set_item("chamfer_e3", found.clouds.chamfer_e3)?;
        dict.set_item("floor_e3", found.floor_e3)?;
        dict.set_item("f_score", found.clouds.f_score)?;
        let rays = |e: &RayErrors| -> PyResult<Bound<'py, PyDict>> {
            let dict = PyDict::new(py);
            dict.set_item("visibility", e.visibility)?;
            dict.set_item("lost", e.lost)?;
            dict.set_item("invented", e.invented)?;
            dict.set_item("depth_mean", e.depth_mean)?;
            dict.set_item("depth_p95", e.depth_p95)?;
            dict.set_item("normal_mean_degrees", e.normal_mean_degrees)?;
            Ok(dict)
        };
        dict.set_item("from_outside", rays(&found.primary)?)?;
        dict.set_item("leaving", rays(&found.secondary)?)?;
        Ok(dict)
    }
}

/// When a training ends, and where it is kept.
struct Plan {
    steps: Option<u64>,
    seconds: Option<f64>,
    checkpoint: Option<PathBuf>,
    resume: bool,
    options: TrainOptions,
}

/// One step in the history: its number, error of visibility, share wrong, error of distance, seconds.
type Step = (u64, f64, f64, f64, f64);

/// Learns a mesh; gives the field and the history of its errors.
#[pyfunction]
#[pyo3(signature = (mesh, *, steps, seconds, resolution, seed, checkpoint, resume, threads, progress))]
fn ddf_train<'py>(
    py: Python<'py>,
    mesh: &Bound<'py, NativeMesh>,
    steps: Option<u64>,
    seconds: Option<f64>,
    resolution: Option<u32>,
    seed: u64,
    checkpoint: Option<PathBuf>,
    resume: bool,
    threads: Option<usize>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<(Bound<'py, NativeField>, Vec<Step>)> {
    if steps.is_none() && seconds.is_none() {
        return Err(usage("a training needs an end: say steps or seconds"));
    }
    let shape = FastShape::default();
    let shape = FastShape { resolution: resolution.unwrap_or(shape.resolution), ..shape };
    let options = TrainOptions { shape, seed, ..TrainOptions::default() };
    let plan = Plan { steps, seconds, checkpoint, resume, options };
    let mesh = &mesh.get().mesh;
    let outcome = watched(py, threads, progress, |watch| train(mesh, &plan, watch))?;
    match (outcome.result, outcome.trouble) {
        (Ok((field, history)), None) => Ok((Bound::new(py, NativeField { field })?, history)),
        (Ok((field, history)), Some(trouble)) => {
            let result = (Bound::new(py, NativeField { field })?, history).into_pyobject(py)?;
            Err(ended(py, trouble, Some(result.into_any().unbind())))
        }
        (Err(error), trouble) => Err(trouble.unwrap_or_else(|| failed(error))),
    }
}

fn train(mesh: &TriangleMesh, plan: &Plan, watch: &Watch) -> Result<(DirectedField, Vec<Step>), String> {
    let text = |error: &dyn std::fmt::Display| error.to_string();
    let start = Instant::now();
    let mut trainer = FastTrainer::new(mesh, plan.options.clone()).map_err(|e| text(&e))?;
    if let Some(path) = plan.checkpoint.as_ref().filter(|path| plan.resume && path.exists()) {
        trainer.resume(path).map_err(|e| text(&e))?;
    }
    let mut history = Vec::new();
    let mut saved = Instant::now();
    let save = |trainer: &FastTrainer| match &plan.checkpoint {
        Some(path) => trainer.save_checkpoint(path).map_err(|e| text(&e)),
        None => Ok(()),
    };
    loop {
        let of_steps = plan.steps.map_or(0.0, |steps| trainer.steps_done() as f64 / steps.max(1) as f64);
        let of_time = plan.seconds.map_or(0.0, |seconds| start.elapsed().as_secs_f64() / seconds);
        let share = of_steps.max(of_time).min(1.0);
        if share >= 1.0 || watch.is_stopped() {
            break;
        }
        let StepReport { visibility_loss, wrong, distance_loss, .. } =
            trainer.step(share as f32).map_err(|e| text(&e))?;
        let seconds = start.elapsed().as_secs_f64();
        history.push((trainer.steps_done(), visibility_loss, wrong, distance_loss, seconds));
        watch.report("training", trainer.steps_done(), plan.steps.unwrap_or(0));
        if saved.elapsed() > CHECKPOINT_INTERVAL {
            save(&trainer)?;
            saved = Instant::now();
        }
    }
    save(&trainer)?;
    let mut field = trainer.field();
    field.provenance = Provenance {
        source: "mesh".into(),
        source_hash: mesh_hash(mesh),
        source_triangles: mesh.triangles.len() as u64,
        steps: trainer.steps_done(),
        // A file of so many steps is the same whenever it is made.
        seconds: if plan.steps.is_some() { 0.0 } else { start.elapsed().as_secs_f64() },
        seed: plan.options.seed,
    };
    field.error = evaluate(&field, trainer.unit_mesh(), POINTS, 1).measured();
    Ok((field, history))
}
