//! Suns: parts of a map so bright and so narrow that samples of a lobe would find them by luck alone.
//!
//! A map is taken apart, L = min(L, t) + max(L − t, 0), where t is so many times the mean of what remains below it. What is
//! above t is gathered into a few narrow groups of texels, and each of them is a lamp at infinity: it is asked for the light
//! that a point reflects of it, without any chance, by one point of it or by as many as the lobe tells apart. What is below
//! is the map that is sampled, convolved and judged. Where there are too many groups t rises: a bright window is no sun.
//!
//! The seed has no such split: its maps are those that samples of the lobe alone can find, `[001]` §4.

use std::f32::consts::{PI, TAU};

use glam::{Mat3, Vec3};
use halflight_image::RgbImage;
use halflight_scene::lights::luminance;

/// t over the mean of what is below it.
const BRIGHT: f32 = 24.0;
/// Cosine of how far the texels of one sun may be from its brightest: 2.5°.
const NARROW: f32 = 0.999_05;
/// The most suns of one map.
const MOST: usize = 32;
/// 2^5 points of one sun at most.
const FINEST: usize = 5;
/// Suns that bring less than this share of the light are left in the map.
const LEAST: f32 = 0.002;

/// Where light comes from, and how much: radiance times solid angle.
pub(super) type Beam = (Vec3, Vec3);

/// A sun.
#[derive(Clone, Debug)]
pub(super) struct Sun {
    /// By one beam, by two, by four; each finer one is of the same light.
    levels: Vec<Vec<Beam>>,
    /// Radians that it is wide.
    width: f32,
}

impl Sun {
    fn new(texels: Vec<Beam>) -> Self {
        let (middle, power) = joined(&texels);
        let spread = texels.iter().map(|(d, p)| luminance(*p) * d.distance_squared(middle)).sum::<f32>();
        // Of a disk the mean of squared distances is an eighth of its squared width.
        let width = (8.0 * spread / luminance(power).max(f32::MIN_POSITIVE)).sqrt();
        let mut groups = vec![texels];
        let mut levels = vec![vec![(middle, power)]];
        for _ in 0..FINEST {
            groups = groups.into_iter().flat_map(halves).collect();
            levels.push(groups.iter().map(|group| joined(group)).collect());
        }
        Self { levels, width }
    }

    /// All of it from one direction.
    pub(super) fn whole(&self) -> Beam {
        self.levels[0][0]
    }

    /// As many beams as a lobe of bandwidth `lobe`, in cycles per radian, tells apart.
    pub(super) fn beams(&self, lobe: f32) -> &[Beam] {
        // 2^k of them lie about width/2^(k/2) from each other; half a period is near enough.
        let apart = (2.0 * self.width * lobe).clamp(1.0, 1e6);
        let level = (2.0 * apart.log2()).ceil() as usize;
        &self.levels[level.min(self.levels.len() - 1)]
    }

    /// The same sun, turned and tinted.
    fn seen(&self, to_world: Mat3, intensity: Vec3) -> Self {
        let turned = |level: &Vec<Beam>| level.iter().map(|(d, p)| (to_world * *d, *p * intensity)).collect();
        Self { levels: self.levels.iter().map(turned).collect(), width: self.width }
    }
}

/// The suns of a map in its own space, and the map without them.
pub(super) fn split(image: &RgbImage) -> Option<(Vec<Sun>, RgbImage)> {
    let (width, height) = (image.width, image.height);
    let solid_angles: Vec<f32> = (0..height)
        .map(|y| {
            let edge = |y: usize| (PI * y as f32 / height as f32).cos();
            TAU / width as f32 * (edge(y) - edge(y + 1))
        })
        .collect();
    let values: Vec<f32> = image.pixels.iter().map(|&p| luminance(Vec3::from(p).max(Vec3::ZERO))).collect();
    let mean_below = |bound: f32| {
        let row = |(row, omega): (&[f32], &f32)| {
            f64::from(row.iter().map(|v| v.min(bound)).sum::<f32>()) * f64::from(*omega)
        };
        (values.chunks_exact(width).zip(&solid_angles).map(row).sum::<f64>() / (4.0 * f64::from(PI))) as f32
    };
    let all = mean_below(f32::INFINITY);
    if !(all > 0.0 && all.is_finite()) {
        return None;
    }
    // It falls from above to a fixed point: what is bright does not count in the mean that it is compared with.
    let mut bound = f32::INFINITY;
    for _ in 0..8 {
        bound = BRIGHT * mean_below(bound);
    }
    loop {
        let above: Vec<usize> = (0..values.len()).filter(|&i| values[i] > bound).collect();
        if above.is_empty() {
            return None;
        }
        let excess = |i: usize| Vec3::from(image.pixels[i]).max(Vec3::ZERO) * (1.0 - bound / values[i]);
        let beam = |i: usize| {
            let (theta, phi) = (
                PI * ((i / width) as f32 + 0.5) / height as f32,
                TAU * ((i % width) as f32 + 0.5) / width as f32,
            );
            let ((sin, cos), (sin_phi, cos_phi)) = (theta.sin_cos(), (phi - PI).sin_cos());
            (Vec3::new(sin * sin_phi, cos, -sin * cos_phi), excess(i) * solid_angles[i / width])
        };
        let Some(groups) = grouped(&above, &values, beam) else {
            bound *= 1.5;
            continue;
        };
        let power: f32 = groups.iter().flatten().map(|(_, power)| luminance(*power)).sum();
        if power < LEAST * 4.0 * PI * all {
            return None;
        }
        let mut rest = image.clone();
        for i in above {
            rest.pixels[i] = (Vec3::from(image.pixels[i]).max(Vec3::ZERO) - excess(i)).to_array();
        }
        return Some((groups.into_iter().map(Sun::new).collect(), rest));
    }
}

/// Texels by the brightest one near them; `None` if those are too many.
fn grouped(above: &[usize], values: &[f32], beam: impl Fn(usize) -> Beam) -> Option<Vec<Vec<Beam>>> {
    let mut by_brightness = above.to_vec();
    by_brightness.sort_by(|&a, &b| values[b].total_cmp(&values[a]).then(a.cmp(&b)));
    let mut groups: Vec<Vec<Beam>> = Vec::new();
    for i in by_brightness {
        let beam = beam(i);
        match groups.iter().position(|group| group[0].0.dot(beam.0) > NARROW) {
            Some(group) => groups[group].push(beam),
            None if groups.len() == MOST => return None,
            None => groups.push(vec![beam]),
        }
    }
    Some(groups)
}

/// All light of some beams, from their mean direction.
fn joined(beams: &[Beam]) -> Beam {
    let power = beams.iter().map(|(_, power)| *power).sum::<Vec3>();
    let middle = beams.iter().map(|(direction, power)| *direction * luminance(*power)).sum::<Vec3>();
    (middle.normalize_or(beams[0].0), power)
}

/// Two halves of equal light, across the longer side; one alone stays.
fn halves(mut beams: Vec<Beam>) -> Vec<Vec<Beam>> {
    if beams.len() < 2 {
        return vec![beams];
    }
    let (low, high) =
        beams.iter().fold((Vec3::MAX, Vec3::MIN), |(low, high), (d, _)| (low.min(*d), high.max(*d)));
    let axis = (0..3).max_by(|&a, &b| (high - low)[a].total_cmp(&(high - low)[b])).unwrap_or(0);
    beams.sort_by(|a, b| a.0[axis].total_cmp(&b.0[axis]));
    let half = 0.5 * beams.iter().map(|(_, power)| luminance(*power)).sum::<f32>();
    let mut sum = 0.0;
    let crossed = beams.iter().position(|(_, power)| {
        sum += luminance(*power);
        sum > half
    });
    let second = beams.split_off(crossed.unwrap_or(1).clamp(1, beams.len() - 1));
    vec![beams, second]
}

/// The suns of a map as a frame sees them.
pub(super) fn seen(suns: &[Sun], to_world: Mat3, intensity: Vec3) -> Vec<Sun> {
    suns.iter().map(|sun| sun.seen(to_world, intensity)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sky(sun: impl Fn(usize, usize) -> f32) -> RgbImage {
        RgbImage::from_fn(512, 256, |x, y| [1.0 + sun(x, y), 1.0 + 0.9 * sun(x, y), 1.0 + 0.7 * sun(x, y)])
    }

    fn total(image: &RgbImage) -> Vec3 {
        let omega = |y: usize| {
            TAU / image.width as f32
                * ((PI * y as f32 / image.height as f32).cos()
                    - (PI * (y + 1) as f32 / image.height as f32).cos())
        };
        (0..image.pixels.len()).map(|i| Vec3::from(image.pixels[i]) * omega(i / image.width)).sum()
    }

    #[test]
    fn suns_and_the_rest_are_all_of_the_light_at_every_level() {
        let image = sky(|x, y| if (200..203).contains(&x) && (100..103).contains(&y) { 9e3 } else { 0.0 });
        let (suns, rest) = split(&image).unwrap_or_else(|| panic!("there is a sun"));
        assert_eq!(suns.len(), 1);
        let all = total(&image);
        for level in &suns[0].levels {
            let sum = total(&rest) + level.iter().map(|(_, power)| *power).sum::<Vec3>();
            // Sums of a hundred thousand floats.
            assert!(sum.distance(all) < 1e-3 * all.length(), "{sum} {all}");
        }
        assert_eq!(suns[0].levels[FINEST].len(), 9, "no more points than texels");
        let brightest = rest.pixels.iter().map(|&p| luminance(p.into())).fold(0.0, f32::max);
        assert!(brightest < 1.01 * BRIGHT, "{brightest}");
        // Three texels of 0.7° each; a disk of equal spread is somewhat wider.
        assert!((0.03..0.06).contains(&suns[0].width), "{}", suns[0].width);
        assert_eq!(suns[0].beams(0.1).len(), 1);
        assert_eq!(suns[0].beams(1e4).len(), 9);
    }

    #[test]
    fn soft_skies_windows_and_black_have_no_suns() {
        assert!(split(&sky(|_, _| 0.0)).is_none());
        assert!(split(&RgbImage::from_fn(16, 8, |_, _| [0.0; 3])).is_none());
        // A bright quarter of everything.
        assert!(split(&sky(|x, y| if x < 256 && y < 128 { 500.0 } else { 0.0 })).is_none());
    }

    #[test]
    fn two_suns_are_two_and_each_keeps_its_colour_and_place() {
        let image = sky(|x, y| if (x, y) == (128, 128) || (x, y) == (384, 40) { 4e4 } else { 0.0 });
        let (suns, _) = split(&image).unwrap_or_else(|| panic!("there are suns"));
        assert_eq!(suns.len(), 2);
        for sun in &suns {
            let (_, power) = sun.whole();
            assert!((power.y / power.x - 0.9).abs() < 1e-3 && (power.z / power.x - 0.7).abs() < 1e-3);
        }
        // Column 128 of 512 is a quarter of a turn from the middle, towards −x.
        assert!(suns.iter().any(|sun| sun.whole().0.distance(Vec3::NEG_X) < 0.05));
    }
}
