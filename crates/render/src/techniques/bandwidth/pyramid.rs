//! Minima over blocks: how finely anything within a square of pixels has to be shaded.
//!
//! Level k holds, for every aligned block of 2^k × 2^k pixels, the smallest value in it. `[001]` §3.1.

/// The smallest of every block, the pixels themselves first.
pub(super) struct MinPyramid {
    levels: Vec<Vec<i8>>,
    widths: Vec<usize>,
}

impl MinPyramid {
    /// Builds levels 0 to `coarsest` over rows of `width` values.
    pub(super) fn new(values: Vec<i8>, width: usize, coarsest: usize) -> Self {
        let mut widths = vec![width];
        let mut levels = vec![values];
        for k in 0..coarsest {
            let (below, w) = (&levels[k], widths[k]);
            let h = below.len() / w;
            let (w2, h2) = (w.div_ceil(2), h.div_ceil(2));
            let smallest = |i: usize| {
                let (x, y) = (2 * (i % w2), 2 * (i / w2));
                let at = |dx: usize, dy: usize| below[(y + dy).min(h - 1) * w + (x + dx).min(w - 1)];
                at(0, 0).min(at(1, 0)).min(at(0, 1)).min(at(1, 1))
            };
            let level = (0..w2 * h2).map(smallest).collect();
            levels.push(level);
            widths.push(w2);
        }
        Self { levels, widths }
    }

    /// The smallest value of the pixels closer than 2^k to the corner (i, j) of the blocks of level k, along each axis.
    pub(super) fn around(&self, k: usize, i: usize, j: usize) -> i8 {
        let (level, w) = (&self.levels[k], self.widths[k]);
        let h = level.len() / w;
        let (x0, x1) = (i.saturating_sub(1), i.min(w - 1));
        let (y0, y1) = (j.saturating_sub(1), j.min(h - 1));
        let at = |x: usize, y: usize| level[y.min(h - 1) * w + x.min(w - 1)];
        at(x0, y0).min(at(x1, y0)).min(at(x0, y1)).min(at(x1, y1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_pixel_near_a_corner_is_smaller_than_the_pyramid_says() {
        let (width, height) = (21, 13);
        let values: Vec<i8> = (0..width * height).map(|i| ((i * 37 + i * i * 11) % 97) as i8).collect();
        let pyramid = MinPyramid::new(values.clone(), width, 3);
        for k in 0..=3 {
            let size = 1usize << k;
            for j in 0..=(height - 1) / size {
                for i in 0..=(width - 1) / size {
                    let near =
                        |at: usize, corner: usize| at + size >= corner * size && at < (corner + 1) * size;
                    let inside = (0..width * height).filter(|p| near(p % width, i) && near(p / width, j));
                    let expected = inside.map(|p| values[p]).min().expect("the corner's own pixel");
                    assert_eq!(pyramid.around(k, i, j), expected, "{k} {i} {j}");
                }
            }
        }
    }
}
