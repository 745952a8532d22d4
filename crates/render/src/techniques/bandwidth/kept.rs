//! The tables of measured materials, kept from run to run in a file beside that of the material: `NAME.binary` has
//! `NAME.binary.linear.bandwidth.safetensors`, or `nearest` for that look-up.
//!
//! Eight bytes with the length of the header, the header as JSON, and arrays of little-endian numbers:
//!
//! | array | type | shape |
//! |---|---|---|
//! | `bandwidth` | U8 | what [`ReflectanceBandwidth::to_bytes`] gives |
//! | `samples` | F32 | [`HalfSamples::numbers`] |
//!
//! `__metadata__` tells the version, the key of what the tables depend on (every cell of the material, the look-up, the sizes of
//! tables), and a checksum of the arrays. From these the whole header follows, and one that differs by a byte is refused:
//! nothing is believed, and what is of another material, damaged or of another version is made anew. A file under that name
//! which does not begin as such a file does is not written over. Where a file cannot be written, tables are made each time.
//!
//! Cost: 5 MB a material; 20 ms to read and check where making takes a second.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use halflight_frequency::reflectance::{ReflectanceBandwidth, SIDE};
use halflight_material::{Lookup, Material, MaterialKind, MeasuredBrdf, SurfaceInput};
use rayon::prelude::*;

use super::lobes::{density, reflectance_bandwidth};
use super::parts::Split;
use super::samples::{ELEVATIONS, HalfSamples, MOST_SAMPLES};
use crate::content::{Hasher, Key};

/// Of the tables and of the file: one more with every change of how either is made.
const VERSION: u32 = 1;
const ASKED: &str = "tables of a measured material";
const BEGINNING: &str = "{\"__metadata__\":{\"format\":\"halflight bandwidth\"";

/// What is known of a measured material alone.
pub(super) struct Tables {
    pub(super) bandwidth: ReflectanceBandwidth,
    pub(super) samples: Arc<HalfSamples>,
}

/// Tables by the measurement that they are of.
#[derive(Default)]
pub(super) struct KeptTables(Vec<(Arc<MeasuredBrdf>, Tables)>);

impl KeptTables {
    /// Of all measurements that materials are made of, from files and into files if `in_files`; and what became of those.
    pub(super) fn new<'a>(
        materials: impl Iterator<Item = &'a Material>,
        in_files: bool,
    ) -> (Self, Vec<String>) {
        let mut measured: Vec<Arc<MeasuredBrdf>> = Vec::new();
        for material in materials.flat_map(Material::leaves) {
            if let MaterialKind::Measured(brdf) = &material.kind
                && !measured.iter().any(|known| Arc::ptr_eq(known, brdf))
            {
                measured.push(Arc::clone(brdf));
            }
        }
        let found: Vec<_> = measured.par_iter().map(|brdf| find_or_make(brdf, in_files)).collect();
        let (tables, notes): (Vec<_>, Vec<_>) = found.into_iter().unzip();
        (Self(measured.into_iter().zip(tables).collect()), notes.into_iter().flatten().collect())
    }

    /// The tables of a material that is a measurement.
    pub(super) fn of(&self, material: &Material) -> Option<&Tables> {
        let MaterialKind::Measured(brdf) = &material.kind else { return None };
        self.0.iter().find(|(known, _)| Arc::ptr_eq(known, brdf)).map(|(_, tables)| tables)
    }
}

fn find_or_make(brdf: &Arc<MeasuredBrdf>, in_files: bool) -> (Tables, Option<String>) {
    let Some(path) = brdf.file().filter(|_| in_files).map(|file| path_of(file, brdf.lookup())) else {
        return (make(brdf), None);
    };
    let key = key_of(brdf);
    let name = brdf.name();
    let anew = match load(&path, &key) {
        Ok(Some(tables)) => return (tables, Some(format!("tables of {name} are from {}", path.display()))),
        Ok(None) => String::new(),
        Err(reason) => format!(", anew as {reason}"),
    };
    let start = Instant::now();
    let tables = make(brdf);
    let seconds = start.elapsed().as_secs_f64();
    let kept = match save(&path, &key, &tables) {
        Ok(()) => format!("and are kept in {}", path.display()),
        Err(reason) => format!("and are not kept: {reason}"),
    };
    (tables, Some(format!("tables of {name} took {seconds:.1} s{anew}, {kept}")))
}

fn make(brdf: &Arc<MeasuredBrdf>) -> Tables {
    let material = Material::new(brdf.name(), MaterialKind::Measured(Arc::clone(brdf)));
    let bsdf = material.bsdf(&SurfaceInput::default());
    let bandwidth = reflectance_bandwidth(&material, &bsdf);
    let parts = Split::new(&material, &material).parts;
    let samples = Arc::new(HalfSamples::new(density(&bsdf), &parts, &bandwidth));
    Tables { bandwidth, samples }
}

/// Where the tables of a material's file are kept.
fn path_of(file: &Path, lookup: Lookup) -> PathBuf {
    let mut path = file.as_os_str().to_owned();
    path.push(match lookup {
        Lookup::Nearest => ".nearest",
        Lookup::Interpolated => ".linear",
    });
    path.push(".bandwidth.safetensors");
    path.into()
}

fn key_of(brdf: &MeasuredBrdf) -> Key {
    let mut hasher = Hasher::default();
    let lookup = match brdf.lookup() {
        Lookup::Nearest => 0,
        Lookup::Interpolated => 1,
    };
    [VERSION as usize, lookup, ELEVATIONS, MOST_SAMPLES, SIDE].iter().for_each(|&x| hasher.add(x as u64));
    hasher.floats(brdf.values().as_flattened());
    hasher.key()
}

/// The header of a file with these arrays, and its length in eight bytes before it.
fn header(key: &Key, bandwidth_bytes: usize, data: &[u8]) -> Vec<u8> {
    let mut hasher = Hasher::default();
    hasher.bytes(data);
    let (end, samples) = (data.len(), (data.len() - bandwidth_bytes) / 4);
    let text = format!(
        "{BEGINNING},\"version\":\"{VERSION}\",\"key\":\"{key}\",\"checksum\":\"{}\"}},\
         \"bandwidth\":{{\"dtype\":\"U8\",\"shape\":[{bandwidth_bytes}],\"data_offsets\":[0,{bandwidth_bytes}]}},\
         \"samples\":{{\"dtype\":\"F32\",\"shape\":[{samples}],\"data_offsets\":[{bandwidth_bytes},{end}]}}}}",
        hasher.key()
    );
    // The arrays start at a multiple of eight.
    let length = text.len().next_multiple_of(8);
    let mut bytes = (length as u64).to_le_bytes().to_vec();
    bytes.extend(text.as_bytes());
    bytes.resize(8 + length, b' ');
    bytes
}

/// Bytes of the bandwidth of an isotropic reflectance.
fn bandwidth_bytes() -> usize {
    ReflectanceBandwidth::constant(0.0).to_bytes().len()
}

/// The tables in a file: `None` if there is no file, and why not if they are not what is needed.
fn load(path: &Path, key: &Key) -> Result<Option<Tables>, String> {
    if !path.exists() {
        return Ok(None);
    }
    let bytes = halflight_file::read(path, ASKED).map_err(|error| error.to_string())?;
    let because = |why: &str| format!("{} {why}", path.display());
    let (first, samples) = (bandwidth_bytes(), 4 * HalfSamples::NUMBERS);
    let length = bytes.len().checked_sub(first + samples).ok_or_else(|| because("is damaged"))?;
    let (head, data) = bytes.split_at(length);
    if head != header(key, first, data) {
        let named = format!("\"version\":\"{VERSION}\",\"key\":\"{key}\"");
        let is_ours = head.windows(named.len()).any(|part| part == named.as_bytes());
        return Err(because(if is_ours { "is damaged" } else { "is damaged, or of another material" }));
    }
    let (bandwidth, samples) = data.split_at(first);
    let numbers: Vec<f32> =
        samples.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    let bandwidth = ReflectanceBandwidth::from_bytes(bandwidth).map_err(|_| because("is damaged"))?;
    let samples = HalfSamples::from_numbers(&numbers).ok_or_else(|| because("is damaged"))?;
    Ok(Some(Tables { bandwidth, samples: Arc::new(samples) }))
}

fn save(path: &Path, key: &Key, tables: &Tables) -> Result<(), String> {
    /// Two pictures of one process may write the same file.
    static WRITING: Mutex<()> = Mutex::new(());
    if !may_replace(path) {
        return Err(format!("{} is something else, and is not written over", path.display()));
    }
    let mut data = tables.bandwidth.to_bytes();
    let first = data.len();
    data.extend(tables.samples.numbers().iter().flat_map(|x| x.to_le_bytes()));
    let _alone = WRITING.lock().unwrap_or_else(PoisonError::into_inner);
    halflight_file::write_whole(path, ASKED, |file| {
        file.write_all(&header(key, first, &data))?;
        file.write_all(&data)
    })
    .map_err(|error| error.to_string())
}

/// Whether a file is not there, empty, or begins as tables do.
fn may_replace(path: &Path) -> bool {
    use std::io::Read;
    if !path.exists() {
        return true;
    }
    let mut begin = Vec::new();
    let length = (8 + BEGINNING.len()) as u64;
    let read = std::fs::File::open(path).and_then(|file| file.take(length).read_to_end(&mut begin));
    read.is_ok() && (begin.is_empty() || begin.get(8..) == Some(BEGINNING.as_bytes()))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use glam::Vec3;
    use halflight_material::write_merl;

    use super::*;

    fn loaded(path: &Path) -> Arc<MeasuredBrdf> {
        Arc::new(MeasuredBrdf::load(path, Lookup::Interpolated).expect("a measured material"))
    }

    fn tables_of(brdf: &Arc<MeasuredBrdf>, in_files: bool) -> (Vec<f32>, Vec<String>) {
        let material = Material::new("measured", MaterialKind::Measured(Arc::clone(brdf)));
        let (tables, notes) = KeptTables::new(std::iter::once(&material), in_files);
        let found = tables.of(&material).expect("tables");
        let mut numbers = found.samples.numbers();
        numbers.extend(found.bandwidth.values());
        (numbers, notes)
    }

    #[test]
    fn tables_are_read_again_for_the_same_material_and_made_anew_for_another_or_from_a_damaged_file() {
        let folder = tempfile::tempdir().unwrap();
        let paint = folder.path().join("paint.binary");
        let source = Material::phong(Vec3::splat(0.2), Vec3::splat(0.5), 40.0);
        write_merl(&source.bsdf(&SurfaceInput::default()), &paint).unwrap();
        let brdf = loaded(&paint);
        let kept = folder.path().join("paint.binary.linear.bandwidth.safetensors");
        // Not asked for: nothing is written.
        let (made, notes) = tables_of(&brdf, false);
        assert!(notes.is_empty() && !kept.exists());
        let (first, notes) = tables_of(&brdf, true);
        assert!(notes[0].contains("are kept in"), "{notes:?}");
        let (second, notes) = tables_of(&brdf, true);
        assert!(notes[0].contains("are from"), "{notes:?}");
        assert!(made == first && first == second);
        // The file is of the plain format.
        let whole = std::fs::read(&kept).unwrap();
        let length = u64::from_le_bytes(*whole.first_chunk().unwrap()) as usize;
        let header = std::str::from_utf8(&whole[8..8 + length]).unwrap().trim_end();
        assert!(
            header.starts_with(BEGINNING) && header.ends_with(&format!(",{}]}}}}", whole.len() - 8 - length))
        );
        // Any byte that differs, fewer bytes and more are noticed, and what is kept is whole again.
        let places =
            [8 + BEGINNING.len() + 14, 8 + length - 3, 8 + length + 20, whole.len() / 2, whole.len() - 1];
        let mut damaged: Vec<Vec<u8>> = places
            .iter()
            .map(|&at| {
                let mut bytes = whole.clone();
                bytes[at] ^= 0x40;
                bytes
            })
            .collect();
        damaged.extend([whole[..whole.len() / 2].to_vec(), [whole.as_slice(), b"more"].concat(), Vec::new()]);
        let key = key_of(&brdf);
        for bytes in &damaged {
            std::fs::write(&kept, bytes).unwrap();
            assert!(load(&kept, &key).is_err(), "{} bytes", bytes.len());
        }
        let (third, notes) = tables_of(&brdf, true);
        assert!(notes[0].contains("anew") && notes[0].contains("are kept in"), "{notes:?}");
        assert!(third == first && std::fs::read(&kept).unwrap() == whole);
        // Another material under the same name.
        let other = Material::phong(Vec3::splat(0.2), Vec3::splat(0.5), 60.0);
        write_merl(&other.bsdf(&SurfaceInput::default()), &paint).unwrap();
        let (fourth, notes) = tables_of(&loaded(&paint), true);
        assert!(notes[0].contains("another material"), "{notes:?}");
        assert!(fourth != first);
        // Something else under that name stays, and so does a folder.
        std::fs::write(&kept, "my notes on paints").unwrap();
        let (_, notes) = tables_of(&brdf, true);
        assert!(notes[0].contains("not written over"), "{notes:?}");
        assert_eq!(std::fs::read(&kept).unwrap(), b"my notes on paints");
        std::fs::remove_file(&kept).unwrap();
        std::fs::create_dir(&kept).unwrap();
        let (fifth, notes) = tables_of(&brdf, true);
        assert!(notes[0].contains("not kept"), "{notes:?}");
        assert!(fifth == first);
    }
}
