//! halflight for Python: the native half of the package `halflight`.
//!
//! What is here takes and gives plain values and contiguous NumPy arrays; the other half, in `python/halflight`, is what
//! people call: it checks shapes, has types and documentation, and knows defaults. Errors are exceptions with the
//! text of the command's errors. Long work runs on threads of its own, without the interpreter's lock.

mod arrays;
mod brdf;
mod ddf;
mod errors;
mod frequency;
mod meshes;
mod picture;
mod render;
mod sh;
mod spheres;
mod stage;
mod work;

use pyo3::prelude::*;

/// What `halflight` for Python is made of; use the package, not this module.
#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    errors::add(module)?;
    stage::add(module)?;
    render::add(module)?;
    picture::add(module)?;
    meshes::add(module)?;
    sh::add(module)?;
    spheres::add(module)?;
    brdf::add(module)?;
    ddf::add(module)?;
    frequency::add(module)
}
