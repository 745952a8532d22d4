//! Tables as bytes, for caches: "HLRB", version, kind (1 isotropic, 0 not), side, all u32, then f32, little-endian.

use super::{ReflectanceBandwidth, SIDE};
use crate::bandwidth::UNLIMITED;

const MAGIC: [u8; 4] = *b"HLRB";
const VERSION: u32 = 1;
const HEADER: usize = 16;

/// Why bytes are not a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BytesError {
    /// They do not begin as a table does, or come from another version.
    #[error("these bytes are not a reflectance bandwidth table of version {VERSION}: make it anew")]
    Header,
    /// Their number does not fit the header.
    #[error(
        "a reflectance bandwidth table of {expected} bytes was cut to, or is followed by, {found}: make it anew"
    )]
    Length {
        /// Bytes that the header asks for.
        expected: usize,
        /// Bytes that there are.
        found: usize,
    },
    /// A value is negative, not finite or out of range.
    #[error("value {index} of a reflectance bandwidth table is no bandwidth: make it anew")]
    Value {
        /// Which one.
        index: usize,
    },
}

impl ReflectanceBandwidth {
    /// The table as bytes.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(HEADER + 4 * self.table.len());
        bytes.extend(MAGIC);
        for word in [VERSION, u32::from(self.isotropic), SIDE as u32] {
            bytes.extend(word.to_le_bytes());
        }
        for value in &self.table {
            bytes.extend(value.to_le_bytes());
        }
        bytes
    }

    /// A table from bytes.
    ///
    /// # Errors
    /// Anything but what [`Self::to_bytes`] writes.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, BytesError> {
        let word = |at: usize| {
            let four: Option<[u8; 4]> = bytes.get(at..at + 4).and_then(|b| b.try_into().ok());
            four.map(u32::from_le_bytes)
        };
        let kind = word(8);
        let right = bytes.starts_with(&MAGIC) && word(4) == Some(VERSION) && word(12) == Some(SIDE as u32);
        if !right || !matches!(kind, Some(0 | 1)) {
            return Err(BytesError::Header);
        }
        let isotropic = kind == Some(1);
        let count = SIDE * SIDE * if isotropic { SIDE } else { SIDE * SIDE };
        let expected = HEADER + 4 * count;
        if bytes.len() != expected {
            return Err(BytesError::Length { expected, found: bytes.len() });
        }
        let values = bytes[HEADER..].chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        let table: Vec<f32> = values.collect();
        match table.iter().position(|v| !(0.0..=UNLIMITED).contains(v)) {
            Some(index) => Err(BytesError::Value { index }),
            None => Ok(Self { isotropic, table }),
        }
    }
}
