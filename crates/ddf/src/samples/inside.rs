//! Whether a point is enclosed by a mesh, for meshes that may be open or of many parts.
//!
//! The odd–even rule [002 §V-B], asked in several directions and decided by the majority: a ray that slips through a hole
//! or along an edge is outvoted. A point from which most directions see no surface at all is outside, whatever the
//! others say.

use glam::Vec3;
use halflight_trace::{MeshTracer, Ray, RayGeometry};

use crate::random::Random;

/// Asks a mesh.
#[derive(Debug)]
pub struct Inside<'a> {
    mesh: &'a MeshTracer,
    votes: usize,
}

/// Crossings after which a ray is given up: it runs along a surface.
const MOST_CROSSINGS: usize = 256;

impl<'a> Inside<'a> {
    /// With an odd number of directions.
    #[must_use]
    pub fn new(mesh: &'a MeshTracer) -> Inside<'a> {
        Inside { mesh, votes: 7 }
    }

    /// Whether most directions leave the mesh an odd number of times.
    #[must_use]
    pub fn contains(&self, point: Vec3) -> bool {
        let (low, high) = self.mesh.bounds();
        if !(point.cmpge(low).all() && point.cmple(high).all()) {
            return false;
        }
        // The same directions for every point: what is asked twice is answered twice alike.
        let mut random = Random::new(17, 0, 0);
        let (mut odd, mut free) = (0, 0);
        for _ in 0..self.votes {
            let crossings = self.crossings(point, random.direction());
            odd += crossings % 2;
            free += usize::from(crossings == 0);
        }
        2 * odd > self.votes && 2 * free < self.votes
    }

    fn crossings(&self, point: Vec3, direction: Vec3) -> usize {
        let (low, high) = self.mesh.bounds();
        let skip = 1e-5 * (high - low).length();
        let (mut count, mut origin) = (0, point);
        while count < MOST_CROSSINGS {
            let Some(hit) = self.mesh.closest(&Ray::new(origin, direction)) else { break };
            count += 1;
            origin += direction * (hit.t + skip);
        }
        count
    }
}
