//! Files, as every loader of halflight sees them.
//!
//! - [`read`] brings a whole file into memory, unpacking `.xz`, and never allocates by what a header claims.
//! - [`write_whole`] writes beside the target and renames, so that a file is whole or absent.
//! - [`LoadError`] and [`SaveError`] tell what was asked, what was found, where, and what to try.
//! - [`nearest_name`] finds the name that was probably meant.

mod error;
mod names;
mod read;
mod write;

pub use error::{LoadError, Place, SaveError};
pub use names::nearest_name;
pub use read::{MAX_FILE_BYTES, extension, read, unpack_xz};
pub use write::write_whole;
