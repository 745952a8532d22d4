//! The entities of a frame, where they stand in it.

use std::sync::Arc;

use glam::{Affine3A, Mat3, Vec3};
use halflight_scene::Frame;
use halflight_sh::{Rotation, Sh};
use halflight_trace::Geometry;

use super::entity::{Cast, Entity, Role, Similarity, carried, instances_of};
use super::flat::Flat;
use super::relief::Relief;
use crate::gbuffer::VisiblePoint;
use crate::sh_light::{Colors, axes};

/// An entity in a frame.
pub(super) struct Posed<'a, const ORDER: usize> {
    pub(super) entity: &'a Entity<ORDER>,
    pub(super) carried: Carried<ORDER>,
    pub(super) center: Vec3,
    pub(super) radius: f32,
}

/// The way from where a field was made to where it is.
pub(super) struct Carried<const ORDER: usize> {
    back: Affine3A,
    turn: Mat3,
    /// Of the harmonics; `None` where nothing turns.
    rotation: Option<Rotation<ORDER>>,
}

/// What a visible point belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Owner {
    Nobody,
    Entity { number: u32, part: u32 },
    Flat(u32),
    Relief(u32),
}

/// All that blocks light or shines in a frame.
pub(super) struct Stage<'a, const ORDER: usize> {
    pub(super) entities: Vec<Posed<'a, ORDER>>,
    pub(super) flats: Vec<Flat>,
    pub(super) reliefs: Vec<(&'a Relief<ORDER>, Carried<ORDER>)>,
    pub(super) owners: Vec<Owner>,
    /// What is only nearly true, in words.
    pub(super) notes: Vec<String>,
}

impl<const ORDER: usize> Carried<ORDER> {
    fn new(moved: &Affine3A, similarity: &Similarity) -> Self {
        let turned =
            Affine3A { matrix3: (similarity.turn * similarity.scale).into(), translation: moved.translation };
        let rotation = (!similarity.turn.abs_diff_eq(Mat3::IDENTITY, 1e-7))
            .then(|| Rotation::from_matrix(&in_axes(&similarity.turn)));
        Self { back: turned.inverse(), turn: similarity.turn, rotation }
    }

    /// A point of the frame where the field was made.
    #[inline]
    pub(super) fn back(&self, point: Vec3) -> Vec3 {
        self.back.transform_point3(point)
    }

    /// A direction of the frame there.
    #[inline]
    pub(super) fn direction_back(&self, direction: Vec3) -> Vec3 {
        self.turn.transpose() * direction
    }

    /// Harmonics of the field in the axes of the frame.
    #[inline]
    pub(super) fn turned(&self, sh: &Sh<ORDER>) -> Sh<ORDER> {
        self.rotation.as_ref().map_or(*sh, |rotation| rotation.apply(sh))
    }
}

/// A turn of the world as a turn of the harmonics' frame.
pub(super) fn in_axes(turn: &Mat3) -> Mat3 {
    // The harmonics' x, y, z are z, x, y of the world.
    let image = |axis: Vec3| Vec3::from_array(axes(*turn * axis));
    Mat3::from_cols(image(Vec3::Z), image(Vec3::X), image(Vec3::Y))
}

impl<const ORDER: usize> Posed<'_, ORDER> {
    /// What it hides from a point.
    #[inline]
    pub(super) fn hidden(&self, point: Vec3) -> Sh<ORDER> {
        let [hidden] = self.entity.occlusion.at(self.carried.back(point));
        self.carried.turned(&hidden)
    }

    /// The light that it sends to a point, if it shines.
    pub(super) fn shining(&self, point: Vec3) -> Option<Colors<ORDER>> {
        let radiance = self.entity.radiance.as_ref()?.at(self.carried.back(point));
        Some(radiance.map(|color| self.carried.turned(&color)))
    }
}

impl<'a, const ORDER: usize> Stage<'a, ORDER> {
    /// Everything where it stands in a frame; `None` if the frame is of another scene than was prepared.
    pub(super) fn new(cast: &'a Cast<ORDER>, frame: &Frame) -> Option<Self> {
        let mut stage = Self {
            entities: Vec::new(),
            flats: Vec::new(),
            reliefs: Vec::new(),
            owners: vec![Owner::Nobody; frame.world.instances().len()],
            notes: Vec::new(),
        };
        if frame.objects.len() != cast.objects.len() {
            return None;
        }
        for (object, (copies, name)) in cast.objects.iter().zip(&cast.names).enumerate() {
            if frame.objects[object].places.len() != copies.len() {
                return None;
            }
            let (mut deforms, mut stretches) = (false, false);
            for (copy, stand) in copies.iter().enumerate() {
                let instances: Vec<u32> = instances_of(frame, object, copy).collect();
                let shown = |number: &u32| &frame.world.instances()[*number as usize];
                let places: Vec<Affine3A> = instances.iter().map(|n| shown(n).transform.open).collect();
                let (moved, alike) = carried(&places, &stand.parts);
                let same_shape = instances.iter().zip(&stand.parts).all(|(number, (geometry, _))| {
                    let now = &shown(number).geometry;
                    Arc::ptr_eq(now, geometry)
                        || !matches!(now.as_ref(), Geometry::Mesh(_) | Geometry::HeightField(_))
                });
                let similarity = Similarity::of(&moved);
                if !matches!(stand.role, Role::Flat { .. } | Role::Nothing) {
                    deforms |= !(alike && same_shape);
                    stretches |= alike && !similarity.exact;
                }
                stage.add(stand, &instances, &places, &moved, &similarity);
            }
            if deforms {
                stage.notes.push(format!(
                    "{name} deforms: its shadows are those of its shape at time 0, carried along (use `shexp` for it)"
                ));
            }
            if stretches {
                stage.notes.push(format!(
                    "{name} is stretched or mirrored: its shadows are those of the nearest turn and even scale"
                ));
            }
        }
        stage.tell_of_neighbours(frame);
        Some(stage)
    }

    fn add(
        &mut self,
        stand: &'a super::entity::Stand<ORDER>,
        instances: &[u32],
        places: &[Affine3A],
        moved: &Affine3A,
        similarity: &Similarity,
    ) {
        let owner = match &stand.role {
            Role::Nothing => Owner::Nobody,
            Role::Flat { is_disk } => match places.first().and_then(|place| Flat::new(*place, *is_disk)) {
                Some(flat) => {
                    self.flats.push(flat);
                    Owner::Flat(self.flats.len() as u32 - 1)
                }
                None => Owner::Nobody,
            },
            Role::Relief(relief) => {
                self.reliefs.push((relief.as_ref(), Carried::new(moved, similarity)));
                Owner::Relief(self.reliefs.len() as u32 - 1)
            }
            Role::Entity(entity) => {
                let center = moved.transform_point3(entity.occlusion.center);
                let radius = similarity.scale * entity.occlusion.radius;
                let carried = Carried::new(moved, similarity);
                self.entities.push(Posed { entity, carried, center, radius });
                Owner::Entity { number: self.entities.len() as u32 - 1, part: 0 }
            }
        };
        for (index, &number) in instances.iter().enumerate() {
            self.owners[number as usize] = match owner {
                Owner::Entity { number, .. } => Owner::Entity { number, part: index as u32 },
                other => other,
            };
        }
    }

    /// Fields are rough within the ball that holds their entity.
    fn tell_of_neighbours(&mut self, frame: &Frame) {
        let name = |number: usize| {
            let is =
                |owner: &Owner| matches!(owner, Owner::Entity { number: n, .. } if *n as usize == number);
            let instance = self.owners.iter().position(is).unwrap_or(0);
            frame.shape_name(instance as u32).to_string()
        };
        let mut told: Vec<String> = Vec::new();
        for (a, of) in self.entities.iter().enumerate() {
            let within = |b: usize| {
                let other = &self.entities[b];
                b != a && other.center.distance(of.center) < of.radius && other.radius < of.radius
            };
            let inner = (0..self.entities.len()).filter(|&b| within(b)).count();
            if inner > 0 {
                told.push(format!(
                    "{inner} {} within the ball that holds {}, where its field is rough",
                    if inner == 1 { "object stands" } else { "objects stand" },
                    name(a)
                ));
            }
        }
        /// More would be a list, not a note.
        const MOST: usize = 4;
        let rest = told.len().saturating_sub(MOST);
        told.truncate(MOST);
        if rest > 0 {
            told.push(format!("and so with {rest} more"));
        }
        self.notes.extend(told);
    }

    /// What the object of a visible point hides from it; `None` for nothing.
    pub(super) fn own(&self, frame: &Frame, point: &VisiblePoint) -> Option<Sh<ORDER>> {
        match self.owners[point.hit.instance as usize] {
            Owner::Nobody | Owner::Flat(_) => None,
            Owner::Relief(number) => {
                let (relief, carried) = &self.reliefs[number as usize];
                Some(carried.turned(&relief.own(carried.back(point.position))))
            }
            Owner::Entity { number, part } => {
                let posed = &self.entities[number as usize];
                let outwards = posed.carried.direction_back(point.geometric_normal);
                let front = is_front(frame, point);
                let hidden = posed.entity.own[part as usize].at(&point.hit, outwards, front)?;
                Some(posed.carried.turned(&hidden))
            }
        }
    }
}

/// Whether the eye is on the side of a triangle that its winding calls the front.
fn is_front(frame: &Frame, point: &VisiblePoint) -> bool {
    let instance = &frame.world.instances()[point.hit.instance as usize];
    let Geometry::Mesh(tracer) = instance.geometry.as_ref() else { return true };
    let place = &instance.transform.open;
    let [a, b, c] = tracer.corners(point.hit.primitive, 0.0).map(|p| place.transform_point3(p));
    let mirrored = place.matrix3.determinant() < 0.0;
    ((b - a).cross(c - a).dot(point.geometric_normal) > 0.0) != mirrored
}
