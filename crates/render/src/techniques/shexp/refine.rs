//! Where light with visibility is worked out, and where it is taken from neighbours: from coarse to fine.
//!
//! Points are first solved at every `stride`th pixel of every `stride`th row. The pixels of each cell between them are
//! shaded from the cell's corners ([`super::between`]) where these are on the same surface and agree. What stays open is
//! tried again at half the stride, with the points that this adds, down to single pixels: shadows at contacts and the
//! edges of things are worked out one by one, smooth ones almost never. Results do not depend on the number of threads.

use glam::Vec3;
use halflight_material::LowFrequency;
use halflight_scene::Frame;
use halflight_sh::Sh;
use rayon::prelude::*;

use super::between::{Cell, Corner};
use super::settings::ShexpSettings;
use super::shade::{Kernels, unshadowed};
use super::solve::{LogLight, Receiver, Scratch, Solver};
use crate::gbuffer::{GBuffer, Pixel, PixelPoint};
use crate::looks::Stages;
use crate::sh_light::Colors;

/// Points along the side of a tile whose points are solved together, and pixels at least.
const TILE_POINTS: usize = 8;
const TILE_PIXELS: usize = 32;
/// Points that make a group of neighbours worth its overhead.
const GROUP: usize = 32;
/// Rows of cells of the first stride in a piece of work.
const BAND: usize = 4;
/// Columns and rows of the blocks of pixels of which it is known whether any is open.
const BLOCK: usize = 8;
/// No light is known at a pixel.
const NONE: u32 = u32::MAX;

/// Light at points of a picture.
#[derive(Default)]
pub(super) struct Lights<const ORDER: usize> {
    /// Pixel by pixel, the place of its light, or [`NONE`].
    slots: Vec<u32>,
    /// How many lights there are; what the memory holds behind them is of pictures before.
    count: usize,
    lights: Vec<Colors<ORDER>>,
    /// The same in two parts, if a pixel adds lobes as logarithms; else empty.
    apart: Vec<LogLight<ORDER>>,
}

impl<const ORDER: usize> Lights<ORDER> {
    /// At how many points it is known.
    pub(super) fn len(&self) -> usize {
        self.count
    }

    fn clear(&mut self, pixels: usize) {
        self.slots.clear();
        self.slots.resize(pixels, NONE);
        self.count = 0;
        self.apart.clear();
    }
}

/// A picture that is being worked out.
pub(super) struct Refinement<'a, const ORDER: usize> {
    solver: &'a Solver<'a, ORDER>,
    view: &'a GBuffer,
    kernels: &'a Kernels<ORDER>,
    /// By how much the irradiances that surround a pixel may differ.
    tolerance: f32,
    known: &'a mut Lights<ORDER>,
    with_logarithms: bool,
    radiance: Vec<Vec3>,
    /// Pixel by pixel, whether it is still to be shaded.
    open: Vec<bool>,
    /// Block by block, whether any of its pixels is: most of a picture is done at the first stride, and need not be looked
    /// through again.
    open_blocks: Vec<bool>,
}

/// The radiance of every pixel. `known` is memory to work in; then it holds the points at which light was worked out.
pub(super) fn shade<const ORDER: usize>(
    solver: &Solver<ORDER>,
    view: &GBuffer,
    frame: &Frame,
    (settings, kernels): (&ShexpSettings, &Kernels<ORDER>),
    known: &mut Lights<ORDER>,
    stages: &mut Stages,
) -> Vec<Vec3> {
    let pixels = view.width * view.height;
    known.clear(pixels);
    let mut refinement = Refinement {
        solver,
        view,
        kernels,
        tolerance: settings.tolerance * unshadowed(solver.light),
        known,
        with_logarithms: false,
        radiance: vec![Vec3::ZERO; pixels],
        open: view.seen.clone(),
        open_blocks: vec![true; view.width.div_ceil(BLOCK) * view.height.div_ceil(BLOCK)],
    };
    stages.time("pixels", || refinement.look_past(frame));
    let mut stride = first_stride(settings.stride);
    loop {
        stages.time("points", || refinement.solve(stride));
        stages.time("pixels", || refinement.interpolate(stride));
        if stride == 1 {
            return refinement.radiance;
        }
        stride /= 2;
    }
}

/// The power of two at or below a setting.
fn first_stride(setting: u32) -> usize {
    1 << setting.max(1).ilog2()
}

impl<const ORDER: usize> Refinement<'_, ORDER> {
    /// Pixels in which nothing is; and whether any of the others adds its lobe as a logarithm.
    fn look_past(&mut self, frame: &Frame) {
        let (view, kernels) = (self.view, self.kernels);
        let pixels = view.pixels.par_iter().zip(&view.seen).zip(&mut self.radiance).with_min_len(4096);
        pixels.for_each(|((visible, seen), radiance)| {
            if !*seen && let Pixel::Nothing(direction) = visible {
                *radiance = frame.lights.escaped(*direction);
            }
        });
        // Points are looked at only where their materials do not tell.
        let may = |material: &Option<LowFrequency>| {
            material.as_ref().is_none_or(|material| kernels.by_logarithms(material))
        };
        let any = || {
            view.pixels.par_iter().with_min_len(4096).any(|visible| {
                matches!(visible, Pixel::Point(point) if kernels.by_logarithms(&view.look_of(point).material))
            })
        };
        self.with_logarithms = view.materials.iter().any(may) && any();
    }

    /// Works out the light at the corners of all cells that have open pixels.
    fn solve(&mut self, stride: usize) {
        let (places, groups) = self.wanted(stride);
        let first = self.known.count;
        self.known.count += places.len();
        let memory = self.known.count.max(self.known.lights.len());
        self.known.lights.resize(memory, [Sh::zero(); 3]);
        let parts = if self.with_logarithms { self.known.count } else { 0 };
        self.known.apart.resize(parts, LogLight::default());
        let mut rest =
            (&mut self.known.lights[first..], self.known.apart.get_mut(first..).unwrap_or_default());
        let mut work = Vec::with_capacity(groups.len());
        let mut begin = 0;
        for end in groups {
            let (lights, others) = rest.0.split_at_mut(end - begin);
            let (apart, other_parts) = rest.1.split_at_mut((end - begin).min(rest.1.len()));
            work.push((&places[begin..end], lights, apart));
            (rest, begin) = ((others, other_parts), end);
        }
        let (solver, view) = (self.solver, self.view);
        work.into_par_iter().for_each_init(
            || (Scratch::default(), Vec::new()),
            |(scratch, receivers), (places, lights, apart)| {
                receivers.clear();
                receivers.extend(places.iter().filter_map(|&place| {
                    let Pixel::Point(point) = &view.pixels[place as usize] else { return None };
                    Some(receiver(solver, point))
                }));
                let apart = (!apart.is_empty()).then_some(apart);
                solver.solve(receivers, scratch, lights, apart);
            },
        );
    }

    /// Pixels whose light is wanted and not known yet, which get their slots, and where each group of neighbours ends.
    fn wanted(&mut self, stride: usize) -> (Vec<u32>, Vec<usize>) {
        let tile = (TILE_POINTS * stride).max(TILE_PIXELS);
        let tops: Vec<usize> = (0..self.view.height).step_by(tile).collect();
        let rows: Vec<_> = tops.into_par_iter().map(|top| self.corners_of_tiles(top, tile, stride)).collect();
        let (mut places, mut groups) = (Vec::new(), Vec::new());
        let first = self.known.count;
        for (corners, ends) in rows {
            let mut begin = 0;
            for end in ends {
                for &place in &corners[begin..end] {
                    // Neighbouring cells share their corners.
                    let slot = &mut self.known.slots[place as usize];
                    if *slot == NONE {
                        *slot = (first + places.len()) as u32;
                        places.push(place);
                    }
                }
                if places.len() - groups.last().unwrap_or(&0) >= GROUP {
                    groups.push(places.len());
                }
                begin = end;
            }
            if places.len() > *groups.last().unwrap_or(&0) {
                groups.push(places.len());
            }
        }
        (places, groups)
    }

    /// Corners without light of the cells with open pixels, tile by tile of a row of tiles, some more than once; and where
    /// each tile ends.
    fn corners_of_tiles(&self, top: usize, tile: usize, stride: usize) -> (Vec<u32>, Vec<usize>) {
        let (width, height) = (self.view.width, self.view.height);
        let (mut corners, mut ends) = (Vec::new(), Vec::new());
        // Cells in blocks, and blocks in tiles, so that those that are done are passed over.
        let block = stride.max(BLOCK);
        for left in (0..width).step_by(tile) {
            for block_y in (top..(top + tile).min(height)).step_by(block) {
                for block_x in (left..(left + tile).min(width)).step_by(block) {
                    if !self.is_open_block(block_x, block_y, block) {
                        continue;
                    }
                    for y in (block_y..(block_y + block).min(height)).step_by(stride) {
                        for x in (block_x..(block_x + block).min(width)).step_by(stride) {
                            let cell = self.cell(x, y, stride);
                            if cell.rows(width).any(|row| is_any(&self.open[row])) {
                                let dark =
                                    |&place: &usize| self.view.seen[place] && self.known.slots[place] == NONE;
                                let places = cell.corners(width).into_iter().filter(dark);
                                corners.extend(places.map(|place| place as u32));
                            }
                        }
                    }
                }
            }
            ends.push(corners.len());
        }
        (corners, ends)
    }

    fn cell(&self, x: usize, y: usize, stride: usize) -> Square {
        Square {
            left: x,
            top: y,
            right: (x + stride).min(self.view.width - 1),
            bottom: (y + stride).min(self.view.height - 1),
            columns: stride.min(self.view.width - x),
            rows: stride.min(self.view.height - y),
        }
    }

    /// Shades the open pixels that the corners of their cells tell enough of; at a stride of 1 all.
    fn interpolate(&mut self, stride: usize) {
        let width = self.view.width;
        let mut radiance = std::mem::take(&mut self.radiance);
        let mut open = std::mem::take(&mut self.open);
        let mut open_blocks = vec![false; self.open_blocks.len()];
        let (block, across) = (stride.max(BLOCK), width.div_ceil(BLOCK));
        let rows = BAND * block;
        let bands = radiance.par_chunks_mut(width * rows).zip(open.par_chunks_mut(width * rows));
        let bands = bands.zip(open_blocks.par_chunks_mut(across * rows / BLOCK));
        bands.enumerate().for_each(|(band, ((radiance, open), open_blocks))| {
            let first = band * rows * width;
            let height = open.len() / width;
            for block_y in (0..height).step_by(block) {
                for block_x in (0..width).step_by(block) {
                    if self.is_open_block(block_x, band * rows + block_y, block) {
                        for y in (block_y..(block_y + block).min(height)).step_by(stride) {
                            for x in (block_x..(block_x + block).min(width)).step_by(stride) {
                                self.shade_cell(
                                    &self.cell(x, band * rows + y, stride),
                                    first,
                                    radiance,
                                    open,
                                );
                            }
                        }
                    }
                }
            }
            for (i, is_open) in open_blocks.iter_mut().enumerate() {
                let (x, y) = (i % across * BLOCK, i / across * BLOCK);
                let columns = x..(x + BLOCK).min(width);
                let mut rows = open[y * width..].chunks(width).take(BLOCK);
                *is_open = rows.any(|row| is_any(&row[columns.clone()]));
            }
        });
        (self.radiance, self.open, self.open_blocks) = (radiance, open, open_blocks);
    }

    /// Whether any pixel of a square of blocks is open.
    fn is_open_block(&self, x: usize, y: usize, size: usize) -> bool {
        let across = self.view.width.div_ceil(BLOCK);
        let columns = x / BLOCK..((x + size) / BLOCK).min(across);
        let mut rows = self.open_blocks.chunks(across).skip(y / BLOCK).take(size / BLOCK);
        rows.any(|row| is_any(&row[columns.clone()]))
    }

    /// Shades what can be shaded of one cell; `radiance` and `open` begin with pixel number `first`.
    fn shade_cell(&self, square: &Square, first: usize, radiance: &mut [Vec3], open: &mut [bool]) {
        let width = self.view.width;
        let is_open = |row: std::ops::Range<usize>| is_any(&open[row.start - first..row.end - first]);
        if !square.rows(width).any(is_open) {
            return;
        }
        if square.columns == 1 && square.rows == 1 {
            let place = square.top * width + square.left;
            if let (Pixel::Point(point), Some(light)) = (&self.view.pixels[place], self.light(place)) {
                let point = self.view.point(point);
                radiance[place - first] = self.kernels.reflected(&point, light, self.apart(place));
                open[place - first] = false;
            }
            return;
        }
        let corners =
            square.corners(width).map(|place| match (&self.view.pixels[place], self.light(place)) {
                (Pixel::Point(point), Some(light)) => Some(Corner { point, light, apart: self.apart(place) }),
                _ => None,
            });
        if corners.iter().all(Option::is_none) {
            return;
        }
        let mut cell = Cell::new(self.solver.simd, self.kernels, corners, self.tolerance);
        for row in square.rows(width) {
            let y = (row.start / width - square.top) as f32 / (square.bottom - square.top).max(1) as f32;
            for place in row.clone() {
                if !open[place - first] {
                    continue;
                }
                let Pixel::Point(point) = &self.view.pixels[place] else { continue };
                let x = (place - row.start) as f32 / (square.right - square.left).max(1) as f32;
                if cell.push(self.view, point, place, [x, y]) {
                    cell.shade(|place, found| {
                        (radiance[place - first], open[place - first]) = (found, false);
                    });
                }
            }
        }
        cell.shade(|place, found| (radiance[place - first], open[place - first]) = (found, false));
    }

    fn light(&self, place: usize) -> Option<&Colors<ORDER>> {
        self.known.lights[..self.known.count].get(self.known.slots[place] as usize)
    }

    fn apart(&self, place: usize) -> Option<&LogLight<ORDER>> {
        self.known.apart.get(self.known.slots[place] as usize)
    }
}

/// A cell: its pixels, and the pixels at its corners, of which those to the right and below belong to the next ones.
struct Square {
    left: usize,
    top: usize,
    /// Where the farther corners are; held within the picture.
    right: usize,
    bottom: usize,
    /// Pixels of its own.
    columns: usize,
    rows: usize,
}

impl Square {
    /// Upper left, upper right, lower left, lower right.
    fn corners(&self, width: usize) -> [usize; 4] {
        if self.columns == 1 && self.rows == 1 && self.right <= self.left + 1 && self.bottom <= self.top + 1 {
            // A single pixel needs no neighbours.
            return [self.top * width + self.left; 4];
        }
        let at = |x: usize, y: usize| y * width + x;
        [
            at(self.left, self.top),
            at(self.right, self.top),
            at(self.left, self.bottom),
            at(self.right, self.bottom),
        ]
    }

    /// The places of its pixels, row by row.
    fn rows(&self, width: usize) -> impl Iterator<Item = std::ops::Range<usize>> {
        let (left, columns) = (self.left, self.columns);
        (self.top..self.top + self.rows).map(move |y| y * width + left..y * width + left + columns)
    }
}

/// Whether any is set; without a branch for each, as they are few.
#[inline]
fn is_any(flags: &[bool]) -> bool {
    flags.iter().fold(false, |any, flag| any | flag)
}

fn receiver<const ORDER: usize>(solver: &Solver<ORDER>, point: &PixelPoint) -> Receiver {
    Receiver {
        position: point.position,
        normal: point.geometric_normal,
        owner: solver.blockers.owner(point.hit.instance, point.hit.primitive),
        instance: point.hit.instance,
    }
}
