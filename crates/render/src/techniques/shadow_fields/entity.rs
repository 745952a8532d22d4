//! From the objects of a scene to entities with their fields: all that is prepared.
//!
//! Everything is made of an object as it stands at time 0, in the world's axes; in a frame an entity is that, carried by
//! the similarity from there. Copies of an object that are similar share what is prepared.

use std::sync::Arc;

use glam::{Affine3A, Mat3, Vec3};
use halflight_scene::{Frame, Scene};
use halflight_trace::{Geometry, Instance, Motion, World};

use super::cast::Caster;
use super::own::Own;
use super::relief::Relief;
use super::settings::ShadowFieldsSettings;
use super::shells::{Fineness, Shells};
use crate::technique::Progress;

/// What an object that blocks light or shines carries with it.
pub(super) struct Entity<const ORDER: usize> {
    /// What it hides.
    pub(super) occlusion: Shells<ORDER, 1>,
    /// How it shines.
    pub(super) radiance: Option<Shells<ORDER, 3>>,
    /// What each part hides from itself.
    pub(super) own: Vec<Own<ORDER>>,
}

/// What stands for a copy of an object.
pub(super) enum Role<const ORDER: usize> {
    Entity(Arc<Entity<ORDER>>),
    Flat { is_disk: bool },
    Relief(Arc<Relief<ORDER>>),
    Nothing,
}

/// A copy of an object and how it stood, part by part, when its fields were made (for a copy that shares them, how the
/// one it shares them with stood).
pub(super) struct Stand<const ORDER: usize> {
    pub(super) role: Role<ORDER>,
    pub(super) parts: Vec<(Arc<Geometry>, Affine3A)>,
}

/// All objects, each with its copies.
pub(super) struct Cast<const ORDER: usize> {
    pub(super) objects: Vec<Vec<Stand<ORDER>>>,
    pub(super) names: Vec<String>,
}

/// A turn and a scale, and whether they are all of a transform.
pub(super) struct Similarity {
    pub(super) turn: Mat3,
    pub(super) scale: f32,
    pub(super) exact: bool,
}

impl Similarity {
    /// The similarity nearest to a transform: its polar factor, by Newton's iteration (Higham 1986).
    pub(super) fn of(transform: &Affine3A) -> Self {
        let matrix = Mat3::from(transform.matrix3);
        let determinant = matrix.determinant();
        let scale = determinant.abs().cbrt();
        let start = matrix * (1.0 / scale);
        if !start.is_finite() || scale == 0.0 {
            return Self { turn: Mat3::IDENTITY, scale: 1.0, exact: false };
        }
        let mut turn = start;
        for _ in 0..12 {
            turn = (turn + turn.inverse().transpose()) * 0.5;
        }
        let exact = determinant > 0.0 && start.abs_diff_eq(turn, 1e-3);
        if determinant < 0.0 {
            turn.x_axis = -turn.x_axis;
        }
        Self { turn, scale, exact }
    }
}

/// Whether the parts of a copy stand to one another as they stood; then the transform from there to here.
pub(super) fn carried(parts: &[Affine3A], stood: &[(Arc<Geometry>, Affine3A)]) -> (Affine3A, bool) {
    let Some((first, (_, start))) = parts.first().zip(stood.first()) else {
        return (Affine3A::IDENTITY, false);
    };
    let moved = *first * start.inverse();
    let alike = parts.len() == stood.len()
        && parts.iter().zip(stood).all(|(part, (_, start))| {
            let expected = moved * *start;
            let size = expected.matrix3.x_axis.length() + expected.translation.length();
            part.abs_diff_eq(expected, 1e-4 * size)
        });
    (moved, alike)
}

/// The instances of a copy: those of each part follow one another copy by copy.
pub(super) fn instances_of(frame: &Frame, object: usize, copy: usize) -> impl Iterator<Item = u32> {
    let posed = &frame.objects[object];
    posed.instances.clone().skip(copy).step_by(posed.places.len().max(1))
}

impl<const ORDER: usize> Cast<ORDER> {
    /// Prepares all objects of a scene, of which this is the frame at time 0.
    pub(super) fn new(
        scene: &Scene,
        frame: &Frame,
        settings: &ShadowFieldsSettings,
        progress: &dyn Progress,
    ) -> Self {
        let total = frame.objects.len() as u64;
        let mut cast = Self { objects: Vec::new(), names: Vec::new() };
        for (object, posed) in frame.objects.iter().enumerate() {
            progress.report("shadow fields of objects", object as u64, total);
            let mut copies: Vec<Stand<ORDER>> = Vec::new();
            for copy in 0..posed.places.len() {
                let instances: Vec<u32> = instances_of(frame, object, copy).collect();
                let stand = copies
                    .iter()
                    .find_map(|other| other.shared(frame, &instances))
                    .unwrap_or_else(|| Stand::new(frame, instances, settings));
                copies.push(stand);
            }
            cast.objects.push(copies);
            cast.names.push(scene.object_name(posed.object).to_string());
        }
        progress.report("shadow fields of objects", total, total);
        cast
    }

    /// Bytes of fields on shells, and of vectors on surfaces.
    pub(super) fn memory_bytes(&self) -> [usize; 2] {
        let mut seen: Vec<*const Entity<ORDER>> = Vec::new();
        let (mut fields, mut surfaces) = (0, 0);
        for stand in self.objects.iter().flatten() {
            match &stand.role {
                Role::Entity(entity) if !seen.contains(&Arc::as_ptr(entity)) => {
                    seen.push(Arc::as_ptr(entity));
                    fields += entity.occlusion.memory_bytes();
                    fields += entity.radiance.as_ref().map_or(0, Shells::memory_bytes);
                    surfaces += entity.own.iter().map(Own::memory_bytes).sum::<usize>();
                }
                Role::Relief(relief) => surfaces += relief.memory_bytes(),
                _ => {}
            }
        }
        [fields, surfaces]
    }
}

impl<const ORDER: usize> Stand<ORDER> {
    /// The same fields for another copy, if it is similar.
    fn shared(&self, frame: &Frame, instances: &[u32]) -> Option<Self> {
        let Role::Entity(entity) = &self.role else { return None };
        let (moved, alike) = carried(&places(frame, instances), &self.parts);
        (alike && Similarity::of(&moved).exact)
            .then(|| Self { role: Role::Entity(Arc::clone(entity)), parts: self.parts.clone() })
    }

    fn new(frame: &Frame, instances: Vec<u32>, settings: &ShadowFieldsSettings) -> Self {
        let shown = |number: u32| &frame.world.instances()[number as usize];
        let parts: Vec<(Arc<Geometry>, Affine3A)> = instances
            .iter()
            .map(|&number| (Arc::clone(&shown(number).geometry), shown(number).transform.open))
            .collect();
        let shines = frame.lights.emitters().iter().any(|emitter| instances.contains(&emitter.instance));
        if let ([(geometry, _)], false) = (parts.as_slice(), shines) {
            match geometry.as_ref() {
                Geometry::Rectangle(_) => return Self { role: Role::Flat { is_disk: false }, parts },
                Geometry::Disk(_) => return Self { role: Role::Flat { is_disk: true }, parts },
                _ => {}
            }
        }
        let still = |(geometry, place): &(Arc<Geometry>, Affine3A)| Instance {
            geometry: Arc::clone(geometry),
            transform: Motion::fixed(*place),
        };
        let world = World::build(parts.iter().map(still).collect(), frame.world.simd());
        let (center, radius) = ball(&parts);
        if !(radius > 0.0 && radius.is_finite()) {
            return Self { role: Role::Nothing, parts };
        }
        let caster = Caster { world: &world, center, radius, rays: settings.rays as usize };
        let role = match parts.as_slice() {
            [(geometry, place)] if matches!(geometry.as_ref(), Geometry::HeightField(_)) => {
                let Geometry::HeightField(tracer) = geometry.as_ref() else { unreachable!("just matched") };
                let posts = settings.posts as usize;
                Role::Relief(Arc::new(Relief::new(&caster, tracer.field(), place, posts)))
            }
            _ => {
                let lamp = shines.then_some((frame, instances.as_slice()));
                Role::Entity(Arc::new(Entity::new(&caster, &parts, lamp, settings)))
            }
        };
        Self { role, parts }
    }
}

impl<const ORDER: usize> Entity<ORDER> {
    pub(super) fn new(
        caster: &Caster,
        parts: &[(Arc<Geometry>, Affine3A)],
        lamp: Option<(&Frame, &[u32])>,
        settings: &ShadowFieldsSettings,
    ) -> Self {
        let fine = Fineness { shells: settings.shells as usize, directions: settings.directions as usize };
        let ball = (caster.center, caster.radius);
        let own = |(geometry, place): &(Arc<Geometry>, Affine3A)| {
            Own::new(caster, geometry, place, settings.spacing)
        };
        Self {
            occlusion: Shells::new(ball, fine, |point| [caster.hidden(point)]),
            radiance: lamp.map(|(frame, instances)| {
                Shells::new(ball, fine, |point| caster.shining(point, frame, instances))
            }),
            own: parts.iter().map(own).collect(),
        }
    }
}

/// Where the instances stand.
fn places(frame: &Frame, instances: &[u32]) -> Vec<Affine3A> {
    instances.iter().map(|&number| frame.world.instances()[number as usize].transform.open).collect()
}

/// A ball that holds all parts: about the middle of their bounds, as small as vertices and spheres allow.
pub(super) fn ball(parts: &[(Arc<Geometry>, Affine3A)]) -> (Vec3, f32) {
    let mut points: Vec<(Vec3, f32)> = Vec::new();
    for (geometry, place) in parts {
        match geometry.as_ref() {
            Geometry::Mesh(tracer) => {
                let mesh = tracer.mesh();
                let used = mesh.triangles.iter().flatten().filter_map(|v| mesh.positions.get(*v as usize));
                points.extend(used.filter(|p| p.is_finite()).map(|p| (place.transform_point3(*p), 0.0)));
            }
            Geometry::Spheres(tracer) => {
                let matrix = place.matrix3;
                let stretch = matrix.x_axis.length().max(matrix.y_axis.length()).max(matrix.z_axis.length());
                let sphere =
                    |s: &halflight_trace::Sphere| (place.transform_point3(s.center), s.radius * stretch);
                points.extend(tracer.spheres().iter().map(sphere));
            }
            other => {
                let (low, high) = other.as_rays().bounds();
                for corner in 0..8 {
                    let pick = |axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
                    let corner = Vec3::new(pick(0), pick(1), pick(2));
                    points.push((place.transform_point3(corner), 0.0));
                }
            }
        }
    }
    let low = points.iter().map(|(p, r)| *p - *r).fold(Vec3::INFINITY, Vec3::min);
    let high = points.iter().map(|(p, r)| *p + *r).fold(Vec3::NEG_INFINITY, Vec3::max);
    let center = 0.5 * (low + high);
    let radius = points.iter().map(|(p, r)| p.distance(center) + r).fold(0.0, f32::max);
    // A little more, so that the rim is within the cone in spite of rounding.
    (center, radius * (1.0 + 1e-6))
}
