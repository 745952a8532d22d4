//! Scenes: from files to a [`Scene`], from a [`Scene`] to a [`Frame`].
//!
//! - [`Scene::load`] reads a scene file, or makes a scene of a bare asset. Everything that can be wrong with input is
//!   said here, with file, line, column and what to do.
//! - [`Scene::at`] gives one instant, or one shutter interval: posed shapes that answer rays, materials, lights, camera.
//! - [`schema`] is the layer below scene files: from one declaration come a table's type, its reader and its reference
//!   page. Techniques declare their settings with it too.
//! - [`spec`] holds the declarations for scene files, [`spec::scene_format_markdown`] the reference page.
//! - [`lights`] and [`camera`] are what a frame is lit by and seen through, [`media`] what light meets on the way.

mod bare;
mod build;
pub mod camera;
mod describe;
mod error;
mod frame;
mod framing;
mod geometry;
pub mod lights;
pub mod media;
mod motion;
mod posed;
pub mod sampling;
mod scene;
pub mod schema;
pub mod spec;

pub use describe::{Description, describe};
pub use error::SceneError;
pub use frame::Frame;
pub use posed::PosedObject;
pub use scene::{LoadOptions, Scene, Up};

/// The material that a text describes, as `--material` takes it: the name of a measured file, a metal, or a type and
/// its keys.
///
/// ```
/// use halflight_material::MaterialKind;
/// let material = halflight_scene::material_from_text("conductor metal=copper roughness=0.2")?;
/// assert!(matches!(material.kind, MaterialKind::Conductor { .. }));
/// # Ok::<(), halflight_scene::SceneError>(())
/// ```
///
/// # Errors
/// An unknown type, unknown keys, impossible values, or a file that cannot be loaded.
pub fn material_from_text(text: &str) -> Result<halflight_material::Material, SceneError> {
    let mut builder = build::Builder::default();
    let material = build::material_from_text(text, &mut builder)?;
    builder.reader.finish(Some(material)).map_err(SceneError::from)
}

/// What [`material_from_text`] reads, as the table of one line that a scene file would have in its place. Whether it is
/// a material shows when it is read.
///
/// ```
/// let table = halflight_scene::material_as_toml("copper roughness=0.2");
/// assert_eq!(table, r#"{ type = "conductor", metal = "copper", roughness = 0.2 }"#);
/// ```
pub fn material_as_toml(text: &str) -> String {
    build::material_as_toml(text)
}
