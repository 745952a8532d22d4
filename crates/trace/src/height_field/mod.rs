//! Rays against height fields, without a mesh.
//!
//! The surface is y = h(x, z) over the two triangles of each cell ([`halflight_shape::HeightField`]). A ray is
//! marched through a pyramid of the least and greatest heights of 4 × 4 blocks ([`pyramid`], [`march`]); sixteen
//! children, or sixteen cells, are tested at once. The idea of descending a min–max pyramid is Musgrave's (1988,
//! *Grid Tracing*) and Tevs, Ihrke and Seidel's (2008, *Maximum Mipmaps*).
//!
//! * Space: that of the field, y up. Primitive 2 c + w is triangle w of cell c = j (columns − 1) + i, the order of
//!   `HeightField::to_mesh`; w = 0 where fx ≥ fz. Hit parameters u and v are the fractions fx and fz within the cell.
//! * Watertight: along a ray each change of side is found, in exactly one triangle (or two at an edge).
//! * Cost: `cargo run --release -p halflight-trace --example height_field_rate` prints rays per second and build time.
//!   Memory beyond the heights, which are shared: 2/15 of theirs.

mod lanes;
mod march;
mod pyramid;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3};
use halflight_shape::HeightField;

use crate::{LocalHit, LocalSurface, Ray, RayGeometry, Simd};
use lanes::Plain;
use march::{GridHit, GridRay, Surroundings, march};

/// Cells along each side of a block of the pyramid's finest nodes.
pub(crate) const BLOCK_CELLS: usize = 16;

/// A height field that answers rays.
///
/// ```
/// use std::sync::Arc;
/// use glam::{Vec2, Vec3};
/// use halflight_shape::HeightField;
/// use halflight_trace::{HeightFieldTracer, Ray, RayGeometry};
/// let field = HeightField::new(2, 2, Vec2::ZERO, Vec2::ONE, vec![0.5; 4])?;
/// let tracer = HeightFieldTracer::build(Arc::new(field));
/// let hit = tracer.closest(&Ray::new(Vec3::new(0.75, 2.0, 0.5), Vec3::NEG_Y)).expect("the field is below");
/// assert_eq!((hit.t, hit.primitive), (1.5, 0));
/// # Ok::<(), halflight_shape::HeightFieldError>(())
/// ```
#[derive(Clone, Debug)]
pub struct HeightFieldTracer {
    field: Arc<HeightField>,
    /// At the closing of the shutter, if that differs.
    close: Option<Arc<HeightField>>,
    levels: Vec<pyramid::Level>,
    bounds: (Vec3, Vec3),
    /// Metres a cell along x and z, in the precision of the ray's set-up.
    spacing: [f64; 2],
    /// Along x and z: what turns a difference over one or two cells into a slope.
    per_metre: [[f32; 2]; 2],
    simd: Simd,
}

impl HeightFieldTracer {
    /// Builds the pyramid. Half a millisecond for 512 × 512 posts.
    ///
    /// # Panics
    /// If the field does not satisfy `HeightField::validate`.
    #[must_use]
    pub fn build(field: Arc<HeightField>) -> Self {
        Self::with_simd(field, None, Simd::detect())
    }

    /// A field whose heights change linearly over the shutter interval, from `open` to `close`.
    ///
    /// # Panics
    /// If the fields have not the same posts and extent, or do not satisfy `HeightField::validate`.
    #[must_use]
    pub fn build_moving(open: Arc<HeightField>, close: Arc<HeightField>) -> Self {
        Self::with_simd(open, Some(close), Simd::detect())
    }

    /// As [`HeightFieldTracer::build`] and [`HeightFieldTracer::build_moving`], with a level of instructions.
    ///
    /// # Panics
    /// As these.
    #[must_use]
    pub fn with_simd(field: Arc<HeightField>, close: Option<Arc<HeightField>>, simd: Simd) -> Self {
        field.validate().expect("a height field is valid");
        if let Some(close) = &close {
            close.validate().expect("a height field is valid");
            let same = (close.columns, close.rows) == (field.columns, field.rows);
            assert!(
                same && close.min == field.min && close.max == field.max,
                "a field moves over its own posts"
            );
        }
        let levels = pyramid::build(&field, close.as_deref());
        let (mut low, mut high) = field.bounds();
        if let Some(close) = &close {
            let range = close.height_range();
            (low.y, high.y) = (low.y.min(range.0), high.y.max(range.1));
        }
        let extent = (field.max.as_dvec2() - field.min.as_dvec2()).to_array();
        let spacing = [extent[0] / (field.columns - 1) as f64, extent[1] / (field.rows - 1) as f64];
        let per_metre = spacing.map(|spacing| [(1.0 / spacing) as f32, (0.5 / spacing) as f32]);
        Self { field, close, levels, bounds: (low, high), spacing, per_metre, simd: simd.or_best() }
    }

    /// The heights at the opening of the shutter.
    #[must_use]
    pub fn field(&self) -> &Arc<HeightField> {
        &self.field
    }

    /// Along x and z: what turns a difference over one or two cells into a slope.
    pub(crate) fn per_metre(&self) -> &[[f32; 2]; 2] {
        &self.per_metre
    }

    /// How many blocks of [`BLOCK_CELLS`]² cells there are.
    pub(crate) fn blocks(&self) -> usize {
        self.levels[0].nodes.len()
    }

    /// The first cell of a block, and its cells along x and z.
    pub(crate) fn block_cells(&self, block: usize) -> ([usize; 2], [usize; 2]) {
        let columns = self.levels[0].columns;
        let first = [block % columns * BLOCK_CELLS, block / columns * BLOCK_CELLS];
        let (across, along) = self.field.cells();
        (first, [(across - first[0]).min(BLOCK_CELLS), (along - first[1]).min(BLOCK_CELLS)])
    }

    /// The box around a block over the shutter interval.
    pub(crate) fn block_bounds(&self, block: usize) -> (Vec3, Vec3) {
        let ([i, j], [across, along]) = self.block_cells(block);
        let (low, high) = self.levels[0].nodes[block].range();
        let (near, far) = (self.field.post(i, j), self.field.post(i + across, j + along));
        (Vec3::new(near.x, low, near.z), Vec3::new(far.x, high, far.z))
    }

    /// Corners of a primitive at a time from 0 to 1, in the order that faces up, with their texture coordinates.
    #[must_use]
    pub fn corners(&self, primitive: u32, time: f32) -> [(Vec3, Vec2); 3] {
        let (cells_x, cells_z) = self.field.cells();
        let cell = (primitive / 2) as usize;
        let other = if primitive & 1 == 0 { [(1, 1), (1, 0)] } else { [(0, 1), (1, 1)] };
        [(0, 0), other[0], other[1]].map(|(dx, dz)| {
            let (i, j) = (cell % cells_x + dx, cell / cells_x + dz);
            let post = self.field.post(i, j);
            let uv = Vec2::new(i as f32 / cells_x as f32, j as f32 / cells_z as f32);
            (Vec3::new(post.x, self.height(i, j, time), post.z), uv)
        })
    }

    /// The height of a post at a time within the shutter.
    fn height(&self, column: usize, row: usize, time: f32) -> f32 {
        let post = row * self.field.columns + column;
        let open = self.field.heights[post];
        match &self.close {
            Some(close) => open + (close.heights[post] - open) * time.clamp(0.0, 1.0),
            None => open,
        }
    }

    /// The ray in the coordinates of the grid, where it is within the field's box (a little widened); with the
    /// distance at which that part starts and the scale from the grid's t to the ray's.
    #[inline(always)]
    fn grid_ray(&self, ray: &Ray) -> Option<(GridRay, f64, f64)> {
        let (low, high) = (self.bounds.0.as_dvec3(), self.bounds.1.as_dvec3());
        let [step_x, step_z] = self.spacing;
        let tall = (high.y - low.y).max(step_x.min(step_z));
        let reach = low.y.abs().max(high.y.abs());
        let margin = DVec3::new(1e-3 * step_x, 1e-3 * tall + 1e-5 * reach, 1e-3 * step_z);
        let (low, high) = (low - margin, high + margin);
        let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        // Directions are kept off zero, so that 0 · ∞ cannot arise: f32 directions above zero are above 1e-46.
        let off_zero = |d: f64| if d.abs() < 1e-60 { 1e-60f64.copysign(d) } else { d };
        let inverse =
            DVec3::new(1.0 / off_zero(direction.x), 1.0 / off_zero(direction.y), 1.0 / off_zero(direction.z));
        let (a, b) = ((low - origin) * inverse, (high - origin) * inverse);
        let start = a.min(b).max_element().max(0.0);
        let end = a.max(b).min_element().min(f64::from(ray.t_max));
        if start <= end {
            let origin = if start > 0.0 { origin + direction * start } else { origin };
            let low = self.bounds.0.as_dvec3();
            let direction = DVec3::new(direction.x / step_x, direction.y, direction.z / step_z);
            // Scaled to about one cell per unit; then no component along x or z may vanish, or lie so near zero that
            // divisions overflow. Over the whole field the change made here is less than a rounding.
            let pace = direction.x.abs().max(direction.z.abs()).max(direction.y.abs() / tall);
            let scale = 1.0 / pace;
            let direction = (direction * scale).as_vec3();
            let off_zero = |d: f32| if d.abs() < 1e-12 { 1e-12f32.copysign(d) } else { d };
            let grid_ray = GridRay {
                origin: [
                    ((origin.x - low.x) / step_x) as f32,
                    origin.y as f32,
                    ((origin.z - low.z) / step_z) as f32,
                ],
                direction: [off_zero(direction.x), direction.y, off_zero(direction.z)],
                starts_inside: start == 0.0,
                t_end: ((end - start) * pace * 1.001) as f32,
            };
            Some((grid_ray, start, scale))
        } else {
            None
        }
    }

    #[inline(always)]
    fn trace<T>(&self, ray: &Ray, mut take: impl FnMut(GridHit, f32) -> T) -> Option<T> {
        let (grid_ray, start, scale) = self.grid_ray(ray)?;
        let surroundings = Surroundings {
            heights: &self.field.heights,
            close: self.close.as_ref().map(|close| (close.heights.as_slice(), ray.time.clamp(0.0, 1.0))),
            columns: self.field.columns,
            rows: self.field.rows,
            levels: &self.levels,
        };
        let accept = |hit: GridHit| {
            let t = (start + f64::from(hit.t) * scale) as f32;
            (t > 0.0 && t <= ray.t_max).then(|| take(hit, t))
        };
        dispatch(self.simd, &grid_ray, &surroundings, accept)
    }
}

#[inline(always)]
fn dispatch<T>(
    simd: Simd,
    ray: &GridRay,
    field: &Surroundings<'_>,
    accept: impl FnMut(GridHit) -> Option<T>,
) -> Option<T> {
    match simd {
        #[cfg(target_arch = "x86_64")]
        Simd::Avx512 | Simd::Avx2 => wide::dispatch(simd, ray, field, accept),
        _ => march::<Plain, T>(ray, field, accept),
    }
}

/// The march compiled for wide instructions.
///
/// This module needs `unsafe` to call functions compiled for instructions that not every processor has.
#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code)]
mod wide {
    use super::lanes::{Avx2, Avx512};
    use super::{GridHit, GridRay, Simd, Surroundings, march};

    #[inline(always)]
    pub(super) fn dispatch<T>(
        simd: Simd,
        ray: &GridRay,
        field: &Surroundings<'_>,
        accept: impl FnMut(GridHit) -> Option<T>,
    ) -> Option<T> {
        // SAFETY: the tracer holds a level that `Simd::or_best` confirmed this processor to have.
        unsafe { if simd == Simd::Avx512 { avx512(ray, field, accept) } else { avx2(ray, field, accept) } }
    }

    #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
    fn avx512<T>(
        ray: &GridRay,
        field: &Surroundings<'_>,
        accept: impl FnMut(GridHit) -> Option<T>,
    ) -> Option<T> {
        march::<Avx512, T>(ray, field, accept)
    }

    #[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
    fn avx2<T>(
        ray: &GridRay,
        field: &Surroundings<'_>,
        accept: impl FnMut(GridHit) -> Option<T>,
    ) -> Option<T> {
        march::<Avx2, T>(ray, field, accept)
    }
}

impl RayGeometry for HeightFieldTracer {
    fn bounds(&self) -> (Vec3, Vec3) {
        self.bounds
    }

    fn closest(&self, ray: &Ray) -> Option<LocalHit> {
        self.trace(ray, |hit, t| {
            let cell = hit.cell[1] * (self.field.columns - 1) + hit.cell[0];
            LocalHit { t, primitive: 2 * cell as u32 + hit.which, u: hit.u, v: hit.v }
        })
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.trace(ray, |_, _| ()).is_some()
    }

    fn surface(&self, ray: &Ray, hit: &LocalHit) -> LocalSurface {
        let field = &*self.field;
        let (cells_x, cells_z) = field.cells();
        let (cell, across) = (hit.primitive / 2, cells_x as u32);
        let (i, j) = ((cell % across) as usize, (cell / across) as usize);
        let (u, v) = (hit.u, hit.v);
        let h = |dx: usize, dz: usize| self.height(i + dx, j + dz, ray.time);
        let (h00, h10, h01, h11) = (h(0, 0), h(1, 0), h(0, 1), h(1, 1));
        let lower = hit.primitive & 1 == 0;
        let (rise_x, rise_z) = if lower { (h10 - h00, h11 - h10) } else { (h11 - h01, h01 - h00) };
        let (low, high) = (field.post(i, j), field.post(i + 1, j + 1));
        let position = Vec3::new(
            low.x + u * (high.x - low.x),
            h00 + u * rise_x + v * rise_z,
            low.z + v * (high.z - low.z),
        );
        let [slope_x, slope_z] = [rise_x * self.per_metre[0][0], rise_z * self.per_metre[1][0]];
        let normal = normal_of_slopes(slope_x, slope_z);
        let shading_normal = if field.smooth {
            let post = |dx: usize, dz: usize| self.post_normal(i + dx, j + dz, ray.time);
            let (p00, p11) = (post(0, 0), post(1, 1));
            let sum = if lower {
                p00 * (1.0 - u) + post(1, 0) * (u - v) + p11 * v
            } else {
                p00 * (1.0 - v) + post(0, 1) * (v - u) + p11 * u
            };
            // Both point up, but a steep triangle's normal may still be beyond a right angle from its posts'.
            let shading = sum.normalize_or(normal);
            if shading.dot(normal) > 0.0 { shading } else { normal }
        } else {
            normal
        };
        // Interpolation makes up to six roundings of numbers no greater than these; and the march of a ray from here counts
        // cells from the field's corner in floats, wherever in the field it is.
        let extent = field.max - field.min;
        let greatest = low.abs().max(high.abs()).max(Vec3::new(extent.x, 0.0, extent.y));
        let tallest = h00.abs().max(h10.abs()).max(h01.abs()).max(h11.abs());
        LocalSurface {
            position,
            position_error: 4.0 * f32::EPSILON * greatest.x.max(greatest.z).max(tallest),
            geometric_normal: normal,
            shading_normal,
            uv: Vec2::new((i as f32 + u) / cells_x as f32, (j as f32 + v) / cells_z as f32),
            tangent: Vec3::new(1.0, slope_x, 0.0),
            handedness: 1.0,
            color: Vec3::ONE,
            material_slot: 0,
        }
    }

    fn primitives(&self) -> usize {
        let (x, z) = self.field.cells();
        2 * x * z
    }

    fn memory_bytes(&self) -> usize {
        self.levels.iter().map(|level| size_of_val(level.nodes.as_slice())).sum()
    }
}

impl HeightFieldTracer {
    /// The normal at a post at a time, from central differences.
    #[inline]
    fn post_normal(&self, column: usize, row: usize, time: f32) -> Vec3 {
        let (columns, rows) = (self.field.columns, self.field.rows);
        let (left, right) = (column.saturating_sub(1), (column + 1).min(columns - 1));
        let (far, near) = (row.saturating_sub(1), (row + 1).min(rows - 1));
        let across = self.height(right, row, time) - self.height(left, row, time);
        let along = self.height(column, near, time) - self.height(column, far, time);
        let [x, z] = self.per_metre;
        normal_of_slopes(across * x[right - left - 1], along * z[near - far - 1])
    }
}

/// The unit normal of a plane that rises by so much per metre; slopes of any size.
fn normal_of_slopes(along_x: f32, along_z: f32) -> Vec3 {
    /// Squares of larger slopes are far from the greatest float, but not for ever.
    const STEEP: f32 = 1e15;
    let normal = Vec3::new(-along_x, 1.0, -along_z);
    let greatest = normal.abs().max_element();
    if greatest < STEEP { normal.normalize() } else { (normal / greatest).normalize() }
}
