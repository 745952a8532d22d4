//! The texels of a map in eight bytes each, interpolated bilinearly: two thirds of the memory of three floats, and
//! looking a direction up in a map that the cache does not hold costs as many lines as it touches.
//!
//! A texel is three 18-bit fractions of a common power of two, so its error is below 4e-6 of its brightest channel:
//! less than the half floats or the shared exponents that maps are stored with.

use glam::{Vec2, Vec3};
use halflight_image::RgbImage;
use rayon::prelude::*;

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
        let ([x0, x1], [row0, row1], f) = self.corners(uv);
        let texel = |i: usize| unpack(self.packed[i]);
        let top = texel(row0 + x0).lerp(texel(row0 + x1), f.x);
        top.lerp(texel(row1 + x0).lerp(texel(row1 + x1), f.x), f.y)
    }

    /// Begins to bring what [`Self::interpolated`] will read into the cache.
    #[inline]
    pub(super) fn prefetch(&self, uv: Vec2) {
        let ([x0, _], rows, _) = self.corners(uv);
        // The neighbour across is in the same line seven times of eight.
        for row in rows {
            prefetch(&self.packed, row + x0);
        }
    }

    /// The two columns, the starts of the two rows, and how far the place lies towards the second of each.
    #[inline]
    fn corners(&self, uv: Vec2) -> ([usize; 2], [usize; 2], Vec2) {
        let (width, height) = (self.width as i32, self.height as i32);
        // Half a texel is added instead of subtracted, so that truncation rounds down.
        let (x, y) = (uv.x * width as f32 + 0.5, uv.y * height as f32 + 0.5);
        let (x_whole, y_whole) = (x as i32, y as i32);
        let x0 = if x_whole == 0 { width - 1 } else { (x_whole - 1).min(width - 1) };
        let x1 = if x_whole >= width { 0 } else { x_whole };
        let row = |y: i32| y.clamp(0, height - 1) as usize * self.width;
        let fraction = Vec2::new(x - x_whole as f32, y - y_whole as f32);
        ([x0 as usize, x1 as usize], [row(y_whole - 1), row(y_whole)], fraction)
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

#[inline]
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
