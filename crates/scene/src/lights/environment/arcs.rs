//! Sine, cosine and their arcs, fast enough to be called for every direction that is drawn or looked up.
//!
//! Written without branches and inlined always, so that loops over them become vector instructions.

use std::f32::consts::{FRAC_PI_2, PI};

/// acos with an absolute error below 1e-6 radians (Abramowitz and Stegun 4.4.46).
#[inline(always)]
pub(super) fn fast_acos(x: f32) -> f32 {
    let a = x.abs().min(1.0);
    let p = FRAC_PI_2
        + a * (-0.214_598_8
            + a * (0.088_978_99
                + a * (-0.050_174_303
                    + a * (0.030_891_88 + a * (-0.017_088_126 + a * (0.006_670_09 - a * 0.001_262_491_1))))));
    let angle = (1.0 - a).sqrt() * p;
    if x < 0.0 { PI - angle } else { angle }
}

/// (sin, cos) of `turns` full turns, up to 1e5 of them, with an absolute error below 1e-6: reduced to an eighth of a turn around a
/// multiple of a quarter, there the Taylor polynomials of degrees 7 and 8.
#[inline(always)]
pub(super) fn fast_sin_cos_of_turns(turns: f32) -> (f32, f32) {
    // Adding this rounds to whole numbers, and leaves them in the lowest bits.
    const TO_WHOLE: f32 = 12_582_912.0;
    let shifted = 4.0 * turns + TO_WHOLE;
    let quarters = shifted.to_bits();
    let x = FRAC_PI_2 * (4.0 * turns - (shifted - TO_WHOLE));
    let s = x * x;
    let sin = x * (1.0 + s * (-1.0 / 6.0 + s * (1.0 / 120.0 - s / 5040.0)));
    let cos = 1.0 + s * (-0.5 + s * (1.0 / 24.0 + s * (-1.0 / 720.0 + s / 40320.0)));
    let (sin, cos) = if quarters & 1 == 0 { (sin, cos) } else { (cos, -sin) };
    if quarters & 2 == 0 { (sin, cos) } else { (-sin, -cos) }
}

/// atan2 with an absolute error below 2e-6 radians: the odd minimax polynomial of degree 15 for atan on [0, 1] and the
/// usual reductions. Texels are larger than 1e-3 radians.
#[inline(always)]
pub(super) fn fast_atan2(y: f32, x: f32) -> f32 {
    let (ax, ay) = (x.abs(), y.abs());
    let (low, high) = (ax.min(ay), ax.max(ay));
    let a = low / high.max(f32::MIN_POSITIVE);
    let s = a * a;
    // Coefficients: Abramowitz and Stegun 4.4.49 (error 2e-8).
    let p = s
        * (0.199_935_51
            + s * (-0.142_089
                + s * (0.106_562_64
                    + s * (-0.075_289_6 + s * (0.042_909_61 + s * (-0.016_165_737 + s * 0.002_866_226))))));
    let angle = a + a * s * (-0.333_331_45 + p);
    let angle = if ay > ax { FRAC_PI_2 - angle } else { angle };
    let angle = if x < 0.0 { PI - angle } else { angle };
    if y < 0.0 { -angle } else { angle }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fast_arcs_stay_within_two_millionths_of_the_exact_ones() {
        for i in 0..20_000 {
            let angle = (i as f32 / 20_000.0 - 0.5) * std::f32::consts::TAU;
            let (sin, cos) = angle.sin_cos();
            let difference = (fast_atan2(sin, cos) - sin.atan2(cos)).abs();
            assert!(difference < 2e-6 || (difference - std::f32::consts::TAU).abs() < 2e-6, "{angle}");
            let exact = f64::from(cos).acos();
            assert!((f64::from(fast_acos(cos)) - exact).abs() < 1e-6, "{angle}");
        }
    }

    #[test]
    fn the_fast_sine_and_cosine_stay_within_a_millionth_of_the_exact_ones() {
        for i in -40_000..40_000 {
            let turns = i as f32 / 20_000.0;
            let (sin, cos) = fast_sin_cos_of_turns(turns);
            let (exact_sin, exact_cos) = (f64::from(turns) * std::f64::consts::TAU).sin_cos();
            assert!((f64::from(sin) - exact_sin).abs() < 1e-6, "{turns}");
            assert!((f64::from(cos) - exact_cos).abs() < 1e-6, "{turns}");
        }
    }
}
