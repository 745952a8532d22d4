//! A map with only its lowest spherical harmonics: the light that techniques of a few bands see, for path tracing too.

use glam::Vec2;
use halflight_image::RgbImage;
use halflight_sh::project::{lat_long, lat_long_direction};
use halflight_sh::window::{Window, to_non_negative};
use halflight_sh::{Sh, ShError};

use super::EnvironmentMap;

/// Columns of the map that is made: eight bands turn eight times around, so interpolation errs by less than 1e-3.
const WIDTH: usize = 512;
const HEIGHT: usize = WIDTH / 2;

impl EnvironmentMap {
    /// The map in its `bands` lowest bands, 1 to 8, under the widest Hanning window that leaves no negative radiance.
    ///
    /// # Errors
    /// A number of bands outside that range.
    pub fn band_limited(&self, bands: u32) -> Result<Self, ShError> {
        let image = match bands {
            1 => self.limited::<1>(),
            2 => self.limited::<2>(),
            3 => self.limited::<3>(),
            4 => self.limited::<4>(),
            5 => self.limited::<5>(),
            6 => self.limited::<6>(),
            7 => self.limited::<7>(),
            8 => self.limited::<8>(),
            _ => return Err(ShError::Order { order: bands as usize }),
        }?;
        Ok(Self::new(image))
    }

    fn limited<const ORDER: usize>(&self) -> Result<RgbImage, ShError> {
        // A map of few texels is interpolated first, as it is where it is looked up.
        let (width, height) = (self.texels.width.max(WIDTH), self.texels.height.max(HEIGHT));
        let texel = |x: usize, y: usize| {
            let place = Vec2::new((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32);
            self.texels.interpolated(place)
        };
        let colors = lat_long::<ORDER>(width, height, texel)?;
        let (colors, _) = to_non_negative(&colors, Window::Hanning { width: 1.0 });
        Ok(RgbImage::from_fn(WIDTH, HEIGHT, |x, y| {
            let direction = lat_long_direction(WIDTH, HEIGHT, x, y).as_vec3();
            let basis = Sh::<ORDER>::basis(direction);
            colors.map(|color| color.dot(&basis).max(0.0))
        }))
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn a_light_of_two_bands_stays_as_it_is_and_a_sun_becomes_soft_but_keeps_its_flux() {
        let map = |value: fn(Vec3) -> f32| {
            EnvironmentMap::new(RgbImage::from_fn(256, 128, |x, y| {
                [value(lat_long_direction(256, 128, x, y).as_vec3()); 3]
            }))
        };
        let smooth = map(|d| 1.0 + 0.5 * d.x);
        let limited = smooth.band_limited(4).unwrap();
        for (x, y) in [(10, 20), (200, 90), (256, 10)] {
            let d = lat_long_direction(512, 256, x, y).as_vec3();
            assert!((limited.texel(x, y).x - (1.0 + 0.5 * d.x)).abs() < 2e-3);
        }
        let sun = map(|d| if d.y > 0.98 { 100.0 } else { 0.1 });
        let limited = sun.band_limited(4).unwrap();
        assert!((limited.mean_radiance() / sun.mean_radiance() - 1.0).abs().max_element() < 0.01);
        assert!(limited.texel(0, 0).x < 20.0 && limited.texel(0, 255).x >= 0.0);
        assert!(sun.band_limited(9).is_err());
    }
}
