//! The settings of `shexp`.

use halflight_scene::record;
use halflight_scene::schema::{positive, within};

record! {
    /// Spherical-harmonic exponentiation: soft shadows of sphere sets and height fields under an environment, for
    /// things that deform every frame.
    pub struct ShexpSettings, "[technique.shexp]" {
        /// Bands of the spherical harmonics, from 3 to 6. More are sharper and cost more.
        #[example = "4"]
        order: u32 = 4 => within(3.0, 6.0),
        /// Spheres that stand for each mesh as a blocker; 0 lets meshes throw no shadow.
        #[example = "100"]
        spheres: u32 = 50 => within(0.0, 4096.0),
        /// Pixels between the points where shadows are worked out, along each axis; 1 works out every pixel.
        #[example = "1"]
        stride: u32 = 4 => within(1.0, 64.0),
        /// How far the irradiances at those points may differ, in parts of the unshadowed light, before the pixels between
        /// are worked out one by one.
        #[example = "0.02"]
        tolerance: f32 = 0.03 => positive(),
        /// Whether blockers that overlap count less.
        #[example = "false"]
        attenuation: bool = true,
    }
}

impl Copy for ShexpSettings {}

impl Default for ShexpSettings {
    fn default() -> Self {
        Self { order: 4, spheres: 50, stride: 4, tolerance: 0.03, attenuation: true }
    }
}
