//! Scenes: from files to a `Scene`, from a `Scene` to a `Frame`.

pub mod camera;
pub mod lights;
pub mod sampling;
pub mod schema;
pub mod spec;
