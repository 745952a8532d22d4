//! Why no spheres could be fitted.

use super::MAX_SPHERES;
use crate::MeshError;

/// Why no spheres could be fitted to a mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SphereFitError {
    /// No sphere at all was asked for.
    #[error("a set of 0 spheres was asked for: at least 1 is needed")]
    NoSpheres,
    /// More spheres than a set may have.
    #[error("a set of {asked} spheres was asked for: at most {MAX_SPHERES} can be fitted")]
    TooManySpheres {
        /// The number.
        asked: usize,
    },
    /// There is nothing to cover.
    #[error("{name} has no surface: none of its {triangles} triangles has an area")]
    NoSurface {
        /// The name of the mesh.
        name: String,
        /// How many triangles there are.
        triangles: usize,
    },
    /// The mesh cannot be used.
    #[error("{name}: {error}")]
    Mesh {
        /// The name of the mesh.
        name: String,
        /// What is wrong with it.
        error: MeshError,
    },
}
