//! Colours for values, in tables of 256.
//!
//! Equal steps of value are equal steps to the eye. Magma (as FLIP is shown by its authors) and viridis are by
//! Stéfan van der Walt and Nathaniel Smith, CC0, kept here as 33 knots (within 2/255 of the full tables). The
//! diverging one is made in Oklab: lightness rises evenly from a dark middle, towards blue below and orange
//! above, which no common kind of colour blindness confuses.

/// 256 colours, for the lowest value to the highest.
pub type Table = Vec<[u8; 3]>;

const MAGMA: [u32; 33] = [
    0x000004, 0x030311, 0x0a0822, 0x130d33, 0x1d1146, 0x28115a, 0x36106a, 0x430f76, 0x50127c, 0x5d177f,
    0x691c81, 0x762181, 0x822681, 0x8f2a81, 0x9c2e7f, 0xa9327d, 0xb63779, 0xc33b75, 0xcf4170, 0xdb486a,
    0xe65163, 0xee5c5e, 0xf5695c, 0xf9785d, 0xfb8761, 0xfd9668, 0xfea571, 0xfeb47b, 0xfec387, 0xfed194,
    0xfde0a2, 0xfceeb0, 0xfcfdbf,
];

const VIRIDIS: [u32; 33] = [
    0x440154, 0x470d60, 0x48186a, 0x482374, 0x472d7b, 0x453681, 0x424086, 0x3f4989, 0x3b528b, 0x375a8d,
    0x33638d, 0x2f6a8e, 0x2c728e, 0x297a8e, 0x26818e, 0x23898e, 0x21908c, 0x1f988b, 0x1f9f88, 0x21a685,
    0x28ae80, 0x31b57b, 0x3ebc74, 0x4cc26c, 0x5dc963, 0x6ece58, 0x82d34c, 0x96d83f, 0xabdc32, 0xc0df24,
    0xd5e21a, 0xeae51a, 0xfde725,
];

/// Shown where there is no value; in none of the tables.
pub const NO_VALUE: [u8; 3] = [0x00, 0xff, 0x66];

/// From black over purple to light yellow, for errors.
pub fn magma() -> Table {
    between(&MAGMA)
}

/// From dark purple over green to yellow, for quantities.
pub fn viridis() -> Table {
    between(&VIRIDIS)
}

/// Blue below, dark in the middle, orange above.
pub fn diverging() -> Table {
    const HUE_DEGREES: [f32; 2] = [245.0, 62.0];
    (0..256)
        .map(|i| {
            // No entry stands for exactly zero in a table of even length; the two next to it are alike.
            let t = (i as f32 - 127.5) / 127.5;
            let hue = HUE_DEGREES[usize::from(t > 0.0)].to_radians();
            let away = t.abs();
            let lightness = 0.17 + 0.71 * away;
            // Chroma rises with lightness and then falls again, to stay among the colours of the screen.
            let chroma = 0.24 * away * (1.0 - 0.58 * away);
            srgb_from_oklab([lightness, chroma * hue.cos(), chroma * hue.sin()])
        })
        .collect()
}

fn between(knots: &[u32; 33]) -> Table {
    (0..256)
        .map(|i| {
            let at = i as f32 / 255.0 * 32.0;
            let knot = (at as usize).min(31);
            let fraction = at - knot as f32;
            [16, 8, 0].map(|shift| {
                let [low, high] = [0, 1].map(|k| (knots[knot + k] >> shift & 0xff) as f32);
                (low + (high - low) * fraction).round() as u8
            })
        })
        .collect()
}

/// Oklab (B. Ottosson, 2020) → sRGB bytes, clamped.
fn srgb_from_oklab([l, a, b]: [f32; 3]) -> [u8; 3] {
    let [l, m, s] = [
        l + 0.396_337_78 * a + 0.215_803_76 * b,
        l - 0.105_561_346 * a - 0.063_854_17 * b,
        l - 0.089_484_18 * a - 1.291_485_5 * b,
    ]
    .map(|v| v * v * v);
    [
        4.076_741_7 * l - 3.307_711_6 * m + 0.230_969_93 * s,
        -1.268_438 * l + 2.609_757_4 * m - 0.341_319_4 * s,
        -0.004_196_086_3 * l - 0.703_418_6 * m + 1.707_614_7 * s,
    ]
    .map(|linear| (crate::srgb_encode(linear.clamp(0.0, 1.0)) * 255.0).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lightness(color: [u8; 3]) -> f32 {
        let [r, g, b] = color.map(crate::srgb_decode_byte);
        (0.2126 * r + 0.7152 * g + 0.0722 * b).cbrt()
    }

    #[test]
    fn sequential_tables_only_get_lighter() {
        for table in [magma(), viridis()] {
            assert_eq!(table.len(), 256);
            assert!(table.windows(2).all(|w| lightness(w[1]) > lightness(w[0]) - 0.004));
        }
    }

    #[test]
    fn the_diverging_table_gets_lighter_from_its_middle_alike_to_both_sides() {
        let table = diverging();
        assert!(table[128..].windows(2).all(|w| lightness(w[1]) > lightness(w[0]) - 0.004));
        assert!(table[..128].windows(2).all(|w| lightness(w[0]) > lightness(w[1]) - 0.004));
        for i in 0..128 {
            let (below, above) = (lightness(table[i]), lightness(table[255 - i]));
            assert!((below - above).abs() < 0.06, "{i}: {below} {above}");
        }
    }

    #[test]
    fn the_colour_of_no_value_is_in_no_table() {
        assert!([magma(), viridis(), diverging()].iter().flatten().all(|&color| color != NO_VALUE));
    }
}
