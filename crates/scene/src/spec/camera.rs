//! `[image]` and `[camera]`.

use glam::Vec3;

use super::transform::TransformSpec;
use crate::schema::{At, at_least, between, positive, within};
use crate::{choices, record};

choices! {
    /// How radiance becomes the colours of an 8-bit picture.
    pub enum ToneName, "tone curve" {
        /// Clamped to 1 and encoded with the sRGB curve.
        "srgb" => Srgb,
        /// Highlights roll off as on film, then the sRGB curve.
        "filmic" => Filmic,
    }
}

record! {
    /// The picture. Options of the command take precedence.
    pub struct ImageSpec, "[image]" {
        /// Width and height.
        #[unit = "pixels"]
        #[example = "[1920, 1080]"]
        size: [u32; 2] = [1280, 720] => within(1.0, 65536.0),
        /// Exposure of 8-bit pictures; EXR files always hold radiance.
        #[unit = "stops"]
        #[example = "-0.5"]
        exposure_ev: f32 = 0.0 => within(-60.0, 60.0),
        /// Tone curve of 8-bit pictures.
        #[example = "\"filmic\""]
        tone: ToneName = ToneName::Srgb,
    }
}

record! {
    /// Where the camera stands at one time of its `keyframes`. What is absent stays as in `[camera]`.
    pub struct CameraKey, "a camera keyframe" {
        /// When.
        #[unit = "seconds"]
        #[example = "2.0"]
        time: f64,
        /// Where it stands.
        #[unit = "metres"]
        #[example = "[0, 1.5, 4]"]
        origin: Option<Vec3>,
        /// What it looks at.
        #[unit = "metres"]
        #[example = "[0, 0.5, 0]"]
        target: Option<Vec3>,
    }
}

record! {
    /// The camera: at `origin`, looking at `target`; or placed by `transform`, looking along its −z axis.
    /// A thin lens blurs what is out of focus when `aperture_radius` is above 0.
    pub struct CameraSpec, "[camera]" {
        /// Where it stands.
        #[unit = "metres"]
        #[example = "[0, 1.7, 4.6]"]
        origin: Option<At<Vec3>>,
        /// What it looks at.
        #[unit = "metres"]
        #[example = "[0, 0.7, 0]"]
        target: Option<At<Vec3>>,
        /// What is up in the picture.
        #[example = "[0, 0, 1]"]
        up: At<Vec3> = At { origin: crate::schema::Origin::nowhere(), value: Vec3::Y },
        /// Instead of `origin` and `target`: from the camera's space (looking along −z, +y up) to the world. Its scale is ignored.
        #[example = "{ translate = [0, 1, 4], rotate_degrees = [-10, 0, 0] }"]
        transform: Option<At<TransformSpec>>,
        /// Angle from the bottom to the top edge; 40 if no angle is given.
        #[unit = "degrees"]
        #[example = "30"]
        vertical_fov_degrees: Option<At<f32>> => between(0.0, 180.0),
        /// Instead of it: angle from the left to the right edge.
        #[unit = "degrees"]
        #[example = "50"]
        horizontal_fov_degrees: Option<At<f32>> => between(0.0, 180.0),
        /// Radius of the lens; 0 is a pinhole, with everything in focus.
        #[unit = "metres"]
        #[example = "0.05"]
        aperture_radius: f32 = 0.0 => at_least(0.0),
        /// Distance of the plane of focus along the viewing direction. Without it, the distance to `target`.
        #[unit = "metres"]
        #[example = "4.5"]
        focus_distance: Option<f32> => positive(),
        /// When the shutter opens and closes, relative to the time of the frame. Equal times freeze all motion.
        #[unit = "seconds"]
        #[example = "[0.0, 0.02]"]
        shutter: At<[f32; 2]> = At { origin: crate::schema::Origin::nowhere(), value: [0.0, 0.0] },
        /// Places in time; between them the camera moves along a straight line. Before the first and after the last it stands still.
        #[example = "[{ time = 0, origin = [0, 1, 5] }, { time = 2, origin = [4, 1, 3] }]"]
        keyframes: Vec<At<CameraKey>>,
    }
}
