//! Queries of the fast field, in grid space.
//!
//! φ(x, ω): the ray goes from one occupied cell to the next; in each, the network is asked for the part within, a little
//! lengthened at both ends; the first that is visible ends the ray. The part, and with it the answer, does not depend on
//! where the ray began as long as it began outside the cell: there the directed eikonal ω · ∇ₓφ = −1 [002 §III] is exact
//! by construction.
//!
//! Normals by differentiation: with e and q the ends of the part and t_e the distance to its start,
//! ∇ₓφ = ∇ₓt_e + Σ_k (∂p_k/∂x)ᵀ ∂d/∂p_k, p_k = e + k/(K−1) (q − e); at a face of the cell across axis a,
//! ∂e/∂x = I − ω êₐᵀ/ω_a and ∇ₓt_e = −êₐ/ω_a; at a start within the cell I and 0.

use std::ops::ControlFlow;

use glam::{UVec3, Vec3};
use halflight_trace::Simd;
use pulp::WithSimd;

use super::encode::{Part, Table, point_gradient};
use super::network::{Answer, Parameters, answer, answer_with_gradient};
use super::shape::{FastShape, MOST_INPUTS};
use crate::grid::{Cells, Chord, Level};

/// The fast field with its grids; features in 16 bits.
#[derive(Clone, Debug)]
pub(crate) struct FastField {
    pub(crate) shape: FastShape,
    pub(crate) cells: Cells,
    pub(crate) levels: Vec<Level>,
    pub(crate) tables: Vec<Vec<i16>>,
    pub(crate) scales: Vec<f32>,
    pub(crate) network: Vec<f32>,
    /// Whether the sides of the surface were learned.
    pub(crate) sides: bool,
    arch: pulp::Arch,
}

/// A hit in grid space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GridHit {
    /// Distance from the ray's origin, in cells.
    pub(crate) t: f32,
    /// Where the part that answered starts on the ray.
    pub(crate) start: f32,
    /// Its cell.
    pub(crate) cell: UVec3,
    /// Logit of visibility.
    pub(crate) logit: f32,
    /// The logit nearest to 0 among the cells that were passed, with this one.
    pub(crate) least_logit: f32,
    /// Whether the back of the surface is seen.
    pub(crate) back: bool,
}

/// Backs farther along a ray than this are not those of the surface that it leaves, in cells.
const MOST_SKIN: f32 = 1.0;

/// A ray in grid space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GridRay {
    pub(crate) origin: Vec3,
    pub(crate) direction: Vec3,
    pub(crate) t_max: f32,
    /// How far from the surface a ray may start that leaves it, in cells: see [`March::is_own_skin`].
    pub(crate) skin: f32,
}

/// The part of a ray in a cell. `None` where the ray ends before it.
#[inline(always)]
pub(crate) fn part_of(ray: &GridRay, chord: &Chord, margin: f32) -> Option<(Part, f32)> {
    let start = (chord.enter - margin).max(0.0);
    let end = chord.leave + margin;
    let part = Part {
        cell: chord.cell,
        start: ray.origin + ray.direction * start,
        direction: ray.direction,
        length: end - start,
    };
    (start < ray.t_max).then_some((part, start))
}

/// The vectors of a level.
pub(crate) fn arch_of(simd: Simd) -> pulp::Arch {
    match simd {
        Simd::Baseline => pulp::Arch::Scalar,
        #[cfg(target_arch = "x86_64")]
        Simd::Avx2 => pulp::x86::V3::try_new().map_or(pulp::Arch::Scalar, pulp::Arch::V3),
        _ => pulp::Arch::new(),
    }
}

#[derive(Clone, Copy)]
struct March<'a> {
    field: &'a FastField,
    ray: GridRay,
}

impl WithSimd for March<'_> {
    type Output = (Option<GridHit>, f32);
    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) -> Self::Output {
        match (S::F32_LANES > 1, self.field.shape.features) {
            (false, 4) => self.run::<S, false, 4>(simd),
            (false, _) => self.run::<S, false, 8>(simd),
            (true, 4) => self.run::<S, true, 4>(simd),
            (true, _) => self.run::<S, true, 8>(simd),
        }
    }
}

impl March<'_> {
    #[inline(always)]
    fn run<S: pulp::Simd, const FUSED: bool, const F: usize>(self, simd: S) -> (Option<GridHit>, f32) {
        let (field, ray) = (self.field, self.ray);
        let mut tables: [&[i16]; super::shape::MOST_LEVELS] = [&[]; super::shape::MOST_LEVELS];
        tables.iter_mut().zip(&field.tables).for_each(|(to, from)| *to = from);
        let tables = &tables[..field.levels.len()];
        let mut least = f32::INFINITY;
        // A hit behind the end of its cell is the next cell's to answer, if that sees it.
        let mut pending: Option<GridHit> = None;
        let found = field.cells.walk(ray.origin, ray.direction, 0.0, ray.t_max, |chord| {
            let Some((mut part, mut start)) = part_of(&ray, &chord, field.shape.margin) else {
                return ControlFlow::Break(pending);
            };
            if pending.is_some_and(|hit| chord.enter > hit.t) {
                return ControlFlow::Break(pending);
            }
            let ask = |part: &Part| {
                answer::<S, FUSED, F, [i16]>(
                    simd,
                    &field.shape,
                    &field.levels,
                    tables,
                    &field.scales,
                    &field.network,
                    part,
                )
            };
            let mut said = ask(&part);
            // On behind the surface, where the same cell may hold another.
            while start < MOST_SKIN && self.is_own_skin(&part, start, &said) {
                let by = said.distance.max(0.0) + 0.5 * ray.skin;
                start += by;
                part.start += ray.direction * by;
                part.length -= by;
                if part.length <= 0.0 {
                    return ControlFlow::Continue(());
                }
                said = ask(&part);
            }
            if said.logit.abs() < least.abs() {
                least = said.logit;
            }
            if said.logit > 0.0 {
                let t = start + said.distance.clamp(0.0, part.length);
                let back = field.sides && said.side < 0.0;
                let hit = GridHit { t, start, cell: chord.cell, logit: said.logit, least_logit: least, back };
                if t > chord.leave && pending.is_none() {
                    pending = Some(hit);
                    return ControlFlow::Continue(());
                }
                return ControlFlow::Break(Some(hit));
            }
            if pending.is_some() { ControlFlow::Break(pending) } else { ControlFlow::Continue(()) }
        });
        let found = found.unwrap_or(pending);
        (found.filter(|hit| hit.t > 0.0 && hit.t <= ray.t_max), least)
    }
}

impl March<'_> {
    /// Whether a back that is met right at the start is that of the surface which the ray leaves: rays start where a field
    /// that errs says that the surface is, off it by the error of most hits, and some start behind it. Those lie within
    /// a few times that error of the back that they see.
    fn is_own_skin(&self, part: &Part, start: f32, said: &Answer) -> bool {
        let ray = &self.ray;
        let seen_back = self.field.sides && said.logit > 0.0 && said.side < 0.0;
        let at = start + said.distance;
        if !seen_back || at > MOST_SKIN || ray.skin <= 0.0 {
            return false;
        }
        let gradient = self.field.gradient(ray, part.cell, start).1;
        let across = gradient.normalize_or(ray.direction).dot(ray.direction).abs();
        at * across < ray.skin
    }
}

impl FastField {
    pub(crate) fn new(
        shape: FastShape,
        cells: Cells,
        tables: Vec<Vec<i16>>,
        scales: Vec<f32>,
        network: Vec<f32>,
    ) -> FastField {
        let levels = shape.levels.iter().map(|&shift| Level::new(&cells, shift)).collect();
        FastField { shape, cells, levels, tables, scales, network, sides: false, arch: pulp::Arch::new() }
    }

    /// From what was learned, rounding features to 16 bits of the largest of each grid.
    pub(crate) fn rounded(shape: &FastShape, cells: &Cells, parameters: &Parameters) -> FastField {
        let (mut tables, mut scales) = (Vec::new(), Vec::new());
        for table in &parameters.tables {
            let most = table.iter().fold(0.0f32, |most, v| most.max(v.abs()));
            let scale = if most > 0.0 { most / 32767.0 } else { 1.0 };
            scales.push(scale);
            tables.push(table.iter().map(|v| (v / scale).round() as i16).collect());
        }
        FastField::new(shape.clone(), cells.clone(), tables, scales, parameters.network.clone())
    }

    /// The first hit, and of the logits that were met the one nearest to 0 (infinite if none was).
    #[inline]
    pub(crate) fn march(&self, ray: GridRay) -> (Option<GridHit>, f32) {
        self.arch.dispatch(March { field: self, ray })
    }

    pub(crate) fn set_simd(&mut self, simd: Simd) {
        self.arch = arch_of(simd);
    }

    fn tables(&self) -> Vec<&[i16]> {
        self.tables.iter().map(Vec::as_slice).collect()
    }

    /// What the network says of a part, with the derivative of φ by the ray's origin.
    pub(crate) fn gradient(&self, ray: &GridRay, cell: UVec3, start: f32) -> (Answer, Vec3) {
        let d = ray.direction;
        // The chord of the cell again, and the faces at its ends.
        let (low, high) = (cell.as_vec3(), cell.as_vec3() + 1.0);
        let (mut leave, mut leave_axis, mut enter, mut enter_axis) = (f32::INFINITY, 0, f32::NEG_INFINITY, 0);
        for axis in 0..3 {
            if d[axis].abs() < 1e-9 {
                continue;
            }
            let (near, far) = if d[axis] > 0.0 { (low, high) } else { (high, low) };
            let (a, b) =
                ((near[axis] - ray.origin[axis]) / d[axis], (far[axis] - ray.origin[axis]) / d[axis]);
            if a > enter {
                (enter, enter_axis) = (a, axis);
            }
            if b < leave {
                (leave, leave_axis) = (b, axis);
            }
        }
        let end = leave + self.shape.margin;
        let part = Part { cell, start: ray.origin + d * start, direction: d, length: (end - start).max(0.0) };
        let by_plane = |axis: usize| {
            let mut v = Vec3::ZERO;
            v[axis] = -1.0 / d[axis];
            v
        };
        // ∇t of the two ends; a start on the ray's own origin stays with it.
        let grad_start = if start > 0.0 && enter.is_finite() { by_plane(enter_axis) } else { Vec3::ZERO };
        let grad_end = if leave.is_finite() { by_plane(leave_axis) } else { Vec3::ZERO };
        let mut by_inputs = [0.0; MOST_INPUTS];
        let tables = self.tables();
        match self.shape.features {
            4 => self.chain::<4, [i16]>(&part, &tables, &mut by_inputs, grad_start, grad_end),
            _ => self.chain::<8, [i16]>(&part, &tables, &mut by_inputs, grad_start, grad_end),
        }
    }

    fn chain<const F: usize, T: Table + ?Sized>(
        &self,
        part: &Part,
        tables: &[&T],
        by_inputs: &mut [f32; MOST_INPUTS],
        grad_start: Vec3,
        grad_end: Vec3,
    ) -> (Answer, Vec3) {
        let (shape, levels) = (&self.shape, &self.levels);
        let (said, corners) =
            answer_with_gradient::<F, T>(shape, levels, tables, &self.scales, &self.network, part, by_inputs);
        let width = shape.used_inputs();
        let (by_point, by_length) =
            point_gradient::<F, T>(shape, levels, tables, &self.scales, &corners, part, &by_inputs[..width]);
        let mut sum = grad_start + by_length * (grad_end - grad_start);
        for (k, &g) in by_point[..shape.points].iter().enumerate() {
            let s = k as f32 / (shape.points - 1) as f32;
            // p_k = x + t_k ω with t_k = (1 − s) t_e + s t_q.
            let grad_t = grad_start.lerp(grad_end, s);
            sum += g + grad_t * g.dot(part.direction);
        }
        (said, sum)
    }

    /// Bytes held.
    pub(crate) fn memory_bytes(&self) -> usize {
        let levels: usize = self.levels.iter().map(Level::memory_bytes).sum();
        let tables: usize = self.tables.iter().map(|table| size_of_val(table.as_slice())).sum();
        self.cells.memory_bytes() + levels + tables + size_of_val(self.network.as_slice())
    }

    /// Numbers that were learned.
    pub(crate) fn parameters(&self) -> usize {
        self.network.len() + self.tables.iter().map(Vec::len).sum::<usize>()
    }
}
