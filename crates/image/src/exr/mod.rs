//! OpenEXR: any flat file in, one part of named channels out.
//!
//! The container is the `exr` crate's; what is read, where its samples go and what is refused is decided here.

mod read;
mod samples;
mod write;

use std::io::Write;
use std::path::Path;

use halflight_file::{LoadError, SaveError, read as read_file, write_whole};

use crate::source::Source;
use crate::{Picture, PicturePart};

/// How many bits a channel gets in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// Sixteen: three digits, up to 65504. Channels that would suffer (depth, position, variance, sample counts
    /// and material numbers) are written as floats all the same.
    Half,
    /// Thirty-two: the picture comes back bit for bit.
    Float,
}

const ASKED: &str = "EXR picture";

impl Picture {
    /// Reads an EXR file (or `.exr.xz`).
    ///
    /// - Scan lines or tiles; of a mip map the largest level; half, float or integer; any compression but HTJ2K.
    /// - Of several parts, the first one with colour gives the names as they are; parts of the same window add
    ///   their channels, with the part's name before the channel's.
    /// - The picture is the *display window*: what the data window leaves out is zero, what it has beyond is cut.
    /// - Values are not judged: infinite depth is a fact. [`load_rgb`](crate::load_rgb) does judge.
    ///
    /// # Errors
    /// Deep or chroma-subsampled data, or damage of any kind, before what the header claims is allocated.
    pub fn load_exr(path: &Path) -> Result<Picture, LoadError> {
        Picture::decode_exr(&read_file(path, ASKED)?, path)
    }

    /// [`Picture::load_exr`] from memory; `name` is for the error.
    ///
    /// # Errors
    /// As [`Picture::load_exr`].
    pub fn decode_exr(bytes: &[u8], name: &Path) -> Result<Picture, LoadError> {
        let source = Source { bytes, name, asked: ASKED };
        source.guarded(|| read::decode(&source))
    }

    /// Writes an EXR file: one part, ZIP-compressed scan lines, channels in alphabetical order as the format
    /// asks, the metadata as text attributes named `halflight.<key>`. The same picture gives the same bytes.
    ///
    /// Finite values beyond the range of half are written as ±65504 there, not as infinity.
    ///
    /// # Errors
    /// No pixels, no channels, two channels of one name, a name or a value that the format cannot hold, or
    /// trouble with the disk.
    pub fn save_exr(&self, path: &Path, precision: Precision) -> Result<(), SaveError> {
        let bytes = self.encode_exr(precision).map_err(|found| SaveError {
            asked: ASKED.into(),
            path: path.to_path_buf(),
            found,
            hint: None,
        })?;
        write_whole(path, ASKED, |writer| writer.write_all(&bytes))
    }

    /// [`Picture::save_exr`] into memory.
    ///
    /// # Errors
    /// As [`Picture::save_exr`], as text.
    pub fn encode_exr(&self, precision: Precision) -> Result<Vec<u8>, String> {
        write::to_bytes(self, precision, None)
    }
}

impl PicturePart {
    /// Reads the data window of an EXR file as a part of its display window; see [`Picture::load_exr`].
    ///
    /// # Errors
    /// As [`Picture::load_exr`]; and a data window that is not inside the display window.
    pub fn load_exr(path: &Path) -> Result<PicturePart, LoadError> {
        PicturePart::decode_exr(&read_file(path, ASKED)?, path)
    }

    /// [`PicturePart::load_exr`] from memory; `name` is for the error.
    ///
    /// # Errors
    /// As [`PicturePart::load_exr`].
    pub fn decode_exr(bytes: &[u8], name: &Path) -> Result<PicturePart, LoadError> {
        let source = Source { bytes, name, asked: ASKED };
        source.guarded(|| read::decode_part(&source))
    }

    /// Writes an EXR file whose data window is this part and whose display window is the larger picture, so that other
    /// programs show it in its place.
    ///
    /// # Errors
    /// As [`Picture::save_exr`].
    pub fn save_exr(&self, path: &Path, precision: Precision) -> Result<(), SaveError> {
        let bytes =
            write::to_bytes(&self.picture, precision, Some((self.origin, self.whole))).map_err(|found| {
                SaveError { asked: ASKED.into(), path: path.to_path_buf(), found, hint: None }
            })?;
        write_whole(path, ASKED, |writer| writer.write_all(&bytes))
    }
}
