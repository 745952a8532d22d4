//! Light probes as angular maps, turned into latitude–longitude maps.
//!
//! An angular map is a disc: its centre looks forward (−z), its rim backward (+z), and the angle from forward
//! grows in proportion to the distance r ∈ [0, 1] from the centre; +x is to its right, +y up.
//! With (u, v) ∈ [−1, 1]² on the picture, right and up:
//!
//! ```text
//! φ = π r,  r = √(u² + v²):   d = (sin φ · u/r,  sin φ · v/r,  −cos φ)
//! inverse:                    r = acos(−d.z) / π,   (u, v) = r (d.x, d.y) / √(d.x² + d.y²)
//! ```
//!
//! Source: Debevec, "Light Probe Image Gallery", 1998, whose probes these are. Cost: nine bilinear look-ups a texel.

use std::f64::consts::{PI, TAU};

use crate::RgbImage;

/// Look-ups along each side of a texel. An angular map a side of W has its texels π/(W/2) apart at the centre; nine
/// look-ups resolve it into latitude–longitude maps down to about half its own resolution without aliasing.
const SUBSAMPLES: usize = 3;

/// A latitude–longitude map (centre column −z, top row +y) of the light that an angular map shows.
///
/// What lies outside the disc plays no part.
pub fn angular_to_latlong(probe: &RgbImage, width: usize, height: usize) -> RgbImage {
    let share = 1.0 / (SUBSAMPLES * SUBSAMPLES) as f32;
    RgbImage::from_fn(width, height, |i, j| {
        let mut sum = [0.0; 3];
        for s in 0..SUBSAMPLES * SUBSAMPLES {
            let offset = |k: usize| (k as f64 + 0.5) / SUBSAMPLES as f64;
            let phi = TAU * ((i as f64 + offset(s % SUBSAMPLES)) / width as f64 - 0.5);
            let theta = PI * (j as f64 + offset(s / SUBSAMPLES)) / height as f64;
            let color = look_up(probe, [phi.sin() * theta.sin(), theta.cos(), -phi.cos() * theta.sin()]);
            for channel in 0..3 {
                sum[channel] += color[channel] * share;
            }
        }
        sum
    })
}

/// The probe's colour in a direction (unit length): bilinear among the texels whose centres lie on the disc.
fn look_up(probe: &RgbImage, [x, y, z]: [f64; 3]) -> [f32; 3] {
    let r = (-z).clamp(-1.0, 1.0).acos() / PI;
    let side = x.hypot(y);
    // Straight backward the whole rim is one direction: any point of it will do.
    let (u, v) = if side > 1e-12 { (r * x / side, r * y / side) } else { (r, 0.0) };
    let (width, height) = (probe.width as f64, probe.height as f64);
    let (px, py) = ((u + 1.0) / 2.0 * width - 0.5, (1.0 - v) / 2.0 * height - 0.5);
    let (x0, y0) = (px.floor(), py.floor());
    let (mut sum, mut weights) = ([0.0; 3], 0.0);
    for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
        let (cx, cy) = (x0 + dx, y0 + dy);
        let weight = (1.0 - (px - cx).abs()) * (1.0 - (py - cy).abs());
        let (du, dv) = ((cx + 0.5) / width * 2.0 - 1.0, (cy + 0.5) / height * 2.0 - 1.0);
        if weight > 0.0 && du * du + dv * dv <= 1.0 {
            let pixel = probe.pixels[cy as usize * probe.width + cx as usize];
            for channel in 0..3 {
                sum[channel] += weight as f32 * pixel[channel];
            }
            weights += weight as f32;
        }
    }
    if weights > 0.0 {
        return sum.map(|v| v / weights);
    }
    // A point on the rim between texels that are all just outside: the nearest one inward.
    let inward = 1.0 - 2.0 / width.min(height);
    let (px, py) = ((u * inward + 1.0) / 2.0 * width, (1.0 - v * inward) / 2.0 * height);
    let (cx, cy) = ((px as usize).min(probe.width - 1), (py as usize).min(probe.height - 1));
    probe.pixels[cy * probe.width + cx]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A probe whose colour is a function of direction.
    fn probe(f: impl Fn([f64; 3]) -> [f32; 3]) -> RgbImage {
        RgbImage::from_fn(256, 256, |i, j| {
            let (u, v) = ((i as f64 + 0.5) / 128.0 - 1.0, 1.0 - (j as f64 + 0.5) / 128.0);
            let r = u.hypot(v);
            if r > 1.0 {
                return [1e9; 3];
            }
            f([(PI * r).sin() * u / r, (PI * r).sin() * v / r, -(PI * r).cos()])
        })
    }

    #[test]
    fn a_smooth_light_keeps_its_directions() {
        let color = |d: [f64; 3]| d.map(|v| 1.0 + v as f32);
        let map = angular_to_latlong(&probe(color), 64, 32);
        for j in 0..32 {
            for i in 0..64 {
                let (phi, theta) = (TAU * ((i as f64 + 0.5) / 64.0 - 0.5), PI * (j as f64 + 0.5) / 32.0);
                let expected = color([phi.sin() * theta.sin(), theta.cos(), -phi.cos() * theta.sin()]);
                for channel in 0..3 {
                    let found = map.pixels[j * 64 + i][channel];
                    assert!((found - expected[channel]).abs() < 0.02, "({i}, {j}): {found} {expected:?}");
                }
            }
        }
    }

    #[test]
    fn the_centre_is_forward_and_the_rim_backward() {
        let map = angular_to_latlong(&probe(|d| [if d[2] < 0.0 { 1.0 } else { 0.0 }, 0.0, 0.0]), 32, 16);
        assert_eq!(map.pixels[8 * 32 + 16][0], 1.0);
        assert_eq!(map.pixels[8 * 32][0], 0.0);
    }
}
