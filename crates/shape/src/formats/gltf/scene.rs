//! Nodes, skins, cameras and lights.

use std::collections::BTreeMap;

use glam::{Affine3A, Mat4, Quat, Vec3};
use halflight_file::LoadError;

use super::accessor::Document;
use super::json::Node;
use super::material::Materials;
use super::mesh;
use crate::mesh::MAX_COORDINATE;
use crate::model::{
    Model, ModelCamera, ModelLight, ModelLightKind, ModelMesh, ModelNode, ModelSkin, Placement,
};

/// The file's nodes in the order of the model's: parents before children.
pub(super) struct Order {
    /// The file's index of each of the model's nodes.
    pub(super) nodes: Vec<usize>,
    /// The model's index of each of the file's nodes.
    pub(super) new_index: Vec<usize>,
    parents: Vec<Option<usize>>,
}

/// Orders the nodes. All nodes are kept, also those outside the scene that is shown: skins may refer to them.
pub(super) fn order(file: &Document) -> Result<Order, LoadError> {
    let nodes = &file.root.nodes;
    let mut parents = vec![None; nodes.len()];
    for (index, node) in nodes.iter().enumerate() {
        for &child in &node.children {
            file.get(nodes, child, "node", &format!("node {index}"))?;
            if let Some(other) = parents[child].replace(index) {
                return Err(
                    file.error(format!("node {child} is a child of node {other} and again of node {index}"))
                );
            }
        }
    }
    let mut order = Vec::with_capacity(nodes.len());
    let mut stack: Vec<usize> = (0..nodes.len()).rev().filter(|&index| parents[index].is_none()).collect();
    while let Some(index) = stack.pop() {
        order.push(index);
        stack.extend(nodes[index].children.iter().rev());
    }
    let mut new_index = vec![usize::MAX; nodes.len()];
    order.iter().enumerate().for_each(|(new, old)| new_index[*old] = new);
    // Each node has at most one parent, so that what no root leads to goes round in a circle.
    match new_index.iter().position(|index| *index == usize::MAX) {
        Some(node) => Err(file.error(format!("node {node} is its own descendant: the nodes form a cycle"))),
        None => Ok(Order { nodes: order, new_index, parents }),
    }
}

/// Fills in nodes, meshes and skins.
pub(super) fn read(
    model: &mut Model,
    order: &Order,
    materials: &mut Materials,
    file: &Document,
) -> Result<(), LoadError> {
    let shown = shown_nodes(file)?;
    let mut meshes: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (new, &old) in order.nodes.iter().enumerate() {
        let node = &file.root.nodes[old];
        let who = node_name(node, old);
        let mut converted = ModelNode {
            name: node.name.clone(),
            parent: order.parents[old].map(|parent| order.new_index[parent]),
            placement: placement(node, &who, file)?,
            ..ModelNode::default()
        };
        if let Some(mesh) = node.mesh.filter(|_| shown[old]) {
            if let std::collections::btree_map::Entry::Vacant(entry) = meshes.entry(mesh) {
                let source = file.get(&file.root.meshes, mesh, "mesh", &who)?;
                let first = model.meshes.len();
                model.meshes.extend(mesh::read(mesh, source, materials, file)?);
                entry.insert((first..model.meshes.len()).collect());
            }
            converted.meshes = meshes[&mesh].clone();
            if node.weights.iter().any(|weight| !weight.is_finite()) {
                return Err(file.error(format!("{who}: a weight of its morph targets is not finite")));
            }
            converted.morph_weights = node.weights.clone();
            if let Some(skin) = node.skin {
                file.get(&file.root.skins, skin, "skin", &who)?;
                converted.skin = Some(skin);
                for &mesh in &converted.meshes {
                    check_joints(&model.meshes[mesh], file.root.skins[skin].joints.len(), &who, file)?;
                }
            }
        }
        if shown[old] {
            read_camera(model, node, new, &who, file)?;
            read_light(model, node, new, &who, file)?;
        }
        model.nodes.push(converted);
    }
    for index in 0..file.root.skins.len() {
        model.skins.push(read_skin(index, order, file)?);
    }
    Ok(())
}

/// Which of the file's nodes belong to the scene that is shown: the default one, else the first, else all.
fn shown_nodes(file: &Document) -> Result<Vec<bool>, LoadError> {
    let root = file.root;
    let scene = match root.scene {
        Some(index) => Some(file.get(&root.scenes, index, "scene", "the file")?),
        None => root.scenes.first(),
    };
    let Some(scene) = scene else { return Ok(vec![true; root.nodes.len()]) };
    let mut shown = vec![false; root.nodes.len()];
    let mut stack = Vec::new();
    for &node in &scene.nodes {
        file.get(&root.nodes, node, "node", "the scene")?;
        stack.push(node);
    }
    while let Some(node) = stack.pop() {
        // A scene may name a node twice.
        if !std::mem::replace(&mut shown[node], true) {
            stack.extend(&root.nodes[node].children);
        }
    }
    Ok(shown)
}

fn node_name(node: &Node, index: usize) -> String {
    if node.name.is_empty() { format!("node {index}") } else { format!("node {index} ({})", node.name) }
}

fn placement(node: &Node, who: &str, file: &Document) -> Result<Placement, LoadError> {
    let bounded = |values: &[f32]| values.iter().all(|v| v.abs() <= MAX_COORDINATE);
    let wrong =
        || file.error(format!("{who}: its transform is not finite, or further out than {MAX_COORDINATE:e}"));
    if let Some(matrix) = &node.matrix {
        if !bounded(matrix) {
            return Err(wrong());
        }
        return Ok(Placement::Matrix(affine(matrix)));
    }
    let translation = node.translation.unwrap_or([0.0; 3]);
    let rotation = node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]);
    let scale = node.scale.unwrap_or([1.0; 3]);
    if !bounded(&translation) || !bounded(&rotation) || !bounded(&scale) {
        return Err(wrong());
    }
    let rotation = Quat::from_array(rotation);
    Ok(Placement::Parts {
        translation: translation.into(),
        rotation: if rotation.length_squared() > 0.0 { rotation.normalize() } else { Quat::IDENTITY },
        scale: scale.into(),
    })
}

/// The last row of a transform is 0 0 0 1, and is not looked at.
fn affine(columns: &[f32; 16]) -> Affine3A {
    Affine3A::from_mat4(Mat4::from_cols_array(columns))
}

fn check_joints(mesh: &ModelMesh, joints: usize, who: &str, file: &Document) -> Result<(), LoadError> {
    let influences = mesh.influences.iter().flat_map(|i| &i.joints).flatten().flatten();
    match influences.max() {
        Some(&largest) if usize::from(largest) >= joints => {
            Err(file
                .error(format!("{who}: its mesh follows joint {largest}, but its skin has {joints} joints")))
        }
        _ => Ok(()),
    }
}

fn read_skin(index: usize, order: &Order, file: &Document) -> Result<ModelSkin, LoadError> {
    let skin = &file.root.skins[index];
    let who = format!("skin {index}");
    let mut joints = Vec::with_capacity(skin.joints.len());
    for &joint in &skin.joints {
        joints.push(*file.get(&order.new_index, joint, "node", &who)?);
    }
    let inverse_bind: Vec<Affine3A> = match skin.inverse_bind_matrices {
        Some(accessor) => file.floats::<16>(accessor, &who)?.iter().map(affine).collect(),
        None => vec![Affine3A::IDENTITY; joints.len()],
    };
    if inverse_bind.len() < joints.len() {
        let found =
            format!("{who} has {} joints, but {} inverse bind matrices", joints.len(), inverse_bind.len());
        return Err(file.error(found));
    }
    Ok(ModelSkin { name: skin.name.clone(), joints, inverse_bind })
}

fn read_camera(
    model: &mut Model,
    node: &Node,
    new: usize,
    who: &str,
    file: &Document,
) -> Result<(), LoadError> {
    let Some(index) = node.camera else { return Ok(()) };
    let camera = file.get(&file.root.cameras, index, "camera", who)?;
    let name = if camera.name.is_empty() { node.name.clone() } else { camera.name.clone() };
    match &camera.perspective {
        Some(lens) if lens.yfov > 0.0 && lens.yfov < std::f32::consts::PI => {
            model.cameras.push(ModelCamera {
                name,
                node: new,
                vertical_fov: lens.yfov,
                aspect: lens.aspect_ratio.filter(|aspect| aspect.is_finite() && *aspect > 0.0),
                near: if lens.znear.is_finite() { lens.znear.max(0.0) } else { 0.0 },
            })
        }
        Some(lens) => {
            let found = format!("camera {index} has a vertical angle of view of {} radians", lens.yfov);
            return Err(file.error(found).hint("it must lie between 0 and π"));
        }
        None => model.warnings.push(format!("camera {index} ({name}) is orthographic and was left out")),
    }
    Ok(())
}

fn read_light(
    model: &mut Model,
    node: &Node,
    new: usize,
    who: &str,
    file: &Document,
) -> Result<(), LoadError> {
    let Some(reference) = &node.extensions.light else { return Ok(()) };
    let light = file.get(&file.root.extensions.lights.lights, reference.light, "light", who)?;
    let name = if light.name.is_empty() { node.name.clone() } else { light.name.clone() };
    let kind = match light.kind.as_str() {
        "directional" => ModelLightKind::Directional,
        "point" => ModelLightKind::Point,
        "spot" => {
            let outer = light.spot.outer_cone_angle.unwrap_or(std::f32::consts::FRAC_PI_4);
            let outer = outer.clamp(0.0, std::f32::consts::FRAC_PI_2);
            ModelLightKind::Spot { inner: light.spot.inner_cone_angle.clamp(0.0, outer), outer }
        }
        other => {
            return Err(file.error(format!(
                "light {} is of the unknown kind `{}`",
                reference.light,
                other.escape_debug()
            )));
        }
    };
    let color = Vec3::from(light.color.unwrap_or([1.0; 3])).max(Vec3::ZERO);
    let intensity = light.intensity.unwrap_or(1.0).max(0.0);
    if !color.is_finite() || !intensity.is_finite() {
        return Err(file.error(format!("light {} has a brightness that is not finite", reference.light)));
    }
    model.lights.push(ModelLight { name, node: new, kind, color, intensity });
    Ok(())
}
