//! Phase-space pictures: for each event of a chain the spectrum as an ellipse, over (x, u) on top and (y, v) below.
//!
//! Light of the covariance Σ is drawn as the ellipse of one standard deviation of its spectrum. The scales of both axes are
//! those of the largest ellipse before the film, the same in every square of a row; the last square, at the film, has its own.

use std::path::Path;

use halflight_frequency::covariance::{Covariance5, Steps};
use halflight_image::{RgbImage, ToneMapping, save_png};

use crate::command::failure::Failure;

/// Side of a square, pixels.
const SIDE: usize = 160;
const GAP: usize = 8;

pub(super) fn save(steps: &Steps<5>, path: &Path) -> Result<(), Failure> {
    let count = steps.events.len().max(1);
    let (width, height) = (count * (SIDE + GAP) + GAP, 2 * (SIDE + GAP) + GAP);
    let mut picture = RgbImage::from_fn(width, height, |_, _| [1.0; 3]);
    for row in 0..2 {
        let (x, u) = (row, row + 2);
        // Light may have grown by orders of magnitude: both axes are drawn by the root of the root.
        let before = &steps.events[..steps.events.len().saturating_sub(1)];
        let largest =
            |axis: usize| before.iter().map(|e| e.covariance.rows[axis][axis]).fold(1e-12, f64::max);
        for (number, event) in steps.events.iter().enumerate() {
            let film = number + 1 == steps.events.len();
            let c = &event.covariance;
            let scale = if film { [c.rows[x][x], c.rows[u][u]] } else { [largest(x), largest(u)] };
            let corner = [GAP + number * (SIDE + GAP), GAP + row * (SIDE + GAP)];
            draw(&mut picture, corner, c, [x, u], scale);
        }
    }
    save_png(path, &picture, &ToneMapping::default()).map_err(Failure::failed)
}

fn draw(
    picture: &mut RgbImage,
    [left, top]: [usize; 2],
    c: &Covariance5,
    [x, u]: [usize; 2],
    scale: [f64; 2],
) {
    let [sx, su] = scale.map(|s| s.max(1e-12).sqrt());
    // Normalised, with a width of a pixel at least.
    let thin = 2e-4;
    let (a, b, d) =
        (c.rows[x][x] / (sx * sx) + thin, c.rows[x][u] / (sx * su), c.rows[u][u] / (su * su) + thin);
    let determinant = (a * d - b * b).max(1e-12);
    for j in 0..SIDE {
        for i in 0..SIDE {
            let place = |k: usize| (k as f64 + 0.5) / SIDE as f64 * 2.4 - 1.2;
            let (p, q) = (place(i), -place(j));
            let distance = ((d * p * p - 2.0 * b * p * q + a * q * q) / determinant).sqrt();
            let inside = (1.0 - distance).clamp(-1.0, 1.0);
            let axis = i == SIDE / 2 || j == SIDE / 2;
            let shade = if inside > 0.0 { 0.15 + 0.35 * (1.0 - inside) } else { 0.9 };
            let color = if inside > 0.0 { [shade as f32 * 0.6, shade as f32, 0.9] } else { [0.92; 3] };
            let color = if axis { color.map(|v: f32| v * 0.75) } else { color };
            picture.pixels[(top + j) * picture.width + left + i] = color;
        }
    }
}
