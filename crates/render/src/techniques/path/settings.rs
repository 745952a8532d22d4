/// Settings of the technique `path`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathSettings {
    /// How often light may scatter on its way to the eye: 1 is direct light only, 0 what shines by itself.
    pub max_depth: u32,
    /// Scatterings after which a path may end by Russian roulette.
    pub roulette_depth: u32,
    /// Bound of what one indirect contribution may add to a sample, in radiance; off unless given, as it darkens.
    pub clamp: Option<f32>,
}

impl Default for PathSettings {
    fn default() -> Self {
        Self { max_depth: 8, roulette_depth: 3, clamp: None }
    }
}
