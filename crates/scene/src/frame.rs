//! One instant of a scene, or one shutter interval: what techniques are handed.

use std::sync::{Arc, OnceLock};

use glam::{Affine3A, Vec2, Vec3};
use halflight_material::Material;
use halflight_shape::{HeightField, ModelLightKind};
use halflight_trace::{Geometry, Instance, Motion, RayGeometry, World};
use rayon::prelude::*;

use crate::SceneError;
use crate::build::{Form, HeightSource, Object, built_once};
use crate::camera::Camera;
use crate::geometry;
use crate::lights::{DeltaLight, Emitter, EmitterShape, Lights};
use crate::media::Media;
use crate::posed::PosedObject;
use crate::scene::Scene;

/// A scene at one time: posed shapes that answer rays, what they are made of, the lights, the camera.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Everything that rays can meet. Ray times run from 0 (the shutter opens) to 1 (it closes).
    pub world: World,
    /// The materials of the scene; [`Frame::material_index`] says which one a surface has.
    pub materials: Vec<Arc<Material>>,
    /// The lights.
    pub lights: Lights,
    /// What light meets between surfaces.
    pub media: Arc<Media>,
    /// The camera.
    pub camera: Camera,
    /// The time asked for, in seconds.
    pub time_seconds: f64,
    /// When the shutter opens and closes, in seconds of the scene.
    pub shutter_seconds: [f64; 2],
    /// The objects that the instances belong to, in the order of the scene.
    pub objects: Vec<PosedObject>,
    /// Lower and upper corner of everything over the shutter interval; both zero if there is nothing.
    pub bounds: (Vec3, Vec3),
    /// Material of each slot, for each instance of the world.
    slots: Vec<Arc<[u32]>>,
    /// Name of the shape, for each instance of the world.
    names: Vec<Arc<str>>,
}

impl Frame {
    /// The index in [`Frame::materials`] of the material in a slot of an instance.
    pub fn material_index(&self, instance: u32, slot: u32) -> u32 {
        self.slots
            .get(instance as usize)
            .and_then(|slots| slots.get(slot as usize).or(slots.last()))
            .copied()
            .unwrap_or(0)
    }

    /// All materials of an instance.
    pub fn materials_of(&self, instance: u32) -> impl Iterator<Item = &Material> {
        let slots = self.slots.get(instance as usize).map_or(&[][..], |slots| &slots[..]);
        slots.iter().filter_map(|&slot| self.materials.get(slot as usize)).map(|material| &**material)
    }

    /// The material in a slot of an instance.
    ///
    /// # Panics
    /// If the frame has no such instance.
    pub fn material(&self, instance: u32, slot: u32) -> &Material {
        &self.materials[self.material_index(instance, slot) as usize]
    }

    /// The name of the shape that an instance of the world belongs to.
    pub fn shape_name(&self, instance: u32) -> &str {
        self.names.get(instance as usize).map_or("", |name| name)
    }

    /// Moves everything that belongs to the shape of this name, but not what it lights: false if there is no such shape.
    pub fn shift_shape(&mut self, name: &str, by: Vec3) -> bool {
        let moved = |transform: &mut Affine3A| transform.translation += glam::Vec3A::from(by);
        let mut instances = self.world.instances().to_vec();
        let mut found = false;
        for (instance, of) in instances.iter_mut().zip(&self.names) {
            if &**of == name {
                moved(&mut instance.transform.open);
                moved(&mut instance.transform.close);
                found = true;
            }
        }
        for object in &mut self.objects {
            if self.names.get(object.instances.start as usize).is_some_and(|of| &**of == name) {
                object.places.iter_mut().for_each(moved);
            }
        }
        if found {
            self.world = World::build(instances, self.world.simd());
            self.bounds = self.world.bounds();
        }
        found
    }

    /// Whether the shutter is open for more than an instant, so that ray times matter.
    pub fn shutter_is_open(&self) -> bool {
        self.shutter_seconds[1] > self.shutter_seconds[0]
    }
}

/// Height fields of more triangles than this are not sampled as lights: each triangle takes a quarter of a kilobyte.
pub(crate) const MOST_SHINING_FACETS: usize = 1 << 18;

/// A part of an object over the shutter interval.
struct Part {
    geometry: Arc<Geometry>,
    transform: [Affine3A; 2],
}

impl Scene {
    /// The scene at a time in seconds, over the camera's shutter interval: transforms and deforming vertices go in
    /// straight lines from where they are when the shutter opens to where they are when it closes.
    ///
    /// Geometry that does not deform is built once and shared by all frames. The result depends on nothing but the
    /// time: not on the frames asked for before, not on the number of threads.
    ///
    /// # Errors
    /// If a picture of a height sequence cannot be read.
    pub fn at(&self, time_seconds: f64) -> Result<Frame, SceneError> {
        let times = self.camera.shutter.map(|offset| time_seconds + offset);
        self.objects.par_iter().for_each(prepare);
        let mut instances = Vec::new();
        let (mut slots, mut names, mut emitters) = (Vec::new(), Vec::new(), Vec::new());
        let mut objects = Vec::with_capacity(self.objects.len());
        for (index, object) in self.objects.iter().enumerate() {
            let first = instances.len() as u32;
            let name: Arc<str> = Arc::from(object.name.as_str());
            let shines = object.materials.iter().any(|&index| self.materials[index as usize].is_emissive());
            let moved = object.track.as_ref().map_or([Affine3A::IDENTITY; 2], |track| track.over(times));
            for part in parts(object, times)? {
                for place in &object.places {
                    let pose = [0, 1].map(|end| moved[end] * *place * part.transform[end]);
                    let number = instances.len() as u32;
                    if shines {
                        self.add_emitters(object, &part.geometry, pose, number, &mut emitters);
                    }
                    let transform = Motion::between(pose[0], pose[1]);
                    instances.push(Instance { geometry: Arc::clone(&part.geometry), transform });
                    slots.push(Arc::clone(&object.materials));
                    names.push(Arc::clone(&name));
                }
            }
            objects.push(PosedObject {
                object: index,
                instances: first..instances.len() as u32,
                places: object.places.iter().map(|place| moved[0] * *place).collect(),
                joints: match &object.form {
                    Form::Model(model) if model.is_animated() => model.joints(times),
                    _ => Vec::new(),
                },
            });
        }
        let world = World::build(instances, self.simd);
        let bounds = world.bounds();
        let radius = 0.5 * bounds.0.distance(bounds.1);
        let mut deltas: Vec<DeltaLight> = self.lights.deltas.clone();
        for object in &self.objects {
            add_model_lights(object, times, &mut deltas);
        }
        let radius = if radius > 0.0 && radius.is_finite() { radius } else { 1.0 };
        let lights = Lights::new(self.lights.environment.clone(), emitters, deltas, radius);
        Ok(Frame {
            world,
            materials: self.materials.clone(),
            lights,
            media: Arc::clone(&self.media),
            camera: self.camera.over(times),
            time_seconds,
            shutter_seconds: times,
            objects,
            bounds,
            slots,
            names,
        })
    }

    /// Adds the primitives of an instance that shine.
    fn add_emitters(
        &self,
        object: &Object,
        geometry: &Geometry,
        pose: [Affine3A; 2],
        instance: u32,
        emitters: &mut Vec<Emitter>,
    ) {
        let material_of = |slot: u32| {
            let index = object.materials.get(slot as usize).or(object.materials.last()).copied().unwrap_or(0);
            &self.materials[index as usize]
        };
        let mut add = |shape: EmitterShape, slot: u32, primitive: u32| {
            let material = material_of(slot);
            if material.is_emissive() {
                emitters.push(Emitter { shape, pose, material: Arc::clone(material), instance, primitive });
            }
        };
        match (&object.form, geometry) {
            (Form::Rectangle, _) => add(EmitterShape::Rectangle, 0, 0),
            (Form::Disk, _) => add(EmitterShape::Disk, 0, 0),
            (_, Geometry::Spheres(tracer)) => {
                for (index, sphere) in tracer.spheres().iter().enumerate() {
                    let (center, radius) = (sphere.center, sphere.radius);
                    add(EmitterShape::Sphere { center, radius }, 0, index as u32);
                }
            }
            (_, Geometry::Mesh(tracer)) => {
                let mesh = tracer.mesh();
                for (index, triangle) in mesh.triangles.iter().enumerate() {
                    let corners = [0.0, 1.0].map(|time| tracer.corners(index as u32, time));
                    let [a, b, c] = corners[0];
                    if (b - a).cross(c - a) == Vec3::ZERO {
                        continue;
                    }
                    let uv = |vertex: u32| mesh.uvs.get(vertex as usize).copied().unwrap_or(Vec2::ZERO);
                    let uvs = triangle.map(uv);
                    add(EmitterShape::Triangle { corners, uvs }, mesh.material_slot(index), index as u32);
                }
            }
            (_, Geometry::HeightField(tracer)) if tracer.primitives() <= MOST_SHINING_FACETS => {
                for primitive in 0..tracer.primitives() as u32 {
                    let [open, close] = [0.0, 1.0].map(|time| tracer.corners(primitive, time));
                    let corners = [open.map(|(corner, _)| corner), close.map(|(corner, _)| corner)];
                    add(EmitterShape::Triangle { corners, uvs: open.map(|(_, uv)| uv) }, 0, primitive);
                }
            }
            // A larger height field is found by chance alone; the loader says so.
            _ => {}
        }
    }
}

/// Adds the lights that stand at nodes of a model. They shine along −z; scales do not change how strongly.
fn add_model_lights(object: &Object, times: [f64; 2], deltas: &mut Vec<DeltaLight>) {
    let Form::Model(model) = &object.form else { return };
    let moved = object.track.as_ref().map_or([Affine3A::IDENTITY; 2], |track| track.over(times));
    for (light, node) in model.lights(times) {
        let intensity = light.color * light.intensity;
        for place in &object.places {
            let pose = [0, 1].map(|end| moved[end] * *place * node[end]);
            let position = pose.map(|pose| Vec3::from(pose.translation));
            let towards = Vec3::from(pose[0].matrix3.z_axis).normalize_or(Vec3::Z);
            deltas.push(match light.kind {
                ModelLightKind::Point => DeltaLight::Point { position, intensity },
                ModelLightKind::Directional => DeltaLight::Directional { towards, irradiance: intensity },
                ModelLightKind::Spot { inner, outer } => DeltaLight::Spot {
                    position,
                    axis: -towards,
                    intensity,
                    cos_inner: inner.cos(),
                    cos_outer: outer.cos(),
                },
            });
        }
    }
}

/// Builds what all frames share of an object, so that many objects are built side by side.
fn prepare(object: &Object) {
    match &object.form {
        Form::Mesh(part) => drop(part.geometry()),
        Form::Model(model) => model.prepare(),
        Form::Spheres(spheres, tracer) => drop(still_spheres(spheres, tracer)),
        Form::Heights(HeightSource::Still(field), tracer) => drop(still_heights(field, tracer)),
        Form::MovingSpheres(_) | Form::Rectangle | Form::Disk | Form::Heights(..) | Form::Field(_) => {}
    }
}

fn still_spheres(spheres: &[(Vec3, f32)], tracer: &OnceLock<Arc<Geometry>>) -> Arc<Geometry> {
    Arc::clone(built_once(tracer, || Arc::new(geometry::spheres(spheres))))
}

fn still_heights(field: &Arc<HeightField>, tracer: &OnceLock<Arc<Geometry>>) -> Arc<Geometry> {
    Arc::clone(built_once(tracer, || Arc::new(geometry::height_field(Arc::clone(field)))))
}

/// The parts of an object over the shutter interval, in its own space.
fn parts(object: &Object, times: [f64; 2]) -> Result<Vec<Part>, SceneError> {
    let one = |geometry: Arc<Geometry>| vec![Part { geometry, transform: [Affine3A::IDENTITY; 2] }];
    Ok(match &object.form {
        Form::Mesh(part) => one(part.geometry()),
        Form::Model(model) => {
            let posed = model.pose(times).into_iter();
            posed.map(|p| Part { geometry: p.geometry, transform: p.transform }).collect()
        }
        Form::Spheres(spheres, tracer) => one(still_spheres(spheres, tracer)),
        // Each moves in its own way, and none of them while the shutter is open.
        Form::MovingSpheres(spheres) => one(Arc::new(geometry::spheres(&spheres.at(times[0])))),
        Form::Rectangle => one(Arc::new(geometry::rectangle())),
        Form::Disk => one(Arc::new(geometry::disk())),
        Form::Field(field) => one(field.geometry()),
        Form::Heights(HeightSource::Still(field), tracer) => one(still_heights(field, tracer)),
        Form::Heights(source, _) if times[0] == times[1] => {
            one(Arc::new(geometry::height_field(source.at(times[0])?)))
        }
        Form::Heights(source, _) => {
            one(Arc::new(geometry::moving_height_field(source.at(times[0])?, source.at(times[1])?)))
        }
    })
}
