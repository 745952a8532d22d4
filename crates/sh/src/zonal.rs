//! Zonal harmonics: functions that depend only on the angle to an axis, one coefficient for each band.
//!
//! With the axis along +z these are the coefficients with m = 0; turning the axis to a direction d costs one evaluation
//! of the basis: `f_lm = √(4π/(2l+1)) z_l y_lm(d)`.

use std::f64::consts::PI;
use std::ops::{Add, Mul, Sub};

use crate::legendre::legendre;
use crate::sh::{SQRT_4PI, zonal_factor};
use crate::{Real, Sh};

/// A function around an axis as `ORDER` coefficients z_l.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(transparent)]
pub struct Zh<const ORDER: usize, T = f32>(pub [T; ORDER]);

impl<const ORDER: usize, T: Real> Zh<ORDER, T> {
    /// The function 1.
    #[must_use]
    pub fn one() -> Self {
        Zh(std::array::from_fn(|l| T::of(if l == 0 { SQRT_4PI } else { 0.0 })))
    }

    /// The indicator of the cap of a half-angle: 1 within, 0 outside.
    ///
    /// z_0 = √π (1 − c), z_l = 2π K_l0 (P_{l−1}(c) − P_{l+1}(c))/(2l + 1) with c the cosine of the half-angle. The four
    /// closed forms of \[000\] are the first four of these.
    #[must_use]
    pub fn cap(half_angle: f64) -> Self {
        let c = half_angle.cos();
        let p = legendre(ORDER + 1, c);
        Zh(std::array::from_fn(|l| {
            T::of(if l == 0 {
                // 1 − cos without its cancellation.
                PI.sqrt() * 2.0 * (half_angle * 0.5).sin().powi(2)
            } else {
                let n = 2.0 * l as f64 + 1.0;
                2.0 * PI * (n / (4.0 * PI)).sqrt() * (p[l - 1] - p[l + 1]) / n
            })
        }))
    }

    /// max(cos θ, 0).
    #[must_use]
    pub fn clamped_cosine() -> Self {
        let lobe = Zh::<ORDER, f64>::phong(1.0);
        Zh(lobe.0.map(|z| T::of(z * PI)))
    }

    /// The Phong lobe (α + 1)/2π · max(cos θ, 0)^α, whose integral is 1. `exponent` is not negative.
    ///
    /// ∫₀¹ x^α P_l(x) dx follows from that of l − 2 by the factor (α − l + 2)/(α + l + 1).
    #[must_use]
    pub fn phong(exponent: f64) -> Self {
        let mut integral = [0.0; ORDER];
        for l in 0..ORDER {
            integral[l] = match l {
                0 => 1.0 / (exponent + 1.0),
                1 => 1.0 / (exponent + 2.0),
                _ => integral[l - 2] * (exponent - l as f64 + 2.0) / (exponent + l as f64 + 1.0),
            };
        }
        Zh(std::array::from_fn(|l| {
            T::of((exponent + 1.0) * ((2.0 * l as f64 + 1.0) / (4.0 * PI)).sqrt() * integral[l])
        }))
    }

    /// The function with its axis along a unit direction.
    #[inline(always)]
    #[must_use]
    pub fn to_direction(&self, axis: impl Into<[T; 3]>) -> Sh<ORDER, T> {
        let mut sh = Sh::basis(axis);
        scale_bands(&mut sh, &self.scaled());
        sh
    }

    /// z_l √(4π/(2l+1)).
    #[inline(always)]
    pub(crate) fn scaled(&self) -> [T; ORDER] {
        let mut scaled = self.0;
        for l in 0..ORDER {
            scaled[l] = scaled[l] * T::of(zonal_factor(l));
        }
        scaled
    }

    /// The function with its axis along +z.
    #[must_use]
    pub fn to_sh(&self) -> Sh<ORDER, T> {
        let mut sh = Sh::zero();
        for l in 0..ORDER {
            sh[l * l + l] = self.0[l];
        }
        sh
    }

    /// The part of a function that depends only on the angle to +z.
    #[must_use]
    pub fn of_sh(sh: &Sh<ORDER, T>) -> Self {
        Zh(std::array::from_fn(|l| sh[l * l + l]))
    }

    /// Each coefficient changed by a function.
    #[must_use]
    pub fn map<U: Real>(&self, change: impl FnMut(T) -> U) -> Zh<ORDER, U> {
        Zh(self.0.map(change))
    }
}

impl<const ORDER: usize> Zh<ORDER, f64> {
    /// The same coefficients in f32.
    #[must_use]
    pub fn cast(&self) -> Zh<ORDER, f32> {
        self.map(|z| z as f32)
    }

    /// The value at an angle from the axis.
    #[must_use]
    pub fn at_angle(&self, angle: f64) -> f64 {
        let p = legendre(ORDER, angle.cos());
        (0..ORDER).map(|l| self.0[l] * ((2.0 * l as f64 + 1.0) / (4.0 * PI)).sqrt() * p[l]).sum()
    }
}

/// Multiplies each band by its factor.
#[inline(always)]
pub(crate) fn scale_bands<const ORDER: usize, T: Real>(sh: &mut Sh<ORDER, T>, factors: &[T; ORDER]) {
    for l in 0..ORDER {
        for i in l * l..(l + 1) * (l + 1) {
            sh[i] = sh[i] * factors[l];
        }
    }
}

impl<const ORDER: usize, T: Real> Add for Zh<ORDER, T> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Zh(std::array::from_fn(|l| self.0[l] + other.0[l]))
    }
}

impl<const ORDER: usize, T: Real> Sub for Zh<ORDER, T> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Zh(std::array::from_fn(|l| self.0[l] - other.0[l]))
    }
}

impl<const ORDER: usize, T: Real> Mul<T> for Zh<ORDER, T> {
    type Output = Self;
    fn mul(self, factor: T) -> Self {
        Zh(self.0.map(|z| z * factor))
    }
}
