//! How fast light varies around a path in space, angle and time: a covariance matrix, and what each event on the way from
//! light to eye does to it.
//!
//! Around one ray the light field is a function l(z) of z = (x, y, u, v, t): position across the ray in metres, angle in
//! radians, time in seconds. With l̂ its Fourier transform over frequencies Ω in cycles per unit,
//!
//! ```text
//! Σ = ∫ Ω Ωᵀ |l̂(Ω)| dΩ / ∫ |l̂(Ω)| dΩ        for a Gaussian l of covariance C:   Σ = C⁻¹/4π²
//! ```
//!
//! For fields that are not Gaussian read twice the second moment of |l̂|², which is the same for Gaussians and for which every
//! law of this module that multiplies holds in the mean over random phases, and every linear one exactly.
//!
//! One rule gives all linear operators: if the light after an event is l₁(z) = l₀(T z), then **Σ₁ = Tᵀ Σ₀ T**. Each operator
//! below says its T. Multiplying by a Gaussian window of variance w adds 1/(4π² w); blurring by a kernel of variance b turns
//! Σ into (Σ⁻¹ + 4π² b)⁻¹, done without inverses, as light that comes from far away is singular.
//!
//! # Conventions
//! Angles are measured *against* the direction in which light travels, `[003]`'s convention: u = −dx/ds, so that travel and
//! convex curvature both have a plus, and a reflection needs no flip. It is the angle that the eye sees. In a plane of
//! incidence x and u lie in the plane, y and v across it. Curvature is 1/radius, convex positive.
//!
//! | event | light after it, l₁(z) = | method |
//! |---|---|---|
//! | travel d | l₀(x + d u, u) | [`Covariance::travel`] |
//! | other axes | l₀(R z) | [`Covariance::rotate`] |
//! | onto a surface, off it | l₀(x cos θ, …), l₀(x / cos θ, …) | [`Covariance::arrive`], [`Covariance::leave`] |
//! | curvature | l₀(x, u + K x) | [`Covariance::curve`] |
//! | an occluder's edge, a texture, a cosine | l₀ · window | [`Covariance::occlude`], [`Covariance::texture`], [`Covariance::cosine`] |
//! | reflection by a lobe | l₀ ∗ lobe, in angle | [`Covariance::reflect`] |
//! | refraction | l₀(x, g u), critical angle a window | [`Covariance::refract`] |
//! | thin lens | l₀(x, u − x/f) | [`Covariance::thin_lens`] |
//! | thick lens | two curved refractions and a travel | [`Covariance::thick_lens`] |
//! | motion | l₀(x + v t, u + w t, t) | [`Covariance::into_motion`], [`Covariance::out_of_motion`] |
//! | absorption | l₀ · exp(−½ xᵀ H x) | [`Covariance::absorb`] |
//! | scattering | aligned, scaled, l₀ ∗ phase function | [`Covariance::scatter`] |
//! | several paths | Σ w l | [`Mean`] |
//!
//! Source: `[003]`, corrected as `docs/errata.md` says; the printed forms are in [`printed`]. Error: linear operators 1e-9
//! against the analytic transform and 1e-6 against the numerical one (`tests/covariance`). Cost of an event in four
//! dimensions: some 100 ns (`cargo run --release -p halflight-frequency --example covariance_chains`).

mod chain;
mod lobes;
mod matrix;
mod operators;
pub mod printed;
mod sampling;

pub use chain::{Event, Steps};
pub use lobes::{
    henyey_greenstein_moment, henyey_greenstein_peak, lobe_from_log_hessian, microfacet_lobe, phong_lobe,
};
pub use matrix::{Covariance, Mean};
pub use operators::{Interface, Lens};
pub use sampling::{
    ThinLensCamera, kernel_precision, remaining, sampling_density, spatial_block, variance_within,
};

/// Light fields of the plane: (x, u).
pub type Covariance2 = Covariance<2>;
/// The same over time: (x, u, t).
pub type Covariance3 = Covariance<3>;
/// Light fields of space: (x, y, u, v).
pub type Covariance4 = Covariance<4>;
/// The same over time: (x, y, u, v, t).
pub type Covariance5 = Covariance<5>;
