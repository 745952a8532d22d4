//! Local frequency analysis: how fast light, lobes, textures and pictures vary, before anything is shaded.
//!
//! Frequencies are in cycles per metre, per radian, per texel or per pixel, never in radians per anything. The bandwidth of
//! a signal is the frequency above which 5 % of its power lies.
//!
//! | | |
//! |---|---|
//! | [`bandwidth`] | bandwidth vectors, their operators along a path, pixels, levels, sample counts |
//! | [`covariance`] | covariance matrices over space, angle and time, their operators, sampling densities, filters |
//! | [`wavelet`] | the bandwidth of pictures in linear time, of the whole or around each texel |
//! | [`mapping`] | the same in cycles per radian or metre: environments, textures on surfaces, area lights |
//! | [`reflectance`] | tables of ρ for any reflectance |
//! | [`importance`] | importance samples made beforehand, by inverted distributions |
//! | [`preconvolved`] | environments convolved with lobes |
//! | [`measured`] | the windowed Fourier transform that predictions are held against |
//!
//! ```
//! use halflight_frequency::bandwidth::{Bandwidth, Chain, Exit, lobe, pixel};
//!
//! // A sphere of 0.5 m, 3 m away, shiny, under a sky with detail of 8 cycles per radian.
//! let rho = lobe::phong(256.0);
//! let exit = Exit { curvature: 2.0, distance: 3.0, cos_exit: 0.8, texture: 0.0 };
//! let at_eye = exit.distant(8.0, rho);
//!
//! // The same, explained.
//! let chain = Chain::new(Bandwidth::distant(8.0)).reflect(0.8, 2.0, 0.0, rho, 0.8).travel(3.0);
//! assert!((chain.bandwidth().angular - at_eye.angular).abs() < 1e-3);
//!
//! let per_pixel = pixel::pixel_bandwidth(at_eye.angular, 0.002, 0.002);
//! assert_eq!(pixel::level(per_pixel, -2, 9), 1);
//! ```

pub mod bandwidth;
pub mod covariance;
pub mod importance;
pub mod mapping;
pub mod measured;
pub mod preconvolved;
pub mod reflectance;
pub mod wavelet;
