//! The model at one time.

use std::sync::Arc;

use glam::{Affine3A, Vec3};

use super::animation::ModelProperty;
use super::{Model, ModelAnimation, ModelNode, Placement, deform};
use crate::TriangleMesh;

/// A mesh of a model at one time.
#[derive(Clone, Debug)]
pub struct PosedMesh {
    /// Its vertices at that time. Meshes that do not deform are shared, not copied.
    pub mesh: Arc<TriangleMesh>,
    /// From the mesh's frame to the model's. It may mirror, and where an animation scales to nothing it has
    /// no inverse.
    pub transform: Affine3A,
    /// The vertices depend on time. If not, at most the transform does.
    pub deforms: bool,
    /// The index of this entry, the same at every time, with the same triangles and attributes.
    pub source: usize,
    /// The node that draws it.
    pub node: usize,
}

impl Model {
    /// Whether anything moves.
    pub fn is_animated(&self) -> bool {
        self.playing().is_some()
    }

    /// How long the first animation lasts, in seconds; `None` if there is none.
    pub fn duration(&self) -> Option<f32> {
        self.playing().map(|animation| animation.duration)
    }

    /// The model at `time_seconds` of its first animation. The time is clamped to `[0, duration]`: an
    /// animation plays once and holds its ends, and whoever wants a loop takes the time modulo the duration.
    /// The list has the same entries in the same order at every time, with the same triangles.
    ///
    /// Meshes without skin or morph targets in use cost nothing but a shared pointer.
    pub fn pose(&self, time_seconds: f32) -> Vec<PosedMesh> {
        self.pose_in(self.playing(), time_seconds)
    }

    /// The model at `time_seconds` of any of its animations, or at rest if `animation` is `None`.
    pub fn pose_in(&self, animation: Option<&ModelAnimation>, time_seconds: f32) -> Vec<PosedMesh> {
        let transforms = self.transforms_in(animation, time_seconds);
        let mut posed = Vec::new();
        for (index, node) in self.nodes.iter().enumerate() {
            let morph_track = animation.and_then(|a| {
                a.channels.iter().find(|c| c.node == index && c.property == ModelProperty::MorphWeights)
            });
            for &mesh in &node.meshes {
                let mesh = &self.meshes[mesh];
                let skin = node.skin.zip(mesh.influences.as_ref());
                let mut weights = if node.morph_weights.is_empty() {
                    mesh.morph_weights.clone()
                } else {
                    node.morph_weights.clone()
                };
                weights.resize(mesh.morphs.len(), 0.0);
                if let Some(channel) = morph_track {
                    channel.track.sample(clamped(animation, time_seconds), &mut weights);
                }
                let morphs = weights.iter().any(|w| *w != 0.0);
                let shape = if morphs || skin.is_some() {
                    let mut shape = TriangleMesh::clone(&mesh.mesh);
                    deform::morph(&mut shape, &mesh.morphs, &weights);
                    if let Some((skin, influences)) = skin {
                        deform::skin(&mut shape, influences, &self.joint_matrices(skin, &transforms));
                    }
                    Arc::new(shape)
                } else {
                    mesh.mesh.clone()
                };
                posed.push(PosedMesh {
                    mesh: shape,
                    // A skinned mesh stands where its joints are, whatever its node says (glTF 2.0, §3.7.3.3).
                    transform: if skin.is_some() { Affine3A::IDENTITY } else { transforms[index] },
                    deforms: (animation.is_some() && skin.is_some())
                        || (morph_track.is_some() && !mesh.morphs.is_empty()),
                    source: posed.len(),
                    node: index,
                });
            }
        }
        posed
    }

    /// Where each node stands in the model's frame at `time_seconds` of the first animation. Cameras and
    /// lights stand at nodes.
    pub fn transforms(&self, time_seconds: f32) -> Vec<Affine3A> {
        self.transforms_in(self.playing(), time_seconds)
    }

    /// Least and greatest coordinates of all that is drawn at `time_seconds`; `None` if nothing is.
    pub fn bounds(&self, time_seconds: f32) -> Option<(Vec3, Vec3)> {
        let boxes = self.pose(time_seconds).into_iter().filter_map(|posed| {
            let (low, high) = posed.mesh.bounds()?;
            if posed.transform == Affine3A::IDENTITY {
                return Some((low, high));
            }
            // Over the vertices, not over the corners of the box, which a rotation would widen.
            let mut points = posed.mesh.triangles.iter().flatten().map(|&v| posed.mesh.positions[v as usize]);
            let first = posed.transform.transform_point3(points.next()?);
            Some(points.fold((first, first), |(low, high), p| {
                let p = posed.transform.transform_point3(p);
                (low.min(p), high.max(p))
            }))
        });
        boxes.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
    }

    fn playing(&self) -> Option<&ModelAnimation> {
        self.animations.iter().find(|animation| !animation.channels.is_empty())
    }

    fn transforms_in(&self, animation: Option<&ModelAnimation>, time_seconds: f32) -> Vec<Affine3A> {
        let time = clamped(animation, time_seconds);
        let mut placements: Vec<Placement> = self.nodes.iter().map(|node| node.placement).collect();
        for channel in animation.iter().flat_map(|a| &a.channels) {
            // A matrix cannot be animated in parts; glTF forbids it, and the loader has taken it apart.
            let Placement::Parts { translation, rotation, scale } = &mut placements[channel.node] else {
                continue;
            };
            match channel.property {
                ModelProperty::Translation => *translation = channel.track.vec3(time),
                ModelProperty::Rotation => *rotation = channel.track.quat(time),
                ModelProperty::Scale => *scale = channel.track.vec3(time),
                ModelProperty::MorphWeights => {}
            }
        }
        let mut transforms: Vec<Affine3A> = Vec::with_capacity(self.nodes.len());
        for (ModelNode { parent, .. }, placement) in self.nodes.iter().zip(&placements) {
            let local = placement.to_affine();
            let global = parent.map_or(local, |parent| transforms[parent] * local);
            // Nested scales can leave the finite numbers though each of them is finite.
            transforms.push(if global.is_finite() { global } else { Affine3A::IDENTITY });
        }
        transforms
    }

    fn joint_matrices(&self, skin: usize, transforms: &[Affine3A]) -> Vec<Affine3A> {
        let skin = &self.skins[skin];
        skin.joints.iter().zip(&skin.inverse_bind).map(|(&joint, bind)| transforms[joint] * *bind).collect()
    }
}

impl Placement {
    /// The transform from the node's frame to its parent's.
    pub fn to_affine(&self) -> Affine3A {
        match *self {
            Self::Parts { translation, rotation, scale } => {
                Affine3A::from_scale_rotation_translation(scale, rotation, translation)
            }
            Self::Matrix(matrix) => matrix,
        }
    }
}

/// `time` within the animation; NaN is its beginning.
fn clamped(animation: Option<&ModelAnimation>, time: f32) -> f32 {
    let end = animation.map_or(0.0, |a| a.duration);
    if time.is_nan() { 0.0 } else { time.clamp(0.0, end.max(0.0)) }
}

#[cfg(test)]
mod tests {
    use glam::Quat;

    use super::*;
    use crate::mesh::samples::octahedron;
    use crate::model::{Interpolation, ModelChannel, ModelMorph, ModelTrack};

    fn moving() -> Model {
        let mut model = Model::from_mesh("octahedron", octahedron());
        model.nodes.push(ModelNode { parent: Some(0), meshes: vec![0], ..ModelNode::default() });
        model.animations.push(ModelAnimation {
            channels: vec![ModelChannel {
                node: 0,
                property: ModelProperty::Translation,
                track: ModelTrack {
                    interpolation: Interpolation::Linear,
                    times: vec![0.0, 2.0],
                    width: 3,
                    values: vec![0.0, 0.0, 0.0, 4.0, 0.0, 0.0],
                },
            }],
            duration: 2.0,
            ..ModelAnimation::default()
        });
        model
    }

    #[test]
    fn a_mesh_alone_stands_still_and_is_shared() {
        let model = Model::from_mesh("octahedron", octahedron());
        assert!(!model.is_animated());
        assert_eq!(model.duration(), None);
        let (now, later) = (model.pose(0.0), model.pose(3.0));
        assert!(Arc::ptr_eq(&now[0].mesh, &later[0].mesh));
        assert!(!now[0].deforms);
        assert_eq!(model.bounds(1.0), Some((Vec3::NEG_ONE, Vec3::ONE)));
    }

    #[test]
    fn children_move_with_their_parents_and_time_is_clamped() {
        let model = moving();
        assert_eq!(model.duration(), Some(2.0));
        for (time, x) in [(-1.0, 0.0), (0.5, 1.0), (2.0, 4.0), (50.0, 4.0), (f32::NAN, 0.0)] {
            let posed = model.pose(time);
            assert_eq!(posed.len(), 2);
            assert_eq!(posed[1].transform.translation, Vec3::new(x, 0.0, 0.0).into(), "at {time}");
            assert!(!posed[1].deforms);
            assert!(Arc::ptr_eq(&posed[0].mesh, &posed[1].mesh));
        }
        assert_eq!(model.triangle_count(), 16);
    }

    #[test]
    fn bounds_follow_rotated_vertices_and_not_the_rotated_box() {
        let mut model = Model::from_mesh("octahedron", octahedron());
        model.nodes[0].placement = Placement::Parts {
            translation: Vec3::ZERO,
            rotation: Quat::from_rotation_y(std::f32::consts::FRAC_PI_4),
            scale: Vec3::ONE,
        };
        let (_, high) = model.bounds(0.0).expect("it has triangles");
        assert!((high.x - 0.5f32.sqrt()).abs() < 1e-6);
    }

    #[test]
    fn morph_weights_of_the_node_come_before_those_of_the_mesh() {
        let mut model = Model::from_mesh("octahedron", octahedron());
        model.meshes[0].morphs = vec![ModelMorph { positions: vec![Vec3::Y; 6], ..Default::default() }];
        model.meshes[0].morph_weights = vec![1.0];
        assert_eq!(model.pose(0.0)[0].mesh.positions[2].y, 2.0);
        model.nodes[0].morph_weights = vec![3.0];
        assert_eq!(model.pose(0.0)[0].mesh.positions[2].y, 4.0);
        assert!(!model.pose(0.0)[0].deforms);
    }

    #[test]
    fn transforms_stay_finite() {
        let mut model = moving();
        for node in &mut model.nodes {
            node.placement = Placement::Parts {
                translation: Vec3::ZERO,
                rotation: Quat::IDENTITY,
                scale: Vec3::splat(1e30),
            };
        }
        assert!(model.transforms(0.0).iter().all(|t| t.is_finite()));
    }
}
