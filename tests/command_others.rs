//! The welcome, `info`, `brdf`, `demo`, `bench`, `completions`, and how errors look.

mod support;

use support::Place;

#[test]
fn without_arguments_it_says_what_it_is_and_three_things_to_try() {
    let outcome = Place::new().done("");
    assert!(outcome.stdout.contains("renderer"));
    assert_eq!(
        outcome.stdout.lines().filter(|line| line.starts_with("  halflight ")).count(),
        3,
        "{outcome:?}"
    );
}

#[test]
fn help_and_version_are_no_errors() {
    let place = Place::new();
    assert!(place.done("--version").stdout.starts_with("halflight "));
    assert!(place.done("--help").stdout.contains("Exit codes"));
    assert_eq!(place.run("--nonsense").code, 2);
}

#[test]
fn info_describes_meshes_scenes_and_pictures() {
    let place = Place::new();
    assert!(place.done("info bunny.ply").stdout.contains("triangles      8"));
    assert_eq!(place.done("info bunny.ply --json").event("info")["description"]["triangles"], 8);
    assert!(place.done("info scene.toml").stdout.contains("content hash"));
    assert!(place.done("info hall.hdr").stdout.contains("16 × 8"));
    place.done("render scene.toml --spp 1 -o out.exr");
    let outcome = place.done("info out.exr");
    assert!(outcome.stdout.contains("depth.Z") && outcome.stdout.contains("scene_hash"), "{outcome:?}");
}

#[test]
fn info_says_what_it_cannot_read() {
    let place = Place::new();
    place.write("empty.ply", "");
    place.write("odd.xyz", "what is this?");
    for name in ["empty.ply", "odd.xyz", "missing.exr", "."] {
        let outcome = place.run(&format!("info {name}"));
        assert!(outcome.code == 1 && outcome.stderr.starts_with("error: "), "{outcome:?}");
    }
}

#[test]
fn a_material_is_written_as_a_merl_file_and_described() {
    let place = Place::new();
    place.done("brdf synth \"conductor metal=copper roughness=0.4\" -o copper.binary");
    assert_eq!(std::fs::metadata(place.path("copper.binary")).unwrap().len(), 34_992_012);
    let outcome = place.done("brdf info copper.binary");
    assert!(outcome.stdout.contains("90 × 90 × 180"), "{outcome:?}");
    assert!(place.done("info copper.binary").stdout.contains("90 × 90 × 180"));
    for (line, code) in [
        ("brdf synth \"conductr roughness=0.3\" -o x.binary", 1),
        ("brdf synth mirror -o x.binary", 1),
        ("brdf synth diffuse -o x.txt", 2),
        ("brdf info bunny.ply", 1),
    ] {
        let outcome = place.run(line);
        assert_eq!(outcome.code, code, "{line}: {outcome:?}");
    }
}

#[test]
fn environments_become_coefficients_that_turn_convert_and_show() {
    let place = Place::new();
    let outcome = place.done("sh project hall.hdr --order 3 --window hanning -o light.json");
    assert!(outcome.stderr.contains("of the energy"), "{outcome:?}");
    // Four quarter turns are none.
    place.done("sh rotate light.json --degrees 90 -o turned.json");
    place.done("sh rotate turned.json --degrees 270 -o back.json");
    let numbers = |name: &str| -> Vec<f64> {
        let text = std::fs::read_to_string(place.path(name)).unwrap();
        let value: serde_json::Value = serde_json::from_str(&text).unwrap();
        let list = value["coefficients"].as_array().unwrap();
        list.iter().flat_map(|colour| colour.as_array().unwrap()).map(|x| x.as_f64().unwrap()).collect()
    };
    assert_eq!(numbers("light.json").len(), 27);
    assert!(numbers("light.json").iter().zip(numbers("back.json")).all(|(a, b)| (a - b).abs() < 1e-9));
    place.done("sh convert light.json --to filament-irradiance -o filament.json");
    place.done("sh convert filament.json --to halflight -o again.json");
    assert!(numbers("light.json").iter().zip(numbers("again.json")).all(|(a, b)| (a - b).abs() < 1e-9));
    let outcome = place.done("sh show light.json --irradiance --size 32x16 -o light.exr");
    assert!(outcome.stdout.contains("band"), "{outcome:?}");
    place.done("info light.exr");
    place.write("broken.json", "{ \"convention\": \"halflight\", \"coefficients\": [[1, 2]] }");
    for (line, code) in [
        ("sh project hall.hdr --order 9", 2),
        ("sh project missing.hdr", 1),
        ("sh rotate light.json --axis 0,0,0 --degrees 1", 2),
        ("sh show broken.json", 1),
        ("sh show scene.toml", 1),
        ("sh convert light.json --to unreal", 2),
        ("sh show light.json -o light.txt", 2),
    ] {
        let outcome = place.run(line);
        assert!(outcome.code == code && outcome.stderr.starts_with("error: "), "{line}: {outcome:?}");
    }
    place.done("sh project hall.hdr --order 4 -o four.json");
    let outcome = place.run("sh convert four.json --to threejs");
    assert!(outcome.code == 1 && outcome.stderr.contains("ends at order 3"), "{outcome:?}");
}

#[test]
fn every_demo_renders() {
    let place = Place::new();
    let listed = place.done("demo --list").stdout;
    let names: Vec<&str> = listed.lines().filter_map(|line| line.split_whitespace().next()).collect();
    assert!(names.len() >= 5, "{listed}");
    for name in &names {
        place.done(&format!("demo {name} --size 32x18 --spp 1 -o out.exr"));
        let image = place.exr("out.exr").rgb().unwrap();
        assert!(image.pixels.iter().flatten().all(|v| v.is_finite()), "{name}");
        assert!(image.pixels.iter().any(|p| p[1] > 0.01), "{name} is black");
    }
    let outcome = place.done("demo --size 16x9 --spp 1");
    assert!(outcome.stderr.contains("other demo scenes"), "{outcome:?}");
    assert!(place.path(&format!("{}.png", names[0])).exists());
    assert_eq!(place.run("demo stil-life").code, 2);
    place.done("demo terrain --save mine.toml");
    place.done("render mine.toml --size 16x9 --spp 1 -o mine.png");
}

#[test]
fn benches_print_tables() {
    let place = Place::new();
    for name in ["rays", "build", "memory", "samplers"] {
        let outcome = place.done(&format!("bench {name} --quick"));
        assert!(outcome.stdout.contains("──"), "{outcome:?}");
    }
    let outcome = place.done("bench path --quick --data nowhere");
    assert!(outcome.stdout.contains("skipped"), "{outcome:?}");
}

#[test]
fn shells_get_their_completions() {
    let place = Place::new();
    for shell in ["bash", "zsh", "fish"] {
        assert!(place.done(&format!("completions {shell}")).stdout.contains("time-limit"));
    }
    assert_eq!(place.run("completions cobol").code, 2);
}

#[test]
fn programs_get_errors_as_events() {
    let outcome = Place::new().run("info missing.ply --json");
    assert!(outcome.code == 1 && outcome.event("error")["message"].as_str().unwrap().contains("missing.ply"));
}
