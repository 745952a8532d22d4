//! Files of samples.
//!
//! A line of text, `halflight-ddf-samples 1 N`, then N records of seven little-endian f32: x, ω, φ. A miss has φ = +∞.

use std::io::Write as _;
use std::path::Path;

use glam::Vec3;
use halflight_file::{LoadError, SaveError, read, write_whole};

use super::FieldSample;

/// The version of sample files that is written and read.
pub const SAMPLES_VERSION: u32 = 1;

const NAME: &str = "halflight-ddf-samples";
const ASKED: &str = "samples of a field";
const RECORD: usize = 7 * 4;

impl FieldSample {
    /// Writes samples, whole or not at all.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn save(samples: &[FieldSample], path: &Path) -> Result<(), SaveError> {
        write_whole(path, ASKED, |to| {
            writeln!(to, "{NAME} {SAMPLES_VERSION} {}", samples.len())?;
            for sample in samples {
                let (o, d) = (sample.origin, sample.direction);
                for value in [o.x, o.y, o.z, d.x, d.y, d.z, sample.distance] {
                    to.write_all(&value.to_le_bytes())?;
                }
            }
            Ok(())
        })
    }

    /// Reads samples.
    ///
    /// # Errors
    /// If the file cannot be read, is none of samples, is cut off, or holds what is no sample.
    pub fn load(path: &Path) -> Result<Vec<FieldSample>, LoadError> {
        let bytes = read(path, ASKED)?;
        let error = |found: String| {
            LoadError::new(ASKED, path, found).hint("write it again with `halflight ddf samples`")
        };
        let end =
            bytes.iter().take(64).position(|&b| b == b'\n').ok_or_else(|| error("no header line".into()))?;
        let header = String::from_utf8_lossy(&bytes[..end]).into_owned();
        let mut words = header.split(' ');
        let (name, version, count) = (words.next(), words.next(), words.next());
        if name != Some(NAME) {
            return Err(error(format!("the first line `{}`", header.escape_debug())));
        }
        if version != Some(&SAMPLES_VERSION.to_string()) {
            return Err(error(format!(
                "version {}, this halflight reads {SAMPLES_VERSION}",
                version.unwrap_or("none")
            )));
        }
        let count: usize =
            count.and_then(|word| word.parse().ok()).ok_or_else(|| error("no number of samples".into()))?;
        let (records, rest) = bytes[end + 1..].as_chunks::<RECORD>();
        if records.len() != count || !rest.is_empty() {
            return Err(error(format!("{} whole samples, where the first line says {count}", records.len())));
        }
        let mut samples = Vec::with_capacity(records.len());
        for (index, record) in records.iter().enumerate() {
            let mut v = [0.0f32; 7];
            for (to, bytes) in v.iter_mut().zip(record.as_chunks::<4>().0) {
                *to = f32::from_le_bytes(*bytes);
            }
            let sample = FieldSample {
                origin: Vec3::new(v[0], v[1], v[2]),
                direction: Vec3::new(v[3], v[4], v[5]),
                distance: v[6],
            };
            let length = sample.direction.length();
            if !(sample.origin.is_finite() && (0.99..1.01).contains(&length) && sample.distance >= 0.0) {
                return Err(error(format!("sample {index} is {sample:?}")));
            }
            samples.push(sample);
        }
        Ok(samples)
    }
}
