//! Pictures of another size, by area: each new pixel is the mean of what it covers.
//!
//! The mean of the whole picture is kept exactly (up to rounding), in both directions, which is what light and
//! error figures need. Enlarging repeats pixels; it does not smooth.

use crate::RgbImage;

impl RgbImage {
    /// The picture in `width × height` pixels.
    pub fn resize(&self, width: usize, height: usize) -> RgbImage {
        if (width, height) == (self.width, self.height) {
            return self.clone();
        }
        if self.pixels.is_empty() {
            return RgbImage::new(width, height);
        }
        let rows = spans(self.height, height);
        let columns = spans(self.width, width);
        let mut narrow = RgbImage::new(width, self.height);
        for y in 0..self.height {
            let row = &self.pixels[y * self.width..][..self.width];
            for (x, span) in columns.iter().enumerate() {
                narrow.pixels[y * width + x] = span.mean(|i| row[i]);
            }
        }
        RgbImage::from_fn(width, height, |x, y| rows[y].mean(|i| narrow.pixels[i * width + x]))
    }

    /// The picture shrunk by a whole factor; blocks at the right and bottom edges may be smaller.
    pub fn box_downsample(&self, factor: usize) -> RgbImage {
        let factor = factor.max(1);
        RgbImage::from_fn(self.width.div_ceil(factor), self.height.div_ceil(factor), |x, y| {
            let (x0, y0) = (x * factor, y * factor);
            let (x1, y1) = ((x0 + factor).min(self.width), (y0 + factor).min(self.height));
            let mut sum = [0.0_f64; 3];
            for row in y0..y1 {
                for pixel in &self.pixels[row * self.width + x0..row * self.width + x1] {
                    sum = std::array::from_fn(|c| sum[c] + f64::from(pixel[c]));
                }
            }
            sum.map(|v| (v / ((x1 - x0) * (y1 - y0)) as f64) as f32)
        })
    }

    /// Sets negative channels to zero and says how many there were: for pictures that are to be light.
    pub fn clamp_negative(&mut self) -> usize {
        let negative = self.pixels.as_flattened_mut().iter_mut().filter(|v| **v < 0.0);
        negative.map(|v| *v = 0.0).count()
    }
}

/// The pixels under one new pixel: whole ones, and shares of the first and last.
struct Span {
    first: usize,
    weights: Vec<f64>,
}

impl Span {
    fn mean(&self, at: impl Fn(usize) -> [f32; 3]) -> [f32; 3] {
        let mut sum = [0.0_f64; 3];
        for (i, weight) in self.weights.iter().enumerate() {
            let pixel = at(self.first + i);
            sum = std::array::from_fn(|c| sum[c] + weight * f64::from(pixel[c]));
        }
        sum.map(|v| v as f32)
    }
}

fn spans(old: usize, new: usize) -> Vec<Span> {
    // In units of 1/(old·new), where both grids have whole coordinates.
    (0..new)
        .map(|i| {
            let (start, end) = (i * old, (i + 1) * old);
            let (first, last) = (start / new, (end - 1) / new);
            let share = |j: usize| ((end.min((j + 1) * new)) - start.max(j * new)) as f64 / old as f64;
            Span { first, weights: (first..=last).map(share).collect() }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mean(image: &RgbImage) -> f64 {
        image.pixels.iter().map(|p| f64::from(p[0])).sum::<f64>() / image.pixels.len() as f64
    }

    #[test]
    fn resizing_keeps_the_mean() {
        let image = RgbImage::from_fn(37, 23, |x, y| [(x * y % 7) as f32, 0.0, 0.0]);
        for (width, height) in [(10, 10), (37, 1), (1, 1), (80, 50), (36, 24)] {
            assert!((mean(&image.resize(width, height)) - mean(&image)).abs() < 1e-6);
        }
    }

    #[test]
    fn a_whole_factor_is_a_mean_of_blocks() {
        let image = RgbImage::from_fn(4, 2, |x, y| [(x + 10 * y) as f32; 3]);
        assert_eq!(image.box_downsample(2), image.resize(2, 1));
        assert_eq!(image.box_downsample(2).pixels[0], [5.5; 3]);
    }

    #[test]
    fn negative_light_is_counted_and_gone() {
        let mut image = RgbImage { width: 1, height: 1, pixels: vec![[-1.0, 2.0, -0.5]] };
        assert_eq!(image.clamp_negative(), 2);
        assert_eq!(image.pixels, [[0.0, 2.0, 0.0]]);
    }
}
