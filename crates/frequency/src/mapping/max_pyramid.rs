//! The largest value within a box of texels, in constant time and never too small.

use halflight_image::Plane;

/// A picture and its halves, each texel the largest of the four below it.
#[derive(Clone, Debug, PartialEq)]
pub struct MaxPyramid {
    levels: Vec<Plane>,
    wraps: [bool; 2],
}

/// Cells of the chosen level that a box may span: more are slower, fewer are larger than the box.
const CELLS: f32 = 4.0;

impl MaxPyramid {
    /// Builds the levels down to one texel. `wraps` says whether columns and rows go round. Values that are not finite
    /// or negative count as zero; an empty picture becomes one texel of zero.
    #[must_use]
    pub fn new(mut picture: Plane, wraps: [bool; 2]) -> Self {
        if picture.width == 0 || picture.height == 0 {
            picture = Plane { width: 1, height: 1, values: vec![0.0] };
        }
        picture.values.resize(picture.width * picture.height, 0.0);
        for value in &mut picture.values {
            *value = if value.is_finite() { value.max(0.0) } else { 0.0 };
        }
        let mut levels = vec![picture];
        loop {
            let below = &levels[levels.len() - 1];
            let (w, h) = (below.width, below.height);
            if w == 1 && h == 1 {
                return Self { levels, wraps };
            }
            let (w2, h2) = (w.div_ceil(2), h.div_ceil(2));
            let largest = |i: usize| {
                let (x, y) = (2 * (i % w2), 2 * (i / w2));
                let at = |dx: usize, dy: usize| below.values[(y + dy).min(h - 1) * w + (x + dx).min(w - 1)];
                at(0, 0).max(at(1, 0)).max(at(0, 1)).max(at(1, 1))
            };
            levels.push(Plane { width: w2, height: h2, values: (0..w2 * h2).map(largest).collect() });
        }
    }

    /// The finest level.
    #[must_use]
    pub fn finest(&self) -> &Plane {
        &self.levels[0]
    }

    /// The levels, the finest first.
    #[must_use]
    pub fn levels(&self) -> &[Plane] {
        &self.levels
    }

    /// At least the largest value in the box around (u, v) in 0..1 whose sides are `width` and `height`, as shares of the
    /// picture. A box of no size gives the texel that holds the point.
    #[must_use]
    pub fn within(&self, u: f32, v: f32, width: f32, height: f32) -> f32 {
        let finest = self.finest();
        let extent = [width * finest.width as f32, height * finest.height as f32];
        let largest = extent[0].max(extent[1]);
        let last = self.levels.len() - 1;
        // NaN and infinity go to the top.
        let level = if largest <= CELLS { 0 } else { ((largest / CELLS).log2().ceil() as usize).min(last) };
        let level = if largest.is_finite() && u.is_finite() && v.is_finite() { level } else { last };
        let plane = &self.levels[level];
        let cell = (level as f32).exp2();
        let range = |at: f32, extent: f32, size: usize, cells: usize, wraps: bool| {
            let at = if wraps { at.rem_euclid(1.0) } else { at.clamp(0.0, 1.0) };
            let (low, high) = (at * size as f32 - 0.5 * extent, at * size as f32 + 0.5 * extent);
            let (low, high) = if wraps { (low, high) } else { (low.max(0.0), high.min(size as f32)) };
            let (low, high) = ((low / cell).floor() as isize, (high / cell).floor() as isize);
            // A box as wide as the picture meets every cell once.
            (low, high.min(low + cells as isize - 1).max(low))
        };
        let (x0, x1) = range(u, extent[0].max(0.0), finest.width, plane.width, self.wraps[0]);
        let (y0, y1) = range(v, extent[1].max(0.0), finest.height, plane.height, self.wraps[1]);
        let fold = |i: isize, cells: usize, finest: usize, wraps: bool| {
            if !wraps {
                return i.clamp(0, cells as isize - 1) as usize;
            }
            // The last cell of a level may be cut: go round by texels, not by cells.
            let texel = ((i as f32 + 0.5) * cell).rem_euclid(finest as f32);
            ((texel / cell) as usize).min(cells - 1)
        };
        let mut most = 0.0f32;
        for y in y0..=y1 {
            let row = fold(y, plane.height, finest.height, self.wraps[1]) * plane.width;
            for x in x0..=x1 {
                most = most.max(plane.values[row + fold(x, plane.width, finest.width, self.wraps[0])]);
            }
        }
        most
    }

    /// The texel that holds (u, v).
    #[inline]
    #[must_use]
    pub fn at(&self, u: f32, v: f32) -> f32 {
        let finest = self.finest();
        let index = |at: f32, size: usize, wraps: bool| {
            let at = if wraps { at - at.floor() } else { at };
            // Converting saturates: below zero and NaN become 0.
            ((at * size as f32) as usize).min(size - 1)
        };
        finest.values
            [index(v, finest.height, self.wraps[1]) * finest.width + index(u, finest.width, self.wraps[0])]
    }
}
