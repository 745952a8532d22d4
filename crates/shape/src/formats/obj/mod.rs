//! Wavefront OBJ.

use std::path::Path;

use halflight_file::LoadError;

use super::Resolver;
use crate::Model;

pub(super) const ASKED: &str = "OBJ mesh";

/// Reads an OBJ file from memory.
///
/// # Errors
/// Always, for now.
pub fn decode_obj(_bytes: &[u8], name: &Path, _companions: &Resolver) -> Result<Model, LoadError> {
    Err(LoadError::new(ASKED, name, "OBJ is not read yet"))
}
