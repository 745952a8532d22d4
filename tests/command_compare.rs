//! `halflight compare`.

mod support;

use serde_json::Value;
use support::Place;

fn with_pictures() -> Place {
    let place = Place::new();
    place.done("render scene.toml --spp 2 -o noisy.exr");
    place.done("render scene.toml --spp 64 --seed 9 -o truth.exr");
    place
}

fn report(place: &Place, folder: &str) -> Value {
    let text =
        std::fs::read_to_string(place.path(folder).join("report.json")).expect("there is a report.json");
    serde_json::from_str(&text).expect("report.json is JSON")
}

#[test]
fn two_pictures_give_a_page_a_table_and_figures() {
    let place = with_pictures();
    let outcome = place.done("compare noisy.exr truth.exr -o report/");
    assert!(outcome.stdout.contains("relMSE") && outcome.stdout.contains("noisy.exr"), "{outcome:?}");
    let page = std::fs::read_to_string(place.path("report/index.html")).unwrap();
    assert!(page.starts_with("<!doctype html>") && page.contains("truth.exr"));
    let row = &report(&place, "report")["candidates"][0];
    assert!(row["relative_mse"].as_f64().unwrap() > 0.0 && row["flip"].as_f64().unwrap() > 0.0);
}

#[test]
fn what_pictures_cost_is_shown_where_their_files_say_it() {
    let place = with_pictures();
    let outcome = place.done("compare noisy.exr truth.exr --no-report");
    assert!(outcome.stdout.contains("samples") && outcome.stdout.contains("seconds"), "{outcome:?}");
    let outcome = place.done("compare noisy.exr truth.exr --no-report --json");
    let row = &outcome.event("compared")["figures"]["candidates"][0];
    assert!(row["samples"] == 2.0 && row["seconds"].as_f64().is_some(), "{row}");
    place.done("render scene.toml --spp 1 -o plain.png");
    let outcome = place.done("compare plain.png truth.exr --no-report");
    assert!(!outcome.stdout.contains("seconds"), "{outcome:?}");
}

#[test]
fn equal_pictures_have_no_error() {
    let place = with_pictures();
    let outcome = place
        .done("compare truth.exr truth.exr --no-report --json --fail-above relmse=0 --fail-below psnr=99");
    let row = &outcome.event("compared")["figures"]["candidates"][0];
    assert_eq!((row["relative_mse"].as_f64(), row["flip"].as_f64()), (Some(0.0), Some(0.0)));
    assert!(!place.path("report").exists());
}

#[test]
fn a_broken_limit_is_exit_code_1() {
    let place = with_pictures();
    let outcome = place.run("compare noisy.exr truth.exr --fail-above relmse=1e-9 --no-report");
    assert!(outcome.code == 1 && outcome.stderr.contains("above the limit"), "{outcome:?}");
    assert_eq!(place.run("compare noisy.exr truth.exr --fail-above relmse=1e9,flip=2 --no-report").code, 2);
    place.done("compare noisy.exr truth.exr --fail-above relmse=1e9 --fail-above flip=2 --no-report");
    assert_eq!(place.run("compare noisy.exr truth.exr --fail-below psnr=200 --no-report").code, 1);
    assert_eq!(place.run("compare noisy.exr truth.exr --fail-above relms=1 --no-report").code, 2);
}

#[test]
fn pictures_of_different_size_or_that_are_missing_are_an_error() {
    let place = with_pictures();
    place.done("render scene.toml --size 8x8 --spp 1 -o small.png");
    let outcome = place.run("compare small.png truth.exr --no-report");
    assert!(outcome.code == 1 && outcome.stderr.contains("8×8"), "{outcome:?}");
    let outcome = place.run("compare trut.exr truth.exr --no-report");
    assert!(outcome.code == 1 && outcome.stderr.contains("did you mean ./truth.exr?"), "{outcome:?}");
    assert_eq!(place.run("compare scene.toml truth.exr --no-report").code, 1);
}

#[test]
fn techniques_race_on_one_scene_over_several_budgets() {
    let place = Place::new();
    let outcome = place.done(
        "compare scene.toml -t path -t path:max_depth=1 --reference path --spp 1,4 --reference-spp 32 -o report",
    );
    assert!(outcome.stdout.contains("path:max_depth=1"), "{outcome:?}");
    let report = report(&place, "report");
    assert_eq!(report["candidates"].as_array().unwrap().len(), 2);
    let points = report["curves"][0]["points"].as_array().unwrap();
    assert_eq!(points.iter().map(|p| p["samples"].as_f64().unwrap()).collect::<Vec<_>>(), [1.0, 4.0]);
    assert!(points[0]["relative_mse"].as_f64() > points[1]["relative_mse"].as_f64());
}

#[test]
fn a_picture_can_be_the_reference_of_a_scene_and_time_the_budget() {
    let place = with_pictures();
    place.done(
        "compare scene.toml --reference truth.exr --time-limit 0.05,0.2 --no-report --fail-above relmse=1",
    );
    let outcome = place.run("compare scene.toml --reference nothing --no-report");
    assert!(outcome.code == 2 && outcome.stderr.contains("nothing"), "{outcome:?}");
}

#[test]
fn a_single_picture_is_wrong_usage_unless_techniques_are_named() {
    let place = with_pictures();
    for picture in ["noisy.exr", "hall.hdr", "missing.png"] {
        let outcome = place.run(&format!("compare {picture} --reference-spp 1 --size 8x8"));
        assert!(outcome.code == 2 && outcome.stderr.contains("it takes two"), "{outcome:?}");
    }
    assert!(!place.path("report").exists());
    place.done("compare hall.hdr -t path --reference-spp 1 --spp 1 --size 8x8 --no-report");
}
