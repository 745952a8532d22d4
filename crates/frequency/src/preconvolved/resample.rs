//! Averages of a latitude–longitude map over larger (or parts of) texels, weighted by their true area.

use std::f32::consts::PI;

use halflight_image::RgbImage;
use rayon::prelude::*;

/// The map at another size, by area.
pub(super) fn area(map: &RgbImage, width: usize, height: usize) -> RgbImage {
    let (w, h) = (map.width, map.height);
    if (w, h) == (width, height) {
        return map.clone();
    }
    let mut pixels = vec![[0.0; 3]; width * height];
    let columns: Vec<Vec<(usize, f32)>> = (0..width).map(|x| overlaps(x, width, w, |e| e)).collect();
    pixels.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        // Between colatitudes a and b a row covers cos a − cos b.
        let rows = overlaps(y, height, h, |edge| -(edge * PI).cos());
        let mut line = vec![[0.0f32; 3]; w];
        for &(row, weight) in &rows {
            for (line, pixel) in line.iter_mut().zip(&map.pixels[row * w..(row + 1) * w]) {
                for c in 0..3 {
                    line[c] += weight * pixel[c];
                }
            }
        }
        for (out, columns) in out.iter_mut().zip(&columns) {
            for &(column, weight) in columns {
                for c in 0..3 {
                    out[c] += weight * line[column][c];
                }
            }
        }
    });
    RgbImage { width, height, pixels }
}

/// The cells of a line of `from` that cell `index` of a line of `to` overlaps, with shares that sum to one; `measure` is
/// the area below an edge in 0..1.
fn overlaps(index: usize, to: usize, from: usize, measure: impl Fn(f32) -> f32) -> Vec<(usize, f32)> {
    let (low, high) = (index as f32 / to as f32, (index + 1) as f32 / to as f32);
    let first = ((low * from as f32) as usize).min(from - 1);
    let last = ((high * from as f32).ceil() as usize).clamp(first + 1, from);
    let share = |cell: usize| {
        let a = (cell as f32 / from as f32).max(low);
        let b = ((cell + 1) as f32 / from as f32).min(high);
        if b > a { (measure(b) - measure(a)).max(0.0) } else { 0.0 }
    };
    let mut shares: Vec<(usize, f32)> = (first..last).map(|cell| (cell, share(cell))).collect();
    let total: f32 = shares.iter().map(|s| s.1).sum();
    for (_, share) in &mut shares {
        *share = if total > 0.0 { *share / total } else { 1.0 / (last - first) as f32 };
    }
    shares
}
