//! Names and times of the frames to render.

use std::path::{Path, PathBuf};

use super::parse::FrameRange;

/// One picture to make.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Shot {
    /// The frame's number; may lie between two frames.
    pub(crate) frame: f64,
    /// Its time in seconds: frame / frames per second.
    pub(crate) time: f64,
    /// Where the picture goes.
    pub(crate) output: PathBuf,
}

/// Digits of a frame number where the name says nothing else.
const DIGITS: usize = 4;

/// A single frame. `####` becomes its number as in a sequence; frame 1.5 of `out.####.exr` is `out.0001.5.exr`.
pub(crate) fn still(frame: f64, fps: f64, output: &Path) -> Vec<Shot> {
    let is_pattern = output.file_name().is_some_and(|name| name.to_string_lossy().contains('#'));
    let output = if is_pattern { numbered(output, frame) } else { output.to_path_buf() };
    vec![Shot { frame, time: frame / fps, output }]
}

/// A sequence; frame 7 of `out.####.exr` is `out.0007.exr`. A name without `#` gets `.####` before its extension.
pub(crate) fn sequence(range: FrameRange, fps: f64, output: &Path) -> Vec<Shot> {
    (range.first..=range.last)
        .map(|frame| {
            let number = f64::from(frame);
            Shot { frame: number, time: number / fps, output: numbered(output, number) }
        })
        .collect()
}

/// The name of a frame's picture; where there is no `#`, `.####` is put before the extension.
pub(crate) fn numbered(output: &Path, frame: f64) -> PathBuf {
    let name = output.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let name = if name.contains('#') { name } else { with_pattern(&name) };
    let start = name.rfind('#').map_or(0, |end| name[..=end].trim_end_matches('#').len());
    let hashes = name[start..].chars().take_while(|&c| c == '#').count();
    let (sign, size) = (if frame < 0.0 { "-" } else { "" }, frame.abs().to_string());
    let (whole, fraction) = size.split_at(size.find('.').unwrap_or(size.len()));
    let number = format!("{sign}{whole:0>hashes$}{fraction}");
    output.with_file_name(format!("{}{number}{}", &name[..start], &name[start + hashes..]))
}

fn with_pattern(name: &str) -> String {
    let hashes = "#".repeat(DIGITS);
    match name.rsplit_once('.') {
        Some((stem, extension)) if !stem.is_empty() => format!("{stem}.{hashes}.{extension}"),
        _ => format!("{name}.{hashes}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_run_of_hashes_becomes_the_number() {
        let name =
            |pattern: &str, frame: i32| numbered(Path::new(pattern), f64::from(frame)).display().to_string();
        assert_eq!(name("a/out.####.exr", 7), "a/out.0007.exr");
        assert_eq!(name("out.####.exr", 12345), "out.12345.exr");
        assert_eq!(name("#_out_##.png", 7), "#_out_07.png");
        assert_eq!(name("a/out.exr", 7), "a/out.0007.exr");
        assert_eq!(name("é#.png", 3), "é3.png");
        assert_eq!(name("out", 7), "out.0007");
        assert_eq!(name("out.##.exr", -2), "out.-02.exr");
        assert_eq!(still(1.5, 24.0, Path::new("y.####.png"))[0].output, Path::new("y.0001.5.png"));
        assert_eq!(still(1.5, 24.0, Path::new("y.png"))[0].output, Path::new("y.png"));
    }

    #[test]
    fn times_follow_from_the_frames_per_second() {
        let shots = sequence(FrameRange { first: 12, last: 13 }, 24.0, Path::new("o.png"));
        assert_eq!(shots.iter().map(|s| s.time).collect::<Vec<_>>(), [0.5, 13.0 / 24.0]);
        assert_eq!(still(1.5, 10.0, Path::new("o.png"))[0].time, 0.15);
    }
}
