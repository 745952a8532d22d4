//! The shadow rays of a block: whether anything is in their way, and what arrives where nothing is.
//!
//! They go everywhere, so they are traced as `World::occluded_scattered` does it. (Packets of those that go towards a
//! sun, found by the density with which they were drawn, were measured: no gain beside it.)

use glam::Vec3;
use halflight_scene::Frame;
use halflight_scene::lights::{Arrival, Environment, MapPoint};
use halflight_trace::{Ray, Simd};

use crate::cutouts::Cutouts;
use crate::samplers::LANES;

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
    /// Place of its ray.
    pub(super) ray: u8,
}

/// Shadow rays, one for each vertex that seeks light.
pub(super) struct Shadows {
    shadows: [Shadow; LANES],
    rays: [Ray; LANES],
    blocked: [bool; LANES],
    count: usize,
    points: [MapPoint; LANES],
    radiance: [Vec3; LANES],
}

impl Shadows {
    pub(super) fn new() -> Self {
        let arrival = Arrival::From { point: None, radiance: Vec3::ZERO };
        let shadow = Shadow { vertex: 0, scattered: Vec3::ZERO, scale: 0.0, arrival, ray: 0 };
        Self {
            shadows: [shadow; LANES],
            rays: [Ray::new(Vec3::ZERO, Vec3::Z); LANES],
            blocked: [false; LANES],
            count: 0,
            points: [MapPoint::default(); LANES],
            radiance: [Vec3::ZERO; LANES],
        }
    }

    pub(super) fn clear(&mut self) {
        self.count = 0;
    }

    pub(super) fn len(&self) -> usize {
        self.count
    }

    #[inline]
    pub(super) fn push(&mut self, shadow: Shadow, ray: Ray) {
        (self.shadows[self.count], self.rays[self.count]) = (Shadow { ray: self.count as u8, ..shadow }, ray);
        self.count += 1;
    }

    /// Finds out which rays are blocked, and forgets those.
    pub(super) fn trace(&mut self, frame: &Frame, cutouts: Cutouts) {
        frame.world.occluded_scattered(&self.rays[..self.count], &mut self.blocked[..self.count]);
        if cutouts.any {
            for (blocked, ray) in self.blocked[..self.count].iter_mut().zip(&self.rays) {
                *blocked = *blocked && cutouts.blocked(frame, ray);
            }
        }
        let mut free = 0;
        for i in (0..self.count).filter(|&i| !self.blocked[i]) {
            self.shadows[free] = self.shadows[i];
            free += 1;
        }
        self.count = free;
    }

    /// The rays, those that are blocked too.
    pub(super) fn rays(&self) -> [Ray; LANES] {
        self.rays
    }

    /// The light that arrives, with its radiance.
    pub(super) fn arriving(
        &mut self,
        simd: Simd,
        environment: Option<&Environment>,
    ) -> impl Iterator<Item = (&Shadow, Vec3)> {
        let mut seen = 0;
        for shadow in &self.shadows[..self.count] {
            if let Arrival::Environment(point) = shadow.arrival {
                self.points[seen] = point;
                seen += 1;
            }
        }
        if let Some(environment) = environment {
            environment.radiance_many(simd, &self.points, seen, &mut self.radiance);
        }
        let mut found = self.radiance[..seen].iter();
        self.shadows[..self.count].iter().map(move |shadow| match shadow.arrival {
            Arrival::Environment(_) => (shadow, found.next().copied().unwrap_or_default()),
            Arrival::From { radiance, .. } => (shadow, radiance),
        })
    }
}
