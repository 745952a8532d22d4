//! Triangle meshes from arrays, and files of them.

use std::path::PathBuf;

use glam::{Vec2, Vec3};
use halflight::image::{Picture, Precision};
use halflight::shape::{TriangleMesh, load_model, write_ply};
use numpy::{PyArray2, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::prelude::*;

use crate::arrays::{image, rows3, slice2, table, vectors};
use crate::errors::{failed, usage};

pub(crate) fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<NativeMesh>()?;
    module.add_function(wrap_pyfunction!(save_image, module)?)
}

/// A mesh.
#[pyclass(frozen, module = "halflight._native", name = "Mesh")]
pub(crate) struct NativeMesh {
    pub(crate) mesh: TriangleMesh,
    warnings: Vec<String>,
}

#[pymethods]
impl NativeMesh {
    #[new]
    #[pyo3(signature = (vertices, faces, normals = None, uvs = None, colors = None))]
    fn new(
        vertices: PyReadonlyArray2<'_, f32>,
        faces: PyReadonlyArray2<'_, u32>,
        normals: Option<PyReadonlyArray2<'_, f32>>,
        uvs: Option<PyReadonlyArray2<'_, f32>>,
        colors: Option<PyReadonlyArray2<'_, f32>>,
    ) -> PyResult<Self> {
        let optional = |array: Option<PyReadonlyArray2<'_, f32>>| -> PyResult<Vec<Vec3>> {
            array.map_or_else(|| Ok(Vec::new()), |array| vectors(&array))
        };
        let uvs = match &uvs {
            Some(uvs) => slice2(uvs)?.chunks_exact(2).map(Vec2::from_slice).collect(),
            None => Vec::new(),
        };
        let mesh = TriangleMesh {
            positions: vectors(&vertices)?,
            triangles: slice2(&faces)?.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
            normals: optional(normals)?,
            uvs,
            colors: optional(colors)?,
            ..TriangleMesh::default()
        };
        mesh.validate().map_err(usage)?;
        Ok(Self { mesh, warnings: Vec::new() })
    }

    /// All parts of a model where they stand, repaired as far as they can be.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        py.detach(|| {
            let model = load_model(&path).map_err(failed)?;
            let mut warnings = model.warnings.clone();
            let mut mesh = model.rest_surface().mesh;
            let flaws = mesh.repair().map_err(|error| failed(format!("{}: {error}", path.display())))?;
            warnings.extend(flaws.sentences(&path.display().to_string()));
            Ok(Self { mesh, warnings })
        })
    }

    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }

    #[getter]
    fn vertices<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        rows3(py, self.mesh.positions.clone())
    }

    #[getter]
    fn faces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        table(py, [self.mesh.triangles.len(), 3], self.mesh.triangles.clone().into_flattened())
    }

    /// Writes a binary PLY.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| write_ply(&path, &self.mesh)).map_err(failed)
    }
}

/// Writes a picture of rows × columns × 3 as an EXR of full precision.
#[pyfunction]
fn save_image(path: PathBuf, rgb: PyReadonlyArray3<'_, f32>) -> PyResult<()> {
    let image = image(&rgb)?;
    let mut picture = Picture::new(image.width, image.height);
    for (channel, name) in ["R", "G", "B"].into_iter().enumerate() {
        picture.push(name, image.pixels.iter().map(|pixel| pixel[channel]).collect());
    }
    picture.save_exr(&path, Precision::Float).map_err(failed)
}
