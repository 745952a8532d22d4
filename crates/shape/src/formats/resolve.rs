//! Where a model's companions (materials, buffers, pictures) come from.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use halflight_file::{LoadError, nearest_name, read};

/// Finds the files that a model refers to. In a folder, they are read from it; in memory, they are what the
/// caller put there, so that decoding touches no file at all.
#[derive(Clone, Debug, Default)]
pub struct Resolver {
    folder: Option<PathBuf>,
    memory: BTreeMap<String, Vec<u8>>,
}

impl Resolver {
    /// Companions lie in this folder, or below it.
    pub fn folder(folder: impl Into<PathBuf>) -> Self {
        Self { folder: Some(folder.into()), memory: BTreeMap::new() }
    }

    /// There are no companions but those given by [`Resolver::with`].
    pub fn memory() -> Self {
        Self::default()
    }

    /// Adds a companion by the name that the model refers to it with.
    #[must_use]
    pub fn with(mut self, name: impl Into<String>, bytes: Vec<u8>) -> Self {
        self.memory.insert(name.into(), bytes);
        self
    }

    /// The bytes of a companion of `model`. `asked` is a noun: `glTF buffer`.
    pub(super) fn bytes(&self, name: &str, asked: &str, model: &Path) -> Result<Vec<u8>, LoadError> {
        if let Some(bytes) = self.memory.get(name) {
            return Ok(bytes.clone());
        }
        match &self.folder {
            Some(folder) => read(&folder.join(name), asked),
            None => Err(self.missing(name, asked, model)),
        }
    }

    /// Where a companion lies, if it lies in the file system, or its bytes. It must exist.
    pub(super) fn locate(&self, name: &str, asked: &str, model: &Path) -> Result<Located, LoadError> {
        if let Some(bytes) = self.memory.get(name) {
            return Ok(Located::Bytes(bytes.clone()));
        }
        let Some(folder) = &self.folder else { return Err(self.missing(name, asked, model)) };
        let path = folder.join(name);
        if path.is_file() {
            return Ok(Located::File(path));
        }
        // Models made on Windows write backslashes, or names whose case their file system did not mind.
        if let Some(path) = similar_file(folder, name) {
            return Ok(Located::File(path));
        }
        if path.is_dir() {
            let found = format!("it refers to {}, which is a folder", path.display());
            return Err(LoadError::new(asked, model, found));
        }
        let error =
            LoadError::new(asked, model, format!("it refers to {name}, and there is no {}", path.display()));
        let parent = path.parent().unwrap_or(folder);
        let names: Vec<String> = std::fs::read_dir(parent)
            .map(|entries| entries.flatten().map(|e| e.file_name().to_string_lossy().into_owned()).collect())
            .unwrap_or_default();
        let wanted = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        Err(match nearest_name(&wanted, names.iter().map(String::as_str)) {
            Some(near) => error.hint(format!("the nearest name there is {}", parent.join(near).display())),
            None => error.hint("put the file beside the model"),
        })
    }

    fn missing(&self, name: &str, asked: &str, model: &Path) -> LoadError {
        let error = LoadError::new(asked, model, format!("it refers to {name}, which was not given with it"));
        match nearest_name(name, self.memory.keys().map(String::as_str)) {
            Some(near) => error.hint(format!("the nearest name that was given is {near}")),
            None => error,
        }
    }
}

/// A companion that was found.
pub(super) enum Located {
    /// In the file system.
    File(PathBuf),
    /// In memory.
    Bytes(Vec<u8>),
}

/// The file under the same name but for the case of letters and the direction of slashes.
fn similar_file(folder: &Path, name: &str) -> Option<PathBuf> {
    let mut path = folder.to_path_buf();
    for part in name.split(['/', '\\']).filter(|part| !part.is_empty() && *part != ".") {
        if part == ".." {
            path.push(part);
            continue;
        }
        let exact = path.join(part);
        path = if exact.exists() {
            exact
        } else {
            let entries = std::fs::read_dir(&path).ok()?;
            let mut same: Vec<PathBuf> = entries
                .flatten()
                .filter(|e| e.file_name().to_string_lossy().to_lowercase() == part.to_lowercase())
                .map(|e| e.path())
                .collect();
            same.sort();
            same.into_iter().next()?
        };
    }
    path.is_file().then_some(path)
}
