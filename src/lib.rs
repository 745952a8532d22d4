//! halflight renders scenes that move, under light that comes from everywhere, with materials that were measured.
//!
//! This is the library; the command of the same name is built on it. A scene goes down this page, from file to
//! picture:
//!
//! ```
//! use halflight::image::{Precision, ToneMapping, save_png};
//! use halflight::{Budget, Film, LoadOptions, Quiet, Scene, Technique, techniques};
//!
//! let folder = std::env::temp_dir().join(format!("halflight-example-{}", std::process::id()));
//! std::fs::create_dir_all(&folder)?;
//! let file = folder.join("ball.toml");
//! std::fs::write(
//!     &file,
//!     r#"
//!     environment = "sky"
//!
//!     [[shape]]
//!     type = "sphere"
//!     center = [0, 1, 0]
//!     radius = 1
//!     material = { type = "conductor", metal = "copper", roughness = 0.3 }
//!
//!     [[shape]]
//!     type = "plane"
//!     "#,
//! )?;
//!
//! // What there is, as functions of time; then one instant of it, which answers rays.
//! let scene = Scene::load(&file, &LoadOptions::default())?;
//! let frame = scene.at(0.0)?;
//!
//! // A technique fills a film until its budget is spent.
//! let mut film = Film::new(64, 36);
//! let budget = Budget { samples: Some(8), ..Budget::default() };
//! let report = techniques::path::Path::default().render(&frame, &mut film, &budget, &Quiet)?;
//! println!("{} rays, relative error {:?}", report.rays, report.relative_error);
//!
//! film.picture().save_exr(&folder.join("ball.exr"), Precision::Half)?;
//! save_png(&folder.join("ball.png"), &film.image(), &ToneMapping::default())?;
//! assert!(film.image().pixels.iter().flatten().any(|&radiance| radiance > 0.1));
//! # std::fs::remove_dir_all(&folder)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | module | what lives there |
//! |---|---|
//! | [`mod@file`] | reading and writing files whole, errors with a story |
//! | [`image`] | pictures in memory and on disk, error metrics, the comparison page |
//! | [`material`] | how surfaces scatter light: analytic and measured |
//! | [`shape`] | meshes, models, height fields, procedural shapes |
//! | [`ddf`] | geometry as learned fields of directed distances |
//! | [`trace`] | rays against everything |
//! | [`scene`] | scene files, lights, cameras, animation |
//! | [`render`] | the film, samplers, and the techniques |
//! | [`job`], [`demos`] | from scenes and wishes to files of pictures; the scenes that are built in |
//! | [`sphere_visibility`] | how far the shadows of a sphere set are from those of its mesh |

pub use halflight_ddf as ddf;
pub use halflight_file as file;
pub use halflight_image as image;
pub use halflight_material as material;
pub use halflight_render as render;
pub use halflight_scene as scene;
pub use halflight_shape as shape;
pub use halflight_trace as trace;

pub mod demos;
pub mod job;
pub mod sphere_visibility;

pub use render::{Budget, Film, Progress, Quiet, RenderReport, Technique, TechniqueError, techniques};
pub use scene::{Frame, LoadOptions, Scene, SceneError};
