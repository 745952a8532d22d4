//! A scrambled (0, 2)-sequence: van der Corput's and Sobol's second dimension, digits of both flipped by a random word.
//! Every aligned block of 2^m points has one point in each of the 2^m boxes of every shape.

use glam::Vec2;

/// Point `index` of the sequence that `seed` scrambles, in [0, 1)².
#[must_use]
pub fn point(index: u32, seed: u32) -> Vec2 {
    let mut second = 0;
    let mut direction = 1u32 << 31;
    let mut digits = index;
    while digits != 0 {
        if digits & 1 == 1 {
            second ^= direction;
        }
        direction ^= direction >> 1;
        digits >>= 1;
    }
    let unit = |bits: u32| (bits >> 8) as f32 * (1.0 / 16_777_216.0);
    Vec2::new(unit(index.reverse_bits() ^ mix(2 * seed)), unit(second ^ mix(2 * seed + 1)))
}

/// A word that looks random (the finalizer of MurmurHash3).
fn mix(mut x: u32) -> u32 {
    x = x.wrapping_add(0x9e37_79b9);
    x = (x ^ (x >> 16)).wrapping_mul(0x85eb_ca6b);
    x = (x ^ (x >> 13)).wrapping_mul(0xc2b2_ae35);
    x ^ (x >> 16)
}
