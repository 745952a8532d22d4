//! The convolutions of a map with Phong lobes in one table, looked up for many directions at once.
//!
//! Level k ≥ 1 is the map convolved with a lobe of exponent 2^(11 − k), as an octahedron of about 0.4 standard deviations of
//! the lobe per texel; level 0 is the map itself, as finely as lobes of exponents up to 2^14 tell (for sharper ones the map is asked). A
//! look-up between two levels takes one of them, by a share
//! that its place in the run of samples decides: the mean over a run is as if both were taken, at half of the cost. The
//! logarithm of the exponent is the straight line between powers of two.
//!
//! Source: `[001]` §4.3. Cost: 6 ns a direction, 86 ns when each was looked up by itself at both levels.

#[cfg(test)]
use glam::Vec3;
use halflight_frequency::preconvolved::LEVELS;
use halflight_trace::Kernel;

use super::octahedral::Octahedral;
use super::samples::{GROUP, LANES, Reflected};

/// The exponent beyond which the map itself is asked: then the lobe, of a tenth of it at least, tells texels apart.
const SHARPEST: f32 = 131_072.0;
/// Texels along the square of level 0 at most: two within a standard deviation of the sharpest lobe that asks it.
pub(super) const FINEST: usize = 768;
/// Tables: the map itself and its convolutions.
const TABLES: usize = LEVELS + 1;

/// Three colours, each the upper half of a float: half of the memory of floats, as looking up waits for that, and a shift
/// makes a float of it. Its error is below 2^-9 of each colour, and rounded to either side alike.
type Texel = [u16; 4];

fn pack(color: [f32; 4]) -> Texel {
    color.map(|c| {
        // Below the largest there is, so that rounding does not make an infinity of it. What is no number is dark.
        let bits = if c > 0.0 { c.min(3.38e38) } else { 0.0 }.to_bits();
        // To the nearest, ties to even.
        (bits.wrapping_add(0x7fff + (bits >> 16 & 1)) >> 16) as u16
    })
}

#[inline(always)]
fn unpack(texel: &Texel) -> [f32; 4] {
    let mut color = [0.0; 4];
    for c in 0..4 {
        color[c] = f32::from_bits(u32::from(texel[c]) << 16);
    }
    color
}

/// All convolutions of one map.
pub(super) struct Convolved {
    texels: Vec<Texel>,
    /// Texels along the square of each level, without the border.
    sizes: [f32; TABLES],
    /// Where each begins.
    starts: [u32; TABLES],
}

/// How much finer or coarser than √2 a level may be taken: the share of a sample in its run, from 0 to 1.
#[inline(always)]
fn dither(i: usize) -> f32 {
    // The golden ratio, in the top bits of a word.
    ((i as u32).wrapping_mul(0x9e37_79b9) >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// The level for a lobe of this exponent: 0 for the map itself, [`LEVELS`] for the broadest lobe.
#[inline(always)]
fn level_of(exponent: f32) -> f32 {
    let octaves = exponent.max(1.0).to_bits() as i32 as f32 * (1.0 / 8_388_608.0) - 127.0;
    (LEVELS as f32 - octaves).max(0.0)
}

impl Convolved {
    /// From the levels, the map itself first, then from the sharpest on.
    pub(super) fn new(levels: &[Octahedral]) -> Self {
        let mut all = Self { texels: Vec::new(), sizes: [1.0; TABLES], starts: [0; TABLES] };
        for (k, level) in levels.iter().enumerate().take(TABLES) {
            all.sizes[k] = level.size() as f32;
            all.starts[k] = all.texels.len() as u32;
            all.texels.extend(level.texels().iter().map(|&texel| pack(texel)));
        }
        all
    }

    /// Bytes that it occupies.
    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(self.texels.as_slice())
    }

    /// Radiance from a direction at a level: one look-up of those that [`LookUp`] makes many of.
    #[cfg(test)]
    pub(super) fn at(&self, direction: Vec3, level: usize) -> Vec3 {
        let at = super::octahedral::encode(direction) * self.sizes[level] + glam::Vec2::splat(0.5);
        let (x, y) = (at.x as u32, at.y as u32);
        let side = self.sizes[level] as u32 + 2;
        let first = (self.starts[level] + y * side + x) as usize;
        let [r, g, b, _] = self.between(first, side as usize, at.x - x as f32, at.y - y as f32);
        Vec3::new(r, g, b)
    }

    /// Between a texel, the next one and those of the next row.
    #[inline(always)]
    fn between(&self, first: usize, side: usize, fx: f32, fy: f32) -> [f32; 4] {
        let (top, bottom) = (&self.texels[first..first + 2], &self.texels[first + side..first + side + 2]);
        let top = [unpack(&top[0]), unpack(&top[1])];
        let bottom = [unpack(&bottom[0]), unpack(&bottom[1])];
        // A loop, as closures are not compiled for the vector instructions at hand.
        let mut found = [0.0; 4];
        for c in 0..4 {
            let a = top[0][c] + fx * (top[1][c] - top[0][c]);
            let b = bottom[0][c] + fx * (bottom[1][c] - bottom[0][c]);
            found[c] = a + fy * (b - a);
        }
        found
    }
}

/// Looks up the light of reflected directions, given in the space of the map.
pub(super) struct LookUp<'a> {
    pub(super) table: &'a Convolved,
    pub(super) reflected: &'a Reflected,
    pub(super) number: usize,
    /// Where in the run the first of them is.
    pub(super) place: usize,
    /// Radiance.
    pub(super) light: &'a mut [[f32; 4]; LANES],
    /// Which of them the map itself knows better.
    pub(super) sharp: &'a mut [bool; LANES],
}

impl Kernel for LookUp<'_> {
    /// Whether any is to be looked up in the map itself.
    type Output = bool;
    #[inline(always)]
    fn run(self) -> bool {
        let Self { table, reflected, number, place, light, sharp } = self;
        let lanes = number.next_multiple_of(GROUP).min(LANES);
        let mut levels = [0u32; LANES];
        let (mut us, mut vs) = ([0.0f32; LANES], [0.0f32; LANES]);
        for i in 0..lanes {
            levels[i] = (level_of(reflected.exponent[i]) + dither(place + i)) as i32 as u32;
            let (x, y, z) = (reflected.x[i], reflected.y[i], reflected.z[i]);
            let scale = 1.0 / (x.abs() + y.abs() + z.abs());
            let (px, pz) = (x * scale, z * scale);
            let (fx, fz) = ((1.0 - pz.abs()).copysign(px), (1.0 - px.abs()).copysign(pz));
            us[i] = 0.5 * if y < 0.0 { fx } else { px } + 0.5;
            vs[i] = 0.5 * if y < 0.0 { fz } else { pz } + 0.5;
        }
        let mut any = false;
        for i in 0..number {
            let level = levels[i].min(LEVELS as u32) as usize;
            sharp[i] = reflected.exponent[i] > SHARPEST;
            any |= sharp[i];
            let size = table.sizes[level];
            let (u, v) = (us[i] * size + 0.5, vs[i] * size + 0.5);
            // Converting saturates: a direction of NaN is that of the first texel.
            let (x, y) = ((u as i32).clamp(0, size as i32), (v as i32).clamp(0, size as i32));
            let side = size as i32 + 2;
            let first = table.starts[level] as usize + (y * side + x) as usize;
            light[i] = table.between(first, side as usize, u - x as f32, v - y as f32);
        }
        any
    }
}

#[cfg(test)]
mod tests {
    use halflight_trace::Simd;

    use super::*;

    #[test]
    fn a_packed_colour_is_itself_to_a_part_in_five_hundred() {
        for color in
            [[1.0, 0.5, 0.25, 0.0], [3e4, 1e-3, 7.1, 0.0], [1e-30, 2e-31, 0.0, 0.0], [0.0; 4], [3e38; 4]]
        {
            let found = unpack(&pack(color));
            for c in 0..3 {
                assert!(
                    (found[c] - color[c]).abs() <= color[c] / 256.0 && found[c].is_finite(),
                    "{color:?} {found:?}"
                );
            }
        }
        assert_eq!(unpack(&pack([f32::NAN, 1.0, f32::INFINITY, -1.0]))[1], 1.0);
        // What is rounded is as often too much as too little.
        let values = (0..4096).map(|i| 1.0 + i as f32 / 4096.0);
        let mean: f32 = values.map(|v| unpack(&pack([v; 4]))[0] / v - 1.0).sum::<f32>() / 4096.0;
        assert!(mean.abs() < 1e-4, "{mean}");
    }

    #[test]
    fn many_directions_are_looked_up_as_each_by_itself_at_the_levels_around_its_exponent() {
        let levels: Vec<Octahedral> = (0..=LEVELS)
            .map(|k| Octahedral::new(8 * k + 8, |d| [d.x + 2.0 + k as f32, d.y * d.y, 0.5 + 0.5 * d.z, 0.0]))
            .collect();
        let table = Convolved::new(&levels);
        let mut reflected = Reflected::default();
        for i in 0..LANES {
            let y = 1.0 - 2.0 * (i as f32 + 0.5) / LANES as f32;
            let (sin, cos) = (i as f32 * 2.399_963).sin_cos();
            let r = (1.0 - y * y).sqrt();
            (reflected.x[i], reflected.y[i], reflected.z[i]) = (r * cos, y, r * sin);
            reflected.exponent[i] = (20.0 * i as f32 / LANES as f32).exp2();
        }
        for simd in [Simd::Baseline, Simd::Avx2, Simd::Avx512] {
            let (mut light, mut sharp) = ([[0.0; 4]; LANES], [false; LANES]);
            for place in [0, 64, 128] {
                let number = 51;
                let (light, sharp) = (&mut light, &mut sharp);
                simd.run(LookUp { table: &table, reflected: &reflected, number, place, light, sharp });
                for i in 0..number {
                    let d = Vec3::new(reflected.x[i], reflected.y[i], reflected.z[i]);
                    let exact = (LEVELS as f32 - reflected.exponent[i].log2()).max(0.0);
                    assert_eq!(sharp[i], reflected.exponent[i] > SHARPEST);
                    let near: Vec<usize> = (0..=LEVELS).filter(|&k| (k as f32 - exact).abs() < 1.1).collect();
                    let found = Vec3::new(light[i][0], light[i][1], light[i][2]);
                    let fits = near.iter().any(|&k| table.at(d, k).distance(found) < 1e-5);
                    assert!(fits, "{simd:?} {i}: {exact} {found}");
                }
            }
        }
    }
}
