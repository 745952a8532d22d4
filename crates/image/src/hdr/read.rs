use halflight_file::{LoadError, Place};

use super::Rgbe;
use crate::RgbImage;
use crate::source::Source;

/// The most pixels one byte can stand for: an old-style run of 255 pixels takes four bytes, and chained runs,
/// which would do better, occur only in wide rows of one colour.
const PIXELS_PER_BYTE: u64 = 128;

/// Rows outside this range cannot use the newer run lengths.
const NEW_RLE_WIDTHS: std::ops::RangeInclusive<usize> = 8..=0x7fff;

/// CIE XYZ to linear Rec. 709, D65 (IEC 61966-2-1).
const XYZ_TO_RGB: [[f32; 3]; 3] = [
    [3.240_97, -1.537_383_2, -0.498_610_76],
    [-0.969_243_65, 1.875_967_5, 0.041_555_06],
    [0.055_630_08, -0.203_976_96, 1.056_971_5],
];

/// How the rows of the file lie in the picture.
struct Layout {
    rows: usize,
    columns: usize,
    /// The file's rows are the picture's columns.
    transposed: bool,
    flip_x: bool,
    flip_y: bool,
}

pub(crate) fn decode(source: &Source) -> Result<RgbImage, LoadError> {
    let mut reader = Reader { source, position: 0 };
    let xyz = reader.header()?;
    let layout = reader.layout()?;
    let Layout { rows, columns, transposed, flip_x, flip_y } = layout;
    source.check_size([columns as u64, rows as u64], 1, PIXELS_PER_BYTE)?;

    // Grows with what is decoded, not with what is claimed.
    let mut scanned: Vec<[f32; 3]> = Vec::new();
    let mut row = vec![Rgbe::default(); columns];
    for _ in 0..rows {
        reader.row(&mut row)?;
        scanned.extend(row.iter().map(|&pixel| to_rgb(pixel, xyz)));
    }
    let (width, height) = if transposed { (rows, columns) } else { (columns, rows) };
    Ok(RgbImage::from_fn(width, height, |x, y| {
        let x = if flip_x { width - 1 - x } else { x };
        let y = if flip_y { height - 1 - y } else { y };
        let (column, row) = if transposed { (y, x) } else { (x, y) };
        scanned[row * columns + column]
    }))
}

fn to_rgb([r, g, b, e]: Rgbe, xyz: bool) -> [f32; 3] {
    // In f64, where 2^(1−136) is an ordinary number and the product is rounded once.
    let scale = if e == 0 { 0.0 } else { (f64::from(e) - 136.0).exp2() };
    let color = [r, g, b].map(|m| (f64::from(m) * scale) as f32);
    if !xyz {
        return color;
    }
    // Divided by the white point's luminance, as Radiance does not.
    XYZ_TO_RGB.map(|row| row[0] * color[0] + row[1] * color[1] + row[2] * color[2])
}

struct Reader<'a> {
    source: &'a Source<'a>,
    position: usize,
}

impl Reader<'_> {
    fn error(&self, found: impl Into<String>) -> LoadError {
        self.source.error(found).at(Place::Byte(self.position as u64))
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], LoadError> {
        let bytes = self.source.bytes.get(self.position..).and_then(|rest| rest.first_chunk::<N>());
        let bytes =
            *bytes.ok_or_else(|| self.error("the file ends inside the pixels").hint("it is cut short"))?;
        self.position += N;
        Ok(bytes)
    }

    /// One line without its end.
    fn line(&mut self) -> Result<String, LoadError> {
        let rest = &self.source.bytes[self.position..];
        let Some(length) = rest.iter().position(|&b| b == b'\n') else {
            return Err(self.error("the file ends inside the header"));
        };
        self.position += length + 1;
        let line = String::from_utf8_lossy(&rest[..length]);
        Ok(line.trim_end_matches('\r').to_owned())
    }

    /// Whether the pixels are XYZ. Lines that are not known say nothing about pixels.
    fn header(&mut self) -> Result<bool, LoadError> {
        let mut xyz = false;
        loop {
            let line = self.line()?;
            if line.is_empty() {
                return Ok(xyz);
            }
            if let Some(format) = line.strip_prefix("FORMAT=") {
                xyz = match format.trim() {
                    "32-bit_rle_rgbe" => false,
                    "32-bit_rle_xyze" => true,
                    other => return Err(self.error(format!("unknown pixel format {other:?}"))),
                };
            }
        }
    }

    /// `-Y 512 +X 1024`: first the axis of rows, then that along a row; the sign is that of the axis, y up.
    fn layout(&mut self) -> Result<Layout, LoadError> {
        let line = self.line()?;
        let found =
            || self.error(format!("a resolution line was expected, like -Y 512 +X 1024; found {line:?}"));
        let [first, rows, second, columns] = line.split_whitespace().collect::<Vec<_>>()[..] else {
            return Err(found());
        };
        let (rows, columns) = (rows.parse::<u32>(), columns.parse::<u32>());
        let (Ok(rows), Ok(columns)) = (rows, columns) else { return Err(found()) };
        let (transposed, y, x) = match (first, second) {
            ("-Y" | "+Y", "-X" | "+X") => (false, first, second),
            ("-X" | "+X", "-Y" | "+Y") => (true, second, first),
            _ => return Err(found()),
        };
        let layout = Layout {
            rows: rows as usize,
            columns: columns as usize,
            transposed,
            flip_x: x == "-X",
            flip_y: y == "+Y",
        };
        Ok(layout)
    }

    fn row(&mut self, row: &mut [Rgbe]) -> Result<(), LoadError> {
        let first = self.take::<4>()?;
        let length = usize::from(first[2]) << 8 | usize::from(first[3]);
        if NEW_RLE_WIDTHS.contains(&row.len()) && first[..2] == [2, 2] && first[2] < 128 {
            if length != row.len() {
                return Err(self.error(format!("a row of {length} pixels in a picture {} wide", row.len())));
            }
            return self.new_row(row);
        }
        self.old_row(first, row)
    }

    /// Each channel in turn, as runs (count above 128) and literals.
    fn new_row(&mut self, row: &mut [Rgbe]) -> Result<(), LoadError> {
        for channel in 0..4 {
            let mut x = 0;
            while x < row.len() {
                let [code] = self.take()?;
                let run = code > 128;
                let count = usize::from(if run { code - 128 } else { code });
                if count == 0 || x + count > row.len() {
                    return Err(self.error(format!("a run of {count} at column {x} of {}", row.len())));
                }
                let pixels = &mut row[x..x + count];
                if run {
                    let [value] = self.take()?;
                    pixels.iter_mut().for_each(|pixel| pixel[channel] = value);
                } else {
                    for pixel in pixels {
                        [pixel[channel]] = self.take()?;
                    }
                }
                x += count;
            }
        }
        Ok(())
    }

    /// Whole pixels; (1, 1, 1, n) repeats the one before n times, and such codes in a row are digits of base 256.
    fn old_row(&mut self, first: Rgbe, row: &mut [Rgbe]) -> Result<(), LoadError> {
        let mut pixel = first;
        let (mut x, mut shift) = (0, 0);
        loop {
            if pixel[..3] == [1, 1, 1] {
                let count = usize::from(pixel[3]) << shift;
                if x == 0 || shift > 16 || x + count > row.len() {
                    return Err(self.error(format!("a run of {count} at column {x} of {}", row.len())));
                }
                let previous = row[x - 1];
                row[x..x + count].fill(previous);
                x += count;
                shift += 8;
            } else {
                row[x] = pixel;
                x += 1;
                shift = 0;
            }
            if x == row.len() {
                return Ok(());
            }
            pixel = self.take()?;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn read(header: &str, pixels: &[u8]) -> Result<RgbImage, LoadError> {
        let bytes = [header.as_bytes(), pixels].concat();
        decode(&Source { bytes: &bytes, name: Path::new("test.hdr"), asked: super::super::ASKED })
    }

    /// Two columns, three rows, red counting from one in file order.
    fn six(resolution: &str) -> Vec<f32> {
        let pixels: Vec<u8> = (2..8).flat_map(|i| [i, 0, 0, 136]).collect();
        let image = read(&format!("#?RADIANCE\nodd line\n\n{resolution}\n"), &pixels).expect("six pixels");
        image.pixels.iter().map(|p| p[0] - 1.0).collect()
    }

    #[test]
    fn each_of_the_eight_orientations_puts_the_first_pixel_in_its_corner() {
        assert_eq!(six("-Y 3 +X 2"), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        assert_eq!(six("-Y 3 -X 2"), [2.0, 1.0, 4.0, 3.0, 6.0, 5.0]);
        assert_eq!(six("+Y 3 +X 2"), [5.0, 6.0, 3.0, 4.0, 1.0, 2.0]);
        assert_eq!(six("+Y 3 -X 2"), [6.0, 5.0, 4.0, 3.0, 2.0, 1.0]);
        // Rows of the file are columns of the picture: three columns of two.
        assert_eq!(six("+X 3 -Y 2"), [1.0, 3.0, 5.0, 2.0, 4.0, 6.0]);
        assert_eq!(six("-X 3 -Y 2"), [5.0, 3.0, 1.0, 6.0, 4.0, 2.0]);
        assert_eq!(six("+X 3 +Y 2"), [2.0, 4.0, 6.0, 1.0, 3.0, 5.0]);
        assert_eq!(six("-X 3 +Y 2"), [6.0, 4.0, 2.0, 5.0, 3.0, 1.0]);
    }

    #[test]
    fn old_runs_repeat_the_pixel_before_and_chain_in_base_256() {
        let pixels = [[128, 0, 0, 129], [1, 1, 1, 3], [1, 1, 1, 1], [64, 0, 0, 129]].concat();
        let image = read("#?RADIANCE\n\n-Y 1 +X 261\n", &pixels).expect("old run lengths");
        assert!(image.pixels[..260].iter().all(|p| p[0] == 1.0));
        assert_eq!(image.pixels[260][0], 0.5);
    }

    #[test]
    fn xyze_white_is_white() {
        let white = [243, 255, 255, 128, 243, 255, 255, 128];
        let image = read("#?RADIANCE\r\nFORMAT=32-bit_rle_xyze\r\n\r\n-Y 1 +X 2\r\n", &white).expect("XYZE");
        assert!(image.pixels[0].iter().all(|v| (v - 1.0).abs() < 0.1), "{:?}", image.pixels[0]);
    }

    #[test]
    fn runs_past_the_row_are_refused_with_their_place() {
        let error = read("#?RADIANCE\n\n-Y 1 +X 8\n", &[2, 2, 0, 8, 137, 0]).expect_err("nine of eight");
        assert!(error.to_string().contains("byte 27") && error.to_string().contains("run of 9"), "{error}");
    }
}
