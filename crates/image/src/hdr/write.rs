use super::Rgbe;
use crate::RgbImage;

/// A Radiance HDR file of the picture, run lengths in the newer scheme where the width allows it. Negative and
/// non-finite values become zero, and what exceeds the format's 1.7e38 is cut: RGBE has no code for them.
pub(crate) fn encode(image: &RgbImage) -> Vec<u8> {
    let mut bytes = b"#?RADIANCE\nSOFTWARE=halflight\nFORMAT=32-bit_rle_rgbe\n\n".to_vec();
    bytes.extend(format!("-Y {} +X {}\n", image.height, image.width).into_bytes());
    if image.width == 0 {
        return bytes;
    }
    for row in image.pixels.chunks(image.width) {
        let row: Vec<Rgbe> = row.iter().map(|&pixel| to_rgbe(pixel)).collect();
        if (8..=0x7fff).contains(&row.len()) {
            bytes.extend([2, 2, (row.len() >> 8) as u8, row.len() as u8]);
            for channel in 0..4 {
                let values: Vec<u8> = row.iter().map(|pixel| pixel[channel]).collect();
                run_lengths(&values, &mut bytes);
            }
        } else {
            // Flat pixels; none can be taken for a run, because a largest mantissa is never below 128.
            bytes.extend(row.as_flattened());
        }
    }
    bytes
}

/// Rounds to the nearest step of the shared exponent.
fn to_rgbe(pixel: [f32; 3]) -> Rgbe {
    let pixel = pixel.map(|v| if v.is_finite() { f64::from(v.max(0.0)) } else { 0.0 });
    let largest = pixel.into_iter().fold(0.0, f64::max);
    if largest < 2.0_f64.powi(-128) {
        return [0; 4];
    }
    // 2^(e−1) ≤ largest < 2^e, with one step up where rounding would reach 256.
    let mut exponent = largest.log2().floor() as i32 + 1;
    let mantissa = |value: f64, exponent: i32| (value * (8.0 - f64::from(exponent)).exp2()).round();
    if mantissa(largest, exponent) > 255.0 {
        exponent += 1;
    }
    let [r, g, b] = pixel.map(|v| mantissa(v, exponent.min(127)).min(255.0) as u8);
    [r, g, b, (exponent.min(127) + 128) as u8]
}

/// Runs of at least four are worth a code of their own; the rest goes in literals of up to 128.
fn run_lengths(values: &[u8], out: &mut Vec<u8>) {
    let run_at = |start: usize| values[start..].iter().take(127).take_while(|&&v| v == values[start]).count();
    let mut x = 0;
    while x < values.len() {
        let run = run_at(x);
        if run >= 4 {
            out.extend([128 + run as u8, values[x]]);
            x += run;
            continue;
        }
        let start = x;
        while x < values.len() && x - start < 128 && run_at(x) < 4 {
            x += 1;
        }
        out.push((x - start) as u8);
        out.extend(&values[start..x]);
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use proptest::prelude::*;

    use super::super::{ASKED, decode};
    use super::*;
    use crate::source::Source;

    proptest! {
        #[test]
        fn what_is_written_comes_back_within_a_step(width in 1_usize..300, seed in any::<u32>()) {
            let mut state = seed;
            let mut next = || { state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453); state >> 16 };
            // Long runs and noise, over the whole range of exponents.
            let image = RgbImage::from_fn(width, 3, |_, _| {
                if next() % 4 == 0 { [0.25; 3] } else { [0; 3].map(|_| next() as f32 * ((next() % 220) as f32 - 110.0).exp2()) }
            });
            let bytes = encode(&image);
            let back = decode(&Source { bytes: &bytes, name: Path::new("t.hdr"), asked: ASKED }).expect("own file");
            for (a, b) in image.pixels.iter().zip(&back.pixels) {
                let step = a.iter().copied().fold(2.0_f32.powi(-126), f32::max) / 255.0;
                for channel in 0..3 {
                    prop_assert!((a[channel] - b[channel]).abs() <= step, "{:?} {:?}", a, b);
                }
            }
        }
    }

    #[test]
    fn values_that_rgbe_lacks_become_the_nearest_it_has() {
        assert_eq!(to_rgbe([-1.0, f32::NAN, f32::INFINITY]), [0; 4]);
        assert_eq!(to_rgbe([f32::MAX, 0.0, 0.0]), [255, 0, 0, 255]);
        assert_eq!(to_rgbe([255.9, 1.0, 0.0])[3], 128 + 9);
    }
}
