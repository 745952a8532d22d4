//! Sizes of pictures, within reason.

use std::str::FromStr;

/// Columns and rows of a picture: `640x360`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

/// Longest side of a picture: what OpenEXR readers commonly take.
const MAX_SIDE: usize = 1 << 16;
/// Most pixels of a picture: its film of 40 bytes a pixel then takes 10 GB.
const MAX_PIXELS: usize = 1 << 28;

impl FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let shape = || format!("expected WIDTHxHEIGHT, for example 640x360, found {text:?}");
        let (width, height) = text.split_once(['x', 'X', '×']).ok_or_else(shape)?;
        let side = |text: &str| text.parse::<usize>().map_err(|_| shape());
        let (width, height) = (side(width)?, side(height)?);
        if width == 0 || height == 0 {
            return Err("a picture has at least one pixel each way".into());
        }
        if width > MAX_SIDE || height > MAX_SIDE || width * height > MAX_PIXELS {
            return Err(format!("a picture has at most {MAX_SIDE} pixels a side and {MAX_PIXELS} in all"));
        }
        Ok(Self { width, height })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_columns_by_rows_within_reason() {
        assert_eq!("640x360".parse(), Ok(Size { width: 640, height: 360 }));
        for text in ["", "640", "x", "0x5", "5x0", "-1x2", "99999x1", "65536x65536", "1x2x3", "1.5x2"] {
            assert!(text.parse::<Size>().is_err(), "{text}");
        }
    }
}
