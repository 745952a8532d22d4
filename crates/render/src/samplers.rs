//! The numbers of [`Sampler`] for many paths at once, computed side by side.
//!
//! Paths of one block have the index of their sample and the number of the next set in common; only their pixels
//! differ. A set of numbers is a chain of integer operations without branches or look-ups, so a vector register
//! carries sixteen paths through it in the time of one. The functions are those of the crate `sobol_burley`, in its
//! first four dimensions; its tables are read once.

use std::sync::LazyLock;

use halflight_trace::{Kernel, Simd};
use sobol_burley::parts::{hash, owen_scramble_rev, sobol_rev, u32_to_f32_norm};

use crate::sampler::Sampler;

/// Most paths that are advanced together.
pub const LANES: usize = 64;

/// Four numbers in [0, 1) for each path, a dimension at a time.
pub type Numbers = [[f32; LANES]; 4];

/// Bits of an index that the sequences tell apart.
const INDEX_BITS: usize = 16;

/// What each bit of a reversed index, from the highest, adds to dimensions 1 to 3. Dimension 0 is the index,
/// with its bits in the order that they have in the others.
static VECTORS: LazyLock<[[u32; 3]; INDEX_BITS]> = LazyLock::new(|| {
    std::array::from_fn(|bit| std::array::from_fn(|d| sobol_rev(1 << (31 - bit), d as u32 + 1)))
});

/// The numbers of one sample of many pixels, drawn four at a time.
#[derive(Clone, Copy, Debug)]
pub struct Samplers {
    pixel_seeds: [u32; LANES],
    index: u32,
    set: u32,
    simd: Simd,
}

impl Samplers {
    /// The numbers of sample `sample` of some pixels, at most [`LANES`].
    pub fn new(seed: u64, pixels: impl Iterator<Item = [u32; 2]>, sample: u32, simd: Simd) -> Self {
        let mut pixel_seeds = [0; LANES];
        for (of_pixel, [x, y]) in pixel_seeds.iter_mut().zip(pixels) {
            *of_pixel = Sampler::new(seed, x, y, sample).pixel_seed();
        }
        Self { pixel_seeds, index: Sampler::new(seed, 0, 0, sample).index(), set: 0, simd }
    }

    /// Keeps only some paths, in this order.
    pub fn keep(&mut self, paths: &[u8]) {
        let all = self.pixel_seeds;
        for (seed, &path) in self.pixel_seeds.iter_mut().zip(paths) {
            *seed = all[path as usize];
        }
    }

    /// The next four numbers of the first `count` paths: those that [`Sampler::next_four`] would give each.
    pub fn next_four(&mut self, count: usize, numbers: &mut Numbers) {
        let kernel = Sobol {
            seeds: &self.pixel_seeds[..count.next_multiple_of(16)],
            set: Sampler::set_offset(self.set),
            index: self.index.reverse_bits(),
            vectors: &VECTORS,
            numbers,
        };
        self.set += 1;
        self.simd.run(kernel);
    }
}

struct Sobol<'a> {
    seeds: &'a [u32],
    set: u32,
    index: u32,
    vectors: &'a [[u32; 3]; INDEX_BITS],
    numbers: &'a mut Numbers,
}

impl Kernel for Sobol<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self { seeds, set, index, vectors, numbers: [first, second, third, fourth] } = self;
        let seeds = &seeds[..seeds.len().min(LANES)];
        for i in 0..seeds.len() {
            let seed = Sampler::set_seed(seeds[i].wrapping_add(set));
            let shuffled = owen_scramble_rev(index, hash(seed ^ 0x79c6_8e4a));
            let scramble = seed.wrapping_mul(0x9c8f_2d3b);
            let mut sobol = [0_u32; 3];
            for (bit, vector) in vectors.iter().enumerate() {
                // All ones where the bit is set.
                let mask = ((shuffled << bit) as i32 >> 31) as u32;
                sobol[0] ^= mask & vector[0];
                sobol[1] ^= mask & vector[1];
                sobol[2] ^= mask & vector[2];
            }
            let number = |value: u32, salt: u32| {
                u32_to_f32_norm(owen_scramble_rev(value, hash(scramble ^ salt)).reverse_bits())
            };
            first[i] = number((shuffled & 0xffff_0000).reverse_bits(), 0x912f_69ba);
            second[i] = number(sobol[0], 0x174f_18ab);
            third[i] = number(sobol[1], 0x691e_72ca);
            fourth[i] = number(sobol[2], 0xb40c_c1b8);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_side_by_side_have_the_numbers_that_each_would_have_alone() {
        for simd in [Simd::Baseline, Simd::Avx2, Simd::Avx512] {
            for (sample, count) in [(0, 1), (1, 64), (37, 50), (65_535, 17), (65_536 + 7, 64)] {
                let place = |path: usize| (path as u32 % 8 + 400, path as u32 / 8 + 24);
                let pixels = (0..count).map(|path| place(path).into());
                let mut samplers = Samplers::new(11, pixels, sample, simd);
                let mut numbers = [[0.0; LANES]; 4];
                samplers.next_four(count, &mut numbers);
                samplers.next_four(count, &mut numbers);
                for path in 0..count {
                    let (x, y) = place(path);
                    let mut alone = Sampler::new(11, x, y, sample);
                    alone.next_four();
                    assert_eq!(numbers.map(|of_all| of_all[path]), alone.next_four());
                }
            }
        }
    }

    #[test]
    fn paths_that_stay_keep_their_numbers() {
        let mut samplers = Samplers::new(0, (0..64).map(|x| [x, 0]), 5, Simd::detect());
        samplers.keep(&[3, 10, 63]);
        let mut numbers = [[0.0; LANES]; 4];
        samplers.next_four(3, &mut numbers);
        for (place, x) in [3, 10, 63].into_iter().enumerate() {
            assert_eq!(numbers.map(|of_all| of_all[place]), Sampler::new(0, x, 0, 5).next_four());
        }
    }
}
