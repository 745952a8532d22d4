//! The shadow rays of a block: which of them may go together, and whether anything is in their way.
//!
//! Directions that are drawn with a density above d fill less than 1/d of solid angle altogether. So the rays towards a
//! small bright part of the environment, a sun, go nearly together, whatever the map: they are traced as packets. The
//! others go everywhere.

use glam::Vec3;
use halflight_scene::lights::Arrival;
use halflight_trace::{Ray, World};

use crate::samplers::LANES;

/// Density per steradian from which directions count as close: together they fill at most a twelfth of a steradian or
/// so.
const CLOSE: f32 = 12.0;

/// Light on its way to a vertex, if nothing is in between.
#[derive(Clone, Copy)]
pub(super) struct Shadow {
    /// Place of the vertex in its list.
    pub(super) vertex: u8,
    /// What the vertex scatters of it.
    pub(super) scattered: Vec3,
    /// What the sample counts.
    pub(super) scale: f32,
    pub(super) arrival: Arrival,
}

/// Shadow rays: those that are close from the front of the lists, the others from the back.
pub(super) struct Shadows {
    shadows: [Shadow; LANES],
    rays: [Ray; LANES],
    blocked: [bool; LANES],
    close: usize,
    scattered: usize,
}

impl Shadows {
    pub(super) fn new() -> Self {
        let arrival = Arrival::From { point: None, radiance: Vec3::ZERO };
        let shadow = Shadow { vertex: 0, scattered: Vec3::ZERO, scale: 0.0, arrival };
        Self {
            shadows: [shadow; LANES],
            rays: [Ray::new(Vec3::ZERO, Vec3::Z); LANES],
            blocked: [false; LANES],
            close: 0,
            scattered: LANES,
        }
    }

    pub(super) fn clear(&mut self) {
        (self.close, self.scattered) = (0, LANES);
    }

    pub(super) fn len(&self) -> usize {
        self.close + LANES - self.scattered
    }

    /// Adds light that was drawn with density `pdf`.
    #[inline]
    pub(super) fn push(&mut self, shadow: Shadow, ray: Ray, pdf: f32) {
        let is_close = pdf > CLOSE && matches!(shadow.arrival, Arrival::Environment(_));
        let place = if is_close { self.close } else { self.scattered - 1 };
        (self.shadows[place], self.rays[place]) = (shadow, ray);
        if is_close {
            self.close += 1;
        } else {
            self.scattered -= 1;
        }
    }

    /// Finds out which rays are blocked.
    pub(super) fn trace(&mut self, world: &World) {
        let (close, scattered) = (self.close, self.scattered);
        world.occluded_packet(&self.rays[..close], &mut self.blocked[..close]);
        world.occluded_scattered(&self.rays[scattered..], &mut self.blocked[scattered..]);
    }

    /// Light that arrives.
    #[inline]
    pub(super) fn free(&self) -> impl Iterator<Item = &Shadow> {
        let places = (0..self.close).chain(self.scattered..LANES);
        places.filter(|&place| !self.blocked[place]).map(|place| &self.shadows[place])
    }
}
