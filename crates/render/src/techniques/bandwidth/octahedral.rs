//! Maps of the sphere that are looked up without an arc: the octahedron, unfolded to a square.
//!
//! (x, y, z)/(|x| + |y| + |z|), seen along +y; the lower half folded out over the corners. Source: Praun & Hoppe 2003,
//! "Spherical parametrization and remeshing". Tables have a border of one texel that goes on around the fold, so that
//! bilinear look-ups need no case for it. Cost of a look-up: 4 to 8 ns from the cache.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

/// Where a direction (of any length > 0) lies in [0, 1]².
#[inline(always)]
pub(super) fn encode(d: Vec3) -> Vec2 {
    let scale = 1.0 / (d.x.abs() + d.y.abs() + d.z.abs());
    let (x, z) = (d.x * scale, d.z * scale);
    let folded = Vec2::new((1.0 - z.abs()).copysign(x), (1.0 - x.abs()).copysign(z));
    let at = if d.y < 0.0 { folded } else { Vec2::new(x, z) };
    0.5 * at + Vec2::splat(0.5)
}

/// The unit direction of a place, also of one just outside of the square.
pub(super) fn decode(at: Vec2) -> Vec3 {
    let mut p = 2.0 * at - Vec2::ONE;
    // Beyond an edge of the square lies what is inside, turned about the middle of the edge.
    if p.x.abs() > 1.0 {
        p = Vec2::new((2.0 - p.x.abs()).copysign(p.x), -p.y);
    }
    if p.y.abs() > 1.0 {
        p = Vec2::new(-p.x, (2.0 - p.y.abs()).copysign(p.y));
    }
    let y = 1.0 - p.x.abs() - p.y.abs();
    let (x, z) =
        if y < 0.0 { ((1.0 - p.y.abs()).copysign(p.x), (1.0 - p.x.abs()).copysign(p.y)) } else { (p.x, p.y) };
    Vec3::new(x, y, z).normalize_or(Vec3::Y)
}

/// A table of four numbers for every direction.
#[derive(Clone, Debug)]
pub(super) struct Octahedral {
    /// Texels along the square, without the border.
    size: usize,
    texels: Vec<[f32; 4]>,
}

impl Octahedral {
    /// From a function of directions, at the middles of texels.
    pub(super) fn new(size: usize, f: impl Fn(Vec3) -> [f32; 4] + Sync) -> Self {
        let side = size + 2;
        let mut texels = vec![[0.0; 4]; side * side];
        texels.par_chunks_mut(side).enumerate().for_each(|(row, texels)| {
            for (column, texel) in texels.iter_mut().enumerate() {
                let at = (Vec2::new(column as f32, row as f32) - Vec2::splat(0.5)) / size as f32;
                *texel = f(decode(at));
            }
        });
        Self { size, texels }
    }

    /// Between the four texels around a direction.
    #[cfg(test)]
    #[inline(always)]
    pub(super) fn between(&self, direction: Vec3) -> [f32; 4] {
        let at = encode(direction) * self.size as f32 + Vec2::splat(0.5);
        let side = self.size + 2;
        // Converting saturates: a direction of NaN is that of the first texel.
        let (x, y) = ((at.x as usize).min(side - 2), (at.y as usize).min(side - 2));
        let (fx, fy) = (at.x - x as f32, at.y - y as f32);
        let top = &self.texels[y * side + x..y * side + x + 2];
        let bottom = &self.texels[(y + 1) * side + x..(y + 1) * side + x + 2];
        std::array::from_fn(|c| {
            let (a, b) =
                (top[0][c] + fx * (top[1][c] - top[0][c]), bottom[0][c] + fx * (bottom[1][c] - bottom[0][c]));
            a + fy * (b - a)
        })
    }

    /// The texel that a direction falls in.
    #[inline(always)]
    pub(super) fn nearest(&self, direction: Vec3) -> [f32; 4] {
        let at = encode(direction) * self.size as f32;
        let last = self.size - 1;
        let (x, y) = ((at.x as usize).min(last), (at.y as usize).min(last));
        self.texels[(y + 1) * (self.size + 2) + x + 1]
    }

    /// All texels with the border, rows of [`Self::size`] + 2.
    pub(super) fn texels(&self) -> &[[f32; 4]] {
        &self.texels
    }

    /// Texels along the square.
    pub(super) fn size(&self) -> usize {
        self.size
    }

    /// Bytes that it occupies.
    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(self.texels.as_slice())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_direction_is_found_again_and_a_smooth_function_is_smooth_over_every_edge() {
        let table = Octahedral::new(64, |d| [d.x, d.y, d.z, 1.0]);
        let spiral = (0..2000).map(|i| {
            let y = 1.0 - 2.0 * (i as f32 + 0.5) / 2000.0;
            let (sin, cos) = (i as f32 * 2.399_963).sin_cos();
            let r = (1.0 - y * y).sqrt();
            Vec3::new(r * cos, y, r * sin)
        });
        let axes = [Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z, Vec3::Y, Vec3::NEG_Y];
        for d in spiral.chain(axes).chain([Vec3::new(0.6, -0.001, 0.8), Vec3::new(0.6, 0.001, -0.8)]) {
            let d = d.normalize();
            assert!(decode(encode(d)).distance(d) < 1e-4, "{d}");
            let [x, y, z, one] = table.between(d);
            assert!(Vec3::new(x, y, z).distance(d) < 2e-2 && (one - 1.0).abs() < 1e-6, "{d}: {x} {y} {z}");
        }
    }
}
