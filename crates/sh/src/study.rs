//! Random sets of blockers, on which the errors of the log-visibility pipeline are stated.
//!
//! *Small* blockers have half-angles of 2–8°, *large* 10–40°, *huge* 40–80°, all scattered uniformly; *body* is a chain
//! of overlapping spheres like those that fill a figure, seen from a point beside it.

use glam::{DVec3, Vec3};

use crate::attenuation::Cap;
use crate::numbers::Numbers;

/// A kind of set, with the number of its blockers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BlockerSet {
    /// Half-angles of 2–8°.
    Small(usize),
    /// Half-angles of 10–40°.
    Large(usize),
    /// Half-angles of 40–80°.
    Huge(usize),
    /// Overlapping spheres along random limbs.
    Body(usize),
}

impl BlockerSet {
    /// The fourteen sets of the tables.
    pub const ALL: [BlockerSet; 14] = [
        BlockerSet::Small(5),
        BlockerSet::Small(50),
        BlockerSet::Small(400),
        BlockerSet::Large(1),
        BlockerSet::Large(3),
        BlockerSet::Large(10),
        BlockerSet::Large(25),
        BlockerSet::Huge(1),
        BlockerSet::Huge(2),
        BlockerSet::Huge(5),
        BlockerSet::Body(10),
        BlockerSet::Body(25),
        BlockerSet::Body(50),
        BlockerSet::Body(400),
    ];

    /// The blockers of one such set, seen from the origin.
    #[must_use]
    pub fn caps(self, seed: u64) -> Vec<Cap> {
        let mut numbers = Numbers::new(seed);
        let mut scattered = |count: usize, low: f64, high: f64| -> Vec<Cap> {
            (0..count)
                .map(|_| {
                    let direction = numbers.direction().as_vec3();
                    Cap { direction, half_angle: numbers.between(low, high).to_radians() as f32 }
                })
                .collect()
        };
        match self {
            BlockerSet::Small(count) => scattered(count, 2.0, 8.0),
            BlockerSet::Large(count) => scattered(count, 10.0, 40.0),
            BlockerSet::Huge(count) => scattered(count, 40.0, 80.0),
            BlockerSet::Body(count) => {
                body(count, seed).into_iter().filter_map(|(c, r)| Cap::of_sphere(c, r)).collect()
            }
        }
    }
}

/// Spheres (centre, radius) of a figure beside the origin: five limbs as chains whose spheres overlap, the more of them
/// the denser.
#[must_use]
pub fn body(count: usize, seed: u64) -> Vec<(Vec3, f32)> {
    let mut numbers = Numbers::new(seed ^ 0xb0d1);
    let centre = numbers.direction() * numbers.between(1.4, 2.6);
    let limbs: Vec<(DVec3, DVec3, f64)> = (0..5)
        .map(|_| {
            let from = centre + numbers.direction() * 0.2;
            (from, from + numbers.direction() * numbers.between(0.5, 0.9), numbers.between(0.1, 0.25))
        })
        .collect();
    (0..count)
        .map(|i| {
            let (from, to, thickness) = limbs[i % 5];
            let along = numbers.next();
            let radius = thickness * numbers.between(0.7, 1.1);
            let place = from.lerp(to, along) + numbers.direction() * (0.15 * thickness);
            (place.as_vec3(), radius as f32)
        })
        .collect()
}
