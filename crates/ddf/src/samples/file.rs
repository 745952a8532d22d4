//! Files of samples.
//!
//! A line of text, `halflight-ddf-samples 2 N MESH SUM`, then N records of seven little-endian f32: x, ω, φ. A miss has
//! φ = +∞. MESH is the hash of the mesh that the samples are of ([`crate::mesh_hash`]), SUM the FNV-1a of the records'
//! 32-bit words: both in 16 hexadecimal digits.

use std::io::Write as _;
use std::path::Path;

use glam::Vec3;
use halflight_file::{LoadError, SaveError, read, write_whole};

use super::FieldSample;

/// The version of sample files that is written and read.
pub const SAMPLES_VERSION: u32 = 2;

const NAME: &str = "halflight-ddf-samples";
const ASKED: &str = "samples of a field";
const AGAIN: &str = "write it again with `halflight ddf samples`";
const RECORD: usize = 7 * 4;
/// Longest first line.
const LONGEST: usize = 128;

impl FieldSample {
    fn words(&self) -> [u32; 7] {
        let (o, d) = (self.origin, self.direction);
        [o.x, o.y, o.z, d.x, d.y, d.z, self.distance].map(f32::to_bits)
    }

    /// FNV-1a of the words of samples.
    pub(crate) fn sum(samples: &[FieldSample]) -> u64 {
        samples
            .iter()
            .flat_map(FieldSample::words)
            .fold(0xcbf2_9ce4_8422_2325, |hash, word| (hash ^ u64::from(word)).wrapping_mul(0x0100_0000_01b3))
    }

    /// Writes samples of a mesh of this hash, whole or not at all.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn save(samples: &[FieldSample], mesh_hash: &str, path: &Path) -> Result<(), SaveError> {
        write_whole(path, ASKED, |to| {
            writeln!(
                to,
                "{NAME} {SAMPLES_VERSION} {} {mesh_hash} {:016x}",
                samples.len(),
                FieldSample::sum(samples)
            )?;
            for sample in samples {
                for word in sample.words() {
                    to.write_all(&word.to_le_bytes())?;
                }
            }
            Ok(())
        })
    }

    /// Reads samples of the mesh of this hash.
    ///
    /// # Errors
    /// If the file cannot be read, is none of samples, is cut off or altered, holds what is no sample, or is of another
    /// mesh.
    pub fn load(path: &Path, mesh_hash: &str) -> Result<Vec<FieldSample>, LoadError> {
        let bytes = read(path, ASKED)?;
        let error = |found: String| LoadError::new(ASKED, path, found).hint(AGAIN);
        let end = bytes
            .iter()
            .take(LONGEST)
            .position(|&b| b == b'\n')
            .ok_or_else(|| error("no header line".into()))?;
        let header = String::from_utf8_lossy(&bytes[..end]).into_owned();
        let words: Vec<&str> = header.split(' ').collect();
        if words[0] != NAME {
            return Err(error(format!("the first line `{}`", header.escape_debug())));
        }
        let version = words.get(1).copied().unwrap_or("none");
        if version != SAMPLES_VERSION.to_string() {
            return Err(error(format!("version {version}, this halflight reads {SAMPLES_VERSION}")));
        }
        let &[_, _, count, of_mesh, sum] = words.as_slice() else {
            return Err(error(format!("the first line `{}`", header.escape_debug())));
        };
        let count: usize = count.parse().map_err(|_| error(format!("{count} as the number of samples")))?;
        if of_mesh != mesh_hash {
            let found = format!("samples of another mesh ({of_mesh}, where this one is {mesh_hash})");
            return Err(LoadError::new(ASKED, path, found)
                .hint("name the mesh that the samples were drawn from, or draw samples of this one"));
        }
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
        let found = format!("{:016x}", FieldSample::sum(&samples));
        if found != sum {
            return Err(error(format!("numbers whose sum is {found}, where the first line says {sum}")));
        }
        Ok(samples)
    }
}
