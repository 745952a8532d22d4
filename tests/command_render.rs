//! `halflight render`, as a user meets it.

mod support;

use halflight::image::{RgbImage, load_rgb, save_hdr};
use support::{Place, bits};

#[test]
fn a_scene_becomes_an_exr_with_layers_and_metadata() {
    let place = Place::new();
    place.done("render scene.toml --spp 4 --seed 7 -o out.exr");
    let picture = place.exr("out.exr");
    assert_eq!((picture.width, picture.height), (48, 27));
    let mut names: Vec<&str> = picture.channels.iter().map(|c| c.name.as_str()).collect();
    names.sort_unstable();
    let mut expected = vec![
        "A",
        "B",
        "G",
        "R",
        "albedo.B",
        "albedo.G",
        "albedo.R",
        "depth.Z",
        "material.id",
        "normal.X",
        "normal.Y",
        "normal.Z",
        "position.X",
        "position.Y",
        "position.Z",
        "samples",
        "variance",
    ];
    expected.sort_unstable();
    assert_eq!(names, expected);
    assert!(picture.channel("samples").unwrap().iter().all(|&s| s == 4.0));
    assert!(picture.rgb().unwrap().pixels.iter().flatten().all(|v| v.is_finite()));
    for key in ["version", "scene_hash", "command", "seed", "samples", "seconds"] {
        assert!(picture.metadata.contains_key(key), "{key} in {:?}", picture.metadata);
    }
    assert_eq!(picture.metadata["seed"], "7");
}

#[test]
fn a_bare_mesh_becomes_a_picture_named_after_it() {
    let place = Place::new();
    let outcome = place.done("render bunny.ply --spp 2 --size 32x18");
    assert!(outcome.stderr.contains("bunny.png"), "{outcome:?}");
    let image = load_rgb(&place.path("bunny.png")).unwrap();
    assert_eq!((image.width, image.height), (32, 18));
    assert!(image.pixels.iter().any(|p| p[0] > 0.05));
}

#[test]
fn environment_material_and_settings_change_the_picture() {
    let place = Place::new();
    place.done("render bunny.ply --spp 1 --size 16x9 -o plain.exr");
    let plain = place.exr("plain.exr").rgb().unwrap();
    for change in [
        "--environment hall.hdr",
        "--material \"phong exponent=40\"",
        "--set path.max_depth=1",
        "--max-depth 1",
        "-t path:max_depth=1",
        "--seed 5",
    ] {
        place.done(&format!("render bunny.ply --spp 1 --size 16x9 -o other.exr {change}"));
        assert_ne!(place.exr("other.exr").rgb().unwrap(), plain, "{change}");
    }
    place.done("render scene.toml --spp 1 -o a.exr --set camera.vertical_fov_degrees=70");
    place.done("render scene.toml --spp 1 -o b.exr");
    assert_ne!(place.exr("a.exr").rgb(), place.exr("b.exr").rgb());
}

#[test]
fn the_picture_does_not_depend_on_the_number_of_threads() {
    let place = Place::new();
    place.done("render scene.toml --spp 3 --threads 1 -o one.exr");
    place.done("render scene.toml --spp 3 --threads 2 -o two.exr");
    place.done("render scene.toml --spp 3 --threads 5 -o five.exr");
    let one = bits(&place.exr("one.exr"));
    assert!(one == bits(&place.exr("two.exr")) && one == bits(&place.exr("five.exr")));
}

#[test]
fn the_instruction_set_can_be_pinned() {
    let place = Place::new();
    place.done("render scene.toml --spp 1 --simd baseline -o out.exr");
    assert_eq!(place.exr("out.exr").metadata["simd"], "baseline");
    assert_eq!(place.run("render scene.toml --simd sse9 -o out.exr").code, 2);
}

#[test]
fn a_sequence_numbers_its_frames_and_shows_the_motion() {
    let place = Place::new();
    place.done("render scene.toml --spp 1 --frames 2..4 --fps 2 -o out.###.exr");
    place.done("render scene.toml --spp 1 --frames 7..7 -o plain.exr");
    let names: Vec<String> = place.files("").into_iter().filter(|n| n.ends_with(".exr")).collect();
    assert_eq!(names, ["out.002.exr", "out.003.exr", "out.004.exr", "plain.0007.exr"]);
    assert_ne!(place.exr("out.002.exr").channel("depth.Z"), place.exr("out.004.exr").channel("depth.Z"));
    // Frame 4 at 2 a second is frame 48 at 24.
    place.done("render scene.toml --spp 1 --frame 48 -o still.exr");
    assert_eq!(place.exr("still.exr").rgb(), place.exr("out.004.exr").rgb());
    place.done("render scene.toml --spp 1 --frame 1.5 --fps 1 -o between.exr");
    assert_eq!(place.exr("between.exr").metadata["time_seconds"], "1.5");
}

#[test]
fn frames_may_be_negative_or_between_and_their_names_say_so() {
    let place = Place::new();
    place.done("render scene.toml --spp 1 --size 8x8 --frames -1..0 -o n.##.png");
    place.done("render scene.toml --spp 1 --size 8x8 --frame 1.5 -o y.####.png");
    let names: Vec<String> = place.files("").into_iter().filter(|n| n.ends_with(".png")).collect();
    assert_eq!(names, ["n.-01.png", "n.00.png", "y.0001.5.png"]);
}

#[test]
fn layers_are_chosen_and_only_where_they_can_be_kept() {
    let place = Place::new();
    place.done("render scene.toml --spp 1 --layers depth,albedo --half -o out.exr");
    let picture = place.exr("out.exr");
    assert!(picture.channel("depth.Z").is_some() && picture.channel("albedo.R").is_some());
    assert!(picture.channel("normal.X").is_none());
    let outcome = place.run("render scene.toml --spp 1 --layers depth -o out.png");
    assert_eq!(outcome.code, 2, "{outcome:?}");
    let outcome = place.run("render scene.toml --spp 1 --layers dept -o out.exr");
    assert!(outcome.code == 2 && outcome.stderr.contains("did you mean depth?"), "{outcome:?}");
}

#[test]
fn exposure_makes_a_png_brighter_and_hdr_holds_radiance() {
    let place = Place::new();
    let mean = |name: &str| {
        let image = load_rgb(&place.path(name)).unwrap();
        image.pixels.iter().flatten().sum::<f32>() / (3 * image.pixels.len()) as f32
    };
    place.done("render scene.toml --spp 2 -o dark.png --exposure -3");
    place.done("render scene.toml --spp 2 -o bright.png --exposure -1 --tone filmic");
    place.done("render scene.toml --spp 2 -o out.hdr");
    place.done("render scene.toml --spp 2 -o out.exr");
    assert!(mean("bright.png") > 1.5 * mean("dark.png"));
    assert!((mean("out.hdr") / mean("out.exr") - 1.0).abs() < 0.02);
}

#[test]
fn a_bare_environment_map_is_exposed_by_what_it_shows() {
    let place = Place::new();
    let mean = |name: &str| {
        let image = load_rgb(&place.path(name)).unwrap();
        image.pixels.iter().flatten().sum::<f32>() / (3 * image.pixels.len()) as f32
    };
    let dim = RgbImage::from_fn(16, 8, |x, y| if (x, y) == (4, 2) { [3.0; 3] } else { [1e-3, 2e-3, 1e-3] });
    save_hdr(&place.path("night.hdr"), &dim).unwrap();
    let outcome = place.done("render night.hdr --spp 4 --size 32x18 -o night.png");
    assert!(outcome.stderr.contains("EV, by the mean of the picture"), "{outcome:?}");
    // Loaded as linear radiance: middle grey is 0.18.
    assert!((0.1..0.5).contains(&mean("night.png")), "{}", mean("night.png"));
    let outcome = place.done("render night.hdr --spp 4 --size 32x18 -o dark.png --exposure 0");
    assert!(!outcome.stderr.contains("EV") && mean("dark.png") < 0.5 * mean("night.png"), "{outcome:?}");
}

#[test]
fn the_first_limit_that_is_reached_ends_the_work() {
    let place = Place::new();
    let start = std::time::Instant::now();
    place.done("render scene.toml --time-limit 0.3 -o time.exr");
    assert!(start.elapsed().as_secs_f64() < 20.0);
    place.done("render scene.toml --error 0.3 --spp 4096 -o error.exr");
    let samples: f64 = place.exr("error.exr").metadata["samples"].parse().unwrap();
    assert!(samples < 4096.0, "{samples}");
}

#[test]
fn figures_go_to_a_file_and_events_to_programs() {
    let place = Place::new();
    let outcome = place.done("render scene.toml --spp 2 -o out.exr --stats out.json --json");
    let done = outcome.event("done");
    assert_eq!(done["frames"][0]["samples"], 2.0);
    assert_eq!(done["frames"][0]["output"], "out.exr");
    let stats: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(place.path("out.json")).unwrap()).unwrap();
    assert_eq!(stats["width"], 48);
    assert!(stats["frames"][0]["rays"].as_u64().unwrap() > 2 * 48 * 27);
}

#[test]
fn quiet_says_nothing_and_a_log_gets_plain_lines() {
    let place = Place::new();
    let quiet = place.done("render scene.toml --spp 1 -o out.exr --quiet");
    assert_eq!((quiet.stdout.as_str(), quiet.stderr.as_str()), ("", ""));
    let plain = place.done("render scene.toml --spp 1 -o out.exr");
    assert!(plain.stdout.is_empty() && !plain.stderr.contains('\r'), "{plain:?}");
    assert!(plain.stderr.contains("wrote out.exr: 1 sample a pixel"), "{plain:?}");
}

#[test]
fn what_is_wrong_with_a_scene_is_said_with_its_place() {
    let place = Place::new();
    place.write("wrong.toml", "[camera]\nvertical_fov_degree = 30\n");
    let outcome = place.run("render wrong.toml -o out.png");
    assert_eq!(outcome.code, 1);
    for part in ["wrong.toml:2:1", "did you mean `vertical_fov_degrees`?"] {
        assert!(outcome.stderr.contains(part), "{outcome:?}");
    }
    assert!(!place.path("out.png").exists());
    let outcome = place.run("render scene.toml --set path.max_dept=3 -o out.png");
    assert!(outcome.code == 1 && outcome.stderr.contains("max_depth"), "{outcome:?}");
}

#[test]
fn what_cannot_be_is_refused_before_any_work() {
    let place = Place::new();
    std::fs::create_dir(place.path("folder.exr")).unwrap();
    for (line, code, part) in [
        ("render scene.toml -o out.jpg", 2, ".exr, .hdr or .png"),
        ("render scene.toml -o out", 2, "extension"),
        (
            "render scene.toml -o scene.toml/out.exr",
            1,
            "there is no folder scene.toml, and it cannot be made",
        ),
        ("render scene.toml -o folder.exr", 1, "this is a folder"),
        ("render missing.toml -o out.exr", 1, "there is no such file"),
        ("render bunny.pli -o out.exr", 1, "bunny.ply"),
        (". -o out.exr", 2, "unrecognized"),
        ("render . -o out.exr", 1, "folder"),
        ("render scene.toml -o out.exr --size 0x9", 2, "at least one pixel"),
        ("render scene.toml -o out.exr --spp 0", 2, "--spp"),
        ("render scene.toml -o out.exr --time-limit -1", 2, "greater than 0"),
        ("render scene.toml -o out.png --exposure 1e9", 2, "60"),
        ("render scene.toml -o out.exr --frames 4..2", 2, "before"),
        ("render scene.toml -o out.exr --resume", 2, "--checkpoint"),
        ("render scene.toml -o out.exr -t pth", 2, "did you mean path?"),
        ("render scene.toml -o out.exr --set camera", 2, "KEY=VALUE"),
        ("render", 2, "SCENE"),
        ("rendr scene.toml", 2, "render"),
    ] {
        let outcome = place.run(line);
        assert_eq!(outcome.code, code, "{line}: {outcome:?}");
        assert!(outcome.stderr.contains(part), "{line}: {outcome:?}");
    }
    assert!(!place.path("out.exr").exists());
}

/// The limit that the shell sets is met by a signal that ends programs which do not expect it.
#[cfg(unix)]
#[test]
fn a_picture_beyond_the_limit_on_files_leaves_the_old_picture_and_says_so() {
    let place = Place::new();
    place.write("out.exr", "what stood here before");
    let script = format!(
        "ulimit -f 8; exec '{}' render scene.toml --size 256x256 --spp 1 -o out.exr",
        env!("CARGO_BIN_EXE_halflight")
    );
    let output =
        std::process::Command::new("sh").arg("-c").arg(script).current_dir(place.path("")).output().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(stderr.contains("cannot write the EXR picture out.exr"), "{stderr}");
    assert!(stderr.contains("raise the limit on the size of files"), "{stderr}");
    assert_eq!(std::fs::read_to_string(place.path("out.exr")).unwrap(), "what stood here before");
    assert!(place.files("").iter().all(|name| !name.contains("partial")));
}
