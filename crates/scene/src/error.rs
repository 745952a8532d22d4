use halflight_file::LoadError;

use crate::schema::{Problem, Problems};

/// Why a scene could not be loaded or posed.
#[derive(Clone, Debug, thiserror::Error)]
pub enum SceneError {
    /// Something that a scene file or an option of the command says is wrong: with file, line, column and a way out.
    #[error(transparent)]
    Settings(#[from] Problems),
    /// A file could not be loaded that no line of a scene file names: the scene file itself, or a bare asset.
    #[error(transparent)]
    Load(#[from] LoadError),
}

impl From<Problem> for SceneError {
    fn from(problem: Problem) -> Self {
        Self::Settings(problem.into())
    }
}

impl SceneError {
    /// Line and column of the first problem, both counted from one, if it stands in a text.
    pub fn line_column(&self) -> Option<(usize, usize)> {
        match self {
            Self::Settings(problems) => problems.first().map(Problem::line_column),
            Self::Load(_) => None,
        }
    }
}
