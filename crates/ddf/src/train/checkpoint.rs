//! Training, kept on disk: everything that the next step depends on.
//!
//! A line of JSON (version, options, mesh, step), then the parameters and both moments of each table and of the network
//! as little-endian f32.

use std::io::Write as _;
use std::path::Path;

use halflight_file::{LoadError, SaveError, read, write_whole};
use serde::{Deserialize, Serialize};

use super::{FastTrainer, TrainOptions};
use crate::unit::mesh_hash;

const VERSION: u32 = 1;
const ASKED: &str = "checkpoint of a training";

#[derive(Serialize, Deserialize)]
struct Header {
    version: u32,
    options: TrainOptions,
    mesh: String,
    /// The sum of the samples that are learned from, if any were given.
    #[serde(default)]
    samples: Option<u64>,
    step: u64,
}

impl FastTrainer {
    /// Writes a checkpoint, whole or not at all.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn save_checkpoint(&self, path: &Path) -> Result<(), SaveError> {
        let header = Header {
            version: VERSION,
            options: self.options.clone(),
            mesh: mesh_hash(&self.mesh),
            samples: self.recorded.as_ref().map(|recorded| recorded.sum),
            step: self.step,
        };
        write_whole(path, ASKED, |to| {
            writeln!(to, "{}", serde_json::to_string(&header)?)?;
            for values in self.state() {
                for value in values {
                    to.write_all(&value.to_le_bytes())?;
                }
            }
            Ok(())
        })
    }

    /// Goes on where a checkpoint ended: the same steps as if there had been no interruption.
    ///
    /// # Errors
    /// If the file cannot be read, is of another version, mesh or options, is cut off, or holds what is no number. The
    /// trainer is then as it was.
    pub fn resume(&mut self, path: &Path) -> Result<(), LoadError> {
        let bytes = read(path, ASKED)?;
        let again = "remove the checkpoint to begin anew";
        let error = |found: String| LoadError::new(ASKED, path, found).hint(again);
        let end = bytes.iter().position(|&b| b == b'\n').ok_or_else(|| error("no header line".into()))?;
        let header: Header =
            serde_json::from_slice(&bytes[..end]).map_err(|e| error(format!("a broken header: {e}")))?;
        if header.version != VERSION {
            return Err(error(format!(
                "version {}, this halflight writes version {VERSION}",
                header.version
            )));
        }
        if header.options != self.options {
            return Err(error("a training with other options".into()));
        }
        if header.mesh != mesh_hash(&self.mesh) {
            return Err(error("a training of another mesh".into()));
        }
        if header.samples != self.recorded.as_ref().map(|recorded| recorded.sum) {
            return Err(error("a training from other samples".into()));
        }
        let numbers = &bytes[end + 1..];
        let wanted: usize = self.state().map(|values| 4 * values.len()).sum();
        if numbers.len() != wanted {
            return Err(error(format!("{} bytes of numbers, where {wanted} are needed", numbers.len())));
        }
        let values: Vec<f32> = numbers.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
        if let Some(index) = values.iter().position(|v| !v.is_finite()) {
            return Err(error(format!("number {index} is {}", values[index])));
        }
        let mut rest = values.as_slice();
        for to in self.state_mut() {
            let (now, later) = rest.split_at(to.len());
            to.copy_from_slice(now);
            rest = later;
        }
        self.step = header.step;
        Ok(())
    }

    fn state(&self) -> impl Iterator<Item = &[f32]> {
        let parameters = self.parameters.tables.iter().chain([&self.parameters.network]);
        let moments = self.moments.iter().flat_map(|adam| [&adam.first, &adam.second]);
        parameters.chain(moments).map(Vec::as_slice)
    }

    fn state_mut(&mut self) -> impl Iterator<Item = &mut [f32]> {
        let parameters = self.parameters.tables.iter_mut().chain([&mut self.parameters.network]);
        let moments = self.moments.iter_mut().flat_map(|adam| [&mut adam.first, &mut adam.second]);
        parameters.chain(moments).map(Vec::as_mut_slice)
    }
}
