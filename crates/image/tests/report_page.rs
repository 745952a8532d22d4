//! The comparison page holds what it should, in a form that no text can break.

#![allow(clippy::unwrap_used, reason = "a test may end where it goes wrong")]

use halflight_image::RgbImage;
use halflight_image::metrics::MetricError;
use halflight_image::report::{Candidate, Comparison, Curve, CurvePoint, Report, ReportError, Row};

fn reference() -> RgbImage {
    RgbImage::from_fn(24, 10, |x, y| [x as f32 / 24.0, y as f32 / 10.0, 0.3])
}

fn scaled(by: f32) -> RgbImage {
    let reference = reference();
    RgbImage::from_fn(24, 10, |x, y| reference.pixels[y * 24 + x].map(|v| v * by))
}

fn comparison() -> Comparison {
    let mut comparison = Comparison::new("Two ramps", "the truth", reference());
    let near = Candidate {
        seconds: Some(2.5),
        samples: Some(64.0),
        peak_memory_bytes: Some(96 << 20),
        ..Candidate::new("near", scaled(0.99))
    };
    comparison.candidates = vec![near, Candidate::new("far", scaled(0.8))];
    comparison.note("command", "halflight compare a b");
    comparison
}

fn curve(name: &str, errors: &[f64]) -> Curve {
    let point = |(i, &relative_mse): (usize, &f64)| CurvePoint {
        seconds: 0.5 * f64::from(1 << i),
        samples: f64::from(4 << i),
        relative_mse,
    };
    Curve { name: name.into(), points: errors.iter().enumerate().map(point).collect() }
}

fn measured(comparison: &Comparison) -> Report {
    comparison.measure().unwrap_or_else(|error| panic!("{error}"))
}

/// What stands in the page between its data tags.
fn data(html: &str) -> serde_json::Value {
    let (_, from) = html.split_once("<script type=\"application/json\" id=\"data\">").expect("data");
    serde_json::from_str(from.split_once("</script>").expect("an end").0).expect("JSON")
}

#[test]
fn rows_come_in_the_order_given_and_rank_as_they_should() {
    let report = measured(&comparison());
    let [near, far] = report.rows() else { panic!("two rows") };
    assert_eq!([&near.name, &far.name], ["near", "far"]);
    assert!(near.relative_mse < far.relative_mse && near.flip < far.flip && near.hdr_flip < far.hdr_flip);
    assert!(near.psnr_db > far.psnr_db);
    assert!((far.brightness_error.expect("not black") + 0.2).abs() < 1e-6);
    assert_eq!(near.peak_memory_mib, Some(96.0));
    assert!(Row::FIGURES.iter().all(|name| near.figure(name).is_some()));
    assert_eq!(near.figure("relmse"), Some(near.relative_mse));
    assert_eq!(near.figure("seconds"), None);
}

#[test]
fn a_picture_and_itself_differ_by_nothing() {
    let mut comparison = Comparison::new("Same", "a", reference());
    comparison.candidates.push(Candidate::new("b", reference()));
    comparison.hdr_flip = false;
    let report = measured(&comparison);
    let row = &report.rows()[0];
    assert_eq!((row.relative_mse, row.flip, row.max_error, row.psnr_db), (0.0, 0.0, 0.0, None));
    assert_eq!((row.figure("psnr"), row.figure("hdr-flip")), (Some(f64::INFINITY), None));
    assert!(report.to_html().contains("∞") && !report.to_html().contains("HDR-FLIP<br>"));
}

#[test]
fn the_json_holds_the_figures_and_no_pictures() {
    let report = measured(&comparison());
    let json: serde_json::Value = serde_json::from_str(&report.to_json()).expect("JSON");
    assert_eq!(json["candidates"][0]["name"], "near");
    assert_eq!(json["candidates"][1]["relative_mse"], report.rows()[1].relative_mse);
    assert_eq!(json["candidates"][1]["seconds"], serde_json::Value::Null);
    assert_eq!(json["notes"][0]["value"], "halflight compare a b");
    assert!(!report.to_json().contains("data:image"));
}

#[test]
fn the_pictures_of_the_page_are_png_of_the_right_size_and_colour() {
    let mut comparison = comparison();
    comparison.candidates[0].image.pixels[30] = [1.0; 3];
    let data = data(&measured(&comparison).to_html());
    let all =
        [&data["reference"]["picture"], &data["candidates"][0]["picture"], &data["candidates"][1]["flip"]];
    for uri in all {
        let coded =
            uri.as_str().and_then(|uri| uri.strip_prefix("data:image/png;base64,")).expect("a data URI");
        let image = image::load_from_memory(&decode_base64(coded)).expect("a PNG").into_rgb8();
        assert_eq!(image.dimensions(), (24, 10));
    }
    let coded = data["candidates"][0]["picture"].as_str().expect("text").split_once(',').expect("a comma").1;
    let image = image::load_from_memory(&decode_base64(coded)).expect("a PNG").into_rgb8();
    assert_eq!(image.get_pixel(6, 1).0, [255; 3]);
}

fn decode_base64(text: &str) -> Vec<u8> {
    let digit = |c: u8| match c {
        b'A'..=b'Z' => u32::from(c - b'A'),
        b'a'..=b'z' => u32::from(c - b'a') + 26,
        b'0'..=b'9' => u32::from(c - b'0') + 52,
        b'+' => 62,
        b'/' => 63,
        _ => 0,
    };
    let padding = text.bytes().rev().take_while(|&c| c == b'=').count();
    let mut bytes: Vec<u8> = text
        .as_bytes()
        .chunks(4)
        .flat_map(|four| four.iter().fold(0, |bits, &c| bits << 6 | digit(c)).to_be_bytes()[1..].to_vec())
        .collect();
    bytes.truncate(bytes.len() - padding);
    bytes
}

#[test]
fn no_text_can_break_out_of_the_page() {
    let evil = "</script><script>alert(1)</script><img src=x onerror=alert(2)>\"'&{{data}}<!--";
    let mut comparison = Comparison::new(evil, evil, reference());
    comparison.candidates = vec![Candidate::new(evil, scaled(0.9)), Candidate::new("b", scaled(1.1))];
    comparison.candidates[0].image.pixels[3][0] = f32::NAN;
    comparison.curves = vec![curve(evil, &[0.1, 0.05])];
    comparison.note(evil, evil);
    let html = measured(&comparison).to_html();
    assert!(!html.contains("<script>alert") && !html.contains("<img src=x") && !html.contains("<!--"));
    assert_eq!(html.matches("</script>").count(), 2);
    assert_eq!(data(&html)["candidates"][0]["name"], evil);
}

#[test]
fn the_page_asks_nothing_of_a_network() {
    let mut comparison = comparison();
    comparison.curves = vec![curve("path", &[0.1, 0.05, 0.02])];
    let html = measured(&comparison).to_html();
    for asking in ["http:", "https:", "src=\"", "@import", "url(", "<link", "fetch(", "XMLHttpRequest"] {
        assert!(!html.contains(asking), "the page contains {asking}");
    }
    assert!(html.contains("default-src 'none'"));
}

#[test]
fn pixels_without_a_value_are_told_of() {
    let mut comparison = comparison();
    for pixel in &mut comparison.candidates[1].image.pixels[5..8] {
        *pixel = [f32::INFINITY; 3];
    }
    let report = measured(&comparison);
    assert_eq!(report.rows()[1].non_finite.left_out, 3);
    assert!(report.rows()[1].relative_mse.is_finite());
    assert!(report.to_html().contains("3 pixels were left out"));
    // The colour for it, as the maps and the page know it.
    let data = data(&report.to_html());
    let coded = data["candidates"][1]["relative"].as_str().expect("text").split_once(',').expect("a comma").1;
    let image = image::load_from_memory(&decode_base64(coded)).expect("a PNG").into_rgb8();
    assert_eq!(image.get_pixel(5, 0).0, [0x00, 0xff, 0x66]);
}

#[test]
fn curves_are_drawn_when_there_are_several_budgets() {
    let mut comparison = comparison();
    assert!(!measured(&comparison).to_html().contains("<svg"));
    comparison.curves = vec![curve("path", &[0.1])];
    assert!(!measured(&comparison).to_html().contains("<svg"), "one budget is no curve");
    comparison.curves = vec![curve("path", &[0.1, 0.05]), curve("prt", &[0.04, 0.0, f64::NAN, 0.03])];
    let html = measured(&comparison).to_html();
    assert_eq!(html.matches("<svg").count(), 2);
    assert!(html.contains("samples per pixel</text>") && html.contains("time in seconds</text>"));
    assert!(!html.contains("NaN") || !html.split("<svg").nth(1).expect("a plot").contains("NaN"));
    // Two and two points, each with a tip, in each of two plots; zero and NaN have no place on the axes.
    assert_eq!(html.matches(" samples per pixel, relMSE ").count(), 8);
}

#[test]
fn what_cannot_be_compared_is_an_error_that_names_it() {
    let mut comparison = comparison();
    comparison.candidates[1].image = RgbImage::new(3, 3);
    let error = comparison.measure().unwrap_err();
    assert!(matches!(&error, ReportError::Metric { found: MetricError::Sizes { .. }, .. }));
    assert!(error.to_string().starts_with("far: ") && error.to_string().contains("3×3"));
    comparison.candidates.clear();
    assert!(comparison.measure().unwrap_err().to_string().contains("the truth"));
}

#[test]
fn files_are_written_whole_and_a_missing_folder_is_said() {
    let folder = tempfile::tempdir().expect("a folder");
    let report = measured(&comparison());
    report.write_html(folder.path().join("index.html")).expect("written");
    report.write_json(folder.path().join("figures.json")).expect("written");
    let html = std::fs::read_to_string(folder.path().join("index.html")).expect("read");
    assert_eq!(html, report.to_html());
    assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 2);
    let error = report.write_html(folder.path().join("none/index.html")).unwrap_err().to_string();
    assert!(error.contains("comparison page") && error.contains("make the folder first"), "{error}");
}

#[test]
fn a_report_does_not_depend_on_the_number_of_threads() {
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| measured(&comparison()).to_html())
    };
    assert_eq!(with(1), with(3));
}
