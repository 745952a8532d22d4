//! Materials, asked many questions at a time.

use std::path::PathBuf;

use glam::{Vec2, Vec3};
use halflight::material::{Lookup, Material, MeasuredBrdf, SurfaceInput, write_merl};
use halflight::scene::material_from_text;
use numpy::PyReadonlyArray2;
use pyo3::prelude::*;
use rayon::prelude::*;

use crate::arrays::{Row, Table, row, rows3, vectors};
use crate::errors::failed;

pub(crate) fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<NativeMaterial>()?;
    module.add_function(wrap_pyfunction!(describe_measured, module)?)
}

/// A material.
#[pyclass(frozen, module = "halflight._native", name = "Material")]
struct NativeMaterial {
    material: Material,
}

/// Directions to light, weights, densities.
type Samples<'py> = (Table<'py, f32>, Table<'py, f32>, Row<'py, f32>);

#[pymethods]
impl NativeMaterial {
    #[new]
    fn new(py: Python<'_>, spec: &str) -> PyResult<Self> {
        Ok(Self { material: py.detach(|| material_from_text(spec)).map_err(failed)? })
    }

    /// Values times the cosine, and densities of sampling.
    fn eval_pdf<'py>(
        &self,
        py: Python<'py>,
        wo: PyReadonlyArray2<'py, f32>,
        wi: PyReadonlyArray2<'py, f32>,
    ) -> PyResult<(Table<'py, f32>, Row<'py, f32>)> {
        let (wo, wi) = (vectors(&wo)?, vectors(&wi)?);
        let (values, pdfs): (Vec<Vec3>, Vec<f32>) = py.detach(|| {
            let bsdf = self.material.bsdf(&SurfaceInput::default());
            wo.par_iter().zip(&wi).with_min_len(1024).map(|(&wo, &wi)| bsdf.eval_pdf(wo, wi)).unzip()
        });
        Ok((rows3(py, values)?, row(py, pdfs)))
    }

    /// Directions drawn for random numbers; zero where nothing is scattered.
    fn sample<'py>(
        &self,
        py: Python<'py>,
        wo: PyReadonlyArray2<'py, f32>,
        u: PyReadonlyArray2<'py, f32>,
    ) -> PyResult<Samples<'py>> {
        let (wo, u) = (vectors(&wo)?, vectors(&u)?);
        let samples: Vec<(Vec3, Vec3, f32)> = py.detach(|| {
            let bsdf = self.material.bsdf(&SurfaceInput::default());
            let one = |(&wo, &u): (&Vec3, &Vec3)| {
                let sample = bsdf.sample(wo, u.x, Vec2::new(u.y, u.z));
                sample.map_or((Vec3::ZERO, Vec3::ZERO, 0.0), |s| (s.wi, s.weight, s.pdf))
            };
            wo.par_iter().zip(&u).with_min_len(1024).map(one).collect()
        });
        let directions = samples.iter().map(|s| s.0).collect();
        let weights = samples.iter().map(|s| s.1).collect();
        Ok((rows3(py, directions)?, rows3(py, weights)?, row(py, samples.iter().map(|s| s.2).collect())))
    }

    /// The colour that it returns straight on.
    #[getter]
    fn albedo(&self) -> [f32; 3] {
        self.material.bsdf(&SurfaceInput::default()).albedo().to_array()
    }

    /// Writes a file of the MERL database's format.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| write_merl(&self.material.bsdf(&SurfaceInput::default()), &path)).map_err(failed)
    }
}

/// What a measured material is like, in words.
#[pyfunction]
fn describe_measured(py: Python<'_>, path: PathBuf) -> PyResult<String> {
    let measured = py.detach(|| MeasuredBrdf::load(&path, Lookup::default())).map_err(failed)?;
    Ok(measured.describe().to_string())
}
