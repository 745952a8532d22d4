//! Real spherical harmonics for light and visibility.
//!
//! # Conventions
//! Real and orthonormal, **without Condon–Shortley phase**; coefficient (l, m) has index l² + l + m; *order n* means
//! the bands 0 … n−1, n² coefficients; +z is the polar axis:
//!
//! ```text
//! y_lm = √2 K_lm cos(mφ)   P_l^m(cos θ)       m > 0
//! y_l0 =    K_l0           P_l(cos θ)
//! y_lm = √2 K_lm sin(|m|φ) P_l^|m|(cos θ)     m < 0      K_lm = √((2l+1)(l−|m|)! / (4π(l+|m|)!))
//! ```
//!
//! so the first band is √(3/4π)·(y, z, x) with positive signs. A direction (x, y, z) of the world is used as it is:
//! the polar axis is the world's +z, though the world's up is +y. Libraries that keep the phase (DirectXMath) differ in
//! the sign of every coefficient with odd m; [`convert`] knows them by name. Angles are in radians.
//!
//! # What is where
//! | | |
//! |---|---|
//! | [`Sh`], [`Zh`], [`Rotation`], [`ProductMatrix`] | vectors, zonal vectors, and what is done with them |
//! | [`Exponential`], [`Sh::log`], [`Sh::exp`] | exponentials, exact logarithm |
//! | [`BlockerTable`], [`LobeTable`], [`attenuation`] | log-visibility of spheres, log-lobes |
//! | [`batch`] | sixteen vectors side by side, for inner loops |
//! | [`project`], [`window`] | from functions and images to coefficients, and their ringing |
//! | [`convert`] | conventions of other libraries |
//! | [`study`] | random sets of blockers, on which errors are stated |
//! | [`mod@bench`], [`mod@reference`] | what the kernels cost, and what they are tested against |
//!
//! # Example
//! ```
//! use glam::Vec3;
//! use halflight_sh::{Exponential, Sh, Zh};
//!
//! // A blocker of half-angle 0.4 overhead, as visibility; its shadow on a white sky, seen by a surface that faces it.
//! let visible = Sh::<4>::one() - Zh::cap(0.4).to_direction(Vec3::Z);
//! let cosine = Zh::clamped_cosine().to_direction(Vec3::Z);
//! let irradiance = visible.dot(&cosine);
//! assert!((irradiance - std::f32::consts::PI * 0.4f32.cos().powi(2)).abs() < 0.05);
//!
//! // Shadows multiply, so their logarithms add.
//! let log = visible.log(0.02);
//! let twice = Exponential::default().apply(&(log + log));
//! assert!(twice.dot(&cosine) < irradiance);
//! ```

pub mod attenuation;
pub mod batch;
pub mod bench;
mod blocker;
pub mod convert;
mod eigen;
mod error;
mod exponential;
mod kernels;
mod legendre;
mod lobe;
mod log_exp;
mod numbers;
pub mod project;
mod real;
pub mod reference;
mod rotation;
mod sh;
mod simd;
pub mod study;
mod tensor;
pub mod window;
mod zonal;

pub use blocker::{BlockerTable, ClosedForm, closed_form, exact_log_visibility};
pub use error::ShError;
pub use exponential::{Exponential, optimal_linear};
pub use lobe::{LobeTable, log_lobe};
pub use project::ShRgb;
pub use real::Real;
pub use rotation::{Matrix3, Rotation};
pub use sh::{ProductMatrix, Sh};
pub use simd::{Kernel, Lane, Simd, UnknownSimd};
pub use zonal::Zh;

/// Orders that this crate computes with.
pub const ORDERS: std::ops::RangeInclusive<usize> = 1..=8;
