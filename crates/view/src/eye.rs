//! The eye of a person at the page: turning about a point, moving, looking around.

use glam::{Affine3A, Mat3, Vec3};
use halflight_scene::camera::{Camera, FieldOfView};

/// How near to straight up or down the eye may look, in radians.
const POLE: f32 = 0.02;

/// Where the eye is, what it turns about, and its lens.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Eye {
    pub(crate) camera: Camera,
    /// What it looks at.
    pub(crate) target: Vec3,
}

impl Eye {
    /// The camera of a scene whose shapes lie in this box; it turns about the point before it at the box's depth.
    pub(crate) fn new(mut camera: Camera, bounds: (Vec3, Vec3)) -> Self {
        camera.pose[1] = camera.pose[0];
        let middle = (bounds.0 + bounds.1) * 0.5;
        let eye = Self { camera, target: Vec3::ZERO };
        let depth = (middle - eye.origin()).dot(eye.forward());
        let size = (bounds.1 - bounds.0).length().max(1e-3);
        let distance = if depth > 1e-3 * size && depth.is_finite() { depth } else { size };
        Self { target: eye.origin() + eye.forward() * distance, ..eye }
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
        }
    }

    /// The direction that is turned to the right about the vertical and up, by angles.
    fn turned(&self, right: f32, up: f32) -> Vec3 {
        let forward = self.forward();
        let elevation = forward.y.clamp(-1.0, 1.0).asin();
        let limit = std::f32::consts::FRAC_PI_2 - POLE;
        let elevation = (elevation + up).clamp(-limit, limit);
        let flat = Vec3::new(forward.x, 0.0, forward.z).try_normalize().unwrap_or_else(|| {
            let (_, above) = self.right_and_up();
            Vec3::new(above.x, 0.0, above.z).normalize_or(Vec3::NEG_Z) * -forward.y.signum()
        });
        let flat = Mat3::from_rotation_y(-right) * flat;
        flat * elevation.cos() + Vec3::Y * elevation.sin()
    }

    /// Turns about the target: π for the height of the picture.
    pub(crate) fn orbit(&mut self, x: f32, y: f32) {
        let pi = std::f32::consts::PI;
        let forward = self.turned(x * pi, -y * pi);
        let origin = self.target - forward * self.distance();
        self.set(Camera::look_at(origin, self.target, Vec3::Y));
    }

    /// Looks around: the field of view for the height of the picture.
    pub(crate) fn look(&mut self, x: f32, y: f32, vertical_fov: f32) {
        let forward = self.turned(x * vertical_fov, -y * vertical_fov);
        let (origin, distance) = (self.origin(), self.distance());
        self.target = origin + forward * distance;
        self.set(Camera::look_at(origin, self.target, Vec3::Y));
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
        Eye::new(camera, (Vec3::splat(-1.0), Vec3::splat(1.0)))
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
}
