//! Random numbers: every one derives from (seed, pixel, sample, set), so that no number depends on the order of work.
//!
//! A *set* is four dimensions of an Owen-scrambled Sobol' sequence over the samples of a pixel (Burley 2020, by the
//! crate `sobol_burley`); sets and pixels are decorrelated by their seeds ("padding"). Within a set the pairs (0, 1)
//! and (2, 3) are stratified best, so a two-dimensional choice takes one of them.

/// The crate's sequences end here; longer ones go on with another seed.
const SEQUENCE_LENGTH: u32 = 1 << 16;

/// The numbers of one sample of one pixel, drawn four at a time.
#[derive(Clone, Copy, Debug)]
pub struct Sampler {
    pixel_seed: u32,
    index: u32,
    set: u32,
}

impl Sampler {
    /// The numbers of sample `sample` of pixel (x, y).
    pub fn new(seed: u64, x: u32, y: u32, sample: u32) -> Self {
        let seed = hash(seed as u32 ^ hash((seed >> 32) as u32));
        let block = sample / SEQUENCE_LENGTH;
        let pixel_seed = hash(x ^ hash(y ^ hash(block.wrapping_add(seed))));
        Self { pixel_seed, index: sample % SEQUENCE_LENGTH, set: 0 }
    }

    /// The next four numbers, each in [0, 1).
    #[inline]
    pub fn next_four(&mut self) -> [f32; 4] {
        let seed = Self::set_seed(self.pixel_seed.wrapping_add(Self::set_offset(self.set)));
        self.set += 1;
        sobol_burley::sample_4d(self.index, 0, seed)
    }

    /// What a set adds to the seed of a pixel.
    #[inline(always)]
    pub(crate) fn set_offset(set: u32) -> u32 {
        set.wrapping_mul(0x9E37_79B9)
    }

    /// The seed of a sequence, from the sum of a pixel's and a set's.
    #[inline(always)]
    pub(crate) fn set_seed(sum: u32) -> u32 {
        hash(sum)
    }

    pub(crate) fn pixel_seed(&self) -> u32 {
        self.pixel_seed
    }

    pub(crate) fn index(&self) -> u32 {
        self.index
    }
}

/// A permutation of the 32-bit numbers without visible structure (Wellons' `lowbias32`).
#[inline(always)]
fn hash(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7FEB_352D);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846C_A68B);
    x ^ (x >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_run_of_sixteen_samples_puts_one_in_each_cell_of_a_four_by_four_grid() {
        for (x, y) in [(0, 0), (1, 0), (0, 1), (511, 300)] {
            for first in [0, 16, 32] {
                let mut cells = [0; 16];
                for sample in first..first + 16 {
                    let mut sampler = Sampler::new(7, x, y, sample);
                    sampler.next_four();
                    let u = sampler.next_four();
                    cells[(u[0] * 4.0) as usize * 4 + (u[1] * 4.0) as usize] += 1;
                }
                assert_eq!(cells, [1; 16]);
            }
        }
    }

    #[test]
    fn pixels_sets_and_seeds_are_decorrelated() {
        let number = |seed, x, y, sample, skip: u32| {
            let mut sampler = Sampler::new(seed, x, y, sample);
            (0..skip).for_each(|_| {
                sampler.next_four();
            });
            f64::from(sampler.next_four()[0]) - 0.5
        };
        let n = 4096;
        let correlation = |other: &dyn Fn(u32) -> f64| {
            (0..n).map(|s| number(1, 5, 9, s, 0) * other(s)).sum::<f64>() / f64::from(n) * 12.0
        };
        assert!(correlation(&|s| number(1, 6, 9, s, 0)).abs() < 0.08);
        assert!(correlation(&|s| number(1, 5, 10, s, 0)).abs() < 0.08);
        assert!(correlation(&|s| number(2, 5, 9, s, 0)).abs() < 0.08);
        assert!(correlation(&|s| number(1, 5, 9, s, 1)).abs() < 0.08);
    }

    #[test]
    fn a_sequence_goes_on_past_the_length_of_the_table() {
        let mut sampler = Sampler::new(0, 0, 0, SEQUENCE_LENGTH + 3);
        assert!(sampler.next_four().iter().all(|u| (0.0..1.0).contains(u)));
    }
}
