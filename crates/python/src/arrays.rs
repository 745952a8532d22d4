//! Between NumPy arrays and vectors.

use glam::{DVec3, Vec3};
use numpy::ndarray::{Array1, Array2, Array3};
use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyArray3, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods,
};
use pyo3::prelude::*;

use crate::errors::failed;
use halflight::image::RgbImage;

/// A row of numbers.
pub(crate) type Row<'py, T> = Bound<'py, PyArray1<T>>;
/// A table of numbers.
pub(crate) type Table<'py, T> = Bound<'py, PyArray2<T>>;

/// The values of a contiguous array.
pub(crate) fn slice2<'a, T: numpy::Element>(array: &'a PyReadonlyArray2<'_, T>) -> PyResult<&'a [T]> {
    array.as_slice().map_err(|_| failed("an array is not contiguous"))
}

/// Rows of three numbers.
pub(crate) fn vectors(array: &PyReadonlyArray2<'_, f32>) -> PyResult<Vec<Vec3>> {
    Ok(slice2(array)?.chunks_exact(3).map(Vec3::from_slice).collect())
}

/// Rows of three numbers in double precision.
pub(crate) fn vectors64(array: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<DVec3>> {
    Ok(slice2(array)?.chunks_exact(3).map(DVec3::from_slice).collect())
}

/// A picture of rows × columns × 3.
pub(crate) fn image(array: &PyReadonlyArray3<'_, f32>) -> PyResult<RgbImage> {
    let (height, width) = (array.shape()[0], array.shape()[1]);
    let values = array.as_slice().map_err(|_| failed("an array is not contiguous"))?;
    let pixels = values.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
    Ok(RgbImage { width, height, pixels })
}

/// A row of values, moved.
pub(crate) fn row<T: numpy::Element>(py: Python<'_>, values: Vec<T>) -> Bound<'_, PyArray1<T>> {
    Array1::from_vec(values).into_pyarray(py)
}

/// A table of values, moved.
pub(crate) fn table<T: numpy::Element>(
    py: Python<'_>,
    shape: [usize; 2],
    values: Vec<T>,
) -> PyResult<Bound<'_, PyArray2<T>>> {
    Ok(Array2::from_shape_vec(shape, values).map_err(failed)?.into_pyarray(py))
}

/// A block of values, moved.
pub(crate) fn block<T: numpy::Element>(
    py: Python<'_>,
    shape: [usize; 3],
    values: Vec<T>,
) -> PyResult<Bound<'_, PyArray3<T>>> {
    Ok(Array3::from_shape_vec(shape, values).map_err(failed)?.into_pyarray(py))
}

/// Rows of three numbers, from vectors.
pub(crate) fn rows3(py: Python<'_>, vectors: Vec<Vec3>) -> PyResult<Bound<'_, PyArray2<f32>>> {
    let count = vectors.len();
    let values: Vec<f32> = vectors.into_iter().flat_map(|v| v.to_array()).collect();
    table(py, [count, 3], values)
}
