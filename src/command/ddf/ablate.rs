//! `halflight ddf ablate`: how near fields come to their mesh with more and more samples [002 Table II, Fig. 6].
//!
//! Each figure is the Chamfer distance × 10³ of a field that was trained for the same number of steps, from nothing but
//! the samples that its row names. Its clouds are of what is seen from outside, the first hits of uniform lines, on both
//! sides: the surface scheme has no rays within closed meshes, as the seed wants it. With steps instead of seconds, and the same seed, the files are the same each time.

use std::path::PathBuf;
use std::sync::Arc;

use clap::Args;
use halflight_ddf::{
    Cloud, FastShape, FieldSample, SampleScheme, TrainOptions, UnitSpace, chamfer_e3, draw_samples,
    mesh_seen_points, seen_points,
};
use halflight_file::write_whole;
use halflight_shape::TriangleMesh;
use serde_json::{Value, json};
use std::io::Write as _;

use super::super::console::Console;
use super::super::failure::Failure;
use super::super::plot::{self, Line, Panel};
use super::super::stage::MachineArgs;
use super::super::table::Table;
use super::super::{interrupt, words};
use super::learner::{Learner, Network, Schedule};

#[derive(Args, Debug)]
pub(super) struct AblateArgs {
    /// A .ply, .obj, .gltf or .glb file
    mesh: PathBuf,
    /// The folder for ablation.json, ablation.txt and ablation.svg
    #[arg(short, long, value_name = "FOLDER", default_value = "ablation")]
    output: PathBuf,
    /// Steps of each training
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    steps: u64,
    /// Which network learns
    #[arg(long, value_enum, default_value_t)]
    network: Network,
    /// Cells along the bounding cube: few, so that what is learned counts, and not the cells themselves
    #[arg(long, value_name = "N", default_value_t = 32)]
    resolution: u32,
    /// What s_fc, s_dr and s_p are set to, one at a time
    #[arg(long, value_name = "N,…", value_delimiter = ',', default_values_t = [1, 2, 4], value_parser = clap::value_parser!(u32).range(1..=1000))]
    values: Vec<u32>,
    /// What the other two are meanwhile
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..=1000))]
    others: u32,
    /// Samples of each of the three kinds: random, point of view, surface
    #[arg(long, value_name = "N,…", value_delimiter = ',', default_values_t = [1_000, 10_000, 100_000, 1_000_000], value_parser = clap::value_parser!(u32).range(10..=20_000_000))]
    counts: Vec<u32>,
    /// Points a side of the Chamfer distance
    #[arg(long, value_name = "N", default_value_t = 30_000, value_parser = clap::value_parser!(u32).range(100..=3_000_000))]
    points: u32,
    /// Seed of all random numbers
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    machine: MachineArgs,
}

/// Most samples of one training: 28 bytes each.
const MOST_SAMPLES: u64 = 40_000_000;

pub(super) fn run(args: &AblateArgs, console: Console) -> Result<(), Failure> {
    args.machine.apply()?;
    let mesh = super::load_mesh(&args.mesh, console)?;
    let name = |what: String| Failure::failed(format!("{}: {what}", args.mesh.display()));
    let unit = UnitSpace::of_mesh(&mesh)
        .ok_or_else(|| name("the mesh has no surface to draw samples from".into()))?;
    let largest = args.values.iter().copied().max().unwrap_or(1);
    let most = 4 * mesh.triangles.len() as u64 * u64::from(largest) * u64::from(args.others).pow(2);
    if most > MOST_SAMPLES {
        return Err(Failure::usage(format!(
            "up to {most} samples of {} triangles, where a training takes at most {MOST_SAMPLES}: ask for smaller --values or \
             --others",
            mesh.triangles.len()
        )));
    }
    std::fs::create_dir_all(&args.output)
        .map_err(|error| Failure::failed(format!("cannot make {}: {error}", args.output.display())))?;
    interrupt::listen();
    let unit_mesh = Arc::new(unit.mesh_to_unit(&mesh));
    let of_mesh = Cloud::new(mesh_seen_points(&unit_mesh, args.points as usize, 1));
    let other = Cloud::new(mesh_seen_points(&unit_mesh, args.points as usize, 2));
    let bench = Bench { args, mesh: &mesh, unit_mesh, floor: chamfer_e3(&other, &of_mesh), of_mesh, console };

    let mut of_parameters: Vec<Vec<Trained>> = Vec::new();
    for parameter in 0..3 {
        let mut row = Vec::new();
        for &value in &args.values {
            let mut n = [args.others as usize; 3];
            n[parameter] = value as usize;
            let scheme = SampleScheme::Surface { faces: n[0], directions: n[1], marching: n[2] };
            row.push(bench.train(
                &format!("{} = {value}", PARAMETERS[parameter]),
                draw_samples(&bench.unit_mesh, scheme, args.seed),
            )?);
        }
        of_parameters.push(row);
    }
    let mut of_counts: Vec<Vec<Trained>> = Vec::new();
    for kind in 0..3 {
        let mut row = Vec::new();
        for &count in &args.counts {
            row.push(bench.train(&format!("{count} {}", KINDS[kind]), bench.draw(kind, count as usize))?);
        }
        of_counts.push(row);
    }
    bench.write(&of_parameters, &of_counts)
}

const PARAMETERS: [&str; 3] = ["s_fc", "s_dr", "s_p"];
const KINDS: [&str; 3] = ["random", "pov", "surface"];

/// What became of one training.
struct Trained {
    samples: usize,
    chamfer_e3: f64,
}

impl Trained {
    fn to_json(&self) -> Value {
        json!({ "samples": self.samples, "chamfer_e3": self.chamfer_e3 })
    }
}

struct Bench<'a> {
    args: &'a AblateArgs,
    mesh: &'a TriangleMesh,
    unit_mesh: Arc<TriangleMesh>,
    of_mesh: Cloud,
    floor: f64,
    console: Console,
}

impl Bench<'_> {
    /// So many samples of a kind: every so-manieth of the least whole number of faces or pixels that gives enough.
    fn draw(&self, kind: usize, count: usize) -> Vec<FieldSample> {
        let seed = self.args.seed;
        let samples = match kind {
            0 => draw_samples(&self.unit_mesh, SampleScheme::Random { count }, seed),
            1 => {
                let pixels = (count as f64 / 50.0).sqrt().ceil() as usize;
                let scheme = SampleScheme::PointOfView { azimuths: 10, polars: 5, pixels };
                draw_samples(&self.unit_mesh, scheme, seed)
            }
            _ => {
                // Each point gives two samples or more, for each of 2 × 2 directions and steps that is not within.
                let faces = (count / (2 * self.unit_mesh.triangles.len().max(1))).clamp(1, 10_000);
                draw_samples(
                    &self.unit_mesh,
                    SampleScheme::Surface { faces, directions: 2, marching: 2 },
                    seed,
                )
            }
        };
        let have = samples.len();
        if have <= count {
            return samples;
        }
        (0..count).map(|i| samples[(i as u128 * have as u128 / count as u128) as usize]).collect()
    }

    fn train(&self, what: &str, samples: Vec<FieldSample>) -> Result<Trained, Failure> {
        let args = self.args;
        let count = samples.len();
        let options = TrainOptions {
            shape: FastShape { resolution: args.resolution, ..FastShape::default() },
            seed: args.seed,
            ..TrainOptions::default()
        };
        let name = |error| Failure::failed(format!("{}: {what}: {error}", args.mesh.display()));
        let mut learner =
            Learner::new(self.mesh, Some(samples), args.network, Schedule::Ours, options).map_err(name)?;
        for step in 0..args.steps {
            if interrupt::is_asked_to_stop() {
                return Err(Failure::Interrupted);
            }
            learner.step(step as f32 / args.steps as f32).map_err(name)?;
        }
        let points = Cloud::new(seen_points(&learner.field(), args.points as usize, 3));
        let trained = Trained { samples: count, chamfer_e3: chamfer_e3(&points, &self.of_mesh) };
        self.console.note(&format!(
            "{what}: {}, Chamfer × 10³ {}",
            words::count(count as f64, "sample"),
            words::figure(trained.chamfer_e3)
        ));
        self.console.event("trained", json!({ "what": what, "result": trained.to_json() }));
        Ok(trained)
    }

    fn write(&self, of_parameters: &[Vec<Trained>], of_counts: &[Vec<Trained>]) -> Result<(), Failure> {
        let args = self.args;
        let cell = |t: &Trained| words::figure(t.chamfer_e3);
        let mut first = Table::new(["n", "s_fc = n", "s_dr = n", "s_p = n"]);
        for (number, value) in args.values.iter().enumerate() {
            let cells = of_parameters.iter().map(|row| cell(&row[number]));
            first.row(std::iter::once(value.to_string()).chain(cells));
        }
        let mut second = Table::new(std::iter::once("samples").chain(KINDS));
        for (number, count) in args.counts.iter().enumerate() {
            let cells = of_counts.iter().map(|row| cell(&row[number]));
            second.row(std::iter::once(count.to_string()).chain(cells));
        }
        let network = match args.network {
            Network::Fast => format!("fast network, {}³ cells", args.resolution),
            Network::Seed => "network of 002".to_string(),
        };
        let text = format!(
            "Chamfer × 10³ after {} steps of the {network}; {} points a side that are seen from outside, of two such clouds of the \
             mesh itself {}\n\n\
             surface samples, the other two at {}\n{}\n\nsamples of each kind\n{}\n",
            args.steps,
            args.points,
            words::figure(self.floor),
            args.others,
            first.to_text(),
            second.to_text()
        );
        let folder = |name: &str| args.output.join(name);
        write_whole(&folder("ablation.txt"), "table", |to| to.write_all(text.as_bytes()))?;
        let list = |row: &Vec<Trained>| row.iter().map(Trained::to_json).collect::<Value>();
        let named = |names: [&str; 3], rows: &[Vec<Trained>]| -> Value {
            names.iter().zip(rows).map(|(name, row)| (name.to_string(), list(row))).collect()
        };
        let all = json!({
            "mesh": args.mesh.file_name().map(|name| name.to_string_lossy().into_owned()),
            "triangles": self.mesh.triangles.len(), "steps": args.steps, "seed": args.seed, "points": args.points,
            "network": network, "floor_e3": self.floor, "values": args.values, "others": args.others,
            "parameters": named(PARAMETERS, of_parameters), "kinds": named(KINDS, of_counts),
        });
        let pretty = serde_json::to_string_pretty(&all).map_err(|e| Failure::failed(e.to_string()))?;
        write_whole(&folder("ablation.json"), "table", |to| to.write_all(pretty.as_bytes()))?;
        let panel = |across: &str, names: [&str; 3], rows: &[Vec<Trained>]| Panel {
            across: across.into(),
            up: "Chamfer × 10³".into(),
            lines: names
                .iter()
                .zip(rows)
                .map(|(name, row)| Line {
                    name: name.to_string(),
                    points: row.iter().map(|t| (t.samples as f64, t.chamfer_e3)).collect(),
                })
                .collect(),
            mark: Some((self.floor, "mesh itself".into())),
        };
        plot::save(
            &folder("ablation.svg"),
            &[
                panel("samples: one parameter at a time", PARAMETERS, of_parameters),
                panel("samples of each kind", KINDS, of_counts),
            ],
        )?;
        self.console.answer(text.trim_end());
        self.console.note(&format!("wrote {} with table and plot", args.output.display()));
        self.console.event("done", all);
        Ok(())
    }
}
