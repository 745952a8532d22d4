//! The G-buffer: what each pixel shows, with all that shading and prediction ask of it.
//!
//! A point keeps where it is and how it lies, and by instance and texture coordinates what it is made of, so that its
//! reflectance is looked up again where it is shaded, and nowhere else. Normal maps are in the normals; displacement is in
//! the geometry. From the grid of the camera's rays, which rasterises what is cheaper that way: 0.1 µs a pixel on one core.

use glam::{Vec2, Vec3};
use halflight_material::{Bsdf, SurfaceInput};
use halflight_scene::Frame;
use halflight_scene::camera::View;
use halflight_trace::{GridRows, Hit, Ray};
use rayon::prelude::*;

use crate::vertex::shading_axes;

/// Columns and rows of the blocks whose rays are traced together.
const BLOCK: usize = 8;
/// Rows that are looked at in one piece of work.
const BAND: usize = 16;
/// Cosine between normals of one plane: 1°.
const SAME_PLANE: f32 = 0.999_85;
/// Squared distance of normals that differ by rounding alone.
const SAME_NORMAL: f32 = 1e-12;
/// The material of a pixel that shows nothing.
const NOTHING: u32 = u32::MAX;

/// What one ray from the eye meets.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfacePoint {
    pub(super) position: Vec3,
    /// Unit shading normal, normal map included, on the side of the eye.
    pub(super) normal: Vec3,
    /// Unit normal of the geometry, on the side of the eye.
    pub(super) geometric_normal: Vec3,
    /// Unit tangent, perpendicular to the shading normal.
    pub(super) tangent: Vec3,
    /// Unit direction to the eye.
    pub(super) towards_eye: Vec3,
    pub(super) uv: Vec2,
    pub(super) color: Vec3,
    /// Metres to the eye.
    pub(super) distance: f32,
    /// Bound of the error of the position, by which shadow rays leave it.
    pub(super) position_error: f32,
    /// −1 where the eye sees the back: the material's own frame has its normal on the other side.
    pub(super) side: f32,
    pub(super) instance: u32,
    /// Of the instance's geometry.
    pub(super) primitive: u32,
    /// Whether the primitive has one normal for all of its points, as far as the pixels beside tell.
    pub(super) is_facet: bool,
    /// Index in the frame's materials, or [`NOTHING`].
    pub(super) material: u32,
}

impl SurfacePoint {
    /// Where nothing is, in this direction.
    fn nothing(direction: Vec3) -> Self {
        Self {
            position: Vec3::ZERO,
            normal: Vec3::Z,
            geometric_normal: Vec3::Z,
            tangent: Vec3::X,
            towards_eye: -direction,
            uv: Vec2::ZERO,
            color: Vec3::ONE,
            distance: f32::INFINITY,
            position_error: 0.0,
            side: 1.0,
            instance: NOTHING,
            primitive: 0,
            is_facet: false,
            material: NOTHING,
        }
    }

    /// Whether there is a surface at all.
    #[inline]
    pub(super) fn is_there(&self) -> bool {
        self.material != NOTHING
    }

    /// Whether two points may tell of each other: the same object of the same material.
    #[inline]
    pub(super) fn is_of(&self, other: &Self) -> bool {
        self.instance == other.instance && self.material == other.material
    }

    /// Whether both lie on facets, and those meet at an angle.
    #[inline]
    pub(super) fn is_facet_beside(&self, other: &Self) -> bool {
        self.is_facet
            && other.is_facet
            && self.primitive != other.primitive
            && self.normal.dot(other.normal) < SAME_PLANE
    }

    /// Along the tangent, across it, and the normal: the frame in which the eye is in front.
    #[inline]
    pub(super) fn axes(&self) -> [Vec3; 3] {
        [self.tangent, self.side * self.normal.cross(self.tangent), self.normal]
    }

    /// The direction to the eye in the frame of [`Self::axes`].
    #[inline]
    pub(super) fn view(&self) -> Vec3 {
        let [x, y, z] = self.axes();
        Vec3::new(x.dot(self.towards_eye), y.dot(self.towards_eye), z.dot(self.towards_eye))
    }

    /// The cosine between normal and eye.
    #[inline]
    pub(super) fn cos_exit(&self) -> f32 {
        self.normal.dot(self.towards_eye)
    }

    /// What its material is asked by.
    pub(super) fn input(&self) -> SurfaceInput {
        SurfaceInput { uv: self.uv, color: self.color }
    }

    /// How it scatters, in the material's own frame: that of [`Self::axes`] with z turned where the back is seen.
    pub(super) fn bsdf<'a>(&self, frame: &'a Frame) -> Bsdf<'a> {
        frame.materials[self.material as usize].bsdf(&self.input())
    }

    /// A shadow ray of length `t_max` that does not meet the surface it leaves.
    pub(super) fn shadow_ray(&self, direction: Vec3, t_max: f32) -> Ray {
        let normal = self.geometric_normal;
        let side = if direction.dot(normal) < 0.0 { -normal } else { normal };
        let step = 1.5 * self.position_error * side.abs().element_sum()
            + 4.0 * f32::EPSILON * self.position.abs().max_element();
        Ray { origin: self.position + side * step, direction, t_max, time: 0.0 }
    }
}

/// The points that a picture shows, rows from the top.
pub(super) struct Surfaces {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) points: Vec<SurfacePoint>,
}

impl Surfaces {
    /// Looks through the point `offset` of every pixel. A lens counts as its middle, a shutter as the moment it opens.
    /// `room` is what a picture before left, to be written over.
    pub(super) fn look(
        frame: &Frame,
        [width, height]: [usize; 2],
        offset: Vec2,
        room: Vec<SurfacePoint>,
    ) -> Self {
        let grid = frame.camera.view(width, height).grid(offset, width, height);
        let tracer = frame.world.grid(grid);
        let mut points = room;
        points.resize(width * height, SurfacePoint::nothing(Vec3::Z));
        points.par_chunks_mut(width * BAND).enumerate().for_each_init(
            || (GridRows::default(), vec![None; width * BAND]),
            |(room, hits), (band, points)| {
                let (top, hits) = (band * BAND, &mut hits[..points.len()]);
                tracer.rows(top, room, hits);
                for (i, (hit, out)) in hits.iter().zip(points.iter_mut()).enumerate() {
                    let ray = grid.ray(i % width, top + i / width);
                    *out = match hit {
                        Some(hit) => point(frame, &ray, hit),
                        None => SurfacePoint::nothing(ray.direction),
                    };
                }
                find_facets(points, width);
            },
        );
        Self { width, height, points }
    }

    /// The point that pixel (x, y) shows.
    #[inline]
    pub(super) fn at(&self, x: usize, y: usize) -> &SurfacePoint {
        &self.points[y * self.width + x]
    }
}

/// Marks what is seen to have the normal of the pixel to the left or above, on the same primitive.
fn find_facets(points: &mut [SurfacePoint], width: usize) {
    for i in 0..points.len() {
        let beside = [(i % width > 0).then(|| i - 1), i.checked_sub(width)];
        for j in beside.into_iter().flatten() {
            let (a, b) = (&points[i], &points[j]);
            let is_one = a.instance == b.instance && a.primitive == b.primitive && a.is_there();
            if is_one && a.normal.distance_squared(b.normal) < SAME_NORMAL {
                points[i].is_facet = true;
                points[j].is_facet = true;
            }
        }
    }
}

/// What is seen through up to [`BLOCK`]² places of the film, whose rays are traced together.
pub(super) fn look_together(
    frame: &Frame,
    view: &View,
    count: usize,
    place: impl Fn(usize) -> Vec2,
    mut found: impl FnMut(usize, SurfacePoint),
) {
    let mut rays = [Ray::new(Vec3::ZERO, Vec3::Z); BLOCK * BLOCK];
    let mut hits: [Option<Hit>; BLOCK * BLOCK] = [None; BLOCK * BLOCK];
    for (i, ray) in rays[..count].iter_mut().enumerate() {
        *ray = view.ray(place(i), Vec2::splat(0.5), 0.0);
    }
    frame.world.closest_packet(&rays[..count], &mut hits[..count]);
    for i in 0..count {
        let point = match &hits[i] {
            Some(hit) => point(frame, &rays[i], hit),
            None => SurfacePoint::nothing(rays[i].direction),
        };
        found(i, point);
    }
}

fn point(frame: &Frame, ray: &Ray, hit: &Hit) -> SurfacePoint {
    let surface = frame.world.surface(ray, hit);
    let towards_eye = -ray.direction;
    let material = frame.material_index(surface.instance, surface.material_slot);
    let [tangent, _, normal] = shading_axes(&surface, &frame.materials[material as usize], towards_eye);
    let side = if normal.dot(towards_eye) < 0.0 { -1.0 } else { 1.0 };
    let front = if surface.geometric_normal.dot(towards_eye) < 0.0 { -1.0 } else { 1.0 };
    SurfacePoint {
        position: surface.position,
        normal: side * normal,
        geometric_normal: front * surface.geometric_normal,
        tangent,
        towards_eye,
        uv: surface.uv,
        color: surface.color,
        distance: hit.t,
        position_error: surface.position_error,
        side,
        instance: surface.instance,
        primitive: hit.primitive,
        is_facet: false,
        material,
    }
}
