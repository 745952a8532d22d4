//! Shading from coarse to fine: a pixel is shaded where the picture varies faster than its coarser neighbours tell.
//!
//! Level k is the lattice of every 2^k-th pixel of every 2^k-th row, the last ones among them. On the coarsest all points are shaded; on each finer
//! one the points that were there keep their values, and a new one is interpolated from the two or four around it that are
//! known, unless a pixel within their reach asks for a finer level, or they show something else. Source: `[001]` §3.2:
//!
//! ```text
//! w_i = α_i · exp(−(z_i/σ)²) · exp(−vᵀ M v)        α bilinear, z the distance from the tangent plane
//! ```
//!
//! M is narrow along the projected normal, 1/cos² times as steep as across (the seed has it the other way round). A point
//! of another object or material, or turned far away, has no weight, so nothing leaks over silhouettes; where the weights
//! that remain are less than half of all, the pixel is shaded. Facets tell nothing of each other.
//!
//! What was predicted is then checked: where points around differ by more than what may lie between them, at the border of
//! a shadow or on a highlight narrower than predicted, the pixel is shaded as well. The seed trusts its prediction.

use glam::{Vec2, Vec3};
use halflight_scene::lights::luminance;
use rayon::prelude::*;

use super::gather::{Blocking, TOGETHER};
use super::parts::Shares;
use super::predict::{Buffer, COARSEST, FEWEST, Predicted};
use super::pyramid::MinPyramid;
use super::shade::Shader;
use super::surface::{SurfacePoint, Surfaces};

/// σ of the distance from the tangent plane, in spacings of the coarser lattice.
const PLANE: f32 = 0.35;
/// Least cosine between normals that tell of each other.
const TURNED: f32 = 0.8;
/// Least share of the weights that has to remain, and where the pixel itself asks for a level coarser still.
const REMAINS: [f32; 2] = [0.5, 0.2];
/// The same where shadow rays are traced: the border of a shadow often lies beside an edge.
const REMAINS_IN_SHADOWS: [f32; 2] = [0.75, 0.75];
/// What points around may differ by at an error of 10 %, over their sum; it grows with the error as the spacing does.
const CONTRAST: f32 = 0.25;
/// The error at which it is that.
const CONTRAST_ERROR: f32 = 0.1;
/// Coarsest level where there are shadows: of them nothing is predicted, so they have to be met by chance.
const COARSEST_OF_SHADOWS: i32 = 2;
/// Most samples of a point for speaking for many pixels.
const MOST_FOR_MANY: u32 = 512;
/// The same of points of lamps, whose mean settles sooner.
const MOST_OF_LAMPS_FOR_MANY: u32 = 64;
/// Weight of the tilt in the exponent, for steps in spacings of the coarser lattice.
const TILTED: f32 = 1.0;
/// Bound of the tilt, so that grazing points keep weights at all.
const MOST_TILTED: f32 = 1.0;

/// What is known of a lattice point.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Known {
    /// What the parts of its material send.
    pub(super) shares: Shares,
    /// Samples that it was shaded by; 0 where it was interpolated, or shows no surface.
    pub(super) samples: u16,
    /// Whether it was shaded.
    pub(super) shaded: bool,
}

/// What was shaded of a picture, before it is composed, and what that took.
#[derive(Default)]
pub(super) struct Shaded {
    pub(super) pixels: Vec<Known>,
    pub(super) rays: u64,
}

/// Shades a picture from coarse to fine.
pub(super) fn shade(shader: &Shader, surfaces: &Surfaces, buffer: &Buffer) -> Shaded {
    let (width, height) = (surfaces.width, surfaces.height);
    let smaller = width.min(height).ilog2() as i32;
    let (most, remains) = match shader.blocking {
        Blocking::Rays => (COARSEST_OF_SHADOWS, REMAINS_IN_SHADOWS),
        Blocking::Spheres(_) => (COARSEST_OF_SHADOWS, REMAINS),
        Blocking::Nothing => (COARSEST, REMAINS),
    };
    let coarsest = most.min(smaller) as usize;
    // Where nothing is nothing has to be shaded.
    let level = |(predicted, point): (&Predicted, &SurfacePoint)| {
        if point.is_there() { predicted.level } else { i8::MAX }
    };
    let levels = buffer.pixels.iter().zip(&surfaces.points).map(level).collect();
    let pyramid = MinPyramid::new(levels, width, coarsest);
    let pose = shader.frame.camera.pose[0].matrix3;
    let (across, down) = (Vec3::from(pose.x_axis), -Vec3::from(pose.y_axis));
    let mut rays = 0;
    let mut coarser: Vec<Known> = Vec::new();
    for k in (0..=coarsest).rev() {
        let size = 1usize << k;
        let columns = points_along(width, size);
        let rows = points_along(height, size);
        let mut finer = vec![Known::default(); columns * rows];
        let spacing = 2 * size;
        let known = Lattice {
            known: &coarser,
            columns: points_along(width, spacing),
            spacing,
            surfaces,
            across,
            down,
            contrast: CONTRAST * (shader.settings.target_error() / CONTRAST_ERROR).sqrt(),
            floor: buffer.floor,
        };
        rays += finer
            .par_chunks_mut(columns)
            .enumerate()
            .map(|(j, row)| {
                let (mut room, mut wanted) = (shader.room(), Vec::new());
                if shader.progress.unwanted() {
                    return 0;
                }
                for (i, out) in row.iter_mut().enumerate() {
                    let place = [(i * size).min(width - 1), (j * size).min(height - 1)];
                    let index = place[1] * width + place[0];
                    let point = &surfaces.points[index];
                    if k < coarsest {
                        if i % 2 == 0 && j % 2 == 0 {
                            *out = coarser[j / 2 * known.columns + i / 2];
                            continue;
                        }
                        let wanted = pyramid.around(k, i, j);
                        if wanted > k as i8
                            && point.is_there()
                            && let Some(shares) = {
                                let coarser = buffer.pixels[index].level > k as i8 + 1;
                                known.between(point, place, [i, j], remains[usize::from(coarser)])
                            }
                        {
                            *out = Known { shares, samples: 0, shaded: false };
                            continue;
                        }
                    }
                    if point.is_there() {
                        wanted.push(i);
                    }
                }
                let place = |i: usize| [(i * size).min(width - 1), (j * size).min(height - 1)];
                let at = |i: usize| place(i)[1] * width + place(i)[0];
                for (number, &i) in wanted.iter().enumerate() {
                    if number % TOGETHER == 0 {
                        let next = wanted[number..].iter().take(TOGETHER);
                        room.look_around(next.map(|&i| &surfaces.points[at(i)]));
                    }
                    // What speaks for many pixels may cost as much as they would. The level that is asked for decides, not
                    // that of the lattice: what is shaded beside it, on another lattice or along an edge, must not differ.
                    let (point, predicted) = (&surfaces.points[at(i)], &buffer.pixels[at(i)]);
                    let fewest = ((FEWEST << (2 * predicted.level.max(0))) / 2).clamp(FEWEST, MOST_FOR_MANY);
                    let samples = predicted.samples.map(u32::from);
                    let at_least = |n: u32, fewest: u32| if n > 1 { n.max(fewest) } else { n };
                    let fewest = [fewest, fewest.min(MOST_OF_LAMPS_FOR_MANY)];
                    let samples = [at_least(samples[0], fewest[0]), at_least(samples[1], fewest[1])];
                    let shares = shader.shares(point, place(i).map(|p| p as u32), samples, &mut room);
                    row[i] = Known { shares, samples: (samples[0] + samples[1]) as u16, shaded: true };
                }
                room.count
            })
            .sum::<u64>();
        coarser = finer;
    }
    Shaded { pixels: coarser, rays }
}

/// The lattice one level coarser.
struct Lattice<'a> {
    known: &'a [Known],
    columns: usize,
    spacing: usize,
    surfaces: &'a Surfaces,
    /// Directions in which the picture goes on to the right and down.
    across: Vec3,
    down: Vec3,
    /// What points around may differ by, over their sum.
    contrast: f32,
    /// Luminance below which differences do not count.
    floor: f32,
}

impl Lattice<'_> {
    /// What is sent between the points around point (i, j) of the finer lattice; `None` where they do not tell.
    fn between(
        &self,
        point: &SurfacePoint,
        [x, y]: [usize; 2],
        [i, j]: [usize; 2],
        least: f32,
    ) -> Option<Shares> {
        let kernel = Kernel::new(point, self.across, self.down);
        let (columns, rows) = (Span::new(x, i, self.spacing, self.surfaces.width), {
            Span::new(y, j, self.spacing, self.surfaces.height)
        });
        let (mut sum, mut weights) = (Shares::default(), 0.0);
        let (mut least_sent, mut most_sent) = (f32::MAX, 0.0f32);
        for (dj, &py) in rows.places[..rows.number].iter().enumerate() {
            for (di, &px) in columns.places[..columns.number].iter().enumerate() {
                let parent = self.surfaces.at(px, py);
                let step = Vec2::new(px as f32 - x as f32, py as f32 - y as f32) / self.spacing as f32;
                let near = columns.near[di] * rows.near[dj];
                let weight = near * kernel.weight(point, parent, step);
                let known = &self.known[(j / 2 + dj) * self.columns + i / 2 + di].shares;
                sum[0] += weight * known[0];
                sum[1] += weight * known[1];
                weights += weight;
                if weight > 0.0 {
                    let sent = luminance(known[0] + known[1]);
                    (least_sent, most_sent) = (least_sent.min(sent), most_sent.max(sent));
                }
            }
        }
        let is_smooth = most_sent - least_sent <= self.contrast * (most_sent + least_sent).max(self.floor);
        (weights >= least && is_smooth).then(|| [sum[0] / weights, sum[1] / weights])
    }
}

/// Points of a lattice along a side: one every `size` pixels, and one in the last.
fn points_along(side: usize, size: usize) -> usize {
    (side - 1).div_ceil(size) + 1
}

/// The one or two points of the coarser lattice that a pixel lies between along one axis, and how near each is.
struct Span {
    places: [usize; 2],
    near: [f32; 2],
    number: usize,
}

impl Span {
    /// Of the pixel `at`, which is point `i` of the finer lattice.
    #[inline]
    fn new(at: usize, i: usize, spacing: usize, side: usize) -> Self {
        let places = [(i / 2 * spacing).min(side - 1), ((i / 2 + 1) * spacing).min(side - 1)];
        if i.is_multiple_of(2) {
            return Self { places, near: [1.0, 0.0], number: 1 };
        }
        let share = (at - places[0]) as f32 / (places[1] - places[0]).max(1) as f32;
        Self { places, near: [1.0 - share, share], number: 2 }
    }
}

/// The weights of what is around one pixel.
struct Kernel {
    /// Unit direction of the projected normal on the film, times √(1/cos² − 1): what is further along the tilt than across
    /// counts less.
    tilt: Vec2,
}

impl Kernel {
    fn new(point: &SurfacePoint, across: Vec3, down: Vec3) -> Self {
        let cos = point.cos_exit().clamp(0.05, 1.0);
        let tilt = Vec2::new(point.normal.dot(across), point.normal.dot(down)).normalize_or_zero();
        Self { tilt: tilt * (TILTED * (1.0 / (cos * cos) - 1.0)).sqrt().min(MOST_TILTED) }
    }

    fn weight(&self, point: &SurfacePoint, parent: &SurfacePoint, step: Vec2) -> f32 {
        if !parent.is_of(point) || parent.normal.dot(point.normal) < TURNED || point.is_facet_beside(parent) {
            return 0.0;
        }
        let away = parent.position - point.position;
        let off = point.normal.dot(away).abs() / away.length().max(f32::MIN_POSITIVE) / PLANE;
        let along = step.dot(self.tilt);
        (-(off * off) - along * along).exp()
    }
}
