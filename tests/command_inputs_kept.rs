//! A render never overwrites what its scene is made from.

mod support;

use halflight::image::{RgbImage, ToneMapping, save_png};
use support::Place;

/// A scene with a texture beside it, a model that names its buffer and the same picture, and a link to the folder.
fn with_files() -> Place {
    let place = Place::new();
    let picture = RgbImage::from_fn(8, 8, |x, y| [x as f32 / 8.0, y as f32 / 8.0, 0.5]);
    save_png(&place.path("tex.png"), &picture, &ToneMapping::default()).expect("a picture can be written");
    let material = "material = { type = \"diffuse\", albedo = \"tex.png\" }";
    place.write("tex.toml", &format!("[[shape]]\ntype = \"sphere\"\nradius = 1\n{material}\n"));
    place.write("lib.mtl", "newmtl red\nKd 1 0 0\n");
    place.write("m.obj", "mtllib lib.mtl\nusemtl red\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    std::fs::create_dir(place.path("sub")).expect("a folder can be made");
    place
}

#[test]
fn outputs_upon_inputs_or_upon_each_other_are_refused_and_nothing_is_lost() {
    let place = with_files();
    let kept = ["tex.png", "tex.toml", "scene.toml", "bunny.ply", "hall.hdr", "lib.mtl", "m.obj"];
    let before: Vec<Vec<u8>> = kept.iter().map(|name| std::fs::read(place.path(name)).unwrap()).collect();
    for (line, part) in [
        ("render tex.toml -o tex.png", "-o other.png"),
        ("render tex.toml -o ./sub/../tex.png", "-o other.png"),
        ("render hall.hdr -o hall.hdr", "made from this file"),
        ("render bunny.ply --environment hall.hdr -o hall.hdr", "made from this file"),
        ("render bunny.ply -o a.png --checkpoint bunny.ply", "--checkpoint other"),
        ("render scene.toml -o a.png --stats sub/../scene.toml", "--stats other.json"),
        ("render m.obj -o a.png --stats lib.mtl", "made from this file"),
        ("render scene.toml -o a.exr --checkpoint ./a.exr", "one file"),
        ("render scene.toml -o a.exr --checkpoint c --stats c", "one file"),
    ] {
        let outcome = place.run(&format!("{line} --spp 1 --size 8x8"));
        assert!(outcome.code == 2 && outcome.stderr.contains(part), "{line}: {outcome:?}");
    }
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(place.path("tex.png"), place.path("link.png")).unwrap();
        let outcome = place.run("render tex.toml -o link.png --spp 1 --size 8x8");
        assert_eq!(outcome.code, 2, "{outcome:?}");
    }
    for (name, bytes) in kept.iter().zip(&before) {
        assert!(std::fs::read(place.path(name)).unwrap() == *bytes, "{name}");
    }
    assert!(!place.path("a.png").exists() && !place.path("a.exr").exists());
}

#[test]
fn the_default_name_gives_way_to_a_file_of_the_scene() {
    let place = with_files();
    let before = std::fs::read(place.path("tex.png")).unwrap();
    for _ in 0..2 {
        let outcome = place.done("render tex.toml --spp 1 --size 8x8");
        assert!(outcome.stderr.contains("goes to tex.render.png"), "{outcome:?}");
    }
    assert!(place.path("tex.render.png").is_file() && !place.path("tex.render2.png").exists());
    assert!(std::fs::read(place.path("tex.png")).unwrap() == before);
}
