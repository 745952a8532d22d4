use std::path::{Path, PathBuf};

use glam::{Vec2, Vec3};

use super::*;
use crate::model::{AlphaMode, ModelImage, Wrap};

fn decode(text: &str) -> Result<Model, LoadError> {
    decode_obj(text.as_bytes(), Path::new("a/shape.obj"), &Resolver::memory())
}

fn message(text: &str) -> String {
    decode(text).expect_err("it is refused").to_string()
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn polygons_and_negative_indices_become_triangles() {
    for faces in ["f 1 2 3 4\n", "f -4 -3 -2 -1\n", "f 1 \\\n 2 3\\\n 4\r\n", "fo 1 2 3 4 # old style"] {
        let model = decode(&format!("{SQUARE}{faces}")).expect(faces);
        assert_eq!(model.name, "shape");
        assert_eq!(model.meshes[0].mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert!(model.warnings.is_empty(), "{:?}", model.warnings);
    }
}

#[test]
fn a_byte_order_mark_is_skipped_and_lines_may_end_in_carriage_returns_alone() {
    let text = format!("{SQUARE}usemtl a\nmtllib a.mtl\nf 1 2 3 4\n");
    let library = "newmtl a\nKd 0 1 0\n";
    let plain = decode(&format!("{SQUARE}f 1 2 3 4\n")).expect("fine");
    for form in [|text: &str| format!("\u{feff}{text}"), |text: &str| text.replace('\n', "\r")] {
        let companions = Resolver::memory().with("a.mtl", form(library).into_bytes());
        let model = decode_obj(form(&text).as_bytes(), Path::new("a/shape.obj"), &companions).expect("fine");
        assert_eq!(model.meshes[0].mesh.positions, plain.meshes[0].mesh.positions);
        assert_eq!(model.meshes[0].mesh.triangles, plain.meshes[0].mesh.triangles);
        assert_eq!(model.materials[0].base_color, glam::Vec4::new(0.0, 1.0, 0.0, 1.0));
        assert!(model.warnings.is_empty(), "{:?}", model.warnings);
    }
    assert!(message("v 0 0 0\rv 1 0\r").contains("line 2: a position has 2 numbers"));
}

#[test]
fn faces_may_stand_before_their_vertices() {
    assert_eq!(decode(&format!("f 1 2 3\n{SQUARE}")).expect("fine").triangle_count(), 1);
    assert!(message("f 1 2 3\nv 0 0 0\n").contains("line 1: a face refers to position 3, but there are 1"));
}

#[test]
fn corners_with_coordinates_of_their_own_get_vertices_of_their_own() {
    let text = format!("{SQUARE}vt 0 0\nvt 1 0\nvt 1 1\nvt 0.5 0.25\nf 1/1 2/2 3/3\nf 1/4 3/3 4/1\n");
    let mesh = decode(&text).expect("fine").meshes[0].mesh.clone();
    assert_eq!(mesh.triangles, [[0, 1, 2], [3, 2, 4]]);
    assert_eq!(mesh.positions[3], Vec3::ZERO);
    // v is turned to count downwards.
    assert_eq!(mesh.uvs, [Vec2::new(0.0, 1.0), Vec2::ONE, Vec2::X, Vec2::new(0.5, 0.75), Vec2::Y]);
    assert!(mesh.normals.is_empty());
}

#[test]
fn missing_normals_come_from_the_triangles_around() {
    let text = format!("{SQUARE}vn 0 0 2\nvn nan 0 0\nf 1//1 2//2 3\n");
    let model = decode(&text).expect("fine");
    assert_eq!(model.meshes[0].mesh.normals, [Vec3::Z; 3]);
    assert_eq!(model.warnings, ["shape: 3 normals had no unit length and were replaced"]);
}

#[test]
fn colours_behind_positions_are_srgb() {
    let mesh =
        decode("v 0 0 0 1 0.5 0\nv 1 0 0 1\nv 0 1 0 1 1 1\nf 1 2 3\n").expect("fine").meshes[0].mesh.clone();
    assert!((mesh.colors[0] - Vec3::new(1.0, 0.2140, 0.0)).length() < 1e-3);
    assert_eq!(mesh.colors[1], Vec3::ONE);
    assert_eq!(
        decode("v 0 0 0 0.5 0.5 0.5\nv 0 0 0\nv 1 1 1\nf 1 2 3").expect("fine").meshes[0].mesh.colors.len(),
        3
    );
}

#[test]
fn what_is_wrong_is_said_with_its_line() {
    assert_eq!(
        message("v 0 0 0\nv 1 0\n"),
        "cannot load the OBJ mesh a/shape.obj: line 2: a position has 2 numbers where three are needed"
    );
    assert!(message("v 0 0 nan\nf 1 1 1").contains("line 1: NaN where a finite number is expected"));
    assert!(message("v 0 0 1e99\nf 1 1 1").contains("line 1: inf"));
    assert!(message("v 0 0 x\n").contains("`x` is not a number"));
    assert!(
        message(&format!("{SQUARE}f 1 2 5\n"))
            .contains("line 5: a face refers to position 5, but there are 4")
    );
    assert!(message(&format!("{SQUARE}f 1 2 0\n")).contains("line 5"));
    assert!(message(&format!("{SQUARE}f 1 2 -5\n")).contains("refers to position `-5`"));
    assert!(message(&format!("{SQUARE}f 1/1 2/1 3/1\n")).contains("texture coordinate 1, but there are 0"));
    assert!(message(&format!("{SQUARE}f 1//9 2 3\n")).contains("normal 9"));
    assert!(message(&format!("{SQUARE}f 1/1/1/1 2 3\n")).contains("not a corner"));
    assert!(message(&format!("{SQUARE}f 99999999999999999999 2 3\n")).contains("not a corner"));
    assert!(message(&format!("{SQUARE}f 4294967296 2 3\n")).contains("line 5"));
    assert!(message("").contains("the file is empty"));
    assert!(message(SQUARE).contains("there are no faces"));
    assert!(message("\u{1}\u{2}PNG\n").contains("line 1: `\\u{1}\\u{2}PNG` is not an OBJ statement"));
}

#[test]
fn what_is_left_out_is_said() {
    let text = format!("{SQUARE}f 1 2 3\nl 1 2\np 1\nf 1 2\nwobble 3\ncurv 0 1 1 2\n");
    let warnings = decode(&text).expect("fine").warnings;
    assert_eq!(warnings.len(), 4, "{warnings:?}");
}

const MATERIALS: &str = "
# a comment
newmtl plain
Kd 0.5 0.25 0.125
illum 1
Ns 90
newmtl shiny
Kd 0.5 0.5 0.5
Ks 1 1 1
Ns 30
illum 2
map_Kd -s 2 3 -o 0.1 0.2 0 -clamp on wood grain.png
map_bump -bm 0.3 bump.png
norm normal.png
Ke 1 2 3
newmtl glass
Kd 1 1 1
d 0.1
Ni 1.33
illum 7
newmtl gold
Kd 0 0 0
Ks 1 0.8 0.3
Ns 200
illum 3
newmtl leaf
map_Kd leaf.png
map_d leaf.png
newmtl holes
map_Kd wood grain.png
map_d leaf.png
newmtl curtain
Tr 0.25
";

fn with_materials(used: &str) -> Result<Model, LoadError> {
    let mut companions = Resolver::memory().with("stuff.mtl", MATERIALS.into());
    for picture in ["wood grain.png", "bump.png", "normal.png", "leaf.png"] {
        companions = companions.with(picture, vec![1, 2, 3]);
    }
    let text = format!("mtllib stuff.mtl\n{SQUARE}{used}");
    decode_obj(text.as_bytes(), Path::new("shape.obj"), &companions)
}

#[test]
fn materials_are_slots_by_first_use() {
    let used =
        "f 1 2 3\nusemtl shiny\nf 1 2 3 4\nusemtl plain\nusemtl gold\nf 1 2 4\nusemtl shiny\nf 1 2 3\n";
    let model = with_materials(used).expect("fine");
    let names: Vec<&str> = model.materials.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(names, ["", "shiny", "plain", "gold"]);
    assert_eq!(model.meshes[0].mesh.material_slots, [0, 1, 1, 3, 1]);
}

#[test]
fn materials_become_metallic_roughness() {
    let names = ["plain", "shiny", "glass", "gold", "leaf", "holes", "curtain", "none"];
    // Each material needs a face, or it is never used.
    let used: String = names.iter().map(|name| format!("usemtl {name}\nf 1 2 3\n")).collect();
    let model = with_materials(&used).expect("fine");
    let by_name = |name: &str| model.materials.iter().find(|m| m.name == name).expect(name);
    let plain = by_name("plain");
    assert_eq!(plain.base_color.to_array(), [0.5, 0.25, 0.125, 1.0]);
    assert_eq!((plain.metallic, plain.roughness, plain.ior), (0.0, 1.0, 1.0));
    let shiny = by_name("shiny");
    assert!((shiny.roughness - 0.5).abs() < 1e-6);
    assert_eq!(shiny.emissive, Vec3::new(1.0, 2.0, 3.0));
    assert_eq!(shiny.bump_scale, 0.3);
    let texture = shiny.base_color_texture.as_ref().expect("it has one");
    assert_eq!(texture.wrap_u, Wrap::ClampToEdge);
    // The picture's lower left corner, (0, 0) upwards, is looked up at the offset (0.1, 0.2) upwards.
    assert!(
        (texture.uv_transform.transform_point2(Vec2::new(0.0, 1.0)) - Vec2::new(0.1, 0.8)).length() < 1e-6
    );
    assert!(
        (texture.uv_transform.transform_point2(Vec2::new(1.0, 0.0)) - Vec2::new(2.1, -2.2)).length() < 1e-6
    );
    assert_eq!(
        model.images[texture.image],
        ModelImage::Encoded { bytes: vec![1, 2, 3], name: "wood grain.png".into() }
    );
    assert!(shiny.normal_texture.is_some() && shiny.bump_texture.is_some());
    let glass = by_name("glass");
    assert!((glass.transmission - 0.9).abs() < 1e-6 && glass.ior == 1.33 && glass.roughness == 0.0);
    let gold = by_name("gold");
    assert_eq!((gold.metallic, gold.base_color.z), (1.0, 0.3));
    assert_eq!(by_name("leaf").alpha_mode, AlphaMode::Mask { cutoff: 0.5 });
    assert_eq!((by_name("curtain").alpha_mode, by_name("curtain").base_color.w), (AlphaMode::Blend, 0.75));
    let holes = by_name("holes").opacity_texture.as_ref().expect("a picture of its own");
    assert_eq!(by_name("holes").alpha_mode, AlphaMode::Mask { cutoff: 0.5 });
    assert!(model.images.len() > holes.image && by_name("leaf").opacity_texture.is_none());
    assert_eq!(by_name("none").base_color.x, 0.8);
    assert!(by_name("none").stand_in && !by_name("plain").stand_in);
    assert!(model.warnings[0].contains("`none`"), "{:?}", model.warnings);
}

#[test]
fn a_missing_material_file_is_a_warning_and_a_missing_texture_an_error() {
    let model = decode(&format!("mtllib gone.mtl\nusemtl oak\n{SQUARE}f 1 2 3\n")).expect("fine");
    assert_eq!(model.materials[0].name, "oak");
    assert!(model.warnings[0].contains("gone.mtl"), "{:?}", model.warnings);

    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("written");
    write("a.obj", &format!("mtllib a.mtl\nusemtl wood\n{SQUARE}f 1 2 3\n"));
    write("a.mtl", "newmtl wood\nmap_Kd textures\\Wood_Colour.png\n");
    let error = crate::load_model(&folder.path().join("a.obj")).expect_err("no texture").to_string();
    assert!(error.contains("Wood_Colour.png"), "{error}");
    std::fs::create_dir(folder.path().join("textures")).expect("made");
    write("textures/wood_color.png", "");
    write("a.mtl", "newmtl wood\nmap_Kd textures/wood_colour.png\n");
    let error = crate::load_model(&folder.path().join("a.obj")).expect_err("no texture").to_string();
    assert!(error.contains("the nearest name there is") && error.contains("wood_color.png"), "{error}");
    // As made on a system that does not mind case or slashes.
    write("a.mtl", "newmtl wood\nmap_Kd Textures\\WOOD_color.png\n");
    let model = crate::load_model(&folder.path().join("a.obj")).expect("found");
    assert_eq!(model.images, [ModelImage::File(folder.path().join("textures").join("wood_color.png"))]);
}

#[test]
fn a_damaged_material_file_is_an_error_with_its_line() {
    let companions = Resolver::memory().with("m.mtl", b"newmtl a\nKd 1 x 1\n".to_vec());
    let text = format!("mtllib m.mtl\n{SQUARE}f 1 2 3\n");
    let error =
        decode_obj(text.as_bytes(), Path::new("s.obj"), &companions).expect_err("refused").to_string();
    assert_eq!(error, "cannot load the OBJ material file m.mtl: line 2: `x` is not a number");
    let companions = Resolver::memory().with("m.mtl", b"newmtl a\nKd 1e99 1 1\n".to_vec());
    decode_obj(text.as_bytes(), Path::new("s.obj"), &companions).expect_err("infinite");
}

#[test]
fn the_meshes_at_hand_have_the_triangles_their_list_says() {
    let folder = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/meshes"));
    let counts = [
        ("armadillo", 86_482),
        ("dragon_100k", 100_000),
        ("happy_buddha_100k", 100_000),
        ("suzanne", 968),
        ("teapot", 6_320),
        ("car_smart", 3_730),
        ("chair_oak", 31_786),
        ("couch_winchester", 23_305),
        ("table_oak", 5_160),
    ];
    for (name, triangles) in counts {
        let path = folder.join(format!("{name}.obj"));
        if !path.exists() {
            eprintln!("skipped: {} is not there", path.display());
            continue;
        }
        let start = std::time::Instant::now();
        let model = crate::load_model(&path).expect(name);
        eprintln!("{name}: {:?} {:?}", start.elapsed(), model.warnings);
        assert_eq!(model.triangle_count(), triangles, "{name}");
        assert!(model.bounds(0.0).is_some());
    }
}
