//! The settings of `bandwidth`.

use halflight_scene::schema::{positive, within};
use halflight_scene::{choices, record};

choices! {
    /// How far the technique `bandwidth` may be from the truth, and how long it takes.
    pub enum Preset, "bandwidth preset" {
        /// A relative standard error of 25 %: for moving things about.
        "draft" => Draft,
        /// 10 %.
        "default" => Default,
        /// 3 %: no noise that one sees.
        "high" => High,
    }
}

choices! {
    /// How the technique `bandwidth` shades.
    pub enum Mode, "bandwidth mode" {
        /// Samples of the lobe see the environment as it is.
        "plain" => Plain,
        /// Samples of the lobe see the environment convolved with what lies between them: fewer do.
        "preconvolved" => Preconvolved,
        /// Every pixel is shaded, by a fixed number of samples of its lobe: what the others are measured against.
        "forward" => Forward,
        /// Every pixel is shaded, by a fixed number of samples of lobe and light together: the truth.
        "reference" => Reference,
    }
}

choices! {
    /// What light has to pass on its way.
    pub enum Visibility, "bandwidth visibility" {
        /// Nothing: no shadows, as in the seed.
        "off" => Off,
        /// A shadow ray for each sample.
        "rays" => Rays,
        /// Spheres that stand for meshes, and height fields, in four bands of harmonics, as `shexp` has them: soft shadows
        /// without rays.
        "spheres" => Spheres,
    }
}

choices! {
    /// Points a pixel where it needs more than one.
    pub enum Antialias, "bandwidth antialiasing" {
        /// One.
        "1x" => One,
        /// Four, two by two.
        "4x" => Four,
        /// Sixteen, four by four.
        "16x" => Sixteen,
    }
}

record! {
    /// Shades only where the picture varies, by as many samples as each pixel needs, both predicted from bandwidth: measured
    /// materials under an environment and area lights, for things, lights and materials that change in every frame.
    pub struct BandwidthSettings, "[technique.bandwidth]" {
        /// Target of the error, by name.
        #[example = "\"draft\""]
        preset: Preset = Preset::Default,
        /// Target of the relative standard error of a shaded pixel, instead of the preset's.
        #[example = "0.02"]
        error: Option<f32> => positive(),
        /// How pixels are shaded.
        #[example = "\"plain\""]
        mode: Mode = Mode::Preconvolved,
        /// n_b: directions towards light by which the bandwidth of a place is judged.
        #[example = "64"]
        directions: u32 = 16 => within(1.0, 1024.0),
        /// What stops light.
        #[example = "\"rays\""]
        visibility: Visibility = Visibility::Off,
        /// Points for pixels at edges and where the picture varies within a pixel.
        #[example = "\"4x\""]
        antialias: Antialias = Antialias::One,
        /// Whether the tables of a measured material are kept from run to run, in a file beside that of the material.
        #[example = "false"]
        cache: bool = true,
        /// Samples of every pixel in the modes `forward` and `reference`.
        #[example = "256"]
        samples: u32 = 64 => within(1.0, 1048576.0),
    }
}

impl Copy for BandwidthSettings {}

impl Default for BandwidthSettings {
    fn default() -> Self {
        Self {
            preset: Preset::Default,
            error: None,
            mode: Mode::Preconvolved,
            directions: 16,
            visibility: Visibility::Off,
            antialias: Antialias::One,
            cache: true,
            samples: 64,
        }
    }
}

impl BandwidthSettings {
    /// The relative standard error that is aimed at.
    #[must_use]
    pub fn target_error(&self) -> f32 {
        self.error.unwrap_or(match self.preset {
            Preset::Draft => 0.25,
            Preset::Default => 0.1,
            Preset::High => 0.03,
        })
    }

    /// Whether every pixel is shaded by a fixed number of samples.
    #[must_use]
    pub fn is_exhaustive(&self) -> bool {
        matches!(self.mode, Mode::Forward | Mode::Reference)
    }
}
