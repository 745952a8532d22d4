//! Light sought for many points at once: the answers of [`Lights::sample`], those from the environment side by side.

use glam::{Vec2, Vec3};
use halflight_trace::Simd;

use super::environment::{Drawn, MANY};
use super::{Arrival, LightSample, Lights};

/// What [`Lights::sample_many`] found, and the room in which it works: kept from call to call.
#[derive(Clone, Debug)]
pub struct LightSamples {
    found: [Option<LightSample>; MANY],
    /// The points that seek light from the environment, and their numbers.
    seekers: [u8; MANY],
    numbers: [Vec2; MANY],
    drawn: Drawn,
}

impl Default for LightSamples {
    fn default() -> Self {
        Self { found: [None; MANY], seekers: [0; MANY], numbers: [Vec2::ZERO; MANY], drawn: Drawn::default() }
    }
}

impl LightSamples {
    /// Light for each of the points that sought it, `None` where the chosen light cannot reach it.
    #[inline]
    pub fn get(&self, point: usize) -> Option<&LightSample> {
        self.found[point].as_ref()
    }
}

impl Lights {
    /// [`Lights::sample`] for `count` points, up to [`MANY`]: `point(i)` gives where it is and when. Of the numbers `u`,
    /// the first two choose the direction and the third the light.
    pub fn sample_many(
        &self,
        simd: Simd,
        count: usize,
        point: impl Fn(usize) -> (Vec3, f32),
        u: &[[f32; MANY]; 4],
        samples: &mut LightSamples,
    ) {
        let LightSamples { found, seekers, numbers, drawn } = samples;
        let mut seeking = 0;
        for i in 0..count {
            let (choice, number) = (u[2][i], Vec2::new(u[0][i], u[1][i]));
            if choice < self.environment_probability {
                (seekers[seeking], numbers[seeking]) = (i as u8, number);
                seeking += 1;
            } else {
                let (from, time) = point(i);
                found[i] = self.sample(from, choice, number, time);
            }
        }
        let Some(environment) = self.environment.as_ref().filter(|_| seeking > 0) else { return };
        environment.sample_many(simd, &numbers[..seeking], drawn);
        for (k, &i) in seekers[..seeking].iter().enumerate() {
            let pdf = drawn.densities[k] * self.environment_probability;
            found[i as usize] = (pdf > 0.0).then_some(LightSample {
                direction: drawn.directions[k],
                arrival: Arrival::Environment(drawn.points[k]),
                pdf,
                delta: false,
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use halflight_image::RgbImage;

    use super::*;
    use crate::lights::{DeltaLight, Environment, EnvironmentMap};

    #[test]
    fn many_points_find_the_light_that_each_would_find_alone() {
        let map = EnvironmentMap::new(RgbImage::from_fn(64, 32, |x, y| [(1 + (x + 3 * y) % 7) as f32; 3]));
        let environment = Environment { map: Arc::new(map), rotation: 0.3, intensity: Vec3::ONE };
        let lamp = DeltaLight::Point { position: [Vec3::Y * 3.0; 2], intensity: Vec3::splat(40.0) };
        for lights in [
            Lights::new(Some(environment.clone()), vec![], vec![lamp], 5.0),
            Lights::new(Some(environment), vec![], vec![], 5.0),
            Lights::new(None, vec![], vec![lamp], 5.0),
            Lights::default(),
        ] {
            let u: [[f32; MANY]; 4] = std::array::from_fn(|d| {
                std::array::from_fn(|i| ((i + 1) as f32 * [0.618, 0.755, 0.569, 0.1][d]).fract())
            });
            let point = |i: usize| (Vec3::new(i as f32, 0.0, 1.0), 0.5);
            let mut samples = LightSamples::default();
            lights.sample_many(Simd::detect(), 50, point, &u, &mut samples);
            for i in 0..50 {
                let (from, time) = point(i);
                let alone = lights.sample(from, u[2][i], Vec2::new(u[0][i], u[1][i]), time);
                assert_eq!(format!("{:?}", samples.get(i)), format!("{:?}", alone.as_ref()));
            }
        }
    }
}
