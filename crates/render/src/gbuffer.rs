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

/// A [`Visible`] as it is kept, in the bytes of a line of the cache: filling and reading these is a good part of what a
/// picture costs.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Pixel {
    Point(PixelPoint),
    Nothing(Vec3),
}

/// A [`VisiblePoint`] as it is kept.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PixelPoint {
    pub(crate) hit: Hit,
    pub(crate) position: Vec3,
    pub(crate) geometric_normal: Vec3,
    pub(crate) normal: Vec3,
    /// The place of its [`Look`].
    look: u32,
}

/// What a surface shows beside its shape.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Look {
    pub(crate) material: LowFrequency,
    pub(crate) emitted: Vec3,
}

impl Look {
    const NONE: Look = Look {
        material: LowFrequency { diffuse: Vec3::ZERO, specular: Vec3::ZERO, exponent: 0.0, exact: true },
        emitted: Vec3::ZERO,
    };
}

/// Memory of a [`GBuffer`], kept from picture to picture: to ask for it anew costs as much as to fill it.
#[derive(Default)]
pub(crate) struct Room(Mutex<Memory>);

#[derive(Default)]
struct Memory {
    pixels: Vec<Pixel>,
    seen: Vec<bool>,
    looks: Vec<Look>,
}

/// The visible points of a picture, pixel by pixel, rows from the top.
pub(crate) struct GBuffer {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) pixels: Vec<Pixel>,
    eye: Vec3,
    /// Of each material of the frame that shows the same everywhere; then, if there are others, of each pixel.
    looks: Vec<Look>,
    /// Whether a pixel is a point: passes that ask no more need not read the points, which are far larger.
    pub(crate) seen: Vec<bool>,
    /// What all points show of each material of the frame; none if that differs from place to place.
    pub(crate) materials: Vec<Option<LowFrequency>>,
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
        let room_there = || room.0.lock().unwrap_or_else(PoisonError::into_inner);
        let Memory { mut pixels, mut seen, mut looks } = std::mem::take(&mut *room_there());
        pixels.resize(width * height, Pixel::Nothing(Vec3::ZERO));
        seen.resize(width * height, false);
        let materials = plain.materials.len();
        looks.resize(materials + if plain.is_all() { 0 } else { width * height }, Look::NONE);
        for (look, material) in looks.iter_mut().zip(&plain.materials) {
            *look = Look { material: material.unwrap_or(Look::NONE.material), emitted: Vec3::ZERO };
        }
        let mut own = looks[materials..].chunks_mut(width * BAND);
        let own: Vec<&mut [Look]> =
            (0..height.div_ceil(BAND)).map(|_| own.next().unwrap_or_default()).collect();
        let bands = pixels.par_chunks_mut(width * BAND).zip(seen.par_chunks_mut(width * BAND)).zip(own);
        bands.enumerate().for_each_init(
            || (GridRows::default(), vec![None; width * BAND], GridPoints::default()),
            |(room, hits, points), (band, ((pixels, seen), own))| {
                let (top, hits) = (band * BAND, &mut hits[..pixels.len()]);
                if top >= region.y + region.height || top + BAND <= region.y {
                    pixels.fill(Pixel::Nothing(Vec3::Z));
                    seen.fill(false);
                    return;
                }
                // Rows are traced whole, as in the whole picture, so that they hold the same bits.
                tracer.rows(top, room, hits);
                tracer.points(top, hits, points);
                for (i, (hit, (pixel, seen))) in hits.iter().zip(pixels.iter_mut().zip(seen)).enumerate() {
                    let (x, y) = (i % width, top + i / width);
                    let ray = grid.ray(x, y);
                    let hit = hit.as_ref().filter(|_| region.contains(x, y));
                    *seen = hit.is_some();
                    let Some(hit) = hit else {
                        *pixel = Pixel::Nothing(ray.direction);
                        continue;
                    };
                    let material = plain.material(frame, hit.instance, points.material_slot[i]);
                    *pixel = Pixel::Point(match (material, own.get_mut(i)) {
                        (None, Some(look)) => {
                            let point = point(frame, &ray, *hit);
                            *look = Look { material: point.material, emitted: point.emitted };
                            point.kept((materials + top * width + i) as u32)
                        }
                        (look, _) => plain_point(&ray, *hit, points, i, look.unwrap_or(0)),
                    });
                }
            },
        );
        Self { width, height, pixels, eye: grid.origin, looks, seen, materials: plain.materials }
    }

    /// What is visible through a pixel.
    pub(crate) fn at(&self, place: usize) -> Visible {
        match &self.pixels[place] {
            Pixel::Point(point) => Visible::Point(self.point(point)),
            Pixel::Nothing(direction) => Visible::Nothing(*direction),
        }
    }

    /// All of a point that is kept.
    pub(crate) fn point(&self, point: &PixelPoint) -> VisiblePoint {
        let &PixelPoint { hit, position, geometric_normal, normal, .. } = point;
        let Look { material, emitted } = *self.look_of(point);
        let towards_eye = self.towards_eye(point);
        VisiblePoint { hit, position, geometric_normal, normal, towards_eye, material, emitted }
    }

    /// What a point shows beside its shape.
    #[inline]
    pub(crate) fn look_of(&self, point: &PixelPoint) -> &Look {
        &self.looks[point.look as usize]
    }

    /// Unit direction from a point to the eye.
    #[inline]
    pub(crate) fn towards_eye(&self, point: &PixelPoint) -> Vec3 {
        (self.eye - point.position).normalize_or(Vec3::Y)
    }

    /// Gives the memory back for the next picture.
    pub(crate) fn leave(self, room: &Room) {
        let Self { pixels, seen, looks, .. } = self;
        *room.0.lock().unwrap_or_else(PoisonError::into_inner) = Memory { pixels, seen, looks };
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

    /// Whether that is so of all materials and instances of the frame.
    fn is_all(&self) -> bool {
        self.materials.iter().all(Option::is_some) && !self.colored.contains(&true)
    }

    /// The index of the material of an instance, if it is plain there.
    #[inline]
    fn material(&self, frame: &Frame, instance: u32, slot: u32) -> Option<u32> {
        if self.colored[instance as usize] {
            return None;
        }
        let index = frame.material_index(instance, slot);
        self.materials[index as usize].map(|_| index)
    }
}

/// [`point`] where the material is plain.
#[inline]
fn plain_point(ray: &Ray, hit: Hit, points: &GridPoints, i: usize, look: u32) -> PixelPoint {
    let towards_eye = -ray.direction;
    let geometric = points.geometric_normal(i);
    let normal = facing_like(points.shading_normal(i), geometric, towards_eye);
    let facing = |normal: Vec3| if normal.dot(towards_eye) < 0.0 { -normal } else { normal };
    let (position, geometric_normal) = (points.position(i), facing(geometric));
    PixelPoint { hit, position, geometric_normal, normal: facing(normal), look }
}

impl VisiblePoint {
    fn kept(&self, look: u32) -> PixelPoint {
        let &Self { hit, position, geometric_normal, normal, .. } = self;
        PixelPoint { hit, position, geometric_normal, normal, look }
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
        assert_eq!(size_of::<Pixel>(), 64);
        for i in 0..view.pixels.len() {
            let Visible::Point(found) = view.at(i) else { continue };
            let exact = point(&frame, &grid.ray(i % 70, i / 70), found.hit);
            assert!(found.position.distance(exact.position) < 1e-5);
            assert!(found.normal.distance(exact.normal) < 1e-4);
            assert!(found.towards_eye.distance(exact.towards_eye) < 1e-5);
            assert!(found.geometric_normal.distance(exact.geometric_normal) < 1e-4);
            assert_eq!((found.material, found.emitted), (exact.material, exact.emitted));
            seen += 1;
        }
        assert!(seen > 1000);
    }
}
