//! The bandwidth that a picture really has around a pixel: a windowed Fourier transform, the slow truth that predictions are
//! held against.
//!
//! The values of a [`WINDOW`]² square lose their mean (weighted by the window), are weighted by Hann's window and
//! transformed; the result is the radius, in cycles per pixel, within which 95 % of |F|² lies. Source: `[001]` §4.1
//! (validation). Its floor, for a window of 32, is about 0.065 cycles per pixel: nothing slower can be told apart.
//! Cost: a transform of 32 × 32 for every pixel that is asked for.

use halflight_image::Plane;
use rayon::prelude::*;

/// The side of the window in pixels: the seed's 32, a compromise between place and frequency.
pub const WINDOW: usize = 32;

/// The smallest bandwidth that the window can measure, cycles per pixel.
pub const FLOOR: f32 = 0.065;

/// The radius that holds 95 % of the power in the window around pixel (x, y), cycles per pixel. Pixels beyond the border
/// repeat the border's; without any variation the result is zero.
#[must_use]
pub fn windowed_bandwidth(picture: &Plane, x: usize, y: usize) -> f32 {
    windowed_quantile(picture, x, y, 0.95)
}

/// The same for another share of the power.
#[must_use]
pub fn windowed_quantile(picture: &Plane, x: usize, y: usize, share: f32) -> f32 {
    if picture.values.is_empty() {
        return 0.0;
    }
    let half = (WINDOW / 2) as isize;
    let pixel = |i: usize, at: usize, size: usize| {
        (at as isize + i as isize - half).clamp(0, size as isize - 1) as usize
    };
    let hann: [f64; WINDOW] = std::array::from_fn(|i| {
        let phase = std::f64::consts::TAU * (i as f64 + 0.5) / WINDOW as f64;
        0.5 - 0.5 * phase.cos()
    });
    let mut values = vec![(0.0f64, 0.0f64); WINDOW * WINDOW];
    let (mut sum, mut weight) = (0.0, 0.0);
    for j in 0..WINDOW {
        for i in 0..WINDOW {
            let at = pixel(j, y, picture.height) * picture.width + pixel(i, x, picture.width);
            let value = f64::from(picture.values[at]);
            let w = hann[i] * hann[j];
            values[j * WINDOW + i].0 = if value.is_finite() { value } else { 0.0 };
            sum += w * values[j * WINDOW + i].0;
            weight += w;
        }
    }
    let mean = sum / weight;
    for j in 0..WINDOW {
        for i in 0..WINDOW {
            let value = &mut values[j * WINDOW + i].0;
            *value = (*value - mean) * hann[i] * hann[j];
        }
    }
    transform(&mut values);
    // What rounding leaves of a constant is no signal.
    radius(&values, share, 1e-20 * (mean * weight).powi(2)) as f32
}

/// [`windowed_bandwidth`] at every pixel.
#[must_use]
pub fn windowed_map(picture: &Plane) -> Plane {
    let width = picture.width;
    let values = (0..width * picture.height)
        .into_par_iter()
        .map(|i| windowed_bandwidth(picture, i % width, i / width))
        .collect();
    Plane { width, height: picture.height, values }
}

/// The radius within which `share` of the power lies; zero where there is no more than `rounding`.
fn radius(spectrum: &[(f64, f64)], share: f32, rounding: f64) -> f64 {
    let frequency = |i: usize| i.min(WINDOW - i) as f64 / WINDOW as f64;
    let mut power: Vec<(f64, f64)> = (0..WINDOW * WINDOW)
        .map(|k| {
            let (re, im) = spectrum[k];
            (frequency(k % WINDOW).hypot(frequency(k / WINDOW)), re * re + im * im)
        })
        .collect();
    let total: f64 = power.iter().map(|p| p.1).sum();
    if total <= rounding {
        return 0.0;
    }
    power.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut inside = 0.0;
    for (radius, energy) in power {
        inside += energy;
        if inside >= f64::from(share) * total {
            return radius;
        }
    }
    std::f64::consts::FRAC_1_SQRT_2
}

/// Rows, then columns.
fn transform(values: &mut [(f64, f64)]) {
    let twiddle: [(f64, f64); WINDOW] = std::array::from_fn(|i| {
        let (sin, cos) = (-std::f64::consts::TAU * i as f64 / WINDOW as f64).sin_cos();
        (cos, sin)
    });
    let mut line = [(0.0, 0.0); WINDOW];
    for row in values.chunks_exact_mut(WINDOW) {
        line.copy_from_slice(row);
        transform_line(&mut line, &twiddle);
        row.copy_from_slice(&line);
    }
    for x in 0..WINDOW {
        for y in 0..WINDOW {
            line[y] = values[y * WINDOW + x];
        }
        transform_line(&mut line, &twiddle);
        for y in 0..WINDOW {
            values[y * WINDOW + x] = line[y];
        }
    }
}

/// Radix 2, decimation in time.
fn transform_line(line: &mut [(f64, f64); WINDOW], twiddle: &[(f64, f64); WINDOW]) {
    let bits = WINDOW.ilog2();
    for i in 0..WINDOW {
        let j = i.reverse_bits() >> (usize::BITS - bits);
        if i < j {
            line.swap(i, j);
        }
    }
    let mut half = 1;
    while half < WINDOW {
        for start in (0..WINDOW).step_by(2 * half) {
            for i in 0..half {
                let (c, s) = twiddle[i * WINDOW / (2 * half)];
                let (re, im) = line[start + half + i];
                let turned = (re * c - im * s, re * s + im * c);
                let kept = line[start + i];
                line[start + i] = (kept.0 + turned.0, kept.1 + turned.1);
                line[start + half + i] = (kept.0 - turned.0, kept.1 - turned.1);
            }
        }
        half *= 2;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wave_has_its_own_frequency_and_a_constant_has_none() {
        for frequency in [0.1, 0.2, 0.35f32] {
            let values = (0..64 * 64)
                .map(|i| {
                    (std::f32::consts::TAU * frequency * ((i % 64) as f32 * 0.8 + (i / 64) as f32 * 0.6))
                        .sin()
                })
                .collect();
            let measured = windowed_bandwidth(&Plane { width: 64, height: 64, values }, 30, 31);
            assert!((measured - frequency).abs() < 0.05, "{frequency}: {measured}");
        }
        let flat = Plane { width: 3, height: 2, values: vec![7.0; 6] };
        assert_eq!(windowed_bandwidth(&flat, 1, 1), 0.0);
    }
}
