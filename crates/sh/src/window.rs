//! Windows: bands scaled down so that a truncated function rings less.
//!
//! A window multiplies band l by σ_l. Sources: P.-P. Sloan, Stupid Spherical Harmonics Tricks, 2008 (Hanning, Lanczos);
//! the automatic strength follows the idea of Filament: the weakest window that leaves nothing negative.

use std::f64::consts::PI;

use crate::zonal::scale_bands;
use crate::{Real, Sh, reference};

/// A family of factors σ_l.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Window {
    /// (1 + cos(πl/w))/2, zero from l = w on.
    Hanning {
        /// w, in bands; twice the order is mild.
        width: f64,
    },
    /// sin x/x with x = πl/w, zero from l = w on.
    Lanczos {
        /// w, in bands; one more than the order is usual.
        width: f64,
    },
}

impl Window {
    /// σ_l. A width that is not positive keeps only band 0.
    #[must_use]
    pub fn factor(&self, l: usize) -> f64 {
        let (Window::Hanning { width } | Window::Lanczos { width }) = *self;
        let x = l as f64 / width;
        match self {
            _ if l == 0 => 1.0,
            // Also where the width is not a number.
            _ if !(0.0..1.0).contains(&x) => 0.0,
            Window::Hanning { .. } => 0.5 * (1.0 + (PI * x).cos()),
            Window::Lanczos { .. } => (PI * x).sin() / (PI * x),
        }
    }

    /// The same family with another width.
    #[must_use]
    pub fn with_width(self, width: f64) -> Window {
        match self {
            Window::Hanning { .. } => Window::Hanning { width },
            Window::Lanczos { .. } => Window::Lanczos { width },
        }
    }
}

impl<const ORDER: usize, T: Real> Sh<ORDER, T> {
    /// The function with its bands scaled by a window.
    #[must_use]
    pub fn windowed(&self, window: Window) -> Self {
        let mut sh = *self;
        scale_bands(&mut sh, &std::array::from_fn(|l| T::of(window.factor(l))));
        sh
    }
}

/// The smallest value of a function, over a quadrature's nodes refined around the smallest.
#[must_use]
pub fn minimum<const ORDER: usize>(sh: &Sh<ORDER, f64>) -> f64 {
    let (mut direction, mut lowest) = (glam::DVec3::Z, f64::INFINITY);
    for (d, _) in reference::sphere_quadrature(6 * ORDER) {
        let value = sh.at(d);
        if value < lowest {
            (direction, lowest) = (d, value);
        }
    }
    // Walk downhill in ever smaller steps.
    let mut step = 0.2 / ORDER as f64;
    while step > 1e-7 {
        let (a, b) = direction.any_orthonormal_pair();
        let better = [a, -a, b, -b]
            .into_iter()
            .map(|side| (direction + side * step).normalize())
            .find(|d| sh.at(*d) < lowest);
        match better {
            Some(d) => (direction, lowest) = (d, sh.at(d)),
            None => step *= 0.5,
        }
    }
    lowest
}

/// The widest window of a family, up to a width of 64 bands, under which all functions stay above −1e-6 of their mean;
/// and the functions under it. Functions without negative values come back as they are, with no window; those with a
/// negative mean cannot be helped and keep only that.
#[must_use]
pub fn to_non_negative<const ORDER: usize, const N: usize>(
    functions: &[Sh<ORDER>; N],
    family: Window,
) -> ([Sh<ORDER>; N], Option<Window>) {
    let double: [Sh<ORDER, f64>; N] = functions.map(|sh| sh.cast());
    let fits = |window: Option<Window>| {
        double.iter().all(|sh| {
            let sh = window.map_or(*sh, |window| sh.windowed(window));
            minimum(&sh) >= -1e-6 * sh[0].abs() / crate::sh::SQRT_4PI
        })
    };
    if fits(None) {
        return (*functions, None);
    }
    let (mut narrow, mut wide) = (0.0, 64.0);
    for _ in 0..24 {
        let middle = 0.5 * (narrow + wide);
        if fits(Some(family.with_width(middle))) {
            narrow = middle;
        } else {
            wide = middle;
        }
    }
    let window = family.with_width(narrow);
    (functions.map(|sh| sh.windowed(window)), Some(window))
}
