//! What something was made of, as a number: what is kept in files between runs is known by it.

use std::fmt;

use glam::Vec3;

/// The number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Key([u64; 2]);

impl Key {
    /// Both halves of it.
    pub(crate) fn words(self) -> [u64; 2] {
        self.0
    }
}

impl fmt::Display for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:016x}{:016x}", self.0[0], self.0[1])
    }
}

/// Two chains of multiplications and shifts, each after the finaliser of splitmix64 (Steele, Lea & Flood 2014): against
/// accident, not against malice.
pub(crate) struct Hasher([u64; 2]);

impl Default for Hasher {
    fn default() -> Self {
        Self([0x243f_6a88_85a3_08d3, 0x1319_8a2e_0370_7344])
    }
}

fn mixed(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

impl Hasher {
    pub(crate) fn add(&mut self, word: u64) {
        let [a, b] = self.0;
        self.0 = [mixed(a ^ word), mixed(b.rotate_left(23).wrapping_add(word))];
    }

    pub(crate) fn bytes(&mut self, bytes: &[u8]) {
        self.add(bytes.len() as u64);
        for chunk in bytes.chunks(8) {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            self.add(u64::from_le_bytes(word));
        }
    }

    pub(crate) fn floats(&mut self, floats: &[f32]) {
        self.add(floats.len() as u64);
        floats.iter().for_each(|x| self.add(u64::from(x.to_bits())));
    }

    pub(crate) fn vectors(&mut self, vectors: &[Vec3]) {
        self.add(vectors.len() as u64);
        vectors.iter().for_each(|v| self.floats(&v.to_array()));
    }

    pub(crate) fn key(&self) -> Key {
        Key(self.0)
    }
}
