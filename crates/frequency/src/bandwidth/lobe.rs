//! ρ, the angular bandwidth of analytic lobes.
//!
//! For cosᵅ: the radius that holds 95 % of |FT|². A Gaussian of standard deviation r has the spectrum
//! exp(−2π²r²ν²), squared a Gaussian of variance 1/(8π²r²); with r² = 1/α the one-dimensional 95 % bound is
//! 1.96 √(α/8π²) = 0.2206 √α and the isotropic two-dimensional radius √(−2 ln 0.05) √(α/8π²) = 0.2755 √α.
//! Measured in one dimension on the lobes themselves: 0.288, 0.468, 0.895, 1.77, 3.53 for α = 1, 4, 16, 64, 256.

/// ρ per √α across one direction, cycles/rad.
pub const PHONG_LINE: f32 = 0.2206;

/// ρ per √α in two dimensions, cycles/rad.
pub const PHONG_RADIUS: f32 = 0.2755;

/// The one-dimensional bandwidth of cosᵅ, cycles/rad.
#[inline]
#[must_use]
pub fn phong_line(exponent: f32) -> f32 {
    PHONG_LINE * exponent.max(0.0).sqrt()
}

/// The radius of the two-dimensional bandwidth of cosᵅ, cycles/rad.
#[inline]
#[must_use]
pub fn phong(exponent: f32) -> f32 {
    PHONG_RADIUS * exponent.max(0.0).sqrt()
}

/// The exponent whose lobe has the two-dimensional bandwidth `lobe`: the inverse of [`phong`].
#[inline]
#[must_use]
pub fn phong_exponent(lobe: f32) -> f32 {
    let root = lobe.max(0.0) / PHONG_RADIUS;
    root * root
}
