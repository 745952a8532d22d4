//! The light of a frame in spherical harmonics: the environment, projected once and turned in every frame.
//!
//! All techniques that use harmonics share one frame: the polar axis is the world's up, (x, y, z) of the harmonics are
//! (z, x, y) of the world, so that turning an environment is a turn about the polar axis.

use std::sync::{Arc, Mutex};

use glam::{Mat3, Vec3};
use halflight_scene::lights::{EnvironmentMap, Lights};
use halflight_sh::project::{kept_energy, lat_long_direction, lat_long_solid_angle};
use halflight_sh::{Sh, Simd};
use rayon::prelude::*;

use crate::technique::TechniqueError;

/// A direction of the world in the frame of the harmonics, whose polar axis is the world's up.
#[inline]
pub(crate) fn axes(direction: Vec3) -> [f32; 3] {
    [direction.z, direction.x, direction.y]
}

/// The level of the harmonics for that of the rays.
pub(crate) fn simd(level: halflight_trace::Simd) -> Simd {
    Simd::from_name(level.name()).unwrap_or(Simd::Baseline)
}

/// Red, green and blue.
pub(crate) type Colors<const ORDER: usize> = [Sh<ORDER>; 3];

/// Lights of whose energy less is kept are called sharp.
pub(crate) const SHARP_LIGHT: f64 = 0.9;

/// The light of one frame.
pub(crate) struct FrameLight<const ORDER: usize> {
    pub(crate) radiance: Colors<ORDER>,
    /// The part of the map's energy that the order keeps.
    pub(crate) kept: f64,
}

/// Radiance beyond this would overflow when its harmonics are multiplied.
const BRIGHTEST: f32 = 1e30;

/// Why the environment cannot be worked with in harmonics, if it cannot.
pub(crate) fn refuse_too_bright(lights: &Lights, technique: &'static str) -> Result<(), TechniqueError> {
    let mean = lights.environment().map_or(Vec3::ZERO, |environment| environment.mean_radiance());
    if mean.is_finite() && mean.max_element() <= BRIGHTEST {
        return Ok(());
    }
    let reason = format!(
        "its environment has a mean radiance of {:.1e}, and beyond {BRIGHTEST:.0e} products of harmonics overflow (scale it \
         down with the environment's `intensity`)",
        mean.max_element()
    );
    Err(TechniqueError { technique, reason })
}

/// What harmonics of the environment leave out of the lights, in words for the user.
pub(crate) fn left_out(lights: &Lights) -> Option<String> {
    let others = !lights.emitters().is_empty() || !lights.deltas().is_empty();
    others.then(|| "lamps and suns beside the environment are left out".into())
}

/// A projected map.
struct Known<const ORDER: usize> {
    map: Arc<EnvironmentMap>,
    colors: Colors<ORDER>,
    kept: f64,
}

/// The projection of the last map that was asked for.
#[derive(Default)]
pub(crate) struct LightCache<const ORDER: usize>(Mutex<Option<Known<ORDER>>>);

impl<const ORDER: usize> LightCache<ORDER> {
    /// The environment of these lights; `None` if there is none.
    pub(crate) fn light(&self, lights: &Lights) -> Option<FrameLight<ORDER>> {
        let environment = lights.environment()?;
        let mut known = self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let known = match &mut *known {
            Some(known) if Arc::ptr_eq(&known.map, &environment.map) => known,
            slot => slot.insert(project(&environment.map)),
        };
        // A turn about the world's up is one about the polar axis.
        let turn = Mat3::from_rotation_z(environment.rotation);
        let intensity = environment.intensity.to_array();
        let colors = std::array::from_fn(|c| known.colors[c].rotated(&turn) * intensity[c]);
        Some(FrameLight { radiance: colors, kept: known.kept })
    }
}

/// Rows at least: the middles of larger texels stand badly for them, and a constant map has but one.
const LEAST_ROWS: usize = 128;

fn project<const ORDER: usize>(map: &Arc<EnvironmentMap>) -> Known<ORDER> {
    let (map_width, map_height) = map.size();
    let split = LEAST_ROWS.div_ceil(map_height);
    // A map narrower than it is high gets columns enough as well.
    let split_columns = split.max((2 * LEAST_ROWS).div_ceil(map_width));
    let (width, height) = (map_width * split_columns, map_height * split);
    let rows: Vec<[Sh<ORDER, f64>; 3]> = (0..height)
        .into_par_iter()
        .map(|row| {
            let mut sums = [Sh::<ORDER, f64>::zero(); 3];
            let solid_angle = lat_long_solid_angle(width, height, row);
            for column in 0..width {
                let d = lat_long_direction(width, height, column, row);
                let basis = Sh::<ORDER, f64>::basis([d.z, d.x, d.y]) * solid_angle;
                for (sum, value) in
                    sums.iter_mut().zip(map.texel(column / split_columns, row / split).to_array())
                {
                    *sum += basis * f64::from(value);
                }
            }
            sums
        })
        .collect();
    let mut sums = [Sh::<ORDER, f64>::zero(); 3];
    for row in rows {
        sums.iter_mut().zip(row).for_each(|(sum, row)| *sum += row);
    }
    let colors = sums.map(|sum| sum.cast());
    // The texels of a map are finite, so the share exists.
    let kept =
        kept_energy(map_width, map_height, |column, row| map.texel(column, row), &colors).unwrap_or(0.0);
    Known { map: Arc::clone(map), colors, kept }
}

#[cfg(test)]
mod tests {
    use halflight_image::RgbImage;
    use halflight_scene::lights::Environment;

    use super::*;

    #[test]
    fn a_turned_environment_is_looked_up_where_its_projection_says() {
        // A light of the first two bands only, so that nothing is lost.
        let image = RgbImage::from_fn(128, 64, |x, y| {
            let d = lat_long_direction(128, 64, x, y).as_vec3();
            [1.0 + 0.5 * d.x, 1.0 + 0.4 * d.y, 1.0 - 0.6 * d.z]
        });
        let environment = Environment {
            map: Arc::new(EnvironmentMap::new(image)),
            rotation: 0.8,
            intensity: Vec3::new(1.0, 2.0, 3.0),
        };
        let lights = Lights::new(Some(environment.clone()), Vec::new(), Vec::new(), 1.0);
        let light = LightCache::<4>::default().light(&lights).unwrap();
        for direction in [Vec3::X, Vec3::NEG_Z, Vec3::new(0.3, -0.5, 0.8).normalize()] {
            let expected = environment.radiance(direction).to_array();
            for (sh, expected) in light.radiance.iter().zip(expected) {
                let found = sh.at(axes(direction));
                assert!((found - expected).abs() < 0.01 * expected, "{direction}: {found} {expected}");
            }
        }
        assert!(light.kept > 0.999);
    }

    #[test]
    fn a_map_of_one_texel_is_a_constant_light() {
        let map = Arc::new(EnvironmentMap::new(RgbImage::from_fn(1, 1, |_, _| [0.2, 1.0, 3.0])));
        let known = project::<4>(&map);
        for (sh, value) in known.colors.iter().zip([0.2, 1.0, 3.0]) {
            assert!((*sh - Sh::constant(value)).norm() < 1e-3 * value);
        }
        assert!(known.kept > 0.999);
    }

    #[test]
    fn light_that_would_overflow_is_refused() {
        let of = |radiance: f32| {
            let map = Arc::new(EnvironmentMap::new(RgbImage::from_fn(8, 4, |_, _| [radiance; 3])));
            let environment = Environment { map, rotation: 0.0, intensity: Vec3::ONE };
            refuse_too_bright(&Lights::new(Some(environment), Vec::new(), Vec::new(), 1.0), "shexp")
        };
        assert!(of(1e20).is_ok() && refuse_too_bright(&Lights::default(), "shexp").is_ok());
        for radiance in [1e31, 1.7e38, 3e38] {
            assert!(of(radiance).unwrap_err().to_string().contains("overflow"), "{radiance}");
        }
    }
}
