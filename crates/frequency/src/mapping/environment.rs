//! Angular bandwidth of distant light.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};
use halflight_image::Plane;

use super::max_pyramid::MaxPyramid;
use crate::wavelet::{Border, Filter, Pyramid, Rule, local_bandwidth};

/// Cycles per radian in every direction of a latitude–longitude map (centre column −z, +x to its right, top row +y).
///
/// Within two rows of a pole it may be seven times too high. Cost for 512 × 256: 1 to 3 ms on two cores, so it may be made anew for every frame.
#[derive(Clone, Debug, PartialEq)]
pub struct EnvironmentBandwidth {
    map: MaxPyramid,
}

impl EnvironmentBandwidth {
    /// Analyses the luminance of a map.
    #[must_use]
    pub fn new(luminance: &Plane, filter: Filter, rule: Rule) -> Self {
        Self { map: MaxPyramid::new(Self::plane(luminance, filter, rule), [true, false]) }
    }

    /// The bandwidth of every texel, cycles per radian, without the pyramid above it.
    #[must_use]
    pub fn plane(luminance: &Plane, filter: Filter, rule: Rule) -> Plane {
        let (w, h) = (luminance.width, luminance.height);
        let down = PI / h.max(1) as f32;
        let across: Vec<f32> =
            (0..h).map(|y| TAU / w.max(1) as f32 * ((y as f32 + 0.5) * down).sin()).collect();
        let pyramid = Pyramid::new(luminance, filter, Border::WrapHorizontally);
        local_bandwidth(&pyramid, rule, |_, y| Vec2::new(across[y], down))
    }

    /// The map, largest values above it.
    #[must_use]
    pub fn map(&self) -> &MaxPyramid {
        &self.map
    }

    /// Cycles per radian of the light from `direction` (need not be normalized).
    #[inline]
    #[must_use]
    pub fn along(&self, direction: Vec3) -> f32 {
        let (u, v) = lat_long(direction);
        self.map.at(u, v)
    }

    /// At least the largest within `radius` radians of `direction`: what a lobe of that width may meet.
    #[must_use]
    pub fn within(&self, direction: Vec3, radius: f32) -> f32 {
        let (u, v) = lat_long(direction);
        let theta = v * PI;
        // A cap of radius r at colatitude θ spans ±asin(sin r / sin θ) of longitude, or all if it holds a pole.
        let holds_pole = theta - radius <= 0.0 || theta + radius >= PI;
        let longitude = if holds_pole { PI } else { (radius.sin() / theta.sin()).clamp(-1.0, 1.0).asin() };
        self.map.within(u, v, longitude / PI, 2.0 * radius / PI)
    }
}

/// u = ½ + atan2(x, −z)/2π, v = acos(y)/π.
#[inline]
fn lat_long(direction: Vec3) -> (f32, f32) {
    let d = direction.normalize_or(Vec3::NEG_Z);
    (0.5 + d.x.atan2(-d.z) / TAU, d.y.clamp(-1.0, 1.0).acos() / PI)
}

/// Bandwidth of a light probe (an angular map: the angle from the centre's direction is π times the distance from the centre
/// of the square picture), cycles per radian; zero outside the disc. A step of one texel across or down is taken at its
/// true length on the sphere.
#[must_use]
pub fn angular_map(luminance: &Plane, filter: Filter, rule: Rule) -> Plane {
    let (w, h) = (luminance.width.max(1) as f32, luminance.height.max(1) as f32);
    let pyramid = Pyramid::new(luminance, filter, Border::Repeat);
    let place = |x: usize, y: usize| (2.0 * (x as f32 + 0.5) / w - 1.0, 2.0 * (y as f32 + 0.5) / h - 1.0);
    let mut map = local_bandwidth(&pyramid, rule, |x, y| {
        let (x, y) = place(x, y);
        let r = x.hypot(y);
        if r > 1.0 {
            return Vec2::ZERO;
        }
        // Radially π per unit, around sin(πr)/r; near the centre both are π.
        let around = if r > 1e-4 { (PI * r).sin() / r } else { PI };
        let (cos, sin) = if r > 1e-4 { (x / r, y / r) } else { (1.0, 0.0) };
        Vec2::new((PI * cos).hypot(around * sin) * 2.0 / w, (PI * sin).hypot(around * cos) * 2.0 / h)
    });
    for (i, value) in map.values.iter_mut().enumerate() {
        let (x, y) = place(i % luminance.width, i / luminance.width);
        if x.hypot(y) > 1.0 {
            *value = 0.0;
        }
    }
    map
}
