//! Cameras: from a point on the film, a point on the lens and a time to a ray.
//!
//! A camera looks along −z of its own frame with +y up and +x to the right. A point (s, t) of the plane at distance 1 is
//! s = (2 x / width − 1) tan(fov_x / 2), t = (1 − 2 y / height) tan(fov_y / 2), where (x, y) are continuous pixel
//! coordinates: pixel (i, j) covers [i, i+1) × [j, j+1) and row 0 is on top.
//!
//! A thin lens of radius a focused at distance f sends the ray from (a p, 0), p uniform on the unit disk, through
//! f (s, t, −1): the plane of focus is perpendicular to the viewing direction.

use glam::{Affine3A, Vec2, Vec3};
use halflight_trace::{Ray, RayGrid};

use crate::sampling::concentric_disk;

/// Which side of the picture a field of view is measured along.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FieldOfView {
    /// From the bottom to the top edge, in radians.
    Vertical(f32),
    /// From the left to the right edge, in radians.
    Horizontal(f32),
}

/// A pinhole (aperture radius 0) or thin-lens camera at one frame, which may move while its shutter is open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Camera to world when the shutter opens and when it closes; rigid.
    pub pose: [Affine3A; 2],
    /// The field of view.
    pub field_of_view: FieldOfView,
    /// Radius of the lens in metres; 0 for a pinhole.
    pub aperture_radius: f32,
    /// Distance of the plane of focus in metres.
    pub focus_distance: f32,
}

impl Camera {
    /// The rigid transform of a camera at `origin` that looks at `target`; `up` need not be perpendicular.
    ///
    /// Where the two points meet or `up` is parallel to the viewing direction, another axis is used.
    pub fn look_at(origin: Vec3, target: Vec3, up: Vec3) -> Affine3A {
        let forward = (target - origin).try_normalize().unwrap_or(Vec3::NEG_Z);
        let right = forward.cross(up).try_normalize().unwrap_or_else(|| forward.any_orthonormal_vector());
        let matrix = glam::Mat3::from_cols(right, right.cross(forward), -forward);
        Affine3A::from_mat3_translation(matrix, origin)
    }

    /// The camera in front of a film of `width` × `height` pixels.
    pub fn view(&self, width: usize, height: usize) -> View {
        let aspect = width as f32 / height as f32;
        let (tan_x, tan_y) = match self.field_of_view {
            FieldOfView::Vertical(angle) => ((0.5 * angle).tan() * aspect, (0.5 * angle).tan()),
            FieldOfView::Horizontal(angle) => ((0.5 * angle).tan(), (0.5 * angle).tan() / aspect),
        };
        View {
            camera: *self,
            scale: Vec2::new(2.0 * tan_x / width as f32, -2.0 * tan_y / height as f32),
            offset: Vec2::new(-tan_x, tan_y),
            moves: self.pose[0] != self.pose[1],
        }
    }
}

/// A camera in front of a film of known size.
#[derive(Clone, Copy, Debug)]
pub struct View {
    camera: Camera,
    scale: Vec2,
    offset: Vec2,
    moves: bool,
}

impl View {
    /// The ray through the continuous pixel position `pixel`, from the lens point that the unit-square sample
    /// `lens` chooses, at `time` in 0..1 across the shutter.
    #[inline]
    pub fn ray(&self, pixel: Vec2, lens: Vec2, time: f32) -> Ray {
        let plane = (self.offset + pixel * self.scale).extend(-1.0);
        let (origin, direction) = if self.camera.aperture_radius > 0.0 {
            let origin = (self.camera.aperture_radius * concentric_disk(lens)).extend(0.0);
            (origin, plane * self.camera.focus_distance - origin)
        } else {
            (Vec3::ZERO, plane)
        };
        let pose = self.pose_at(time);
        Ray {
            origin: pose.transform_point3(origin),
            direction: pose.transform_vector3(direction).normalize(),
            t_max: f32::INFINITY,
            time,
        }
    }

    /// The rays through the point `offset` of each pixel, from the middle of the lens as the shutter opens: those of
    /// [`View::ray`], all together.
    pub fn grid(&self, offset: Vec2, columns: usize, rows: usize) -> RayGrid {
        let pose = self.camera.pose[0];
        let corner = (self.offset + offset * self.scale).extend(-1.0);
        RayGrid {
            origin: pose.translation.into(),
            corner: pose.transform_vector3(corner),
            across: pose.transform_vector3(Vec3::X * self.scale.x),
            down: pose.transform_vector3(Vec3::Y * self.scale.y),
            columns,
            rows,
        }
    }

    /// Distance from the eye to `point` along the viewing direction, in metres.
    pub fn depth(&self, point: Vec3, time: f32) -> f32 {
        let pose = self.pose_at(time);
        Vec3::from(pose.matrix3.z_axis).dot(Vec3::from(pose.translation) - point)
    }

    #[inline]
    fn pose_at(&self, time: f32) -> Affine3A {
        let [open, close] = self.camera.pose;
        if !self.moves {
            return open;
        }
        let mix = |a: glam::Vec3A, b: glam::Vec3A| a + time * (b - a);
        Affine3A {
            matrix3: glam::Mat3A::from_cols(
                mix(open.matrix3.x_axis, close.matrix3.x_axis),
                mix(open.matrix3.y_axis, close.matrix3.y_axis),
                mix(open.matrix3.z_axis, close.matrix3.z_axis),
            ),
            translation: mix(open.translation, close.translation),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The camera of the reference scene `bunny_diffuse`, with the directions its description gives.
    #[test]
    fn a_pinhole_sends_the_rays_that_the_reference_scenes_describe() {
        let camera = Camera {
            pose: [Camera::look_at(Vec3::new(0.0, 1.7, 4.6), Vec3::new(0.0, 0.72, 0.0), Vec3::Y); 2],
            field_of_view: FieldOfView::Horizontal(34f32.to_radians()),
            aperture_radius: 0.0,
            focus_distance: 1.0,
        };
        let view = camera.view(512, 512);
        for (pixel, direction) in [
            ([0.5, 0.5], [-0.280_161_6, 0.082_697_58, -0.956_384_1]),
            ([511.5, 0.5], [0.280_161_6, 0.082_697_58, -0.956_384_1]),
            ([153.6, 409.6], [-0.119_424_39, -0.378_685_54, -0.917_788_14]),
            ([256.0, 256.0], [0.0, -0.208_367_3, -0.978_050_64]),
        ] {
            let ray = view.ray(Vec2::from(pixel), Vec2::splat(0.5), 0.0);
            assert!(ray.direction.distance(Vec3::from(direction)) < 1e-6, "{pixel:?}");
        }
    }

    #[test]
    fn the_rays_of_a_grid_are_those_through_its_pixels() {
        let camera = Camera {
            pose: [Camera::look_at(Vec3::new(1.0, 2.0, 3.0), Vec3::ZERO, Vec3::Y); 2],
            field_of_view: FieldOfView::Vertical(0.7),
            aperture_radius: 0.1,
            focus_distance: 2.5,
        };
        let (view, offset) = (camera.view(40, 30), Vec2::new(0.3, 0.8));
        let grid = view.grid(offset, 40, 30);
        for (x, y) in [(0, 0), (39, 0), (17, 29)] {
            let (a, b) =
                (view.ray(Vec2::new(x as f32, y as f32) + offset, Vec2::splat(0.5), 0.0), grid.ray(x, y));
            assert!(a.origin.distance(b.origin) < 1e-6 && a.direction.distance(b.direction) < 1e-6);
        }
    }

    #[test]
    fn rays_through_the_whole_lens_meet_in_the_plane_of_focus() {
        let camera = Camera {
            pose: [Camera::look_at(Vec3::new(1.0, 2.0, 3.0), Vec3::ZERO, Vec3::Y); 2],
            field_of_view: FieldOfView::Vertical(0.7),
            aperture_radius: 0.3,
            focus_distance: 2.5,
        };
        let view = camera.view(640, 360);
        let pixel = Vec2::new(100.0, 50.0);
        let meeting = |lens: Vec2| {
            let ray = view.ray(pixel, lens, 0.0);
            let to_plane =
                (2.5 - view.depth(ray.origin, 0.0)) / (view.depth(ray.origin + ray.direction, 0.0));
            ray.origin + ray.direction * to_plane
        };
        let first = meeting(Vec2::new(0.1, 0.2));
        for lens in [[0.9, 0.3], [0.5, 0.99], [0.01, 0.7]] {
            assert!(meeting(Vec2::from(lens)).distance(first) < 1e-4);
        }
    }
}
