//! Area lights: a picture that ends, and what lies around it is dark.

use glam::Vec2;
use halflight_image::Plane;

use super::filter::{Border, Filter};
use super::local::local_bandwidth;
use super::pyramid::Pyramid;
use super::rule::Rule;

/// Bandwidth around every texel of a light, its edges included, in cycles per metre: the picture is set into one of twice
/// its size that is dark elsewhere, analysed and cut out again. `[001]` §2.3, local light sources.
#[must_use]
pub fn padded_local_bandwidth(picture: &Plane, filter: Filter, rule: Rule, metres_per_texel: Vec2) -> Plane {
    let (w, h) = (picture.width, picture.height);
    let (left, top) = (w.div_ceil(2), h.div_ceil(2));
    let mut padded = Plane { width: 2 * w, height: 2 * h, values: vec![0.0; 4 * w * h] };
    for (y, row) in picture.values.chunks(w.max(1)).take(h).enumerate() {
        let at = (top + y) * 2 * w + left;
        padded.values[at..at + row.len()].copy_from_slice(row);
    }
    let pyramid = Pyramid::new(&padded, filter, Border::Repeat);
    let whole = local_bandwidth(&pyramid, rule, |_, _| metres_per_texel);
    let values = (0..w * h).map(|i| whole.values[(top + i / w) * 2 * w + left + i % w]).collect();
    Plane { width: w, height: h, values }
}

/// A flat polygon as a picture (share of each texel that is inside, of 4 × 4 points) of `resolution` texels along its longer
/// side, and the metres per texel. Corners in the polygon's plane, in metres, in either order; a polygon that encloses
/// nothing gives one dark texel.
#[must_use]
pub fn polygon_mask(corners: &[Vec2], resolution: usize) -> (Plane, Vec2) {
    let finite = corners.len() >= 3 && corners.iter().all(|c| c.is_finite());
    let low = corners.iter().copied().fold(Vec2::INFINITY, Vec2::min);
    let size = corners.iter().copied().fold(Vec2::NEG_INFINITY, Vec2::max) - low;
    let longer = size.max_element();
    let sized = longer > 0.0 && longer.is_finite();
    if !finite || !sized || resolution == 0 {
        return (Plane { width: 1, height: 1, values: vec![0.0] }, Vec2::ONE);
    }
    let texel = longer / resolution as f32;
    let count = |extent: f32| ((extent / texel - 1e-3).ceil() as usize).clamp(1, resolution);
    let (w, h) = (count(size.x), count(size.y));
    let inside = |p: Vec2| {
        let mut odd = false;
        for (i, &a) in corners.iter().enumerate() {
            let b = corners[(i + 1) % corners.len()];
            if (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) * (b.x - a.x) / (b.y - a.y) {
                odd = !odd;
            }
        }
        odd
    };
    let coverage = |i: usize| {
        let hits = (0..16).filter(|s| {
            let at = Vec2::new(
                (i % w) as f32 + (s % 4) as f32 * 0.25 + 0.125,
                (i / w) as f32 + (s / 4) as f32 * 0.25 + 0.125,
            );
            inside(low + at * texel)
        });
        hits.count() as f32 / 16.0
    };
    (Plane { width: w, height: h, values: (0..w * h).map(coverage).collect() }, Vec2::splat(texel))
}
