//! From the words of the command line to values.

use std::str::FromStr;

/// Columns and rows of a picture: `640x360`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Size {
    pub(crate) width: usize,
    pub(crate) height: usize,
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

/// Most frames of a sequence: at 24 a second, more than eleven hours.
const MAX_FRAMES: i64 = 1_000_000;

/// First and last frame of a sequence, both rendered: `1..24`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct FrameRange {
    pub(crate) first: i32,
    pub(crate) last: i32,
}

impl FromStr for FrameRange {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let shape = || format!("expected FIRST..LAST (both are rendered), for example 1..24, found {text:?}");
        let (first, last) = text.split_once("..").ok_or_else(shape)?;
        let number = |text: &str| text.parse::<i32>().map_err(|_| shape());
        let (first, last) = (number(first)?, number(last.strip_prefix('=').unwrap_or(last))?);
        if last < first {
            return Err(format!("the last frame, {last}, comes before the first, {first}"));
        }
        if i64::from(last) - i64::from(first) >= MAX_FRAMES {
            return Err(format!("a sequence has at most {MAX_FRAMES} frames"));
        }
        Ok(Self { first, last })
    }
}

/// A finite number greater than zero.
pub(crate) fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if x.is_finite() && x > 0.0 => Ok(x),
        _ => Err(format!("expected a number greater than 0, found {text:?}")),
    }
}

/// A finite number.
pub(crate) fn finite(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if x.is_finite() => Ok(x),
        _ => Err(format!("expected a number, found {text:?}")),
    }
}

/// The most stops, either way, as in a scene's `image.exposure_ev`.
const MAX_STOPS: f64 = 60.0;

/// An exposure in stops.
pub(crate) fn stops(text: &str) -> Result<f64, String> {
    match finite(text)? {
        ev if ev.abs() <= MAX_STOPS => Ok(ev),
        _ => Err(format!("expected -{MAX_STOPS} to {MAX_STOPS} stops, found {text}")),
    }
}

/// `key=value`, the value as it was written.
pub(crate) fn assignment(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((key, value)) if !key.trim().is_empty() => Ok((key.trim().into(), value.trim().into())),
        _ => Err(format!("expected KEY=VALUE, found {text:?}")),
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

    #[test]
    fn a_range_of_frames_has_both_its_ends() {
        assert_eq!("1..24".parse(), Ok(FrameRange { first: 1, last: 24 }));
        assert_eq!("3..=3".parse(), Ok(FrameRange { first: 3, last: 3 }));
        assert_eq!("-2..1".parse(), Ok(FrameRange { first: -2, last: 1 }));
        for text in ["", "5", "5..", "..5", "7..3", "a..b", "-1..-2", "0..2000000"] {
            assert!(text.parse::<FrameRange>().is_err(), "{text}");
        }
    }

    #[test]
    fn numbers_are_finite() {
        assert_eq!(positive("0.5"), Ok(0.5));
        assert!(["0", "-1", "nan", "inf", "x"].iter().all(|t| positive(t).is_err()));
        assert!(["nan", "inf", ""].iter().all(|t| finite(t).is_err()));
        assert_eq!(stops("-60"), Ok(-60.0));
        assert!(["1e9", "-61", "nan"].iter().all(|t| stops(t).is_err()));
        assert_eq!(assignment("a.b = 3=4"), Ok(("a.b".into(), "3=4".into())));
        assert!(assignment("=3").is_err() && assignment("a").is_err());
    }
}
