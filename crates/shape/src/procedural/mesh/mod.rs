//! Meshes from formulas, for scenes made of nothing but the program.
//!
//! All have unit normals, finite texture coordinates, and triangles counter-clockwise seen from outside; the solids
//! are closed (their signed volume is positive). +y is up; solids that stand, stand on y = 0. Sizes in metres.
//!
//! ```
//! use halflight_shape::procedural::mesh;
//! let knot = mesh::knot(2, 3, 0.6, 0.15, 256, 32);
//! assert_eq!(knot.triangles.len(), 2 * 256 * 32);
//! ```

mod clay;
mod objects;
mod round;
mod solids;
mod turned;

use std::collections::HashMap;

use glam::{Affine3A, Vec2, Vec3};

use crate::TriangleMesh;

pub use clay::{car_body, dragon, rabbit, seated};
pub use objects::{blob, figure, monolith, pot, shader_ball, vase};
pub use round::{capsule, ico_sphere, knot, torus, uv_sphere};
pub use solids::{cuboid, plane, rounded_box};
pub use turned::{cone, cylinder, disk, lathe};

/// A surface over (u, v) ∈ [0, 1]² at `across × along` quads; `surface` gives position and outward unit normal. The
/// front is where ∂v × ∂u points, so that a picture that is not to be mirrored there runs against u. Triangles without area (at poles) are left out.
fn grid(across: usize, along: usize, surface: impl Fn(f32, f32) -> (Vec3, Vec3)) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    for row in 0..=along {
        for column in 0..=across {
            let uv = Vec2::new(column as f32 / across as f32, row as f32 / along as f32);
            let (position, normal) = surface(uv.x, uv.y);
            mesh.positions.push(position);
            mesh.normals.push(normal);
            mesh.uvs.push(Vec2::new(1.0 - uv.x, 1.0 - uv.y));
        }
    }
    let stride = (across + 1) as u32;
    for row in 0..along as u32 {
        for column in 0..across as u32 {
            let a = row * stride + column;
            push_solid(&mut mesh, [a, a + stride, a + stride + 1]);
            push_solid(&mut mesh, [a, a + stride + 1, a + 1]);
        }
    }
    mesh
}

fn push_solid(mesh: &mut TriangleMesh, triangle: [u32; 3]) {
    let [a, b, c] = triangle.map(|v| mesh.positions[v as usize]);
    if a != b && b != c && c != a {
        mesh.triangles.push(triangle);
    }
}

/// Several meshes as one, each moved by its transform; all faces of part i get the material slot given with it.
///
/// ```
/// use glam::{Affine3A, Vec3};
/// use halflight_shape::procedural::mesh;
/// let ball = mesh::uv_sphere(0.5, 32, 16);
/// let pair = mesh::merge(&[(&ball, Affine3A::IDENTITY, 0), (&ball, Affine3A::from_translation(Vec3::X), 1)]);
/// assert_eq!(pair.triangles.len(), 2 * ball.triangles.len());
/// ```
pub fn merge(parts: &[(&TriangleMesh, Affine3A, u32)]) -> TriangleMesh {
    let mut whole = TriangleMesh::default();
    for (part, transform, slot) in parts {
        let first = whole.positions.len() as u32;
        let normals = transform.matrix3.inverse().transpose();
        whole.positions.extend(part.positions.iter().map(|&p| transform.transform_point3(p)));
        whole.normals.extend(part.normals.iter().map(|&n| (normals * n).normalize_or(Vec3::Y)));
        whole.uvs.extend(&part.uvs);
        let flip = transform.matrix3.determinant() < 0.0;
        whole.triangles.extend(part.triangles.iter().map(|t| {
            let [a, b, c] = t.map(|v| v + first);
            if flip { [a, c, b] } else { [a, b, c] }
        }));
        whole.material_slots.resize(whole.triangles.len(), *slot);
    }
    if whole.material_slots.iter().all(|&slot| slot == 0) {
        whole.material_slots.clear();
    }
    whole
}

/// Smooth normals by area-weighted sums over vertices at equal positions, across texture seams.
fn smooth_across_seams(mesh: &mut TriangleMesh) {
    let key = |p: Vec3| p.to_array().map(|c| (c * 65_536.0).round() as i64);
    let mut sums: HashMap<[i64; 3], Vec3> = HashMap::new();
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|v| mesh.positions[v as usize]);
        let area = (b - a).cross(c - a);
        for p in [a, b, c] {
            *sums.entry(key(p)).or_default() += area;
        }
    }
    mesh.normals = mesh
        .positions
        .iter()
        .map(|&p| sums.get(&key(p)).copied().unwrap_or(Vec3::Y).normalize_or(Vec3::Y))
        .collect();
}

#[cfg(test)]
mod tests {
    use std::cmp::Ordering;
    use std::f32::consts::PI;

    use super::*;

    /// Six times the volume is the sum of the determinants of the faces.
    fn signed_volume(mesh: &TriangleMesh) -> f32 {
        let volume = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| mesh.positions[v as usize].as_dvec3());
            a.dot(b.cross(c)) / 6.0
        };
        mesh.triangles.iter().map(volume).sum::<f64>() as f32
    }

    /// Every edge, by position, is walked as often one way as the other.
    fn is_closed(mesh: &TriangleMesh) -> bool {
        let key = |v: u32| mesh.positions[v as usize].to_array().map(|c| (c * 20_000.0).round() as i32);
        let mut edges: HashMap<_, i32> = HashMap::new();
        for t in &mesh.triangles {
            for i in 0..3 {
                let (a, b) = (key(t[i]), key(t[(i + 1) % 3]));
                match a.cmp(&b) {
                    Ordering::Less => *edges.entry((a, b)).or_default() += 1,
                    Ordering::Greater => *edges.entry((b, a)).or_default() -= 1,
                    Ordering::Equal => {}
                }
            }
        }
        edges.values().all(|&walks| walks == 0)
    }

    fn check(name: &str, mesh: &TriangleMesh, volume: Option<f32>) {
        let count = mesh.positions.len();
        assert_eq!((mesh.normals.len(), mesh.uvs.len()), (count, count), "{name}");
        assert!(mesh.positions.iter().all(|p| p.is_finite()), "{name}");
        assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-4), "{name}: normals are unit");
        assert!(mesh.uvs.iter().all(|uv| uv.is_finite()), "{name}");
        let mut agreeing = 0;
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
            let face = (b - a).cross(c - a);
            agreeing += usize::from(t.iter().all(|&v| mesh.normals[v as usize].dot(face) >= 0.0));
        }
        assert!(
            agreeing * 1000 >= mesh.triangles.len() * 995,
            "{name}: normals are on the side of the winding"
        );
        if let Some(expected) = volume {
            assert!(is_closed(mesh), "{name} is closed");
            let found = signed_volume(mesh);
            assert!((found / expected - 1.0).abs() < 0.02, "{name}: volume {found}, expected {expected}");
        }
    }

    #[test]
    fn solids_are_closed_face_outwards_and_have_the_volume_of_their_formula() {
        check("sphere", &uv_sphere(0.5, 64, 32), Some(4.0 / 3.0 * PI * 0.125));
        check("ico sphere", &ico_sphere(0.5, 4), Some(4.0 / 3.0 * PI * 0.125));
        check("torus", &torus(1.0, 0.25, 96, 48), Some(2.0 * PI * PI * 0.0625));
        check("cuboid", &cuboid(Vec3::new(1.0, 2.0, 3.0)), Some(6.0));
        let rounding = 0.1f32;
        let inner = 0.8f32;
        let expected = inner.powi(3)
            + 6.0 * inner * inner * rounding
            + 3.0 * PI * rounding * rounding * inner
            + 4.0 / 3.0 * PI * rounding.powi(3);
        check("rounded box", &rounded_box(Vec3::ONE, rounding, 6), Some(expected));
        check("cylinder", &cylinder(0.5, 2.0, 96), Some(0.5 * PI));
        check("cone", &cone(0.5, 2.0, 96), Some(0.5 * PI / 3.0));
        check("capsule", &capsule(Vec3::ZERO, Vec3::Y, 0.25, 64), Some(PI * 0.0625 * (1.0 + 1.0 / 3.0)));
        check("knot", &knot(2, 3, 0.6, 0.1, 512, 48), None);
        assert!(is_closed(&knot(2, 3, 0.6, 0.1, 128, 16)));
    }

    #[test]
    fn objects_are_closed_and_face_outwards() {
        for (name, mesh) in [
            ("vase", vase(96)),
            ("pot", pot(96)),
            ("monolith", monolith()),
            ("blob", blob(0.5, 7, 5)),
            ("figure", figure(1.75)),
            ("shader ball", shader_ball(96)),
            ("rabbit", rabbit(1.0, 64)),
            ("seated", seated(1.0, 160)),
            ("dragon", dragon(1.0, 224)),
            ("car", car_body(1.4, 96)),
        ] {
            check(name, &mesh, None);
            assert!(is_closed(&mesh), "{name} is closed");
            assert!(signed_volume(&mesh) > 0.0, "{name} faces outwards");
            let low = mesh.positions.iter().fold(f32::INFINITY, |low, p| low.min(p.y));
            assert!(low.abs() < 1e-3, "{name} stands on y = 0, not {low}");
        }
    }

    #[test]
    fn no_picture_is_mirrored_on_a_generated_mesh() {
        for (name, mesh) in [
            ("sphere", uv_sphere(0.5, 32, 16)),
            ("ico sphere", ico_sphere(0.5, 4)),
            ("torus", torus(1.0, 0.25, 32, 16)),
            ("cuboid", cuboid(Vec3::ONE)),
            ("cylinder", cylinder(0.5, 1.0, 32)),
            ("cone", cone(0.5, 1.0, 32)),
            ("knot", knot(2, 3, 0.6, 0.1, 256, 16)),
            ("vase", vase(32)),
            ("plane", plane(Vec2::ONE, 2, 2)),
            ("disk", disk(1.0, 32)),
        ] {
            // Counter-clockwise triangles are so in the picture too, seen with v upwards.
            let turns = |t: &&[u32; 3]| {
                let [a, b, c] = t.map(|v| mesh.uvs[v as usize]);
                (b - a).perp_dot(c - a) > 0.0
            };
            let mirrored = mesh.triangles.iter().filter(turns).count();
            // At the seam of the ico sphere a triangle spans the picture backwards.
            assert!(mirrored * 20 <= mesh.triangles.len(), "{name}: {mirrored} of {}", mesh.triangles.len());
        }
    }

    #[test]
    fn grounds_face_up() {
        for (name, mesh) in [("plane", plane(Vec2::new(2.0, 3.0), 4, 5)), ("disk", disk(2.0, 48))] {
            check(name, &mesh, None);
            for t in &mesh.triangles {
                let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
                assert!((b - a).cross(c - a).y > 0.0, "{name}");
            }
        }
    }

    #[test]
    fn merging_keeps_slots_and_turns_mirrored_parts_right_side_out() {
        let ball = uv_sphere(0.5, 24, 12);
        let mirror = Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0));
        let both = merge(&[(&ball, Affine3A::IDENTITY, 0), (&ball, mirror, 2)]);
        check("pair", &both, Some(2.0 * signed_volume(&ball)));
        assert_eq!(both.material_slots[0], 0);
        assert_eq!(both.material_slots.last(), Some(&2));
    }
}
