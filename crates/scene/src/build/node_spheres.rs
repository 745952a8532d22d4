//! Spheres that move one by one: the nodes of a model.

use std::sync::Arc;

use glam::{Affine3A, Vec3};
use halflight_shape::Model;

/// The nodes of a model that have no children, each a sphere about its origin with its scale as radius.
pub(crate) struct NodeSpheres {
    model: Arc<Model>,
    /// The nodes that are spheres.
    nodes: Vec<usize>,
}

impl NodeSpheres {
    pub(crate) fn new(model: Arc<Model>) -> Self {
        let mut is_parent = vec![false; model.nodes.len()];
        for parent in model.nodes.iter().filter_map(|node| node.parent) {
            is_parent[parent] = true;
        }
        let nodes = (0..model.nodes.len()).filter(|&node| !is_parent[node]).collect();
        Self { model, nodes }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    pub(crate) fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Middles and radii at a time; a node that is scaled to nothing leaves a point that no ray meets.
    pub(crate) fn at(&self, time_seconds: f64) -> Vec<(Vec3, f32)> {
        let transforms = self.model.transforms(time_seconds as f32);
        let sphere = |place: &Affine3A| {
            let radius = place.matrix3.determinant().abs().cbrt();
            (Vec3::from(place.translation), radius.max(f32::MIN_POSITIVE))
        };
        self.nodes.iter().map(|&node| sphere(&transforms[node])).collect()
    }

    pub(crate) fn is_animated(&self) -> bool {
        self.model.is_animated()
    }

    /// Seconds until they come to rest.
    pub(crate) fn duration(&self) -> Option<f64> {
        self.model.duration().map(f64::from)
    }
}

#[cfg(test)]
mod tests {
    use halflight_shape::{ModelNode, Placement};

    use super::*;

    #[test]
    fn leaves_are_spheres_and_inner_nodes_only_move_them() {
        let placed = |translation, scale, parent| ModelNode {
            placement: Placement::Parts {
                translation,
                rotation: glam::Quat::IDENTITY,
                scale: Vec3::splat(scale),
            },
            parent,
            ..ModelNode::default()
        };
        let nodes =
            vec![placed(Vec3::X, 2.0, None), placed(Vec3::Y, 0.25, Some(0)), placed(Vec3::Z, 0.1, None)];
        let spheres = NodeSpheres::new(Arc::new(Model { nodes, ..Model::default() }));
        let at = spheres.at(0.0);
        assert_eq!(at.len(), 2);
        assert!(at[0].0.abs_diff_eq(Vec3::new(1.0, 2.0, 0.0), 1e-6) && (at[0].1 - 0.5).abs() < 1e-6);
        assert!(at[1].0.abs_diff_eq(Vec3::Z, 1e-6) && (at[1].1 - 0.1).abs() < 1e-6);
    }
}
