//! Errors as exceptions, with the text that the command would print.

use std::fmt::Display;

use halflight::job::JobError;
use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyKeyboardInterrupt};
use pyo3::prelude::*;

create_exception!(
    halflight,
    Error,
    PyException,
    "What was asked could not be done; the text says why, and what to try."
);
create_exception!(halflight, UsageError, Error, "What was asked makes no sense.");
create_exception!(
    halflight,
    Interrupted,
    PyKeyboardInterrupt,
    "Ctrl-C while something was made; `.result` holds what there was, or is None."
);

pub(crate) fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    module.add("Error", py.get_type::<Error>())?;
    module.add("UsageError", py.get_type::<UsageError>())?;
    module.add("Interrupted", py.get_type::<Interrupted>())
}

/// Any error of the libraries.
pub(crate) fn failed(error: impl Display) -> PyErr {
    Error::new_err(error.to_string().trim_end().to_string())
}

/// A question that has no answer.
pub(crate) fn usage(error: impl Display) -> PyErr {
    UsageError::new_err(error.to_string().trim_end().to_string())
}

/// An error of a job.
pub(crate) fn of_job(error: JobError) -> PyErr {
    match error {
        JobError::Usage(text) => usage(text),
        JobError::Failed(text) => failed(text),
    }
}
