//! What every form of geometry answers, in its own space.

use std::sync::Arc;

use glam::{Vec2, Vec3};

use crate::Ray;
use crate::flat::{Disk, Rectangle};
use crate::height_field::HeightFieldTracer;
use crate::mesh::MeshTracer;
use crate::spheres::SphereTracer;

/// A form of geometry that answers rays in its own space.
///
/// Directions are of any length; t counts in that length. A learned or custom form implements this and joins a world
/// as [`Geometry::Custom`].
pub trait RayGeometry: Send + Sync + std::fmt::Debug {
    /// Lower and upper corner, over the whole shutter interval.
    fn bounds(&self) -> (Vec3, Vec3);
    /// The nearest intersection with 0 < t ≤ `ray.t_max`.
    fn closest(&self, ray: &Ray) -> Option<LocalHit>;
    /// Whether there is any intersection with 0 < t ≤ `ray.t_max`.
    fn occluded(&self, ray: &Ray) -> bool;
    /// What shading needs to know of a hit that `closest` gave for this ray.
    fn surface(&self, ray: &Ray, hit: &LocalHit) -> LocalSurface;
    /// How many primitives it holds.
    fn primitives(&self) -> usize;
    /// Bytes held, without what is shared with others.
    fn memory_bytes(&self) -> usize;
    /// How often a form that stands for another had to ask that other; `None` for forms that stand for themselves.
    fn fallback(&self) -> Option<FallbackCounts> {
        None
    }
    /// Whether a hit on this primitive was found by the form that this one falls back to.
    fn fell_back(&self, primitive: u32) -> bool {
        let _ = primitive;
        false
    }
    /// A number that differs between custom forms that answer differently, for what is kept from run to run.
    fn identity(&self) -> u64 {
        0
    }
}

/// How often a form of geometry that stands for another, as a learned field does for its mesh, asked that other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FallbackCounts {
    /// Rays that were asked while there was another form.
    pub asked: u64,
    /// Hits that the other form confirmed nearby.
    pub confirmed: u64,
    /// Rays that were asked of the whole other form.
    pub fell_back: u64,
}

/// An intersection in the space of the geometry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalHit {
    /// Distance in lengths of the ray's direction.
    pub t: f32,
    /// Index of the primitive.
    pub primitive: u32,
    /// First parameter on the primitive: for a triangle the barycentric weight of its second vertex.
    pub u: f32,
    /// Second parameter on the primitive: for a triangle the barycentric weight of its third vertex.
    pub v: f32,
}

/// What shading needs to know of a hit, in the space of the geometry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalSurface {
    /// The point, recomputed on the primitive.
    pub position: Vec3,
    /// Bound of the error of `position` along any axis.
    pub position_error: f32,
    /// Unit normal of the geometry, on the side that the winding calls front.
    pub geometric_normal: Vec3,
    /// Unit interpolated normal, in the hemisphere of `geometric_normal`.
    pub shading_normal: Vec3,
    /// Texture coordinates.
    pub uv: Vec2,
    /// Direction of growing u, of any length; zero where there is none.
    pub tangent: Vec3,
    /// +1 or −1: the bitangent, where the picture's "up" goes (falling v), is
    /// `handedness · shading_normal × tangent`; −1 where a picture is mirrored on the surface.
    pub handedness: f32,
    /// Linear vertex colour, white where there is none.
    pub color: Vec3,
    /// Material slot of the primitive.
    pub material_slot: u32,
}

/// The forms of geometry.
#[derive(Clone, Debug)]
pub enum Geometry {
    /// Triangles, still or moving.
    Mesh(MeshTracer),
    /// A set of spheres.
    Spheres(SphereTracer),
    /// Heights over a grid, still or moving.
    HeightField(HeightFieldTracer),
    /// The unit square.
    Rectangle(Rectangle),
    /// The unit disk.
    Disk(Disk),
    /// Anything else that answers rays.
    Custom(Arc<dyn RayGeometry>),
}

impl Geometry {
    /// The geometry behind its common interface.
    #[inline]
    #[must_use]
    pub fn as_rays(&self) -> &dyn RayGeometry {
        match self {
            Geometry::Mesh(mesh) => mesh,
            Geometry::Spheres(spheres) => spheres,
            Geometry::HeightField(field) => field,
            Geometry::Rectangle(rectangle) => rectangle,
            Geometry::Disk(disk) => disk,
            Geometry::Custom(custom) => custom.as_ref(),
        }
    }
}
