//! Numbers as colours: a layer of a picture as a person reads it.

use std::path::Path;

use halflight_file::SaveError;

use super::colors::viridis;
use crate::{Plane, tone};

/// Part of the values at each end that the colours leave out, unless their range is given.
const OUTLIERS: f32 = 0.005;

/// The colour of pixels that have no value: the background of a depth.
const NOTHING: [u8; 3] = [0x3c, 0x3c, 0x40];

/// A layer in the colours of viridis.
#[derive(Clone, Debug)]
pub struct FalseColor {
    /// Pixels along a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// sRGB, 3 bytes a pixel, rows from the top.
    pub bytes: Vec<u8>,
    /// The value that is darkest; what is less looks the same.
    pub low: f32,
    /// The value that is brightest; what is more looks the same.
    pub high: f32,
    /// Whether pixels without a finite value are among them; those are grey.
    pub has_gaps: bool,
}

impl FalseColor {
    /// From `range` or, without it, from the least to the greatest value without a few outliers.
    pub fn new(values: &[f32], [width, height]: [usize; 2], range: Option<[f32; 2]>) -> Self {
        let mut sorted: Vec<f32> = values.iter().copied().filter(|v| v.is_finite()).collect();
        let has_gaps = sorted.len() < values.len();
        let [low, high] = range.unwrap_or_else(|| {
            sorted.sort_by(f32::total_cmp);
            let last = sorted.len().saturating_sub(1) as f32;
            [OUTLIERS, 1.0 - OUTLIERS]
                .map(|part| sorted.get((part * last) as usize).copied().unwrap_or_default())
        });
        let table = viridis();
        // In f64: the ends may be as far apart as numbers are.
        let span = f64::from(high) - f64::from(low);
        let place = |v: f32| if span > 0.0 { 255.0 * (f64::from(v) - f64::from(low)) / span } else { 0.0 };
        let color =
            |v: &f32| if v.is_finite() { table[place(*v).clamp(0.0, 255.0) as usize] } else { NOTHING };
        Self { width, height, bytes: values.iter().flat_map(color).collect(), low, high, has_gaps }
    }

    /// Of a plane, see [`FalseColor::new`].
    pub fn of(plane: &Plane, range: Option<[f32; 2]>) -> Self {
        Self::new(&plane.values, [plane.width, plane.height], range)
    }

    /// Writes it as an 8-bit PNG.
    ///
    /// # Errors
    /// Trouble with the disk.
    pub fn save_png(&self, path: &Path) -> Result<(), SaveError> {
        tone::save_png_bytes(path, &self.bytes, [self.width, self.height])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_go_from_dark_to_light_and_gaps_are_grey() {
        let shown = FalseColor::new(&[0.0, 1.0, f32::NAN, 9.0], [4, 1], Some([0.0, 1.0]));
        assert_eq!(shown.bytes[0..3], viridis()[0]);
        assert_eq!(shown.bytes[3..6], viridis()[255]);
        assert_eq!(shown.bytes[6..9], NOTHING);
        assert_eq!(shown.bytes[9..12], viridis()[255]);
        assert!(shown.has_gaps);
    }

    #[test]
    fn a_few_outliers_do_not_make_the_rest_dark() {
        let mut values: Vec<f32> = (0..1000).map(|i| i as f32).collect();
        values[999] = 1e30;
        let shown = FalseColor::new(&values, [1000, 1], None);
        assert!(shown.low < 10.0 && shown.high < 1000.0 && shown.high > 980.0);
        // One value, no value, and values as far apart as numbers are.
        assert_eq!(FalseColor::new(&[2.0; 3], [3, 1], None).bytes[0..3], viridis()[0]);
        assert!(FalseColor::new(&[f32::INFINITY], [1, 1], None).has_gaps);
        let far = FalseColor::new(&[f32::MIN, 0.0, f32::MAX], [3, 1], Some([f32::MIN, f32::MAX]));
        assert_eq!(far.bytes[3..6], viridis()[127]);
    }
}
