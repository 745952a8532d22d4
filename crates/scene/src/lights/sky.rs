//! Built-in light: a clear sky with its sun, and a studio with soft boxes, both baked into latitude–longitude maps.
//!
//! The sky is Preetham, Shirley and Smits, *A Practical Analytic Model for Daylight* (1999), with the colour of the
//! sun from its height, a sun disk wider than the real one (so that a map can hold it) of equal flux, and a ground of
//! constant albedo below the horizon. It is scaled so that a white diffuse floor has radiance near one.

use glam::{Mat3, Vec3};
use halflight_image::RgbImage;

/// Columns of the baked sky.
const SKY_WIDTH: usize = 1024;
/// Angular radius of the sun in the map, in radians: ten times the sun's, three texels.
const SUN_RADIUS: f32 = 0.02;

/// Parameters of the built-in sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sky {
    /// Height of the sun above the horizon, in radians.
    pub sun_elevation: f32,
    /// Where the sun stands, in radians from −z towards +x.
    pub sun_azimuth: f32,
    /// Haziness: 2 is very clear, 6 is hazy.
    pub turbidity: f32,
    /// Reflectance of the ground below the horizon.
    pub ground_albedo: f32,
}

impl Default for Sky {
    fn default() -> Self {
        Self { sun_elevation: 0.75, sun_azimuth: -0.7, turbidity: 3.0, ground_albedo: 0.2 }
    }
}

impl Sky {
    /// The sky as a map in the layout of [`super::environment`].
    pub fn bake(&self) -> RgbImage {
        let turbidity = self.turbidity.clamp(1.7, 10.0);
        let elevation = self.sun_elevation.clamp(0.02, std::f32::consts::FRAC_PI_2);
        let sun = direction_at(self.sun_azimuth, elevation);
        let zenith_angle = std::f32::consts::FRAC_PI_2 - elevation;
        let perez = Perez::new(turbidity, zenith_angle);
        let sun_radiance = sun_color(elevation, turbidity) * sun_to_sky_radiance();
        // Radiance of the ground under the sky and the sun, taken as uniform.
        let ground = self.ground_albedo
            * (perez.rgb(0.6, 0.8) + sun_radiance * (SUN_RADIUS * SUN_RADIUS) * elevation.sin());
        bake(|direction| {
            if direction.y <= 0.0 {
                return ground;
            }
            let cos_gamma = direction.dot(sun).clamp(-1.0, 1.0);
            let sky = perez.rgb(direction.y.max(0.02).acos(), cos_gamma.acos());
            let edge = (cos_gamma - SUN_RADIUS.cos()) / (1.0 - SUN_RADIUS.cos());
            sky + sun_radiance * smooth_step(edge / 0.3)
        })
    }
}

/// Radiance of the widened sun in units of the sky's scale: sun and sky give a horizontal floor about 5 : 1 on a clear day.
fn sun_to_sky_radiance() -> f32 {
    2.6 / (std::f32::consts::PI * SUN_RADIUS * SUN_RADIUS)
}

/// Colour of direct sunlight after the air it passes: Rayleigh and aerosol extinction at three wavelengths over the
/// relative air mass of Kasten and Young.
fn sun_color(elevation: f32, turbidity: f32) -> Vec3 {
    let degrees = elevation.to_degrees();
    let air_mass = 1.0 / (elevation.sin() + 0.50572 * (degrees + 6.07995).powf(-1.6364));
    let rayleigh = Vec3::new(0.048, 0.099, 0.218);
    let aerosol = Vec3::new(0.58, 0.70, 0.90) * 0.046 * (turbidity - 1.0).max(0.0);
    (-(rayleigh + aerosol) * air_mass).to_array().map(f32::exp).into()
}

/// The sky of Preetham et al.: a zenith colour in xyY and the function of Perez for each of the three.
struct Perez {
    zenith: Vec3,
    coefficients: [[f32; 5]; 3],
    sun_zenith: f32,
}

impl Perez {
    fn new(t: f32, sun_zenith: f32) -> Self {
        let chi = (4.0 / 9.0 - t / 120.0) * (std::f32::consts::PI - 2.0 * sun_zenith);
        let luminance = (4.0453 * t - 4.9710) * chi.tan() - 0.2155 * t + 2.4192;
        let powers = [sun_zenith.powi(3), sun_zenith.powi(2), sun_zenith, 1.0];
        let chromaticity = |rows: [[f32; 4]; 3]| {
            let along = rows.map(|row| row.iter().zip(powers).map(|(a, b)| a * b).sum::<f32>());
            t * t * along[0] + t * along[1] + along[2]
        };
        let x = chromaticity([
            [0.00166, -0.00375, 0.00209, 0.0],
            [-0.02903, 0.06377, -0.03202, 0.00394],
            [0.11693, -0.21196, 0.06052, 0.25886],
        ]);
        let y = chromaticity([
            [0.00275, -0.00610, 0.00317, 0.0],
            [-0.04214, 0.08970, -0.04153, 0.00516],
            [0.15346, -0.26756, 0.06670, 0.26688],
        ]);
        Self {
            zenith: Vec3::new(x, y, luminance.max(0.1)),
            coefficients: [
                [
                    -0.0193 * t - 0.2592,
                    -0.0665 * t + 0.0008,
                    -0.0004 * t + 0.2125,
                    -0.0641 * t - 0.8989,
                    -0.0033 * t + 0.0452,
                ],
                [
                    -0.0167 * t - 0.2608,
                    -0.0950 * t + 0.0092,
                    -0.0079 * t + 0.2102,
                    -0.0441 * t - 1.6537,
                    -0.0109 * t + 0.0529,
                ],
                [
                    0.1787 * t - 1.4630,
                    -0.3554 * t + 0.4275,
                    -0.0227 * t + 5.3251,
                    0.1206 * t - 2.5771,
                    -0.0670 * t + 0.3703,
                ],
            ],
            sun_zenith,
        }
    }

    /// Linear Rec. 709 at zenith angle `theta` and angle `gamma` from the sun; 1 is about 25 kcd/m².
    fn rgb(&self, theta: f32, gamma: f32) -> Vec3 {
        let value = |channel: usize| {
            let c = self.coefficients[channel];
            let perez = |theta: f32, gamma: f32| {
                (1.0 + c[0] * (c[1] / theta.cos().max(0.01)).exp())
                    * (1.0 + c[2] * (c[3] * gamma).exp() + c[4] * gamma.cos().powi(2))
            };
            self.zenith[channel] * perez(theta, gamma) / perez(0.0, self.sun_zenith)
        };
        let (x, y, luminance) = (value(0), value(1), value(2) / 25.0);
        let xyz = Vec3::new(x / y, 1.0, (1.0 - x - y) / y) * luminance;
        XYZ_TO_REC709.mul_vec3(xyz).max(Vec3::ZERO)
    }
}

/// IEC 61966-2-1, columns X, Y, Z.
const XYZ_TO_REC709: Mat3 = Mat3::from_cols(
    Vec3::new(3.240_454, -0.969_266, 0.055_643),
    Vec3::new(-1.537_138, 1.876_011, -0.204_026),
    Vec3::new(-0.498_531, 0.041_556, 1.057_225),
);

/// A photographer's studio: a large warm key box, a cool fill, a thin rim strip, and a dim gradient between them.
pub fn studio() -> RgbImage {
    // Azimuth from −z towards +x and elevation of the centre, half sizes, all in radians; radiance. A camera at the
    // usual place looks along −z, so a key light behind its left shoulder stands at azimuth −130°.
    struct SoftBox {
        azimuth: f32,
        elevation: f32,
        half_width: f32,
        half_height: f32,
        radiance: Vec3,
    }
    let boxes = [
        SoftBox {
            azimuth: -2.2,
            elevation: 0.85,
            half_width: 0.42,
            half_height: 0.32,
            radiance: Vec3::new(15.0, 13.6, 11.8),
        },
        SoftBox {
            azimuth: 1.75,
            elevation: 0.45,
            half_width: 0.30,
            half_height: 0.45,
            radiance: Vec3::new(2.6, 3.0, 3.6),
        },
        SoftBox {
            azimuth: 0.45,
            elevation: 0.55,
            half_width: 0.60,
            half_height: 0.09,
            radiance: Vec3::new(9.0, 9.0, 9.4),
        },
    ];
    bake(|direction| {
        let elevation = direction.y.clamp(-1.0, 1.0).asin();
        let azimuth = direction.x.atan2(-direction.z);
        let wall = Vec3::new(0.20, 0.21, 0.23) * (0.35 + 0.65 * smooth_step(0.5 + 0.5 * direction.y));
        boxes.iter().fold(wall, |sum, b| {
            let turn = (azimuth - b.azimuth + std::f32::consts::PI).rem_euclid(std::f32::consts::TAU)
                - std::f32::consts::PI;
            let across = turn * elevation.cos() / b.half_width;
            let up = (elevation - b.elevation) / b.half_height;
            // Soft edges keep the map's interpolation from stepping.
            let edge = |x: f32| smooth_step((1.0 - x.abs()) / 0.15);
            sum + b.radiance * edge(across) * edge(up)
        })
    })
}

fn bake(radiance: impl Fn(Vec3) -> Vec3 + Sync) -> RgbImage {
    let (width, height) = (SKY_WIDTH, SKY_WIDTH / 2);
    RgbImage::from_fn(width, height, |x, y| {
        let azimuth = std::f32::consts::TAU * ((x as f32 + 0.5) / width as f32 - 0.5);
        let elevation = std::f32::consts::PI * (0.5 - (y as f32 + 0.5) / height as f32);
        radiance(direction_at(azimuth, elevation)).to_array()
    })
}

fn direction_at(azimuth: f32, elevation: f32) -> Vec3 {
    Vec3::new(azimuth.sin() * elevation.cos(), elevation.sin(), -azimuth.cos() * elevation.cos())
}

fn smooth_step(x: f32) -> f32 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sky_and_the_studio_are_finite_and_nowhere_negative() {
        for elevation in [-0.2, 0.0, 0.1, 0.8, 1.57] {
            for turbidity in [1.0, 2.0, 4.0, 12.0] {
                let map = Sky { sun_elevation: elevation, turbidity, ..Sky::default() }.bake();
                assert!(
                    map.pixels.iter().flatten().all(|c| c.is_finite() && *c >= 0.0),
                    "{elevation} {turbidity}"
                );
            }
        }
        assert!(studio().pixels.iter().flatten().all(|c| c.is_finite() && *c > 0.0));
    }

    #[test]
    fn the_clear_sky_is_blue_above_and_the_sun_is_brightest() {
        let sky = Sky { sun_elevation: 0.6, sun_azimuth: 0.0, turbidity: 2.5, ground_albedo: 0.2 };
        let map = sky.bake();
        let top = map.pixels[map.width * 20];
        assert!(top[2] > 1.3 * top[0], "{top:?}");
        let (brightest, _) =
            map.pixels.iter().enumerate().max_by(|a, b| a.1[1].total_cmp(&b.1[1])).expect("texels");
        let elevation = 90.0 - 180.0 * ((brightest / map.width) as f32 + 0.5) / map.height as f32;
        assert!((elevation - 0.6f32.to_degrees()).abs() < 1.5, "{elevation}");
    }
}
