//! The bandwidth of pictures in linear time, of the whole or around each texel.
//!
//! A separable wavelet pyramid splits a picture's power into octaves, i = 0 the finest; the bandwidth is the upper end of
//! the first octave, counted from the finest, at which 5 % of the power has been passed:
//!
//! ```text
//! I = smallest i with Σ_{k ≤ i} E_k ≥ 5 % of Σ E          ν = 2^−(I+1) cycles per texel
//! ```
//!
//! Source: `[001]` §2.3 and eq. (7) in its verified form: as printed, eq. (7) sums the coarse tail and compares amplitudes,
//! which gives the finest level for almost any picture ([`printed`]).
//!
//! Around a texel, E_k is the power per texel of those wavelets that lie over it. Horizontal and vertical detail are
//! counted apart, each at its own frequency in cycles per radian or metre, so that maps whose texels are not square (all
//! latitude–longitude maps, near their poles) need no detour: the quantile is taken over true frequencies. Where texels are
//! square this is the rule above.
//!
//! Far light must not hide near detail: the coarse wavelets around a texel may be full of a sun that stands elsewhere. Their
//! power is therefore limited to the variance that the picture really has within two to three [`NEIGHBOURHOOD`]s of the texel.
//!
//! Error: conservative by 1.25 to 2.5 ([`Filter::Smooth`]), up to 5 ([`Filter::Haar`]); with [`Rule::Within`] 1.1 to 1.8
//! times the windowed transform (`tests/wavelets.rs`). Cost: `cargo run --release -p halflight-frequency --example bandwidth_rate`.

mod filter;
mod local;
mod padded;
pub mod printed;
mod pyramid;
mod rule;

pub use filter::{Border, Filter};
pub use local::{NEIGHBOURHOOD, local_bandwidth};
pub use padded::{padded_local_bandwidth, polygon_mask};
pub use pyramid::{Level, Pyramid};
pub use rule::{NEGLIGIBLE_CONTRAST, Rule, TAIL, whole_bandwidth};

use halflight_image::{Plane, RgbImage};

/// Rec. 709 luminance of a picture.
#[must_use]
pub fn luminance(picture: &RgbImage) -> Plane {
    let values = picture.pixels.iter().map(|p| 0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2]).collect();
    Plane { width: picture.width, height: picture.height, values }
}
