//! `halflight ddf mesh` and `halflight ddf samples`.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use clap::{Args, ValueEnum};
use halflight_ddf::{DirectedField, FieldSample, SampleScheme, UnitSpace, draw_samples, mesh_hash};
use halflight_file::extension;
use halflight_shape::{SphereFitOptions, SphereSet, write_ply};
use serde_json::json;

use super::super::console::Console;
use super::super::failure::Failure;
use super::super::parse::positive;
use super::super::{interrupt, output, words};

#[derive(Args, Debug)]
pub(super) struct MeshArgs {
    /// The .ddf file
    field: PathBuf,
    /// A .ply mesh, or a .spheres file
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Posts along each side of the grid of distances
    #[arg(long, value_name = "N", default_value_t = 96, value_parser = clap::value_parser!(u32).range(8..=512))]
    posts: u32,
    /// Take the least distance over so many directions at each post [002 eq. 5], not that to points of the surface
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(6..=4096))]
    directions: Option<u32>,
    /// Distance of the shell from the surface, in steps of the grid
    #[arg(long, value_name = "STEPS", value_parser = positive, default_value_t = 0.8)]
    shell: f64,
    /// How many spheres, for a .spheres file
    #[arg(short = 'n', long, value_name = "N", default_value_t = 50)]
    spheres: usize,
}

pub(super) fn mesh(args: &MeshArgs, console: Console) -> Result<(), Failure> {
    let kind = extension(&args.output);
    if kind != "ply" && kind != "spheres" {
        let path = args.output.display();
        return Err(Failure::usage(format!(
            "cannot write {path}: fields become .ply meshes or .spheres files"
        )));
    }
    output::check_writable(&args.output)?;
    let field = DirectedField::load(&args.field)?;
    let start = Instant::now();
    interrupt::listen();
    let shown = Mutex::new(Instant::now());
    let go_on = |part: f32| {
        if let Ok(mut shown) = shown.try_lock()
            && shown.elapsed() > Duration::from_secs(2)
        {
            *shown = Instant::now();
            super::tell(console, "distances", part);
        }
        !interrupt::is_asked_to_stop()
    };
    let grid = match args.directions {
        Some(directions) => field.distance_grid(args.posts, directions as usize),
        None => field.surface_grid(args.posts, &go_on).ok_or(Failure::Interrupted)?,
    };
    // Spheres fill a body: they are fitted to the solid, as everywhere else.
    let mesh = if kind == "ply" { grid.surface(args.shell as f32 * grid.step) } else { grid.solid() };
    if mesh.triangles.is_empty() {
        return Err(Failure::failed(format!(
            "{}: the field has no surface that the grid sees",
            args.field.display()
        )));
    }
    let what = if kind == "ply" {
        write_ply(&args.output, &mesh)?;
        words::count(mesh.triangles.len() as f64, "triangle")
    } else {
        let options = SphereFitOptions { spheres: args.spheres, ..SphereFitOptions::default() };
        let name = args.field.display().to_string();
        let (set, report) = SphereSet::fit(&name, &mesh, &options).map_err(Failure::failed)?;
        report.warnings.iter().for_each(|warning| console.warn(warning));
        set.save(&args.output)?;
        words::count(set.len() as f64, "sphere")
    };
    let seconds = start.elapsed().as_secs_f64();
    console.note(&format!("wrote {} with {what} in {}", args.output.display(), words::seconds(seconds)));
    console.event(
        "done",
        json!({ "output": args.output, "triangles": mesh.triangles.len(), "seconds": seconds }),
    );
    Ok(())
}

#[derive(Args, Debug)]
pub(super) struct SamplesArgs {
    /// A .ply, .obj, .gltf or .glb file
    mesh: PathBuf,
    /// The file of samples: a line of text, then records of seven little-endian floats
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Where samples are drawn
    #[arg(long, value_enum, default_value_t)]
    scheme: Scheme,
    /// Points on each face (surface)
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..))]
    faces: u32,
    /// Directions from each point (surface)
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..))]
    directions: u32,
    /// Points along each ray (surface)
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..))]
    marching: u32,
    /// How many samples (random, pov)
    #[arg(long, value_name = "N", default_value_t = 1_000_000, value_parser = clap::value_parser!(u32).range(1..))]
    count: u32,
    /// Seed of all random numbers
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Scheme {
    /// Points on the faces, directions from them, and steps along these
    #[default]
    Surface,
    /// Points of the bounding cube in uniform directions
    Random,
    /// The pixels of 50 cameras around the mesh
    Pov,
}

/// The most samples: 28 bytes each, as many as a file may hold.
const MOST_SAMPLES: u64 = 60_000_000;

pub(super) fn samples(args: &SamplesArgs, console: Console) -> Result<(), Failure> {
    output::check_writable(&args.output)?;
    let mesh = super::load_mesh(&args.mesh, console)?;
    let path: &Path = &args.mesh;
    let no_surface =
        || Failure::failed(format!("{}: the mesh has no surface to draw samples from", path.display()));
    let unit = UnitSpace::of_mesh(&mesh).ok_or_else(no_surface)?;
    let unit_mesh = Arc::new(unit.mesh_to_unit(&mesh));
    let scheme = match args.scheme {
        Scheme::Surface => SampleScheme::Surface {
            faces: args.faces as usize,
            directions: args.directions as usize,
            marching: args.marching as usize,
        },
        Scheme::Random => SampleScheme::Random { count: args.count as usize },
        Scheme::Pov => SampleScheme::PointOfView {
            azimuths: 10,
            polars: 5,
            pixels: (f64::from(args.count) / 50.0).sqrt().ceil() as usize,
        },
    };
    let most = match args.scheme {
        Scheme::Surface => [args.faces, args.directions, args.marching]
            .iter()
            .fold(4 * mesh.triangles.len() as u64, |product, &n| product.saturating_mul(u64::from(n))),
        _ => u64::from(args.count),
    };
    if most > MOST_SAMPLES {
        return Err(Failure::usage(format!(
            "up to {most} samples, where a file holds at most {MOST_SAMPLES}: ask for fewer points, directions or steps"
        )));
    }
    let start = Instant::now();
    let samples = draw_samples(&unit_mesh, scheme, args.seed);
    let seconds = start.elapsed().as_secs_f64();
    let misses = samples.iter().filter(|sample| sample.distance.is_infinite()).count();
    FieldSample::save(&samples, &mesh_hash(&mesh), &args.output)?;
    console.note(&format!(
        "wrote {} with {}, {:.1} % of them misses, drawn in {}",
        args.output.display(),
        words::count(samples.len() as f64, "sample"),
        100.0 * misses as f64 / samples.len().max(1) as f64,
        words::seconds(seconds)
    ));
    console.event(
        "done",
        json!({ "output": args.output, "samples": samples.len(), "misses": misses, "seconds": seconds }),
    );
    Ok(())
}
