//! A learned field, asked in the object's own space.

use glam::{UVec3, Vec3};
use halflight_trace::Simd;
use serde::{Deserialize, Serialize};

use crate::fast::field::{FastField, GridRay};
use crate::fast::shape::FastShape;
use crate::unit::{UnitSpace, grid_to_unit, unit_to_grid};

/// What is known of a field's errors, in units of the unit sphere; measured after training, on rays that were not
/// trained on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MeasuredError {
    /// Mean of |predicted − true| distance where both hit.
    pub depth_mean: f32,
    /// 95th percentile of the same.
    pub depth_p95: f32,
    /// 95th percentile of the same across the surface, times |n · ω|: what rays that leave are offset by.
    pub across_p95: f32,
    /// Part of the rays for which hit or miss is right.
    pub visibility: f32,
    /// Mean angle between true and predicted normal, in degrees.
    pub normal_mean_degrees: f32,
    /// Chamfer distance × 10³, see [`crate::chamfer_e3`].
    pub chamfer_e3: f32,
}

/// Where a field came from.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// Name of the mesh file.
    pub source: String,
    /// FNV-1a of the positions and triangles of the mesh.
    pub source_hash: String,
    /// Its triangles.
    pub source_triangles: u64,
    /// Steps of training.
    pub steps: u64,
    /// Seconds of training.
    pub seconds: f64,
    /// Seed of training.
    pub seed: u64,
}

/// A field φ(x, ω), ξ(x, ω) that was learned from a mesh.
#[derive(Clone, Debug)]
pub struct DirectedField {
    pub(crate) fast: FastField,
    unit: UnitSpace,
    /// Object to grid: g = x · scale + offset.
    grid_scale: f32,
    grid_offset: Vec3,
    /// What training measured of itself.
    pub error: MeasuredError,
    /// Where it came from.
    pub provenance: Provenance,
}

/// What a field answers where a surface is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldHit {
    /// φ, in lengths of the direction.
    pub distance: f32,
    /// Logit of ξ: visible is above 0.
    pub logit: f32,
    /// The logit of least size among the cells that the ray passed: near 0 where the answer was a close call.
    pub least_logit: f32,
    /// The cell that answered.
    pub(crate) cell: UVec3,
    /// Where its part starts, in lengths of the direction.
    pub(crate) start: f32,
}

impl FieldHit {
    /// The cell that answered, as one number.
    #[must_use]
    pub fn cell_number(&self) -> u32 {
        self.cell.x | self.cell.y << 9 | self.cell.z << 18
    }
}

/// The cell of a number.
pub(crate) fn cell_of_number(number: u32) -> UVec3 {
    UVec3::new(number & 511, number >> 9 & 511, number >> 18 & 511)
}

impl DirectedField {
    pub(crate) fn new(fast: FastField, unit: UnitSpace) -> DirectedField {
        let r = fast.shape.resolution;
        let grid_scale = unit.scale * UnitSpace::cells_per_unit(r);
        let grid_offset = unit_to_grid(unit.to_unit(Vec3::ZERO), r);
        DirectedField {
            fast,
            unit,
            grid_scale,
            grid_offset,
            error: MeasuredError::default(),
            provenance: Provenance::default(),
        }
    }

    /// The sizes of the field.
    #[must_use]
    pub fn shape(&self) -> &FastShape {
        &self.fast.shape
    }

    /// From the object's own space to the unit sphere.
    #[must_use]
    pub fn unit(&self) -> UnitSpace {
        self.unit
    }

    /// Lower and upper corner of all that can be hit, in the object's own space.
    #[must_use]
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let (low, high) = self.fast.cells.bounds();
        let r = self.fast.shape.resolution;
        let margin = self.fast.shape.margin;
        let out = |p: Vec3| self.unit.from_unit(grid_to_unit(p, r));
        (out(low - margin), out(high + margin))
    }

    /// Cells that the surface passes through.
    #[must_use]
    pub fn occupied_cells(&self) -> usize {
        self.fast.cells.count()
    }

    /// Numbers that were learned.
    #[must_use]
    pub fn parameters(&self) -> usize {
        self.fast.parameters()
    }

    /// Bytes held in memory.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        size_of::<Self>() + self.fast.memory_bytes()
    }

    /// Uses the vector instructions of a level.
    pub fn set_simd(&mut self, simd: Simd) {
        self.fast.set_simd(simd);
    }

    /// The ray in grid space and the length of its direction there; `None` for a direction of no length, or numbers
    /// that are not finite.
    #[inline]
    fn to_grid(&self, x: Vec3, omega: Vec3, t_max: f32) -> Option<(GridRay, f32)> {
        let direction = omega * self.grid_scale;
        let length = direction.length();
        let origin = x * self.grid_scale + self.grid_offset;
        let usable = length > 0.0 && length.is_finite() && origin.is_finite() && t_max > 0.0;
        usable.then(|| (GridRay { origin, direction: direction / length, t_max: t_max * length }, length))
    }

    /// φ(x, ω) where 0 < φ ≤ `t_max`; distances count in lengths of ω. `None` means that nothing is seen, which is also
    /// the answer to a direction without length.
    #[inline]
    #[must_use]
    pub fn query(&self, x: Vec3, omega: Vec3, t_max: f32) -> Option<FieldHit> {
        self.query_with_doubt(x, omega, t_max).0
    }

    /// The same, and the logit of least size that was met, infinite if the ray met no occupied cell.
    #[inline]
    #[must_use]
    pub fn query_with_doubt(&self, x: Vec3, omega: Vec3, t_max: f32) -> (Option<FieldHit>, f32) {
        let Some((ray, length)) = self.to_grid(x, omega, t_max) else { return (None, f32::INFINITY) };
        let (hit, least) = self.fast.march(ray);
        let hit = hit.map(|hit| FieldHit {
            distance: hit.t / length,
            logit: hit.logit,
            least_logit: hit.least_logit,
            cell: hit.cell,
            start: hit.start / length,
        });
        (hit, least)
    }

    /// ξ(x, ω): whether anything is seen.
    #[inline]
    #[must_use]
    pub fn is_visible(&self, x: Vec3, omega: Vec3) -> bool {
        self.query(x, omega, f32::INFINITY).is_some()
    }

    /// ∇ₓφ at a hit that this field gave for this ray, by exact differentiation of network and features; in units of
    /// distance along ω (|ω| = 1 gives a dimensionless gradient).
    #[must_use]
    pub fn gradient(&self, x: Vec3, omega: Vec3, hit: &FieldHit) -> Vec3 {
        let Some((ray, length)) = self.to_grid(x, omega, f32::INFINITY) else { return Vec3::ZERO };
        let (_, gradient) = self.fast.gradient(&ray, hit.cell, hit.start * length);
        gradient * (self.grid_scale / length)
    }

    /// The unit normal at a hit, towards the ray's origin: n = ∇ₓφ/|∇ₓφ| [002 eq. 3, 7]; where the gradient vanishes or
    /// points along the ray, against the ray.
    #[must_use]
    pub fn normal(&self, x: Vec3, omega: Vec3, hit: &FieldHit) -> Vec3 {
        let against = (-omega).normalize_or(Vec3::Y);
        let normal = self.gradient(x, omega, hit).normalize_or(against);
        if !normal.is_finite() {
            return against;
        }
        let facing = normal.dot(against);
        if facing > 1e-3 { normal } else { (normal + against * (1e-3 - facing)).normalize_or(against) }
    }
}
