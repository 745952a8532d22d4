//! PLY, the Stanford polygon format (Turk 1994).
//!
//! Read are `vertex` (x, y, z; nx, ny, nz; texture coordinates as s, t or u, v or texture_u, texture_v; red,
//! green, blue), `face` (polygons of any size, cut into triangles) and `tristrips`, in any order, of any type of
//! number, in text or in either order of bytes. Everything else is passed over.
//!
//! - v counts upwards in the files that common programs write, and is turned to count downwards.
//! - Colours of whole numbers are sRGB, those of fractions linear.
//! - Vertices that no triangle uses are kept, so that vertex numbers are the file's.
//!
//! The file is parsed in one pass from memory; what counts claim is checked against the bytes that are left
//! before anything is allocated. The kitchen, 1,443,509 triangles in 27.5 MB, is parsed in 0.10 s on one core, and
//! holds 60 MB at most with its file in memory (`cargo test -p halflight-shape --test large_meshes -- --nocapture`).

mod header;
mod read;
mod source;
mod write;

use std::path::Path;

use halflight_file::{LoadError, Place};

pub use write::write_ply;

use self::header::Encoding;
use self::source::{Ascii, Binary};
use super::{model_name, without_mark};
use crate::Model;

pub(super) const ASKED: &str = "PLY mesh";

/// Reads a PLY file from memory; `name` is for the model's name and messages.
///
/// # Errors
/// Anything that does not follow the format, indices out of range, and numbers that are not finite, with the
/// line (text) or the byte (binary).
pub fn decode_ply(bytes: &[u8], name: &Path) -> Result<Model, LoadError> {
    let bytes = without_mark(bytes);
    let header = header::parse(bytes, name)?;
    let outcome = match header.encoding {
        Encoding::Ascii => read::body(&header, &mut Ascii::new(bytes, header.body)),
        Encoding::LittleEndian => read::body(&header, &mut Binary::<false>::new(bytes, header.body)),
        Encoding::BigEndian => read::body(&header, &mut Binary::<true>::new(bytes, header.body)),
    };
    let (mut mesh, mut warnings) = outcome.map_err(|trouble| {
        let place = if header.encoding == Encoding::Ascii {
            Place::Line(1 + bytes[..trouble.offset].iter().filter(|b| **b == b'\n').count())
        } else {
            Place::Byte(trouble.offset as u64)
        };
        let error = LoadError::new(ASKED, name, trouble.found).at(place);
        match trouble.hint {
            Some(hint) => error.hint(hint),
            None => error,
        }
    })?;
    let flaws = mesh.repair().map_err(|e| LoadError::new(ASKED, name, e.to_string()))?;
    let title = model_name(name);
    warnings.extend(flaws.sentences(&title));
    Ok(Model { warnings, ..Model::from_mesh(title, mesh) })
}

#[cfg(test)]
mod tests;
