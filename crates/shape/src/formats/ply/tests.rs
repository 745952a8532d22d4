use std::path::{Path, PathBuf};

use glam::{Vec2, Vec3};
use halflight_file::LoadError;

use super::*;
use crate::TriangleMesh;

fn decode(bytes: &[u8]) -> Result<Model, LoadError> {
    decode_ply(bytes, Path::new("a/shape.ply.xz"))
}

fn message(bytes: &[u8]) -> String {
    decode(bytes).expect_err("it is refused").to_string()
}

fn mesh(bytes: &[u8]) -> TriangleMesh {
    let model = decode(bytes).expect("it is sound");
    assert_eq!(model.name, "shape");
    TriangleMesh::clone(&model.meshes[0].mesh)
}

#[test]
fn a_byte_order_mark_before_the_first_line_is_skipped() {
    let text = b"\xEF\xBB\xBFply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
        property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
        0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    assert_eq!(mesh(text).positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
}

/// A number in one of the types of the format.
fn put(bytes: &mut Vec<u8>, encoding: &str, kind: &str, value: f64) {
    if encoding == "ascii" {
        bytes.extend(format!("{value} ").bytes());
        return;
    }
    let mut word = match kind {
        "char" | "int8" => (value as i8).to_le_bytes().to_vec(),
        "uchar" | "uint8" => (value as u8).to_le_bytes().to_vec(),
        "short" | "int16" => (value as i16).to_le_bytes().to_vec(),
        "ushort" | "uint16" => (value as u16).to_le_bytes().to_vec(),
        "int" | "int32" => (value as i32).to_le_bytes().to_vec(),
        "uint" | "uint32" => (value as u32).to_le_bytes().to_vec(),
        "float" | "float32" => (value as f32).to_le_bytes().to_vec(),
        _ => value.to_le_bytes().to_vec(),
    };
    if encoding == "binary_big_endian" {
        word.reverse();
    }
    bytes.extend(word);
}

/// A square with everything, between elements and properties that mean nothing.
fn flavour(encoding: &str, real: &str, whole: &str, count: &str, line_end: &str) -> Vec<u8> {
    let header = [
        "ply",
        &format!("format {encoding} 1.0"),
        "comment made for a test",
        "obj_info nothing",
        "element camera 1",
        &format!("property {real} view"),
        &format!("property list {count} {real} more"),
        "element vertex 4",
        &format!("property {real} nx"),
        &format!("property {real} ny"),
        &format!("property {real} nz"),
        &format!("property {real} z"),
        &format!("property {real} y"),
        &format!("property list {count} {whole} nonsense"),
        &format!("property {real} x"),
        &format!("property {real} s"),
        &format!("property {real} t"),
        "property uchar red",
        "property uchar green",
        "property uchar blue",
        "property uchar alpha",
        "element face 2",
        &format!("property {whole} flags"),
        &format!("property list {count} {whole} vertex_indices"),
        "end_header",
    ];
    let mut bytes = Vec::new();
    for line in header {
        bytes.extend(line.bytes());
        bytes.extend(line_end.bytes());
    }
    let mut put = |kind: &str, value: f64| put(&mut bytes, encoding, kind, value);
    put(real, 7.0);
    put(count, 2.0);
    put(real, 1.0);
    put(real, 2.0);
    for (x, y) in [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)] {
        for value in [0.0, 0.0, 1.0, 5.0, y] {
            put(real, value);
        }
        put(count, 1.0);
        put(whole, 9.0);
        for value in [x, x, y] {
            put(real, value);
        }
        for value in [255.0, 0.0, 188.0, 255.0] {
            put("uchar", value);
        }
    }
    put(whole, 1.0);
    put(count, 4.0);
    (0..4).for_each(|i| put(whole, f64::from(i)));
    put(whole, 1.0);
    put(count, 2.0);
    put(whole, 0.0);
    put(whole, 1.0);
    bytes
}

#[test]
fn every_flavour_gives_the_same_mesh() {
    for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for (real, whole, count) in [
            ("float", "int", "uchar"),
            ("double", "uint32", "int32"),
            ("float32", "uint8", "uint16"),
            ("float64", "short", "char"),
            ("int", "ushort", "uint"),
            ("int8", "int8", "short"),
        ] {
            for line_end in ["\n", "\r\n", "\r"] {
                let bytes = flavour(encoding, real, whole, count, line_end);
                let model = decode(&bytes).expect("it is sound");
                let mesh = &model.meshes[0].mesh;
                assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
                assert_eq!(mesh.positions[2], Vec3::new(1.0, 1.0, 5.0));
                assert_eq!(mesh.normals, [Vec3::Z; 4]);
                // v is turned to count downwards.
                assert_eq!(mesh.uvs[1..3], [Vec2::ONE, Vec2::X]);
                // 188/255 is the middle of the linear scale, nearly.
                assert!((mesh.colors[0] - Vec3::new(1.0, 0.0, 0.5028)).length() < 1e-3);
                assert_eq!(model.warnings, ["1 faces have fewer than three corners and were left out"]);
            }
        }
    }
}

#[test]
fn what_was_written_is_read_back() {
    let mut original = crate::mesh::samples::grid(5);
    original.compute_smooth_normals();
    original.colors = original.positions.clone();
    original.positions[3] = Vec3::new(1e-30, -3.25e7, 0.1);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("grid.ply");
    write_ply(&path, &original).expect("written");
    let back = crate::load_model(&path).expect("read").meshes[0].mesh.clone();
    assert_eq!((&back.positions, &back.triangles), (&original.positions, &original.triangles));
    assert_eq!((&back.normals, &back.colors), (&original.normals, &original.colors));
    assert!(back.uvs.iter().zip(&original.uvs).all(|(a, b)| (*a - *b).length() < 1e-6));
    let error = write_ply(&folder.path().join("no/such/grid.ply"), &original).expect_err("no folder");
    assert!(error.to_string().contains("make the folder first"), "{error}");
}

const POINTS: &str = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
const CORNERS: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

fn text(elements: &str, rows: &str) -> Vec<u8> {
    format!("ply\nformat ascii 1.0\n{elements}end_header\n{rows}").into_bytes()
}

#[test]
fn strips_turn_and_begin_anew() {
    let elements = format!("{POINTS}element tristrips 1\nproperty list int int vertex_indices\n");
    let strips = mesh(&text(&elements, &format!("{CORNERS}10 0 1 3 2 -1 1 2 3 3 -1")));
    assert_eq!(strips.triangles, [[0, 1, 3], [3, 1, 2], [1, 2, 3]]);
}

#[test]
fn faces_may_stand_before_vertices() {
    let elements = format!("element face 1\nproperty list uchar int vertex_index\n{POINTS}");
    assert_eq!(mesh(&text(&elements, &format!("4 0 1 2 3\n{CORNERS}"))).triangles.len(), 2);
}

#[test]
fn points_without_faces_are_a_mesh_without_triangles() {
    let model = decode(&text(POINTS, CORNERS)).expect("it is sound");
    assert!(model.meshes[0].mesh.triangles.is_empty());
    assert_eq!(model.warnings, ["there are no faces in it, only points"]);
}

#[test]
fn what_is_wrong_is_said_with_its_line_or_byte() {
    let face = format!("{POINTS}element face 1\nproperty list uchar int vertex_indices\n");
    let cases: [(&[u8], &str); 20] = [
        (b"", "the file is empty"),
        (b"PLY\n", "does not begin with the line `ply`"),
        (b"ply\nformat ascii 1.0\nelement vertex 4", "line 3: the header has no `end_header` line"),
        (b"ply\nformat utf9 1.0\n", "line 2: the format `utf9` is not known"),
        (b"ply\nend_header\n", "line 2: the header does not say its format"),
        (b"ply\nwibble\n", "line 2: `wibble` is not a line of a PLY header"),
        (b"ply\nelement vertex -1\n", "line 2: `-1` is not a count"),
        (b"ply\nproperty float x\n", "line 2: a property stands before any element"),
        (
            b"ply\nelement vertex 1\nproperty flaot x\n",
            "line 3: `flaot` is not a type of number (did you mean `float`?)",
        ),
        (b"ply\nelement vertex 1\nproperty list float int x\n", "counts its items in fractions"),
        (b"ply\nelement vertex 1\nelement vertex 2\n", "two elements called `vertex`"),
        (b"ply\nelement vertex 1\nproperty int x\nproperty int x\n", "two properties `x`"),
        (b"ply\nformat ascii 1.0\nend_header\n", "there is no element `vertex`"),
        (b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n", "no property `y`"),
        (
            &text(&face, &format!("{CORNERS}3 0 1 4\n")),
            "line 14: row 0 of element `face` refers to vertex 4, but there are 4",
        ),
        (&text(&face, &format!("{CORNERS}3 0 1 -1\n")), "refers to vertex -1"),
        (&text(&face, &format!("{CORNERS}3 0 1 1.5\n")), "refers to vertex 1.5"),
        (&text(&face, "0 0 0\n1 nan 0\n1 1 0\n0 1 0\n3 0 1 2\n"), "line 11: `y` of vertex 1 is NaN"),
        (&text(&face, "0 0 0\n1 x 0\n1 1 0\n0 1 0\n3 0 1 2\n"), "line 11: `x` is not a number in row 1"),
        (&text(&face, &format!("{CORNERS}200 0 1 2\n")), "should list 200 vertices, but"),
    ];
    for (bytes, expected) in cases {
        let found = message(bytes);
        assert!(found.contains(expected), "{found}\nis not: {expected}");
    }
    let mut binary = flavour("binary_little_endian", "float", "int", "uchar", "\n");
    let end = binary.len();
    binary[end - 3] = 1;
    let expected = format!("byte {}: row 1 of element `face` refers to vertex 257", end - 4);
    assert!(message(&binary).contains(&expected), "{}", message(&binary));
}

#[test]
fn counts_that_the_file_cannot_hold_are_refused_before_any_memory_is_taken() {
    for count in ["4000000000", "18446744073709551615"] {
        let elements = format!("{POINTS}element face {count}\nproperty list uchar int vertex_indices\n");
        assert!(message(&text(&elements, CORNERS)).contains("bytes are left"));
        let elements = POINTS.replace('4', count);
        assert!(message(&text(&elements, CORNERS)).contains("bytes are left"));
        // Elements without properties take no bytes, and no time either.
        let elements = format!("element nothing {count}\n{POINTS}");
        decode(&text(&elements, CORNERS)).expect("it is sound");
    }
    let list = format!("{POINTS}element face 1\nproperty list uint int vertex_indices\n");
    let mut bytes = text(&list, "");
    bytes.splice(11..16, b"binary_little_endian".iter().copied());
    let header = String::from_utf8_lossy(&bytes).into_owned();
    assert!(header.contains("binary_little_endian"), "{header}");
    bytes.extend([0; 48]);
    bytes.extend([0xff; 4]);
    bytes.extend([0; 8]);
    assert!(message(&bytes).contains("should list 4294967295 vertices, but 8 bytes are left"));
}

#[test]
fn the_wrong_order_of_bytes_is_refused() {
    let bytes = flavour("binary_big_endian", "float", "int", "int", "\n");
    let text = b"binary_big_endian";
    let at = bytes.windows(text.len()).position(|w| w == text).expect("it is there");
    let mut wrong = bytes.clone();
    wrong.splice(at..at + text.len(), b"binary_little_endian".iter().copied());
    message(&wrong);
}

#[test]
fn files_cut_short_anywhere_are_refused() {
    for encoding in ["binary_little_endian", "binary_big_endian"] {
        let bytes = flavour(encoding, "double", "int", "uchar", "\n");
        for end in 0..bytes.len() {
            message(&bytes[..end]);
        }
    }
    // In text a number may lose its last digits without a trace; here the last number has one digit.
    let bytes = flavour("ascii", "double", "int", "uchar", "\n");
    for end in 0..bytes.len() - 1 {
        message(&bytes[..end]);
    }
}

#[test]
fn the_meshes_at_hand_have_the_triangles_their_list_says() {
    let folder = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/meshes"));
    for (name, triangles, vertices) in [
        ("airplane", 2_452, 1_335),
        ("stanford_bunny", 69_451, 35_947),
        ("xyzrgb_dragon_100k", 100_000, 50_002),
    ] {
        let path = folder.join(format!("{name}.ply"));
        if !path.exists() {
            eprintln!("skipped: {} is not there", path.display());
            continue;
        }
        let start = std::time::Instant::now();
        let model = crate::load_model(&path).expect(name);
        eprintln!("{name}: {:?} {:?}", start.elapsed(), model.warnings);
        let mesh = &model.meshes[0].mesh;
        assert_eq!((mesh.triangles.len(), mesh.positions.len()), (triangles, vertices), "{name}");
    }
}
