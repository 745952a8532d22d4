//! Samples for each pixel in two independent halves, as many as each is to have.
//!
//! The halves judge each other: a filter of one is compared with the samples of the other. Each half goes on in the order of its
//! own sequence, so what a pixel has does not depend on how the work was cut. Paths travel in blocks of pixels that are at the
//! same index of their sequence.

use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;

use super::super::path::block::Block;
use super::super::path::integrator::Integrator;
use super::photons::Averaged;
use crate::camera_sample::CameraSampler;
use crate::film::Pixel;
use crate::samplers::LANES;

/// Columns and rows of a square: enough that blocks are full where few pixels want more samples.
const SIDE: usize = 32;
/// Columns and rows of the blocks that coherent rays travel in, within a square.
const BLOCK: usize = 8;

/// What tells the seeds of the halves apart.
pub(super) const HALF: u64 = 0x5851_f42d_4c95_7f2d;

/// The samples of one pixel.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Halves {
    pub(super) half: [Pixel; 2],
    /// How many it is to have in both together.
    pub(super) target: u32,
}

impl Halves {
    /// Of both halves.
    pub(super) fn both(&self) -> Pixel {
        let [a, b] = &self.half;
        Pixel {
            sum: std::array::from_fn(|c| a.sum[c] + b.sum[c]),
            sum_squares: a.sum_squares + b.sum_squares,
            samples: a.samples + b.samples,
        }
    }
}

/// A square of the film.
pub(super) struct Square<T> {
    pub(super) x: usize,
    pub(super) y: usize,
    pub(super) width: usize,
    pub(super) pixels: Vec<T>,
}

impl<T: Clone + Default> Square<T> {
    /// The film in squares.
    pub(super) fn cover(width: usize, height: usize) -> Vec<Self> {
        let mut squares = Vec::new();
        for y in (0..height).step_by(SIDE) {
            for x in (0..width).step_by(SIDE) {
                let (columns, rows) = (SIDE.min(width - x), SIDE.min(height - y));
                squares.push(Self { x, y, width: columns, pixels: vec![T::default(); columns * rows] });
            }
        }
        squares
    }
}

impl<T> Square<T> {
    pub(super) fn place(&self, i: usize) -> [usize; 2] {
        [self.x + i % self.width, self.y + i / self.width]
    }
}

/// One number per pixel, rows from the top.
pub(super) fn flat<T, U: Clone + Default>(
    squares: &[Square<T>],
    width: usize,
    f: impl Fn(&T) -> U,
) -> Vec<U> {
    let count = squares.iter().map(|s| s.pixels.len()).sum();
    let mut all = vec![U::default(); count];
    for square in squares {
        for (i, pixel) in square.pixels.iter().enumerate() {
            let [x, y] = square.place(i);
            all[y * width + x] = f(pixel);
        }
    }
    all
}

/// The pixels of a square, block by block.
fn in_blocks(width: usize, count: usize) -> Vec<u16> {
    let mut order: Vec<u16> = (0..count as u16).collect();
    let key = |i: usize| (i / width / BLOCK, i % width / BLOCK, i);
    order.sort_by_key(|&i| key(i as usize));
    order
}

/// Gives every pixel the samples that it is to have. Returns the rays that took, and how many samples were not finite.
pub(super) fn fill(
    integrator: &Integrator,
    cameras: &[CameraSampler; 2],
    averaged: Option<&Averaged>,
    squares: &mut [Square<Halves>],
    stop: &(dyn Fn() -> bool + Sync),
) -> (u64, u64) {
    let (rays, lost) = (AtomicU64::new(0), AtomicU64::new(0));
    squares.par_iter_mut().for_each(|square| {
        if stop() {
            return;
        }
        let mut block = Block::new();
        let (mut traced, mut bad) = (0, 0);
        let order = in_blocks(square.width, square.pixels.len());
        for half in 0..2 {
            // The first half has the odd one.
            let wanted = |pixel: &Halves| (pixel.target + 1 - half as u32) / 2;
            let begin = square.pixels.iter().map(|p| p.half[half].samples).min().unwrap_or(0);
            let end = square.pixels.iter().map(wanted).max().unwrap_or(0);
            for sample in begin..end {
                let mut list = [0u16; SIDE * SIDE];
                let mut count = 0;
                for &i in &order {
                    let pixel = &square.pixels[i as usize];
                    if pixel.half[half].samples == sample && sample < wanted(pixel) {
                        list[count] = i;
                        count += 1;
                    }
                }
                if let Some(averaged) = averaged {
                    for &i in &list[..count] {
                        let index = 2 * sample + half as u32;
                        let place = square.place(i as usize);
                        let radiance = averaged.radiance(&cameras[half], place, sample, index);
                        bad += u64::from(!square.pixels[i as usize].half[half].add(radiance));
                    }
                    traced += 6 * count as u64;
                    continue;
                }
                for chunk in list[..count].chunks(LANES) {
                    let places = chunk.iter().map(|&i| square.place(i as usize));
                    let simd = integrator.frame.world.simd();
                    let (n, samplers) = cameras[half].rays(places, sample, simd, &mut block.rays);
                    integrator.radiance_of_block(&mut block, n, samplers, &mut traced);
                    for (&i, &radiance) in chunk.iter().zip(&block.radiance[..n]) {
                        bad += u64::from(!square.pixels[i as usize].half[half].add(radiance));
                    }
                }
            }
        }
        rays.fetch_add(traced, Ordering::Relaxed);
        lost.fetch_add(bad, Ordering::Relaxed);
    });
    (rays.into_inner(), lost.into_inner())
}
