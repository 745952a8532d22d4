//! How texture coordinates and normals change along a surface: what footprints and curvature are made of.
//!
//! On a triangle with edges a, b and normal n = a × b, a step p in its plane changes the weights of its second and third corner by
//! (b × n)·p/n² and (n × a)·p/n²; attributes follow. Spheres under similarities, rectangles and disks have theirs in closed form.

use glam::{Affine3A, Mat3, Vec3};

use super::World;
use crate::{Geometry, Hit, Surface};

/// Changes per metre along a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gradients {
    /// Of the texture coordinates: u changes by `u`·p for a step p.
    pub u: Vec3,
    /// The same of v.
    pub v: Vec3,
    /// Of the unit shading normal: it turns by `normal` p. Normal maps left out.
    pub normal: Mat3,
}

/// Those at a hit; `None` for shapes that do not tell.
pub(super) fn gradients(world: &World, hit: &Hit, time: f32, surface: &Surface) -> Option<Gradients> {
    let instance = world.instances().get(hit.instance as usize)?;
    let to_world = instance.transform.at(time);
    let found = match &*instance.geometry {
        Geometry::Mesh(tracer) => {
            let mesh = tracer.mesh();
            let triangle = *mesh.triangles.get(hit.primitive as usize)?;
            let corners = tracer.corners(hit.primitive, time).map(|p| to_world.transform_point3(p));
            let (a, b) = (corners[1] - corners[0], corners[2] - corners[0]);
            let n = a.cross(b);
            let [first, second] = [b.cross(n), n.cross(a)].map(|v| v / n.length_squared());
            let uvs = triangle.map(|i| mesh.uvs.get(i as usize).copied().unwrap_or_default());
            let (du, dv) = (uvs[1] - uvs[0], uvs[2] - uvs[0]);
            let normals = triangle.map(|i| mesh.normals.get(i as usize).copied());
            let normal = if let [Some(n0), Some(n1), Some(n2)] = normals {
                let through = Mat3::from(to_world.matrix3.inverse().transpose());
                let unit = |n: Vec3| (through * n).normalize_or_zero();
                let (n0, n1, n2) = (unit(n0), unit(n1), unit(n2));
                let mixed = n0 * (1.0 - hit.u - hit.v) + n1 * hit.u + n2 * hit.v;
                let turn = outer(n1 - n0, first) + outer(n2 - n0, second);
                across(mixed.normalize_or_zero()) * turn * (1.0 / mixed.length().max(1e-6))
            } else {
                Mat3::ZERO
            };
            let side =
                if normal == Mat3::ZERO { 1.0 } else { side_of(surface, &normals, through_of(&to_world)) };
            Gradients {
                u: first * du.x + second * dv.x,
                v: first * du.y + second * dv.y,
                normal: normal * side,
            }
        }
        Geometry::Rectangle(_) | Geometry::Disk(_) => {
            let through = through_of(&to_world);
            Gradients { u: through * (Vec3::X * 0.5), v: through * (Vec3::Y * -0.5), normal: Mat3::ZERO }
        }
        Geometry::Spheres(tracer) => {
            let sphere = tracer.spheres().get(hit.primitive as usize)?;
            let local = to_world.inverse().transform_point3(surface.position) - sphere.center;
            let through = through_of(&to_world);
            let level = (local.x * local.x + local.z * local.z).max(1e-12 * sphere.radius * sphere.radius);
            let turns = 1.0 / (std::f32::consts::TAU * level);
            let u = Vec3::new(local.z, 0.0, -local.x) * turns;
            // v = acos(y/r)/π falls with y, and stands along the sphere.
            let v = (local * local.y / (sphere.radius * sphere.radius) - Vec3::Y)
                / (std::f32::consts::PI * level.sqrt());
            let scale = to_world.matrix3.determinant().abs().cbrt();
            let normal = across(surface.shading_normal) * (1.0 / (sphere.radius * scale));
            Gradients { u: through * u, v: through * v, normal }
        }
        Geometry::HeightField(_) | Geometry::Custom(_) => return None,
    };
    let finite = found.u.is_finite() && found.v.is_finite() && found.normal.is_finite();
    finite.then_some(found)
}

/// M⁻ᵀ: gradients go to the world as normals do.
fn through_of(to_world: &Affine3A) -> Mat3 {
    Mat3::from(to_world.matrix3.inverse().transpose())
}

/// Whether the surface has the mesh's normals as they are or turned over.
fn side_of(surface: &Surface, normals: &[Option<Vec3>; 3], through: Mat3) -> f32 {
    let mean: Vec3 = normals.iter().flatten().map(|n| through * *n).sum();
    if mean.dot(surface.shading_normal) < 0.0 { -1.0 } else { 1.0 }
}

/// a bᵀ.
fn outer(a: Vec3, b: Vec3) -> Mat3 {
    Mat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// 1 − n nᵀ.
fn across(n: Vec3) -> Mat3 {
    Mat3::IDENTITY - outer(n, n)
}

#[cfg(test)]
#[path = "gradients_tests.rs"]
mod tests;
