//! Transfer in a file, of the plain format safetensors: eight bytes with the length of the header, the header as JSON, and
//! arrays of little-endian numbers.
//!
//! | array | type | shape |
//! |---|---|---|
//! | `nodes` | U32 | nodes × 4: three corners, then four times the first child plus the kind of split |
//! | `normals` | F32 | vertices × 3 |
//! | `visible` | F32 | vertices |
//! | `diffuse` | F32 | vertices × channels × n |
//! | `matrix_of` | U32 | vertices: the number of the matrix, 2³² − 1 for none |
//! | `glossy` | F32 | matrices × channels × n × n, light first |
//!
//! `__metadata__` tells the version, the key of what transfer depends on, a checksum of the arrays, and the sizes, from
//! which the whole header follows: one that differs by a byte is refused. Nothing is believed: a file that is not for
//! this scene and these settings, that is damaged or of another version, is made anew.

use std::io::Write;
use std::path::Path;

use glam::Vec3;
use halflight_file::SaveError;
use halflight_scene::Frame;

use super::key::{self, VERSION};
use super::receivers::Receivers;
use super::settings::PrtSettings;
use super::transfer::{NO_MATRIX, Transfer};
use super::tree::{Node, Tree};
use crate::content::{Hasher, Key};

const ASKED: &str = "transfer cache";
/// A header takes less than a thousandth of this.
const MAX_HEADER: u64 = 1 << 20;

/// What the header says.
#[derive(Clone, Debug, PartialEq)]
struct Header {
    version: u32,
    key: String,
    albedos: u64,
    checksum: String,
    n: usize,
    channels: usize,
    roots: usize,
    nodes: usize,
    vertices: usize,
    matrices: usize,
    error: [f32; 2],
    is_cut_short: bool,
    rays: u64,
}

/// An array of the file: its name, its type and its shape.
type Array = (&'static str, &'static str, Vec<usize>);

impl Header {
    fn arrays(&self) -> [Array; 6] {
        let &Self { n, channels, nodes, vertices, matrices, .. } = self;
        [
            ("nodes", "U32", vec![nodes, 4]),
            ("normals", "F32", vec![vertices, 3]),
            ("visible", "F32", vec![vertices]),
            ("diffuse", "F32", vec![vertices, channels, n]),
            ("matrix_of", "U32", vec![vertices]),
            ("glossy", "F32", vec![matrices, channels, n, n]),
        ]
    }

    /// The bytes of all arrays; `None` if there are too many for any file.
    fn data_bytes(&self) -> Option<usize> {
        self.arrays().iter().try_fold(0usize, |sum, (_, _, shape)| {
            let bytes = shape.iter().try_fold(4usize, |product, &size| product.checked_mul(size))?;
            sum.checked_add(bytes)
        })
    }

    fn text(&self) -> String {
        let Self {
            version, key, albedos, checksum, n, channels, roots, nodes, vertices, matrices, rays, ..
        } = self;
        let [mean, high] = self.error;
        let mut text = format!(
            "{{\"__metadata__\":{{\"format\":\"halflight prt\",\"version\":\"{version}\",\"key\":\"{key}\",\
             \"albedos\":\"{albedos}\",\"checksum\":\"{checksum}\",\"n\":\"{n}\",\"channels\":\"{channels}\",\
             \"roots\":\"{roots}\",\"nodes\":\"{nodes}\",\"vertices\":\"{vertices}\",\"matrices\":\"{matrices}\",\
             \"error_mean\":\"{mean}\",\"error_95\":\"{high}\",\"cut_short\":\"{}\",\"rays\":\"{rays}\"}}",
            self.is_cut_short
        );
        let mut start = 0;
        for (name, kind, shape) in self.arrays() {
            let end = start + 4 * shape.iter().product::<usize>();
            text += &format!(
                ",\"{name}\":{{\"dtype\":\"{kind}\",\"shape\":{shape:?},\"data_offsets\":[{start},{end}]}}"
            );
            start = end;
        }
        text.push('}');
        // The arrays start at a multiple of eight.
        let padding = text.len().next_multiple_of(8) - text.len();
        text + &" ".repeat(padding)
    }

    /// The header that a text is of, if it is one to the last byte.
    fn parse(text: &str) -> Option<Self> {
        fn read<T: std::str::FromStr>(text: &str, name: &str) -> Option<T> {
            let start = text.find(&format!("\"{name}\":\""))? + name.len() + 4;
            let length = text[start..].find('"')?;
            text[start..start + length].parse().ok()
        }
        let header = Self {
            version: read(text, "version")?,
            key: read(text, "key")?,
            albedos: read(text, "albedos")?,
            checksum: read(text, "checksum")?,
            n: read(text, "n")?,
            channels: read(text, "channels")?,
            roots: read(text, "roots")?,
            nodes: read(text, "nodes")?,
            vertices: read(text, "vertices")?,
            matrices: read(text, "matrices")?,
            error: [read(text, "error_mean")?, read(text, "error_95")?],
            is_cut_short: read(text, "cut_short")?,
            rays: read(text, "rays")?,
        };
        // Before the text is written again: it multiplies the sizes.
        header.data_bytes()?;
        (header.text() == text).then_some(header)
    }
}

/// Writes transfer to a file.
pub(super) fn save(path: &Path, key: &Key, albedos: u64, transfer: &Transfer) -> Result<(), SaveError> {
    let data = data_of(transfer);
    let header = Header {
        version: VERSION,
        key: key.to_string(),
        albedos,
        checksum: checksum(&data),
        n: transfer.n,
        channels: transfer.channels,
        roots: transfer.roots,
        nodes: transfer.tree.nodes.len(),
        vertices: transfer.normals.len(),
        matrices: transfer.glossy.len() / (transfer.channels * transfer.n * transfer.n).max(1),
        error: transfer.error,
        is_cut_short: transfer.is_cut_short,
        rays: transfer.rays,
    };
    let text = header.text();
    halflight_file::write_whole(path, ASKED, |file| {
        file.write_all(&(text.len() as u64).to_le_bytes())?;
        file.write_all(text.as_bytes())?;
        file.write_all(&data)
    })
}

/// How the name of a cache ends. What stands under such a name and is no cache is taken for a damaged one, and made anew; no
/// other file is ever written over, so that a scene or a mesh whose name was given by mistake is safe.
pub(super) const ENDING: &str = "safetensors";

/// Reads transfer from a file: `None` if there is no file, and why not if it is not what is needed.
pub(super) fn load(
    path: &Path,
    key: &Key,
    frame: &Frame,
    receivers: &Receivers,
    settings: &PrtSettings,
) -> Result<Option<Transfer>, String> {
    if !path.exists() {
        return Ok(None);
    }
    let bytes = halflight_file::read(path, ASKED).map_err(|error| error.to_string())?;
    let because = |why: &str| format!("{} {why}", path.display());
    let (header, data) = split(&bytes).ok_or_else(|| because("is damaged, or no transfer cache"))?;
    if header.version != VERSION {
        return Err(because(&format!("is of version {}, not {VERSION}", header.version)));
    }
    if header.key != key.to_string() {
        return Err(because("is of another scene or other settings"));
    }
    let channels = if settings.bounces() > 0 { 3 } else { 1 };
    let fits = header.n == (settings.order * settings.order) as usize
        && header.channels == channels
        && header.roots == receivers.roots()
        && header.checksum == checksum(data);
    let transfer = fits.then(|| transfer_of(&header, data)).flatten().ok_or_else(|| because("is damaged"))?;
    if header.albedos != key::albedos(&transfer, frame, receivers, settings) {
        return Err(because("is of other materials"));
    }
    Ok(Some(transfer))
}

/// Header and arrays, if the file has a header and exactly the bytes that it tells of.
fn split(bytes: &[u8]) -> Option<(Header, &[u8])> {
    let (length, rest) = bytes.split_first_chunk::<8>()?;
    let length = u64::from_le_bytes(*length);
    if length > MAX_HEADER {
        return None;
    }
    let (text, data) = rest.split_at_checked(length as usize)?;
    let header = Header::parse(std::str::from_utf8(text).ok()?)?;
    (header.data_bytes()? == data.len()).then_some((header, data))
}

fn checksum(data: &[u8]) -> String {
    let mut hasher = Hasher::default();
    hasher.bytes(data);
    hasher.key().to_string()
}

fn data_of(transfer: &Transfer) -> Vec<u8> {
    let mut data = Vec::new();
    for node in &transfer.tree.nodes {
        let [a, b, c] = node.corners;
        [a, b, c, node.split].iter().for_each(|x| data.extend(x.to_le_bytes()));
    }
    let mut floats =
        |values: &mut dyn Iterator<Item = f32>| values.for_each(|x| data.extend(x.to_le_bytes()));
    floats(&mut transfer.normals.iter().flat_map(|n| n.to_array()));
    floats(&mut transfer.visible.iter().copied());
    floats(&mut transfer.diffuse.iter().copied());
    transfer.matrix_of.iter().for_each(|x| data.extend(x.to_le_bytes()));
    transfer.glossy.iter().for_each(|x| data.extend(x.to_le_bytes()));
    data
}

/// The transfer that the arrays hold, if every number in them is one that can be.
fn transfer_of(header: &Header, data: &[u8]) -> Option<Transfer> {
    let mut rest = data;
    let mut next = |words: usize| -> Option<Vec<u32>> {
        let (bytes, after) = rest.split_at_checked(4 * words)?;
        rest = after;
        Some(bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect())
    };
    let finite = |words: Vec<u32>| -> Option<Vec<f32>> {
        let floats: Vec<f32> = words.into_iter().map(f32::from_bits).collect();
        floats.iter().all(|x| x.is_finite()).then_some(floats)
    };
    let &Header { n, channels, roots, nodes, vertices, matrices, .. } = header;
    let nodes = next(4 * nodes)?;
    let nodes = nodes.chunks_exact(4).map(|w| Node { corners: [w[0], w[1], w[2]], split: w[3] }).collect();
    let tree = Tree { nodes };
    let normals = finite(next(3 * vertices)?)?;
    let normals = normals.chunks_exact(3).map(Vec3::from_slice).collect();
    let visible = finite(next(vertices)?)?;
    let diffuse = finite(next(vertices * channels * n)?)?;
    let matrix_of = next(vertices)?;
    let glossy = finite(next(matrices * channels * n * n)?)?;
    let numbered = matrix_of.iter().all(|&m| m == NO_MATRIX || (m as usize) < matrices);
    (numbered && tree.is_sound(roots, vertices)).then_some(Transfer {
        n,
        channels,
        roots,
        tree,
        normals,
        visible,
        diffuse,
        matrix_of,
        glossy,
        error: header.error,
        is_cut_short: header.is_cut_short,
        rays: header.rays,
    })
}
