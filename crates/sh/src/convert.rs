//! Coefficients of other libraries.
//!
//! Each convention is this crate's basis with other signs, scales or axes, so a conversion multiplies (and, for axes,
//! rotates) the coefficients:
//!
//! | convention | order of indices | what differs |
//! |---|---|---|
//! | [`Convention::Halflight`] | l² + l + m | |
//! | [`Convention::DirectXMath`] | l² + l + m | Condon–Shortley phase: odd m has the other sign |
//! | [`Convention::ThreeJs`] | l² + l + m, 9 coefficients | nothing; constants rounded to six digits |
//! | [`Convention::E3nn`] | l² + l + m | +y is the polar axis: its arguments (x, y, z) stand where ours are (z, x, y) |
//! | [`Convention::FilamentPhase`] | l² + l + m | Condon–Shortley phase, as Filament's unscaled `computeSH` writes |
//! | [`Convention::FilamentIrradiance`] | l² + l + m, 9 coefficients | irradiance/π of the coefficients, times the constants of the basis, so that a shader evaluates bare polynomials |
//!
//! Sources: the libraries' own code: DirectXMath `SHMath/DirectXSH.cpp` (`sh_eval_basis_*`), three.js
//! `SphericalHarmonics3.getBasisAt`, e3nn `o3/_spherical_harmonics.py` (normalization `integral`; `component` and `norm`
//! are scales of it, see [`E3nnNorm`]), Filament `libs/ibl/src/CubemapSH.cpp` (`computeSH` and
//! `computeIrradianceSH3Bands`, the form of `cmgen --sh`). What differs is a convention of the *basis*: the coefficients
//! of one and the same function on the sphere are converted. Axes of the world (which way is up) are not touched; turn
//! with [`Sh::rotated`] for that.

use std::f64::consts::PI;

use glam::DMat3;

use crate::tensor::band_and_m;
use crate::{Sh, ShError};

/// How a library writes coefficients.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Convention {
    /// This crate's: real, orthonormal, no Condon–Shortley phase, +z polar.
    Halflight,
    /// Microsoft's DirectXMath SHMath (`XMSHEvalDirection` and all that follows).
    DirectXMath,
    /// three.js `SphericalHarmonics3`, radiance.
    ThreeJs,
    /// e3nn `spherical_harmonics`.
    E3nn(E3nnNorm),
    /// Filament's `CubemapSH::computeSH`, radiance.
    FilamentPhase,
    /// Filament's pre-scaled irradiance of three bands, as `cmgen` writes and materials read.
    FilamentIrradiance,
}

/// The `normalization` of e3nn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum E3nnNorm {
    /// ∫ Y² = 1, as here.
    Integral,
    /// |Y^l|² = 2l + 1: √4π times the former.
    Component,
    /// |Y^l|² = 1.
    Norm,
}

impl Convention {
    /// All, with the names that [`Convention::from_name`] reads.
    pub const ALL: [(&'static str, Convention); 8] = [
        ("halflight", Convention::Halflight),
        ("directxmath", Convention::DirectXMath),
        ("threejs", Convention::ThreeJs),
        ("e3nn", Convention::E3nn(E3nnNorm::Integral)),
        ("e3nn-component", Convention::E3nn(E3nnNorm::Component)),
        ("e3nn-norm", Convention::E3nn(E3nnNorm::Norm)),
        ("filament", Convention::FilamentPhase),
        ("filament-irradiance", Convention::FilamentIrradiance),
    ];

    /// The convention of a name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Convention> {
        Self::ALL.iter().find(|(known, _)| *known == name).map(|&(_, convention)| convention)
    }

    /// The largest order that the library's form has.
    #[must_use]
    pub fn largest_order(self) -> usize {
        match self {
            Convention::ThreeJs | Convention::FilamentIrradiance => 3,
            Convention::DirectXMath => 6,
            _ => 8,
        }
    }

    /// What our coefficient is multiplied by (after the turn of the axes, for e3nn) to become the library's.
    fn factor(self, l: usize, m: i32) -> f64 {
        let phase = if m.rem_euclid(2) == 1 { -1.0 } else { 1.0 };
        match self {
            Convention::Halflight | Convention::ThreeJs | Convention::E3nn(E3nnNorm::Integral) => 1.0,
            Convention::DirectXMath | Convention::FilamentPhase => phase,
            // A basis that is larger has coefficients that are smaller.
            Convention::E3nn(E3nnNorm::Component) => 1.0 / (4.0 * PI).sqrt(),
            Convention::E3nn(E3nnNorm::Norm) => ((2.0 * l as f64 + 1.0) / (4.0 * PI)).sqrt(),
            Convention::FilamentIrradiance => {
                let cosine = [1.0, 2.0 / 3.0, 0.25][l.min(2)];
                let basis = match (l, m) {
                    (0, _) => 1.0 / (4.0 * PI),
                    (1, _) => 3.0 / (4.0 * PI),
                    // (3z² − 1) and (x² − y²) carry half and quarter of the others' constant.
                    (_, 0) => 5.0 / (16.0 * PI),
                    (_, 2) => 15.0 / (16.0 * PI),
                    _ => 15.0 / (4.0 * PI),
                };
                cosine * basis.sqrt()
            }
        }
    }
}

/// Our world's direction of e3nn's arguments: its polar axis y is our z, its z our x.
fn e3nn_axes() -> DMat3 {
    // f(ω) is written in e3nn as f of (x, y, z) = ω; ours evaluates y_lm at (z, x, y) of that.
    DMat3::from_cols(glam::DVec3::Y, glam::DVec3::Z, glam::DVec3::X)
}

fn check<const ORDER: usize>(convention: Convention) -> Result<(), ShError> {
    if ORDER > convention.largest_order() { Err(ShError::Order { order: ORDER }) } else { Ok(()) }
}

impl<const ORDER: usize> Sh<ORDER, f64> {
    /// This function's coefficients as a library writes them.
    ///
    /// # Errors
    /// An order that the library's form does not have.
    pub fn to_convention(&self, convention: Convention) -> Result<Vec<f64>, ShError> {
        check::<ORDER>(convention)?;
        let turned = match convention {
            Convention::E3nn(_) => self.rotated(&e3nn_axes()),
            _ => *self,
        };
        Ok((0..ORDER * ORDER)
            .map(|i| {
                let (l, m) = band_and_m(i);
                turned[i] * convention.factor(l, m)
            })
            .collect())
    }

    /// The function whose coefficients a library wrote.
    ///
    /// Irradiance becomes radiance: bands are divided by the cosine's factors, which the first three bands all have.
    ///
    /// # Errors
    /// Another number of coefficients, or an order that the library's form does not have.
    pub fn from_convention(convention: Convention, coefficients: &[f64]) -> Result<Self, ShError> {
        check::<ORDER>(convention)?;
        if coefficients.len() != ORDER * ORDER {
            return Err(ShError::Length {
                what: "coefficients",
                expected: ORDER * ORDER,
                found: coefficients.len(),
            });
        }
        let ours = Self::from_fn(|i| {
            let (l, m) = band_and_m(i);
            coefficients[i] / convention.factor(l, m)
        });
        Ok(match convention {
            Convention::E3nn(_) => ours.rotated(&e3nn_axes().transpose()),
            _ => ours,
        })
    }
}
