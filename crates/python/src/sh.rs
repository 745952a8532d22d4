//! Spherical harmonics of rows of coefficients: functions of many at once, in f64.

use glam::{DMat3, DVec3};
use halflight_sh::convert::Convention;
use halflight_sh::{Sh, ShError, Zh, exact_log_visibility, project, reference};
use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::prelude::*;
use rayon::prelude::*;

use crate::arrays::{Row, Table, image, row, slice2, table, vectors64};
use crate::errors::{failed, usage};

pub(crate) fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(sh_basis, module)?)?;
    module.add_function(wrap_pyfunction!(sh_quadrature, module)?)?;
    module.add_function(wrap_pyfunction!(sh_project_map, module)?)?;
    module.add_function(wrap_pyfunction!(sh_product, module)?)?;
    module.add_function(wrap_pyfunction!(sh_rotate, module)?)?;
    module.add_function(wrap_pyfunction!(sh_log, module)?)?;
    module.add_function(wrap_pyfunction!(sh_exp, module)?)?;
    module.add_function(wrap_pyfunction!(sh_convolve, module)?)?;
    module.add_function(wrap_pyfunction!(sh_irradiance, module)?)?;
    module.add_function(wrap_pyfunction!(sh_convert, module)?)?;
    module.add_function(wrap_pyfunction!(sh_cap, module)?)?;
    module.add_function(wrap_pyfunction!(sh_log_cap, module)?)
}

/// An expression with an order that is known only now as a constant.
macro_rules! at_order {
    ($order:expr, $n:ident => $body:expr) => {
        match $order {
            1 => {
                const $n: usize = 1;
                $body
            }
            2 => {
                const $n: usize = 2;
                $body
            }
            3 => {
                const $n: usize = 3;
                $body
            }
            4 => {
                const $n: usize = 4;
                $body
            }
            5 => {
                const $n: usize = 5;
                $body
            }
            6 => {
                const $n: usize = 6;
                $body
            }
            7 => {
                const $n: usize = 7;
                $body
            }
            8 => {
                const $n: usize = 8;
                $body
            }
            order => Err(usage(ShError::Order { order })),
        }
    };
}
pub(crate) use at_order;

/// The order of rows of `n²` coefficients.
fn order_of(array: &PyReadonlyArray2<'_, f64>) -> usize {
    array.shape()[1].isqrt()
}

fn sh<const N: usize>(row: &[f64]) -> Sh<N, f64> {
    Sh::from_fn(|i| row[i])
}

/// Each row through a function, many at a time.
fn each<'py, const N: usize>(
    py: Python<'py>,
    rows: &PyReadonlyArray2<'py, f64>,
    change: impl Fn(Sh<N, f64>) -> Sh<N, f64> + Sync,
) -> PyResult<Table<'py, f64>> {
    let (count, values) = (rows.shape()[0], slice2(rows)?);
    let mut out = vec![0.0; values.len()];
    py.detach(|| {
        out.par_chunks_exact_mut(N * N)
            .with_min_len(64)
            .zip(values.par_chunks_exact(N * N))
            .for_each(|(out, row)| out.copy_from_slice(change(sh::<N>(row)).coefficients()));
    });
    table(py, [count, N * N], out)
}

/// y_i of each direction.
#[pyfunction]
fn sh_basis<'py>(
    py: Python<'py>,
    directions: PyReadonlyArray2<'py, f64>,
    order: usize,
) -> PyResult<Table<'py, f64>> {
    let directions = vectors64(&directions)?;
    let count = directions.len();
    at_order!(order, N => {
        let rows: Vec<f64> =
            directions.iter().flat_map(|&d| Sh::<N, f64>::basis(d).coefficients().to_vec()).collect();
        table(py, [count, N * N], rows)
    })
}

/// Directions and weights that are exact for functions of bands below 2 · `nodes`.
#[pyfunction]
fn sh_quadrature<'py>(py: Python<'py>, nodes: usize) -> PyResult<(Table<'py, f64>, Row<'py, f64>)> {
    let points: Vec<(DVec3, f64)> = reference::sphere_quadrature(nodes);
    let directions = points.iter().flat_map(|(d, _)| d.to_array()).collect();
    Ok((table(py, [points.len(), 3], directions)?, row(py, points.iter().map(|(_, w)| *w).collect())))
}

/// Coefficients of the three colours of a latitude–longitude picture, and the share of its energy that they keep.
#[pyfunction]
fn sh_project_map<'py>(
    py: Python<'py>,
    picture: PyReadonlyArray3<'py, f32>,
    order: usize,
) -> PyResult<(Table<'py, f64>, f64)> {
    let image = image(&picture)?;
    let texel = |x: usize, y: usize| glam::Vec3::from(image.pixels[y * image.width + x]);
    at_order!(order, N => {
        let (light, kept) = py.detach(|| {
            let light = project::lat_long::<N>(image.width, image.height, texel)?;
            let kept = project::kept_energy(image.width, image.height, texel, &light)?;
            Ok((light, kept))
        }).map_err(|error: ShError| failed(error))?;
        let rows = light.iter().flat_map(|sh| sh.cast().coefficients().to_vec()).collect();
        Ok((table(py, [3, N * N], rows)?, kept))
    })
}

/// Products of rows, truncated to their order.
#[pyfunction]
fn sh_product<'py>(
    py: Python<'py>,
    a: PyReadonlyArray2<'py, f64>,
    b: PyReadonlyArray2<'py, f64>,
) -> PyResult<Table<'py, f64>> {
    let (count, left, right) = (a.shape()[0], slice2(&a)?, slice2(&b)?);
    at_order!(order_of(&a), N => {
        let mut out = vec![0.0; left.len()];
        py.detach(|| {
            let pairs = left.par_chunks_exact(N * N).zip(right.par_chunks_exact(N * N));
            out.par_chunks_exact_mut(N * N).with_min_len(64).zip(pairs).for_each(|(out, (a, b))| {
                out.copy_from_slice(sh::<N>(a).product(&sh::<N>(b)).coefficients());
            });
        });
        table(py, [count, N * N], out)
    })
}

/// Rows turned with a rotation, given by its matrix.
#[pyfunction]
fn sh_rotate<'py>(
    py: Python<'py>,
    rows: PyReadonlyArray2<'py, f64>,
    matrix: PyReadonlyArray2<'py, f64>,
) -> PyResult<Table<'py, f64>> {
    let m = slice2(&matrix)?;
    let matrix = DMat3::from_cols_array(&std::array::from_fn(|i| m[i % 3 * 3 + i / 3]));
    at_order!(order_of(&rows), N => each::<N>(py, &rows, |f| f.rotated(&matrix)))
}

/// Logarithms of rows, with values raised to a floor.
#[pyfunction]
fn sh_log<'py>(py: Python<'py>, rows: PyReadonlyArray2<'py, f64>, floor: f64) -> PyResult<Table<'py, f64>> {
    at_order!(order_of(&rows), N => each::<N>(py, &rows, |f| f.log(floor)))
}

/// Exponentials of rows.
#[pyfunction]
fn sh_exp<'py>(py: Python<'py>, rows: PyReadonlyArray2<'py, f64>) -> PyResult<Table<'py, f64>> {
    at_order!(order_of(&rows), N => each::<N>(py, &rows, |f| f.exp()))
}

/// Rows convolved with a zonal function of one number a band.
#[pyfunction]
fn sh_convolve<'py>(
    py: Python<'py>,
    rows: PyReadonlyArray2<'py, f64>,
    zonal: PyReadonlyArray1<'py, f64>,
) -> PyResult<Table<'py, f64>> {
    let zonal = zonal.as_slice().map_err(failed)?;
    at_order!(order_of(&rows), N => {
        let kernel = Zh::<N, f64>(std::array::from_fn(|l| zonal[l]));
        each::<N>(py, &rows, |f| f.convolved(&kernel))
    })
}

/// Irradiance by the normal, of rows of radiance.
#[pyfunction]
fn sh_irradiance<'py>(py: Python<'py>, rows: PyReadonlyArray2<'py, f64>) -> PyResult<Table<'py, f64>> {
    at_order!(order_of(&rows), N => each::<N>(py, &rows, |f| f.irradiance()))
}

/// Rows from the form of one library into that of another.
#[pyfunction]
fn sh_convert<'py>(
    py: Python<'py>,
    rows: PyReadonlyArray2<'py, f64>,
    from_: &str,
    to: &str,
) -> PyResult<Table<'py, f64>> {
    let find = |name: &str| {
        let names: Vec<&str> = Convention::ALL.iter().map(|(name, _)| *name).collect();
        Convention::from_name(name)
            .ok_or_else(|| usage(format!("there is no convention {name:?} (there are {})", names.join(", "))))
    };
    let (from, to) = (find(from_)?, find(to)?);
    let (count, values) = (rows.shape()[0], slice2(&rows)?);
    at_order!(order_of(&rows), N => {
        let mut out = Vec::with_capacity(values.len());
        for row in values.chunks_exact(N * N) {
            let f = Sh::<N, f64>::from_convention(from, row).map_err(failed)?;
            out.extend(f.to_convention(to).map_err(failed)?);
        }
        table(py, [count, N * N], out)
    })
}

/// Zonal coefficients of caps about +z: 1 within the half angle, 0 beyond; one a band.
#[pyfunction]
fn sh_cap<'py>(py: Python<'py>, half_angles: Vec<f64>, order: usize) -> PyResult<Table<'py, f64>> {
    at_order!(order, N => {
        let rows = half_angles.iter().flat_map(|&a| Zh::<N>::cap(a).0.map(f64::from)).collect();
        table(py, [half_angles.len(), N], rows)
    })
}

/// Zonal logarithms of the visibility beside a sphere of each half angle, about +z; one a band.
#[pyfunction]
fn sh_log_cap<'py>(
    py: Python<'py>,
    half_angles: Vec<f64>,
    floor: f64,
    order: usize,
) -> PyResult<Table<'py, f64>> {
    at_order!(order, N => {
        let rows = half_angles.iter().flat_map(|&a| exact_log_visibility::<N>(a, floor).0).collect();
        table(py, [half_angles.len(), N], rows)
    })
}
