//! The `.spheres` file: JSON, one sphere a line, readable by anything.
//!
//! ```json
//! {
//!   "format": "halflight spheres",
//!   "version": 1,
//!   "name": "bunny",
//!   "mesh": "91c58f0ab28d6d3e",
//!   "checksum": "2f1c0b8a77d1e940",
//!   "spheres": [
//!     { "center": [0.1, 0.2, 0.3], "radius": 0.05, "joints": [4, 7], "weights": [0.75, 0.25] }
//!   ]
//! }
//! ```
//!
//! `mesh` is [`super::RestSurface::hash`] of the surface the set was fitted to, in hexadecimal. Metres, in the frame of
//! the model at rest. `joints` are nodes of the model, at most four, with as many weights, which sum to 1; both are
//! absent from a sphere that only moves as a whole. `checksum` is that of the numbers, so that damage is found; who changes
//! spheres by hand leaves it out. Numbers are written so that they read back to the same bits.

use std::io::{self, Write};
use std::path::Path;

use glam::Vec3;
use halflight_file::{LoadError, Place, SaveError, read, write_whole};
use serde::Deserialize;

use super::{RestSurface, SphereInfluences, SphereSet};
use crate::MAX_COORDINATE;

/// The version that is written and read.
pub const SPHERES_VERSION: u64 = 1;
const FORMAT: &str = "halflight spheres";
const ASKED: &str = "sphere set";
const FIT_AGAIN: &str = "fit it again with `halflight spheres fit`";

/// What tells the version, whatever else the file holds.
#[derive(Deserialize)]
struct Head {
    format: String,
    version: u64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(rename = "format")]
    _format: String,
    #[serde(rename = "version")]
    _version: u64,
    name: String,
    mesh: String,
    checksum: Option<String>,
    spheres: Vec<Entry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    center: [f32; 3],
    radius: f32,
    joints: Option<Vec<u16>>,
    weights: Option<Vec<f32>>,
}

impl SphereSet {
    /// Writes the set; the file is whole or absent.
    ///
    /// # Errors
    /// Whatever the file system says.
    pub fn save(&self, path: &Path) -> Result<(), SaveError> {
        write_whole(path, ASKED, |writer| self.write_to(writer))
    }

    fn write_to(&self, writer: &mut impl Write) -> io::Result<()> {
        let name = serde_json::to_string(&self.name)?;
        writeln!(
            writer,
            "{{\n  \"format\": \"{FORMAT}\",\n  \"version\": {SPHERES_VERSION},\n  \"name\": {name},"
        )?;
        writeln!(writer, "  \"mesh\": \"{:016x}\",", self.mesh_hash)?;
        writeln!(writer, "  \"checksum\": \"{:016x}\",\n  \"spheres\": [", self.checksum())?;
        for (i, (center, radius)) in self.spheres().enumerate() {
            let [x, y, z] = center.to_array();
            write!(writer, "    {{ \"center\": [{x:?}, {y:?}, {z:?}], \"radius\": {radius:?}")?;
            if let Some(influences) = self.influences.get(i) {
                let used = || (0..4).filter(|&k| influences.weights[k] != 0.0);
                let joints: Vec<u16> = used().map(|k| influences.joints[k]).collect();
                let weights: Vec<f32> = used().map(|k| influences.weights[k]).collect();
                write!(writer, ", \"joints\": {joints:?}, \"weights\": {weights:?}")?;
            }
            writeln!(writer, " }}{}", if i + 1 < self.len() { "," } else { "" })?;
        }
        writeln!(writer, "  ]\n}}")
    }

    /// Reads a set.
    ///
    /// # Errors
    /// A missing or damaged file, another format or version, or numbers that make no spheres.
    pub fn load(path: &Path) -> Result<Self, LoadError> {
        Self::decode(&read(path, ASKED)?, path)
    }

    /// Reads a set from memory; `path` is for errors.
    ///
    /// # Errors
    /// As [`SphereSet::load`].
    pub fn decode(bytes: &[u8], path: &Path) -> Result<Self, LoadError> {
        let error = |found: String| LoadError::new(ASKED, path, found);
        let json_error = |e: serde_json::Error| {
            error(e.to_string().split(" at line ").next().unwrap_or_default().into())
                .at(Place::LineColumn(e.line(), e.column()))
                .hint(FIT_AGAIN)
        };
        let head: Head = serde_json::from_slice(bytes).map_err(json_error)?;
        if head.format != FORMAT {
            return Err(error(format!("the format is {:?}, not {FORMAT:?}", head.format)));
        }
        if head.version != SPHERES_VERSION {
            let found = format!("version {}; this halflight knows version {SPHERES_VERSION}", head.version);
            return Err(error(found).hint(FIT_AGAIN));
        }
        let file: File = serde_json::from_slice(bytes).map_err(json_error)?;
        let mesh_hash = u64::from_str_radix(&file.mesh, 16)
            .map_err(|_| error(format!("{:?} is no content hash of 16 hexadecimal digits", file.mesh)))?;
        let mut set = Self { name: file.name, mesh_hash, ..Self::default() };
        for (index, entry) in file.spheres.iter().enumerate() {
            let sphere_error = |found: String| error(format!("sphere {index}: {found}")).hint(FIT_AGAIN);
            set.push(entry).map_err(sphere_error)?;
        }
        if !set.influences.is_empty() && set.influences.len() != set.len() {
            return Err(error("some spheres have joints and some have none".into()).hint(FIT_AGAIN));
        }
        if file.checksum.is_some_and(|sum| sum != format!("{:016x}", set.checksum())) {
            return Err(error("its numbers are not those that were written".into()).hint(FIT_AGAIN));
        }
        if set.is_empty() {
            return Err(error("there is no sphere in it".into()).hint(FIT_AGAIN));
        }
        Ok(set)
    }

    /// FNV-1a of the bits of all numbers.
    fn checksum(&self) -> u64 {
        let spheres = self.spheres().flat_map(|(c, r)| [c.x, c.y, c.z, r]).map(f32::to_bits);
        let influences = self.influences.iter().flat_map(|i| {
            // Joints without weight are not written.
            (0..4)
                .filter(|&k| i.weights[k] != 0.0)
                .flat_map(|k| [u32::from(i.joints[k]), i.weights[k].to_bits()])
        });
        spheres
            .chain(influences)
            .flat_map(u32::to_le_bytes)
            .fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
    }

    fn push(&mut self, entry: &Entry) -> Result<(), String> {
        let center = Vec3::from_array(entry.center);
        let in_range = |x: f32| x.is_finite() && x.abs() <= MAX_COORDINATE;
        if !entry.center.into_iter().all(in_range) {
            return Err(format!("the center {center} is not finite, or too far out"));
        }
        if !(in_range(entry.radius) && entry.radius > 0.0) {
            return Err(format!("the radius {} is not a positive length", entry.radius));
        }
        self.centers.push(center);
        self.radii.push(entry.radius);
        let (joints, weights) = match (&entry.joints, &entry.weights) {
            (Some(joints), Some(weights)) => (joints, weights),
            (None, None) => return Ok(()),
            _ => return Err("joints and weights come together".into()),
        };
        let sum: f32 = weights.iter().sum();
        let sound = weights.iter().all(|w| (0.0..=1.001).contains(w)) && (sum - 1.0).abs() < 1e-3;
        if joints.len() != weights.len() || joints.len() > 4 || !(sound || weights.is_empty()) {
            return Err(format!(
                "joints {joints:?} with weights {weights:?}: up to 4 with weights of sum 1 expected"
            ));
        }
        let mut influences = SphereInfluences { joints: [0; 4], weights: [0.0; 4] };
        for (k, (joint, weight)) in joints.iter().zip(weights).enumerate() {
            (influences.joints[k], influences.weights[k]) = (*joint, *weight);
        }
        self.influences.push(influences);
        Ok(())
    }

    /// Whether the set was fitted to this surface.
    ///
    /// # Errors
    /// It was fitted to another one; `path` is the file it came from.
    pub fn must_fit(&self, surface: &RestSurface, path: &Path) -> Result<(), LoadError> {
        let hash = surface.hash();
        if self.mesh_hash == hash {
            return Ok(());
        }
        let found = format!(
            "it was fitted to another mesh ({}, content {:016x}) than {} (content {hash:016x})",
            self.name, self.mesh_hash, surface.name
        );
        Err(LoadError::new(ASKED, path, found).hint(FIT_AGAIN))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TriangleMesh;
    use crate::mesh::samples::octahedron;

    fn set() -> SphereSet {
        SphereSet {
            name: "a \"bunny\"\n".into(),
            mesh_hash: 0x0123_4567_89ab_cdef,
            centers: vec![Vec3::new(0.1, -2.0 / 3.0, 1e-7), Vec3::new(1e12, 0.0, -0.0)],
            radii: vec![1.0 / 3.0, f32::MIN_POSITIVE],
            influences: vec![
                SphereInfluences { joints: [4, 7, 0, 0], weights: [0.7, 0.3, 0.0, 0.0] },
                SphereInfluences { joints: [65535, 0, 0, 0], weights: [1.0, 0.0, 0.0, 0.0] },
            ],
        }
    }

    fn bytes(set: &SphereSet) -> Vec<u8> {
        let mut bytes = Vec::new();
        set.write_to(&mut bytes).expect("memory takes all");
        bytes
    }

    fn decode(bytes: &[u8]) -> Result<SphereSet, LoadError> {
        SphereSet::decode(bytes, Path::new("a.spheres"))
    }

    #[test]
    fn a_set_reads_back_to_the_same_bits() {
        for set in [set(), SphereSet { influences: Vec::new(), ..set() }] {
            assert_eq!(decode(&bytes(&set)).expect("it was just written"), set);
        }
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.spheres");
        set().save(&path).expect("it can be written");
        assert_eq!(SphereSet::load(&path).expect("it was just written"), set());
    }

    #[test]
    fn files_cut_short_or_with_a_changed_byte_never_panic() {
        let whole = bytes(&set());
        for length in 0..whole.len() - 2 {
            assert!(decode(&whole[..length]).is_err(), "{length} bytes were read");
        }
        for at in 0..whole.len() {
            for value in [0, b'9', b'e', b'-', b'"', 255] {
                let mut damaged = whole.clone();
                damaged[at] = value;
                if let Ok(set) = decode(&damaged) {
                    assert!(set.radii.iter().all(|r| r.is_finite() && *r > 0.0));
                    assert!(set.centers.iter().all(|c| c.is_finite()));
                }
            }
        }
    }

    #[test]
    fn what_is_wrong_with_a_file_is_said() {
        let text = String::from_utf8(bytes(&set())).expect("text");
        let said = |from: &str, to: &str| {
            assert!(text.contains(from), "{from}");
            decode(text.replace(from, to).as_bytes()).expect_err("it is damaged").to_string()
        };
        assert!(said("\"version\": 1", "\"version\": 2").contains("version 2"));
        assert!(said(FORMAT, "sphere tree").contains("\"sphere tree\""));
        assert!(said("0123456789abcdef", "xyz").contains("\"xyz\""));
        assert!(said("0.33333334", "-1").contains("sphere 0: the radius -1"));
        assert!(said("0.33333334", "5.0").contains("not those that were written"));
        assert!(said("0.33333334", "1e99").contains("a.spheres"));
        assert!(said("[0.7, 0.3]", "[0.7]").contains("joints"));
        assert!(said("[0.7, 0.3]", "[0.7, 0.7]").contains("sum 1"));
        assert!(said("\"radius\"", "\"radios\"").contains("line 8"));
        let none = bytes(&SphereSet::default());
        assert!(decode(&none).expect_err("it is empty").to_string().contains("no sphere"));
    }

    #[test]
    fn a_set_of_another_mesh_is_told_by_its_hash() {
        let surface = RestSurface { name: "octahedron".into(), mesh: octahedron(), influences: Vec::new() };
        let set = SphereSet { mesh_hash: surface.hash(), ..set() };
        assert!(set.must_fit(&surface, Path::new("a.spheres")).is_ok());
        let moved = TriangleMesh { positions: vec![Vec3::ONE; 6], ..octahedron() };
        let other = RestSurface { mesh: moved, ..surface };
        let error = set.must_fit(&other, Path::new("a.spheres")).expect_err("another mesh").to_string();
        assert!(error.contains("another mesh") && error.contains("spheres fit"), "{error}");
    }
}
