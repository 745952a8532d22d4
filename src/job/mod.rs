//! From a scene and wishes to pictures: what the command and other programs share.
//!
//! | for | take |
//! |---|---|
//! | a scene with changes | [`Stage`] |
//! | one picture or [a part of it](Share) | [`Order`] |
//! | parts of a picture joined | [`merge`](merge::merge) |
//! | files | [`save`], [`Format`] |
//!
//! ```
//! use halflight::job::{Changes, Order, Stage, TechniqueSpec, create};
//! use halflight::{Budget, Quiet, trace::Simd};
//!
//! let stage = Stage::load("demo:cornell-box".as_ref(), &Changes::default(), Simd::detect())?;
//! let made = create(&TechniqueSpec::default(), &stage)?;
//! let budget = Budget { samples: Some(2), ..Budget::default() };
//! let order = Order { budget, size: "32x32".parse()?, ..Order::new(&stage, &made) };
//! let shot = order.shoot(0.0, 0.0, &Quiet)?;
//! assert_eq!(shot.picture.channel("R").map(<[f32]>::len), Some(32 * 32));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod error;
mod exposure;
mod layers;
pub mod merge;
mod order;
mod output;
mod part;
mod size;
mod stage;
mod technique;

pub use error::JobError;
pub use exposure::automatic_exposure;
pub use halflight_render::share::Share;
pub use layers::choose_layers;
pub use order::{Facts, Order, ShotPicture};
pub use output::{Encoding, Format, save};
pub use part::{Showing, part_name, save_part, save_share};
pub use size::Size;
pub use stage::{Changes, Stage};
pub use technique::{TechniqueSpec, create};
