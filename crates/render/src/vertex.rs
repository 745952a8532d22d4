//! A point where light scatters: the surface that a ray found, its material there, and the frame between the two.

use glam::{Vec2, Vec3};
use halflight_material::{Bsdf, Footprint, Material, SurfaceInput};
use halflight_scene::Frame;
use halflight_trace::{Hit, Ray, Surface};

/// A surface point that is ready to shade.
#[derive(Clone, Copy, Debug)]
pub struct Vertex<'a> {
    /// The geometry.
    pub surface: Surface,
    /// The material, for its emission and its index.
    pub material: &'a Material,
    /// How it scatters, in the local frame.
    pub bsdf: Bsdf<'a>,
    /// Axes of the local frame in world space: along the tangent, across it, and the shading normal.
    axes: [Vec3; 3],
    /// Unit direction back along the ray, in world space.
    pub towards_eye: Vec3,
    /// The same in the local frame.
    pub wo: Vec3,
    /// Whether the ray was stopped by chance where the surface is there only in part: then what shines shines wholly.
    solid: bool,
}

impl<'a> Vertex<'a> {
    /// What `ray` finds at `hit`.
    #[inline]
    pub fn new(frame: &'a Frame, ray: &Ray, hit: &Hit) -> Self {
        let surface = frame.world.surface(ray, hit);
        let material = frame.material(surface.instance, surface.material_slot);
        let input = SurfaceInput { uv: surface.uv, color: surface.color };
        let towards_eye = -ray.direction;
        let axes = shading_axes(&surface, material, towards_eye);
        let wo = to_local(&axes, towards_eye);
        Self { surface, material, bsdf: material.bsdf(&input), axes, towards_eye, wo, solid: false }
    }

    /// [`Vertex::new`] at a hit of which chance has decided that it stops the ray: what is there is solid.
    #[inline]
    pub(crate) fn stopped(frame: &'a Frame, ray: &Ray, hit: &Hit) -> Self {
        let vertex = Self::new(frame, ray, hit);
        Self { bsdf: vertex.bsdf.solid(), solid: true, ..vertex }
    }

    /// [`Vertex::stopped`] on a surface that is known, with textures as the mean under a footprint and lobes as wide as the
    /// normals under it make them.
    pub(crate) fn stopped_over(
        frame: &'a Frame,
        ray: &Ray,
        surface: Surface,
        footprint: Option<Footprint>,
    ) -> Self {
        let material = frame.material(surface.instance, surface.material_slot);
        let input = SurfaceInput { uv: surface.uv, color: surface.color };
        let towards_eye = -ray.direction;
        let mapped = footprint.and_then(|footprint| material.normal_over(surface.uv, footprint));
        let (axes, slopes) = match mapped {
            Some((bump, slopes)) => (axes_about(&surface, Some(bump), towards_eye), slopes),
            None => (shading_axes(&surface, material, towards_eye), 0.0),
        };
        let wo = to_local(&axes, towards_eye);
        let bsdf = material.bsdf_over(&input, footprint, slopes).solid();
        Self { surface, material, bsdf, axes, towards_eye, wo, solid: true }
    }

    /// A point of a medium at distance `t` along `ray`: no surface, so nothing is offset and no side is the wrong one.
    pub(crate) fn in_medium(frame: &'a Frame, ray: &Ray, t: f32, anisotropy: f32) -> Self {
        let towards_eye = -ray.direction;
        let tangent = towards_eye.any_orthonormal_vector();
        let surface = Surface {
            position: ray.at(t),
            position_error: 0.0,
            geometric_normal: towards_eye,
            shading_normal: towards_eye,
            uv: Vec2::ZERO,
            tangent,
            handedness: 1.0,
            color: Vec3::ONE,
            instance: u32::MAX,
            primitive: u32::MAX,
            material_slot: 0,
        };
        Self {
            surface,
            material: frame.media.material(),
            bsdf: Bsdf::phase(anisotropy),
            axes: [tangent, towards_eye.cross(tangent), towards_eye],
            towards_eye,
            wo: Vec3::Z,
            solid: true,
        }
    }

    /// From world space to the local frame.
    #[inline]
    pub fn to_local(&self, direction: Vec3) -> Vec3 {
        to_local(&self.axes, direction)
    }

    /// From the local frame to world space.
    #[inline]
    pub fn to_world(&self, local: Vec3) -> Vec3 {
        local.x * self.axes[0] + local.y * self.axes[1] + local.z * self.axes[2]
    }

    /// The shading normal, normal map included, in world space.
    pub fn shading_normal(&self) -> Vec3 {
        self.axes[2]
    }

    /// Whether geometry and shading agree on which side `direction` leaves by. Where they do not, light would leak
    /// through the surface: it scatters nothing there.
    #[inline]
    pub fn same_side(&self, direction: Vec3, local: Vec3) -> bool {
        let geometric = self.surface.geometric_normal.dot(direction);
        geometric * local.z > 0.0
    }

    /// Radiance that the surface itself sends towards the eye.
    #[inline]
    pub fn emitted(&self) -> Vec3 {
        if !self.material.is_emissive() {
            return Vec3::ZERO;
        }
        let front = self.surface.geometric_normal.dot(self.towards_eye) > 0.0;
        if !front && !self.material.two_sided {
            return Vec3::ZERO;
        }
        let uv = self.surface.uv;
        match &self.material.emission {
            Some(emission) if self.solid => emission.at(uv),
            _ => self.material.emitted(&SurfaceInput { uv, color: Vec3::ONE }),
        }
    }
}

/// The local frame in world space: along the tangent, across it, and the shading normal, normal map included.
#[inline]
pub(crate) fn shading_axes(surface: &Surface, material: &Material, towards_eye: Vec3) -> [Vec3; 3] {
    axes_about(surface, material.shading_normal_local(surface.uv), towards_eye)
}

/// The same with a normal in the tangent frame, if there is one.
#[inline]
fn axes_about(surface: &Surface, bump: Option<Vec3>, towards_eye: Vec3) -> [Vec3; 3] {
    let mut normal = surface.shading_normal;
    let mut tangent = surface.tangent;
    if let Some(bump) = bump {
        let bitangent = surface.handedness * normal.cross(tangent);
        normal = (bump.x * tangent + bump.y * bitangent + bump.z * normal).normalize_or(normal);
    }
    normal = facing_like(normal, surface.geometric_normal, towards_eye);
    // The surface's tangent is perpendicular to the surface's own shading normal.
    if normal != surface.shading_normal {
        tangent = (tangent - normal * normal.dot(tangent)).normalize_or_zero();
        if tangent == Vec3::ZERO {
            tangent = normal.any_orthonormal_vector();
        }
    }
    [tangent, normal.cross(tangent), normal]
}

#[inline]
fn to_local(axes: &[Vec3; 3], direction: Vec3) -> Vec3 {
    Vec3::new(axes[0].dot(direction), axes[1].dot(direction), axes[2].dot(direction))
}

/// The shading normal, bent just far enough that the eye sees the same side of it as of the geometry: interpolated
/// and mapped normals turn away at silhouettes, which would be black.
#[inline]
pub(crate) fn facing_like(normal: Vec3, geometric: Vec3, towards_eye: Vec3) -> Vec3 {
    /// Least cosine to the eye after bending, about 0.6 degrees above the horizon.
    const MIN_COSINE: f32 = 0.01;
    let side = if geometric.dot(towards_eye) < 0.0 { -1.0 } else { 1.0 };
    let cosine = side * normal.dot(towards_eye);
    if cosine >= MIN_COSINE || normal == geometric {
        return normal;
    }
    (normal + side * (MIN_COSINE - cosine) * towards_eye).normalize_or(geometric)
}
