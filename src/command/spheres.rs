//! `halflight spheres`: fits spheres to a mesh, says how well they stand for it, and shows them.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::{Args, Parser, Subcommand};
use glam::{Affine3A, Vec3};
use halflight::sphere_visibility::shell_errors;
use halflight_file::{extension, write_whole};
use halflight_shape::{SphereFitOptions, SphereSet, TriangleMesh, load_model, procedural, write_ply};
use serde_json::json;

use super::args::{Cli, Command};
use super::console::Console;
use super::failure::Failure;
use super::info::field;
use super::parse::finite;
use super::table::Table;
use super::{output, render, words};

#[derive(Args, Debug)]
pub(crate) struct SpheresArgs {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Fit spheres to a mesh or a model; they follow its joints
    Fit {
        /// A .ply, .obj, .gltf or .glb file
        mesh: PathBuf,
        /// How many spheres
        #[arg(short = 'n', long, value_name = "N", default_value_t = 50)]
        spheres: usize,
        /// The file, .spheres [default: beside the mesh, where `shexp` finds it]
        #[arg(short, long, value_name = "FILE")]
        output: Option<PathBuf>,
        /// Shrink all spheres by one factor until their shadows have the mean area of the mesh's, instead of covering
        /// all of its surface
        #[arg(long)]
        balanced: bool,
    },
    /// Say how well spheres stand for a mesh: volume outside, surface uncovered, silhouettes, visibility
    Check {
        /// The mesh or model they were fitted to
        mesh: PathBuf,
        /// The .spheres file
        spheres: PathBuf,
        /// Time in the model's animation, in seconds [default: at rest]
        #[arg(long, value_name = "SECONDS", value_parser = finite, allow_negative_numbers = true)]
        time: Option<f64>,
    },
    /// Render spheres, beside their mesh if it is given; or write them as a mesh
    Show {
        /// The .spheres file
        spheres: PathBuf,
        /// The mesh or model they were fitted to
        mesh: Option<PathBuf>,
        /// A picture, or a .ply mesh of the spheres [default: spheres.png]
        #[arg(short, long, value_name = "FILE", default_value = "spheres.png")]
        output: PathBuf,
        /// Time in the model's animation, in seconds [default: at rest]
        #[arg(long, value_name = "SECONDS", value_parser = finite, allow_negative_numbers = true, requires = "mesh")]
        time: Option<f64>,
    },
}

pub(crate) fn run(args: &SpheresArgs, console: Console) -> Result<(), Failure> {
    match &args.action {
        Action::Fit { mesh, spheres, output, balanced } => {
            fit(mesh, *spheres, output.as_deref(), *balanced, console)
        }
        Action::Check { mesh, spheres, time } => check(mesh, spheres, *time, console),
        Action::Show { spheres, mesh, output, time } => {
            show(spheres, mesh.as_deref(), output, *time, console)
        }
    }
}

fn fit(
    mesh: &Path,
    spheres: usize,
    path: Option<&Path>,
    balanced: bool,
    console: Console,
) -> Result<(), Failure> {
    let beside = || mesh.with_extension("spheres");
    let path = path.map_or_else(beside, Path::to_path_buf);
    if extension(&path) != "spheres" {
        return Err(Failure::usage(format!(
            "cannot write {}: sphere sets are .spheres files",
            path.display()
        )));
    }
    output::check_writable(&path)?;
    let model = load_model(mesh)?;
    let start = Instant::now();
    let options = SphereFitOptions { spheres, ..SphereFitOptions::default() };
    let (mut set, report) = SphereSet::fit_model(&model, &options).map_err(Failure::failed)?;
    report.warnings.iter().for_each(|warning| console.warn(warning));
    if balanced {
        set = set.balanced(&model.rest_surface().mesh).0;
    }
    let seconds = start.elapsed().as_secs_f64();
    set.save(&path)?;
    console.note(&format!(
        "wrote {} with {} in {}; {} points covered",
        path.display(),
        words::count(set.len() as f64, "sphere"),
        words::seconds(seconds),
        if balanced { "not all".into() } else { format!("all {}", report.covered_points) },
    ));
    let measure = set.measure(&model.rest_surface().mesh);
    console.note(&format!(
        "outside volume {}, uncovered surface {}",
        measure.outside_fraction().map_or("all (the mesh encloses nothing)".into(), percent),
        percent(measure.coverage.uncovered)
    ));
    console.event(
        "done",
        json!({
            "output": path, "seconds": seconds, "spheres": set.len(), "rounds": report.rounds,
            "teleports": report.teleports, "outside_fraction": measure.outside_fraction(),
            "uncovered": measure.coverage.uncovered, "has_interior": report.has_interior,
        }),
    );
    Ok(())
}

/// A set, and the mesh it belongs to, at one time.
fn posed(mesh: &Path, spheres: &Path, time: Option<f64>) -> Result<(SphereSet, TriangleMesh), Failure> {
    let set = SphereSet::load(spheres)?;
    let model = load_model(mesh)?;
    let rest = model.rest_surface();
    set.must_fit(&rest, spheres)?;
    Ok(match time {
        Some(time) => (set.posed(&model.rest_to_pose(time as f32)), model.surface_at(time as f32)),
        None => (set, rest.mesh),
    })
}

fn check(mesh: &Path, spheres: &Path, time: Option<f64>, console: Console) -> Result<(), Failure> {
    let (set, surface) = posed(mesh, spheres, time)?;
    let measure = set.measure(&surface);
    let outlines = set.silhouettes(&surface);
    let shells = shell_errors(&set, &surface);
    let mut text = format!(
        "{}: {} for {}\n",
        spheres.display(),
        words::count(set.len() as f64, "sphere"),
        mesh.display()
    );
    let outside = match measure.outside_fraction() {
        Some(share) => format!("{} of the mesh's volume", percent(share)),
        None => "all: the mesh encloses nothing".into(),
    };
    field(&mut text, "outside", outside);
    let coverage = measure.coverage;
    let bound = percent(coverage.uncertain);
    field(
        &mut text,
        "uncovered",
        format!("{} of the surface (certainly less than {bound})", percent(coverage.uncovered)),
    );
    field(
        &mut text,
        "silhouettes",
        format!(
            "overlap {} of 1 on average over 64 directions, {} at worst; area × {}",
            words::figure(outlines.mean_iou),
            words::figure(outlines.least_iou),
            words::figure(outlines.area_ratio)
        ),
    );
    let mut table = Table::new([
        "at radii",
        "blocked",
        "fit alone",
        "attenuated logs",
        "logs by 1/m",
        "the same, cut",
        "no spheres",
    ]);
    for shell in &shells {
        let figures =
            [shell.blocked, shell.fit, shell.attenuated, shell.divided, shell.cut, shell.none].map(percent);
        table.row([format!("{}", shell.radii)].into_iter().chain(figures));
    }
    field(&mut text, "visibility", "root mean square error in spherical harmonics of order 4");
    text += &table.to_text();
    console.answer(text.trim_end());
    console.event(
        "check",
        json!({
            "spheres": set.len(), "outside_fraction": measure.outside_fraction(),
            "outside_volume": measure.outside_volume, "mesh_volume": measure.mesh_volume,
            "uncovered": coverage.uncovered, "uncertain": coverage.uncertain, "mean_iou": outlines.mean_iou,
            "least_iou": outlines.least_iou, "area_ratio": outlines.area_ratio,
            "shells": shells.iter().map(|s| json!({
                "radii": s.radii, "blocked": s.blocked, "fit": s.fit, "attenuated": s.attenuated, "divided": s.divided,
                "cut": s.cut, "none": s.none,
            })).collect::<Vec<_>>(),
        }),
    );
    Ok(())
}

/// `1.23 %`
fn percent(share: f64) -> String {
    format!("{} %", words::figure(100.0 * share))
}

fn show(
    spheres: &Path,
    mesh: Option<&Path>,
    path: &Path,
    time: Option<f64>,
    console: Console,
) -> Result<(), Failure> {
    let (set, surface) = match mesh {
        Some(mesh) => posed(mesh, spheres, time).map(|(set, surface)| (set, Some(surface)))?,
        None => (SphereSet::load(spheres)?, None),
    };
    if extension(path) == "ply" {
        output::check_writable(path)?;
        write_ply(path, &as_mesh(&set))?;
        console.note(&format!("wrote {}", path.display()));
        console.event("done", json!({ "output": path }));
        return Ok(());
    }
    let failure =
        |e: std::io::Error| Failure::failed(format!("cannot make a scene of {}: {e}", spheres.display()));
    let folder = tempfile::tempdir().map_err(failure)?;
    let scene = folder.path().join("spheres.toml");
    if let Some(surface) = &surface {
        write_ply(&folder.path().join("surface.ply"), surface)?;
    }
    let text = scene_of(&set, surface.as_ref());
    write_whole(&scene, "scene file", |writer| std::io::Write::write_all(writer, text.as_bytes()))?;
    let line =
        ["halflight".as_ref(), "render".as_ref(), scene.as_os_str(), "--output".as_ref(), path.as_os_str()];
    let cli = Cli::try_parse_from(line).map_err(Failure::failed)?;
    match cli.command {
        Some(Command::Render(args)) => render::run(&args, console),
        _ => Ok(()),
    }
}

/// Colours of spheres by turns, so that neighbours can be told apart.
const COLORS: [[f32; 3]; 6] = [
    [0.75, 0.3, 0.2],
    [0.8, 0.6, 0.2],
    [0.35, 0.6, 0.3],
    [0.2, 0.5, 0.6],
    [0.3, 0.35, 0.7],
    [0.6, 0.35, 0.6],
];

/// A scene file: the spheres, the mesh on their left, and the ground.
fn scene_of(set: &SphereSet, surface: Option<&TriangleMesh>) -> String {
    let (low, high) = set.bounds().unwrap_or_default();
    let scale = (high - low).max_element().max(f32::MIN_POSITIVE);
    // Models come in any unit and place: the scene is of the size of a person, on the ground.
    let to_scene = Affine3A::from_scale(Vec3::splat(1.0 / scale))
        * Affine3A::from_translation(-Vec3::new(0.5 * (low.x + high.x), low.y, 0.5 * (low.z + high.z)));
    let placed = set.transformed(&to_scene);
    let mut text = String::from(
        "description = \"spheres\"\nenvironment = \"sky\"\n\n[image]\nsize = [640, 400]\n\n[[shape]]\ntype = \"plane\"\nmaterial = { type = \"diffuse\", albedo = 0.5 }\n",
    );
    let aside = if surface.is_some() { 0.6 } else { 0.0 };
    for (turn, color) in COLORS.iter().enumerate() {
        let spheres: Vec<String> = placed
            .spheres()
            .skip(turn)
            .step_by(COLORS.len())
            .map(|(c, r)| format!("[{:?}, {:?}, {:?}, {r:?}]", c.x + aside, c.y, c.z))
            .collect();
        if !spheres.is_empty() {
            text += &format!(
                "\n[[shape]]\ntype = \"spheres\"\nspheres = [{}]\nmaterial = {{ type = \"diffuse\", albedo = {color:?} }}\n",
                spheres.join(", ")
            );
        }
    }
    if surface.is_some() {
        let [x, y, z] = to_scene.translation.to_array();
        text += &format!(
            "\n[[shape]]\ntype = \"mesh\"\nfile = \"surface.ply\"\nmaterial = {{ type = \"diffuse\", albedo = 0.6 }}\ntransform = {{ scale = {:?}, translate = [{:?}, {y:?}, {z:?}] }}\n",
            1.0 / scale,
            x - aside
        );
    }
    text
}

/// All spheres as triangles.
fn as_mesh(set: &SphereSet) -> TriangleMesh {
    let ball = procedural::mesh::ico_sphere(1.0, 3);
    let mut whole = TriangleMesh::default();
    for (center, radius) in set.spheres() {
        let transform = Affine3A::from_translation(center) * Affine3A::from_scale(Vec3::splat(radius));
        whole.merge(&ball.transformed(&transform));
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_as_a_mesh_has_its_volume() {
        let set = SphereSet {
            centers: vec![Vec3::ZERO, 5.0 * Vec3::X],
            radii: vec![1.0, 2.0],
            ..SphereSet::default()
        };
        let volume = set.measure(&as_mesh(&set)).mesh_volume;
        assert!((volume / (36.0 / 3.0 * std::f64::consts::PI) - 1.0).abs() < 0.03, "{volume}");
    }
}
