//! From covariance at the film to samples and filters.
//!
//! At the film the axes are (x, y) in pixels, (u, v) on the lens in metres, and time in shutters; a picture is the light
//! field integrated over lens and shutter and over each pixel. With W the variances of what is integrated over:
//!
//! ```text
//! what remains of one sample's variance    1 − det(1 + 4π² W Σ)^(−½)          (a random field of that spectrum)
//! reconstruction kernel                    exp(−½ xᵀ S x),  S = 4π² [(Σ⁻¹)_xx]⁻¹
//! sampling density                         √det of the spatial block, in samples per pixel
//! ```

use super::matrix::{Covariance, FOUR_PI_SQUARED};

/// A camera's part in the chain, in front of one pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinLensCamera {
    /// Width of a pixel on the plane at distance 1 (2 tan(f/2)/W), across and down.
    pub pixel: [f64; 2],
    /// Distance of the plane of focus, metres.
    pub focus_distance: f64,
    /// Radius of the lens, metres; 0 is a pinhole.
    pub aperture_radius: f64,
}

impl ThinLensCamera {
    /// From the light that arrives at the lens, axes along the film's, to the film: the ray of pixel s and lens point p has
    /// x = p and u = s − p/f. Angles are those from the axis, as slopes.
    #[must_use]
    pub fn film<const N: usize>(&self, light: &Covariance<N>) -> Covariance<N> {
        let power = if self.focus_distance > 0.0 { 1.0 / self.focus_distance } else { 0.0 };
        let mut t = [[0.0; N]; N];
        for axis in 0..Covariance::<N>::SPACE {
            let angle = N / 2 + axis;
            t[axis][angle] = 1.0;
            t[angle][axis] = self.pixel[axis.min(1)];
            t[angle][angle] = -power;
        }
        if let Some(time) = Covariance::<N>::time() {
            t[time][time] = 1.0;
        }
        light.transformed(&t)
    }

    /// W: the variances that a pixel integrates over; a pixel's is 1/12, a disc's a²/4 per axis, a shutter's 1/12.
    #[must_use]
    pub fn integrated<const N: usize>(&self, shutter: bool) -> [f64; N] {
        let mut w = [0.0; N];
        for axis in 0..Covariance::<N>::SPACE {
            w[axis] = 1.0 / 12.0;
            w[N / 2 + axis] = 0.25 * self.aperture_radius * self.aperture_radius;
        }
        if let Some(time) = Covariance::<N>::time() {
            w[time] = if shutter { 1.0 / 12.0 } else { 0.0 };
        }
        w
    }
}

/// What part of a field's variance is met by samples spread with variances `w` about a point: 1 − det(1 + 4π² W Σ)^(−½).
///
/// A random field whose |l̂|² is a Gaussian of covariance Σ/2 has the correlation exp(−π² δᵀ Σ δ); two samples
/// differ by δ of covariance 2W, and the mean of that is the determinant.
#[must_use]
pub fn variance_within<const N: usize>(covariance: &Covariance<N>, w: &[f64; N]) -> f64 {
    let scaled = w.map(|w| FOUR_PI_SQUARED * w);
    1.0 - 1.0 / covariance.determinant_of_one_plus(&scaled).sqrt()
}

/// The spectrum of the picture: everything but the film integrated over windows of variance `w` (0 leaves an axis alone: a
/// pinhole sees the slice at its own point).
#[must_use]
pub fn remaining<const N: usize>(covariance: &Covariance<N>, w: &[f64; N]) -> Covariance<N> {
    let mut result = *covariance;
    for axis in Covariance::<N>::SPACE..N {
        if w[axis] > 0.0 {
            // The window widens the spectrum, the integral takes its slice at zero.
            result = result.windowed(axis, w[axis]).integrated(axis);
        }
    }
    result
}

/// The spatial block [xx, xy, yy]; in the plane the same twice.
#[must_use]
pub fn spatial_block<const N: usize>(covariance: &Covariance<N>) -> [f64; 3] {
    let rows = &covariance.rows;
    if N < 4 { [rows[0][0], 0.0, rows[0][0]] } else { [rows[0][0], rows[0][1], rows[1][1]] }
}

/// S [xx, xy, yy] of the kernel exp(−½ xᵀ S x) that keeps what the spectrum holds: S = 4π² [(Σ⁻¹)_xx]⁻¹, all but the
/// film's two axes integrated.
#[must_use]
pub fn kernel_precision<const N: usize>(covariance: &Covariance<N>) -> [f64; 3] {
    let mut sliced = *covariance;
    for axis in Covariance::<N>::SPACE..N {
        sliced = sliced.integrated(axis);
    }
    spatial_block(&sliced).map(|value| FOUR_PI_SQUARED * value)
}

/// Samples per unit of area that the spatial block asks for: √det Σ_xx, per pixel if Ω is in cycles per pixel.
#[must_use]
pub fn sampling_density([xx, xy, yy]: [f64; 3]) -> f64 {
    (xx * yy - xy * xy).max(0.0).sqrt()
}
