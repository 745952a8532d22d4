//! Surfaces that shine: triangles, rectangles, disks and spheres with an emissive material.
//!
//! A shape lives in its own space and is carried to the world by a transform that may move while the shutter is open.
//! Points are drawn uniformly by local area; an affine map M takes local area dA with normal n to |cof(M) n| dA, which
//! makes the density exact for any transform. A sphere under a similarity, seen from outside, is drawn by the cone it
//! fills instead (uniform in solid angle), and a rectangle whose sides stay perpendicular by the solid angle of
//! Ureña, Fajardo and King (2013): both remove the variance of cosine and distance.

use std::sync::Arc;

use glam::{Affine3A, Mat3, Vec2, Vec3};
use halflight_material::{Material, SurfaceInput};

use super::environment::luminance;
use super::solid_angle::SphericalRectangle;
use crate::sampling::{concentric_disk, uniform_sphere};

/// The form of an emitter, in its own space.
#[derive(Clone, Debug)]
pub enum EmitterShape {
    /// A triangle: its corners when the shutter opens and closes, and their texture coordinates.
    Triangle {
        /// Corners at the opening and at the closing of the shutter.
        corners: [[Vec3; 3]; 2],
        /// Texture coordinates of the corners.
        uvs: [Vec2; 3],
    },
    /// The square [−1, 1]² of the xy-plane, facing +z.
    Rectangle,
    /// The unit disk of the xy-plane, facing +z.
    Disk,
    /// A sphere, facing outwards.
    Sphere {
        /// Its centre.
        center: Vec3,
        /// Its radius.
        radius: f32,
    },
}

/// One shining surface of a frame.
#[derive(Clone, Debug)]
pub struct Emitter {
    /// Its form.
    pub shape: EmitterShape,
    /// Local to world when the shutter opens and when it closes.
    pub pose: [Affine3A; 2],
    /// What it is made of.
    pub material: Arc<Material>,
    /// The instance of the world that it belongs to.
    pub instance: u32,
    /// The primitive of that instance.
    pub primitive: u32,
}

/// A point on an emitter, as seen from a point to be lit.
#[derive(Clone, Copy, Debug)]
pub struct EmitterSample {
    /// The point in world space.
    pub point: Vec3,
    /// Its unit normal.
    pub normal: Vec3,
    /// Its texture coordinates.
    pub uv: Vec2,
    /// Density over solid angle from where it is seen; over area for [`Emitter::sample_surface`].
    pub pdf: f32,
}

impl Emitter {
    /// Radiance leaving a point with texture coordinates `uv` and normal `normal` towards `towards`.
    pub fn radiance(&self, uv: Vec2, normal: Vec3, towards: Vec3) -> Vec3 {
        if normal.dot(towards) > 0.0 || self.material.two_sided {
            self.material.emitted(&SurfaceInput { uv, color: Vec3::ONE })
        } else {
            Vec3::ZERO
        }
    }

    /// Luminance times area when the shutter opens, in W/sr without the unit's constant: how strong it is among others.
    pub fn strength(&self) -> f32 {
        let sides = if self.material.two_sided && !matches!(self.shape, EmitterShape::Sphere { .. }) {
            2.0
        } else {
            1.0
        };
        sides * luminance(self.material.mean_emission()) * self.area()
    }

    /// A point in the middle of it when the shutter opens.
    pub fn center(&self) -> Vec3 {
        let local = match &self.shape {
            EmitterShape::Triangle { corners, .. } => (corners[0][0] + corners[0][1] + corners[0][2]) / 3.0,
            EmitterShape::Rectangle | EmitterShape::Disk => Vec3::ZERO,
            EmitterShape::Sphere { center, .. } => *center,
        };
        self.pose[0].transform_point3(local)
    }

    /// How the place of a point changes with its texture coordinates when the shutter opens: metres per unit of u and of v. Of
    /// a triangle whose coordinates do not tell, none.
    pub fn derivatives(&self, uv: Vec2) -> Option<[Vec3; 2]> {
        let pose = self.pose[0];
        let [u, v] = match &self.shape {
            EmitterShape::Triangle { corners, uvs } => {
                let [a, b, c] = corners[0];
                let (one, other) = (uvs[1] - uvs[0], uvs[2] - uvs[0]);
                let scale = 1.0 / one.perp_dot(other);
                if !scale.is_finite() {
                    return None;
                }
                [scale * (other.y * (b - a) - one.y * (c - a)), scale * (one.x * (c - a) - other.x * (b - a))]
            }
            EmitterShape::Rectangle | EmitterShape::Disk => [2.0 * Vec3::X, -2.0 * Vec3::Y],
            EmitterShape::Sphere { radius, .. } => {
                use std::f32::consts::{PI, TAU};
                let ((sin, cos), (sin_v, cos_v)) = ((TAU * (uv.x - 0.5)).sin_cos(), (PI * uv.y).sin_cos());
                let around = Vec3::new(sin_v * cos, 0.0, -sin_v * sin);
                let down = Vec3::new(cos_v * sin, -sin_v, cos_v * cos);
                [radius * TAU * around, radius * PI * down]
            }
        };
        Some([u, v].map(|local| pose.transform_vector3(local)))
    }

    /// Area in square metres when the shutter opens (of an ellipsoid, its mean over the three axes).
    pub fn area(&self) -> f32 {
        let pose = self.pose[0];
        match &self.shape {
            EmitterShape::Triangle { corners, .. } => {
                let [a, b, c] = corners[0].map(|p| pose.transform_point3(p));
                0.5 * (b - a).cross(c - a).length()
            }
            EmitterShape::Rectangle => 4.0 * area_scale(&pose, Vec3::Z).length(),
            EmitterShape::Disk => std::f32::consts::PI * area_scale(&pose, Vec3::Z).length(),
            EmitterShape::Sphere { radius, .. } => {
                let mean =
                    [Vec3::X, Vec3::Y, Vec3::Z].map(|n| area_scale(&pose, n).length()).iter().sum::<f32>()
                        / 3.0;
                4.0 * std::f32::consts::PI * radius * radius * mean
            }
        }
    }

    /// A point as seen from `from`, or `None` where the emitter cannot be seen at all.
    pub fn sample(&self, from: Vec3, u: Vec2, time: f32) -> Option<EmitterSample> {
        let pose = self.pose_at(time);
        match &self.shape {
            EmitterShape::Triangle { uvs, .. } => {
                let [a, b, c] = self.world_corners(&pose, time);
                // Fold the square onto the triangle.
                let (v, w) = if u.x + u.y > 1.0 { (1.0 - u.x, 1.0 - u.y) } else { (u.x, u.y) };
                // A mirroring transform turns the winding, but not the front (as glTF has it).
                let sign = if pose.matrix3.determinant() < 0.0 { -1.0 } else { 1.0 };
                let cross = sign * (b - a).cross(c - a);
                let double_area = cross.length();
                let uv = uvs[0] * (1.0 - v - w) + uvs[1] * v + uvs[2] * w;
                by_area(from, a + v * (b - a) + w * (c - a), cross / double_area, uv, 2.0 / double_area)
            }
            EmitterShape::Rectangle => {
                if let Some(rectangle) = SphericalRectangle::seen_from(&pose, from) {
                    let (point, local) = rectangle.sample(u)?;
                    let normal = area_scale(&pose, Vec3::Z).normalize();
                    let uv = rectangle_uv(local);
                    return Some(EmitterSample { point, normal, uv, pdf: 1.0 / rectangle.solid_angle() });
                }
                let local = 2.0 * u - Vec2::ONE;
                let scaled = area_scale(&pose, Vec3::Z);
                let area = 4.0 * scaled.length();
                let uv = rectangle_uv(local);
                by_area(from, pose.transform_point3(local.extend(0.0)), scaled.normalize(), uv, 1.0 / area)
            }
            EmitterShape::Disk => {
                let local = concentric_disk(u);
                let scaled = area_scale(&pose, Vec3::Z);
                let area = std::f32::consts::PI * scaled.length();
                let uv = disk_uv(local);
                by_area(from, pose.transform_point3(local.extend(0.0)), scaled.normalize(), uv, 1.0 / area)
            }
            EmitterShape::Sphere { center, radius } => {
                if let Some((center, radius)) = round(&pose, *center, *radius)
                    && from.distance_squared(center) > radius * radius * OUTSIDE
                {
                    return sample_cone(from, center, radius, u);
                }
                let normal = uniform_sphere(u);
                let scaled = area_scale(&pose, normal);
                let pdf = 1.0 / (4.0 * std::f32::consts::PI * radius * radius * scaled.length());
                let point = pose.transform_point3(*center + *radius * normal);
                by_area(from, point, scaled.normalize(), sphere_uv(normal), pdf)
            }
        }
    }

    /// Density over solid angle with which [`Self::sample`] from `from` chooses `point` with unit normal `normal`.
    pub fn pdf(&self, from: Vec3, point: Vec3, normal: Vec3, time: f32) -> f32 {
        let pose = self.pose_at(time);
        let area_pdf = match &self.shape {
            EmitterShape::Triangle { .. } => {
                let [a, b, c] = self.world_corners(&pose, time);
                2.0 / (b - a).cross(c - a).length()
            }
            EmitterShape::Rectangle => {
                if let Some(rectangle) = SphericalRectangle::seen_from(&pose, from) {
                    return 1.0 / rectangle.solid_angle();
                }
                1.0 / (4.0 * area_scale(&pose, Vec3::Z).length())
            }
            EmitterShape::Disk => 1.0 / (std::f32::consts::PI * area_scale(&pose, Vec3::Z).length()),
            EmitterShape::Sphere { center, radius } => {
                if let Some((center, radius)) = round(&pose, *center, *radius) {
                    let distance_squared = from.distance_squared(center);
                    if distance_squared > radius * radius * OUTSIDE {
                        return 1.0 / cone_solid_angle(radius * radius / distance_squared);
                    }
                }
                let local = (pose.inverse().transform_point3(point) - *center).normalize_or(Vec3::Z);
                let scale = area_scale(&pose, local).length();
                1.0 / (4.0 * std::f32::consts::PI * radius * radius * scale)
            }
        };
        let to = point - from;
        let cosine = normal.dot(to).abs() / to.length();
        let pdf = area_pdf * to.length_squared() / cosine;
        if pdf.is_finite() { pdf } else { 0.0 }
    }

    /// A point drawn by local area, for light that sets out from it; its density is per square metre. `None` where the emitter
    /// has no area.
    pub fn sample_surface(&self, u: Vec2, time: f32) -> Option<EmitterSample> {
        let pose = self.pose_at(time);
        let (local, uv) = match &self.shape {
            EmitterShape::Triangle { uvs, .. } => {
                let [a, b, c] = self.world_corners(&pose, time);
                let (v, w) = if u.x + u.y > 1.0 { (1.0 - u.x, 1.0 - u.y) } else { (u.x, u.y) };
                let sign = if pose.matrix3.determinant() < 0.0 { -1.0 } else { 1.0 };
                let cross = sign * (b - a).cross(c - a);
                let uv = uvs[0] * (1.0 - v - w) + uvs[1] * v + uvs[2] * w;
                let (point, pdf) = (a + v * (b - a) + w * (c - a), 2.0 / cross.length());
                let normal = cross.normalize_or_zero();
                return (pdf.is_finite() && pdf > 0.0).then_some(EmitterSample { point, normal, uv, pdf });
            }
            EmitterShape::Sphere { center, radius } => {
                let normal = uniform_sphere(u);
                let scaled = area_scale(&pose, normal);
                let pdf = 1.0 / (4.0 * std::f32::consts::PI * radius * radius * scaled.length());
                let point = pose.transform_point3(*center + *radius * normal);
                let (normal, uv) = (scaled.normalize_or_zero(), sphere_uv(normal));
                return (pdf.is_finite() && pdf > 0.0).then_some(EmitterSample { point, normal, uv, pdf });
            }
            EmitterShape::Rectangle => {
                let local = 2.0 * u - Vec2::ONE;
                ((local, 4.0), rectangle_uv(local))
            }
            EmitterShape::Disk => {
                let local = concentric_disk(u);
                ((local, std::f32::consts::PI), disk_uv(local))
            }
        };
        let (local, area) = local;
        let scaled = area_scale(&pose, Vec3::Z);
        let pdf = 1.0 / (area * scaled.length());
        let (point, normal) = (pose.transform_point3(local.extend(0.0)), scaled.normalize_or_zero());
        (pdf.is_finite() && pdf > 0.0).then_some(EmitterSample { point, normal, uv, pdf })
    }

    fn pose_at(&self, time: f32) -> Affine3A {
        let [open, close] = &self.pose;
        if open == close {
            return *open;
        }
        Affine3A {
            matrix3: open.matrix3 + (close.matrix3 - open.matrix3) * time,
            translation: open.translation.lerp(close.translation, time),
        }
    }

    /// The corners of a triangle in world space.
    fn world_corners(&self, pose: &Affine3A, time: f32) -> [Vec3; 3] {
        let EmitterShape::Triangle { corners: [open, close], .. } = &self.shape else {
            unreachable!("only triangles have corners");
        };
        [0, 1, 2].map(|i| pose.transform_point3(open[i].lerp(close[i], time)))
    }
}

/// A sphere is sampled by its cone from farther than this times its squared radius; nearer, the cone is nearly a
/// half-space and its sine is lost to rounding.
const OUTSIDE: f32 = 1.0001;

/// cof(M) n: the direction of a surface's normal in the world, its length the local stretch of area.
fn area_scale(pose: &Affine3A, normal: Vec3) -> Vec3 {
    let [x, y, z] = [pose.matrix3.x_axis, pose.matrix3.y_axis, pose.matrix3.z_axis].map(Vec3::from);
    let cofactor = Mat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    // A mirroring transform turns the cofactor's normals inwards.
    let sign = if x.cross(y).dot(z) < 0.0 { -1.0 } else { 1.0 };
    sign * (cofactor * normal)
}

/// Texture coordinates of a point of the square, v downwards.
fn rectangle_uv(local: Vec2) -> Vec2 {
    Vec2::new(0.5 + 0.5 * local.x, 0.5 - 0.5 * local.y)
}

fn disk_uv(local: Vec2) -> Vec2 {
    rectangle_uv(local)
}

/// Texture coordinates of a sphere: those of a globe about +y, the middle of its map towards +z.
fn sphere_uv(normal: Vec3) -> Vec2 {
    let u = 0.5 + normal.x.atan2(normal.z) / std::f32::consts::TAU;
    Vec2::new(u, normal.y.clamp(-1.0, 1.0).acos() / std::f32::consts::PI)
}

/// From a density over area to one over solid angle.
fn by_area(from: Vec3, point: Vec3, normal: Vec3, uv: Vec2, area_pdf: f32) -> Option<EmitterSample> {
    let to = point - from;
    let pdf = area_pdf * to.length_squared() * to.length() / normal.dot(to).abs();
    (pdf.is_finite() && pdf > 0.0).then_some(EmitterSample { point, normal, uv, pdf })
}

/// Centre and radius in the world if the transform keeps the sphere round.
fn round(pose: &Affine3A, center: Vec3, radius: f32) -> Option<(Vec3, f32)> {
    let [x, y, z] = [pose.matrix3.x_axis, pose.matrix3.y_axis, pose.matrix3.z_axis];
    let scale_squared = x.length_squared();
    let tolerance = 1e-5 * scale_squared;
    let even = (y.length_squared() - scale_squared).abs() < tolerance
        && (z.length_squared() - scale_squared).abs() < tolerance;
    let square = x.dot(y).abs() < tolerance && y.dot(z).abs() < tolerance && z.dot(x).abs() < tolerance;
    (even && square).then(|| (pose.transform_point3(center), radius * scale_squared.sqrt()))
}

/// Solid angle of a cone whose half angle has the squared sine `sin2`: 2π(1 − cos), without cancellation.
fn cone_solid_angle(sin2: f32) -> f32 {
    std::f32::consts::TAU * sin2 / (1.0 + (1.0 - sin2).sqrt())
}

fn sample_cone(from: Vec3, center: Vec3, radius: f32, u: Vec2) -> Option<EmitterSample> {
    let to_center = center - from;
    let distance_squared = to_center.length_squared();
    let sin2_max = radius * radius / distance_squared;
    // 1 − cos of the direction, uniform in solid angle.
    let one_minus_cos = u.x * sin2_max / (1.0 + (1.0 - sin2_max).sqrt());
    let cos = 1.0 - one_minus_cos;
    let sin2 = (one_minus_cos * (2.0 - one_minus_cos)).max(0.0);
    // The near intersection of that direction, told by the angle at the centre (Akalin's form, as in pbrt-v3 §14.2.3).
    let sin_max = sin2_max.sqrt();
    let cos_alpha = sin2 / sin_max + cos * (1.0 - sin2 / sin2_max).max(0.0).sqrt();
    let sin_alpha = (1.0 - cos_alpha * cos_alpha).max(0.0).sqrt();
    let axis = to_center / distance_squared.sqrt();
    let (tangent, bitangent) = axis.any_orthonormal_pair();
    let (sin_phi, cos_phi) = (std::f32::consts::TAU * u.y).sin_cos();
    let normal = (sin_alpha * cos_phi) * tangent + (sin_alpha * sin_phi) * bitangent - cos_alpha * axis;
    let pdf = 1.0 / cone_solid_angle(sin2_max);
    (pdf.is_finite()).then(|| EmitterSample {
        point: center + radius * normal,
        normal,
        uv: sphere_uv(normal),
        pdf,
    })
}
