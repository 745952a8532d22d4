//! Sets of rays.

use std::f32::consts::TAU;

use glam::Vec3;

use crate::{Ray, World};

/// A camera for primary rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Where it stands.
    pub eye: Vec3,
    /// What it looks at.
    pub target: Vec3,
    /// Opening angle of the square picture, in radians.
    pub field_of_view: f32,
}

impl View {
    /// From the front and a little above, the ball around the box just filling the picture.
    #[must_use]
    pub fn outside(bounds: (Vec3, Vec3)) -> View {
        let (target, radius) = ball(bounds);
        let field_of_view = 0.6_f32;
        let away = Vec3::new(0.3, 0.25, 1.0).normalize() * (0.8 * radius / (field_of_view * 0.5).sin());
        View { eye: target + away, target, field_of_view }
    }

    /// From near the middle of the box towards its low corner in x and z: for rooms.
    #[must_use]
    pub fn inside(bounds: (Vec3, Vec3)) -> View {
        let (low, high) = bounds;
        let eye = low + (high - low) * Vec3::new(0.55, 0.55, 0.6);
        View { eye, target: low + (high - low) * Vec3::new(0.2, 0.4, 0.1), field_of_view: 1.2 }
    }
}

/// Centre and radius of the ball around a box.
fn ball((low, high): (Vec3, Vec3)) -> (Vec3, f32) {
    ((low + high) * 0.5, (high - low).length() * 0.5)
}

/// One ray through the middle of each of `size`² pixels, tile by tile of 8 × 8, row by row within a tile.
#[must_use]
pub fn primary_rays(view: &View, size: u32) -> Vec<Ray> {
    let forward = (view.target - view.eye).normalize();
    let right = forward.cross(Vec3::Y).normalize();
    let up = right.cross(forward);
    let half = (view.field_of_view * 0.5).tan();
    let mut rays = Vec::with_capacity((size * size) as usize);
    for tile_y in 0..size.div_ceil(8) {
        for tile_x in 0..size.div_ceil(8) {
            for pixel in 0..64 {
                let (x, y) = (tile_x * 8 + pixel % 8, tile_y * 8 + pixel / 8);
                if x < size && y < size {
                    let to_plane = |pixel: u32| ((pixel as f32 + 0.5) / size as f32 * 2.0 - 1.0) * half;
                    let direction = forward + right * to_plane(x) - up * to_plane(y);
                    rays.push(Ray::new(view.eye, direction.normalize()));
                }
            }
        }
    }
    rays
}

/// Numbers in [0, 1) from a counter. Source: Jarzynski, Olano, Hash Functions for GPU Rendering, 2020 (`pcg`).
struct Numbers(u32);

impl Numbers {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let word = ((self.0 >> ((self.0 >> 28) + 4)) ^ self.0).wrapping_mul(277_803_737);
        ((word >> 22 ^ word) >> 8) as f32 / 16_777_216.0
    }

    fn on_sphere(&mut self) -> Vec3 {
        let (z, turn) = (1.0 - 2.0 * self.next(), TAU * self.next());
        let r = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(r * turn.cos(), r * turn.sin(), z)
    }
}

/// Rays from the sphere of twice the radius around a box to points in the ball around it.
#[must_use]
pub fn random_rays(bounds: (Vec3, Vec3), count: usize) -> Vec<Ray> {
    let (centre, radius) = ball(bounds);
    let mut numbers = Numbers(1);
    (0..count)
        .map(|_| {
            let origin = centre + numbers.on_sphere() * (2.0 * radius);
            let inside = centre + numbers.on_sphere() * (radius * numbers.next().cbrt());
            Ray::new(origin, (inside - origin).normalize())
        })
        .collect()
}

/// From each hit of some rays, one ray into the hemisphere around the normal, cosine-distributed.
#[must_use]
pub fn bounce_rays(world: &World, rays: &[Ray]) -> Vec<Ray> {
    let mut numbers = Numbers(2);
    let mut bounces = Vec::new();
    for ray in rays {
        if let Some(hit) = world.closest(ray) {
            let surface = world.surface(ray, &hit);
            let normal = surface.geometric_normal * -surface.geometric_normal.dot(ray.direction).signum();
            let direction = (normal + numbers.on_sphere() * 0.999).normalize();
            bounces.push(surface.spawn(direction, 0.0));
        }
    }
    bounces
}
