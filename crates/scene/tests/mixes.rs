//! Materials of two others: in which order they are declared does not matter, and what cannot be mixed is told.

use std::path::Path;

use halflight_image::RgbImage;
use halflight_material::{Material, MaterialKind};
use halflight_scene::{LoadOptions, Scene};

const PARTS: &str = "
[material.clay]
type = \"diffuse\"
albedo = 0.5
[material.lamp]
type = \"emissive\"
[material.bumpy]
type = \"diffuse\"
normal_map = \"mask.hdr\"
[material.thin]
type = \"diffuse\"
opacity = 0.5
[[shape]]
type = \"sphere\"
material = \"mix\"
";

fn scene_in(folder: &Path, text: &str) -> Result<Scene, String> {
    let path = folder.join("scene.toml");
    std::fs::write(&path, text).expect("the scene is written");
    Scene::load(&path, &LoadOptions::default()).map_err(|error| error.to_string())
}

fn pictures(folder: &Path) {
    let checker = RgbImage::from_fn(8, 8, |x, y| [((x / 4 + y / 4) % 2) as f32; 3]);
    halflight_image::save_hdr(&folder.join("mask.hdr"), &checker).expect("the mask is written");
    let bright = RgbImage::from_fn(2, 2, |x, _| [x as f32 * 3.0; 3]);
    halflight_image::save_hdr(&folder.join("bright.hdr"), &bright).expect("the picture is written");
}

fn material<'a>(scene: &'a Scene, name: &str) -> &'a Material {
    scene.materials().iter().find(|m| m.name == name).expect("the scene has that material")
}

#[test]
fn a_mix_may_be_declared_before_its_parts_and_be_part_of_another() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    pictures(folder.path());
    let text = format!(
        "[material.mix]\ntype = \"mix\"\nfirst = \"half\"\nsecond = {{ type = \"mirror\" }}\nmask = \"mask.hdr\"\n\
         [material.half]\ntype = \"mix\"\nfirst = \"clay\"\nsecond = \"gold\"\n\
         [material.gold]\ntype = \"conductor\"\nmetal = \"gold\"\n{PARTS}"
    );
    let scene = scene_in(folder.path(), &text).unwrap_or_else(|error| panic!("{error}"));
    let mix = material(&scene, "mix");
    let MaterialKind::Mix { parts, .. } = &mix.kind else { panic!("a mix") };
    let MaterialKind::Mix { parts: inner, .. } = &parts[0].kind else { panic!("a mix in a mix") };
    assert!(matches!(inner[0].kind, MaterialKind::Diffuse { .. }));
    assert!(matches!(inner[1].kind, MaterialKind::Conductor { .. }));
    assert_eq!(mix.leaves().len(), 3);
    let at = |u: f32| {
        let input = halflight_material::SurfaceInput { uv: glam::Vec2::new(u, 0.2), ..Default::default() };
        mix.bsdf(&input).is_delta_only()
    };
    assert!(!at(0.2) && at(0.7), "half of the checker is a mirror");
}

#[test]
fn what_cannot_be_mixed_is_told_with_its_line() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    pictures(folder.path());
    for (mix, parts) in [
        ("first = \"clai\"\nsecond = \"clay\"", &[":3:9", "there is no material `clai`", "`clay`"] as &[_]),
        ("first = \"mix\"\nsecond = \"clay\"", &[":3:9", "made of itself: `mix`, of `mix`"]),
        (
            "first = \"clay\"\nsecond = \"b\"\n[material.b]\ntype = \"mix\"\nfirst = \"clay\"\nsecond = \"mix\"",
            &[":8:10", "`mix`, of `b`, of `mix`"],
        ),
        ("first = \"clay\"\nsecond = \"lamp\"", &[":4:10", "`lamp` is part of a mix", "a `radiance`"]),
        ("first = \"bumpy\"\nsecond = \"clay\"", &[":3:9", "a `normal_map`", "in the mix itself"]),
        ("first = \"clay\"\nsecond = \"thin\"", &[":4:10", "an `opacity`"]),
        ("first = \"clay\"\nsecond = { type = \"diffuse\", emission = 1 }", &[":4:10", "an `emission`"]),
        ("first = \"clay\"", &[":1:", "second"]),
        ("first = \"clay\"\nsecond = 3", &[":4:10", "the name of a material"]),
        ("first = \"clay\"\nsecond = \"clay\"\nmask = 1.5", &[":5:8", "from 0 to 1", "1.5"]),
        ("first = \"clay\"\nsecond = \"clay\"\nmask = -0.1", &[":5:8", "-0.1"]),
        ("first = \"clay\"\nsecond = \"clay\"\nmask = nan", &[":5:8", "nan"]),
        ("first = \"clay\"\nsecond = \"clay\"\nmask = \"none.png\"", &[":5:8", "none.png"]),
        (
            "first = \"clay\"\nsecond = \"clay\"\nmask = \"bright.hdr\"",
            &[":5:8", "the mask is 3 in column 1 and row 0", "`factor`"],
        ),
        ("first = \"clay\"\nsecond = \"clay\"\nmusk = 0.1", &[":5:1", "`mask`"]),
    ] {
        let text = format!("[material.mix]\ntype = \"mix\"\n{mix}\n{PARTS}");
        let Err(error) = scene_in(folder.path(), &text) else { panic!("{mix}: a mistake") };
        for part in parts {
            assert!(error.contains(part), "{mix}: {part} is not in\n{error}");
        }
    }
}

#[test]
fn mixes_may_not_go_so_deep_that_a_point_asks_hundreds_of_materials() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    pictures(folder.path());
    let chain = |length: usize| {
        let mut text = String::new();
        for i in 1..=length {
            let name = if i == length { "mix".to_string() } else { format!("m{i}") };
            let part = if i == 1 { "clay".to_string() } else { format!("m{}", i - 1) };
            text += &format!("[material.{name}]\ntype = \"mix\"\nfirst = \"{part}\"\nsecond = \"{part}\"\n");
        }
        scene_in(folder.path(), &(text + PARTS))
    };
    assert!(chain(8).is_ok());
    // From the deepest up, or from the uppermost down: it is the depth that counts, not the order.
    let error = chain(9).err().unwrap_or_default();
    assert!(error.contains("deeper"), "{error}");
}
