//! `halflight ddf render`: what a field says, pixel by pixel, without light.

use std::path::PathBuf;
use std::sync::Arc;

use clap::{Args, ValueEnum};
use glam::{Quat, Vec3};
use halflight_ddf::{Answered, DirectedField, FieldTracer};
use halflight_image::{Picture, ToneCurve};
use halflight_trace::bench::{View, primary_rays};
use halflight_trace::{MeshTracer, Ray, RayGeometry};
use rayon::prelude::*;
use serde_json::json;

use super::super::console::Console;
use super::super::failure::Failure;
use super::super::output::{self, Encoding};
use super::super::parse::finite;
use super::super::stage::MachineArgs;
use super::super::words;
use super::sheet::{self, Sheet};

#[derive(Args, Debug)]
pub(super) struct RenderFieldArgs {
    /// The .ddf file
    field: PathBuf,
    /// Its mesh: the picture shows the mesh on the left, the field on the right
    mesh: Option<PathBuf>,
    /// The picture; .exr holds all layers
    #[arg(short, long, value_name = "FILE", default_value = "field.png")]
    output: PathBuf,
    /// What the colours show
    #[arg(long, value_enum, default_value_t)]
    show: Show,
    /// Width and height of the view, in pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 512, value_parser = clap::value_parser!(u32).range(8..=8192))]
    size: u32,
    /// Turn the view about the vertical axis
    #[arg(long, value_name = "DEGREES", value_parser = finite, default_value_t = 0.0, allow_negative_numbers = true)]
    azimuth: f64,
    /// Ask the mesh where the field is in doubt, and show which rays those are in the layer `fallback`
    #[arg(long, requires = "mesh")]
    fallback: bool,
    /// Make a sheet of panels instead, each of so many pixels a side as `--size` says
    #[arg(long, value_enum, requires = "mesh", conflicts_with_all = ["show", "fallback", "azimuth"])]
    sheet: Option<Sheet>,
    /// Another field and its mesh, for more rows of a sheet
    #[arg(long, num_args = 2, value_names = ["FIELD", "MESH"], requires = "sheet")]
    also: Vec<PathBuf>,
    #[command(flatten)]
    machine: MachineArgs,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum Show {
    /// Normals, towards the viewer
    #[default]
    Normal,
    /// Distances from near (white) to far (dark)
    Distance,
    /// Distances of the field minus those of the mesh: red is too far, blue too near
    Difference,
    /// How sure the field is: bright where the least certain cell was certain
    Confidence,
}

/// What one ray saw.
#[derive(Clone, Copy, Default)]
pub(super) struct Seen {
    distance: f32,
    normal: Vec3,
    doubt: f32,
    fell_back: bool,
}

pub(super) fn run(args: &RenderFieldArgs, console: Console) -> Result<(), Failure> {
    args.machine.apply()?;
    output::check_writable(&args.output)?;
    if args.mesh.is_none() && args.show == Show::Difference {
        return Err(Failure::usage(
            "`--show difference` needs the mesh that the field is held against: halflight ddf render FIELD MESH --show difference",
        ));
    }
    if let (Some(sheet), Some(mesh)) = (args.sheet, &args.mesh) {
        let also = args.also.chunks_exact(2).map(|pair| (pair[0].clone(), pair[1].clone()));
        let pairs: Vec<(PathBuf, PathBuf)> =
            std::iter::once((args.field.clone(), mesh.clone())).chain(also).collect();
        sheet::save(sheet, &pairs, (&args.output, args.size), console)?;
        console.note(&format!("wrote {}", args.output.display()));
        console.event("done", json!({ "output": args.output }));
        return Ok(());
    }
    let mut field = DirectedField::load(&args.field)?;
    field.set_simd(args.machine.simd()?);
    let field = Arc::new(field);
    let mesh = match &args.mesh {
        Some(path) => {
            let mesh = super::load_mesh(path, console)?;
            super::warn_of_other_mesh((&args.field, &field), (path, &mesh), console);
            Some(Arc::new(MeshTracer::build(Arc::new(mesh))))
        }
        None => None,
    };
    let tracer = match &mesh {
        Some(mesh) if args.fallback => FieldTracer::with_fallback(Arc::clone(&field), Arc::clone(mesh)),
        _ => FieldTracer::new(Arc::clone(&field)),
    };
    let size = args.size;
    let rays = view_rays(field.bounds(), size, (args.azimuth as f32, 1.0));
    let of_field: Vec<Seen> = rays.par_iter().map(|ray| by_field(&tracer, ray)).collect();
    let of_mesh: Option<Vec<Seen>> =
        mesh.as_ref().map(|mesh| rays.par_iter().map(|ray| by_mesh(mesh, ray)).collect());
    let panels: Vec<&Vec<Seen>> = of_mesh.iter().chain([&of_field]).collect();
    let (columns, rows) = (size as usize * panels.len(), size as usize);
    let scale = Range::of(&panels);
    let mut picture = Picture::new(columns, rows);
    let at = |x: usize, y: usize| {
        let (panel, x) = (x / size as usize, x % size as usize);
        let index = index_of(x as u32, y as u32, size);
        let truth = of_mesh.as_ref().map(|seen| seen[index]);
        (panels[panel][index], truth)
    };
    let layer = |f: &dyn Fn(Seen, Option<Seen>) -> f32| -> Vec<f32> {
        (0..rows * columns)
            .map(|i| at(i % columns, i / columns))
            .map(|(seen, truth)| f(seen, truth))
            .collect()
    };
    for (channel, name) in ["R", "G", "B"].into_iter().enumerate() {
        picture.push(name, layer(&|seen, truth| color(args.show, &scale, seen, truth)[channel]));
    }
    picture.push("depth.Z", layer(&|seen, _| seen.distance));
    for (axis, name) in ["normal.X", "normal.Y", "normal.Z"].into_iter().enumerate() {
        picture.push(name, layer(&|seen, _| seen.normal[axis]));
    }
    picture.push("confidence.Y", layer(&|seen, _| seen.doubt));
    picture.push("fallback.Y", layer(&|seen, _| f32::from(u8::from(seen.fell_back))));
    let encoding = Encoding { exposure_ev: 0.0, tone: ToneCurve::Srgb, half: false };
    output::save(&args.output, &picture, &encoding)?;
    let counts = tracer.fallback_counts();
    let share = |part: u64| 100.0 * part as f64 / counts.asked.max(1) as f64;
    let mut text = format!("wrote {}", args.output.display());
    if args.fallback {
        text += &format!(
            "; {:.1} % of the rays were asked of the mesh, {:.1} % confirmed on it",
            share(counts.fell_back),
            share(counts.confirmed)
        );
    }
    if let Some(of_mesh) = &of_mesh {
        let right =
            of_mesh.iter().zip(&of_field).filter(|(a, b)| (a.distance > 0.0) == (b.distance > 0.0)).count();
        text += &format!(
            "; {} of the pixels agree on hit or miss",
            words::figure(right as f64 / rays.len() as f64)
        );
    }
    console.note(&text);
    console.event(
        "done",
        json!({
            "output": args.output, "asked": counts.asked, "fell_back": counts.fell_back,
            "confirmed": counts.confirmed,
        }),
    );
    Ok(())
}

/// Rays of a square view from the front, turned about the vertical axis, from so many times as far away, tile by tile of 8 × 8.
pub(super) fn view_rays(bounds: (Vec3, Vec3), size: u32, (azimuth_degrees, away): (f32, f32)) -> Vec<Ray> {
    let view = View::outside(bounds);
    let turn = Quat::from_rotation_y(azimuth_degrees.to_radians());
    let eye = view.target + away * (turn * (view.eye - view.target));
    primary_rays(&View { eye, ..view }, size)
}

/// Where the ray of a pixel stands among the rays of a view.
pub(super) fn index_of(x: u32, y: u32, size: u32) -> usize {
    // Tiles at the right and lower border are cut.
    let (tile_x, tile_y) = (x / 8, y / 8);
    let high = (size - tile_y * 8).min(8);
    let wide = (size - tile_x * 8).min(8);
    let before = tile_y * 8 * size + tile_x * 8 * high;
    (before + (y % 8) * wide + x % 8) as usize
}

pub(super) fn by_field(tracer: &FieldTracer, ray: &Ray) -> Seen {
    let (hit, answered) = tracer.closest_with_source(ray);
    let (_, doubt) = tracer.field().query_with_doubt(ray.origin, ray.direction, ray.t_max);
    let doubt = 1.0 / (1.0 + (-doubt.abs()).exp());
    let fell_back = answered == Answered::Mesh;
    match hit {
        Some(hit) => {
            let normal = tracer.surface(ray, &hit).geometric_normal;
            Seen { distance: hit.t, normal: towards(normal, ray), doubt, fell_back }
        }
        None => Seen { doubt, fell_back, ..Seen::default() },
    }
}

pub(super) fn by_mesh(mesh: &MeshTracer, ray: &Ray) -> Seen {
    match mesh.closest(ray) {
        Some(hit) => {
            let normal = mesh.surface(ray, &hit).geometric_normal;
            Seen { distance: hit.t, normal: towards(normal, ray), doubt: 1.0, fell_back: false }
        }
        None => Seen { doubt: 1.0, ..Seen::default() },
    }
}

fn towards(normal: Vec3, ray: &Ray) -> Vec3 {
    if normal.dot(ray.direction) > 0.0 { -normal } else { normal }
}

/// The distances that are shown.
pub(super) struct Range {
    near: f32,
    far: f32,
}

impl Range {
    pub(super) fn of(panels: &[&Vec<Seen>]) -> Range {
        let hits = || panels[0].iter().map(|seen| seen.distance).filter(|&t| t > 0.0);
        let near = hits().fold(f32::INFINITY, f32::min);
        let far = hits().fold(0.0, f32::max);
        if near < far { Range { near, far } } else { Range { near: 0.0, far: 1.0 } }
    }
}

pub(super) fn color(show: Show, range: &Range, seen: Seen, truth: Option<Seen>) -> [f32; 3] {
    let is_hit = seen.distance > 0.0;
    match show {
        Show::Normal if is_hit => (seen.normal * 0.5 + 0.5).to_array(),
        Show::Distance if is_hit => {
            let part = (seen.distance - range.near) / (range.far - range.near);
            [(1.0 - 0.9 * part).clamp(0.05, 1.0).powi(2); 3]
        }
        Show::Difference => match truth {
            Some(truth) if is_hit && truth.distance > 0.0 => {
                // White to full colour over a fiftieth of the depth that is seen.
                let part = (seen.distance - truth.distance) / (range.far - range.near) * 50.0;
                let fade = (1.0 - part.abs()).clamp(0.0, 1.0);
                if part > 0.0 { [1.0, fade, fade] } else { [fade, fade, 1.0] }
            }
            Some(truth) if is_hit != (truth.distance > 0.0) => [0.0, 0.6, 0.0],
            _ => [0.0; 3],
        },
        Show::Confidence => [((seen.doubt - 0.5) * 2.0).powi(2); 3],
        _ => [0.0; 3],
    }
}
