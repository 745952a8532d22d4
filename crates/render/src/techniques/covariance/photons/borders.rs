//! How much of a kernel in a medium lies where its light can be seen: within media, and not within a solid.
//!
//! A kernel hands out the whole power of its photon. What of it lies beyond the border of a medium, or under the ground, no ray
//! from the eye ever gathers, so that light would be missing along borders; kernels are divided by the share that does lie
//! within, and rays gather within alone. The share is the mean over [`POINTS`] points spread as the kernel is: 1 − q in the
//! unit ball, of which (5 r³ − 3 r⁵)/2 lie within r, each with its opposite, so that a plane through the middle has exactly half.
//!
//! Cost: nothing for kernels that nothing is near to; else a short ray for each point.

use std::f32::consts::TAU;
use std::sync::LazyLock;

use glam::Vec3;
use halflight_scene::Frame;
use halflight_scene::media::Region;
use halflight_trace::{DistanceGrid, Ray};

/// Points of a kernel that are looked at.
const POINTS: usize = 24;
/// The least share: a photon is within a medium itself, if only just.
const LEAST: f32 = 0.08;

/// Points of the unit ball.
static BALL: LazyLock<[Vec3; POINTS]> = LazyLock::new(|| {
    let radius = |share: f32| {
        let (mut low, mut high) = (0.0f32, 1.0f32);
        for _ in 0..30 {
            let r = 0.5 * (low + high);
            if 0.5 * r * r * r * (5.0 - 3.0 * r * r) < share { low = r } else { high = r }
        }
        0.5 * (low + high)
    };
    std::array::from_fn(|i| {
        let pair = (i / 2) as f32;
        let pairs = (POINTS / 2) as f32;
        // Over a half ball by the golden angle, radii in another order.
        let z = (pair + 0.5) / pairs;
        let (sin, cos) = (TAU * (0.618_034 * pair).fract()).sin_cos();
        let across = (1.0 - z * z).sqrt();
        let r = radius((0.5 + 0.754_877_7 * pair + 0.5 / pairs).fract());
        let side = if i % 2 == 0 { r } else { -r };
        side * Vec3::new(across * cos, across * sin, z)
    })
});

/// What kernels are kept within.
#[derive(Clone, Copy)]
pub(super) struct Borders<'a> {
    pub(super) frame: &'a Frame,
    pub(super) near: Option<&'a DistanceGrid>,
    /// Of the shutter.
    pub(super) time: f32,
}

impl Borders<'_> {
    /// The share of the kernel with these axes and half lengths about a point.
    pub(super) fn share(&self, at: Vec3, axes: [Vec3; 3], sides: [f32; 3]) -> f32 {
        let longest = sides[0].max(sides[1]).max(sides[2]);
        let volumes = self.frame.media.volumes();
        let deep = volumes.iter().any(|volume| match volume.region {
            Region::Sphere { center, radius } => radius - center.distance(at) > longest,
            region => {
                let (low, high) = region.bounds();
                (at - low).min(high - at).min_element() > longest
            }
        });
        // Within this nothing is in the way.
        let free = self.near.map_or(0.0, |grid| grid.distance(at));
        let open = free > longest;
        if deep && open {
            return 1.0;
        }
        let inside = |point: Vec3| {
            deep || volumes.iter().any(|volume| match volume.region {
                Region::Everywhere => true,
                Region::Box { low, high } => point.cmpge(low).all() && point.cmple(high).all(),
                Region::Sphere { center, radius } => center.distance_squared(point) <= radius * radius,
            })
        };
        let seen = |way: Vec3| {
            let length = way.length();
            length <= free || length <= 0.0 || !self.is_buried(at, way / length, length)
        };
        let count = BALL.iter().filter(|point| {
            let way = axes[0] * (sides[0] * point.x)
                + axes[1] * (sides[1] * point.y)
                + axes[2] * (sides[2] * point.z);
            inside(at + way) && seen(way)
        });
        (count.count() as f32 / POINTS as f32).max(LEAST)
    }

    /// Whether a point is within something, or under it: an odd number of surfaces lie between. Beyond both sides of a
    /// wall light does not belong, but the eye finds it there.
    fn is_buried(&self, from: Vec3, direction: Vec3, length: f32) -> bool {
        /// Most surfaces that are passed.
        const SURFACES: usize = 6;
        let world = &self.frame.world;
        let mut ray = Ray { origin: from, direction, t_max: length, time: self.time };
        let mut passed = 0;
        while passed < SURFACES
            && let Some(hit) = world.closest(&ray)
        {
            passed += 1;
            let next = world.surface(&ray, &hit).spawn(direction, self.time);
            ray = Ray { t_max: length - next.origin.distance(from), ..next };
            if ray.t_max <= 0.0 {
                break;
            }
        }
        passed % 2 == 1
    }
}
