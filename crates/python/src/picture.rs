//! Pictures: to and from files, joined, compared.

use std::collections::BTreeMap;
use std::path::PathBuf;

use halflight::image::metrics::{Difference, flip, hdr_flip, relative_squared_error, signed_difference};
use halflight::image::{Channel, Picture, Plane, ToneCurve, ToneMapping, encode_png, load_rgb};
use halflight::job::merge::{Wishes, merge as merge_files};
use halflight::job::{Encoding, automatic_exposure, save};
use numpy::{IntoPyArray, ndarray::ArrayD};
use numpy::{PyArrayDyn, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::arrays::{image, slice2, table};
use crate::errors::{failed, of_job, usage};

/// Groups of channels, metadata, facts.
pub(crate) type Shown<'py> = (Vec<Group<'py>>, BTreeMap<String, String>, Bound<'py, PyDict>);
/// The name of a layer, those of its channels, and their values: rows × columns (× channels).
pub(crate) type Group<'py> = (String, Vec<String>, Bound<'py, PyArrayDyn<f32>>);

pub(crate) fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(load_picture, module)?)?;
    module.add_function(wrap_pyfunction!(save_picture, module)?)?;
    module.add_function(wrap_pyfunction!(save_tile, module)?)?;
    module.add_function(wrap_pyfunction!(load_image, module)?)?;
    module.add_function(wrap_pyfunction!(png, module)?)?;
    module.add_function(wrap_pyfunction!(exposure_of, module)?)?;
    module.add_function(wrap_pyfunction!(merge, module)?)?;
    module.add_function(wrap_pyfunction!(compare, module)?)
}

/// Channels by layer, in the order R, G, B, A and then by name. Channels of a layer share one array: their values are
/// interleaved, once.
pub(crate) fn groups<'py>(
    py: Python<'py>,
    [height, width]: [usize; 2],
    channels: Vec<Channel>,
) -> PyResult<Vec<Group<'py>>> {
    let mut layers: Vec<(String, Vec<Channel>)> = Vec::new();
    for channel in channels {
        let layer = match channel.name.as_str() {
            "R" | "G" | "B" => "rgb",
            name => name.split('.').next().unwrap_or(name),
        };
        match layers.iter_mut().find(|(name, _)| name == layer) {
            Some((_, list)) => list.push(channel),
            None => layers.push((layer.to_string(), vec![channel])),
        }
    }
    for (name, list) in &mut layers {
        // Red before green before blue, x before y before z.
        let place = |channel: &Channel| match channel.name.rsplit('.').next().unwrap_or_default() {
            "R" => "0".to_string(),
            "G" => "1".to_string(),
            "B" => "2".to_string(),
            other => format!("9{other}"),
        };
        if name != "A" {
            list.sort_by_key(place);
        }
    }
    layers
        .into_iter()
        .map(|(layer, list)| {
            let names: Vec<String> = list.iter().map(|channel| channel.name.clone()).collect();
            let many = list.len();
            let array = if let [_] = list.as_slice() {
                let values = list.into_iter().next().map(|channel| channel.values).unwrap_or_default();
                ArrayD::from_shape_vec(vec![height, width], values)
            } else {
                let mut values = vec![0.0; height * width * many];
                for (c, channel) in list.iter().enumerate() {
                    values
                        .iter_mut()
                        .skip(c)
                        .step_by(many)
                        .zip(&channel.values)
                        .for_each(|(to, from)| *to = *from);
                }
                ArrayD::from_shape_vec(vec![height, width, many], values)
            };
            Ok((layer, names, array.map_err(failed)?.into_pyarray(py)))
        })
        .collect()
}

/// The names of tone curves.
pub(crate) fn tone_name(tone: ToneCurve) -> &'static str {
    match tone {
        ToneCurve::Srgb => "srgb",
        ToneCurve::Filmic => "filmic",
    }
}

fn tone_of(name: &str) -> PyResult<ToneCurve> {
    match name {
        "srgb" => Ok(ToneCurve::Srgb),
        "filmic" => Ok(ToneCurve::Filmic),
        _ => Err(usage(format!("there is no tone curve {name:?} (there are srgb and filmic)"))),
    }
}

/// Reads an EXR with all its layers.
#[pyfunction]
fn load_picture(py: Python<'_>, path: PathBuf) -> PyResult<(Vec<Group<'_>>, BTreeMap<String, String>)> {
    let picture = py.detach(|| Picture::load_exr(&path)).map_err(failed)?;
    Ok((groups(py, [picture.height, picture.width], picture.channels)?, picture.metadata))
}

/// Reads the colour of a picture of any format: rows × columns × 3.
#[pyfunction]
fn load_image(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, numpy::PyArray3<f32>>> {
    let image = py.detach(|| load_rgb(&path)).map_err(failed)?;
    let values = image.pixels.into_flattened();
    crate::arrays::block(py, [image.height, image.width, 3], values)
}

type Channels<'py> = Vec<(String, PyReadonlyArray2<'py, f32>)>;

fn picture_of(channels: &Channels<'_>, metadata: BTreeMap<String, String>) -> PyResult<Picture> {
    let Some((_, first)) = channels.first() else { return Err(usage("a picture without channels")) };
    let [height, width] = [first.shape()[0], first.shape()[1]];
    let mut picture = Picture::new(width, height);
    for (name, values) in channels {
        if values.shape() != [height, width] {
            return Err(usage(format!(
                "the channel {name} has {:?} values, others {height} × {width}",
                values.shape()
            )));
        }
        picture.push(name.clone(), slice2(values)?.to_vec());
    }
    picture.metadata = metadata;
    Ok(picture)
}

/// Writes a picture in the format of its name, whole or not at all.
#[pyfunction]
fn save_picture(
    py: Python<'_>,
    path: PathBuf,
    channels: Channels<'_>,
    metadata: BTreeMap<String, String>,
    exposure: Option<f32>,
    tone: &str,
    half: bool,
) -> PyResult<()> {
    let picture = picture_of(&channels, metadata)?;
    let tone = tone_of(tone)?;
    py.detach(|| {
        let exposure_ev =
            exposure.unwrap_or_else(|| picture.rgb().map_or(0.0, |image| automatic_exposure(&image)));
        save(&path, &picture, &Encoding { exposure_ev, tone, half })
    })
    .map_err(of_job)
}

/// Writes a tile: an EXR that knows its place.
#[pyfunction]
fn save_tile(
    py: Python<'_>,
    path: PathBuf,
    channels: Channels<'_>,
    metadata: BTreeMap<String, String>,
    tile: (u32, u32),
    whole: (usize, usize),
    samples: Option<u32>,
    exposure: Option<f32>,
    tone: &str,
    half: bool,
) -> PyResult<()> {
    let picture = picture_of(&channels, metadata)?;
    let share = halflight::job::Share::new(tile.0, tile.1).map_err(usage)?;
    let size = crate::stage::size_of(whole)?;
    let showing = halflight::job::Showing { exposure_ev: exposure, tone: tone_of(tone)? };
    py.detach(|| halflight::job::save_share(&path, picture, share, size, samples, showing, half))
        .map_err(of_job)
}

/// The stops that bring the mean of a picture to middle grey.
#[pyfunction]
fn exposure_of(rgb: PyReadonlyArray3<'_, f32>) -> PyResult<f32> {
    Ok(automatic_exposure(&image(&rgb)?))
}

/// A PNG in memory.
#[pyfunction]
fn png<'py>(
    py: Python<'py>,
    rgb: PyReadonlyArray3<'py, f32>,
    exposure: f32,
    tone: &str,
) -> PyResult<Bound<'py, PyBytes>> {
    let image = image(&rgb)?;
    let mapping = ToneMapping { exposure_ev: exposure, curve: tone_of(tone)? };
    let bytes = py.detach(|| encode_png(&image, &mapping)).map_err(failed)?;
    Ok(PyBytes::new(py, &bytes))
}

/// Joins tiles, and writes the picture.
#[pyfunction]
fn merge(
    py: Python<'_>,
    tiles: Vec<PathBuf>,
    output: PathBuf,
    exposure: Option<f32>,
    tone: Option<&str>,
) -> PyResult<()> {
    let wishes = Wishes { exposure_ev: exposure, tone: tone.map(tone_of).transpose()? };
    py.detach(|| merge_files(&tiles, &output, &wishes, "halflight.merge")).map_err(of_job)?;
    Ok(())
}

/// How far a picture is from a reference: figures, and maps of FLIP, relative squared error and signed difference.
#[pyfunction]
fn compare<'py>(
    py: Python<'py>,
    picture: PyReadonlyArray3<'py, f32>,
    reference: PyReadonlyArray3<'py, f32>,
    exposure: f32,
) -> PyResult<(Bound<'py, PyDict>, Bound<'py, PyDict>)> {
    let (picture, reference) = (image(&picture)?, image(&reference)?);
    let measured = py.detach(|| {
        Ok((
            Difference::measure(&picture, &reference, exposure)?,
            flip(&picture, &reference, exposure)?,
            hdr_flip(&picture, &reference)?,
            relative_squared_error(&picture, &reference)?,
            signed_difference(&picture, &reference)?,
        ))
    });
    let (difference, flip, hdr, relative, signed) =
        measured.map_err(|error: halflight::image::metrics::MetricError| failed(error))?;
    let figures = PyDict::new(py);
    figures.set_item("relmse", difference.relative_mse)?;
    figures.set_item("mse", difference.mse)?;
    figures.set_item("psnr", difference.psnr_db)?;
    figures.set_item("flip", flip.mean)?;
    figures.set_item("hdr_flip", hdr.mean)?;
    figures.set_item("max_error", difference.max_error)?;
    figures.set_item("max_error_at", difference.max_error_at)?;
    figures.set_item("mean", difference.mean)?;
    figures.set_item("reference_mean", difference.reference_mean)?;
    figures.set_item("left_out", difference.non_finite.left_out)?;
    let maps = PyDict::new(py);
    let plane = |plane: Plane| table(py, [plane.height, plane.width], plane.values);
    maps.set_item("flip", plane(flip.map)?)?;
    maps.set_item("relative", plane(relative)?)?;
    maps.set_item("signed", plane(signed)?)?;
    Ok((figures, maps))
}
