//! Gradient noise from a hash: the same number everywhere, for ever, without a table.
//!
//! Perlin's improved noise (2002): lattice gradients joined by the quintic 6t⁵ − 15t⁴ + 10t³. The gradients are
//! chosen by a hash of (lattice point, seed). Values lie within ±1 and have mean 0.

use glam::{Vec2, Vec3};

/// Well-mixed 32 bits of a lattice point (the finaliser of MurmurHash3 over multiplied coordinates).
pub(crate) fn hash(x: i32, y: i32, z: i32, seed: u32) -> u32 {
    let mut h = seed
        ^ (x as u32).wrapping_mul(0x9e37_79b1)
        ^ (y as u32).wrapping_mul(0x85eb_ca77).rotate_left(11)
        ^ (z as u32).wrapping_mul(0xc2b2_ae3d).rotate_left(21);
    h = (h ^ (h >> 16)).wrapping_mul(0x85eb_ca6b);
    h = (h ^ (h >> 13)).wrapping_mul(0xc2b2_ae35);
    h ^ (h >> 16)
}

fn fade(t: f32) -> f32 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

fn fade3(t: Vec3) -> Vec3 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

/// Noise over the plane, within ±1.
pub(crate) fn noise2(p: Vec2, seed: u32) -> f32 {
    let cell = p.floor();
    let f = p - cell;
    let (x, y) = (cell.x as i32, cell.y as i32);
    let corner = |dx: i32, dy: i32| {
        let h = hash(x.wrapping_add(dx), y.wrapping_add(dy), 0, seed);
        // Sixteen bits a component: gradients in a square, which hides the eight directions of the original.
        let gradient = Vec2::new((h & 0xffff) as f32, (h >> 16) as f32) * (2.0 / 65535.0) - Vec2::ONE;
        gradient.dot(f - Vec2::new(dx as f32, dy as f32))
    };
    let (sx, sy) = (fade(f.x), fade(f.y));
    let low = corner(0, 0) + sx * (corner(1, 0) - corner(0, 0));
    let high = corner(0, 1) + sx * (corner(1, 1) - corner(0, 1));
    low + sy * (high - low)
}

/// Noise in space, within ±1.5.
pub(crate) fn noise3(p: Vec3, seed: u32) -> f32 {
    let cell = p.floor();
    let f = p - cell;
    let [x, y, z] = cell.to_array().map(|c| c as i32);
    let corner = |dx: i32, dy: i32, dz: i32| {
        let h = hash(x.wrapping_add(dx), y.wrapping_add(dy), z.wrapping_add(dz), seed);
        let bits = [h & 0x3ff, (h >> 10) & 0x3ff, (h >> 20) & 0x3ff];
        let gradient = Vec3::from_array(bits.map(|b| b as f32)) * (2.0 / 1023.0) - Vec3::ONE;
        gradient.dot(f - Vec3::new(dx as f32, dy as f32, dz as f32))
    };
    let s = fade3(f);
    let along_x = |dy, dz| {
        let (a, b) = (corner(0, dy, dz), corner(1, dy, dz));
        a + s.x * (b - a)
    };
    let along_y = |dz| {
        let (a, b) = (along_x(0, dz), along_x(1, dz));
        a + s.y * (b - a)
    };
    let (a, b) = (along_y(0), along_y(1));
    a + s.z * (b - a)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_continuous_bounded_and_of_mean_zero() {
        let (mut sum, mut squares) = (0.0, 0.0);
        let n = 40_000;
        for i in 0..n {
            let p = Vec2::new(i as f32 * 0.137 - 900.0, i as f32 * 0.0713 + 5.0);
            let value = noise2(p, 3);
            assert!(value.abs() <= 1.0);
            assert!((noise2(p + Vec2::splat(1e-3), 3) - value).abs() < 0.02);
            let q = Vec3::new(p.x, p.y, 0.01 * p.x);
            assert!((noise3(q + Vec3::splat(1e-3), 3) - noise3(q, 3)).abs() < 0.02);
            sum += value;
            squares += value * value;
        }
        assert!((sum / n as f32).abs() < 0.02);
        assert!((0.02..0.2).contains(&(squares / n as f32)));
    }
}
