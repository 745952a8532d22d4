//! Pictures rendered in tiles and joined with `halflight merge`, as a user meets it.

mod support;

use halflight::image::PicturePart;
use support::{Place, bits};

/// Names of the tiles of a picture `t.exr`.
fn tiles(count: usize) -> String {
    let digits = count.to_string().len();
    (1..=count).map(|i| format!("t.tile{i:0digits$}of{count}.exr")).collect::<Vec<_>>().join(" ")
}

/// Renders all tiles as `t.tile…`.
fn render_tiles(place: &Place, options: &str, count: usize) {
    for i in 1..=count {
        place.done(&format!("render {options} --tile {i}/{count} -o t.exr"));
    }
}

#[test]
fn tiles_of_every_technique_joined_are_the_bits_of_one_picture_with_all_layers() {
    let place = Place::new();
    for technique in ["path", "prt", "shadow-fields", "shexp", "bandwidth", "covariance"] {
        let options = format!("scene.toml -t {technique} --spp 6 --size 70x50 --seed 3");
        place.done(&format!("render {options} -o whole.exr"));
        let whole = place.exr("whole.exr");
        let counts = if technique == "path" { vec![2, 7, 20] } else { vec![3] };
        for count in counts {
            render_tiles(&place, &options, count);
            place.done(&format!("merge {} -o merged.exr", tiles(count)));
            let merged = place.exr("merged.exr");
            assert!(bits(&merged) == bits(&whole), "{technique} in {count}");
            for key in ["version", "scene", "scene_hash", "technique", "seed", "frame", "simd"] {
                assert_eq!(merged.metadata[key], whole.metadata[key], "{technique} {key}");
            }
            let samples = |text: &str| text.parse::<f64>().unwrap();
            let (merged, whole) = (samples(&merged.metadata["samples"]), samples(&whole.metadata["samples"]));
            assert!((merged - whole).abs() < 1e-9 * whole, "{technique}: {merged} {whole}");
        }
    }
}

#[test]
fn a_merged_png_has_the_bytes_of_one_rendered_whole() {
    let place = Place::new();
    // The exposure of a bare map is found from the whole picture, which no tile has.
    for scene in ["hall.hdr", "scene.toml --exposure 1.5 --tone filmic"] {
        place.done(&format!("render {scene} --spp 2 --size 40x40 -o whole.png"));
        render_tiles(&place, &format!("{scene} --spp 2 --size 40x40 --layers none"), 3);
        place.done(&format!("merge {} -o merged.png", tiles(3)));
        let file = |name: &str| std::fs::read(place.path(name)).unwrap();
        assert!(file("whole.png") == file("merged.png"), "{scene}");
    }
}

#[test]
fn half_precision_survives_a_merge() {
    let place = Place::new();
    place.done("render scene.toml --spp 2 --half -o whole.exr");
    render_tiles(&place, "scene.toml --spp 2 --half", 2);
    place.done(&format!("merge {} -o merged.exr", tiles(2)));
    assert!(bits(&place.exr("whole.exr")) == bits(&place.exr("merged.exr")));
    place.done("render scene.toml --spp 2 -o float.exr");
    assert!(
        place.path("merged.exr").metadata().unwrap().len()
            < place.path("float.exr").metadata().unwrap().len()
    );
}

#[test]
fn every_frame_of_a_sequence_can_be_divided() {
    let place = Place::new();
    place.done("render scene.toml --spp 2 --frames 1..3 -o whole.##.exr");
    for i in 1..=2 {
        place.done(&format!("render scene.toml --spp 2 --frames 1..3 --tile {i}/2 -o part.##.exr"));
    }
    let parts: Vec<String> = place.files("").into_iter().filter(|name| name.starts_with("part")).collect();
    assert_eq!(parts.len(), 6);
    assert!(parts.contains(&"part.02.tile1of2.exr".to_string()), "{parts:?}");
    let outcome = place.done(&format!("merge {} -o joined.##.exr --json", parts.join(" ")));
    assert_eq!(outcome.events().iter().filter(|event| event["event"] == "merged").count(), 3);
    for frame in ["01", "02", "03"] {
        let [whole, joined] = ["whole", "joined"].map(|name| place.exr(&format!("{name}.{frame}.exr")));
        assert!(bits(&whole) == bits(&joined), "{frame}");
        assert_eq!(whole.metadata["frame"], joined.metadata["frame"]);
    }
}

#[test]
fn tiles_that_do_not_belong_together_are_refused_and_what_differs_is_named() {
    let place = Place::new();
    place.done("render scene.toml --spp 2 --tile 1/2 -o t.exr");
    place.write("merged.exr", "precious");
    for (change, said) in [
        ("--seed 5", "seed"),
        ("--max-depth 1", "technique"),
        ("-t shexp", "technique"),
        ("--size 64x27", "size of the picture"),
        ("--set camera.aperture_radius=0.1", "content of the scene"),
        ("--simd baseline", "instruction set"),
        ("--layers depth", "layers"),
        ("--half", "precision"),
        ("--exposure 1", "exposure"),
        ("--fps 1 --frame 0", ""),
        ("--frame 3", "missing"),
    ] {
        place.done(&format!("render scene.toml --spp 2 --tile 2/2 {change} -o other.exr"));
        let outcome = place.run("merge t.tile1of2.exr other.tile2of2.exr -o merged.exr");
        if said.is_empty() {
            assert_eq!(outcome.code, 0, "{change}: {outcome:?}");
            place.write("merged.exr", "precious");
            continue;
        }
        assert_eq!(outcome.code, 1, "{change}: {outcome:?}");
        assert!(outcome.stderr.contains(said) && outcome.stderr.contains("tile"), "{change}: {outcome:?}");
        assert_eq!(std::fs::read(place.path("merged.exr")).unwrap(), b"precious", "{change}");
    }
    place.done("render scene.toml --spp 3 --tile 2/2 -o other.exr");
    let outcome = place.run("merge t.tile1of2.exr other.tile2of2.exr -o new.exr");
    assert!(
        outcome.stderr.contains("samples asked for") && outcome.stderr.contains("3 a pixel"),
        "{outcome:?}"
    );
    assert!(!place.path("new.exr").exists());
}

#[test]
fn missing_double_and_foreign_files_are_refused() {
    let place = Place::new();
    render_tiles(&place, "scene.toml --spp 1", 2);
    place.done("render scene.toml --spp 1 -o whole.exr");
    let refused = |line: &str, said: &[&str]| {
        let outcome = place.run(&format!("merge {line} -o out.exr"));
        assert_eq!(outcome.code, 1, "{line}: {outcome:?}");
        assert!(said.iter().all(|said| outcome.stderr.contains(said)), "{line}: {outcome:?}");
        assert!(!place.path("out.exr").exists());
    };
    refused("t.tile2of2.exr", &["1 of 2 tiles is missing: 1/2"]);
    std::fs::copy(place.path("t.tile1of2.exr"), place.path("copy.exr")).unwrap();
    refused("t.tile1of2.exr copy.exr t.tile2of2.exr", &["twice", "copy.exr"]);
    refused("whole.exr t.tile2of2.exr", &["whole.exr", "no tile"]);
    refused("t.tile1of2.exr hall.hdr", &["hall.hdr"]);
    refused("t.tile1of2.exr nowhere.exr", &["nowhere.exr"]);
    place.done("render scene.toml --spp 1 --tile 2/3 --size 48x48 -o t.exr");
    refused("t.tile1of2.exr t.tile2of3.exr", &["do not belong together"]);
    let bytes = std::fs::read(place.path("t.tile2of2.exr")).unwrap();
    for length in [0, 100, bytes.len() / 2, bytes.len() - 1] {
        std::fs::write(place.path("cut.exr"), &bytes[..length]).unwrap();
        refused("t.tile1of2.exr cut.exr", &["cut.exr"]);
    }
    // A tile whose window was moved claims pixels that are another's.
    let mut part = PicturePart::load_exr(&place.path("t.tile2of2.exr")).unwrap();
    part.origin[1] -= 1;
    part.save_exr(&place.path("moved.exr"), halflight::image::Precision::Float).unwrap();
    refused("t.tile1of2.exr moved.exr", &["not those of tile 2/2"]);
    part.origin[1] += 1;
    part.picture.metadata.insert("interrupted".into(), "yes".into());
    part.save_exr(&place.path("early.exr"), halflight::image::Precision::Float).unwrap();
    refused("t.tile1of2.exr early.exr", &["interrupted"]);
    let outcome = place.run("merge t.tile1of2.exr t.tile2of2.exr -o t.tile1of2.exr");
    assert!(outcome.code == 2 && outcome.stderr.contains("one of the tiles"), "{outcome:?}");
    place.done("merge t.tile1of2.exr t.tile2of2.exr -o out.exr");
}

#[test]
fn tiles_that_could_not_be_joined_are_not_begun() {
    let place = Place::new();
    for (options, said) in [
        ("--tile 1/2 -o t.png", "tiles are .exr"),
        ("--tile 1/2 --time-limit 1 -o t.exr", "same samples"),
        ("--tile 1/2 --error 0.1 -o t.exr", "same samples"),
        ("--tile 0/2 -o t.exr", "numbered from 1"),
        ("--tile 3/2 -o t.exr", "no tile 3 of 2"),
        ("--tile x -o t.exr", "expected I/N"),
        ("--tile 7/7 -o t.exr", "6 tiles at most"),
        ("-t covariance --tile 1/2 --checkpoint film -o t.exr", "whole picture"),
    ] {
        let outcome = place.run(&format!("render scene.toml {options}"));
        assert_eq!(outcome.code, 2, "{options}: {outcome:?}");
        assert!(outcome.stderr.contains(said), "{options}: {outcome:?}");
    }
    assert!(place.files("").iter().all(|name| !name.contains("tile")));
    let outcome = place.done("render scene.toml -t shexp --spp 1 --tile 1/2 -o t.exr");
    assert!(outcome.stderr.contains("divide a sequence by its frames"), "{outcome:?}");
    place.done("render bunny.ply --spp 1 --size 32x32 --tile 2/2");
    assert!(place.path("bunny.tile2of2.exr").exists());
}

#[test]
fn a_tile_can_be_gone_on_with_and_belongs_to_its_share_only() {
    let place = Place::new();
    place.done("render scene.toml --spp 11 -o whole.exr");
    for i in 1..=2 {
        let line = format!("render scene.toml --tile {i}/2 --checkpoint film{i} -o t.exr");
        place.done(&format!("{line} --spp 5"));
        place.done(&format!("{line} --spp 11 --resume"));
    }
    let outcome = place.run("render scene.toml --tile 2/2 --checkpoint film1 --resume --spp 11 -o t.exr");
    assert!(outcome.code == 1, "{outcome:?}");
    place.done(&format!("merge {} -o merged.exr", tiles(2)));
    assert!(bits(&place.exr("whole.exr")) == bits(&place.exr("merged.exr")));
}
