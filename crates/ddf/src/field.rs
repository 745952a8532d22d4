//! A learned field, asked in the object's own space.

use glam::{UVec3, Vec3};
use halflight_trace::Simd;
use serde::{Deserialize, Serialize};

use crate::fast::field::{FastField, GridRay};
use crate::fast::shape::FastShape;
use crate::seed::field::{BOUND, UnitHit};
use crate::seed::{SeedNetwork, SeedShape};
use crate::unit::{UnitSpace, grid_to_unit, unit_to_grid};
use rayon::prelude::*;

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
    pub(crate) form: Form,
    unit: UnitSpace,
    /// Object to grid: g = (x − center) · scale + offset. The center is taken off first, or else the place of an object
    /// that stands far from the origin would be rounded twice.
    grid_scale: f32,
    grid_offset: Vec3,
    /// What training measured of itself.
    pub error: MeasuredError,
    /// Where it came from.
    pub provenance: Provenance,
}

/// What was learned.
#[derive(Clone, Debug)]
pub(crate) enum Form {
    Fast(Box<FastField>),
    Seed(Box<SeedNetwork>),
}

/// The sizes of a field.
#[derive(Clone, Debug, PartialEq)]
pub enum FieldShape {
    /// Of the fast one.
    Fast(FastShape),
    /// Of the seed's network.
    Seed(SeedShape),
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
    /// Whether it is the back of the surface, by the winding of the mesh, that is seen; never where
    /// [`DirectedField::knows_sides`] says no.
    pub back: bool,
}

impl FieldHit {
    /// The cell that answered, as one number.
    #[must_use]
    pub fn cell_number(&self) -> u32 {
        self.cell.x | self.cell.y << 9 | self.cell.z << 18
    }
}

/// Rays that leave a surface start within so many times the 95th percentile of the error across it.
const SKIN: f32 = 3.0;

/// The cell of a number.
pub(crate) fn cell_of_number(number: u32) -> UVec3 {
    UVec3::new(number & 511, number >> 9 & 511, number >> 18 & 511)
}

fn of_seed(hit: &UnitHit, length: f32) -> FieldHit {
    FieldHit {
        distance: hit.t / length,
        logit: hit.logit,
        least_logit: hit.logit,
        cell: UVec3::ZERO,
        start: hit.start / length,
        back: false,
    }
}

impl DirectedField {
    pub(crate) fn new(fast: FastField, unit: UnitSpace) -> DirectedField {
        let r = fast.shape.resolution;
        let grid_scale = unit.scale * UnitSpace::cells_per_unit(r);
        let grid_offset = unit_to_grid(Vec3::ZERO, r);
        DirectedField {
            form: Form::Fast(Box::new(fast)),
            unit,
            grid_scale,
            grid_offset,
            error: MeasuredError::default(),
            provenance: Provenance::default(),
        }
    }

    /// The field of the seed's network, which was trained in the unit sphere of a mesh.
    #[must_use]
    pub fn of_seed(network: SeedNetwork, unit: UnitSpace) -> DirectedField {
        DirectedField {
            form: Form::Seed(Box::new(network)),
            unit,
            grid_scale: unit.scale,
            grid_offset: Vec3::ZERO,
            error: MeasuredError::default(),
            provenance: Provenance::default(),
        }
    }

    /// The sizes of the field.
    #[must_use]
    pub fn shape(&self) -> FieldShape {
        match &self.form {
            Form::Fast(fast) => FieldShape::Fast(fast.shape.clone()),
            Form::Seed(network) => FieldShape::Seed(network.shape()),
        }
    }

    /// The 95th percentile of the error across the surface, in units; of a field that was not measured, a guess that is
    /// rather too large.
    pub(crate) fn error_across(&self) -> f32 {
        if self.error.across_p95 > 0.0 { self.error.across_p95 } else { 0.1 * self.grain() }
    }

    /// Whether front and back of the surface are told apart, as light that is refracted needs it. Fields that were
    /// trained from samples, and those of the seed's network, were never told.
    #[must_use]
    pub fn knows_sides(&self) -> bool {
        matches!(&self.form, Form::Fast(fast) if fast.sides)
    }

    /// The length below which the field tells nothing apart, in units: a cell of the fast field; for the seed's network as
    /// much as a cell of the default resolution.
    pub(crate) fn grain(&self) -> f32 {
        let resolution = match &self.form {
            Form::Fast(fast) => fast.shape.resolution,
            Form::Seed(_) => FastShape::default().resolution,
        };
        1.0 / UnitSpace::cells_per_unit(resolution)
    }

    /// Whether a ray asked alone costs much more than one asked with [`DirectedField::query_many`].
    #[must_use]
    pub fn prefers_many(&self) -> bool {
        matches!(self.form, Form::Seed(_))
    }

    /// From the object's own space to the unit sphere.
    #[must_use]
    pub fn unit(&self) -> UnitSpace {
        self.unit
    }

    /// Lower and upper corner of all that can be hit, in the object's own space.
    #[must_use]
    pub fn bounds(&self) -> (Vec3, Vec3) {
        match &self.form {
            Form::Fast(fast) => {
                let (low, high) = fast.cells.bounds();
                let r = fast.shape.resolution;
                let margin = fast.shape.margin;
                let out = |p: Vec3| self.unit.from_unit(grid_to_unit(p, r));
                (out(low - margin), out(high + margin))
            }
            Form::Seed(_) => {
                (self.unit.from_unit(Vec3::splat(-BOUND)), self.unit.from_unit(Vec3::splat(BOUND)))
            }
        }
    }

    /// Cells that the surface passes through; 1 for the seed's network, which has no cells.
    #[must_use]
    pub fn occupied_cells(&self) -> usize {
        match &self.form {
            Form::Fast(fast) => fast.cells.count(),
            Form::Seed(_) => 1,
        }
    }

    /// Numbers that were learned.
    #[must_use]
    pub fn parameters(&self) -> usize {
        match &self.form {
            Form::Fast(fast) => fast.parameters(),
            Form::Seed(network) => network.parameters(),
        }
    }

    /// Bytes held in memory.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        size_of::<Self>()
            + match &self.form {
                Form::Fast(fast) => size_of::<FastField>() + fast.memory_bytes(),
                Form::Seed(network) => network.memory_bytes(),
            }
    }

    /// Uses the vector instructions of a level.
    pub fn set_simd(&mut self, simd: Simd) {
        if let Form::Fast(fast) = &mut self.form {
            fast.set_simd(simd);
        }
    }

    /// The ray in grid space (for the seed's network the unit sphere) and the length of its direction there; `None` for a
    /// direction of no length, or numbers that are not finite.
    #[inline]
    fn to_grid(&self, x: Vec3, omega: Vec3, t_max: f32) -> Option<(GridRay, f32)> {
        let direction = omega * self.grid_scale;
        let length = direction.length();
        let origin = (x - Vec3::from(self.unit.center)) * self.grid_scale + self.grid_offset;
        let usable = length > 0.0 && length.is_finite() && origin.is_finite() && t_max > 0.0;
        let skin = SKIN * self.error_across() * self.grid_scale / self.unit.scale;
        usable
            .then(|| (GridRay { origin, direction: direction / length, t_max: t_max * length, skin }, length))
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
        match &self.form {
            Form::Fast(fast) => {
                let (hit, least) = fast.march(ray);
                let hit = hit.map(|hit| FieldHit {
                    distance: hit.t / length,
                    logit: hit.logit,
                    least_logit: hit.least_logit,
                    cell: hit.cell,
                    start: hit.start / length,
                    back: hit.back,
                });
                (hit, least)
            }
            Form::Seed(network) => {
                let (hit, logit) = network.one(ray.origin, ray.direction, ray.t_max);
                (hit.map(|hit| of_seed(&hit, length)), logit)
            }
        }
    }

    /// [`DirectedField::query_with_doubt`] for many rays (x, ω) without an end.
    #[must_use]
    pub fn query_many(&self, rays: &[(Vec3, Vec3)]) -> Vec<(Option<FieldHit>, f32)> {
        let Form::Seed(network) = &self.form else {
            let one = |&(x, omega): &(Vec3, Vec3)| self.query_with_doubt(x, omega, f32::INFINITY);
            return rays.par_iter().with_min_len(64).map(one).collect();
        };
        let grid: Vec<Option<(GridRay, f32)>> =
            rays.iter().map(|&(x, omega)| self.to_grid(x, omega, f32::INFINITY)).collect();
        let asked: Vec<(Vec3, Vec3)> =
            grid.iter().flatten().map(|(ray, _)| (ray.origin, ray.direction)).collect();
        let mut said = network.many(&asked).into_iter();
        grid.into_iter()
            .map(|ray| match ray.and_then(|(_, length)| Some((length, said.next()?))) {
                Some((length, (hit, logit))) => (hit.map(|hit| of_seed(&hit, length)), logit),
                None => (None, f32::INFINITY),
            })
            .collect()
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
        let gradient = match &self.form {
            Form::Fast(fast) => fast.gradient(&ray, hit.cell, hit.start * length).1,
            Form::Seed(network) => network.gradient(ray.origin, ray.direction, hit.start * length),
        };
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
