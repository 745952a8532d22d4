//! Lights of scene files: those without extent, and shapes that shine.

use std::sync::{Arc, OnceLock};

use glam::{Affine3A, Mat3, Vec3};
use halflight_material::{ColorInput, Material, MaterialKind};

use super::{Builder, Form, Object};
use crate::lights::{DeltaLight, Environment};
use crate::schema::{At, Problem};
use crate::spec::{LightKind, LightSpec};

/// The lights of a scene that are no shapes.
#[derive(Clone, Debug, Default)]
pub(crate) struct LightRig {
    pub(crate) environment: Option<Environment>,
    pub(crate) deltas: Vec<DeltaLight>,
}

impl Builder {
    /// Builds every `[[light]]`: lights without extent, and objects for those with one.
    pub(crate) fn lights(&mut self, lights: &[At<LightSpec>]) -> (Vec<DeltaLight>, Vec<Object>) {
        let (mut deltas, mut objects) = (Vec::new(), Vec::new());
        for (index, light) in lights.iter().enumerate() {
            let name = light
                .common
                .name
                .as_ref()
                .map_or_else(|| format!("light {}", index + 1), |n| n.value.clone());
            let (form, place, radiance, two_sided) = match &light.kind {
                LightKind::Point(point) => {
                    deltas.push(DeltaLight::Point {
                        position: [point.position; 2],
                        intensity: point.intensity.0,
                    });
                    continue;
                }
                LightKind::Directional(sun) => {
                    match sun.direction.try_normalize() {
                        Some(direction) => deltas.push(DeltaLight::Directional {
                            towards: -direction,
                            irradiance: sun.irradiance.0,
                        }),
                        None => self
                            .reader
                            .report(Problem::new(&sun.direction.origin, "this direction points nowhere")),
                    }
                    continue;
                }
                LightKind::Rectangle(s) => {
                    let scale = Vec3::new(0.5 * s.size.x, 0.5 * s.size.y, 1.0);
                    (
                        Form::Rectangle,
                        self.facing(s.position, &s.target) * Affine3A::from_scale(scale),
                        &s.radiance,
                        s.two_sided,
                    )
                }
                LightKind::Disk(s) => {
                    let scale = Vec3::new(s.radius, s.radius, 1.0);
                    (
                        Form::Disk,
                        self.facing(s.position, &s.target) * Affine3A::from_scale(scale),
                        &s.radiance,
                        s.two_sided,
                    )
                }
                LightKind::Sphere(s) => (
                    Form::Spheres(vec![(s.position, s.radius)], OnceLock::new()),
                    Affine3A::IDENTITY,
                    &s.radiance,
                    false,
                ),
            };
            let emission: ColorInput = self.color(radiance);
            let material = Material {
                name: name.clone(),
                kind: MaterialKind::Black,
                emission: Some(emission),
                two_sided,
                normal_map: None,
                opacity: None,
            };
            let materials: Arc<[u32]> = Arc::from([self.add_material(material)]);
            objects.push(Object { name, form, materials, places: vec![place], track: None, ground: true });
        }
        (deltas, objects)
    }

    /// From a space whose +z faces `target` from `position` to the world; its x axis is level.
    fn facing(&mut self, position: Vec3, target: &At<Vec3>) -> Affine3A {
        let Some(z) = (target.value - position).try_normalize() else {
            self.reader.report(Problem::new(&target.origin, "a light cannot face the point where it stands"));
            return Affine3A::IDENTITY;
        };
        let x = Vec3::Y.cross(z).try_normalize().unwrap_or(Vec3::X);
        Affine3A::from_mat3_translation(Mat3::from_cols(x, z.cross(x), z), position)
    }
}
