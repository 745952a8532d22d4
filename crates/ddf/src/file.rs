//! The file of a field: [safetensors](https://github.com/huggingface/safetensors), with everything that is not a tensor
//! as JSON under the one metadata key `halflight-ddf`.
//!
//! | tensor | type | what |
//! |---|---|---|
//! | `cells` | U64 [R/4, R/4, R/4] | a bit for each cell of a block of 4³, x fastest |
//! | `features.N` | I16 [vertices, F] | features of grid N, times `scales[N]`, in the order of blocks and bits |
//! | `network` | F32 [n] | weights (inputs × outputs) and biases of each layer |
//!
//! A field of the seed's network has its JSON under `halflight-ddf-seed` and these tensors:
//!
//! | tensor | type | what |
//! |---|---|---|
//! | `layer.N` | F32 [n] | v (neuron by neuron), g and biases of layer N; the last has 32 neurons, of which the first counts |

use std::collections::HashMap;
use std::io::Write as _;
use std::path::Path;

use halflight_file::{LoadError, SaveError, read, write_whole};
use safetensors::SafeTensors;
use safetensors::tensor::{Dtype, TensorView, serialize};
use serde::{Deserialize, Serialize};

use crate::fast::field::FastField;
use crate::fast::shape::FastShape;
use crate::field::{DirectedField, Form, MeasuredError, Provenance};
use crate::grid::{Cells, Level};
use crate::seed::{SeedNetwork, SeedShape};
use crate::unit::UnitSpace;

/// The Chamfer distance × 10³ of a field that has no surface: twice the square of the sphere's diameter.
pub(crate) const MOST_CHAMFER_E3: f32 = 8000.0;

/// The version of field files that is written and read.
pub const FIELD_VERSION: u32 = 1;

const KEY: &str = "halflight-ddf";
const SEED_KEY: &str = "halflight-ddf-seed";
const ASKED: &str = "field of directed distances";

#[derive(Debug, Serialize, Deserialize)]
struct Header {
    version: u32,
    shape: FastShape,
    unit: UnitSpace,
    scales: Vec<f32>,
    /// Whether the sides of the surface were learned; older files know none.
    #[serde(default)]
    sides: bool,
    error: MeasuredError,
    provenance: Provenance,
}

#[derive(Debug, Serialize, Deserialize)]
struct SeedHeader {
    version: u32,
    shape: SeedShape,
    unit: UnitSpace,
    error: MeasuredError,
    provenance: Provenance,
}

/// Only the version, which a file of another version has too.
#[derive(Deserialize)]
struct Versioned {
    version: u32,
}

impl DirectedField {
    /// The bytes of the field's file.
    #[must_use]
    pub fn encode(&self) -> Vec<u8> {
        match &self.form {
            Form::Fast(fast) => self.encode_fast(fast),
            Form::Seed(network) => self.encode_seed(network),
        }
    }

    fn encode_seed(&self, network: &SeedNetwork) -> Vec<u8> {
        let header = SeedHeader {
            version: FIELD_VERSION,
            shape: network.shape(),
            unit: self.unit(),
            error: self.error,
            provenance: self.provenance.clone(),
        };
        let layers: Vec<Vec<u8>> =
            network.values().map(|values| values.iter().flat_map(|v| v.to_le_bytes()).collect()).collect();
        let tensors = layers.iter().enumerate().filter_map(|(number, bytes)| {
            let view = TensorView::new(Dtype::F32, vec![bytes.len() / 4], bytes).ok()?;
            Some((format!("layer.{number}"), view))
        });
        let text = serde_json::to_string(&header).unwrap_or_default();
        serialize(tensors, Some(HashMap::from([(SEED_KEY.to_string(), text)]))).unwrap_or_default()
    }

    fn encode_fast(&self, fast: &FastField) -> Vec<u8> {
        let header = Header {
            version: FIELD_VERSION,
            shape: fast.shape.clone(),
            unit: self.unit(),
            scales: fast.scales.clone(),
            sides: fast.sides,
            error: self.error,
            provenance: self.provenance.clone(),
        };
        let along = (fast.shape.resolution / 4) as usize;
        let cells: Vec<u8> = fast.cells.blocks().iter().flat_map(|word| word.to_le_bytes()).collect();
        let network: Vec<u8> = fast.network.iter().flat_map(|v| v.to_le_bytes()).collect();
        let tables: Vec<Vec<u8>> =
            fast.tables.iter().map(|table| table.iter().flat_map(|v| v.to_le_bytes()).collect()).collect();
        let mut tensors = vec![
            ("cells".to_string(), TensorView::new(Dtype::U64, vec![along; 3], &cells)),
            ("network".to_string(), TensorView::new(Dtype::F32, vec![fast.network.len()], &network)),
        ];
        for (number, table) in tables.iter().enumerate() {
            let shape = vec![fast.levels[number].count(), fast.shape.features];
            tensors.push((format!("features.{number}"), TensorView::new(Dtype::I16, shape, table)));
        }
        // Lengths follow from the field itself, and a header of plain numbers has a text.
        let tensors = tensors.into_iter().filter_map(|(name, view)| Some((name, view.ok()?)));
        let text = serde_json::to_string(&header).unwrap_or_default();
        serialize(tensors, Some(HashMap::from([(KEY.to_string(), text)]))).unwrap_or_default()
    }

    /// Writes the field's file, whole or not at all.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn save(&self, path: &Path) -> Result<(), SaveError> {
        let bytes = self.encode();
        write_whole(path, ASKED, |to| to.write_all(&bytes))
    }

    /// Reads a field's file.
    ///
    /// # Errors
    /// If it cannot be read, is no field, is of another version, is cut off, or its tensors disagree with its header;
    /// if a number in it is not finite.
    pub fn load(path: &Path) -> Result<DirectedField, LoadError> {
        Self::decode(&read(path, ASKED)?, path)
    }

    /// As [`DirectedField::load`], from bytes; `name` is for messages.
    ///
    /// # Errors
    /// As [`DirectedField::load`].
    pub fn decode(bytes: &[u8], name: &Path) -> Result<DirectedField, LoadError> {
        decode(bytes).map_err(|(found, hint)| LoadError::new(ASKED, name, found).hint(hint))
    }
}

/// What was found, and what to try.
type Story = (String, &'static str);

const AGAIN: &str = "train it again with `halflight ddf train`";
const CUT: &str = "the file may have been cut off in copying: copy it again, or train it again";

fn decode(bytes: &[u8]) -> Result<DirectedField, Story> {
    let (length, metadata) = SafeTensors::read_metadata(bytes)
        .map_err(|error| (format!("not a whole safetensors file: {error}"), CUT))?;
    let keys = metadata.metadata().as_ref();
    let text_of = |key: &str| keys.and_then(|map| map.get(key));
    let (text, is_seed) = match (text_of(KEY), text_of(SEED_KEY)) {
        (Some(text), _) => (text, false),
        (None, Some(text)) => (text, true),
        (None, None) => {
            return Err(("a safetensors file that holds no field of directed distances".into(), AGAIN));
        }
    };
    let Versioned { version } =
        serde_json::from_str(text).map_err(|error| (format!("a broken header: {error}"), AGAIN))?;
    if version != FIELD_VERSION {
        let found = format!("a field of version {version}; this halflight reads version {FIELD_VERSION}");
        return Err((found, AGAIN));
    }
    let tensors = || {
        SafeTensors::deserialize(bytes).map_err(|error| {
            (format!("not a whole safetensors file of {length} bytes of header: {error}"), CUT)
        })
    };
    if is_seed {
        return decode_seed(text, &tensors()?);
    }
    let header: Header =
        serde_json::from_str(text).map_err(|error| (format!("a broken header: {error}"), AGAIN))?;
    header.shape.check().map_err(|problem| (format!("a header whose {problem}"), AGAIN))?;
    check(&header.unit, &header.error)?;
    if header.scales.len() != header.shape.levels.len()
        || header.scales.iter().any(|v| !(v.is_finite() && *v > 0.0))
    {
        let found = format!("scales {:?} for {} grids", header.scales, header.shape.levels.len());
        return Err((found, AGAIN));
    }
    let tensors = tensors()?;
    let along = (header.shape.resolution / 4) as usize;
    let words = tensor(&tensors, "cells", Dtype::U64, &[along; 3])?;
    let words = words.as_chunks::<8>().0.iter().map(|bytes| u64::from_le_bytes(*bytes)).collect();
    let cells = Cells::from_blocks(header.shape.resolution, words)
        .ok_or_else(|| ("another number of cells than the header's resolution has".to_string(), AGAIN))?;
    let network = tensor(&tensors, "network", Dtype::F32, &[header.shape.network_len()])?;
    let network = numbers(network, "a network")?;
    let mut tables = Vec::new();
    for (number, &shift) in header.shape.levels.iter().enumerate() {
        let count = Level::new(&cells, shift).count();
        let name = format!("features.{number}");
        let table = tensor(&tensors, &name, Dtype::I16, &[count, header.shape.features])?;
        tables.push(table.as_chunks::<2>().0.iter().map(|bytes| i16::from_le_bytes(*bytes)).collect());
    }
    no_others(&tensors, 2 + tables.len())?;
    let mut fast = FastField::new(header.shape, cells, tables, header.scales, network);
    fast.sides = header.sides;
    let mut field = DirectedField::new(fast, header.unit);
    field.error = header.error;
    field.provenance = header.provenance;
    Ok(field)
}

fn decode_seed(text: &str, tensors: &SafeTensors<'_>) -> Result<DirectedField, Story> {
    let header: SeedHeader =
        serde_json::from_str(text).map_err(|error| (format!("a broken header: {error}"), AGAIN))?;
    header.shape.check().map_err(|problem| (format!("a header with {problem}"), AGAIN))?;
    check(&header.unit, &header.error)?;
    let mut values = Vec::new();
    for (number, length) in SeedNetwork::lengths(&header.shape).into_iter().enumerate() {
        let name = format!("layer.{number}");
        let layer = tensor(tensors, &name, Dtype::F32, &[length])?;
        values.push(numbers(layer, &format!("a layer {number}"))?);
    }
    no_others(tensors, values.len())?;
    let mut field = DirectedField::of_seed(SeedNetwork::from_values(&header.shape, values), header.unit);
    field.error = header.error;
    field.provenance = header.provenance;
    Ok(field)
}

/// Whether space and errors are such.
fn check(unit: &UnitSpace, e: &MeasuredError) -> Result<(), Story> {
    unit.check().map_err(|problem| (format!("bounds that cannot be: {problem}"), AGAIN))?;
    // Nothing in the unit sphere, and nothing that starts at its bounds, is farther off than this.
    let far = 4.0;
    let bounds = [
        ("depth_mean", e.depth_mean, far),
        ("depth_p95", e.depth_p95, far),
        ("across_p95", e.across_p95, far),
        ("visibility", e.visibility, 1.0),
        ("normal_mean_degrees", e.normal_mean_degrees, 180.0),
        ("chamfer_e3", e.chamfer_e3, MOST_CHAMFER_E3),
    ];
    match bounds.into_iter().find(|&(_, value, most)| !(0.0..=most).contains(&value)) {
        Some((name, value, most)) => {
            Err((format!("a measured error `{name}` of {value}, where 0 to {most} is possible"), AGAIN))
        }
        None => Ok(()),
    }
}

/// No tensors beside those that the header asks for.
fn no_others(tensors: &SafeTensors<'_>, wanted: usize) -> Result<(), Story> {
    if tensors.len() == wanted {
        return Ok(());
    }
    let mut names = tensors.names();
    names.sort_unstable();
    names.truncate(12);
    Err((
        format!("{} tensors ({}), where the header asks for {wanted}", tensors.len(), names.join(", ")),
        AGAIN,
    ))
}

/// Little-endian numbers, all finite.
fn numbers(bytes: &[u8], what: &str) -> Result<Vec<f32>, Story> {
    let values: Vec<f32> = bytes.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
    match values.iter().position(|v| !v.is_finite()) {
        Some(index) => Err((format!("{what} whose number {index} is {}", values[index]), AGAIN)),
        None => Ok(values),
    }
}

fn tensor<'a>(
    tensors: &SafeTensors<'a>,
    name: &str,
    kind: Dtype,
    shape: &[usize],
) -> Result<&'a [u8], Story> {
    let view = tensors.tensor(name).map_err(|_| (format!("no tensor `{name}`"), AGAIN))?;
    if view.dtype() != kind || view.shape() != shape {
        let found = format!(
            "tensor `{name}` is {:?} {:?}, where the header asks for {kind:?} {shape:?}",
            view.dtype(),
            view.shape()
        );
        return Err((found, AGAIN));
    }
    Ok(view.data())
}
