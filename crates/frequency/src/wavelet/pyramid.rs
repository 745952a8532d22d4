//! The separable pyramid: per octave the power of horizontal and of vertical detail, in linear time.
//!
//! Levels halve, rounding up; a dimension that has come down to one texel is left alone. Diagonal detail counts half as
//! horizontal and half as vertical. One output row needs four input rows, which are filtered vertically into two rows first
//! (whole rows at a time), then each of these horizontally; rows are independent, which is where threads come in.

use halflight_image::Plane;
use rayon::prelude::*;

use super::filter::{Border, Filter, Taps};

/// Larger values would overflow when squared; nothing that lights a scene is as bright.
const LARGEST: f32 = 1e15;

/// Power of one octave: level i has wavelengths between 2^(i+1) and 2^(i+2) texels.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// Cells across: each covers 2^(i+1) texels of the picture.
    pub width: usize,
    /// Cells down.
    pub height: usize,
    /// Power per texel of detail that varies horizontally.
    pub across: Vec<f32>,
    /// Power per texel of detail that varies vertically.
    pub down: Vec<f32>,
}

/// All octaves of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Pyramid {
    /// Columns of the picture.
    pub width: usize,
    /// Rows of the picture.
    pub height: usize,
    /// Octaves, the finest first; none for a picture of one texel.
    pub levels: Vec<Level>,
    /// The picture without the octaves finer than [`NEIGHBOURHOOD`](super::NEIGHBOURHOOD), or its coarsest.
    pub(super) coarse: Plane,
    pub(super) border: Border,
    /// Mean of the whole, as the coarsest low-pass value.
    pub mean: f32,
}

impl Pyramid {
    /// Analyses a picture. Values that are not finite count as zero.
    #[must_use]
    pub fn new(picture: &Plane, filter: Filter, border: Border) -> Self {
        let count = picture.width * picture.height;
        let mut values: Vec<f32> = picture
            .values
            .iter()
            .take(count)
            .map(|v| if v.is_finite() { v.clamp(-LARGEST, LARGEST) } else { 0.0 })
            .collect();
        values.resize(count, 0.0);
        let mut approximation = Plane { width: picture.width, height: picture.height, values };
        let mut coarse = None;
        let mut levels = Vec::new();
        while count > 0 && (approximation.width > 1 || approximation.height > 1) {
            let (next, mut level) = split(&approximation, &filter.taps(), border);
            if filter == Filter::Smooth {
                // Four taps reach into the neighbouring cells; so does their power.
                level.across = spread(&level.across, level.width, level.height, border);
                level.down = spread(&level.down, level.width, level.height, border);
            }
            levels.push(level);
            approximation = next;
            if levels.len() == super::local::FINE_LEVELS {
                coarse = Some(approximation.clone());
            }
        }
        let mean = approximation.values.first().copied().unwrap_or(0.0);
        let coarse = coarse.unwrap_or(approximation);
        Self { width: picture.width, height: picture.height, levels, coarse, border, mean }
    }

    /// E_k: the power of each octave over the whole picture, horizontal and vertical together, per texel.
    #[must_use]
    pub fn energies(&self) -> Vec<f64> {
        let mean = |v: &[f32]| v.iter().map(|&e| f64::from(e)).sum::<f64>() / v.len().max(1) as f64;
        self.levels.iter().map(|l| mean(&l.across) + mean(&l.down)).collect()
    }
}

/// The index of a texel that may lie up to two beyond the border.
#[inline]
pub(super) fn inside(at: isize, size: usize, wraps: bool) -> usize {
    let last = size as isize - 1;
    if wraps { at.rem_euclid(size as isize) as usize } else { at.clamp(0, last) as usize }
}

/// Low-pass values and both kinds of detail of a band of rows.
type Outputs<'a> = ((&'a mut [f32], &'a mut [f32]), &'a mut [f32]);

fn split(picture: &Plane, taps: &Taps, border: Border) -> (Plane, Level) {
    let (w, h) = (picture.width, picture.height);
    let (w2, h2) = (w.div_ceil(2), h.div_ceil(2));
    let mut approximation = vec![0.0; w2 * h2];
    let mut across = vec![0.0; w2 * h2];
    let mut down = vec![0.0; w2 * h2];
    // Bands of rows, about 4000 texels each, so that threads have something to do and small levels stay on one.
    let rows = (2048 / w2).max(1);
    let band = |(index, ((low, across), down)): (usize, Outputs)| {
        let mut lines = [vec![0.0; w + 4], vec![0.0; w + 4]];
        let outputs = low.chunks_mut(w2).zip(across.chunks_mut(w2)).zip(down.chunks_mut(w2));
        for (row, ((low, across), down)) in outputs.enumerate() {
            vertically(picture, index * rows + row, taps, border, &mut lines);
            horizontally(&lines, w, taps, low, across, down);
        }
    };
    let size = rows * w2;
    let work =
        approximation.par_chunks_mut(size).zip(across.par_chunks_mut(size)).zip(down.par_chunks_mut(size));
    work.enumerate().for_each(band);
    let level = Level { width: w2, height: h2, across, down };
    (Plane { width: w2, height: h2, values: approximation }, level)
}

/// Output row `row` filtered vertically: low-pass and high-pass lines, each with one texel before and up to three after.
fn vertically(picture: &Plane, row: usize, taps: &Taps, border: Border, lines: &mut [Vec<f32>; 2]) {
    let (w, h) = (picture.width, picture.height);
    let [low, high] = lines;
    if h == 1 {
        low[1..=w].copy_from_slice(&picture.values[..w]);
        high.fill(0.0);
    } else {
        let source: [&[f32]; 4] = std::array::from_fn(|t| {
            let y = inside((2 * row + t) as isize - 1, h, border == Border::Wrap);
            &picture.values[y * w..(y + 1) * w]
        });
        let [a, b, c, d] = source;
        let (l, g) = (taps.low, taps.high);
        for ((((lo, hi), (&a, &b)), &c), &d) in
            low[1..=w].iter_mut().zip(&mut high[1..=w]).zip(a.iter().zip(b)).zip(c).zip(d)
        {
            *lo = l[0] * a + l[1] * b + l[2] * c + l[3] * d;
            *hi = g[0] * a + g[1] * b + g[2] * c + g[3] * d;
        }
    }
    let wraps = border != Border::Repeat;
    for line in [low, high] {
        line[0] = line[1 + inside(-1, w, wraps)];
        for beyond in 0..3 {
            line[1 + w + beyond] = line[1 + inside((w + beyond) as isize, w, wraps)];
        }
    }
}

fn horizontally(
    lines: &[Vec<f32>; 2],
    width: usize,
    taps: &Taps,
    low: &mut [f32],
    across: &mut [f32],
    down: &mut [f32],
) {
    let (l, g) = (taps.low, taps.high);
    if width == 1 {
        low[0] = lines[0][1];
        across[0] = 0.0;
        down[0] = lines[1][1] * lines[1][1];
        return;
    }
    // Texels 2j − 1 … 2j + 2 stand at 2j … 2j + 3 of the line.
    let sum = |f: &[f32; 4], p: &[f32], q: &[f32]| f[0] * p[0] + f[1] * p[1] + f[2] * q[0] + f[3] * q[1];
    let cells = low.len();
    let (first, second) = (&lines[0][..2 * cells + 2], &lines[1][..2 * cells + 2]);
    for (j, ((low, across), down)) in low.iter_mut().zip(across).zip(down).enumerate() {
        let (p, q) = (&first[2 * j..2 * j + 2], &first[2 * j + 2..2 * j + 4]);
        let (r, s) = (&second[2 * j..2 * j + 2], &second[2 * j + 2..2 * j + 4]);
        *low = sum(&l, p, q);
        let horizontal = sum(&g, p, q);
        let vertical = sum(&l, r, s);
        let diagonal = sum(&g, r, s);
        let half = 0.5 * diagonal * diagonal;
        *across = horizontal * horizontal + half;
        *down = vertical * vertical + half;
    }
}

/// Weights ¼, ½, ¼ in both directions.
fn spread(values: &[f32], w: usize, h: usize, border: Border) -> Vec<f32> {
    let mut out = vec![0.0; w * h];
    let rows = (4096 / w).max(1);
    out.par_chunks_mut(rows * w).enumerate().for_each(|(band, out)| {
        let mut line = vec![0.0; w + 2];
        for (row, out) in out.chunks_mut(w).enumerate() {
            let y = (band * rows + row) as isize;
            let source = |dy: isize| {
                let y = inside(y + dy, h, border == Border::Wrap);
                &values[y * w..(y + 1) * w]
            };
            let (a, b, c) = (source(-1), source(0), source(1));
            for (((mid, &a), &b), &c) in line[1..=w].iter_mut().zip(a).zip(b).zip(c) {
                *mid = 0.25 * (a + c) + 0.5 * b;
            }
            let wraps = border != Border::Repeat;
            line[0] = line[1 + inside(-1, w, wraps)];
            line[w + 1] = line[1 + inside(w as isize, w, wraps)];
            for (x, out) in out.iter_mut().enumerate() {
                *out = 0.25 * (line[x] + line[x + 2]) + 0.5 * line[x + 1];
            }
        }
    });
    out
}
