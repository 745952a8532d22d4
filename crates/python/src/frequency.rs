//! Bandwidths and covariance matrices, many at a time.

use glam::Vec2;
use halflight::image::Plane;
use halflight_frequency::bandwidth::{Bandwidth, lobe, pixel};
use halflight_frequency::covariance::{Covariance, microfacet_lobe, phong_lobe};
use halflight_frequency::wavelet::{Border, Filter, Pyramid, Rule, local_bandwidth, whole_bandwidth};
use numpy::{PyArray1, PyArray2, PyArray3, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::arrays::{block, row, slice2, table};
use crate::errors::{failed, usage};

pub(crate) fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(frequency_bandwidth, module)?)?;
    module.add_function(wrap_pyfunction!(frequency_covariance, module)?)?;
    module.add_function(wrap_pyfunction!(frequency_eigenvalues, module)?)?;
    module.add_function(wrap_pyfunction!(frequency_phong, module)?)?;
    module.add_function(wrap_pyfunction!(frequency_lobe, module)?)?;
    module.add_function(wrap_pyfunction!(frequency_pixel, module)?)?;
    module.add_function(wrap_pyfunction!(frequency_picture, module)?)?;
    module.add_function(wrap_pyfunction!(frequency_local, module)?)
}

/// An operator on bandwidth vectors (ν_s, ν_a), row by row; its numbers stand in `parameters`, a row each.
#[pyfunction]
fn frequency_bandwidth<'py>(
    py: Python<'py>,
    operator: &str,
    vectors: PyReadonlyArray2<'py, f32>,
    parameters: PyReadonlyArray2<'py, f32>,
) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let apply: fn(Bandwidth, &[f32]) -> Bandwidth = match operator {
        "travel" => |nu, p| nu.travel(p[0]),
        "incidence" => |nu, p| nu.incidence(p[0]),
        "exit" => |nu, p| nu.exit(p[0]),
        "curvature" => |nu, p| nu.curvature(p[0]),
        "band_limit" => |nu, p| nu.band_limit(p[0]),
        "reflect" => |nu, p| nu.reflect(p[0], p[1]),
        "magnitude" => |nu, _| nu.magnitude(),
        _ => return Err(usage(format!("there is no operator {operator:?} on bandwidths"))),
    };
    let (count, width) = (vectors.shape()[0], parameters.shape()[1]);
    let (vectors, parameters) = (slice2(&vectors)?, slice2(&parameters)?);
    let out = (0..count).flat_map(|i| {
        let nu = apply(
            Bandwidth::new(vectors[2 * i], vectors[2 * i + 1]),
            &parameters[i * width..(i + 1) * width],
        );
        [nu.spatial, nu.angular]
    });
    table(py, [count, 2], out.collect())
}

/// An operator on covariance matrices of 2 to 5 dimensions, one after another.
#[pyfunction]
fn frequency_covariance<'py>(
    py: Python<'py>,
    operator: &str,
    matrices: PyReadonlyArray3<'py, f64>,
    parameters: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let (count, n, width) = (matrices.shape()[0], matrices.shape()[1], parameters.shape()[1]);
    let values = matrices.as_slice().map_err(failed)?;
    let parameters = slice2(&parameters)?;
    let parameters = |i: usize| &parameters[i * width..(i + 1) * width];
    let out = match n {
        2 => covariances::<2>(operator, values, &parameters),
        3 => covariances::<3>(operator, values, &parameters),
        4 => covariances::<4>(operator, values, &parameters),
        5 => covariances::<5>(operator, values, &parameters),
        _ => Err(usage(format!("covariance matrices have 2 to 5 dimensions, not {n}"))),
    }?;
    block(py, [count, n, n], out)
}

fn covariances<'a, const N: usize>(
    operator: &str,
    values: &[f64],
    parameters: &dyn Fn(usize) -> &'a [f64],
) -> PyResult<Vec<f64>> {
    let apply: fn(Covariance<N>, &[f64]) -> Covariance<N> = match operator {
        "travel" => |c, p| c.travel(p[0]),
        "rotate" => |c, p| c.rotate(p[0]),
        "arrive" => |c, p| c.arrive(p[0]),
        "leave" => |c, p| c.leave(p[0]),
        "curve" => |c, p| c.curve([p[0], p[1], p[2]], p[3]),
        "occlude" => |c, p| c.occlude(p[0]),
        "cosine" => |c, p| c.cosine(p[0]),
        "texture" => |c, p| c.texture([p[0], p[1], p[2]]),
        "reflect" => |c, p| c.reflect([p[0], p[1], p[2]]),
        "thin_lens" => |c, p| c.thin_lens(p[0]),
        "into_motion" => |c, p| c.into_motion([p[0], p[1]], [p[2], p[3]]),
        "out_of_motion" => |c, p| c.out_of_motion([p[0], p[1]], [p[2], p[3]]),
        _ => return Err(usage(format!("there is no operator {operator:?} on covariances"))),
    };
    let of = |(i, matrix): (usize, &[f64])| {
        let rows = std::array::from_fn(|r| std::array::from_fn(|c| matrix[r * N + c]));
        apply(Covariance { rows }, parameters(i)).rows
    };
    Ok(values.chunks_exact(N * N).enumerate().map(of).flat_map(|rows| rows.as_flattened().to_vec()).collect())
}

/// Eigenvalues of covariance matrices.
#[pyfunction]
fn frequency_eigenvalues<'py>(
    py: Python<'py>,
    matrices: PyReadonlyArray3<'py, f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    fn all<const N: usize>(values: &[f64]) -> Vec<f64> {
        let of = |matrix: &[f64]| {
            let rows = std::array::from_fn(|r| std::array::from_fn(|c| matrix[r * N + c]));
            Covariance::<N> { rows }.eigenvalues().to_vec()
        };
        values.chunks_exact(N * N).flat_map(of).collect()
    }
    let (count, n) = (matrices.shape()[0], matrices.shape()[1]);
    let values = matrices.as_slice().map_err(failed)?;
    let out = match n {
        2 => all::<2>(values),
        3 => all::<3>(values),
        4 => all::<4>(values),
        5 => all::<5>(values),
        _ => return Err(usage(format!("covariance matrices have 2 to 5 dimensions, not {n}"))),
    };
    table(py, [count, n], out)
}

/// Angular bandwidth of Phong lobes, cycles per radian.
#[pyfunction]
fn frequency_phong(py: Python<'_>, exponents: Vec<f32>) -> Bound<'_, PyArray1<f32>> {
    row(py, exponents.into_iter().map(lobe::phong).collect())
}

/// The covariance [uu, uv, vv] in radians² of a lobe: `phong` by exponent, `microfacet` by α and the cosine.
#[pyfunction]
fn frequency_lobe(kind: &str, a: f64, cos: f64) -> PyResult<[f64; 3]> {
    match kind {
        "phong" => Ok(phong_lobe(a)),
        "microfacet" => Ok(microfacet_lobe(a, cos)),
        _ => Err(usage(format!("there is no lobe {kind:?} (there are phong and microfacet)"))),
    }
}

/// Cycles per pixel of angular bandwidths, for pixels of that many radians.
#[pyfunction]
fn frequency_pixel(py: Python<'_>, angular: Vec<f32>, pixel_angle: f32) -> Bound<'_, PyArray1<f32>> {
    row(py, angular.into_iter().map(|a| pixel::pixel_bandwidth(a, pixel_angle, pixel_angle)).collect())
}

fn pyramid(values: &PyReadonlyArray2<'_, f32>) -> PyResult<Pyramid> {
    let (height, width) = (values.shape()[0], values.shape()[1]);
    let plane = Plane { width, height, values: slice2(values)?.to_vec() };
    Ok(Pyramid::new(&plane, Filter::Smooth, Border::Repeat))
}

/// The bandwidth of a whole picture, cycles per texel.
#[pyfunction]
fn frequency_picture(values: PyReadonlyArray2<'_, f32>) -> PyResult<f32> {
    Ok(whole_bandwidth(&pyramid(&values)?, Rule::Within))
}

/// The bandwidth around each texel, cycles per texel.
#[pyfunction]
fn frequency_local<'py>(
    py: Python<'py>,
    values: PyReadonlyArray2<'py, f32>,
) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let pyramid = pyramid(&values)?;
    let plane = py.detach(|| local_bandwidth(&pyramid, Rule::Within, |_, _| Vec2::ONE));
    table(py, [plane.height, plane.width], plane.values)
}
