//! Damaged files of every model format: an error or a model that can be used, never a panic, within a second.

use std::path::Path;
use std::time::{Duration, Instant};

use glam::{Vec2, Vec3};
use halflight_file::LoadError;
use halflight_shape::{Model, Resolver, TriangleMesh, decode_gltf, decode_obj, decode_ply, write_ply};

/// A fixed sequence of numbers (xorshift, Marsaglia 2003): the same damage in every run.
struct Sequence(u64);

impl Sequence {
    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % end.max(1) as u64) as usize
    }
}

type Decode = fn(&[u8]) -> Result<Model, LoadError>;

fn ply(bytes: &[u8]) -> Result<Model, LoadError> {
    decode_ply(bytes, Path::new("damaged.ply"))
}

fn obj(bytes: &[u8]) -> Result<Model, LoadError> {
    let materials = Resolver::memory().with("a.mtl", b"newmtl a\nKd 1 0 0\nmap_Kd a.png\n".to_vec());
    decode_obj(bytes, Path::new("damaged.obj"), &materials.with("a.png", vec![0]))
}

fn mtl(bytes: &[u8]) -> Result<Model, LoadError> {
    let materials = Resolver::memory().with("a.mtl", bytes.to_vec()).with("a.png", vec![0]);
    decode_obj(
        b"mtllib a.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        Path::new("a.obj"),
        &materials,
    )
}

fn gltf(bytes: &[u8]) -> Result<Model, LoadError> {
    decode_gltf(bytes, Path::new("damaged.glb"), &Resolver::memory())
}

/// What is not refused must be usable.
fn check(bytes: &[u8], decode: Decode) {
    let start = Instant::now();
    if let Ok(model) = decode(bytes) {
        for time in [0.0, 0.37] {
            for posed in model.pose(time) {
                posed.mesh.validate().expect("a loaded mesh is valid");
                assert!(posed.transform.is_finite());
                let slots = posed.mesh.material_slots.iter().max().map_or(0, |slot| *slot as usize + 1);
                assert!(slots <= model.materials.len());
            }
        }
        for texture in model.materials.iter().flat_map(|m| m.textures()) {
            assert!(texture.image < model.images.len());
        }
    }
    assert!(start.elapsed() < Duration::from_secs(1), "{:?} for {} bytes", start.elapsed(), bytes.len());
}

fn damage(seed: &[u8], decode: Decode, rounds: usize) {
    decode(seed).expect("the seed is sound");
    let mut sequence = Sequence(0x9e37_79b9_7f4a_7c15);
    let step = (seed.len() / rounds).max(1);
    for end in (0..seed.len()).step_by(step) {
        check(&seed[..end], decode);
    }
    for _ in 0..rounds {
        let mut bytes = seed.to_vec();
        for _ in 0..=sequence.below(3) {
            let at = sequence.below(bytes.len());
            match sequence.below(5) {
                0 => bytes[at] ^= 1 << sequence.below(8),
                1 => bytes[at] = sequence.below(256) as u8,
                2 => bytes[at] = b'0' + sequence.below(10) as u8,
                3 => drop(bytes.remove(at)),
                _ => {
                    let end = (at + 4).min(bytes.len());
                    bytes[at..end].fill(0xff);
                }
            }
        }
        check(&bytes, decode);
    }
}

fn square() -> TriangleMesh {
    let mut mesh = TriangleMesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        uvs: vec![Vec2::ZERO; 4],
        colors: vec![Vec3::ONE; 4],
        ..TriangleMesh::default()
    };
    mesh.compute_smooth_normals();
    mesh
}

#[test]
fn damaged_ply_files_are_refused_or_usable() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("square.ply");
    write_ply(&path, &square()).expect("written");
    damage(&std::fs::read(&path).expect("read"), ply, 4000);
    let text = b"ply\nformat ascii 1.0\ncomment x\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\nproperty list uchar int vertex_indices\n\
        element tristrips 1\nproperty list int int vertex_indices\nend_header\n0 0 0 1 2 3\n1 0 0 4 5 6\n1 1 0 7 8 9\n0 1 0 0 0 0\n\
        4 0 1 2 3\n5 0 1 2 -1 3\n";
    damage(text, ply, 4000);
}

#[test]
fn damaged_obj_files_are_refused_or_usable() {
    let text =
        b"mtllib a.mtl\nv 0 0 0\nv 1 0 0 1 0.5 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 1\nvn 0 0 1\nusemtl a\n\
        f 1/1/1 2/2/1 3/1/1 4/2/1\nusemtl b\nf -4//1 -3//1 -2//1\ng x\no y\ns 1\nl 1 2\n";
    damage(text, obj, 4000);
    let text = b"newmtl a\nKd 1 0.5 0.25\nKs 1 1 1\nNs 20\nKe 0 0 0\nd 0.5\nillum 7\nNi 1.5\nmap_Kd -s 1 2 3 -o 0 0 0 -clamp on a.png\nbump -bm 2 a.png\nPr 0.5\n";
    damage(text, mtl, 3000);
}

#[test]
fn damaged_gltf_files_are_refused_or_usable() {
    for name in ["RiggedSimple.glb", "AnimatedMorphCube.glb"] {
        let path =
            Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/animated")).join(name);
        match std::fs::read(&path) {
            Ok(bytes) => damage(&bytes, gltf, 3000),
            Err(_) => eprintln!("skipped: {} is not there", path.display()),
        }
    }
    damage(everything_in_one_text().as_bytes(), gltf, 4000);
}

/// A model with everything inside one text: two triangles, a skin, a morph target, an animation, a camera, a light.
fn everything_in_one_text() -> String {
    let data = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAgD8AAIA/AACAPwAAgD8AAAA/AAABAAIAAAA=";
    r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,2]}],
        "nodes":[{"mesh":0,"skin":0,"children":[1],"weights":[0.5]},{"rotation":[0,0,0,1],"camera":0},
        {"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,1,2,3,1],"mesh":0,"extensions":{"KHR_lights_punctual":{"light":0}}}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0,"targets":[{"POSITION":0}]}]}],
        "materials":[{"pbrMetallicRoughness":{"baseColorFactor":[1,0,0,1],"baseColorTexture":{"index":0}}}],
        "textures":[{"source":0}],"images":[{"bufferView":0}],
        "skins":[{"joints":[1]}],
        "animations":[{"channels":[{"sampler":0,"target":{"node":1,"path":"translation"}}],"samplers":[{"input":2,"output":0}]}],
        "cameras":[{"type":"perspective","perspective":{"yfov":0.8,"znear":0.1}}],
        "extensionsUsed":["KHR_lights_punctual"],"extensions":{"KHR_lights_punctual":{"lights":[{"type":"spot","spot":{}}]}},
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},
        {"bufferView":0,"byteOffset":60,"componentType":5123,"count":3,"type":"SCALAR"},
        {"bufferView":0,"byteOffset":36,"componentType":5126,"count":3,"type":"SCALAR"}],
        "bufferViews":[{"buffer":0,"byteLength":68}],
        "buffers":[{"byteLength":68,"uri":"data:application/octet-stream;base64,DATA"}]}"#
        .replace("DATA", data)
}

/// An OBJ file, and after a NUL byte its material file.
fn obj_and_mtl(bytes: &[u8]) -> Result<Model, LoadError> {
    let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
    let (mesh, materials) = bytes.split_at(end);
    let companions = Resolver::memory().with("a.mtl", materials.to_vec()).with("a.png", vec![0]);
    decode_obj(mesh, Path::new("seed.obj"), &companions)
}

#[test]
fn the_seeds_of_the_fuzz_targets_are_sound_and_survive_damage() {
    let corpus = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../fuzz/corpus"));
    for (folder, decode) in [("mesh_ply", ply as Decode), ("mesh_obj", obj_and_mtl), ("mesh_gltf", gltf)] {
        let Ok(entries) = std::fs::read_dir(corpus.join(folder)) else {
            eprintln!("skipped: there are no seeds in {folder}");
            continue;
        };
        let mut paths: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
        paths.sort();
        for path in paths {
            damage(&std::fs::read(&path).expect("readable"), decode, 500);
        }
    }
}
