//! What the eye sees through each pixel, for techniques that shade points instead of paths.

use glam::{Vec2, Vec3};
use halflight_material::LowFrequency;
use halflight_scene::Frame;
use halflight_scene::camera::View;
use halflight_trace::{Hit, Ray};
use rayon::prelude::*;

use crate::vertex::Vertex;

/// Columns and rows of the blocks whose rays are traced together.
pub(crate) const BLOCK: usize = 8;

/// The visible point of a pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct VisiblePoint {
    /// The hit, for what is kept by instance or primitive.
    pub(crate) hit: Hit,
    pub(crate) position: Vec3,
    /// Unit normal of the geometry, on the side of the eye.
    pub(crate) geometric_normal: Vec3,
    /// Unit shading normal, normal map included, on the side of the eye.
    pub(crate) normal: Vec3,
    /// Unit direction to the eye.
    pub(crate) towards_eye: Vec3,
    pub(crate) material: LowFrequency,
    pub(crate) emitted: Vec3,
}

/// A pixel: a visible point, or the direction in which nothing is.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Visible {
    Point(VisiblePoint),
    Nothing(Vec3),
}

/// The visible points of a picture, pixel by pixel, rows from the top.
pub(crate) struct GBuffer {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) pixels: Vec<Visible>,
}

impl GBuffer {
    /// Looks through the point `offset` of each pixel, (½, ½) for its middle. A lens counts as its middle, a shutter
    /// as the moment it opens.
    pub(crate) fn look(frame: &Frame, width: usize, height: usize, offset: Vec2) -> Self {
        let view = frame.camera.view(width, height);
        let mut pixels = vec![Visible::Nothing(Vec3::ZERO); width * height];
        pixels.par_chunks_mut(width * BLOCK).enumerate().for_each(|(band, pixels)| {
            let rows = pixels.len() / width;
            for left in (0..width).step_by(BLOCK) {
                let columns = BLOCK.min(width - left);
                look_at_block(frame, &view, pixels, [left, band * BLOCK, columns, rows], width, offset);
            }
        });
        Self { width, height, pixels }
    }
}

/// Fills the pixels of one block; `pixels` are the rows that it lies in.
fn look_at_block(
    frame: &Frame,
    view: &View,
    pixels: &mut [Visible],
    [left, top, columns, rows]: [usize; 4],
    width: usize,
    offset: Vec2,
) {
    let mut rays = [Ray::new(Vec3::ZERO, Vec3::Z); BLOCK * BLOCK];
    let mut hits: [Option<Hit>; BLOCK * BLOCK] = [None; BLOCK * BLOCK];
    let count = columns * rows;
    for (i, ray) in rays[..count].iter_mut().enumerate() {
        let pixel = Vec2::new((left + i % columns) as f32, (top + i / columns) as f32) + offset;
        *ray = view.ray(pixel, Vec2::splat(0.5), 0.0);
    }
    frame.world.closest_packet(&rays[..count], &mut hits[..count]);
    for i in 0..count {
        let visible = match hits[i] {
            Some(hit) => Visible::Point(point(frame, &rays[i], hit)),
            None => Visible::Nothing(rays[i].direction),
        };
        pixels[i / columns * width + left + i % columns] = visible;
    }
}

fn point(frame: &Frame, ray: &Ray, hit: Hit) -> VisiblePoint {
    let vertex = Vertex::new(frame, ray, &hit);
    let towards_eye = vertex.towards_eye;
    let facing = |normal: Vec3| if normal.dot(towards_eye) < 0.0 { -normal } else { normal };
    VisiblePoint {
        hit,
        position: vertex.surface.position,
        geometric_normal: facing(vertex.surface.geometric_normal),
        normal: facing(vertex.shading_normal()),
        towards_eye,
        material: vertex.bsdf.low_frequency(),
        emitted: vertex.emitted(),
    }
}
