//! How fast light varies along a path: the two-dimensional bandwidth (cycles per metre, cycles per radian) and what each
//! event on the way does to it.
//!
//! Around one ray the light field is a function of position x across the ray and angle u = dx/dtravel. The spectrum of what
//! one light sends along one path is a line through the origin of the frequency plane; a [`Bandwidth`] is the end of that
//! line, with signs, and every event is a matrix (`verified mathematics`, §5, flatland):
//!
//! ```text
//! ν = T_d' P_x C_-c B C_-c P_i T_d ν_light
//! T_d = [1 0; −d 1]   P_i = diag(cos θ_i, 1)   P_x = diag(1/cos θ_x, 1)   C_c = [1 c; 0 1]      c > 0: convex
//! B ν = ν · min(1, ρ/|ν_a|), then widened in space by the texture's t
//! ```
//!
//! Source: `[001]` Fig. 4 and eq. (3)–(6), (9)–(11), in their corrected forms; what was printed is in [`printed`], for the
//! tests that show the difference. The seed's mirror S is not among the operators: with it, the two travels of a local light
//! subtract (a plane mirror would give |d − d'|). See `docs/errata.md`.
//!
//! | | |
//! |---|---|
//! | [`Bandwidth`] | one operator at a time |
//! | [`Chain`] | the same, remembering every step, for explanations |
//! | [`Exit`] | the whole chain in closed form, for one or sixteen directions: what runs per pixel |
//! | [`pixel`] | cycles per pixel, level of the pyramid, anisotropy |
//! | [`variance`] | second moments and sample counts |
//! | [`lobe`] | ρ of analytic lobes |
//!
//! Error, as prediction over the 95 % radius of a windowed FFT, 5/50/95 percentiles with [`Exit::roundness`]: planes
//! 1.01/1.02/1.11, spheres 0.94/1.03/1.18, through a lobe 0.86/0.98/1.16, cylinders 0.86/0.99/1.33 (`tests/predicted.rs`;
//! without `roundness` up to 1.25 higher). Cost:
//! `cargo run --release -p halflight-frequency --example bandwidth_rate`.

mod bounce;
mod chain;
pub mod lobe;
mod operators;
pub mod pixel;
pub mod printed;
pub mod variance;

pub use bounce::Exit;
pub use chain::{Chain, Operator, Step};
pub use operators::{Bandwidth, GRAZING, UNLIMITED, bounded};
