//! The animated models at hand, against a slow reference in f64 that reads the files on its own.

use std::cell::RefCell;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use glam::{DMat4, DQuat, DVec3, DVec4};
use halflight_shape::load_model;
use serde_json::Value;

fn data(name: &str) -> Option<PathBuf> {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/animated")).join(name);
    if !path.exists() {
        eprintln!("skipped: {} is not there", path.display());
        return None;
    }
    Some(path)
}

/// A `.glb` read by the shortest way: no checks, all in f64.
struct Reference {
    json: Value,
    binary: Vec<u8>,
    /// Accessors that were read before.
    known: RefCell<HashMap<u64, Rc<Vec<f64>>>>,
}

impl Reference {
    fn read(path: &Path) -> Self {
        let bytes = std::fs::read(path).expect("it is there");
        let length = u32::from_le_bytes(bytes[12..16].try_into().expect("four bytes")) as usize;
        Self {
            json: serde_json::from_slice(&bytes[20..20 + length]).expect("JSON"),
            binary: bytes[20 + length + 8..].to_vec(),
            known: RefCell::default(),
        }
    }

    fn index(value: &Value, key: &str) -> usize {
        value[key].as_u64().unwrap_or(0) as usize
    }

    /// An accessor as a flat list.
    fn numbers(&self, accessor: &Value) -> Rc<Vec<f64>> {
        let index = accessor.as_u64().expect("an index");
        if let Some(known) = self.known.borrow().get(&index) {
            return known.clone();
        }
        let numbers = Rc::new(self.read_accessor(index));
        self.known.borrow_mut().insert(index, numbers.clone());
        numbers
    }

    fn read_accessor(&self, index: u64) -> Vec<f64> {
        let accessor = &self.json["accessors"][index as usize];
        let view = &self.json["bufferViews"][Self::index(accessor, "bufferView")];
        let width = match accessor["type"].as_str().expect("a type") {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 16,
        };
        let size = match Self::index(accessor, "componentType") {
            5121 => 1,
            5123 => 2,
            _ => 4,
        };
        let start = Self::index(view, "byteOffset") + Self::index(accessor, "byteOffset");
        let stride = view["byteStride"].as_u64().map_or(width * size, |s| s as usize);
        let read = |at: usize| {
            let b = &self.binary[at..];
            match Self::index(accessor, "componentType") {
                5121 => f64::from(b[0]),
                5123 => f64::from(u16::from_le_bytes([b[0], b[1]])),
                5126 => f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])),
                other => panic!("component type {other}"),
            }
        };
        (0..Self::index(accessor, "count"))
            .flat_map(|i| (0..width).map(move |k| (i, k)))
            .map(|(i, k)| read(start + i * stride + k * size))
            .collect()
    }

    /// The value of a channel at a time, if the node has one: linear interpolation only.
    fn animated(&self, node: usize, path: &str, time: f64) -> Option<Vec<f64>> {
        let animation = &self.json["animations"][0];
        let channel = animation["channels"].as_array()?.iter().find(|c| {
            c["target"]["node"].as_u64() == Some(node as u64) && c["target"]["path"].as_str() == Some(path)
        })?;
        let sampler = &animation["samplers"][Self::index(channel, "sampler")];
        let (times, values) = (self.numbers(&sampler["input"]), self.numbers(&sampler["output"]));
        let width = values.len() / times.len();
        let row = |key: usize| values[key * width..(key + 1) * width].to_vec();
        let next = times.iter().position(|t| *t > time).unwrap_or(times.len());
        if next == 0 || next == times.len() {
            return Some(row(next.saturating_sub(1)));
        }
        let s = (time - times[next - 1]) / (times[next] - times[next - 1]);
        let (mut from, mut to) = (row(next - 1), row(next));
        if path == "rotation" {
            let quat = |v: &[f64]| DQuat::from_xyzw(v[0], v[1], v[2], v[3]);
            return Some(quat(&from).slerp(quat(&to), s).to_array().to_vec());
        }
        from.iter_mut().zip(&mut to).for_each(|(a, b)| *a = (1.0 - s) * *a + s * *b);
        Some(from)
    }

    fn local(&self, node: usize, time: f64) -> DMat4 {
        let json = &self.json["nodes"][node];
        let list = |key: &str| -> Option<Vec<f64>> {
            Some(json[key].as_array()?.iter().map(|v| v.as_f64().expect("a number")).collect())
        };
        if let Some(m) = list("matrix") {
            return DMat4::from_cols_array(&m.try_into().expect("sixteen"));
        }
        let part = |key: &str| self.animated(node, key, time).or_else(|| list(key));
        let scale = part("scale").map_or(DVec3::ONE, |v| DVec3::from_slice(&v));
        let turn = part("rotation").map_or(DQuat::IDENTITY, |v| DQuat::from_slice(&v).normalize());
        let shift = part("translation").map_or(DVec3::ZERO, |v| DVec3::from_slice(&v));
        DMat4::from_scale_rotation_translation(scale, turn, shift)
    }

    fn global(&self, node: usize, time: f64) -> DMat4 {
        let parent = self.json["nodes"].as_array().expect("nodes").iter().position(|n| {
            n["children"].as_array().is_some_and(|c| c.iter().any(|c| c.as_u64() == Some(node as u64)))
        });
        parent.map_or(DMat4::IDENTITY, |parent| self.global(parent, time)) * self.local(node, time)
    }

    /// World positions of a primitive's vertices.
    fn world(&self, node: usize, primitive: &Value, time: f64) -> Vec<DVec3> {
        let attributes = &primitive["attributes"];
        let mut positions: Vec<DVec3> =
            self.numbers(&attributes["POSITION"]).chunks(3).map(DVec3::from_slice).collect();
        let weights = self.animated(node, "weights", time).unwrap_or_default();
        for (target, weight) in primitive["targets"].as_array().into_iter().flatten().zip(weights) {
            for (p, d) in positions.iter_mut().zip(self.numbers(&target["POSITION"]).chunks(3)) {
                *p += weight * DVec3::from_slice(d);
            }
        }
        let Some(skin) = self.json["nodes"][node]["skin"].as_u64() else {
            let global = self.global(node, time);
            return positions.into_iter().map(|p| global.transform_point3(p)).collect();
        };
        let skin = &self.json["skins"][skin as usize];
        let binds = self.numbers(&skin["inverseBindMatrices"]);
        let joints: Vec<DMat4> = skin["joints"]
            .as_array()
            .expect("joints")
            .iter()
            .zip(binds.chunks(16))
            .map(|(joint, bind)| {
                let bind = DMat4::from_cols_array(&bind.to_vec().try_into().expect("sixteen"));
                self.global(joint.as_u64().expect("an index") as usize, time) * bind
            })
            .collect();
        let (followed, weights) =
            (self.numbers(&attributes["JOINTS_0"]), self.numbers(&attributes["WEIGHTS_0"]));
        let skinned = |(i, p): (usize, DVec3)| {
            let w = DVec4::from_slice(&weights[4 * i..]);
            let w = w / w.element_sum();
            (0..4).map(|k| w[k] * joints[followed[4 * i + k] as usize].transform_point3(p)).sum()
        };
        positions.into_iter().enumerate().map(skinned).collect()
    }
}

#[test]
fn posed_vertices_agree_with_the_reference_at_every_time() {
    for (name, times) in [
        ("CesiumMan.glb", &[0.0, 0.7, 1.9, 5.0][..]),
        ("BrainStem.glb", &[0.0, 11.3]),
        ("RiggedFigure.glb", &[0.4]),
        ("RiggedSimple.glb", &[0.0, 1.3]),
        ("AnimatedMorphCube.glb", &[0.0, 0.9, 2.5]),
        ("AnimatedMorphSphere.glb", &[1.1]),
    ] {
        let Some(path) = data(name) else { return };
        let model = load_model(&path).expect(name);
        let reference = Reference::read(&path);
        for &time in times {
            let mut posed = model.pose(time).into_iter();
            let mut worst = 0f64;
            for (node, json) in reference.json["nodes"].as_array().expect("nodes").iter().enumerate() {
                let Some(mesh) = json["mesh"].as_u64() else { continue };
                let mesh = &reference.json["meshes"][mesh as usize];
                for primitive in mesh["primitives"].as_array().expect("primitives") {
                    let ours = posed.next().expect("as many meshes");
                    assert!(ours.deforms, "{name}");
                    let theirs = reference.world(node, primitive, f64::from(time));
                    assert_eq!(ours.mesh.positions.len(), theirs.len(), "{name}");
                    for (p, q) in ours.mesh.positions.iter().zip(&theirs) {
                        let p = ours.transform.transform_point3(*p).as_dvec3();
                        worst = worst.max(p.distance(*q));
                    }
                }
            }
            assert!(posed.next().is_none());
            let (low, high) = model.bounds(time).expect("it has triangles");
            let size = f64::from((high - low).length());
            assert!(worst < 2e-6 * size, "{name} at {time}: {worst} of {size}");
        }
    }
}

#[test]
fn the_models_have_the_triangles_and_seconds_their_list_says() {
    for (name, triangles, seconds) in [
        ("CesiumMan.glb", 4_672, 2.0),
        ("BrainStem.glb", 61_666, 34.9),
        ("RiggedFigure.glb", 256, 1.25),
        ("RiggedSimple.glb", 188, 2.1),
        ("AnimatedMorphCube.glb", 12, 4.2),
        ("AnimatedMorphSphere.glb", 960, 7.2),
    ] {
        let Some(path) = data(name) else { return };
        let model = load_model(&path).expect(name);
        assert_eq!(model.triangle_count(), triangles, "{name}");
        assert!(model.is_animated());
        assert!(
            (model.duration().expect("animated") - seconds).abs() < 0.06,
            "{name}: {:?}",
            model.duration()
        );
        assert!(model.warnings.iter().all(|w| w.contains("no area")), "{name}: {:?}", model.warnings);
        let (first, later) = (model.pose(0.0), model.pose(0.5));
        for (a, b) in first.iter().zip(&later) {
            assert_eq!((a.source, &a.mesh.triangles), (b.source, &b.mesh.triangles));
            assert!(a.mesh.positions != b.mesh.positions || first.len() > 1, "{name} does not move");
        }
    }
}

#[test]
fn the_walking_man_has_his_texture() {
    let Some(path) = data("CesiumMan.glb") else { return };
    let model = load_model(&path).expect("it loads");
    let texture = model.materials[0].base_color_texture.as_ref().expect("a texture");
    let halflight_shape::ModelImage::Encoded { bytes, .. } = &model.images[texture.image] else {
        panic!("it is inside the file")
    };
    assert!(bytes.starts_with(&[0xff, 0xd8]), "a JPEG file");
}
