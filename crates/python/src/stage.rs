//! Scenes with changes, kept with the work that a technique has prepared for them.

use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use halflight::job::{Changes, Size, Stage as Loaded};
use halflight::render::techniques::Made;
use halflight::scene::Up;
use halflight::trace::Simd;
use pyo3::prelude::*;

use crate::errors::{of_job, usage};

pub(crate) fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Stage>()?;
    module.add_function(wrap_pyfunction!(detect_simd, module)?)?;
    module.add_function(wrap_pyfunction!(demos, module)?)
}

/// A loaded scene.
#[pyclass(frozen, module = "halflight._native")]
pub(crate) struct Stage {
    pub(crate) loaded: Loaded,
    /// The last technique, prepared.
    pub(crate) kept: Mutex<Option<Made>>,
}

impl Stage {
    /// The technique of that identity that was prepared last, if it is free.
    pub(crate) fn take(&self, identity: &str) -> Option<Made> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.take_if(|made| made.identity == identity)
    }

    pub(crate) fn keep(&self, made: Made) {
        *self.kept.lock().unwrap_or_else(PoisonError::into_inner) = Some(made);
    }
}

/// The instruction set of a name, if this machine has it; the best without a name.
pub(crate) fn simd(name: Option<&str>) -> PyResult<Simd> {
    name.map_or_else(|| Ok(Simd::detect()), |name| Simd::from_name(name).map_err(usage))
}

#[pymethods]
impl Stage {
    #[new]
    #[pyo3(signature = (path, *, up_z = false, environment = None, material = None, shapes = Vec::new(), set = Vec::new(), size = None, simd = None))]
    fn new(
        py: Python<'_>,
        path: PathBuf,
        up_z: bool,
        environment: Option<PathBuf>,
        material: Option<String>,
        shapes: Vec<(String, String)>,
        set: Vec<String>,
        size: Option<(usize, usize)>,
        simd: Option<&str>,
    ) -> PyResult<Self> {
        let simd = self::simd(simd)?;
        let size = size.map(size_of).transpose()?;
        let up = if up_z { Up::Z } else { Up::Y };
        let changes = Changes { up, environment, material, shapes, set, size };
        let loaded = py.detach(|| Loaded::load(&path, &changes, simd)).map_err(of_job)?;
        Ok(Self { loaded, kept: Mutex::new(None) })
    }

    #[getter]
    fn name(&self) -> &str {
        self.loaded.name()
    }

    #[getter]
    fn hash(&self) -> &str {
        self.loaded.hash()
    }

    #[getter]
    fn simd(&self) -> &str {
        self.loaded.simd_name()
    }

    #[getter]
    fn size(&self) -> (usize, usize) {
        let Size { width, height } = self.loaded.size();
        (width, height)
    }

    /// Stops and the name of the tone curve; no stops where the picture decides.
    #[getter]
    fn showing(&self) -> (Option<f32>, &'static str) {
        let exposure = (!self.loaded.exposes_itself()).then(|| self.loaded.exposure_ev());
        (exposure, crate::picture::tone_name(self.loaded.tone()))
    }

    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.loaded.warnings().to_vec()
    }

    #[getter]
    fn files(&self) -> Vec<PathBuf> {
        self.loaded.scene().files().to_vec()
    }

    #[getter]
    fn duration(&self) -> Option<f64> {
        self.loaded.scene().duration()
    }

    #[getter]
    fn is_animated(&self) -> bool {
        self.loaded.scene().is_animated()
    }

    fn describe(&self) -> String {
        self.loaded.describe()
    }
}

/// A size within reason.
pub(crate) fn size_of((width, height): (usize, usize)) -> PyResult<Size> {
    format!("{width}x{height}").parse().map_err(usage)
}

/// The best instruction set of this machine.
#[pyfunction]
fn detect_simd() -> &'static str {
    Simd::detect().name()
}

/// Names of the built-in scenes and what they show.
#[pyfunction]
fn demos() -> Vec<(&'static str, &'static str)> {
    halflight::demos::DEMOS.iter().map(|demo| (demo.name, demo.description())).collect()
}
