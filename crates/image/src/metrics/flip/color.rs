//! The colour spaces of FLIP: opponent colours YCxCz for the filters, L*a*b* for the difference.
//!
//! X, Y, Z here are divided by those of white, so that the rows of the matrix sum to one:
//!
//! ```text
//! YCxCz:   Y' = 116 Y − 16        Cx = 500 (X − Y)         Cz = 200 (Y − Z)
//! L*a*b*:  L = 116 f(Y) − 16      a = 500 (f(X) − f(Y))    b = 200 (f(Y) − f(Z))
//! ```

/// Linear Rec. 709 → X, Y, Z over those of its white (x 0.3127, y 0.3290, to the digits the paper gives).
const TO_XYZ: [[f32; 3]; 3] = [
    [0.433_895_39, 0.376_242_37, 0.189_862_24],
    [0.212_636_82, 0.715_182_98, 0.072_180_2],
    [0.017_752_42, 0.109_465_63, 0.872_781_95],
];

/// The inverse of [`TO_XYZ`].
const FROM_XYZ: [[f32; 3]; 3] = [
    [3.080_342, -1.537_399, -0.542_943],
    [-0.921_178_4, 1.875_93, 0.045_248_41],
    [0.052_881_29, -0.204_011_2, 1.151_13],
];

fn apply(matrix: &[[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
    matrix.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// Luminance of a linear colour.
pub(super) fn luminance(rgb: [f32; 3]) -> f32 {
    TO_XYZ[1][0] * rgb[0] + TO_XYZ[1][1] * rgb[1] + TO_XYZ[1][2] * rgb[2]
}

/// Linear Rec. 709 → the opponent colours, which are linear in it.
pub(super) fn opponent_from_linear(rgb: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = apply(&TO_XYZ, rgb);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// The opponent colours → linear Rec. 709.
pub(super) fn linear_from_opponent([luma, cx, cz]: [f32; 3]) -> [f32; 3] {
    let y = (luma + 16.0) / 116.0;
    apply(&FROM_XYZ, [y + cx / 500.0, y, y - cz / 200.0])
}

/// L*, a*, b* of a linear colour, with a and b lessened in the dark as the eye does (Hunt effect).
pub(super) fn hunt_lab(rgb: [f32; 3]) -> [f32; 3] {
    const DELTA: f32 = 6.0 / 29.0;
    let [x, y, z] = apply(&TO_XYZ, rgb)
        .map(|t| if t > DELTA * DELTA * DELTA { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 });
    let lightness = 116.0 * y - 16.0;
    let hunt = 0.01 * lightness;
    [lightness, hunt * 500.0 * (x - y), hunt * 200.0 * (y - z)]
}

/// The HyAB distance: city block between lightness and chroma, Euclidean within chroma, for large differences.
pub(super) fn hyab(p: [f32; 3], q: [f32; 3]) -> f32 {
    let [lightness, a, b] = [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
    lightness.abs() + (a * a + b * b).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn opponent_colours_go_there_and_back() {
        for rgb in [[0.0; 3], [1.0; 3], [0.2, 0.7, 0.05], [1.0, 0.0, 0.3]] {
            let back = linear_from_opponent(opponent_from_linear(rgb));
            for c in 0..3 {
                assert!((back[c] - rgb[c]).abs() < 2e-6, "{rgb:?} came back as {back:?}");
            }
        }
    }

    #[test]
    fn white_is_lightness_one_hundred_without_colour() {
        let [l, a, b] = hunt_lab([1.0; 3]);
        assert!((l - 100.0).abs() < 1e-4 && a.abs() < 1e-3 && b.abs() < 1e-3);
        let [y, cx, cz] = opponent_from_linear([1.0; 3]);
        assert!((y - 100.0).abs() < 1e-4 && cx.abs() < 1e-3 && cz.abs() < 1e-3);
    }
}
