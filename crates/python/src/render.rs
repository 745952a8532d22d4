//! Rendering, whole or in tiles.

use halflight::Budget;
use halflight::image::Picture;
use halflight::job::{Format, JobError, Order, Share, ShotPicture, TechniqueSpec, choose_layers, create};
use halflight::render::techniques::TECHNIQUES;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::{failed, of_job, usage};
use crate::picture::{Shown, groups};
use crate::stage::{Stage, size_of};
use crate::work::{Watch, ended, watched};

pub(crate) fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(render, module)?)?;
    module.add_function(wrap_pyfunction!(tile_region, module)?)?;
    module.add_function(wrap_pyfunction!(techniques, module)?)
}

/// Names of the techniques, each with its settings: key, what it takes, what it does.
#[pyfunction]
fn techniques() -> Vec<(&'static str, Vec<(String, String)>)> {
    let settings = |entry: &halflight::render::techniques::Entry| {
        entry.settings().into_iter().map(|doc| (doc.name, doc.about)).collect()
    };
    TECHNIQUES.iter().map(|entry| (entry.name, settings(entry))).collect()
}

/// Left column, top row, columns and rows of a tile.
#[pyfunction]
fn tile_region(tile: (u32, u32), size: (usize, usize)) -> PyResult<(usize, usize, usize, usize)> {
    let size = size_of(size)?;
    let region = Share::new(tile.0, tile.1).and_then(|share| share.region(size.width, size.height));
    region.map(|r| (r.x, r.y, r.width, r.height)).map_err(usage)
}

/// What is asked for, apart from the scene.
struct Wish {
    spec: TechniqueSpec,
    size: Option<(usize, usize)>,
    budget: Budget,
    layers: Vec<&'static str>,
    share: Option<Share>,
    frame: f64,
    time: f64,
}

/// Renders one picture or a tile of it: groups of channels, metadata, facts.
#[pyfunction]
#[pyo3(signature = (stage, technique, settings, *, size, samples, seconds, error, seed, layers, frame, time, tile, threads, progress))]
fn render<'py>(
    py: Python<'py>,
    stage: &Bound<'py, Stage>,
    technique: &str,
    settings: Vec<String>,
    size: Option<(usize, usize)>,
    samples: Option<u32>,
    seconds: Option<f64>,
    error: Option<f64>,
    seed: u64,
    layers: &str,
    frame: f64,
    time: f64,
    tile: Option<(u32, u32)>,
    threads: Option<usize>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Shown<'py>> {
    let mut spec: TechniqueSpec = technique.parse().map_err(usage)?;
    spec.settings.extend(settings);
    let wish = Wish {
        spec,
        size,
        budget: Budget { samples, seconds, error, seed },
        layers: choose_layers(Some(layers), Format::Exr).map_err(of_job)?,
        share: tile.map(|(index, count)| Share::new(index, count)).transpose().map_err(usage)?,
        frame,
        time,
    };
    let stage = stage.get();
    if let Some(size) = wish.size {
        size_of(size)?;
    }
    let outcome = watched(py, threads, progress, |watch| shoot(stage, &wish, watch))?;
    let shown = match outcome.result {
        Ok(shot) if shot.samples > 0.0 => Some(show(py, shot)?),
        Ok(_) => None,
        Err(error) => return Err(outcome.trouble.unwrap_or_else(|| of_job(error))),
    };
    match (outcome.trouble, shown) {
        (Some(trouble), shown) => {
            let shown = shown.map(|shown| shown.into_pyobject(py)).transpose()?;
            Err(ended(py, trouble, shown.map(|shown| shown.into_any().unbind())))
        }
        (None, Some(shown)) => Ok(shown),
        (None, None) => Err(failed("stopped before the first sample: there is no picture")),
    }
}

fn shoot(stage: &Stage, wish: &Wish, watch: &Watch) -> Result<ShotPicture, JobError> {
    let fresh = create(&wish.spec, &stage.loaded)?;
    let made = match stage.take(&fresh.identity) {
        Some(made) => made,
        None => {
            let mut made = fresh;
            // Refused before the work that is worth hours.
            order(stage, wish, &made)?.check()?;
            made.technique.prepare(stage.loaded.scene(), watch)?;
            made
        }
    };
    let shot = order(stage, wish, &made)?.shoot(wish.frame, wish.time, watch)?;
    if !watch.is_stopped() {
        stage.keep(made);
    }
    Ok(shot)
}

fn order<'a>(
    stage: &'a Stage,
    wish: &Wish,
    made: &'a halflight::render::techniques::Made,
) -> Result<Order<'a>, JobError> {
    let mut order = Order::new(&stage.loaded, made);
    if let Some((width, height)) = wish.size {
        order.size = halflight::job::Size { width, height };
    }
    order.budget = wish.budget.clone();
    order.layers.clone_from(&wish.layers);
    order.share = wish.share;
    Ok(order)
}

/// The picture and all that is known of it, for Python.
fn show(py: Python<'_>, shot: ShotPicture) -> PyResult<Shown<'_>> {
    let facts = PyDict::new(py);
    facts.set_item("samples", shot.samples)?;
    facts.set_item("seconds", shot.report.elapsed.as_secs_f64())?;
    facts.set_item("build_seconds", shot.build_seconds)?;
    facts.set_item("rays", shot.report.rays)?;
    facts.set_item("non_finite", shot.report.non_finite)?;
    facts.set_item("interrupted", shot.report.interrupted)?;
    facts.set_item("relative_error", shot.report.relative_error)?;
    facts.set_item("notes", shot.report.notes)?;
    let stages = shot.report.stages.iter().map(|(name, time)| (*name, time.as_secs_f64()));
    facts.set_item("stages", stages.collect::<Vec<_>>())?;
    let Picture { width, height, channels, metadata } = shot.picture;
    Ok((groups(py, [height, width], channels)?, metadata, facts))
}
