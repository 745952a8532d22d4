//! Sphere sets: fitted, measured, and what they hide from points.

use std::path::PathBuf;

use glam::Vec3;
use halflight::shape::{SphereFitOptions, SphereSet};
use halflight_sh::attenuation::{Cap, log_visibility, multiplicities};
use halflight_sh::{BlockerTable, ShError};
use numpy::{PyArray1, PyArray2, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;

use crate::arrays::{row, rows3, slice2, table, vectors};
use crate::errors::{failed, usage};
use crate::meshes::NativeMesh;
use crate::sh::at_order;

pub(crate) fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<NativeSpheres>()?;
    module.add_function(wrap_pyfunction!(spheres_log_visibility, module)?)
}

/// Spheres that stand for a mesh.
#[pyclass(frozen, module = "halflight._native", name = "Spheres")]
pub(crate) struct NativeSpheres {
    set: SphereSet,
    warnings: Vec<String>,
}

#[pymethods]
impl NativeSpheres {
    /// Of centres and radii, one row of four numbers each.
    #[new]
    fn new(spheres: PyReadonlyArray2<'_, f32>) -> PyResult<Self> {
        let rows = slice2(&spheres)?;
        if rows.iter().any(|x| !x.is_finite()) || rows.chunks_exact(4).any(|s| s[3] <= 0.0) {
            return Err(usage("spheres: centres must be finite, and radii greater than 0"));
        }
        let set = SphereSet {
            centers: rows.chunks_exact(4).map(Vec3::from_slice).collect(),
            radii: rows.chunks_exact(4).map(|s| s[3]).collect(),
            ..SphereSet::default()
        };
        Ok(Self { set, warnings: Vec::new() })
    }

    #[staticmethod]
    fn fit(py: Python<'_>, mesh: &Bound<'_, NativeMesh>, count: usize, balanced: bool) -> PyResult<Self> {
        let mesh = &mesh.get().mesh;
        py.detach(|| {
            let options = SphereFitOptions { spheres: count, ..SphereFitOptions::default() };
            let (mut set, report) = SphereSet::fit("mesh", mesh, &options).map_err(failed)?;
            if balanced {
                set = set.balanced(mesh).0;
            }
            Ok(Self { set, warnings: report.warnings })
        })
    }

    #[staticmethod]
    fn load(path: PathBuf) -> PyResult<Self> {
        Ok(Self { set: SphereSet::load(&path).map_err(failed)?, warnings: Vec::new() })
    }

    fn save(&self, path: PathBuf) -> PyResult<()> {
        self.set.save(&path).map_err(failed)
    }

    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }

    #[getter]
    fn centers<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        rows3(py, self.set.centers.clone())
    }

    #[getter]
    fn radii<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        row(py, self.set.radii.clone())
    }

    /// Volumes, coverage and silhouettes against a mesh.
    fn measure<'py>(&self, py: Python<'py>, mesh: &Bound<'py, NativeMesh>) -> PyResult<Bound<'py, PyDict>> {
        let mesh = &mesh.get().mesh;
        let (measure, outlines) = py.detach(|| (self.set.measure(mesh), self.set.silhouettes(mesh)));
        let dict = PyDict::new(py);
        dict.set_item("mesh_volume", measure.mesh_volume)?;
        dict.set_item("union_volume", measure.union_volume)?;
        dict.set_item("outside_fraction", measure.outside_fraction())?;
        dict.set_item("uncovered", measure.coverage.uncovered)?;
        dict.set_item("mean_iou", outlines.mean_iou)?;
        dict.set_item("least_iou", outlines.least_iou)?;
        Ok(dict)
    }
}

/// At each point the logarithm of what spheres leave of the sky, overlaps attenuated: rows of coefficients, the point inside of
/// no sphere counted twice.
#[pyfunction]
fn spheres_log_visibility<'py>(
    py: Python<'py>,
    spheres: &Bound<'py, NativeSpheres>,
    points: PyReadonlyArray2<'py, f32>,
    order: usize,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let count = points.shape()[0];
    let points = vectors(&points)?;
    let set = &spheres.get().set;
    at_order!(order, N => {
        let rows: Vec<f64> = py.detach(|| {
            let table = BlockerTable::<N>::new();
            points.par_iter().with_min_len(16).flat_map_iter(|point| {
                let caps: Vec<Cap> =
                    set.spheres().filter_map(|(centre, radius)| Cap::of_sphere(centre - *point, radius)).collect();
                let sum = log_visibility::<N>(&table, &caps, &multiplicities(&caps), None);
                sum.cast().coefficients().to_vec()
            }).collect()
        });
        table(py, [count, N * N], rows)
    })
}
