//! The settings of `covariance`.

use halflight_scene::schema::{positive, within};
use halflight_scene::{choices, record};

use super::super::path::PathSettings;

choices! {
    /// What the technique `covariance` does with what it knows.
    pub enum Reconstruction, "covariance reconstruction" {
        /// Filters as wide as the covariance allows and the samples bear out.
        "filtered" => Filtered,
        /// The mean of each pixel's own samples.
        "none" => None,
    }
}

choices! {
    /// How the technique `covariance` makes a picture.
    pub enum Method, "covariance method" {
        /// Paths from the eye alone.
        "paths" => Paths,
        /// Photons for what smooth surfaces gather and for media, paths for the rest.
        "photons" => Photons,
    }
}

choices! {
    /// How wide the kernels of photons are.
    pub enum Kernel, "covariance kernel" {
        /// As the covariance of their light allows for their number.
        "covariance" => Covariance,
        /// The same for all, narrower from pass to pass.
        "fixed" => Fixed,
    }
}

choices! {
    /// What textures are averaged over.
    pub enum Textures, "covariance textures" {
        /// What the covariance of the path's rays covers, after lobes too.
        "covariance" => Covariance,
        /// What differentials of the pixel's ray cover, up to the first lobe: for comparison.
        "differentials" => Differentials,
        /// Nothing: as `path` does.
        "points" => Points,
    }
}

choices! {
    /// Where the technique `covariance` puts samples.
    pub enum Sampling, "covariance sampling" {
        /// Where the prediction and the measured variance ask for them.
        "adaptive" => Adaptive,
        /// The same number in every pixel.
        "uniform" => Uniform,
    }
}

record! {
    /// Paths that know how fast light varies around them, for few samples where the picture is blurred: by the lens, by
    /// motion, by gloss, by fog.
    pub struct CovarianceSettings, "[technique.covariance]" {
        /// How often light may scatter on its way to the eye, as in `path`.
        #[example = "1"]
        max_depth: u32 = 8 => within(0.0, 1e6),
        /// Scatterings after which a path may end by Russian roulette.
        #[example = "1000"]
        roulette_depth: u32 = 3 => within(0.0, 1e6),
        /// Paths of which one, as likely as what it brings, carries covariance, for each square of four by four pixels.
        #[example = "8"]
        pilots: u32 = 4 => within(1.0, 64.0),
        /// Where the samples go.
        #[example = "\"uniform\""]
        sampling: Sampling = Sampling::Adaptive,
        /// What makes a picture of them.
        #[example = "\"none\""]
        reconstruction: Reconstruction = Reconstruction::Filtered,
        /// The widest filter, as its standard deviation.
        #[unit = "pixels"]
        #[example = "6"]
        widest_filter: f32 = 4.0 => positive(),
        /// Paths from the eye, or photons from the lights with them: for caustics and for media.
        #[example = "\"photons\""]
        method: Method = Method::Paths,
        /// What textures and normal maps are averaged over at every vertex, less from sample to sample.
        #[example = "\"covariance\""]
        textures: Textures = Textures::Points,
        /// Photons of each pass; a pass is one sample a pixel.
        #[example = "200000"]
        photons: u32 = 65536 => within(1.0, 1e8),
        /// How wide the kernels of photons are.
        #[example = "\"fixed\""]
        kernel: Kernel = Kernel::Covariance,
        /// First radius of fixed kernels; four pixels where the camera is focused unless given.
        #[unit = "m"]
        #[example = "0.05"]
        radius: Option<f32> => positive(),
        /// How fast fixed kernels narrow: pass i + 1 has (i + this)/(i + 1) of the area of pass i; 1 is not at all.
        #[example = "0.8"]
        radius_falloff: f32 = 0.666_666_7 => within(0.0, 1.0),
    }
}

impl Copy for CovarianceSettings {}

impl Default for CovarianceSettings {
    fn default() -> Self {
        Self {
            max_depth: 8,
            roulette_depth: 3,
            pilots: 4,
            sampling: Sampling::Adaptive,
            reconstruction: Reconstruction::Filtered,
            widest_filter: 4.0,
            method: Method::Paths,
            textures: Textures::Points,
            photons: 65536,
            kernel: Kernel::Covariance,
            radius: None,
            radius_falloff: 0.666_666_7,
        }
    }
}

impl CovarianceSettings {
    /// What its paths have in common with those of `path`.
    pub(super) fn of_paths(&self) -> PathSettings {
        PathSettings { max_depth: self.max_depth, roulette_depth: self.roulette_depth, clamp: None }
    }
}
