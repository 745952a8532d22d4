//! Many directions of an environment at once: the arithmetic in vector instructions, the look-ups asked for together.
//!
//! The answers are those of [`Environment::sample`] and [`Environment::locate`], to the last bit.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};
use halflight_trace::{Kernel, Simd};

use super::arcs::fast_acos;
use super::{Environment, MapPoint};

/// Most directions in one call.
pub const MANY: usize = 64;

/// Directions drawn together, and the room to draw them in.
#[derive(Clone, Debug)]
pub struct Drawn {
    /// Unit directions.
    pub directions: [Vec3; MANY],
    /// Where they meet the map.
    pub points: [MapPoint; MANY],
    /// Their densities over solid angle.
    pub densities: [f32; MANY],
    map_u: [f32; MANY],
    cos_theta: [f32; MANY],
}

impl Default for Drawn {
    fn default() -> Self {
        Self {
            directions: [Vec3::ZERO; MANY],
            points: [MapPoint::default(); MANY],
            densities: [0.0; MANY],
            map_u: [0.0; MANY],
            cos_theta: [0.0; MANY],
        }
    }
}

struct Directions<'a> {
    environment: &'a Environment,
    drawn: &'a mut Drawn,
}

impl Kernel for Directions<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self { environment, drawn } = self;
        for i in 0..MANY {
            let (map_u, cos_theta) = (drawn.map_u[i], drawn.cos_theta[i]);
            drawn.points[i] = MapPoint(Vec2::new(map_u, fast_acos(cos_theta) / PI));
            drawn.directions[i] = environment.direction(map_u, cos_theta);
        }
    }
}

struct Points<'a> {
    environment: &'a Environment,
    directions: &'a [Vec3; MANY],
    points: &'a mut [MapPoint; MANY],
}

impl Kernel for Points<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        for i in 0..MANY {
            self.points[i] = MapPoint(self.environment.uv(self.directions[i]));
        }
    }
}

impl Environment {
    /// [`Environment::sample`] for up to [`MANY`] pairs of numbers.
    pub fn sample_many(&self, simd: Simd, numbers: &[Vec2], drawn: &mut Drawn) {
        let count = numbers.len();
        for (i, &u) in numbers.iter().enumerate() {
            (drawn.map_u[i], drawn.cos_theta[i], drawn.densities[i]) = self.map.table.sample(u);
        }
        simd.run(Directions { environment: self, drawn });
        for point in &drawn.points[..count] {
            self.map.texels.prefetch(point.0);
        }
    }

    /// [`Environment::radiance_at`] for the first `count` of some points, which are points of this environment.
    pub fn radiance_many(
        &self,
        simd: Simd,
        points: &[MapPoint; MANY],
        count: usize,
        radiance: &mut [Vec3; MANY],
    ) {
        self.map.texels.interpolated_many(simd, &points.map(|point| point.0), count, radiance);
        radiance[..count].iter_mut().for_each(|radiance| *radiance *= self.intensity);
    }

    /// [`Environment::locate`] for the first `count` of the directions, which must be finite.
    pub fn locate_many(
        &self,
        simd: Simd,
        directions: &[Vec3; MANY],
        count: usize,
        points: &mut [MapPoint; MANY],
    ) {
        simd.run(Points { environment: self, directions, points });
        for point in &points[..count] {
            self.map.texels.prefetch(point.0);
            self.map.table.prefetch(point.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use halflight_image::RgbImage;

    use super::super::EnvironmentMap;
    use super::*;

    #[test]
    fn many_directions_at_once_are_those_of_one_at_a_time() {
        let image = RgbImage::from_fn(128, 64, |x, y| [(1 + (x * 31 + y * 17) % 23) as f32; 3]);
        let map = Arc::new(EnvironmentMap::new(image));
        let environment = Environment { map, rotation: -1.3, intensity: Vec3::ONE };
        for simd in [Simd::Baseline, Simd::Avx2, Simd::Avx512] {
            let number =
                |i: usize| Vec2::new((i as f32 * 0.618_034).fract(), (i as f32 * 0.414_213_56).fract());
            let numbers: Vec<Vec2> = (0..51).map(number).collect();
            let mut drawn = Drawn::default();
            environment.sample_many(simd, &numbers, &mut drawn);
            let mut points = [MapPoint::default(); MANY];
            environment.locate_many(simd, &drawn.directions, 51, &mut points);
            let mut radiance = [Vec3::ZERO; MANY];
            environment.radiance_many(simd, &points, 51, &mut radiance);
            for i in 0..51 {
                assert_eq!(radiance[i], environment.radiance_at(points[i]));
                let (direction, point, density) = environment.sample(numbers[i]);
                assert_eq!(drawn.directions[i], direction);
                assert_eq!((drawn.points[i], drawn.densities[i]), (point, density));
                assert_eq!(points[i], environment.locate(direction));
            }
        }
    }

    #[test]
    fn directions_along_the_axes_meet_the_map_within_it() {
        let map = Arc::new(EnvironmentMap::new(RgbImage::from_fn(8, 4, |_, _| [1.0; 3])));
        let environment = Environment { map, rotation: 0.0, intensity: Vec3::ONE };
        let axes = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
        let mut directions = [Vec3::ZERO; MANY];
        directions[..6].copy_from_slice(&axes);
        let mut points = [MapPoint::default(); MANY];
        environment.locate_many(Simd::detect(), &directions, 6, &mut points);
        for (point, axis) in points.iter().zip(axes) {
            assert!(environment.radiance_at(*point).x > 0.0 && environment.pdf_at(*point) > 0.0, "{axis}");
        }
    }
}
