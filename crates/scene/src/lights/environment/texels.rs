//! The texels of a map in eight bytes each, interpolated bilinearly: two thirds of the memory of three floats, and
//! looking a direction up in a map that the cache does not hold costs as many lines as it touches.
//!
//! A texel is three 18-bit fractions of a common power of two, so its error is below 4e-6 of its brightest channel:
//! less than the half floats or the shared exponents that maps are stored with.

use glam::{Vec2, Vec3};
use halflight_image::RgbImage;
use halflight_trace::{Kernel, Simd};
use rayon::prelude::*;

use super::many::MANY;
use super::prefetch::prefetch;

const FRACTION_BITS: u32 = 18;
const FRACTION_MASK: u64 = (1 << FRACTION_BITS) - 1;
/// Powers of two are stored with this added. Dimmer texels than 2⁻¹⁰⁰ are black.
const EXPONENT_BIAS: i32 = 100;

/// A map of non-negative radiance, rows from the top, periodic across.
#[derive(Debug)]
pub(super) struct Texels {
    pub(super) width: usize,
    pub(super) height: usize,
    packed: Vec<u64>,
}

impl Texels {
    pub(super) fn new(image: &RgbImage) -> Self {
        let packed = image.pixels.par_iter().map(|&pixel| pack(pixel)).collect();
        Self { width: image.width, height: image.height, packed }
    }

    pub(super) fn texel(&self, x: usize, y: usize) -> Vec3 {
        unpack(self.packed[y * self.width + x])
    }

    /// The map at texture coordinates in [0, 1), texel centres at (i + ½)/width, (j + ½)/height.
    #[inline]
    pub(super) fn interpolated(&self, uv: Vec2) -> Vec3 {
        let corners = self.corners(uv);
        blend(self.texels_at(&corners), corners.fraction)
    }

    /// [`Self::interpolated`] for many places.
    pub(super) fn interpolated_many(
        &self,
        simd: Simd,
        places: &[Vec2; MANY],
        count: usize,
        out: &mut [Vec3; MANY],
    ) {
        let mut corners = [Corners::default(); MANY];
        simd.run(Cornering { texels: self, places, corners: &mut corners });
        let mut packed = [[0; MANY]; 4];
        for (i, corners) in corners[..count].iter().enumerate() {
            let texels = self.texels_at(corners);
            for corner in 0..4 {
                packed[corner][i] = texels[corner];
            }
        }
        simd.run(Blending { packed: &packed, corners: &corners, out });
    }

    /// Begins to bring what [`Self::interpolated`] will read into the cache.
    #[inline]
    pub(super) fn prefetch(&self, uv: Vec2) {
        let Corners { columns, rows, .. } = self.corners(uv);
        // The neighbour across is in the same line seven times of eight.
        for row in rows {
            prefetch(&self.packed, row as usize * self.width + columns[0] as usize);
        }
    }

    /// The texels of the first row, then those of the second.
    #[inline]
    fn texels_at(&self, corners: &Corners) -> [u64; 4] {
        let Corners { columns: [x0, x1], rows, .. } = *corners;
        let [top, bottom] = rows.map(|row| &self.packed[row as usize * self.width..][..self.width]);
        [top[x0 as usize], top[x1 as usize], bottom[x0 as usize], bottom[x1 as usize]]
    }

    #[inline(always)]
    fn corners(&self, uv: Vec2) -> Corners {
        let (width, height) = (self.width as i32, self.height as i32);
        // Half a texel is added instead of subtracted, so that truncation rounds down.
        let (x, y) = (uv.x * width as f32 + 0.5, uv.y * height as f32 + 0.5);
        let (x_whole, y_whole) = (x as i32, y as i32);
        let x0 = if x_whole == 0 { width - 1 } else { (x_whole - 1).min(width - 1) };
        let x1 = if x_whole >= width { 0 } else { x_whole };
        let row = |y: i32| y.clamp(0, height - 1) as u32;
        let fraction = Vec2::new(x - x_whole as f32, y - y_whole as f32);
        Corners { columns: [x0 as u32, x1 as u32], rows: [row(y_whole - 1), row(y_whole)], fraction }
    }
}

/// The texels around a place.
#[derive(Clone, Copy, Debug, Default)]
struct Corners {
    columns: [u32; 2],
    rows: [u32; 2],
    /// How far the place lies towards the second of each.
    fraction: Vec2,
}

/// The mean of four texels, two rows of two, by how near each is.
#[inline(always)]
fn blend(packed: [u64; 4], f: Vec2) -> Vec3 {
    let [a, b, c, d] = [unpack(packed[0]), unpack(packed[1]), unpack(packed[2]), unpack(packed[3])];
    let (across, down) = (Vec2::new(1.0 - f.x, f.x), Vec2::new(1.0 - f.y, f.y));
    (a * across.x + b * across.y) * down.x + (c * across.x + d * across.y) * down.y
}

struct Cornering<'a> {
    texels: &'a Texels,
    places: &'a [Vec2; MANY],
    corners: &'a mut [Corners; MANY],
}

impl Kernel for Cornering<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        for i in 0..MANY {
            self.corners[i] = self.texels.corners(self.places[i]);
        }
    }
}

struct Blending<'a> {
    packed: &'a [[u64; MANY]; 4],
    corners: &'a [Corners; MANY],
    out: &'a mut [Vec3; MANY],
}

impl Kernel for Blending<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let [a, b, c, d] = self.packed;
        for i in 0..MANY {
            self.out[i] = blend([a[i], b[i], c[i], d[i]], self.corners[i].fraction);
        }
    }
}

fn pack(pixel: [f32; 3]) -> u64 {
    let pixel = pixel.map(|c| if c > 0.0 { c } else { 0.0 });
    let largest = pixel.iter().fold(0.0f32, |a, &b| a.max(b));
    if largest < f32::MIN_POSITIVE {
        return 0;
    }
    // The least power of two above the largest channel, from the bits of the float.
    let exponent = (largest.to_bits() >> 23) as i32 - 126;
    if exponent < -EXPONENT_BIAS {
        return 0;
    }
    let scale = f64::from(FRACTION_BITS as i32 - exponent).exp2();
    let fraction = |c: f32| ((f64::from(c) * scale).round() as u64).min(FRACTION_MASK);
    let [r, g, b] = pixel.map(fraction);
    r | g << FRACTION_BITS
        | b << (2 * FRACTION_BITS)
        | ((exponent + EXPONENT_BIAS) as u64) << (3 * FRACTION_BITS)
}

#[inline(always)]
fn unpack(packed: u64) -> Vec3 {
    let exponent = (packed >> (3 * FRACTION_BITS)) as i32 - EXPONENT_BIAS - FRACTION_BITS as i32;
    // 2^exponent: the least is −118, above the subnormals.
    let scale = f32::from_bits(((exponent + 127) as u32) << 23);
    let fraction = |shift: u32| ((packed >> shift) & FRACTION_MASK) as i32 as f32;
    Vec3::new(fraction(0), fraction(FRACTION_BITS), fraction(2 * FRACTION_BITS)) * scale
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_packed_texel_is_within_four_millionths_of_its_brightest_channel() {
        for scale in [1e-28, 1e-9, 0.3, 1.0, 1.999_999_9, 65_504.0, 1e9, 3e38f32] {
            for pixel in [[1.0, 0.5, 0.25], [0.0, 1.0, 1e-7], [0.999_999_94, 0.7, 0.1], [0.0, 0.0, 1.0]] {
                let pixel = pixel.map(|c: f32| c * scale);
                let error = unpack(pack(pixel)) - Vec3::from(pixel);
                assert!(
                    error.abs().max_element() <= 4e-6 * pixel.iter().fold(0.0, |a: f32, &b| a.max(b)),
                    "{pixel:?}"
                );
            }
        }
        assert_eq!(unpack(pack([0.0, -1.0, f32::NAN])), Vec3::ZERO);
        assert_eq!(unpack(pack([1e-40, 0.0, 0.0])), Vec3::ZERO);
    }

    #[test]
    fn interpolation_wraps_across_and_stops_at_the_poles() {
        let image = RgbImage::from_fn(4, 2, |x, y| [(x + 10 * y) as f32, 0.0, 0.0]);
        let texels = Texels::new(&image);
        let at = |x: f32, y: f32| texels.interpolated(Vec2::new(x / 4.0, y / 2.0)).x;
        assert_eq!(at(0.5, 0.5), 0.0);
        assert_eq!(at(1.0, 0.5), 0.5);
        assert_eq!(at(0.0, 0.5), 1.5);
        assert_eq!(at(3.999_999_8, 0.5), 1.5);
        assert_eq!(at(2.5, 0.0), 2.0);
        assert_eq!(at(2.5, 1.0), 7.0);
        assert_eq!(at(2.5, 1.999_999_9), 12.0);
    }
}
