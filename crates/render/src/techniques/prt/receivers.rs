//! The surfaces of a frame as roots of triangles: from a point of a root to the surface there, and back from a hit.
//!
//! | form | roots | parameters |
//! |---|---|---|
//! | mesh | its triangles | barycentric weights |
//! | height field | two for each block of cells | x and z |
//! | rectangle | two | u and v |
//! | disk | two for each of four quarters | angle and radius |
//! | spheres | eight octants each | direction, scaled to \|x\| + \|y\| + \|z\| = 1 |
//!
//! Where light can reach both sides of a surface it is there twice, once for each; but for height fields, of which only
//! the upper side is.

use std::collections::HashMap;
use std::f32::consts::TAU;

use glam::{Affine3A, Vec2, Vec3};
use halflight_scene::Frame;
use halflight_shape::{HeightField, TriangleMesh};
use halflight_trace::{Geometry, Hit, Ray, Surface};

use super::tree::Weights;
use crate::vertex::Vertex;

/// How far a point of transfer is moved into its triangle, as a part of the triangle, so that in a corner of a room it
/// is on this side of the other wall.
const INWARD: f32 = 1e-3;

/// What the roots of a surface are.
#[derive(Clone, Copy, Debug)]
enum Form {
    Mesh,
    /// Blocks of so many cells along each side, so many of them along x and z.
    Heights {
        block: usize,
        across: usize,
    },
    Rectangle,
    Disk,
    Spheres,
}

/// One side of an instance.
#[derive(Clone, Copy, Debug)]
struct Side {
    instance: u32,
    is_back: bool,
    form: Form,
    first_root: u32,
}

/// A point of transfer.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    /// The surface, with normals on the side that is lit.
    pub(super) surface: Surface,
    /// What it gives back of the light that it gets.
    pub(super) albedo: Vec3,
    pub(super) is_glossy: bool,
}

/// The surfaces of a frame.
pub(super) struct Receivers {
    sides: Vec<Side>,
    roots: u32,
    /// Front and back of each instance, as numbers into `sides`.
    of_instance: Vec<[Option<u32>; 2]>,
    /// From the world to the space of each instance.
    inverses: Vec<Affine3A>,
    /// Instances that have a material with a lobe.
    glossy: Vec<bool>,
    /// Instances that no form is known for.
    pub(super) strange: usize,
}

impl Receivers {
    /// The surfaces of a frame; height fields in blocks of about `max_edge`.
    pub(super) fn of(frame: &Frame, max_edge: f32) -> Self {
        let mut all = Self {
            sides: Vec::new(),
            roots: 0,
            of_instance: Vec::new(),
            inverses: Vec::new(),
            glossy: Vec::new(),
            strange: 0,
        };
        for (number, instance) in frame.world.instances().iter().enumerate() {
            let transform = instance.transform.open;
            let inverse = transform.inverse();
            let number = number as u32;
            all.inverses.push(inverse);
            all.glossy.push(is_glossy(frame, number, &instance.geometry));
            let (form, count, both) = match instance.geometry.as_ref() {
                Geometry::Mesh(tracer) => {
                    let mesh = tracer.mesh();
                    (Form::Mesh, mesh.triangles.len(), !is_closed(mesh))
                }
                Geometry::HeightField(tracer) => {
                    let field = tracer.field();
                    let spacing = field.spacing();
                    let step = (transform.transform_vector3(Vec3::X * spacing.x).length())
                        .max(transform.transform_vector3(Vec3::Z * spacing.y).length());
                    let (x, z) = field.cells();
                    let block = ((max_edge / step) as usize).clamp(1, x.max(z));
                    let across = x.div_ceil(block);
                    (Form::Heights { block, across }, 2 * across * z.div_ceil(block), false)
                }
                Geometry::Rectangle(_) => (Form::Rectangle, 2, true),
                Geometry::Disk(_) => (Form::Disk, 8, true),
                Geometry::Spheres(tracer) => (Form::Spheres, 8 * tracer.spheres().len(), false),
                Geometry::Custom(_) => {
                    all.strange += 1;
                    all.of_instance.push([None; 2]);
                    continue;
                }
            };
            let shows_back = both && frame_shows_back(frame, number, &instance.geometry);
            let usable = inverse.is_finite() && transform.matrix3.determinant() != 0.0;
            let mut numbers = [None; 2];
            for is_back in [false, true] {
                if usable && (!is_back || shows_back) {
                    numbers[usize::from(is_back)] = Some(all.sides.len() as u32);
                    all.sides.push(Side { instance: number, is_back, form, first_root: all.roots });
                    all.roots += count as u32;
                }
            }
            all.of_instance.push(numbers);
        }
        all
    }

    /// Whether an instance has no roots, because its form has no parameters to put points of transfer at, as a learned
    /// field: its transfer is worked out where it is seen.
    pub(super) fn is_strange(frame: &Frame, instance: u32) -> bool {
        matches!(frame.world.instances()[instance as usize].geometry.as_ref(), Geometry::Custom(_))
    }

    /// How many roots there are.
    pub(super) fn roots(&self) -> usize {
        self.roots as usize
    }

    /// What matters of an instance beside its geometry.
    pub(super) fn said(&self, instance: usize) -> u64 {
        let [front, back] = self.of_instance[instance].map(|side| u64::from(side.is_some()));
        4 * u64::from(self.glossy[instance]) + 2 * front + back
    }

    fn side_of(&self, root: u32) -> &Side {
        let after = self.sides.partition_point(|side| side.first_root <= root);
        &self.sides[after - 1]
    }

    /// The surface at a point of a root, exactly there or a little inwards, without its material.
    fn surface(&self, frame: &Frame, root: u32, weights: Weights) -> (Ray, Hit, Surface) {
        let side = self.side_of(root);
        let instance = &frame.world.instances()[side.instance as usize];
        let transform = instance.transform.open;
        let (ray, hit) = hit_of(side, &instance.geometry, &transform, root - side.first_root, weights);
        let mut surface = frame.world.surface(&ray, &hit);
        if let Geometry::HeightField(tracer) = instance.geometry.as_ref() {
            // Steps between flat triangles are not what is sampled here: transfer is smooth between posts.
            let normal = smooth_normal(tracer.field(), hit);
            let turned =
                self.inverses[side.instance as usize].matrix3.transpose() * glam::Vec3A::from(normal);
            let normal = Vec3::from(turned).normalize_or(surface.geometric_normal);
            (surface.geometric_normal, surface.shading_normal) = (normal, normal);
        }
        if side.is_back {
            surface.geometric_normal = -surface.geometric_normal;
            surface.shading_normal = -surface.shading_normal;
        }
        (ray, hit, surface)
    }

    /// Where a point of a root is.
    pub(super) fn position(&self, frame: &Frame, root: u32, weights: Weights) -> Vec3 {
        self.surface(frame, root, weights).2.position
    }

    /// A point of transfer.
    pub(super) fn point(&self, frame: &Frame, root: u32, weights: Weights) -> Point {
        let inward = weights.map(|w| w * (1.0 - INWARD) + INWARD / 3.0);
        let (_, _, exact) = self.surface(frame, root, weights);
        let (ray, hit, mut surface) = self.surface(frame, root, inward);
        surface.shading_normal = exact.shading_normal;
        let material = Vertex::new(frame, &ray, &hit).bsdf.low_frequency();
        let albedo = (material.diffuse + material.specular).clamp(Vec3::ZERO, Vec3::ONE);
        Point { surface, albedo, is_glossy: self.glossy[surface.instance as usize] }
    }

    /// The corners of every root as vertices, those at one place with one normal being one.
    pub(super) fn weld(&self, frame: &Frame) -> (Vec<[u32; 3]>, Vec<(u32, Weights)>) {
        let mut known: HashMap<([u32; 6], u32, bool), u32> = HashMap::new();
        let mut vertices = Vec::new();
        let mut corners = Vec::with_capacity(self.roots());
        for root in 0..self.roots {
            let side = self.side_of(root);
            corners.push([0, 1, 2].map(|corner| {
                let mut weights = [0.0; 3];
                weights[corner] = 1.0;
                let surface = self.surface(frame, root, weights).2;
                let (p, n) = (surface.position, surface.shading_normal);
                // Adding zero makes minus zero plain.
                let bits = [p.x, p.y, p.z, n.x, n.y, n.z].map(|x| (x + 0.0).to_bits());
                *known.entry((bits, side.instance, side.is_back)).or_insert_with(|| {
                    vertices.push((root, weights));
                    vertices.len() as u32 - 1
                })
            }));
        }
        (corners, vertices)
    }

    /// The root that a hit is on, and where in it; `None` where no light is known to come. `position` is the hit's
    /// point and `seen_from` the side of it that is looked at.
    #[inline]
    pub(super) fn locate(
        &self,
        frame: &Frame,
        hit: &Hit,
        position: Vec3,
        seen_from: Vec3,
    ) -> Option<(u32, Weights)> {
        let sides = self.of_instance[hit.instance as usize];
        let any = &self.sides[sides[0].or(sides[1])? as usize];
        let geometry = frame.world.instances()[hit.instance as usize].geometry.as_ref();
        let inverse = &self.inverses[hit.instance as usize];
        let local = || inverse.transform_point3(position);
        let (root, weights, front) = match (any.form, geometry) {
            (Form::Spheres, Geometry::Spheres(tracer)) => {
                let sphere = tracer.spheres()[hit.primitive as usize];
                let outward = local() - sphere.center;
                let front = outward.dot(inverse.transform_vector3(seen_from)) > 0.0;
                let (octant, weights) = octant_of(outward);
                (8 * hit.primitive + octant, weights, front)
            }
            (Form::Heights { block, across }, Geometry::HeightField(tracer)) => {
                let (x, z) = tracer.field().cells();
                let cell = (hit.primitive / 2) as usize;
                let grid = Vec2::new((cell % x) as f32 + hit.u, (cell / x) as f32 + hit.v);
                let at = [cell % x / block, cell / x / block];
                let low = Vec2::new((at[0] * block) as f32, (at[1] * block) as f32);
                let size =
                    Vec2::new((x - at[0] * block).min(block) as f32, (z - at[1] * block).min(block) as f32);
                let (half, weights) = half_of((grid - low) / size);
                let front = self.faces(frame, hit, position, seen_from);
                (2 * (at[1] * across + at[0]) as u32 + half, weights, front)
            }
            (Form::Rectangle, _) => {
                let (half, weights) = half_of(Vec2::new(hit.u, hit.v));
                (half, weights, self.faces(frame, hit, position, seen_from))
            }
            (Form::Disk, _) => {
                let at = Vec2::new(2.0 * hit.u - 1.0, 1.0 - 2.0 * hit.v);
                let quarters = (at.y.atan2(at.x).rem_euclid(TAU) / TAU * 4.0).clamp(0.0, 3.999_999);
                let (half, weights) = half_of(Vec2::new(quarters.fract(), at.length()));
                (2 * quarters as u32 + half, weights, self.faces(frame, hit, position, seen_from))
            }
            _ => {
                let weights = [1.0 - hit.u - hit.v, hit.u, hit.v].map(|w| w.clamp(0.0, 1.0));
                (hit.primitive, weights, self.faces(frame, hit, position, seen_from))
            }
        };
        let side = &self.sides[sides[usize::from(!front)]? as usize];
        Some((side.first_root + root, weights))
    }

    /// Whether a direction points to the front of what was hit.
    fn faces(&self, frame: &Frame, hit: &Hit, position: Vec3, seen_from: Vec3) -> bool {
        // The forms that come here need no more of the ray than its time.
        let ray = Ray::new(position + seen_from, -seen_from);
        frame.world.surface(&ray, hit).geometric_normal.dot(seen_from) > 0.0
    }
}

/// Whether any material of an instance reflects in a lobe.
fn is_glossy(frame: &Frame, instance: u32, geometry: &Geometry) -> bool {
    materials(geometry).any(|slot| !frame.material(instance, slot).is_matt())
}

/// Whether any material of an instance scatters from behind.
fn frame_shows_back(frame: &Frame, instance: u32, geometry: &Geometry) -> bool {
    materials(geometry).any(|slot| frame.material(instance, slot).two_sided)
}

/// The material slots of a geometry.
fn materials(geometry: &Geometry) -> impl Iterator<Item = u32> {
    let last = match geometry {
        Geometry::Mesh(tracer) => tracer.mesh().material_slots.iter().copied().max().unwrap_or(0),
        _ => 0,
    };
    0..=last
}

/// Whether a mesh encloses space with its front outside: every edge is passed once each way, and the volume of every
/// connected part is positive. No light reaches the other side.
fn is_closed(mesh: &TriangleMesh) -> bool {
    // Vertices at one place are one, or seams of textures would be holes.
    let mut at_place: HashMap<[u32; 3], u32> = HashMap::new();
    let number: Vec<u32> = mesh
        .positions
        .iter()
        .map(|p| {
            let next = at_place.len() as u32;
            *at_place.entry(p.to_array().map(|x| (x + 0.0).to_bits())).or_insert(next)
        })
        .collect();
    let mut parent: Vec<u32> = (0..at_place.len() as u32).collect();
    fn top(parent: &mut [u32], mut of: u32) -> u32 {
        while parent[of as usize] != of {
            parent[of as usize] = parent[parent[of as usize] as usize];
            of = parent[of as usize];
        }
        of
    }
    let mut balance: HashMap<(u32, u32), i32> = HashMap::new();
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|v| number[v as usize]);
        for (from, to) in [(a, b), (b, c), (c, a)] {
            *balance.entry((from, to)).or_insert(0) += 1;
            *balance.entry((to, from)).or_insert(0) -= 1;
            let (p, q) = (top(&mut parent, from), top(&mut parent, to));
            parent[p as usize] = q;
        }
    }
    if mesh.triangles.is_empty() || balance.values().any(|&n| n != 0) {
        return false;
    }
    let mut volumes = vec![0.0f64; parent.len()];
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|v| mesh.positions[v as usize].as_dvec3());
        volumes[top(&mut parent, number[triangle[0] as usize]) as usize] += a.dot(b.cross(c));
    }
    let parts = (0..parent.len() as u32).filter(|&v| parent[v as usize] == v);
    parts.into_iter().all(|part| volumes[part as usize] >= 0.0)
}

/// The half of the unit square that a point is in, and its weights there: below the diagonal from (0, 0) to (1, 1) first.
fn half_of(at: Vec2) -> (u32, Weights) {
    let at = at.clamp(Vec2::ZERO, Vec2::ONE);
    if at.x >= at.y { (0, [1.0 - at.x, at.x - at.y, at.y]) } else { (1, [1.0 - at.y, at.x, at.y - at.x]) }
}

/// The point of the unit square with these weights in that half.
fn in_half(half: u32, weights: Weights) -> Vec2 {
    let [_, b, c] = weights;
    if half == 0 { Vec2::new(b + c, c) } else { Vec2::new(b, b + c) }
}

/// The octant of a direction, and its weights there.
fn octant_of(direction: Vec3) -> (u32, Weights) {
    let size = direction.abs();
    let sum = size.element_sum().max(f32::MIN_POSITIVE);
    let negative = direction.is_negative_bitmask();
    (negative, (size / sum).to_array())
}

/// The direction with these weights in an octant.
fn in_octant(octant: u32, weights: Weights) -> Vec3 {
    let sign = |bit: u32| if octant >> bit & 1 == 1 { -1.0 } else { 1.0 };
    Vec3::new(sign(0) * weights[0], sign(1) * weights[1], sign(2) * weights[2]).normalize_or(Vec3::Y)
}

/// A hit at a point of a root, with a ray that would have found it.
fn hit_of(side: &Side, geometry: &Geometry, transform: &Affine3A, root: u32, weights: Weights) -> (Ray, Hit) {
    let hit = |primitive: u32, at: Vec2| Hit { t: 1.0, instance: side.instance, primitive, u: at.x, v: at.y };
    let any_ray = Ray::new(Vec3::ZERO, Vec3::NEG_Y);
    match (side.form, geometry) {
        (Form::Heights { block, across }, Geometry::HeightField(tracer)) => {
            let (x, z) = tracer.field().cells();
            let number = (root / 2) as usize;
            let at = [number % across * block, number / across * block];
            let size = Vec2::new((x - at[0]).min(block) as f32, (z - at[1]).min(block) as f32);
            let grid = Vec2::new(at[0] as f32, at[1] as f32) + in_half(root % 2, weights) * size;
            let cell = [(grid.x as usize).min(x - 1), (grid.y as usize).min(z - 1)];
            let within = grid - Vec2::new(cell[0] as f32, cell[1] as f32);
            let half = u32::from(within.x < within.y);
            (any_ray, hit(2 * (cell[1] * x + cell[0]) as u32 + half, within))
        }
        (Form::Rectangle, _) => (any_ray, hit(0, in_half(root, weights))),
        (Form::Disk, _) => {
            let at = in_half(root % 2, weights);
            let angle = ((root / 2) as f32 + at.x) / 4.0 * TAU;
            let (sin, cos) = angle.sin_cos();
            (any_ray, hit(0, Vec2::new(0.5 + 0.5 * at.y * cos, 0.5 - 0.5 * at.y * sin)))
        }
        (Form::Spheres, Geometry::Spheres(tracer)) => {
            let sphere = tracer.spheres()[(root / 8) as usize];
            let outward = in_octant(root % 8, weights) * sphere.radius.abs();
            let origin = transform.transform_point3(sphere.center + 2.0 * outward);
            // Not of unit length: so that the distance is 1 in both spaces.
            let ray = Ray::new(origin, transform.transform_vector3(-outward));
            (ray, hit(root / 8, Vec2::ZERO))
        }
        _ => (any_ray, hit(root, Vec2::new(weights[1], weights[2]))),
    }
}

/// The normal of a height field between its posts' normals.
fn smooth_normal(field: &HeightField, hit: Hit) -> Vec3 {
    let (x, _) = field.cells();
    let cell = (hit.primitive / 2) as usize;
    let (i, j) = (cell % x, cell / x);
    let post = |dx: usize, dz: usize| field.post_normal(i + dx, j + dz);
    let far = post(0, 0).lerp(post(1, 0), hit.u);
    let near = post(0, 1).lerp(post(1, 1), hit.u);
    far.lerp(near, hit.v).normalize_or(Vec3::Y)
}
