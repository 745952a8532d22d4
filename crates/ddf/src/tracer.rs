//! A field among the forms of geometry: what a world asks of it.
//!
//! With a mesh beside it, the field's answers are confirmed. *Confident* is a ray all of whose cells answered clearly
//! (|logit| above [`FieldTracer::DOUBT`]). A confident hit is looked for on the mesh within a short stretch about the
//! field's distance, which costs little; whatever is not found there, and every ray that is not confident, is asked of
//! the whole mesh: that is the fallback, and it is counted.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::{Vec2, Vec3};
use halflight_trace::{FallbackCounts, LocalHit, LocalSurface, MeshTracer, Ray, RayGeometry};

use crate::field::{DirectedField, FieldHit, cell_of_number};

/// Bit of a primitive's number that says that the mesh answered.
const OF_MESH: u32 = 1 << 31;
/// Bit that says that the whole mesh was asked.
const FELL_BACK: u32 = 1 << 30;
/// Bit that says that the field sees the back of its surface.
const BACK: u32 = 1 << 29;

/// A field that answers rays, with or without a mesh to fall back to.
#[derive(Clone, Debug)]
pub struct FieldTracer {
    field: Arc<DirectedField>,
    mesh: Option<Arc<MeshTracer>>,
    counts: Arc<Counts>,
}

#[derive(Debug, Default)]
struct Counts {
    asked: AtomicU64,
    confirmed: AtomicU64,
    fell_back: AtomicU64,
}

/// Where an answer came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answered {
    /// The field alone.
    Field,
    /// The field, confirmed on the mesh.
    Confirmed,
    /// The mesh alone.
    Mesh,
}

impl FieldTracer {
    /// Logits nearer to 0 than this are doubtful: a chance of more than 1 in 400 to be wrong.
    pub const DOUBT: f32 = 6.0;

    /// A field that answers for itself.
    #[must_use]
    pub fn new(field: Arc<DirectedField>) -> FieldTracer {
        FieldTracer { field, mesh: None, counts: Arc::default() }
    }

    /// A field that asks its mesh where it is in doubt.
    #[must_use]
    pub fn with_fallback(field: Arc<DirectedField>, mesh: Arc<MeshTracer>) -> FieldTracer {
        FieldTracer { field, mesh: Some(mesh), counts: Arc::default() }
    }

    /// The field.
    #[must_use]
    pub fn field(&self) -> &Arc<DirectedField> {
        &self.field
    }

    /// How often the mesh was needed so far.
    #[must_use]
    pub fn fallback_counts(&self) -> FallbackCounts {
        let load = |count: &AtomicU64| count.load(Ordering::Relaxed);
        FallbackCounts {
            asked: load(&self.counts.asked),
            confirmed: load(&self.counts.confirmed),
            fell_back: load(&self.counts.fell_back),
        }
    }

    /// The nearest hit, and who answered.
    #[must_use]
    pub fn closest_with_source(&self, ray: &Ray) -> (Option<LocalHit>, Answered) {
        let (hit, doubt) = self.field.query_with_doubt(ray.origin, ray.direction, ray.t_max);
        let Some(mesh) = &self.mesh else { return (hit.as_ref().map(local), Answered::Field) };
        self.counts.asked.fetch_add(1, Ordering::Relaxed);
        if doubt.abs() >= Self::DOUBT {
            let Some(hit) = hit else { return (None, Answered::Field) };
            // Twice the 95th percentile either way, in lengths of the direction.
            let error = 2.0 * self.field.error.depth_p95.max(1e-3) / self.field.unit().scale;
            let around = error / ray.direction.length();
            let from = (hit.distance - around).max(0.0);
            let near =
                Ray { origin: ray.at(from), t_max: (hit.distance + around).min(ray.t_max) - from, ..*ray };
            if let Some(mut found) = mesh.closest(&near) {
                found.t = (found.t + from).min(ray.t_max);
                found.primitive |= OF_MESH;
                self.counts.confirmed.fetch_add(1, Ordering::Relaxed);
                return (Some(found), Answered::Confirmed);
            }
        }
        self.counts.fell_back.fetch_add(1, Ordering::Relaxed);
        let found =
            mesh.closest(ray).map(|hit| LocalHit { primitive: hit.primitive | OF_MESH | FELL_BACK, ..hit });
        (found, Answered::Mesh)
    }

    /// Bound of a hit's error, in the object's own space: what was measured across the surface, and the rounding of
    /// coordinates.
    fn position_error(&self, position: Vec3) -> f32 {
        let measured = self.field.error_across() / self.field.unit().scale;
        measured.max(8.0 * f32::EPSILON * position.abs().max_element())
    }
}

fn local(hit: &FieldHit) -> LocalHit {
    let back = if hit.back { BACK } else { 0 };
    LocalHit { t: hit.distance, primitive: hit.cell_number() | back, u: hit.start, v: hit.logit }
}

impl RayGeometry for FieldTracer {
    fn bounds(&self) -> (Vec3, Vec3) {
        self.field.bounds()
    }

    fn closest(&self, ray: &Ray) -> Option<LocalHit> {
        self.closest_with_source(ray).0
    }

    fn occluded(&self, ray: &Ray) -> bool {
        let (hit, doubt) = self.field.query_with_doubt(ray.origin, ray.direction, ray.t_max);
        let Some(mesh) = &self.mesh else { return hit.is_some() };
        self.counts.asked.fetch_add(1, Ordering::Relaxed);
        if doubt.abs() >= Self::DOUBT {
            // A hit near the ray's end may lie on either side of it.
            let error = 2.0 * self.field.error.depth_p95 / self.field.unit().scale / ray.direction.length();
            match hit {
                None => return false,
                Some(hit) if hit.distance + error < ray.t_max => return true,
                Some(_) => {}
            }
        }
        self.counts.fell_back.fetch_add(1, Ordering::Relaxed);
        mesh.occluded(ray)
    }

    fn surface(&self, ray: &Ray, hit: &LocalHit) -> LocalSurface {
        if let Some(mesh) = &self.mesh
            && hit.primitive & OF_MESH != 0
        {
            return mesh
                .surface(ray, &LocalHit { primitive: hit.primitive & !(OF_MESH | FELL_BACK), ..*hit });
        }
        let field_hit = FieldHit {
            distance: hit.t,
            logit: hit.v,
            least_logit: hit.v,
            cell: cell_of_number(hit.primitive),
            start: hit.u,
            back: hit.primitive & BACK != 0,
        };
        // Towards the front, as a mesh has it.
        let facing = self.field.normal(ray.origin, ray.direction, &field_hit);
        let normal = if field_hit.back { -facing } else { facing };
        let position = ray.at(hit.t);
        LocalSurface {
            position,
            position_error: self.position_error(position),
            geometric_normal: normal,
            shading_normal: normal,
            uv: Vec2::ZERO,
            tangent: Vec3::ZERO,
            handedness: 1.0,
            color: Vec3::ONE,
            material_slot: 0,
        }
    }

    fn fallback(&self) -> Option<FallbackCounts> {
        self.mesh.as_ref().map(|_| self.fallback_counts())
    }

    fn fell_back(&self, primitive: u32) -> bool {
        self.mesh.is_some() && primitive & FELL_BACK != 0
    }

    /// FNV-1a of the field's file, and whether there is a mesh.
    fn identity(&self) -> u64 {
        let start = 0xcbf2_9ce4_8422_2325 ^ u64::from(self.mesh.is_some());
        self.field
            .encode()
            .into_iter()
            .fold(start, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
    }

    fn primitives(&self) -> usize {
        self.field.occupied_cells()
    }

    fn memory_bytes(&self) -> usize {
        self.field.memory_bytes() + self.mesh.as_ref().map_or(0, |mesh| mesh.memory_bytes())
    }
}
