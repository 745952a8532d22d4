use halflight_scene::record;
use halflight_scene::schema::{positive, within};

record! {
    /// The reference path tracer: multiple importance sampling of lights and materials, without bias.
    pub struct PathSettings, "[technique.path]" {
        /// How often light may scatter on its way to the eye: 1 is direct light only, 0 what shines by itself.
        #[example = "1"]
        max_depth: u32 = 8 => within(0.0, 1e6),
        /// Scatterings after which a path may end by Russian roulette.
        #[example = "1000"]
        roulette_depth: u32 = 3 => within(0.0, 1e6),
        /// Bound of what one indirect contribution may add to a sample; off unless given, as it darkens.
        #[unit = "radiance"]
        #[example = "10"]
        clamp: Option<f32> => positive(),
    }
}

impl Copy for PathSettings {}

impl Default for PathSettings {
    fn default() -> Self {
        Self { max_depth: 8, roulette_depth: 3, clamp: None }
    }
}
