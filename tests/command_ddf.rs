//! `halflight ddf` and scenes with fields, as a user meets them: what is said, what is refused.

mod support;

use support::{Outcome, Place};

/// A place with a field of its octahedron, which was trained for two steps.
fn place() -> Place {
    let place = Place::new();
    place.done("ddf train bunny.ply --steps 2 --resolution 16");
    place
}

fn refused(place: &Place, line: &str, with: &str) {
    let outcome = place.run(line);
    assert!(outcome.code != 0 && outcome.stderr.contains(with), "{line}: {outcome:?}");
}

fn warned(outcome: &Outcome, of: &str) -> bool {
    outcome.stderr.contains(of)
}

fn scene(place: &Place, name: &str, shape: &str) {
    let text = format!(
        "[camera]\norigin = [0, 1, 4]\ntarget = [0, 0, 0]\n[environment]\ntype = \"sky\"\n[[shape]]\nname = \"s\"\n{shape}\n"
    );
    place.write(name, &text);
}

const QUICK: &str = "--size 24x16 --spp 1";

#[test]
fn options_that_would_do_nothing_are_refused() {
    let place = place();
    refused(&place, "ddf train bunny.ply --steps 1 --schedule printed", "--schedule");
    refused(&place, "ddf train bunny.ply --steps 1 --network seed --resolution 64", "--resolution");
    refused(&place, "ddf train bunny.ply --steps 0", "--steps");
    refused(&place, "ddf samples bunny.ply -o s.samples --scheme random --count 0", "--count");
    refused(&place, "ddf samples bunny.ply -o s.samples --faces 0", "--faces");
    refused(&place, "ddf render bunny.ddf --show difference", "FIELD MESH");
    assert!(!place.path("s.samples").exists() && !place.path("field.png").exists());
}

#[test]
fn a_field_of_another_mesh_is_said_wherever_both_are_named() {
    let place = place();
    let stretched =
        std::fs::read_to_string(place.path("bunny.ply")).expect("the mesh").replace("1 0 0", "2 0 0");
    place.write("other.ply", &stretched);
    let said = "not the mesh that";
    scene(&place, "own.toml", "type = \"mesh\"\nfile = \"bunny.ply\"");
    scene(&place, "other.toml", "type = \"mesh\"\nfile = \"other.ply\"");
    for (mesh, scene, is_other) in [("bunny.ply", "own.toml", false), ("other.ply", "other.toml", true)] {
        let lines = [
            format!("render {scene} --shape s=bunny.ddf {QUICK} -o x.png"),
            format!("ddf render bunny.ddf {mesh} --size 16 -o x.png"),
            format!("ddf eval bunny.ddf {mesh} --points 200"),
        ];
        for line in lines {
            assert_eq!(warned(&place.done(&line), said), is_other, "{line}");
        }
    }
}

#[test]
fn what_a_field_cannot_stand_for_is_said_or_refused() {
    let place = place();
    place.write("moving.gltf", MOVING);
    scene(&place, "moving.toml", "type = \"mesh\"\nfile = \"moving.gltf\"\nfield = \"bunny.ddf\"");
    refused(&place, &format!("render moving.toml {QUICK} -o x.png"), "is animated");
    scene(
        &place,
        "smooth.toml",
        "type = \"mesh\"\nfile = \"bunny.ply\"\nfield = \"bunny.ddf\"\nshading = \"smooth\"",
    );
    assert!(warned(&place.done(&format!("render smooth.toml {QUICK} -o x.png")), "`shading` is left out"));
    let textured = "type = \"mesh\"\nfile = \"bunny.ply\"\nfield = \"bunny.ddf\"\nmaterial = { type = \"diffuse\", albedo = \"hall.hdr\" }";
    scene(&place, "textured.toml", textured);
    assert!(warned(&place.done(&format!("render textured.toml {QUICK} -o x.png")), "no texture coordinates"));
}

#[test]
fn glass_needs_a_field_that_knows_its_sides() {
    let place = place();
    place.done("ddf samples bunny.ply -o s.samples --scheme random --count 2000");
    place.done("ddf train bunny.ply --samples s.samples --steps 2 --resolution 16 -o sampled.ddf");
    let line = |field: &str| format!("render {field} {QUICK} --material \"dielectric ior=1.5\" -o x.png");
    let said = "does not know where light enters";
    assert!(warned(&place.done(&line("sampled.ddf")), said));
    assert!(!warned(&place.done(&line("bunny.ddf")), said));
}

#[test]
fn where_the_mesh_was_asked_is_a_layer_of_the_picture() {
    let place = place();
    place.done("ddf render bunny.ddf bunny.ply --fallback --size 24 -o own.exr");
    // Two steps leave a field in doubt about nearly everything.
    let share = |name: &str| {
        let picture = place.exr(name);
        let layer = picture.channels.iter().find(|channel| channel.name.starts_with("fallback"));
        let values = &layer.expect("the layer").values;
        values.iter().sum::<f32>() / values.len() as f32
    };
    assert!(share("own.exr") > 0.05);
    scene(
        &place,
        "both.toml",
        "type = \"mesh\"\nfile = \"bunny.ply\"\nfield = \"bunny.ddf\"\nfield_fallback = true",
    );
    let outcome = place.done(&format!("render both.toml {QUICK} -o both.exr"));
    assert!(share("both.exr") > 0.02, "{outcome:?}");
}

#[test]
fn an_evaluation_says_what_it_knows_and_dashes_else() {
    let place = place();
    let outcome = place.done("ddf eval bunny.ddf bunny.ply --points 200");
    let training = outcome.stdout.lines().find(|line| line.contains("training")).expect("a line on training");
    assert!(training.trim_end().ends_with("2 steps"), "{training}");
    assert!(!outcome.stdout.contains("-0"), "{}", outcome.stdout);
}

#[test]
fn broken_fields_are_refused_by_every_command_and_leave_no_file() {
    let place = place();
    let bytes = std::fs::read(place.path("bunny.ddf")).expect("the field");
    std::fs::write(place.path("cut.ddf"), &bytes[..bytes.len() / 2]).expect("written");
    std::fs::write(place.path("empty.ddf"), []).expect("written");
    for field in ["cut.ddf", "empty.ddf", "bunny.ply"] {
        for line in [
            format!("ddf render {field} -o out.png"),
            format!("ddf eval {field} bunny.ply"),
            format!("ddf mesh {field} -o out.ply"),
        ] {
            refused(&place, &line, field);
        }
    }
    for name in ["empty.obj", "nan.obj", "far.obj"] {
        let text = match name {
            "empty.obj" => "",
            "nan.obj" => "v 0 0 0\nv nan 1 0\nv 1 0 0\nf 1 2 3\n",
            _ => "v 0 0 0\nv 1e30 1 0\nv 1 1e30 0\nf 1 2 3\n",
        };
        place.write(name, text);
        refused(&place, &format!("ddf train {name} --steps 1 -o out.ddf"), name);
    }
    assert!(
        !place.path("out.png").exists() && !place.path("out.ply").exists() && !place.path("out.ddf").exists()
    );
}

#[test]
fn a_field_becomes_a_mesh_with_its_progress_shown() {
    let place = place();
    place.done("ddf mesh bunny.ddf -o again.ply --posts 24");
    place.done("ddf mesh bunny.ddf -o again2.ply --posts 24 --directions 32");
    assert!(place.path("again.ply").exists() && place.path("again2.ply").exists());
}

/// A triangle that moves.
const MOVING: &str = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
"buffers":[{"byteLength":68,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/AAAAAAAAAAA="}],
"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":8},{"buffer":0,"byteOffset":44,"byteLength":24}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},{"bufferView":1,"componentType":5126,"count":2,"type":"SCALAR","min":[0],"max":[1]},{"bufferView":2,"componentType":5126,"count":2,"type":"VEC3"}],
"animations":[{"samplers":[{"input":1,"output":2}],"channels":[{"sampler":0,"target":{"node":0,"path":"translation"}}]}]}"#;
