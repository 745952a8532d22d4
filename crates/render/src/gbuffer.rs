//! What the eye sees through each pixel, for techniques that shade points instead of paths.

use std::sync::{Mutex, PoisonError};

use glam::{Vec2, Vec3};
use halflight_material::{LowFrequency, Material, SurfaceInput};
use halflight_scene::Frame;
use halflight_trace::{Geometry, GridPoints, GridRows, Hit, Instance, Ray};
use rayon::prelude::*;

use crate::film::Region;
use crate::vertex::{Vertex, facing_like};

/// Rows that are looked at in one piece of work.
const BAND: usize = 16;

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

/// Memory for the pixels of a [`GBuffer`], kept from picture to picture: to ask for it anew costs as much as to fill it.
#[derive(Default)]
pub(crate) struct Room(Mutex<Vec<Visible>>);

/// The visible points of a picture, pixel by pixel, rows from the top.
pub(crate) struct GBuffer {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) pixels: Vec<Visible>,
}

impl GBuffer {
    /// Looks through the point `offset` of each pixel of a region, (½, ½) for its middle; outside of it there is nothing. A
    /// lens counts as its middle, a shutter as the moment it opens.
    pub(crate) fn look(
        frame: &Frame,
        [width, height]: [usize; 2],
        region: Region,
        offset: Vec2,
        room: &Room,
    ) -> Self {
        let grid = frame.camera.view(width, height).grid(offset, width, height);
        let tracer = frame.world.grid(grid);
        let plain = Plain::of(frame);
        let mut pixels = std::mem::take(&mut *room.0.lock().unwrap_or_else(PoisonError::into_inner));
        pixels.resize(width * height, Visible::Nothing(Vec3::ZERO));
        pixels.par_chunks_mut(width * BAND).enumerate().for_each_init(
            || (GridRows::default(), vec![None; width * BAND], GridPoints::default()),
            |(room, hits, points), (band, pixels)| {
                let (top, hits) = (band * BAND, &mut hits[..pixels.len()]);
                if top >= region.y + region.height || top + BAND <= region.y {
                    pixels.fill(Visible::Nothing(Vec3::Z));
                    return;
                }
                // Rows are traced whole, as in the whole picture, so that they hold the same bits.
                tracer.rows(top, room, hits);
                tracer.points(top, hits, points);
                for (i, (hit, pixel)) in hits.iter().zip(pixels).enumerate() {
                    let (x, y) = (i % width, top + i / width);
                    let ray = grid.ray(x, y);
                    let Some(hit) = hit.as_ref().filter(|_| region.contains(x, y)) else {
                        *pixel = Visible::Nothing(ray.direction);
                        continue;
                    };
                    let material = plain.material(frame, hit.instance, points.material_slot[i]);
                    *pixel = Visible::Point(match material {
                        Some(material) => plain_point(&ray, *hit, points, i, material),
                        None => point(frame, &ray, *hit),
                    });
                }
            },
        );
        Self { width, height, pixels }
    }

    /// Gives the memory back for the next picture.
    pub(crate) fn leave(self, room: &Room) {
        *room.0.lock().unwrap_or_else(PoisonError::into_inner) = self.pixels;
    }
}

/// Materials of which all that shading needs is known before: alike everywhere, and not shining.
struct Plain {
    /// By index in the frame.
    materials: Vec<Option<LowFrequency>>,
    /// By instance: whether its geometry has colours of its own.
    colored: Vec<bool>,
}

impl Plain {
    fn of(frame: &Frame) -> Self {
        let input = SurfaceInput { uv: Vec2::ZERO, color: Vec3::ONE };
        let alike = |material: &Material| {
            (material.is_uniform() && !material.is_emissive()).then(|| material.bsdf(&input).low_frequency())
        };
        let colored = |instance: &Instance| match instance.geometry.as_ref() {
            Geometry::Mesh(mesh) => !mesh.mesh().colors.is_empty(),
            Geometry::Custom(_) => true,
            _ => false,
        };
        Self {
            materials: frame.materials.iter().map(|material| alike(material)).collect(),
            colored: frame.world.instances().iter().map(colored).collect(),
        }
    }

    #[inline]
    fn material(&self, frame: &Frame, instance: u32, slot: u32) -> Option<LowFrequency> {
        if self.colored[instance as usize] {
            return None;
        }
        self.materials[frame.material_index(instance, slot) as usize]
    }
}

/// [`point`] where the material is plain.
#[inline]
fn plain_point(ray: &Ray, hit: Hit, points: &GridPoints, i: usize, material: LowFrequency) -> VisiblePoint {
    let towards_eye = -ray.direction;
    let geometric = points.geometric_normal(i);
    let normal = facing_like(points.shading_normal(i), geometric, towards_eye);
    let facing = |normal: Vec3| if normal.dot(towards_eye) < 0.0 { -normal } else { normal };
    VisiblePoint {
        hit,
        position: points.position(i),
        geometric_normal: facing(geometric),
        normal: facing(normal),
        towards_eye,
        material,
        emitted: Vec3::ZERO,
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

#[cfg(test)]
mod tests {
    use halflight_scene::{LoadOptions, Scene};

    use super::*;

    #[test]
    fn plain_points_are_those_of_vertices() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.toml");
        let text = "
            [camera]
            origin = [3, 4, 5]
            target = [0, 0, 0]
            [[shape]]
            type = \"height-field\"
            extent = [6, 6]
            posts = [40, 40]
            heights = { type = \"fractal\", amplitude = 0.6, wavelength = 2 }
            material = { type = \"phong\", diffuse = 0.4, specular = 0.3, exponent = 9 }
            [[shape]]
            type = \"sphere\"
            center = [0, 1, 0]
            radius = 0.7
            material = { type = \"diffuse\", albedo = [0.2, 0.3, 0.4] }
        ";
        std::fs::write(&path, text).unwrap();
        let frame = Scene::load(&path, &LoadOptions::default()).unwrap().at(0.0).unwrap();
        let view = GBuffer::look(&frame, [70, 50], Region::whole(70, 50), Vec2::splat(0.5), &Room::default());
        let grid = frame.camera.view(70, 50).grid(Vec2::splat(0.5), 70, 50);
        let mut seen = 0;
        for (i, visible) in view.pixels.iter().enumerate() {
            let Visible::Point(found) = visible else { continue };
            let exact = point(&frame, &grid.ray(i % 70, i / 70), found.hit);
            assert!(found.position.distance(exact.position) < 1e-5);
            assert!(found.normal.distance(exact.normal) < 1e-4);
            assert!(found.geometric_normal.distance(exact.geometric_normal) < 1e-4);
            assert_eq!((found.material, found.emitted), (exact.material, exact.emitted));
            seen += 1;
        }
        assert!(seen > 1000);
    }
}
