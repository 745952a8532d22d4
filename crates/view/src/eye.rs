//! The eye of a person at the page: turning about a point, moving, looking around.

use glam::{Affine3A, Quat, Vec3};
use halflight_scene::camera::{Camera, FieldOfView};

/// How near to straight up or down the eye may look, in radians.
const POLE: f32 = 0.02;

/// What a person has taken into his own hands; everything else follows the camera of the scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Own {
    pub(crate) place: bool,
    pub(crate) field_of_view: bool,
    pub(crate) lens: bool,
}

/// Where the eye is, what it turns about, and its lens.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Eye {
    pub(crate) camera: Camera,
    /// What it looks at.
    pub(crate) target: Vec3,
    /// What is up, of length 1.
    up: Vec3,
    pub(crate) own: Own,
}

impl Eye {
    /// The camera of a scene whose shapes lie in this box; it turns about the point before it at the box's depth.
    pub(crate) fn new(camera: Camera, up: Vec3, bounds: (Vec3, Vec3)) -> Self {
        let middle = (bounds.0 + bounds.1) * 0.5;
        let eye = Self { camera, target: Vec3::ZERO, up, own: Own::default() };
        let depth = (middle - eye.origin()).dot(eye.forward());
        let size = (bounds.1 - bounds.0).length().max(1e-3);
        let distance = if depth > 1e-3 * size && depth.is_finite() { depth } else { size };
        Self { target: eye.origin() + eye.forward() * distance, ..eye }
    }

    /// Goes where the camera of the scene has gone, in all that the person has left to it.
    pub(crate) fn follow(&mut self, camera: Camera, bounds: (Vec3, Vec3)) {
        let scene = Self::new(camera, self.up, bounds);
        if !self.own.place {
            (self.camera.pose, self.target) = (scene.camera.pose, scene.target);
        }
        if !self.own.field_of_view {
            self.camera.field_of_view = camera.field_of_view;
        }
        if !self.own.lens {
            self.camera.aperture_radius = camera.aperture_radius;
            self.camera.focus_distance = camera.focus_distance;
        }
    }

    /// Another field of view.
    pub(crate) fn zoom(&mut self, field_of_view: FieldOfView) {
        self.camera.field_of_view = field_of_view;
        self.own.field_of_view = true;
    }

    /// Another lens.
    pub(crate) fn lens(&mut self, aperture_radius: f32, focus_distance: f32) {
        (self.camera.aperture_radius, self.camera.focus_distance) = (aperture_radius, focus_distance);
        self.own.lens = true;
    }

    /// Moves what it turns about to a distance before it.
    pub(crate) fn aim(&mut self, distance: f32) {
        self.target = self.origin() + self.forward() * distance;
    }

    pub(crate) fn origin(&self) -> Vec3 {
        self.camera.pose[0].translation.into()
    }

    pub(crate) fn forward(&self) -> Vec3 {
        -Vec3::from(self.camera.pose[0].matrix3.z_axis)
    }

    pub(crate) fn distance(&self) -> f32 {
        self.origin().distance(self.target).max(1e-6)
    }

    fn right_and_up(&self) -> (Vec3, Vec3) {
        let matrix = self.camera.pose[0].matrix3;
        (matrix.x_axis.into(), matrix.y_axis.into())
    }

    fn set(&mut self, pose: Affine3A) {
        if pose.is_finite() {
            self.camera.pose = [pose; 2];
            self.own.place = true;
        }
    }

    /// The direction that is turned to the right about what is up, and up, by angles.
    fn turned(&self, right: f32, up: f32) -> Vec3 {
        let forward = self.forward();
        let height = forward.dot(self.up);
        let limit = std::f32::consts::FRAC_PI_2 - POLE;
        let elevation = (height.clamp(-1.0, 1.0).asin() + up).clamp(-limit, limit);
        let flat = (forward - self.up * height).try_normalize().unwrap_or_else(|| {
            let (_, above) = self.right_and_up();
            let level = (above - self.up * above.dot(self.up)).try_normalize();
            level.unwrap_or_else(|| self.up.any_orthonormal_vector()) * -height.signum()
        });
        let flat = Quat::from_axis_angle(self.up, -right) * flat;
        flat * elevation.cos() + self.up * elevation.sin()
    }

    /// Turns about the target: π for the height of the picture.
    pub(crate) fn orbit(&mut self, x: f32, y: f32) {
        let pi = std::f32::consts::PI;
        let forward = self.turned(x * pi, -y * pi);
        let origin = self.target - forward * self.distance();
        self.set(Camera::look_at(origin, self.target, self.up));
    }

    /// Looks around: the field of view for the height of the picture.
    pub(crate) fn look(&mut self, x: f32, y: f32, vertical_fov: f32) {
        let forward = self.turned(x * vertical_fov, -y * vertical_fov);
        let (origin, distance) = (self.origin(), self.distance());
        self.target = origin + forward * distance;
        self.set(Camera::look_at(origin, self.target, self.up));
    }

    /// Moves sideways so that the target follows the pointer.
    pub(crate) fn pan(&mut self, x: f32, y: f32, vertical_fov: f32) {
        let height = 2.0 * self.distance() * (0.5 * vertical_fov).tan();
        let (right, up) = self.right_and_up();
        self.shift((up * y - right * x) * height);
    }

    /// To the right, up, forwards, in parts of the distance.
    pub(crate) fn fly(&mut self, by: [f32; 3]) {
        let (right, up) = self.right_and_up();
        let step = right * by[0] + up * by[1] + self.forward() * by[2];
        self.shift(step * self.distance());
    }

    fn shift(&mut self, step: Vec3) {
        let mut pose = self.camera.pose[0];
        pose.translation += glam::Vec3A::from(step);
        if (self.target + step).is_finite() {
            self.set(pose);
            self.target += step;
        }
    }

    pub(crate) fn dolly(&mut self, by: f32) {
        let distance = (self.distance() * by.clamp(1e-3, 1e3)).clamp(1e-5, 1e7);
        let mut pose = self.camera.pose[0];
        pose.translation = glam::Vec3A::from(self.target - self.forward() * distance);
        self.set(pose);
    }

    /// Everything in a box in view, from the same side.
    pub(crate) fn frame(&mut self, bounds: (Vec3, Vec3), vertical_fov: f32) {
        let radius = (0.5 * (bounds.1 - bounds.0).length()).max(1e-4);
        if !radius.is_finite() {
            return;
        }
        self.target = (bounds.0 + bounds.1) * 0.5;
        let distance = 1.05 * radius / (0.5 * vertical_fov).sin().max(1e-3);
        let mut pose = self.camera.pose[0];
        pose.translation = glam::Vec3A::from(self.target - self.forward() * distance);
        self.set(pose);
    }

    /// The vertical field of view of a picture of this shape, in radians.
    pub(crate) fn vertical_fov(&self, aspect: f32) -> f32 {
        match self.camera.field_of_view {
            FieldOfView::Vertical(angle) => angle,
            FieldOfView::Horizontal(angle) => 2.0 * ((0.5 * angle).tan() / aspect).atan(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn eye() -> Eye {
        let camera = Camera {
            pose: [Camera::look_at(Vec3::new(0.0, 1.0, 5.0), Vec3::ZERO, Vec3::Y); 2],
            field_of_view: FieldOfView::Vertical(0.7),
            aperture_radius: 0.0,
            focus_distance: 1.0,
        };
        Eye::new(camera, Vec3::Y, (Vec3::splat(-1.0), Vec3::splat(1.0)))
    }

    #[test]
    fn turning_keeps_the_distance_and_the_target_in_the_middle() {
        let mut eye = eye();
        let (distance, target) = (eye.distance(), eye.target);
        for (x, y) in [(0.3, 0.1), (-1.7, 4.0), (0.0, -9.0), (12.0, 0.5)] {
            eye.orbit(x, y);
            assert!((eye.distance() - distance).abs() < 1e-3);
            assert!(((target - eye.origin()).normalize()).dot(eye.forward()) > 0.9999);
            assert!(eye.camera.pose[0].is_finite());
        }
    }

    #[test]
    fn half_a_turn_and_back_is_nothing() {
        let mut eye = eye();
        let before = eye.origin();
        eye.orbit(0.4, 0.05);
        eye.orbit(-0.4, -0.05);
        assert!(eye.origin().distance(before) < 1e-3);
    }

    #[test]
    fn panning_a_picture_height_moves_by_what_is_seen() {
        let mut eye = eye();
        let (before, seen) = (eye.origin(), 2.0 * eye.distance() * 0.35f32.tan());
        eye.pan(1.0, 0.0, 0.7);
        assert!((eye.origin().distance(before) - seen).abs() < 1e-3);
    }

    #[test]
    fn no_motion_leaves_the_finite() {
        let mut eye = eye();
        for _ in 0..200 {
            eye.dolly(1e9);
            eye.fly([1e30, -1e30, 1e30]);
            eye.pan(1e30, 1e30, 0.7);
            eye.orbit(1e20, -1e20);
            eye.look(1e20, 1e20, 0.7);
            eye.frame((Vec3::NEG_INFINITY, Vec3::INFINITY), 0.7);
            assert!(eye.camera.pose[0].is_finite() && eye.target.is_finite());
        }
    }

    #[test]
    fn what_is_up_stays_up_when_it_is_not_y() {
        for up in [Vec3::Z, Vec3::NEG_Y, Vec3::new(1.0, 1.0, 0.5).normalize()] {
            let mut eye = eye();
            eye.camera.pose = [Camera::look_at(Vec3::new(3.0, -4.0, 2.0), Vec3::ZERO, up); 2];
            let mut eye = Eye::new(eye.camera, up, (Vec3::splat(-1.0), Vec3::splat(1.0)));
            let height = eye.origin().dot(up);
            for _ in 0..7 {
                eye.orbit(0.3, 0.0);
                let (right, above) = eye.right_and_up();
                assert!(right.dot(up).abs() < 1e-4 && above.dot(up) > 0.0);
                assert!((eye.origin().dot(up) - height).abs() < 1e-3);
            }
        }
    }

    #[test]
    fn the_eye_follows_the_scene_until_it_is_moved() {
        let mut eye = eye();
        let bounds = (Vec3::splat(-1.0), Vec3::splat(1.0));
        let there = Vec3::new(4.0, 2.0, 1.0);
        let moved = Camera {
            pose: [Camera::look_at(there, Vec3::ZERO, Vec3::Y); 2],
            focus_distance: 7.0,
            ..eye.camera
        };
        eye.zoom(FieldOfView::Vertical(0.2));
        eye.follow(moved, bounds);
        assert_eq!((eye.origin(), eye.camera.focus_distance), (there, 7.0));
        assert_eq!(eye.camera.field_of_view, FieldOfView::Vertical(0.2));
        eye.orbit(0.1, 0.0);
        let held = eye.origin();
        eye.follow(Camera { pose: [Camera::look_at(Vec3::ONE, Vec3::ZERO, Vec3::Y); 2], ..moved }, bounds);
        assert_eq!(eye.origin(), held);
    }
}
