use std::path::Path;

use glam::{Affine3A, Vec2, Vec3};
use serde_json::{Value, json};

use super::*;
use crate::model::{AlphaMode, ModelImage, ModelLightKind, Wrap};

/// A file made piece by piece: each array of numbers becomes a buffer view and an accessor.
struct File {
    json: Value,
    binary: Vec<u8>,
}

const FLOAT: u32 = 5126;

impl File {
    fn new() -> Self {
        let json =
            json!({"asset": {"version": "2.0"}, "accessors": [], "bufferViews": [], "nodes": [{"mesh": 0}]});
        Self { json, binary: Vec::new() }
    }

    fn array(&mut self, list: &str) -> &mut Vec<Value> {
        self.json[list].as_array_mut().expect("it is an array")
    }

    fn view(&mut self, bytes: &[u8]) -> usize {
        let offset = self.binary.len().next_multiple_of(4);
        self.binary.resize(offset, 0);
        self.binary.extend_from_slice(bytes);
        self.array("bufferViews").push(json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()}));
        self.array("bufferViews").len() - 1
    }

    fn accessor(&mut self, accessor: Value) -> usize {
        self.array("accessors").push(accessor);
        self.array("accessors").len() - 1
    }

    fn numbers(&mut self, kind: &str, component: u32, bytes: &[u8], count: usize) -> usize {
        let view = self.view(bytes);
        self.accessor(json!({"bufferView": view, "componentType": component, "count": count, "type": kind}))
    }

    fn floats(&mut self, kind: &str, values: &[f32]) -> usize {
        let width = match kind {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 16,
        };
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.numbers(kind, FLOAT, &bytes, values.len() / width)
    }

    /// One mesh of one primitive over a unit square of four vertices.
    fn square() -> Self {
        let mut file = Self::new();
        let positions = file.floats("VEC3", &[0., 0., 0., 1., 0., 0., 0., 1., 0., 1., 1., 0.]);
        file.json["meshes"] = json!([{"primitives": [{"attributes": {"POSITION": positions}, "mode": 5}]}]);
        file
    }

    fn primitive(&mut self) -> &mut Value {
        &mut self.json["meshes"][0]["primitives"][0]
    }

    fn attribute(&mut self, name: &str, accessor: usize) {
        self.primitive()["attributes"][name] = json!(accessor);
    }

    fn decode(&self) -> Result<Model, LoadError> {
        let mut json = self.json.clone();
        json["buffers"] = json!([{"byteLength": self.binary.len(), "uri": "all%20data.bin"}]);
        let companions = Resolver::memory()
            .with("all data.bin", self.binary.clone())
            .with("colour.png", vec![1])
            .with("other.png", vec![2]);
        decode_gltf(json.to_string().as_bytes(), Path::new("file.gltf"), &companions)
    }

    fn model(&self) -> Model {
        self.decode().expect("it is sound")
    }

    fn message(&self) -> String {
        self.decode().expect_err("it is refused").to_string()
    }

    /// The same as a `.glb`.
    fn packed(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        json["buffers"] = json!([{"byteLength": self.binary.len()}]);
        let mut text = json.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut data = self.binary.clone();
        data.resize(data.len().next_multiple_of(4), 0);
        let word = |n: usize| (n as u32).to_le_bytes();
        let mut bytes = b"glTF".to_vec();
        bytes.extend(word(2));
        bytes.extend(word(12 + 8 + text.len() + 8 + data.len()));
        bytes.extend(word(text.len()));
        bytes.extend(b"JSON");
        bytes.extend(text);
        bytes.extend(word(data.len()));
        bytes.extend(b"BIN\0");
        bytes.extend(data);
        bytes
    }
}

#[test]
fn triangles_come_from_lists_strips_and_fans_and_from_indices_of_every_size() {
    let mut file = File::square();
    assert_eq!(file.model().meshes[0].mesh.triangles, [[0, 1, 2], [2, 1, 3]]);
    file.primitive()["mode"] = json!(6);
    assert_eq!(file.model().meshes[0].mesh.triangles, [[1, 2, 0], [2, 3, 0]]);
    file.primitive()["mode"] = json!(4);
    for (component, bytes) in [
        (5121, vec![0u8, 1, 2, 1, 3, 2]),
        (5123, [0u16, 1, 2, 1, 3, 2].iter().flat_map(|i| i.to_le_bytes()).collect()),
        (5125, [0u32, 1, 2, 1, 3, 2].iter().flat_map(|i| i.to_le_bytes()).collect()),
    ] {
        let indices = file.numbers("SCALAR", component, &bytes, 6);
        file.primitive()["indices"] = json!(indices);
        assert_eq!(file.model().meshes[0].mesh.triangles, [[0, 1, 2], [1, 3, 2]]);
    }
    file.primitive()["mode"] = json!(1);
    let model = file.model();
    assert!(model.meshes.is_empty() && model.warnings[0].contains("points or lines"));
}

#[test]
fn text_and_binary_files_say_the_same() {
    let file = File::square();
    let model = decode_gltf(&file.packed(), Path::new("file.glb"), &Resolver::memory()).expect("it is sound");
    assert_eq!(model.meshes[0].mesh, file.model().meshes[0].mesh);
}

#[test]
fn whole_numbers_become_fractions_and_sparse_values_replace() {
    let mut file = File::square();
    let colors = file.numbers("VEC4", 5121, &[255, 0, 51, 9, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0], 4);
    file.json["accessors"][colors]["normalized"] = json!(true);
    file.attribute("COLOR_0", colors);
    let normals = file.numbers("VEC3", 5120, &[0, 0, 127, 0, 0, 129, 0, 127, 0, 128, 0, 0], 4);
    file.json["accessors"][normals]["normalized"] = json!(true);
    file.attribute("NORMAL", normals);
    let places = file.view(&[3, 0]);
    let values = file.view(&[4f32, 5.0, 6.0].map(f32::to_le_bytes).concat());
    file.json["accessors"][0]["sparse"] = json!({"count": 1,
        "indices": {"bufferView": places, "componentType": 5123}, "values": {"bufferView": values}});
    let mesh = file.model().meshes[0].mesh.clone();
    assert!((mesh.colors[0] - Vec3::new(1.0, 0.0, 0.2)).length() < 1e-6);
    assert_eq!(mesh.normals, [Vec3::Z, Vec3::NEG_Z, Vec3::Y, Vec3::NEG_X]);
    assert_eq!(mesh.positions[3], Vec3::new(4.0, 5.0, 6.0));
    // All zero but for the sparse values.
    let targets = file.accessor(json!({"componentType": FLOAT, "count": 4, "type": "VEC3",
        "sparse": file.json["accessors"][0]["sparse"].clone()}));
    file.primitive()["targets"] = json!([{"POSITION": targets}]);
    let model = file.model();
    assert_eq!(model.meshes[0].morphs[0].positions[2..], [Vec3::ZERO, Vec3::new(4.0, 5.0, 6.0)]);
}

#[test]
fn vertices_of_other_primitives_are_dropped() {
    let mut file = File::square();
    let uvs = file.floats("VEC2", &[0., 0., 0.1, 0., 0.2, 0., 0.3, 0.]);
    file.attribute("TEXCOORD_0", uvs);
    let indices = file.numbers("SCALAR", 5121, &[3, 2, 1], 3);
    file.primitive()["indices"] = json!(indices);
    let mesh = file.model().meshes[0].mesh.clone();
    assert_eq!(mesh.positions, [Vec3::X, Vec3::Y, Vec3::new(1.0, 1.0, 0.0)]);
    assert_eq!((mesh.triangles[0], mesh.uvs[0].x), ([2, 1, 0], 0.1));
}

#[test]
fn materials_are_read_with_their_extensions() {
    let mut file = File::square();
    let uvs = file.floats("VEC2", &[0.; 8]);
    let others = file.floats("VEC2", &[0.5; 8]);
    file.attribute("TEXCOORD_0", uvs);
    file.attribute("TEXCOORD_1", others);
    let normals = file.floats("VEC3", &[0., 0., 1., 0., 0., 1., 0., 0., 1., 0., 0., 1.]);
    file.attribute("NORMAL", normals);
    file.primitive()["material"] = json!(1);
    file.json["materials"] = json!([{"name": "unused", "normalTexture": {"index": 99}}, {
        "name": "paint", "doubleSided": true, "alphaMode": "MASK", "alphaCutoff": 0.25,
        "emissiveFactor": [1, 0.5, 0],
        "normalTexture": {"index": 1, "scale": 0.5, "texCoord": 1},
        "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 1, 0.75], "metallicFactor": 0.1, "roughnessFactor": 0.2,
            "baseColorTexture": {"index": 0, "texCoord": 0, "extensions": {"KHR_texture_transform":
                {"offset": [0.1, 0.2], "rotation": std::f32::consts::FRAC_PI_2, "scale": [2, 3], "texCoord": 1}}}},
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4}, "KHR_materials_ior": {"ior": 1.33},
            "KHR_materials_transmission": {"transmissionFactor": 0.9}, "KHR_materials_unlit": {}}}]);
    file.json["textures"] = json!([{"source": 1, "sampler": 0}, {"source": 0}]);
    file.json["samplers"] = json!([{"wrapS": 33071, "wrapT": 33648}]);
    file.json["images"] =
        json!([{"uri": "other.png"}, {"uri": "data:image/png;base64,AQI=", "name": "inside"}]);
    let model = file.model();
    assert_eq!(model.materials.len(), 1);
    let paint = &model.materials[0];
    assert_eq!(paint.base_color.to_array(), [0.5, 0.25, 1.0, 0.75]);
    assert_eq!((paint.metallic, paint.roughness, paint.normal_scale), (0.1, 0.2, 0.5));
    assert_eq!((paint.ior, paint.transmission, paint.unlit, paint.double_sided), (1.33, 0.9, true, true));
    assert_eq!(paint.emissive, Vec3::new(4.0, 2.0, 0.0));
    assert_eq!(paint.alpha_mode, AlphaMode::Mask { cutoff: 0.25 });
    let texture = paint.base_color_texture.as_ref().expect("a texture");
    assert_eq!((texture.wrap_u, texture.wrap_v), (Wrap::ClampToEdge, Wrap::MirroredRepeat));
    assert_eq!(model.images[texture.image], ModelImage::Encoded { bytes: vec![1, 2], name: "inside".into() });
    // A quarter turn counter-clockwise with v downwards takes +u to −v, and +v to +u.
    let place = |u, v| texture.uv_transform.transform_point2(Vec2::new(u, v));
    assert!((place(0.0, 0.0) - Vec2::new(0.1, 0.2)).length() < 1e-6);
    assert!((place(1.0, 0.0) - Vec2::new(0.1, -1.8)).length() < 1e-6);
    assert!((place(0.0, 1.0) - Vec2::new(3.1, 0.2)).length() < 1e-6);
    // Both textures are laid by the second set.
    assert_eq!(model.meshes[0].mesh.uvs[0], Vec2::splat(0.5));
    assert_eq!(model.meshes[0].mesh.tangents.len(), 4);
    assert!(model.warnings.is_empty(), "{:?}", model.warnings);
    file.json["materials"][1]["normalTexture"]["texCoord"] = json!(0);
    assert!(file.model().warnings[0].contains("several sets"));
    file.json["images"][0]["uri"] = json!("otter.png");
    assert!(
        file.message().contains("otter.png") && file.message().contains("other.png"),
        "{}",
        file.message()
    );
}

#[test]
fn the_example_of_the_texture_transform_shows_the_lower_left_quarter_turned_clockwise() {
    let mut file = File::square();
    file.json["images"] = json!([{"uri": "data:image/png;base64,AAAA"}]);
    file.json["samplers"] = json!([{"magFilter": 9728}]);
    file.json["textures"] = json!([{"source": 0, "sampler": 0}, {"source": 0}]);
    file.json["materials"] = json!([{"emissiveTexture": {"index": 1}, "pbrMetallicRoughness": {"baseColorTexture":
        {"index": 0, "extensions": {"KHR_texture_transform":
            {"offset": [0, 1], "rotation": std::f32::consts::FRAC_PI_2, "scale": [0.5, 0.5]}}}}}]);
    file.primitive()["material"] = json!(0);
    let material = file.model().materials.remove(0);
    let texture = material.base_color_texture.expect("it has one");
    // Corners of the square from its upper left on, to right and down: what stood upright lies on its right side.
    for (corner, expected) in [
        (Vec2::ZERO, Vec2::new(0.0, 1.0)),
        (Vec2::X, Vec2::new(0.0, 0.5)),
        (Vec2::ONE, Vec2::new(0.5, 0.5)),
        (Vec2::Y, Vec2::new(0.5, 1.0)),
    ] {
        let found = texture.uv_transform.transform_point2(corner);
        assert!(found.distance(expected) < 1e-6, "{corner} shows {found}");
    }
    assert!(texture.nearest, "so its sampler says");
    assert!(!material.emissive_texture.expect("it has one").nearest);
}

#[test]
fn nodes_carry_their_children_cameras_and_lights() {
    let mut file = File::square();
    file.json["nodes"] = json!([
        {"mesh": 0, "translation": [0, 1, 0]},
        {"children": [0, 2], "scale": [2, 2, 2]},
        {"camera": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 2, 3, 1]},
        {"mesh": 0, "name": "not in the scene"},
        {"extensions": {"KHR_lights_punctual": {"light": 1}}}
    ]);
    file.json["scenes"] = json!([{"nodes": [3]}, {"nodes": [1, 4]}]);
    file.json["scene"] = json!(1);
    file.json["cameras"] =
        json!([{"name": "eye", "perspective": {"yfov": 0.5, "znear": 0.1, "aspectRatio": 2}}]);
    file.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [{"type": "point"},
        {"type": "spot", "intensity": 7, "color": [1, 0, 0], "spot": {"outerConeAngle": 0.4}}]}});
    let model = file.model();
    let posed = model.pose(0.0);
    assert_eq!(posed.len(), 1);
    let expected =
        Affine3A::from_scale_rotation_translation(Vec3::splat(2.0), glam::Quat::IDENTITY, Vec3::Y * 2.0);
    assert_eq!(posed[0].transform, expected);
    let transforms = model.transforms(0.0);
    assert_eq!((model.cameras[0].vertical_fov, model.cameras[0].aspect), (0.5, Some(2.0)));
    assert_eq!(Vec3::from(transforms[model.cameras[0].node].translation), Vec3::new(2.0, 4.0, 6.0));
    assert_eq!(model.lights[0].kind, ModelLightKind::Spot { inner: 0.0, outer: 0.4 });
    assert_eq!((model.lights[0].intensity, model.lights.len()), (7.0, 1));
}

#[test]
fn nodes_in_a_cycle_or_with_two_parents_are_refused() {
    let mut file = File::square();
    file.json["nodes"] = json!([{"mesh": 0}, {"children": [2]}, {"children": [1]}]);
    assert!(file.message().contains("node 1 is its own descendant"), "{}", file.message());
    file.json["nodes"] = json!([{"mesh": 0, "children": [0]}]);
    assert!(file.message().contains("cycle"));
    file.json["nodes"] = json!([{"mesh": 0}, {"children": [0]}, {"children": [0]}]);
    assert!(file.message().contains("node 0 is a child of node 1 and again of node 2"));
    // A chain that would overflow a recursion.
    let chain = (0..100_000).map(|i| if i == 0 { json!({"mesh": 0}) } else { json!({"children": [i - 1]}) });
    file.json["nodes"] = chain.collect();
    assert_eq!(file.model().pose(0.0).len(), 1);
}

#[test]
fn several_sets_of_joints_move_a_mesh() {
    let mut file = File::square();
    let joints = file.numbers("VEC4", 5121, &[0, 0, 0, 0].repeat(4), 4);
    let more = file.numbers("VEC4", 5121, &[1, 200, 0, 0].repeat(4), 4);
    let weights = file.floats("VEC4", &[1.0, 0.0, 0.0, 0.0].repeat(4));
    let others = file.floats("VEC4", &[3.0, 0.0, 0.0, 0.0].repeat(4));
    for (name, accessor) in
        [("JOINTS_0", joints), ("JOINTS_1", more), ("WEIGHTS_0", weights), ("WEIGHTS_1", others)]
    {
        file.attribute(name, accessor);
    }
    file.json["nodes"] =
        json!([{"mesh": 0, "skin": 0, "translation": [9, 9, 9]}, {}, {"translation": [4, 0, 0]}]);
    file.json["skins"] = json!([{"joints": [1, 2]}]);
    let posed = &file.model().pose(0.0)[0];
    // A quarter follows the first joint and three quarters the second; the node's own place does not count.
    assert_eq!(posed.mesh.positions[1], Vec3::new(4.0, 0.0, 0.0));
    assert_eq!(posed.transform, Affine3A::IDENTITY);
    assert!(!posed.deforms);
    file.json["skins"] = json!([{"joints": [1]}]);
    assert!(file.message().contains("follows joint 1, but its skin has 1 joints"), "{}", file.message());
}

#[test]
fn animations_move_nodes_and_weights() {
    let mut file = File::square();
    let target = file.floats("VEC3", &[0., 0., 1.].repeat(4));
    file.primitive()["targets"] = json!([{"POSITION": target}]);
    file.json["meshes"][0]["weights"] = json!([0.25]);
    file.json["meshes"][0]["extras"] = json!({"targetNames": ["raise"]});
    assert_eq!(file.model().pose(0.0)[0].mesh.positions[0].z, 0.25);
    assert_eq!(file.model().meshes[0].morphs[0].name, "raise");
    let times = file.floats("SCALAR", &[0.0, 2.0]);
    let weights = file.floats("SCALAR", &[0.0, 1.0]);
    let spline =
        file.floats("VEC3", &[0., 0., 0., 0., 0., 0., 3., 0., 0., 3., 0., 0., 6., 0., 0., 0., 0., 0.]);
    file.json["animations"] = json!([{"samplers": [{"input": times, "output": weights},
        {"input": times, "output": spline, "interpolation": "CUBICSPLINE"}],
        "channels": [{"sampler": 0, "target": {"node": 0, "path": "weights"}},
            {"sampler": 1, "target": {"node": 0, "path": "translation"}}]}]);
    let model = file.model();
    assert_eq!(model.duration(), Some(2.0));
    let posed = &model.pose(0.5)[0];
    assert!(posed.deforms && (posed.mesh.positions[0].z - 0.25).abs() < 1e-6);
    assert!(
        (posed.transform.translation.x - 1.5).abs() < 1e-6,
        "a straight line has the slope of its tangents"
    );
    file.json["animations"][0]["samplers"][0]["output"] = json!(spline);
    assert!(file.message().contains("VEC3 where SCALAR is expected"));
    file.json["animations"][0]["samplers"][0]["output"] = json!(weights);
    let backwards = file.floats("SCALAR", &[1.0, 0.5]);
    file.json["animations"][0]["samplers"][0]["input"] = json!(backwards);
    assert!(file.message().contains("time runs backwards"));
}

#[test]
fn ranges_outside_their_buffers_and_claims_without_bytes_are_refused() {
    let refused = |change: &dyn Fn(&mut Value), expected: &str| {
        let mut file = File::square();
        let indices = file.numbers("SCALAR", 5121, &[0, 1, 2], 3);
        file.primitive()["indices"] = json!(indices);
        change(&mut file.json);
        let message = file.message();
        assert!(message.contains(expected), "{message}");
    };
    refused(&|j| j["accessors"][0]["count"] = json!(5), "takes 5 elements of 12 bytes");
    refused(&|j| j["accessors"][0]["count"] = json!(u64::MAX), "too much for the size of the file");
    refused(&|j| j["accessors"][0]["byteOffset"] = json!(u64::MAX), "from byte 18446744073709551615");
    refused(&|j| j["bufferViews"][0]["byteLength"] = json!(999), "takes 999 bytes from byte 0");
    refused(&|j| j["bufferViews"][0]["byteOffset"] = json!(u64::MAX), "buffer view 0 takes");
    refused(&|j| j["bufferViews"][0]["byteStride"] = json!(4), "stand 4 bytes apart");
    refused(&|j| j["bufferViews"][0]["byteStride"] = json!(u64::MAX), "takes 4 elements");
    refused(&|j| j["bufferViews"][0]["buffer"] = json!(1), "refers to buffer 1, but there are 1");
    refused(&|j| j["accessors"][0]["bufferView"] = json!(7), "refers to buffer view 7");
    refused(&|j| j["accessors"][0]["componentType"] = json!(1), "unknown type 1");
    refused(&|j| j["accessors"][1]["componentType"] = json!(FLOAT), "not of unsigned whole numbers");
    refused(
        &|j| j["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(70),
        "refers to accessor 70",
    );
    refused(&|j| j["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(1), "SCALAR where VEC3");
    refused(
        &|j| j["meshes"][0]["primitives"][0]["material"] = json!(0),
        "refers to material 0, but there are 0",
    );
    refused(&|j| j["meshes"][0]["primitives"][0]["mode"] = json!(9), "unknown mode 9");
    refused(&|j| j["nodes"][0]["mesh"] = json!(3), "refers to mesh 3");
    refused(&|j| j["nodes"][0]["translation"] = json!([1e30, 0, 0]), "further out");
    refused(&|j| j["scenes"] = json!([{"nodes": [5]}]), "refers to node 5");
    refused(&|j| j["asset"]["version"] = json!("1.0"), "only 2.x is read");
    refused(
        &|j| j["extensionsRequired"] = json!(["KHR_draco_mesh_compression", "KHR_texture_transform"]),
        "it requires KHR_draco_mesh_compression, which is not read",
    );
    refused(&|j| j["nodes"] = json!("none"), "the JSON is not glTF's");
    // A count of nothing in the file may not ask for memory either.
    refused(
        &|j| {
            j["accessors"][0] = json!({"componentType": FLOAT, "count": 4_000_000_000u64, "type": "VEC3"});
        },
        "too much for the size of the file",
    );
}

#[test]
fn addresses_in_the_net_are_said_not_to_be_files() {
    let text =
        r#"{"asset": {"version": "2.0"}, "buffers": [{"byteLength": 4, "uri": "http://a.org/b.bin"}]}"#;
    let refused = decode_gltf(text.as_bytes(), Path::new("a.gltf"), &Resolver::memory());
    let message = refused.expect_err("not a file").to_string();
    assert!(
        message.contains("it refers to http://a.org/b.bin, and only files beside it are read"),
        "{message}"
    );
}

#[test]
fn numbers_that_are_not_finite_and_indices_out_of_range_are_refused() {
    for bad in [f32::NAN, f32::INFINITY, 1e20] {
        let mut file = File::square();
        file.binary[4..8].copy_from_slice(&bad.to_le_bytes());
        assert!(file.message().contains("POSITION"), "{}", file.message());
        if !bad.is_finite() {
            assert!(file.message().ends_with(&format!("is {bad}")), "{}", file.message());
        }
    }
    let mut file = File::square();
    let indices = file.numbers("SCALAR", 5121, &[0, 1, 4], 3);
    file.primitive()["indices"] = json!(indices);
    assert!(file.message().contains("index 2 refers to vertex 4, but there are 4 vertices"));
}

#[test]
fn damaged_containers_are_refused() {
    let whole = File::square().packed();
    let message = |bytes: &[u8]| {
        decode_gltf(bytes, Path::new("file.glb"), &Resolver::memory()).expect_err("refused").to_string()
    };
    for end in 0..whole.len() {
        message(&whole[..end]);
    }
    assert!(message(&[]).contains("the file is empty"));
    let mut old = whole.clone();
    old[4] = 1;
    assert!(message(&old).contains("byte 4: it is a binary glTF of version 1"));
    let mut long = whole.clone();
    long[15] = 0xff;
    assert!(message(&long).contains("a chunk should have"));
    assert!(message(b"{\"asset\": \n nonsense").contains("line 2, column"));
    assert!(message(&b"[".repeat(100_000)).contains("JSON"));
}

#[test]
fn files_in_a_folder_are_found_beside_the_model() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut file = File::square();
    file.json["buffers"] = json!([{"byteLength": file.binary.len(), "uri": "data.bin"}]);
    let path = folder.path().join("model.gltf");
    std::fs::write(&path, file.json.to_string()).expect("written");
    let error = crate::load_model(&path).expect_err("no buffer").to_string();
    assert!(error.contains("data.bin") && error.contains("no such file"), "{error}");
    std::fs::write(folder.path().join("data.bin"), &file.binary).expect("written");
    assert_eq!(crate::load_model(&path).expect("found").name, "model");
    std::fs::write(folder.path().join("data.bin"), &file.binary[..20]).expect("written");
    assert!(crate::load_model(&path).expect_err("short").to_string().contains("should have 48 bytes"));
    assert!(crate::load_model(folder.path()).expect_err("a folder").to_string().contains("folder"));
}
