//! What the technique `bandwidth` takes for a scene and how far it is from the truth, stage by stage:
//! `bandwidth_stages SCENE.toml FOLDER [SETTINGS]…` with settings such as `mode="preconvolved",error=0.02`.
//! Pictures are written to the folder; the truth is read from there if it is there already.

use std::path::{Path, PathBuf};
use std::time::Instant;

use halflight_image::{RgbImage, ToneMapping, metrics, save_png};
use halflight_render::techniques::bandwidth::{BandwidthSettings, BandwidthTechnique};
use halflight_render::{Budget, Film, Quiet, Technique};
use halflight_scene::schema::{self, Table};
use halflight_scene::{LoadOptions, Scene};

fn settings(text: &str) -> BandwidthSettings {
    let mut table = Table::empty();
    for part in text.split(',').filter(|part| !part.is_empty()) {
        table.assign("settings", part).expect("a setting");
    }
    schema::read(&table).unwrap_or_else(|problems| panic!("{problems}"))
}

fn cpu_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or("").split_whitespace().collect();
    let ticks = |i: usize| fields.get(i).and_then(|f| f.parse::<f64>().ok()).unwrap_or(0.0);
    (ticks(11) + ticks(12)) / 100.0
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [scene, folder, configurations @ ..] = arguments.as_slice() else {
        eprintln!("bandwidth_stages SCENE.toml FOLDER [SETTINGS]…");
        return;
    };
    let folder = PathBuf::from(folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    let stem = Path::new(scene).file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
    let options = LoadOptions::default();
    let scene = Scene::load(Path::new(scene), &options).unwrap_or_else(|error| panic!("{error}"));
    let [width, height] = scene.image().size.map(|s| s as usize);
    let ev = scene.image().exposure_ev;
    let frame = scene.at(0.0).unwrap_or_else(|error| panic!("{error}"));
    let render = |text: &str, repeats: u32| {
        let mut technique = BandwidthTechnique::new(settings(text));
        let begun = Instant::now();
        technique.prepare(&scene, &Quiet).expect("a scene that it can show");
        let prepared = begun.elapsed();
        let mut film = Film::new(width, height);
        let budget = Budget { samples: Some(1), ..Budget::default() };
        let mut report = technique.render(&frame, &mut film, &budget, &Quiet).expect("a picture");
        let cpu = cpu_seconds();
        let mut best = report.clone();
        for _ in 0..repeats {
            film = Film::new(width, height);
            report = technique.render(&frame, &mut film, &budget, &Quiet).expect("a picture");
            if report.elapsed < best.elapsed {
                best = report.clone();
            }
        }
        let cpu = (cpu_seconds() - cpu) / f64::from(repeats.max(1));
        (film, best, prepared, cpu)
    };
    let truth_file = folder.join(format!("{stem}.truth"));
    let truth = match std::fs::read(&truth_file) {
        Ok(bytes) if bytes.len() == width * height * 12 => {
            let floats: Vec<f32> =
                bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
            let pixels = floats.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
            RgbImage { width, height, pixels }
        }
        _ => {
            let truth = render("mode=\"reference\",samples=384", 0).0.image();
            let bytes: Vec<u8> = truth.pixels.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
            std::fs::write(&truth_file, bytes).expect("a file");
            truth
        }
    };
    for (number, text) in configurations.iter().enumerate() {
        let exhaustive = text.contains("forward") || text.contains("reference");
        let (film, report, prepared, cpu) = render(
            text,
            if exhaustive {
                0
            } else {
                std::env::var("REPEATS").ok().and_then(|r| r.parse().ok()).unwrap_or(8)
            },
        );
        let image = film.image();
        let psnr = metrics::psnr(&image, &truth, ev).unwrap_or(0.0);
        println!(
            "{text}: {psnr:.2} dB, {:.1} ms (cpu {:.1}), prepared in {:.0} ms",
            report.elapsed.as_secs_f64() * 1e3,
            cpu * 1e3,
            prepared.as_secs_f64() * 1e3
        );
        let stages: Vec<String> =
            report.stages.iter().map(|(n, t)| format!("{n} {:.1}", t.as_secs_f64() * 1e3)).collect();
        println!("    {}", stages.join(", "));
        for note in &report.notes {
            println!("    {note}");
        }
        let mut parts = vec![exposed(&truth, ev), exposed(&image, ev)];
        let difference = image.pixels.iter().zip(&truth.pixels);
        let difference = difference.map(|(a, b)| std::array::from_fn(|c| 8.0 * (a[c] - b[c]).abs()));
        parts.push(exposed(&RgbImage { width, height, pixels: difference.collect() }, ev));
        for (layer, scale) in
            [("shaded", 1.0), ("level", 0.25), ("bandwidth", 1.0), ("shading-samples", 1.0 / 256.0)]
        {
            if let Some(values) = film.layers.get(layer) {
                parts.push(RgbImage {
                    width,
                    height,
                    pixels: values.iter().map(|v| [v * scale; 3]).collect(),
                });
            }
        }
        let file = folder.join(format!("{stem}-{number}.png"));
        save_png(&file, &sheet(&parts), &ToneMapping::default()).expect("a picture");
    }
}

fn exposed(image: &RgbImage, ev: f32) -> RgbImage {
    let pixels = image.pixels.iter().map(|p| p.map(|v| v * ev.exp2())).collect();
    RgbImage { width: image.width, height: image.height, pixels }
}

/// Pictures of one size, four in a row.
fn sheet(parts: &[RgbImage]) -> RgbImage {
    let (width, height) = (parts[0].width, parts[0].height);
    RgbImage::from_fn(width * parts.len().min(4), height * parts.len().div_ceil(4), |x, y| {
        parts
            .get(y / height * 4 + x / width)
            .map_or([0.0; 3], |part| part.pixels[y % height * width + x % width])
    })
}
