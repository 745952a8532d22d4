//! Techniques that can say why a pixel is as it is: what `halflight explain` prints and the viewer shows.

use halflight_frequency::covariance::Steps;
use halflight_scene::schema::{self, Table};
use halflight_scene::{Frame, Scene};

use super::bandwidth::BandwidthTechnique;
use super::covariance::Covariance;
use crate::technique::{Progress, Technique};

/// The techniques that [`explain`] knows.
pub const EXPLAIN: &[&str] = &["bandwidth", "covariance"];

/// A pixel explained.
#[derive(Clone, Debug)]
pub struct Explained {
    /// In words, lines that end in a line break.
    pub text: String,
    /// The events of the path that brings most, where the technique follows paths.
    pub steps: Option<Steps<5>>,
}

/// Why the technique of this name, with these settings, shades the pixel in column `x` and row `y` of a picture of
/// `width` × `height` as it does; `None` if there is no such pixel, or the technique cannot say (see [`EXPLAIN`]).
///
/// The scene is asked for what outlives a frame, the frame for everything else.
///
/// # Errors
/// Settings that it does not have, or a scene that it cannot show.
pub fn explain(
    (name, settings): (&str, &Table),
    scene: &Scene,
    frame: &Frame,
    size: [usize; 2],
    pixel: [usize; 2],
    progress: &dyn Progress,
) -> Result<Option<Explained>, String> {
    match name {
        "bandwidth" => {
            let settings = schema::read(settings).map_err(|error| error.to_string())?;
            let mut technique = BandwidthTechnique::new(settings);
            technique.prepare(scene, progress).map_err(|error| error.to_string())?;
            Ok(technique.explain(frame, size, pixel).map(|text| Explained { text, steps: None }))
        }
        "covariance" => {
            let settings = schema::read(settings).map_err(|error| error.to_string())?;
            let found = Covariance::new(settings).explain(frame, size, pixel);
            Ok(found.map(|found| Explained { text: found.text, steps: Some(found.steps) }))
        }
        _ => Ok(None),
    }
}
