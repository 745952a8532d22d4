//! Which vertices stand at the same place.
//!
//! Files split vertices where texture coordinates or normals jump. What concerns the surface itself (smooth
//! normals, displacement without cracks) needs them joined again. Two vertices are one place when their
//! positions are equal; 0 and −0 are equal. One hash look-up a vertex.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use super::TriangleMesh;

/// A hash of one or a few 64-bit words by multiplication with 2⁶⁴/φ (Knuth, TAOCP vol. 3, §6.4): the keys are
/// made by this program's own meshes, and the maps are short-lived.
#[derive(Default)]
pub(super) struct WordHasher(u64);

impl Hasher for WordHasher {
    fn finish(&self) -> u64 {
        // The high bits are the well-mixed ones; the map takes its bucket from the low ones.
        self.0 ^ (self.0 >> 29)
    }

    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.write_u64(u64::from(byte));
        }
    }

    fn write_u64(&mut self, word: u64) {
        self.0 = (self.0.rotate_left(23) ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }

    fn write_u32(&mut self, word: u32) {
        self.write_u64(u64::from(word));
    }
}

/// A map keyed by words.
pub(super) type WordMap<K, V> = HashMap<K, V, BuildHasherDefault<WordHasher>>;

impl TriangleMesh {
    /// For each vertex the first vertex that stands at the same place (itself, if it is the first).
    pub(crate) fn places(&self) -> Vec<u32> {
        let mut first = WordMap::with_capacity_and_hasher(self.positions.len(), Default::default());
        let place = |(vertex, position): (usize, &glam::Vec3)| {
            // Adding zero turns −0 into 0.
            let [x, y, z] = (*position + glam::Vec3::ZERO).to_array().map(f32::to_bits);
            *first.entry((u64::from(x) << 32 | u64::from(y), z)).or_insert(vertex as u32)
        };
        self.positions.iter().enumerate().map(place).collect()
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::super::samples::octahedron;

    #[test]
    fn equal_positions_are_one_place() {
        let mut mesh = octahedron();
        mesh.positions.extend([Vec3::new(1.0, -0.0, 0.0), Vec3::new(1.0, 1e-7, 0.0)]);
        assert_eq!(mesh.places(), [0, 1, 2, 3, 4, 5, 0, 7]);
    }
}
