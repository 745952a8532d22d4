//! Why a job could not be done.

/// Why a picture could not be made: the message tells the whole story.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum JobError {
    /// What was asked makes no sense.
    #[error("{0}")]
    Usage(String),
    /// What was asked could not be done.
    #[error("{0}")]
    Failed(String),
}

impl JobError {
    /// What was asked makes no sense.
    pub fn usage(message: impl std::fmt::Display) -> Self {
        Self::Usage(message.to_string().trim_end().to_string())
    }

    /// Any error of the libraries: they tell the whole story themselves.
    pub fn failed(error: impl std::fmt::Display) -> Self {
        Self::Failed(error.to_string().trim_end().to_string())
    }
}

impl From<halflight_file::LoadError> for JobError {
    fn from(error: halflight_file::LoadError) -> Self {
        Self::failed(error)
    }
}

impl From<halflight_file::SaveError> for JobError {
    fn from(error: halflight_file::SaveError) -> Self {
        Self::failed(error)
    }
}

impl From<halflight_render::TechniqueError> for JobError {
    fn from(error: halflight_render::TechniqueError) -> Self {
        Self::failed(error)
    }
}
