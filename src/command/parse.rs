//! From the words of the command line to values.

use std::str::FromStr;

pub(crate) use halflight::job::Size;

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
