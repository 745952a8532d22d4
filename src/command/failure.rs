//! Why a command did not do what it was asked, and the exit code that says so.

use std::fmt;

/// The command did what it was asked.
pub(crate) const DONE: u8 = 0;
/// A file, a scene, a technique or a disk stood in the way; or figures were worse than `--fail-above` allows.
pub(crate) const FAILED: u8 = 1;
/// The command line makes no sense.
pub(crate) const USAGE: u8 = 2;
/// An interrupt signal came; the picture holds the samples there were.
pub(crate) const INTERRUPTED: u8 = 130;

/// Why a command ended without being done.
#[derive(Debug)]
pub(crate) enum Failure {
    /// The options contradict each other or the world: `message`, then what to try.
    Usage(String),
    /// What was asked could not be done.
    Failed(String),
    /// An interrupt signal; what there was has been written, and said.
    Interrupted,
}

impl Failure {
    pub(crate) fn usage(message: impl fmt::Display) -> Self {
        Self::Usage(message.to_string())
    }

    /// Any error of the libraries: they tell the whole story themselves.
    pub(crate) fn failed(error: impl fmt::Display) -> Self {
        Self::Failed(error.to_string())
    }

    pub(crate) fn exit_code(&self) -> u8 {
        match self {
            Self::Usage(_) => USAGE,
            Self::Failed(_) => FAILED,
            Self::Interrupted => INTERRUPTED,
        }
    }

    /// What to tell the user; nothing for an interrupt, of which they know.
    pub(crate) fn message(&self) -> Option<&str> {
        match self {
            Self::Usage(message) | Self::Failed(message) => Some(message.trim_end()),
            Self::Interrupted => None,
        }
    }
}

impl From<halflight::job::JobError> for Failure {
    fn from(error: halflight::job::JobError) -> Self {
        match error {
            halflight::job::JobError::Usage(message) => Self::Usage(message),
            halflight::job::JobError::Failed(message) => Self::Failed(message),
        }
    }
}

impl From<halflight_file::LoadError> for Failure {
    fn from(error: halflight_file::LoadError) -> Self {
        Self::failed(error)
    }
}

impl From<halflight_file::SaveError> for Failure {
    fn from(error: halflight_file::SaveError) -> Self {
        Self::failed(error)
    }
}

impl From<halflight_render::TechniqueError> for Failure {
    fn from(error: halflight_render::TechniqueError) -> Self {
        Self::failed(error)
    }
}

impl From<halflight_image::metrics::MetricError> for Failure {
    fn from(error: halflight_image::metrics::MetricError) -> Self {
        Self::failed(error)
    }
}
