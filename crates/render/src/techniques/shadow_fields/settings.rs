//! The settings of `shadow-fields`.

use halflight_scene::record;
use halflight_scene::schema::within;

record! {
    /// Precomputed shadow fields: soft shadows among rigid things that move, turn and scale, under an environment and
    /// lamps that may move among them.
    pub struct ShadowFieldsSettings, "[technique.shadow-fields]" {
        /// Bands of the spherical harmonics, from 3 to 6. More are sharper and cost more.
        #[example = "5"]
        order: u32 = 4 => within(3.0, 6.0),
        /// Shells of a field, from 0.2 to 8 bounding radii.
        #[example = "24"]
        shells: u32 = 16 => within(2.0, 64.0),
        /// Steps of the grid of directions on a shell along one side; it has (directions + 1)² points.
        #[example = "24"]
        directions: u32 = 16 => within(2.0, 64.0),
        /// Rays for each vector of a field.
        #[example = "1024"]
        rays: u32 = 512 => within(16.0, 65536.0),
        /// Longest distance between the points of a surface that know what the object itself hides, in bounding radii.
        #[example = "0.05"]
        spacing: f32 = 0.1 => within(0.01, 2.0),
        /// Posts along a side at which a height field is known, and levels of height above it.
        #[example = "64"]
        posts: u32 = 40 => within(2.0, 512.0),
    }
}

impl Copy for ShadowFieldsSettings {}

impl Default for ShadowFieldsSettings {
    fn default() -> Self {
        Self { order: 4, shells: 16, directions: 16, rays: 512, spacing: 0.1, posts: 40 }
    }
}
