//! Finer levels than the picture: pixels at edges, and those whose predicted bandwidth is more than a pixel shows.
//!
//! Such a pixel is looked through at 2 × 2 or 4 × 4 places of its own. What a place shows is interpolated from the pixels
//! around that show the same surface, if that surface asks for no more; otherwise it is shaded, by its share of the
//! samples that the whole pixel would have had. All other pixels keep what they have. Source: `[001]` §4.3; the seed looks
//! through 4 or 16 places of all pixels, and shades as here.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::hierarchy::{Known, Shaded};
use super::parts::Shares;
use super::predict::{Buffer, FEWEST};
use super::shade::Shader;
use super::surface::{SurfacePoint, Surfaces, look_together};

/// Distance from the tangent plane, in steps to the neighbour, beyond which there is an edge between two pixels.
const EDGE: f32 = 0.7;
/// Cosine between normals below which there is one.
const CREASE: f32 = 0.8;

/// Whether something ends between two neighbouring pixels.
fn parted(a: &SurfacePoint, b: &SurfacePoint) -> bool {
    if !a.is_of(b) {
        return true;
    }
    if !a.is_there() {
        return false;
    }
    let step = b.position - a.position;
    a.normal.dot(b.normal) < CREASE
        || a.is_facet_beside(b)
        || a.geometric_normal.dot(step).abs() > EDGE * step.length()
}

/// Looks again through the pixels that need it, at up to `side` × `side` places each; returns how many pixels those were.
/// `offset` is where the picture looked through its pixels.
pub(super) fn refine(
    shader: &Shader,
    surfaces: &Surfaces,
    buffer: &Buffer,
    (shaded, picture): (&mut Shaded, &mut [Vec3]),
    side: usize,
    offset: Vec2,
) -> usize {
    let (width, height) = (surfaces.width, surfaces.height);
    let view = shader.frame.camera.view(width, height);
    let finer = Finer { shader, surfaces, buffer, known: &shaded.pixels };
    let found: Vec<(Vec<(usize, Part)>, u64)> = (0..height)
        .into_par_iter()
        .map(|y| {
            let mut room = shader.room();
            let mut row = Vec::new();
            if shader.progress.unwanted() {
                return (row, 0);
            }
            for x in 0..width {
                let Some(side) = finer.places([x, y], side) else { continue };
                let corner = Vec2::new(x as f32, y as f32) + offset - Vec2::splat(0.5);
                let place = |i: usize| {
                    corner
                        + (Vec2::new((i % side) as f32, (i / side) as f32) + Vec2::splat(0.5)) / side as f32
                };
                let mut sum = Part::default();
                look_together(shader.frame, &view, side * side, place, |i, point| {
                    let at = [(x * side + i % side) as u32, (y * side + i / side) as u32];
                    let part = finer.part([x, y], &point, at, (side * side) as u32, &mut room);
                    sum.radiance += part.radiance;
                    sum.samples = sum.samples.saturating_add(part.samples);
                    sum.shaded |= part.shaded;
                });
                sum.radiance /= (side * side) as f32;
                row.push((y * width + x, sum));
            }
            (row, room.count)
        })
        .collect();
    let mut pixels = 0;
    for (row, rays) in found {
        shaded.rays += rays;
        pixels += row.len();
        for (index, known) in row {
            picture[index] = known.radiance;
            let pixel = &mut shaded.pixels[index];
            (pixel.samples, pixel.shaded) = (known.samples, known.shaded);
        }
    }
    pixels
}

/// What one place of a pixel shows, or the mean of some.
#[derive(Clone, Copy, Default)]
struct Part {
    radiance: Vec3,
    samples: u16,
    shaded: bool,
}

struct Finer<'a> {
    shader: &'a Shader<'a>,
    surfaces: &'a Surfaces,
    buffer: &'a Buffer,
    known: &'a [Known],
}

impl Finer<'_> {
    /// Places along the side of a pixel through which to look again; `None` where once is enough.
    fn places(&self, [x, y]: [usize; 2], side: usize) -> Option<usize> {
        let point = self.surfaces.at(x, y);
        let beside = [(1, 0), (0, 1), (-1, 0), (0, -1)];
        let is_edge = beside.iter().any(|step| {
            self.neighbour([x, y], *step).is_some_and(|index| parted(point, &self.surfaces.points[index]))
        });
        if is_edge {
            return Some(side);
        }
        if !point.is_there() {
            return None;
        }
        let level = self.buffer.pixels[y * self.surfaces.width + x].detail;
        (level < 0).then(|| side.min(1 << -level))
    }

    fn neighbour(&self, [x, y]: [usize; 2], (dx, dy): (isize, isize)) -> Option<usize> {
        let (x, y) = (x.checked_add_signed(dx)?, y.checked_add_signed(dy)?);
        (x < self.surfaces.width && y < self.surfaces.height).then(|| y * self.surfaces.width + x)
    }

    /// What one place of a pixel shows.
    fn part(
        &self,
        pixel: [usize; 2],
        point: &SurfacePoint,
        at: [u32; 2],
        parts: u32,
        room: &mut super::gather::Gathered,
    ) -> Part {
        if !point.is_there() {
            let radiance = self.shader.frame.lights.escaped(-point.towards_eye);
            return Part { radiance, samples: 0, shaded: false };
        }
        let (mut sum, mut weights) = (Shares::default(), 0.0);
        let (mut asks, mut samples) = (i8::MAX, [FEWEST; 2]);
        let mut nearest = f32::INFINITY;
        for dy in -1..=1 {
            for dx in -1..=1 {
                let Some(index) = self.neighbour(pixel, (dx, dy)) else { continue };
                let other = &self.surfaces.points[index];
                if !other.is_of(point)
                    || other.normal.dot(point.normal) < CREASE
                    || other.is_facet_beside(point)
                {
                    continue;
                }
                let away = other.position - point.position;
                let distance = away.length_squared();
                let off = point.normal.dot(away);
                let weight = (-(off * off) / distance.max(f32::MIN_POSITIVE) / (EDGE * EDGE)).exp()
                    / distance.max(1e-20);
                let known = &self.known[index].shares;
                sum = std::array::from_fn(|part| sum[part] + weight * known[part]);
                weights += weight;
                let predicted = &self.buffer.pixels[index];
                asks = asks.min(predicted.level);
                if distance < nearest {
                    nearest = distance;
                    samples = predicted.samples.map(u32::from);
                }
            }
        }
        if weights > 0.0 && weights.is_finite() && (0..i8::MAX).contains(&asks) {
            let radiance = self.shader.composed(point, sum.map(|s| s / weights));
            return Part { radiance, samples: 0, shaded: false };
        }
        let samples = samples.map(|n| if n > 1 { (n / parts).max(FEWEST) } else { n });
        let shares = self.shader.shares(point, at, samples, room);
        let radiance = self.shader.composed(point, shares);
        Part { radiance, samples: (samples[0] + samples[1]) as u16, shaded: true }
    }
}
