//! The camera as the last event of a path: from light that arrives at the lens to pixels, lens and shutter.

use glam::{Vec2, Vec3};
use halflight_frequency::covariance::{Covariance5, ThinLensCamera};
use halflight_scene::Frame;
use halflight_scene::camera::View;

/// A frame's camera in front of a film.
pub(super) struct FilmAxes {
    pub(super) view: View,
    /// Width of a pixel on the plane at distance 1.
    pub(super) pixel: f32,
    size: [usize; 2],
    /// To the right and down in the picture, and ahead, as the shutter opens.
    pub(super) right: Vec3,
    pub(super) down: Vec3,
    pub(super) ahead: Vec3,
    aperture: f32,
    focus: f32,
    shutter: bool,
    /// How far the camera goes while the shutter is open, and how its view turns.
    moves: [Vec3; 2],
}

impl FilmAxes {
    pub(super) fn new(frame: &Frame, width: usize, height: usize) -> Self {
        let camera = &frame.camera;
        let view = camera.view(width, height);
        let [open, close] = camera.pose;
        let through = |x: f32, y: f32| {
            let ray = pinhole(frame, width, height).ray(Vec2::new(x, y), Vec2::splat(0.5), 0.0);
            ray.direction
        };
        let (x, y) = (0.5 * width as f32, 0.5 * height as f32);
        let pixel = through(x + 1.0, y).distance(through(x, y));
        let ahead = -Vec3::from(open.matrix3.z_axis);
        Self {
            view,
            pixel: if pixel > 0.0 { pixel } else { 1e-3 },
            size: [width, height],
            right: open.matrix3.x_axis.into(),
            down: -Vec3::from(open.matrix3.y_axis),
            ahead,
            aperture: camera.aperture_radius,
            focus: camera.focus_distance,
            shutter: frame.shutter_is_open(),
            moves: [(close.translation - open.translation).into(), -Vec3::from(close.matrix3.z_axis) - ahead],
        }
    }

    /// The direction in which the middle of the lens sees the middle of a pixel as the shutter opens.
    pub(super) fn direction(&self, x: usize, y: usize) -> Vec3 {
        let middle = [0.5 * self.size[0] as f32, 0.5 * self.size[1] as f32];
        let (s, t) = (x as f32 + 0.5 - middle[0], y as f32 + 0.5 - middle[1]);
        (self.ahead + self.pixel * (s * self.right + t * self.down)).normalize()
    }

    /// The axes of the film across a ray of this direction.
    pub(super) fn across(&self, direction: Vec3) -> [Vec3; 2] {
        let right = self.right - direction * direction.dot(self.right);
        let right = right.normalize_or(direction.any_orthonormal_vector());
        [right, direction.cross(right)]
    }

    /// Variance, in pixels², that the lens gives a point at `depth`.
    pub(super) fn blur(&self, depth: f32) -> f32 {
        let blur = 0.5 * self.aperture * (1.0 / depth.max(1e-6) - 1.0 / self.focus) / self.pixel;
        blur * blur
    }

    /// How far a velocity (metres a shutter) at `depth` goes in the picture, in pixels.
    pub(super) fn streak(&self, velocity: Vec3, depth: f32) -> Vec2 {
        let of_camera = self.moves[0] + self.moves[1] * depth;
        let relative = velocity - of_camera;
        Vec2::new(relative.dot(self.right), relative.dot(self.down)) / (depth.max(1e-6) * self.pixel)
    }

    fn camera(&self, direction: Vec3) -> ThinLensCamera {
        let cos = direction.dot(self.ahead).clamp(0.1, 1.0);
        // Off the axis a pixel spans less, and the plane of focus is further away along the ray.
        let pixel = f64::from(self.pixel * cos * cos.sqrt());
        ThinLensCamera {
            pixel: [pixel; 2],
            focus_distance: f64::from(self.focus / cos),
            aperture_radius: f64::from(self.aperture),
        }
    }

    /// Light past the lens, which turns what comes from a point in focus into what comes from afar, and how far away that point is;
    /// `None` for a pinhole.
    pub(super) fn lens(&self, direction: Vec3, light: &Covariance5) -> Option<(Covariance5, f64)> {
        let camera = self.camera(direction);
        let [x, y] = self.across(direction);
        let on = |v: Vec3| [f64::from(v.dot(x)), f64::from(v.dot(y))];
        let arriving = light.into_motion(on(self.moves[0]), on(self.moves[1]));
        (self.aperture > 0.0).then(|| (arriving.thin_lens(camera.focus_distance), camera.focus_distance))
    }

    /// From light at the lens, on the axes of [`FilmAxes::across`], to the film.
    pub(super) fn film(&self, direction: Vec3, light: &Covariance5) -> Covariance5 {
        let camera = self.camera(direction);
        if let Some((past, _)) = self.lens(direction, light) {
            // Behind the lens rays of a point in focus are parallel: the film is as far away as it likes.
            return ThinLensCamera { focus_distance: 0.0, ..camera }.film(&past);
        }
        let [x, y] = self.across(direction);
        let on = |v: Vec3| [f64::from(v.dot(x)), f64::from(v.dot(y))];
        camera.film(&light.into_motion(on(self.moves[0]), on(self.moves[1])))
    }

    /// What pixel, lens and shutter integrate over.
    pub(super) fn windows(&self) -> [f64; 5] {
        self.camera(self.ahead).integrated(self.shutter)
    }
}

/// The same camera with a lens of no size.
pub(super) fn pinhole(frame: &Frame, width: usize, height: usize) -> View {
    let camera = halflight_scene::camera::Camera { aperture_radius: 0.0, ..frame.camera };
    camera.view(width, height)
}
