//! Writes binary glTF: just what the demo models need.

use std::path::Path;

use glam::{Quat, Vec3};
use halflight_shape::TriangleMesh;
use serde_json::{Value, json};

/// A joint or a place in the hierarchy, and how it moves.
#[derive(Clone, Debug, Default)]
pub(crate) struct Node {
    pub(crate) name: String,
    pub(crate) parent: Option<usize>,
    /// Where it stands in its parent at rest.
    pub(crate) rest: Vec3,
    pub(crate) scale: Option<f32>,
    /// Keys in time; empty where it does not move so.
    pub(crate) translations: Vec<Vec3>,
    pub(crate) rotations: Vec<Quat>,
}

/// A mesh whose vertices follow the nodes.
pub(crate) struct Skinned {
    pub(crate) mesh: TriangleMesh,
    /// Two nodes for each vertex, and the weight of the first.
    pub(crate) joints: Vec<([u8; 2], f32)>,
}

/// What a file holds.
pub(crate) struct Scene {
    pub(crate) nodes: Vec<Node>,
    /// Seconds between keys.
    pub(crate) interval: f32,
    pub(crate) body: Body,
}

/// What is drawn.
pub(crate) enum Body {
    Skin(Skinned),
    /// The same mesh at every node.
    Everywhere(TriangleMesh),
}

/// Parts of the file that are still growing.
#[derive(Default)]
struct Writer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Writer {
    /// Numbers of `width` components each; returns the accessor.
    fn floats(&mut self, kind: &str, width: usize, values: &[f32], bounds: bool) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let view = self.view(&bytes);
        let count = values.len() / width;
        let mut accessor = json!({ "bufferView": view, "componentType": 5126, "count": count, "type": kind });
        if bounds {
            let fold = |start: f32, pick: fn(f32, f32) -> f32| -> Vec<f32> {
                (0..width)
                    .map(|c| values.iter().skip(c).step_by(width).fold(start, |a, &b| pick(a, b)))
                    .collect()
            };
            accessor["min"] = json!(fold(f32::INFINITY, f32::min));
            accessor["max"] = json!(fold(f32::NEG_INFINITY, f32::max));
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn indices(&mut self, values: &[u16]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let view = self.view(&bytes);
        let count = values.len();
        self.accessors
            .push(json!({ "bufferView": view, "componentType": 5123, "count": count, "type": "SCALAR" }));
        self.accessors.len() - 1
    }

    /// Four bytes each, as numbers from 0 to 255 or from 0 to 1.
    fn bytes_of_four(&mut self, values: &[u8], normalized: bool) -> usize {
        let view = self.view(values);
        let count = values.len() / 4;
        self.accessors.push(json!({
            "bufferView": view, "componentType": 5121, "count": count, "type": "VEC4", "normalized": normalized
        }));
        self.accessors.len() - 1
    }

    fn view(&mut self, bytes: &[u8]) -> usize {
        let offset = self.bytes.len();
        self.bytes.extend_from_slice(bytes);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.push(json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() }));
        self.views.len() - 1
    }

    fn mesh(&mut self, mesh: &TriangleMesh) -> Value {
        let flat = |list: &[Vec3]| list.iter().flat_map(|v| v.to_array()).collect::<Vec<f32>>();
        let position = self.floats("VEC3", 3, &flat(&mesh.positions), true);
        let normal = self.floats("VEC3", 3, &flat(&mesh.normals), false);
        let indices: Vec<u16> = mesh.triangles.iter().flatten().map(|&v| v as u16).collect();
        let indices = self.indices(&indices);
        json!({ "attributes": { "POSITION": position, "NORMAL": normal }, "indices": indices })
    }
}

/// Writes a file.
pub(crate) fn write(path: &Path, scene: &Scene) -> std::io::Result<()> {
    let mut file = Writer::default();
    let mut nodes: Vec<Value> = scene
        .nodes
        .iter()
        .enumerate()
        .map(|(index, node)| {
            let mut value = json!({ "name": node.name, "translation": node.rest.to_array() });
            let children: Vec<usize> =
                (0..scene.nodes.len()).filter(|&c| scene.nodes[c].parent == Some(index)).collect();
            if !children.is_empty() {
                value["children"] = json!(children);
            }
            if let Some(scale) = node.scale {
                value["scale"] = json!([scale, scale, scale]);
            }
            value
        })
        .collect();
    let mut roots: Vec<usize> = (0..nodes.len()).filter(|&i| scene.nodes[i].parent.is_none()).collect();
    let mut root =
        json!({ "asset": { "version": "2.0", "generator": "halflight, demo_models" }, "scene": 0 });
    match &scene.body {
        Body::Skin(skinned) => {
            let mut primitive = file.mesh(&skinned.mesh);
            let joints: Vec<u8> = skinned.joints.iter().flat_map(|([a, b], _)| [*a, *b, 0, 0]).collect();
            let share = |w: f32| (255.0 * w).round() as u8;
            let weights: Vec<u8> =
                skinned.joints.iter().flat_map(|(_, w)| [share(*w), 255 - share(*w), 0, 0]).collect();
            primitive["attributes"]["JOINTS_0"] = json!(file.bytes_of_four(&joints, false));
            primitive["attributes"]["WEIGHTS_0"] = json!(file.bytes_of_four(&weights, true));
            let inverse: Vec<f32> = (0..nodes.len())
                .flat_map(|node| {
                    let at = -at_rest(&scene.nodes, node);
                    glam::Mat4::from_translation(at).to_cols_array()
                })
                .collect();
            let inverse = file.floats("MAT4", 16, &inverse, false);
            let joints: Vec<usize> = (0..nodes.len()).collect();
            root["meshes"] = json!([{ "name": "body", "primitives": [primitive] }]);
            root["skins"] = json!([{ "joints": joints, "inverseBindMatrices": inverse }]);
            roots.push(nodes.len());
            nodes.push(json!({ "name": "body", "mesh": 0, "skin": 0 }));
        }
        Body::Everywhere(mesh) => {
            let primitive = file.mesh(mesh);
            root["meshes"] = json!([{ "name": "sphere", "primitives": [primitive] }]);
            nodes.iter_mut().for_each(|node| node["mesh"] = json!(0));
        }
    }
    root["scenes"] = json!([{ "nodes": roots }]);
    root["nodes"] = json!(nodes);
    root["animations"] = json!([animation(scene, &mut file)]);
    root["buffers"] = json!([{ "byteLength": file.bytes.len() }]);
    root["bufferViews"] = json!(file.views);
    root["accessors"] = json!(file.accessors);
    std::fs::write(path, pack(&root.to_string(), &file.bytes))
}

fn animation(scene: &Scene, file: &mut Writer) -> Value {
    let (mut samplers, mut channels) = (Vec::new(), Vec::new());
    let mut times: Vec<(usize, usize)> = Vec::new();
    for (index, node) in scene.nodes.iter().enumerate() {
        let translations: Vec<f32> = node.translations.iter().flat_map(|v| v.to_array()).collect();
        let rotations: Vec<f32> = node.rotations.iter().flat_map(|q| q.to_array()).collect();
        for (path, kind, width, values) in
            [("translation", "VEC3", 3, translations), ("rotation", "VEC4", 4, rotations)]
        {
            if values.is_empty() {
                continue;
            }
            let count = values.len() / width;
            let input = match times.iter().find(|(keys, _)| *keys == count) {
                Some((_, accessor)) => *accessor,
                None => {
                    let list: Vec<f32> = (0..count).map(|i| i as f32 * scene.interval).collect();
                    let accessor = file.floats("SCALAR", 1, &list, true);
                    times.push((count, accessor));
                    accessor
                }
            };
            let output = file.floats(kind, width, &values, false);
            channels.push(json!({ "sampler": samplers.len(), "target": { "node": index, "path": path } }));
            samplers.push(json!({ "input": input, "output": output }));
        }
    }
    json!({ "name": "motion", "samplers": samplers, "channels": channels })
}

/// Where a node stands in the model at rest.
pub(crate) fn at_rest(nodes: &[Node], node: usize) -> Vec3 {
    nodes[node].rest + nodes[node].parent.map_or(Vec3::ZERO, |parent| at_rest(nodes, parent))
}

/// The two chunks of a binary file.
fn pack(json: &str, binary: &[u8]) -> Vec<u8> {
    let mut text = json.as_bytes().to_vec();
    text.resize(text.len().next_multiple_of(4), b' ');
    let total = 12 + 8 + text.len() + 8 + binary.len();
    let mut file = b"glTF".to_vec();
    file.extend(2u32.to_le_bytes());
    file.extend((total as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", text.as_slice()), (b"BIN\0", binary)] {
        file.extend((chunk.len() as u32).to_le_bytes());
        file.extend(kind);
        file.extend(chunk);
    }
    file
}
