//! Film, samplers, and the techniques that turn a frame into a picture.
//!
//! A [`Technique`] is handed a [`halflight_scene::Frame`] and a [`Film`]; it knows nothing of files, commands or windows.

pub mod camera_sample;
pub mod checkpoint;
mod content;
mod cutouts;
pub mod features;
pub mod film;
mod gbuffer;
mod looks;
pub mod sampler;
pub mod samplers;
mod sh_light;
pub mod share;
pub mod technique;
pub mod techniques;
mod tracking;
pub mod vertex;

pub use film::{Film, Region};
pub use share::Share;
pub use technique::{Budget, Progress, Quiet, RenderReport, Technique, TechniqueError};
