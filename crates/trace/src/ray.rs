use glam::{Vec2, Vec3};

/// A ray, from its origin to `t_max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts.
    pub origin: Vec3,
    /// Where it goes; unit length, so that t is in metres.
    pub direction: Vec3,
    /// Hits at t > `t_max` do not count. Infinite for a ray without end.
    pub t_max: f32,
    /// When within the frame's shutter interval, 0 at its opening and 1 at its closing.
    pub time: f32,
}

/// The nearest intersection of a ray, as much of it as traversal knows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance along the ray.
    pub t: f32,
    /// Index of the instance in the world.
    pub instance: u32,
    /// Index of the primitive in the instance's geometry.
    pub primitive: u32,
    /// First parameter on the primitive: for a triangle the barycentric weight of its second vertex.
    pub u: f32,
    /// Second parameter on the primitive: for a triangle the barycentric weight of its third vertex.
    pub v: f32,
}

/// What shading needs to know of a hit, in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// The point, recomputed on the primitive so that its error is small and known.
    pub position: Vec3,
    /// Bound of the error of `position`, in metres along any axis.
    pub position_error: f32,
    /// Unit normal of the geometry, on the side that the winding calls front.
    pub geometric_normal: Vec3,
    /// Unit interpolated normal, in the hemisphere of `geometric_normal`.
    pub shading_normal: Vec3,
    /// Texture coordinates.
    pub uv: Vec2,
    /// Unit direction of growing u, perpendicular to `shading_normal`.
    pub tangent: Vec3,
    /// +1 or −1: the bitangent (growing v) is `handedness · shading_normal × tangent`.
    pub handedness: f32,
    /// Linear vertex colour, white where there is none.
    pub color: Vec3,
    /// Index of the instance in the world.
    pub instance: u32,
    /// Index of the primitive in the instance's geometry.
    pub primitive: u32,
    /// Material slot of the primitive.
    pub material_slot: u32,
}
