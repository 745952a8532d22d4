//! What can be wrong with a mesh or with what is asked of it.

/// Why no field can be made.
#[derive(Debug, thiserror::Error)]
pub enum DdfError {
    /// The mesh has no triangle with an area.
    #[error(
        "the mesh has no surface: {triangles} triangles, none with an area; a field of distances needs something to be distant from"
    )]
    NoSurface {
        /// How many triangles it has.
        triangles: usize,
    },
    /// The mesh is broken.
    #[error("the mesh cannot be used: {0}")]
    Mesh(#[from] halflight_shape::MeshError),
    /// The mesh is too large.
    #[error(
        "the mesh has {triangles} triangles; fields are trained from at most {most}: simplify it, or train from its parts"
    )]
    TooLarge {
        /// How many triangles it has.
        triangles: usize,
        /// How many are possible.
        most: usize,
    },
    /// A number is out of range.
    #[error("{0}")]
    Setting(String),
    /// Training left the range of numbers.
    #[error("training diverged in step {step}: a weight is no longer a number; try a lower learning rate")]
    Diverged {
        /// The step after which it was noticed.
        step: u64,
    },
}
