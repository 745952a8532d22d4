//! Tests for scattering functions, for those of this crate and for your own.
//!
//! A sampler, a density and a value have to agree with each other and with physics:
//!
//! - [`chi_square`]: directions come as often as the density says, and the value a sample carries is the value
//!   that is evaluated. [`chi_square_of`] does the first for any sampler of directions.
//! - [`furnace`]: what a uniform light is returned as: never more than one.
//! - [`reciprocity_error`]: light goes both ways alike.
//! - [`never_breaks`]: no two directions, however degenerate, give anything that is not a finite number.
//!
//! Each draws its randomness from a seed: the same call gives the same answer.
//!
//! ```
//! use glam::Vec3;
//! use halflight_material::{Material, SurfaceInput, test_kit};
//! let metal = Material::metal("gold", 0.4).expect("a known metal");
//! let bsdf = metal.bsdf(&SurfaceInput::default());
//! let wo = Vec3::new(0.6, 0.0, 0.8);
//! let report = test_kit::chi_square(&bsdf, wo, &test_kit::ChiSquare::default());
//! assert!(report.passes(), "{report}");
//! assert!(test_kit::furnace(&bsdf, wo, 1.0, 4096, 1).albedo.max_element() < 1.0);
//! ```

mod chi_square;
mod partition;
mod physics;
mod statistics;

pub use chi_square::{ChiSquare, ChiSquareReport, chi_square, chi_square_of};
pub use physics::{Furnace, furnace, never_breaks, reciprocity_error};
pub use statistics::{Random, chi_square_p_value, sidak_threshold};
