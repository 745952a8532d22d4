//! The three loops in which building a tree spends its time: sorting boxes into bins, dividing them at a bin's edge,
//! and measuring a range of them.
//!
//! Maxima only, no sums: the results do not depend on the order or on the width of vectors, so a tree is the same on
//! every machine and for any number of threads.
//!
//! `unsafe` is needed to call the copies compiled for AVX2, and to turn a float that is known to be in range into an
//! integer without the check.
#![allow(unsafe_code)]

use crate::simd::{Lanes, Plain, Simd};

/// How many bins along each axis: 16, as Wald 2007 (§3) found enough; 32 measured 1 % faster rays for 20 % more time.
pub(crate) const BINS: usize = 16;

/// A box as a maximum of eight numbers: −low x, −low y, −low z, (spare), high x, high y, high z, (spare).
pub(crate) type Span = [f32; 8];

/// The span of nothing.
pub(crate) const NOTHING: Span = [f32::NEG_INFINITY; 8];

/// A box with the number of what it holds in the first spare place (as bits) .
pub(crate) type Item = Span;

/// An item of a box and a number.
#[inline(always)]
pub(crate) fn item(low: glam::Vec3, high: glam::Vec3, number: u32) -> Item {
    [-low.x, -low.y, -low.z, f32::from_bits(number), high.x, high.y, high.z, 0.0]
}

/// The number in an item.
#[inline(always)]
pub(crate) fn number(item: &Item) -> u32 {
    item[3].to_bits()
}

/// Half of a span's surface area; 0 for nothing.
#[inline(always)]
pub(crate) fn half_area(span: &Span) -> f32 {
    let [x, y, z] = [span[0] + span[4], span[1] + span[5], span[2] + span[6]];
    if x >= 0.0 { x * y + y * z + z * x } else { 0.0 }
}

/// The span of both.
#[inline(always)]
pub(crate) fn join(a: &Span, b: &Span) -> Span {
    let mut out = *a;
    for i in 0..8 {
        out[i] = if b[i] > a[i] { b[i] } else { a[i] };
    }
    out
}

/// Counts and spans of the items in each bin of each axis.
#[derive(Clone)]
pub(crate) struct Bins {
    pub(crate) counts: [[u32; BINS]; 3],
    pub(crate) spans: [[Span; BINS]; 3],
}

impl Bins {
    pub(crate) const EMPTY: Bins = Bins { counts: [[0; BINS]; 3], spans: [[NOTHING; BINS]; 3] };

    /// What two parts hold together.
    pub(crate) fn merge(mut self, other: &Bins) -> Bins {
        for axis in 0..3 {
            for bin in 0..BINS {
                self.counts[axis][bin] += other.counts[axis][bin];
                self.spans[axis][bin] = join(&self.spans[axis][bin], &other.spans[axis][bin]);
            }
        }
        self
    }
}

/// From twice an item's centre to its bin: (centre − origin) · scale, on each axis.
#[derive(Clone, Copy)]
pub(crate) struct Grid {
    pub(crate) origin: [f32; 3],
    pub(crate) scale: [f32; 3],
}

impl Grid {
    /// A grid over a span of (doubled) centres. An axis without extent has one bin.
    pub(crate) fn over(centres: &Span) -> Grid {
        let mut grid = Grid { origin: [0.0; 3], scale: [0.0; 3] };
        for axis in 0..3 {
            let extent = centres[axis] + centres[4 + axis];
            grid.origin[axis] = -centres[axis];
            let scale = BINS as f32 * 0.999_999 / extent;
            grid.scale[axis] = if extent > 0.0 && scale.is_finite() { scale } else { 0.0 };
        }
        grid
    }

    #[inline(always)]
    fn bin(&self, item: &Item, axis: usize) -> usize {
        let place = (item[4 + axis] - item[axis] - self.origin[axis]) * self.scale[axis];
        // SAFETY: items are finite and lie within the grid's span, so that 0 ≤ place < 17; see `Grid::over`.
        let bin: i32 = unsafe { place.to_int_unchecked() };
        (bin as usize).min(BINS - 1)
    }
}

#[inline(always)]
fn bin_body<V: Lanes>(items: &[Item], grid: &Grid, bins: &mut Bins) {
    for item in items {
        let span = V::load(item);
        for axis in 0..3 {
            let bin = grid.bin(item, axis);
            bins.counts[axis][bin] += 1;
            let place = &mut bins.spans[axis][bin];
            span.max(V::load(place)).store(place);
        }
    }
}

#[inline(always)]
fn extent_body<V: Lanes>(items: &[Item]) -> (Span, Span) {
    let mut boxes = V::splat(f32::NEG_INFINITY);
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for item in items {
        boxes = V::load(item).max(boxes);
        for axis in 0..3 {
            let centre = item[4 + axis] - item[axis];
            low[axis] = if centre < low[axis] { centre } else { low[axis] };
            high[axis] = if centre > high[axis] { centre } else { high[axis] };
        }
    }
    let mut span = NOTHING;
    boxes.store(&mut span);
    span[3] = 0.0;
    (span, [-low[0], -low[1], -low[2], 0.0, high[0], high[1], high[2], 0.0])
}

#[inline(always)]
fn partition_body(items: &mut [Item], grid: &Grid, axis: usize, first_right: usize) -> usize {
    let mut left = 0;
    for i in 0..items.len() {
        // Both places are written whatever the outcome: no branch to mispredict.
        let item = items[i];
        let other = items[left];
        let goes_left = grid.bin(&item, axis) < first_right;
        items[i] = other;
        items[left] = item;
        left += usize::from(goes_left);
    }
    left
}

/// One set of copies for each level that makes a difference here.
macro_rules! dispatch {
    ($name:ident, $wide:ident, ($($arg:ident: $type:ty),*) -> $result:ty, $plain_body:expr, $wide_body:expr) => {
        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
        fn $wide($($arg: $type),*) -> $result {
            $wide_body
        }

        /// The loop of this name, by the best instructions of the level.
        pub(crate) fn $name(simd: Simd, $($arg: $type),*) -> $result {
            #[cfg(target_arch = "x86_64")]
            if simd >= Simd::Avx2 {
                // SAFETY: a level is only ever made after its instructions were found.
                return unsafe { $wide($($arg),*) };
            }
            let _ = simd;
            $plain_body
        }
    };
}

dispatch!(bin, bin_wide, (items: &[Item], grid: &Grid, bins: &mut Bins) -> (),
    bin_body::<Plain>(items, grid, bins), bin_body::<crate::simd::Wide8>(items, grid, bins));
dispatch!(extent, extent_wide, (items: &[Item]) -> (Span, Span),
    extent_body::<Plain>(items), extent_body::<crate::simd::Wide8>(items));
dispatch!(partition, partition_wide, (items: &mut [Item], grid: &Grid, axis: usize, first_right: usize) -> usize,
    partition_body(items, grid, axis, first_right), partition_body(items, grid, axis, first_right));
