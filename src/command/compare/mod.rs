//! `halflight compare`: two pictures, or several techniques on one scene.

mod judge;
mod options;
mod race;
mod tell;

pub(crate) use options::CompareArgs;

use std::path::{Path, PathBuf};

use halflight_file::extension;
use halflight_image::report::{Candidate, Comparison};
use halflight_image::{Picture, RgbImage, load_rgb};

use super::console::Console;
use super::failure::Failure;
use super::output;

/// Where the page goes when nothing else is said.
const DEFAULT_REPORT: &str = "report";
/// The extensions of pictures.
const PICTURES: [&str; 7] = ["exr", "hdr", "png", "jpg", "jpeg", "tif", "tiff"];

pub(crate) fn run(args: &CompareArgs, console: Console) -> Result<(), Failure> {
    if args.reference_picture.is_none() {
        refuse_single_picture(args)?;
    }
    let folder =
        (!args.no_report).then(|| args.output.clone().unwrap_or_else(|| PathBuf::from(DEFAULT_REPORT)));
    if let Some(folder) = &folder {
        make_folder(folder)?;
    }
    let comparison = match &args.reference_picture {
        Some(reference) => of_pictures(args, reference)?,
        None => race::run(args, console).inspect_err(|failure| {
            if matches!(failure, Failure::Interrupted) {
                console.note("interrupted: no report was written");
            }
        })?,
    };
    let report = comparison.measure().map_err(Failure::failed)?;
    tell::tell(console, &report.figures);
    if let Some(folder) = &folder {
        let page = folder.join("index.html");
        report.write_html(&page)?;
        report.write_json(folder.join("report.json"))?;
        console.note(&format!("wrote {}", page.display()));
    }
    judge::judge(args, &report.figures, console)
}

/// A picture alone is an asset (an environment, heights), but who gives no technique has forgotten the other picture.
fn refuse_single_picture(args: &CompareArgs) -> Result<(), Failure> {
    let is_picture = PICTURES.contains(&extension(&args.input).as_str());
    if !is_picture || !args.technique.is_empty() || args.reference.is_some() {
        return Ok(());
    }
    let name = args.input.display();
    Err(Failure::usage(format!(
        "{name} is one picture, and it takes two: halflight compare {name} REFERENCE (to compare techniques on a scene \
         that is made of {name}, name them with -t)"
    )))
}

/// Makes the folder of the report, and learns now whether it can be written to.
fn make_folder(folder: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(folder)
        .map_err(|e| Failure::failed(format!("cannot make the folder {}: {e}", folder.display())))?;
    output::check_writable(&folder.join("index.html"))
}

fn of_pictures(args: &CompareArgs, reference: &Path) -> Result<Comparison, Failure> {
    if !args.technique.is_empty() || !args.spp.is_empty() || !args.time_limit.is_empty() {
        return Err(Failure::usage(
            "-t, --spp and --time-limit are for a scene; two pictures are compared as they are",
        ));
    }
    let (picture, truth) = (load(&args.input)?, load(reference)?);
    let (image_name, truth_name) = (args.input.display().to_string(), reference.display().to_string());
    let mut comparison =
        Comparison::new(format!("{image_name} against {truth_name}"), truth_name, truth.image);
    comparison.exposure_ev = args.exposure.map_or(0.0, |ev| ev as f32);
    comparison.reference_noise = args.reference_noise;
    comparison.candidates.push(Candidate {
        samples: picture.samples,
        seconds: picture.seconds,
        ..Candidate::new(image_name, picture.image)
    });
    for (label, cost) in [("reference samples", truth.samples), ("reference seconds", truth.seconds)] {
        if let Some(cost) = cost {
            comparison.note(label, cost.to_string());
        }
    }
    note_origin(&mut comparison);
    Ok(comparison)
}

/// Adds how the figures came to be.
fn note_origin(comparison: &mut Comparison) {
    let command: Vec<String> = std::env::args_os().map(|a| a.to_string_lossy().into_owned()).collect();
    comparison.note("command", command.join(" "));
    comparison.note("version", concat!("halflight ", env!("CARGO_PKG_VERSION")));
}

/// A picture and, if its file says so, what it cost.
struct Loaded {
    image: RgbImage,
    samples: Option<f64>,
    seconds: Option<f64>,
}

/// Pixels that are not finite are let in: the figures count them.
fn load(path: &Path) -> Result<Loaded, Failure> {
    if extension(path) == "exr" {
        let picture = Picture::load_exr(path)?;
        if let Some(image) = picture.rgb() {
            let number = |key: &str| {
                let number = picture.metadata.get(key)?.trim().parse::<f64>().ok()?;
                (number.is_finite() && number >= 0.0).then_some(number)
            };
            return Ok(Loaded { image, samples: number("samples"), seconds: number("seconds") });
        }
    }
    Ok(Loaded { image: load_rgb(path)?, samples: None, seconds: None })
}
