//! Writes the pictures that the demo scenes of `bandwidth` lay on surfaces, made of formulas: `demo_pictures FOLDER`
//! (in the repository: `scenes/models`).

use std::path::PathBuf;

use glam::{Vec2, Vec3};
use halflight_image::{RgbImage, ToneMapping, save_png, srgb_decode};

const SIDE: usize = 256;

/// Value noise of period `period` on the unit square.
fn noise(at: Vec2, period: u32) -> f32 {
    let p = at * period as f32;
    let cell = p.floor();
    let f = p - cell;
    let s = f * f * (Vec2::splat(3.0) - 2.0 * f);
    let corner = |dx: u32, dy: u32| {
        let (x, y) = ((cell.x as u32 + dx) % period, (cell.y as u32 + dy) % period);
        let mut h =
            x.wrapping_mul(0x9E37_79B9) ^ y.wrapping_mul(0x85EB_CA6B) ^ period.wrapping_mul(0xC2B2_AE35);
        h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
        h = (h ^ (h >> 12)).wrapping_mul(0x297A_2D39);
        ((h ^ (h >> 15)) >> 8) as f32 / 16_777_216.0
    };
    let (a, b) = (
        corner(0, 0) + s.x * (corner(1, 0) - corner(0, 0)),
        corner(0, 1) + s.x * (corner(1, 1) - corner(0, 1)),
    );
    a + s.y * (b - a)
}

fn turbulence(at: Vec2) -> f32 {
    [(4, 0.5), (8, 0.25), (16, 0.125), (32, 0.0625)]
        .iter()
        .map(|&(period, weight)| weight * noise(at, period))
        .sum()
}

/// White marble with grey veins.
fn marble(at: Vec2) -> Vec3 {
    let vein = (std::f32::consts::TAU * (at.x + 2.0 * at.y + 1.6 * turbulence(at))).sin().abs().powf(0.35);
    Vec3::new(0.24, 0.24, 0.27).lerp(Vec3::new(0.78, 0.76, 0.72), vein)
}

/// The height of hammered metal, in units of its side.
fn hammered(at: Vec2) -> f32 {
    0.012 * noise(at, 12) + 0.004 * noise(at, 32)
}

/// The normal of a height as a picture of normals, +y towards smaller v.
fn normal(at: Vec2) -> Vec3 {
    let step = 1.0 / SIDE as f32;
    let slope = |d: Vec2| {
        let wrapped = |p: Vec2| p - p.floor();
        (hammered(wrapped(at + d)) - hammered(wrapped(at - d))) / (2.0 * step)
    };
    Vec3::new(-slope(Vec2::X * step), slope(Vec2::Y * step), 1.0).normalize()
}

fn main() {
    let Some(folder) = std::env::args_os().nth(1).map(PathBuf::from) else {
        eprintln!("demo_pictures FOLDER");
        return;
    };
    let place = |x: usize, y: usize| (Vec2::new(x as f32, y as f32) + Vec2::splat(0.5)) / SIDE as f32;
    let veins = RgbImage::from_fn(SIDE, SIDE, |x, y| marble(place(x, y)).to_array());
    // Bytes that are the numbers themselves: the curve of the picture's format is undone.
    let dents = RgbImage::from_fn(SIDE, SIDE, |x, y| {
        (0.5 * normal(place(x, y)) + Vec3::splat(0.5)).to_array().map(srgb_decode)
    });
    for (name, picture) in [("marble.png", veins), ("hammered.png", dents)] {
        if let Err(error) = save_png(&folder.join(name), &picture, &ToneMapping::default()) {
            eprintln!("{error}");
        }
    }
}
