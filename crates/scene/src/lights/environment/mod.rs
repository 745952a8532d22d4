//! Light from everywhere: a latitude–longitude map at infinity, sampled by luminance × solid angle.
//!
//! **Layout.** Texel (i, j) of a W × H map is centred at u = (i + ½)/W, v = (j + ½)/H. The direction of (u, v) is
//! (sin φ sin θ, cos θ, −cos φ sin θ) with φ = 2π(u − ½), θ = πv: the centre column looks along −z, +x is to its
//! right, the top row is +y. Radiance is interpolated bilinearly, periodic in u and clamped in v.

mod arcs;
mod band_limit;
mod many;
mod prefetch;
mod table;
mod texels;

use std::f32::consts::{PI, TAU};
use std::sync::Arc;

use glam::{Vec2, Vec3};
use halflight_image::RgbImage;
use rayon::prelude::*;

pub use many::{Drawn, MANY};

use arcs::{fast_acos, fast_atan2, fast_sin_cos_of_turns};
use table::Table;
use texels::Texels;

/// A map and its sampling table, shared between frames.
#[derive(Debug)]
pub struct EnvironmentMap {
    texels: Texels,
    table: Table,
    mean_radiance: Vec3,
}

impl EnvironmentMap {
    /// Builds the sampling table of a map of finite radiance in the layout above; negative texels are taken as black.
    ///
    /// # Panics
    /// If the map has no texels.
    pub fn new(image: RgbImage) -> Self {
        assert!(image.width > 0 && image.height > 0, "an environment map has texels");
        let luminances: Vec<f32> =
            image.pixels.par_iter().map(|&p| luminance(Vec3::from(p).max(Vec3::ZERO))).collect();
        let table = Table::new(&luminances, image.width, image.height);
        Self { texels: Texels::new(&image), table, mean_radiance: mean_over_sphere(&image) }
    }

    /// Columns and rows.
    pub fn size(&self) -> (usize, usize) {
        (self.texels.width, self.texels.height)
    }

    /// Radiance of one texel.
    ///
    /// # Panics
    /// If there is no such texel.
    pub fn texel(&self, x: usize, y: usize) -> Vec3 {
        self.texels.texel(x, y)
    }

    /// Radiance averaged over the sphere.
    pub fn mean_radiance(&self) -> Vec3 {
        self.mean_radiance
    }
}

/// Where a direction meets a map; see [`Environment::locate`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MapPoint(Vec2);

/// A map with a rotation about +y and an intensity: what a frame sees at infinity.
#[derive(Clone, Debug)]
pub struct Environment {
    /// The map.
    pub map: Arc<EnvironmentMap>,
    /// Turns the map about +y, in radians: what was seen along −z is then seen along −z turned towards −x.
    pub rotation: f32,
    /// Multiplies the map.
    pub intensity: Vec3,
}

impl Environment {
    /// Where `direction` (unit) meets the map. What is stored there is on its way into the cache when this returns:
    /// trace the ray that decides whether it is seen before asking for it.
    #[inline]
    pub fn locate(&self, direction: Vec3) -> MapPoint {
        let point = MapPoint(self.uv(direction));
        self.map.texels.prefetch(point.0);
        self.map.table.prefetch(point.0);
        point
    }

    /// Radiance that arrives from where the map was met.
    #[inline]
    pub fn radiance_at(&self, point: MapPoint) -> Vec3 {
        self.intensity * self.map.texels.interpolated(point.0)
    }

    /// Density over solid angle with which [`Self::sample`] chooses that direction.
    #[inline]
    pub fn pdf_at(&self, point: MapPoint) -> f32 {
        self.map.table.density(point.0)
    }

    /// Radiance that arrives from `direction` (unit).
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        self.radiance_at(self.locate(direction))
    }

    /// Density over solid angle with which [`Self::sample`] chooses `direction`.
    pub fn pdf(&self, direction: Vec3) -> f32 {
        self.pdf_at(self.locate(direction))
    }

    /// A direction, where it meets the map, and its density over solid angle. The darkest parts of the map are drawn
    /// more rarely than their light deserves: to be joined with sampling of the material.
    #[inline]
    pub fn sample(&self, u: Vec2) -> (Vec3, MapPoint, f32) {
        let (map_u, cos_theta, density) = self.map.table.sample(u);
        let point = MapPoint(Vec2::new(map_u, fast_acos(cos_theta) / PI));
        self.map.texels.prefetch(point.0);
        (self.direction(map_u, cos_theta), point, density)
    }

    /// Mean radiance over the sphere, with the intensity.
    pub fn mean_radiance(&self) -> Vec3 {
        self.intensity * self.map.mean_radiance
    }

    #[inline(always)]
    fn uv(&self, direction: Vec3) -> Vec2 {
        let u = 0.5 + (fast_atan2(direction.x, -direction.z) + self.rotation) / TAU;
        // A rotation is reduced to one turn where it is set, so u lies between −1 and 2.
        let wrapped = if u < 0.0 { u + 1.0 } else { u };
        let wrapped = if wrapped >= 1.0 { wrapped - 1.0 } else { wrapped };
        Vec2::new(wrapped.clamp(0.0, 1.0 - f32::EPSILON), fast_acos(direction.y) / PI)
    }

    #[inline(always)]
    fn direction(&self, u: f32, cos_theta: f32) -> Vec3 {
        let sin_theta = (1.0 - cos_theta * cos_theta).max(0.0).sqrt();
        let (sin, cos) = fast_sin_cos_of_turns(u - 0.5 - self.rotation / TAU);
        Vec3::new(sin * sin_theta, cos_theta, -cos * sin_theta)
    }
}

/// Rec. 709 luminance.
pub fn luminance(rgb: Vec3) -> f32 {
    rgb.dot(Vec3::new(0.212_671, 0.715_160, 0.072_169))
}

fn mean_over_sphere(image: &RgbImage) -> Vec3 {
    let mut sum = glam::DVec3::ZERO;
    for (j, row) in image.pixels.chunks(image.width).enumerate() {
        let edge = |j: usize| (std::f64::consts::PI * j as f64 / image.height as f64).cos();
        let weight = (edge(j) - edge(j + 1)) / (2.0 * image.width as f64);
        sum += row.iter().map(|&p| Vec3::from(p).max(Vec3::ZERO).as_dvec3()).sum::<glam::DVec3>() * weight;
    }
    sum.as_vec3()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spotted(width: usize, height: usize) -> Environment {
        let image = RgbImage::from_fn(width, height, |x, y| {
            let base = 0.2 + 0.1 * ((x * 7 + y * 13) % 11) as f32;
            let sun = if x * 10 / width == 6 && y * 10 / height == 2 { 30.0 } else { 0.0 };
            [base + sun, base, base + 0.5 * sun]
        });
        Environment { map: Arc::new(EnvironmentMap::new(image)), rotation: 0.7, intensity: Vec3::ONE }
    }

    #[test]
    fn a_sampled_direction_has_the_density_that_looking_it_up_gives() {
        for (width, height) in [(1, 1), (16, 8), (37, 19), (1500, 700)] {
            let environment = spotted(width, height);
            for i in 0..2000u32 {
                let u = Vec2::new((i as f32 * 0.618_034).fract(), (i as f32 + 0.5) / 2000.0);
                let (direction, point, pdf) = environment.sample(u);
                assert!((direction.length() - 1.0).abs() < 1e-5);
                let looked_up = environment.pdf(direction);
                assert!((pdf - looked_up).abs() <= 2e-3 * pdf, "{width}x{height} {u}: {pdf} {looked_up}");
                assert_eq!(environment.pdf_at(point), pdf);
                let (here, there) = (environment.radiance_at(point), environment.radiance(direction));
                assert!(
                    here.distance(there) <= 0.02 * there.length(),
                    "{width}x{height} {u}: {here} {there}"
                );
            }
        }
    }

    #[test]
    fn the_density_integrates_to_one_and_the_estimator_to_the_mean_radiance() {
        let environment = spotted(64, 32);
        let (n_v, n_u) = (512, 1024);
        let mut integral = 0.0f64;
        for j in 0..n_v {
            for i in 0..n_u {
                let cos_theta = 1.0 - 2.0 * (j as f32 + 0.5) / n_v as f32;
                let direction = environment.direction((i as f32 + 0.5) / n_u as f32, cos_theta);
                integral +=
                    f64::from(environment.pdf(direction)) * 4.0 * std::f64::consts::PI / (n_v * n_u) as f64;
            }
        }
        assert!((integral - 1.0).abs() < 2e-3, "{integral}");
        let mut estimate = Vec3::ZERO;
        let n = 1 << 14;
        for i in 0..n {
            let u = Vec2::new((i as f32 * 0.618_034).fract(), (i as f32 + 0.5) / n as f32);
            let (direction, _, pdf) = environment.sample(u);
            estimate += environment.radiance(direction) / pdf / n as f32;
        }
        let mean = environment.mean_radiance() * 4.0 * PI;
        assert!(estimate.distance(mean) < 0.02 * mean.length(), "{estimate} {mean}");
    }

    #[test]
    fn the_layout_has_minus_z_at_the_centre_and_x_to_its_right() {
        let environment = Environment { rotation: 0.0, ..spotted(8, 4) };
        for (direction, uv) in [
            (Vec3::NEG_Z, [0.5, 0.5]),
            (Vec3::X, [0.75, 0.5]),
            (Vec3::NEG_X, [0.25, 0.5]),
            (Vec3::Y, [0.5, 0.0]),
        ] {
            assert!(environment.uv(direction).distance(Vec2::from(uv)) < 1e-5, "{direction}");
        }
    }

    #[test]
    fn a_smooth_map_is_drawn_by_a_coarse_table_and_a_small_sun_by_a_fine_one() {
        let map = |sun: f32| {
            EnvironmentMap::new(RgbImage::from_fn(1024, 512, |x, y| {
                let base = 1.0 + (y as f32 / 512.0);
                if x == 300 && y == 100 { [base + sun; 3] } else { [base; 3] }
            }))
        };
        assert_eq!(map(0.0).table.rows_and_cells(), (32, 32 * 32));
        // The sun reaches over the row above and the row below.
        assert_eq!(map(1e6).table.rows_and_cells(), (512, 3 * 1024 + 509 * 32));
    }
}
