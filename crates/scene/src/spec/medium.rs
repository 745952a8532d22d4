//! `[[medium]]`.

use glam::Vec3;

use crate::record;
use crate::schema::{At, Color, FilePath, at_least, between, positive};

record! {
    /// What is between surfaces: fog, smoke, milk. It absorbs and scatters within a box (`min` and `max`), within a ball
    /// (`center` and `radius`), or, without any of these, everywhere. Media that overlap add. Only the technique `path` and
    /// those that build on its paths see them.
    pub struct MediumSpec, "[[medium]]" {
        /// What messages call it.
        #[example = "\"smoke\""]
        name: Option<String>,
        /// How much of the light is swallowed on a metre.
        #[unit = "1/metre"]
        #[example = "[0.1, 0.2, 0.4]"]
        absorption: Color = Color::grey(0.0) => at_least(0.0),
        /// How much of the light is sent elsewhere on a metre.
        #[unit = "1/metre"]
        #[example = "0.5"]
        scattering: Color = Color::grey(0.0) => at_least(0.0),
        /// The mean cosine of scattering, Henyey and Greenstein's g: towards −1 back, 0 all around, towards 1 on ahead.
        #[example = "0.7"]
        anisotropy: f32 = 0.0 => between(-1.0, 1.0),
        /// Multiplies both.
        #[example = "2"]
        density: f32 = 1.0 => at_least(0.0),
        /// A file of densities that multiply both too, stretched over the box: `halflight grid 1`, a line with three sizes,
        /// `f32`, and then little-endian numbers, x fastest.
        #[example = "\"smoke.grid\""]
        grid: Option<FilePath>,
        /// Lower corner of the box.
        #[unit = "metres"]
        #[example = "[-1, 0, -1]"]
        min: Option<At<Vec3>>,
        /// Upper corner of the box.
        #[unit = "metres"]
        #[example = "[1, 2, 1]"]
        max: Option<At<Vec3>>,
        /// Middle of the ball.
        #[unit = "metres"]
        #[example = "[0, 1, 0]"]
        center: Option<At<Vec3>>,
        /// Radius of the ball.
        #[unit = "metres"]
        #[example = "0.5"]
        radius: Option<At<f32>> => positive(),
    }
}
