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
fn info_shows_a_layer_in_false_colour() {
    let place = Place::new();
    place.done("render scene.toml --spp 1 -o out.exr");
    let outcome = place.done("info out.exr --layer depth -o depth.png --range 0,10");
    assert!(outcome.stdout.contains("depth.Z from 0 (dark) to 10 (yellow)"), "{outcome:?}");
    let sizes = place.done("info depth.png").stdout;
    let line = |text: &str| text.lines().find(|line| line.contains("size")).map(str::to_string);
    assert_eq!(line(&sizes), line(&place.done("info out.exr").stdout));
    for (wish, told) in [
        ("out.exr --layer dept -o x.png", "did you mean depth"),
        ("out.exr --layer normal -o x.png", "choose one of normal.X, normal.Y, normal.Z"),
        ("out.exr --layer depth -o x.jpg", "shown as .png"),
        ("out.exr --layer depth -o x.png --range 3,1", "LOW below HIGH"),
        ("hall.hdr --layer depth -o x.png", "only .exr pictures"),
        ("out.exr --layer depth", "--output"),
    ] {
        let outcome = place.run(&format!("info {wish}"));
        assert!(outcome.code == 2 && outcome.stderr.contains(told), "{wish}: {outcome:?}");
    }
    assert!(!place.path("x.png").exists());
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
fn what_a_measured_material_cannot_hold_is_refused_or_warned_of() {
    let place = Place::new();
    let outcome = place.run("brdf synth \"emissive radiance=5\" -o lamp.binary");
    assert!(outcome.code == 1 && outcome.stderr.contains("it only shines"), "{outcome:?}");
    assert!(!place.path("lamp.binary").exists());
    let brushed = "brdf synth \"conductor roughness=0.4 anisotropy=0.7\" -o brushed.binary";
    let outcome = place.done(brushed);
    assert!(outcome.stderr.contains("warning: the format is for isotropic materials"), "{outcome:?}");
}

#[test]
fn info_of_a_geotiff_tells_elevations_and_voids() {
    let place = Place::new();
    std::fs::write(place.path("land.tif"), geotiff()).unwrap();
    let outcome = place.done("info land.tif --json");
    let description = &outcome.event("info")["description"];
    assert_eq!(description["kind"], "heights", "{outcome:?}");
    assert_eq!((&description["filled_voids"], &description["range"][0]), (&2.into(), &10.0.into()));
    assert_eq!(description["metres_per_pixel"][0], 30.0);
}

/// 4 × 3 posts of 32-bit floats, 30 m apart, two of them void (−9999); one strip, little-endian.
fn geotiff() -> Vec<u8> {
    let heights: [f32; 12] = [10.0, 11.0, 12.0, 13.0, 14.0, -9999.0, 16.0, 17.0, 18.0, -9999.0, 20.0, 21.0];
    let spacing = [30.0f64, 30.0, 0.0];
    let tie = [0.0f64, 0.0, 0.0, 500_000.0, 4_000_000.0, 0.0];
    // Version 1.1.0 of the key directory; projected coordinates, pixels are areas.
    let keys: [u16; 12] = [1, 1, 0, 2, 1024, 0, 1, 1, 1025, 0, 1, 1];
    let mut data: Vec<u8> = Vec::new();
    let (short, long, ascii, double) = (3u16, 4u16, 2u16, 12u16);
    let place = |data: &mut Vec<u8>, bytes: Vec<u8>| {
        let at = 8 + data.len() as u32;
        data.extend(bytes);
        at
    };
    let pixels = place(&mut data, heights.iter().flat_map(|v| v.to_le_bytes()).collect());
    let spacing = place(&mut data, spacing.iter().flat_map(|v| v.to_le_bytes()).collect());
    let tie = place(&mut data, tie.iter().flat_map(|v| v.to_le_bytes()).collect());
    let keys = place(&mut data, keys.iter().flat_map(|v| v.to_le_bytes()).collect());
    let void = place(&mut data, b"-9999\0".to_vec());
    let entries: [(u16, u16, u32, u32); 14] = [
        (256, short, 1, 4),
        (257, short, 1, 3),
        (258, short, 1, 32),
        (259, short, 1, 1),
        (262, short, 1, 1),
        (273, long, 1, pixels),
        (277, short, 1, 1),
        (278, short, 1, 3),
        (279, long, 1, 48),
        (339, short, 1, 3),
        (33550, double, 3, spacing),
        (33922, double, 6, tie),
        (34735, short, 12, keys),
        (42113, ascii, 6, void),
    ];
    let mut file = b"II*\0".to_vec();
    file.extend((8 + data.len() as u32).to_le_bytes());
    file.extend(data);
    file.extend((entries.len() as u16).to_le_bytes());
    for (tag, kind, count, value) in entries {
        file.extend(tag.to_le_bytes());
        file.extend(kind.to_le_bytes());
        file.extend(count.to_le_bytes());
        file.extend(value.to_le_bytes());
    }
    file.extend([0; 4]);
    file
}

#[test]
fn a_missing_folder_of_an_output_is_made() {
    let place = Place::new();
    place.done("render scene.toml --spp 1 --frames 1..2 -o frames/of/the/ball.####.png");
    assert_eq!(place.files("frames/of/the"), ["ball.0001.png", "ball.0002.png"]);
    place.done("demo cornell-box --save scenes/mine.toml");
    assert!(place.path("scenes/mine.toml").exists());
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
    for name in ["rays", "build", "memory", "samplers", "sh", "shexp"] {
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
