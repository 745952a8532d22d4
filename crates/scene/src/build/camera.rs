//! The camera of a scene, as a function of time.

use std::sync::Arc;

use glam::{Affine3A, Vec3};
use halflight_shape::Model;

use super::Builder;
use crate::camera::{Camera, FieldOfView};
use crate::framing::{self, Outline};
use crate::motion::rising;
use crate::schema::{At, Problem};
use crate::spec::CameraSpec;

/// Angle of view where none is given.
const DEFAULT_FOV_DEGREES: f32 = 40.0;

/// A camera that may move.
#[derive(Clone, Debug)]
pub(crate) struct CameraRig {
    pub(crate) placement: Placement,
    pub(crate) field_of_view: FieldOfView,
    pub(crate) aperture_radius: f32,
    /// Given by the scene, or the distance to what the camera looks at.
    pub(crate) focus_distance: Option<f32>,
    /// Distance of the plane of focus for placements without a target.
    pub(crate) subject_distance: f32,
    /// When the shutter opens and closes, relative to the time of the frame, in seconds.
    pub(crate) shutter: [f64; 2],
}

/// Where the camera stands.
#[derive(Clone, Debug)]
pub(crate) enum Placement {
    /// At points in time; between them along straight lines.
    LookAt { keys: Vec<(f64, Vec3, Vec3)>, up: Vec3 },
    /// By a rigid transform.
    Fixed(Affine3A),
    /// At a node of a model.
    Node(Arc<Model>, usize),
}

/// The lens that bare assets and scenes without a camera are seen through.
pub(crate) fn default_lens() -> FieldOfView {
    FieldOfView::Vertical(DEFAULT_FOV_DEGREES.to_radians())
}

/// A rigid transform that looks where another does: its scale and shear left out.
fn rigid(transform: &Affine3A) -> Affine3A {
    let origin = Vec3::from(transform.translation);
    let forward = -Vec3::from(transform.matrix3.z_axis).normalize_or(Vec3::Z);
    // The direction itself, not the difference of two points: far from the origin that would lose it.
    let rotation = Camera::look_at(Vec3::ZERO, forward, Vec3::from(transform.matrix3.y_axis));
    Affine3A { translation: origin.into(), ..rotation }
}

impl CameraRig {
    /// The camera over a shutter interval that begins and ends at these times.
    pub(crate) fn over(&self, times: [f64; 2]) -> Camera {
        let pose = times.map(|time| self.pose(time));
        let focus_distance = self.focus_distance.unwrap_or_else(|| match &self.placement {
            Placement::LookAt { keys, .. } => {
                let (origin, target) = look_points(keys, times[0]);
                origin.distance(target)
            }
            _ => self.subject_distance,
        });
        Camera {
            pose,
            field_of_view: self.field_of_view,
            aperture_radius: self.aperture_radius,
            focus_distance: if focus_distance > 0.0 && focus_distance.is_finite() {
                focus_distance
            } else {
                1.0
            },
        }
    }

    fn pose(&self, time: f64) -> Affine3A {
        match &self.placement {
            Placement::LookAt { keys, up } => {
                let (origin, target) = look_points(keys, time);
                Camera::look_at(origin, target, *up)
            }
            Placement::Fixed(pose) => *pose,
            Placement::Node(model, node) => {
                let duration = model.duration().map_or(0.0, f64::from);
                let time = if duration > 0.0 { time.rem_euclid(duration) } else { 0.0 };
                model.transforms(time as f32).get(*node).map_or(Affine3A::IDENTITY, rigid)
            }
        }
    }

    /// What is up for it, of length 1.
    pub(crate) fn up(&self) -> Vec3 {
        if let Placement::LookAt { up, .. } = &self.placement {
            return up.normalize_or(Vec3::Y);
        }
        let top = Vec3::from(self.pose(0.0).matrix3.y_axis);
        let axes = [Vec3::Y, Vec3::Z, Vec3::X, Vec3::NEG_Y, Vec3::NEG_Z, Vec3::NEG_X];
        axes.into_iter()
            .fold(Vec3::Y, |best, axis| if axis.dot(top) > best.dot(top) + 1e-3 { axis } else { best })
    }

    /// Whether the camera moves.
    pub(crate) fn moves(&self) -> bool {
        match &self.placement {
            Placement::LookAt { keys, .. } => keys.len() > 1,
            Placement::Fixed(_) => false,
            Placement::Node(model, _) => model.is_animated(),
        }
    }

    /// The time of its last keyframe.
    pub(crate) fn end(&self) -> Option<f64> {
        match &self.placement {
            Placement::LookAt { keys, .. } if keys.len() > 1 => keys.last().map(|key| key.0),
            _ => None,
        }
    }
}

/// Origin and target at a time.
fn look_points(keys: &[(f64, Vec3, Vec3)], time: f64) -> (Vec3, Vec3) {
    let after = keys.partition_point(|key| key.0 <= time);
    match (after.checked_sub(1).map(|i| keys[i]), keys.get(after).copied()) {
        (Some(a), Some(b)) => {
            let part = ((time - a.0) / (b.0 - a.0)) as f32;
            (a.1.lerp(b.1, part), a.2.lerp(b.2, part))
        }
        (Some(only), None) | (None, Some(only)) => (only.1, only.2),
        (None, None) => (Vec3::ZERO, Vec3::NEG_Z),
    }
}

impl Builder {
    /// The camera that a scene file asks for; what it leaves open is framed so that the outline fits.
    pub(crate) fn camera(
        &mut self,
        spec: Option<&CameraSpec>,
        outline: &Outline,
        size: [u32; 2],
    ) -> CameraRig {
        let aspect = size[0] as f32 / size[1] as f32;
        let Some(spec) = spec else {
            let (origin, target) = framing::frame(outline, default_lens(), aspect, None);
            return CameraRig {
                placement: Placement::LookAt { keys: vec![(0.0, origin, target)], up: Vec3::Y },
                field_of_view: default_lens(),
                aperture_radius: 0.0,
                focus_distance: None,
                subject_distance: 1.0,
                shutter: [0.0, 0.0],
            };
        };
        let field_of_view = match (&spec.vertical_fov_degrees, &spec.horizontal_fov_degrees) {
            (Some(_), Some(second)) => {
                let problem = Problem::new(&second.origin, "a camera has one angle of view, not two");
                self.reader.report(problem.help("the other follows from the size of the picture"));
                default_lens()
            }
            (Some(angle), None) => FieldOfView::Vertical(angle.value.to_radians()),
            (None, Some(angle)) => FieldOfView::Horizontal(angle.value.to_radians()),
            (None, None) => default_lens(),
        };
        let shutter = spec.shutter.value.map(f64::from);
        if shutter[1] < shutter[0] {
            let message = "a shutter cannot close before it opens";
            self.reader.report(
                Problem::new(&spec.shutter.origin, message).help("write [opens, closes], in seconds"),
            );
        }
        if spec.up.value == Vec3::ZERO {
            self.reader.report(Problem::new(&spec.up.origin, "`up` must have a length above 0"));
        }
        if let Err(problem) = rising(&spec.keyframes, |key| key.time) {
            self.reader.report(problem);
        }
        let placement = self.placement(spec, outline, field_of_view, aspect);
        let subject_distance = match &placement {
            Placement::Fixed(pose) => Vec3::from(pose.translation).distance(outline.center()),
            _ => 1.0,
        };
        CameraRig {
            placement,
            field_of_view,
            aperture_radius: spec.aperture_radius,
            focus_distance: spec.focus_distance,
            subject_distance,
            shutter,
        }
    }

    fn placement(
        &mut self,
        spec: &CameraSpec,
        outline: &Outline,
        lens: FieldOfView,
        aspect: f32,
    ) -> Placement {
        if let Some(transform) = &spec.transform {
            if spec.origin.is_some() || spec.target.is_some() || !spec.keyframes.is_empty() {
                let message = "a camera is placed by `transform`, or by `origin` and `target`, not by both";
                self.reader.report(Problem::new(&transform.origin, message));
            }
            return match transform.resolve() {
                Ok(transform) => Placement::Fixed(rigid(&transform)),
                Err(problem) => {
                    self.reader.report(problem);
                    Placement::Fixed(Affine3A::IDENTITY)
                }
            };
        }
        let given = |point: &Option<At<Vec3>>| point.as_ref().map(|at| at.value);
        let (origin, target) = match (given(&spec.origin), given(&spec.target)) {
            (Some(origin), Some(target)) => (origin, target),
            (Some(origin), None) => (origin, outline.center()),
            (None, target) => framing::frame(outline, lens, aspect, target),
        };
        let keys = if spec.keyframes.is_empty() {
            vec![(0.0, origin, target)]
        } else {
            let key = |key: &crate::spec::CameraKey| {
                (key.time, key.origin.unwrap_or(origin), key.target.unwrap_or(target))
            };
            spec.keyframes.iter().map(|at| key(&at.value)).collect()
        };
        if let Some(number) = keys.iter().position(|(_, origin, target)| origin == target) {
            let nowhere = crate::schema::Origin::nowhere();
            let mut points = [&spec.target, &spec.origin].into_iter().flatten().map(|at| &at.origin);
            let at = spec.keyframes.get(number).map(|key| &key.origin).or(points.next());
            let origin = keys[number].1;
            self.reader.report(Problem::new(
                at.unwrap_or(&nowhere),
                format!("the camera stands at {origin} and looks at the same point"),
            ));
        }
        Placement::LookAt { keys, up: spec.up.value }
    }
}
