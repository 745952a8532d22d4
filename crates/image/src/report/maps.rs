//! The error maps of the page: which values get which colours, and what the legends say.

use rayon::prelude::*;
use serde_json::{Value, json};

use super::colors::{NO_VALUE, Table, diverging, magma, viridis};
use super::text::plain;
use crate::metrics::finite_in_both;
use crate::{Plane, RgbImage};

/// How the values of a map become colours.
pub(super) struct MapStyle {
    name: &'static str,
    note: String,
    /// Whether `low` and `high` are decimal logarithms of the values.
    log: bool,
    /// Whether colours follow the square root of a value's size, on both sides of zero.
    root: bool,
    low: f32,
    high: f32,
    table: Table,
    /// Where along the legend, from 0 to 1, and what to write there.
    ticks: Vec<(f32, String)>,
}

/// The decades that relative squared errors are shown in: the same on every page, so that pages can be compared.
const DECADES: (i32, i32) = (-6, 0);

impl MapStyle {
    /// FLIP, over all of its range.
    pub(super) fn flip() -> Self {
        Self {
            name: "FLIP",
            note: "How much a person notices when the two are shown in turn: 0 nothing, 1 the most.".into(),
            log: false,
            root: false,
            low: 0.0,
            high: 1.0,
            table: magma(),
            ticks: (0..=5).map(|i| (i as f32 / 5.0, plain(f64::from(i) / 5.0))).collect(),
        }
    }

    /// Relative squared error, by its logarithm.
    pub(super) fn relative() -> Self {
        let (low, high) = DECADES;
        let ticks = (low..=high)
            .map(|power| {
                let label = match power {
                    _ if power == low => format!("≤ 1e{power}"),
                    _ if power == high => format!("≥ {}", plain(10_f64.powi(power))),
                    _ => format!("1e{power}"),
                };
                ((power - low) as f32 / (high - low) as f32, label)
            })
            .collect();
        Self {
            name: "relative squared error",
            note: "(x − r)² ⁄ (r² + 0.01), mean of the channels, logarithmic.".into(),
            log: true,
            root: false,
            low: low as f32,
            high: high as f32,
            table: viridis(),
            ticks,
        }
    }

    /// Signed difference, as far as `reach` to both sides; by its root, so that a reach that the worst candidate
    /// needs still shows the bias of the best.
    pub(super) fn signed(reach: f32) -> Self {
        let tick = |i: i32| {
            let sign = ["−", "", "+"][(i.signum() + 1) as usize];
            (0.5 + i as f32 / 4.0, format!("{sign}{}", plain(f64::from(reach) * f64::from(i * i) / 4.0)))
        };
        Self {
            name: "signed difference",
            note: "(x − r) ⁄ √(r² + 0.01), mean of the channels, square-root scale: blue is too dark, orange too bright.".into(),
            log: false,
            root: true,
            low: -reach,
            high: reach,
            table: diverging(),
            ticks: (-2..=2).map(tick).collect(),
        }
    }

    /// The map as sRGB bytes; pixels that are not finite in both pictures stand out in a colour of their own.
    pub(super) fn paint(&self, map: &Plane, image: &RgbImage, reference: &RgbImage) -> Vec<u8> {
        let colors: Vec<[u8; 3]> = map
            .values
            .par_iter()
            .zip(image.pixels.par_iter().zip(&reference.pixels))
            .map(|(&value, (x, r))| if finite_in_both(x, r) { self.color(value) } else { NO_VALUE })
            .collect();
        colors.into_flattened()
    }

    fn color(&self, value: f32) -> [u8; 3] {
        let value = if self.log { value.max(1e-30).log10() } else { value };
        let value =
            if self.root { self.high * (value.abs() / self.high).sqrt().copysign(value) } else { value };
        let at = ((value - self.low) / (self.high - self.low)).clamp(0.0, 1.0);
        self.table[(at * 255.0).round() as usize]
    }

    /// What the page's script needs for the legend and for reading values back.
    pub(super) fn describe(&self) -> Value {
        let colors: Vec<String> =
            self.table.iter().map(|[r, g, b]| format!("{r:02x}{g:02x}{b:02x}")).collect();
        json!({
            "name": self.name, "note": self.note, "log": self.log, "root": self.root, "low": self.low, "high": self.high,
            "colors": colors, "ticks": self.ticks,
        })
    }
}

/// How far the signed maps reach: past 99 of 100 values of each map, rounded up to 1, 2 or 5 times a power of ten.
pub(super) fn reach_of(maps: &[Plane]) -> f32 {
    let largest = maps
        .iter()
        .map(|map| {
            let mut sizes: Vec<f32> = map.values.iter().map(|v| v.abs()).collect();
            let at = sizes.len().saturating_sub(1) * 99 / 100;
            *sizes.select_nth_unstable_by(at, f32::total_cmp).1
        })
        .fold(0.0, f32::max);
    // At least a thousandth, so that rounding is not shown as error; at most what is far off anyway.
    let largest = f64::from(largest).clamp(1e-3, 10.0);
    let decade = 10_f64.powf(largest.log10().floor());
    let step = [1.0, 2.0, 5.0].into_iter().find(|step| step * decade >= largest * 0.9999).unwrap_or(10.0);
    (step * decade) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(values: Vec<f32>) -> Plane {
        Plane { width: values.len(), height: 1, values }
    }

    #[test]
    fn the_reach_is_a_round_number_past_nearly_all_values() {
        assert_eq!(reach_of(&[plane(vec![0.013; 50]), plane(vec![-0.031; 50])]), 0.05);
        assert_eq!(reach_of(&[plane(vec![0.0; 10])]), 1e-3);
        assert_eq!(reach_of(&[plane(vec![f32::MAX; 10])]), 10.0);
        assert_eq!(reach_of(&[plane(vec![0.2; 4])]), 0.2);
    }

    #[test]
    fn pixels_without_a_value_stand_out() {
        let mut image = RgbImage::new(3, 1);
        image.pixels[1][2] = f32::NAN;
        let bytes = MapStyle::flip().paint(&plane(vec![0.0, 0.0, 1.0]), &image, &RgbImage::new(3, 1));
        assert_eq!(bytes, [0x00, 0x00, 0x04, 0x00, 0xff, 0x66, 0xfc, 0xfd, 0xbf]);
    }
}
