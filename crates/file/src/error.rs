use std::fmt;
use std::path::{Path, PathBuf};

/// Where in a file something was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    Whole,
    /// An offset in bytes from the start of the (unpacked) file.
    Byte(u64),
    /// A line, counted from one.
    Line(usize),
    /// A line and a column, both counted from one.
    LineColumn(usize, usize),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::Whole => Ok(()),
            Place::Byte(offset) => write!(f, "byte {offset}: "),
            Place::Line(line) => write!(f, "line {line}: "),
            Place::LineColumn(line, column) => write!(f, "line {line}, column {column}: "),
        }
    }
}

/// Why a file could not be loaded: what was asked, what was found, where, and what to try.
///
/// ```
/// use halflight_file::{LoadError, Place};
/// let error = LoadError::new("PLY mesh", "bunny.ply", "vertex index 99 of a mesh with 12 vertices")
///     .at(Place::Line(31))
///     .hint("export the mesh again");
/// assert_eq!(
///     error.to_string(),
///     "cannot load the PLY mesh bunny.ply: line 31: vertex index 99 of a mesh with 12 vertices (export the mesh again)"
/// );
/// ```
#[derive(Clone, Debug, thiserror::Error)]
pub struct LoadError {
    /// What was asked for, as a noun: `PLY mesh`, `Radiance HDR picture`.
    pub asked: String,
    /// The file, as the caller named it.
    pub path: PathBuf,
    /// Where in the file the trouble is.
    pub place: Place,
    /// What was found there.
    pub found: String,
    /// What to try, if there is something to try.
    pub hint: Option<String>,
}

impl LoadError {
    /// An error about the file as a whole.
    pub fn new(asked: impl Into<String>, path: impl AsRef<Path>, found: impl Into<String>) -> Self {
        Self {
            asked: asked.into(),
            path: path.as_ref().to_path_buf(),
            place: Place::Whole,
            found: found.into(),
            hint: None,
        }
    }

    /// The same error at a place in the file.
    #[must_use]
    pub fn at(mut self, place: Place) -> Self {
        self.place = place;
        self
    }

    /// The same error with something to try.
    #[must_use]
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }
}

impl fmt::Display for LoadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "cannot load the {} {}: {}{}", self.asked, self.path.display(), self.place, self.found)?;
        match &self.hint {
            Some(hint) => write!(f, " ({hint})"),
            None => Ok(()),
        }
    }
}

/// Why a file could not be written. Whatever stood under that name before still stands.
#[derive(Debug, thiserror::Error)]
#[error("cannot write the {asked} {}: {found}{}", path.display(), hint.as_ref().map(|h| format!(" ({h})")).unwrap_or_default())]
pub struct SaveError {
    /// What was to be written, as a noun: `EXR picture`.
    pub asked: String,
    /// The file, as the caller named it.
    pub path: PathBuf,
    /// What went wrong.
    pub found: String,
    /// What to try, if there is something to try.
    pub hint: Option<String>,
}
