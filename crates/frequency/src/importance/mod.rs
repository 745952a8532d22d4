//! Importance samples made beforehand: per view direction a few vectors of directions with their densities.
//!
//! The lobe of a view is tabulated over cells of elevation and azimuth, its cumulative distribution inverted numerically
//! (rows, then columns), and points of a scrambled (0, 2)-sequence sent through: the first N of a vector are well
//! distributed for every N, best for powers of two. Within a cell directions are uniform, so the density is that of the
//! cell and exact: (1/N) Σ f/p is unbiased whatever f is, also for a view between those of the table, because a share of
//! [`UNIFORM`] of every density is uniform over the hemisphere.
//!
//! Source: `[001]` §3.3 ("numerical inversion of its cumulative distribution"; the sequence is ours: the seed picks at
//! random). Frames: +z = normal; a vector is made for a view in the xz-plane and turned to the real one, as
//! [`Samples::direction`] does. Error: `tests/importances.rs`.

mod invert;
mod sequence;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use invert::Inverse;
pub use sequence::point;

/// The share of every density that is uniform over the hemisphere: bounds the weight of what a cell's middle missed.
pub const UNIFORM: f32 = 0.05;

/// A direction towards light and its density.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImportanceSample {
    /// Unit vector in the frame of the table's view.
    pub direction: Vec3,
    /// Per steradian, > 0.
    pub pdf: f32,
}

/// What a table holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TableSize {
    /// Elevations of the view, from the normal to the horizon.
    pub elevations: usize,
    /// Azimuths of the view: 1 for isotropic reflectances.
    pub azimuths: usize,
    /// Vectors per view: neighbouring pixels take different ones.
    pub vectors: usize,
    /// Samples per vector.
    pub samples: usize,
    /// Rows of cells from the normal to the horizon; four times as many columns around it.
    pub rows: usize,
}

impl Default for TableSize {
    /// 2 MB, made in 0.2 s: views 2.8° apart, four vectors of 1024, cells of 0.94°.
    fn default() -> Self {
        Self { elevations: 32, azimuths: 1, vectors: 4, samples: 1024, rows: 96 }
    }
}

/// Importance samples of one reflectance.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportanceTable {
    size: TableSize,
    samples: Vec<ImportanceSample>,
}

/// A vector for one view.
#[derive(Clone, Copy, Debug)]
pub struct Samples<'a> {
    /// In the table's frame; see [`Self::direction`].
    pub samples: &'a [ImportanceSample],
    /// Cosine and sine of the turn about the normal from the table's frame to the view's.
    pub turn: Vec2,
}

impl Samples<'_> {
    /// Direction of sample `i` in the local frame in which the view was given.
    #[inline]
    #[must_use]
    pub fn direction(&self, i: usize) -> Vec3 {
        let d = self.samples[i].direction;
        let (c, s) = (self.turn.x, self.turn.y);
        Vec3::new(c * d.x - s * d.y, s * d.x + c * d.y, d.z)
    }
}

impl ImportanceTable {
    /// Tabulates `lobe(view, light)`, which need not be normalized: BRDF times cosine, as a rule. Called from many threads.
    /// Values that are negative or not finite count as zero; where a view has none at all its samples are uniform.
    /// Sizes of zero are taken as one.
    #[must_use]
    pub fn new(lobe: impl Fn(Vec3, Vec3) -> f32 + Sync, size: TableSize) -> Self {
        let size = TableSize {
            elevations: size.elevations.max(1),
            azimuths: size.azimuths.max(1),
            vectors: size.vectors.max(1),
            samples: size.samples.max(1),
            rows: size.rows.max(1),
        };
        let views = size.elevations * size.azimuths;
        let vectors: Vec<Vec<ImportanceSample>> = (0..views)
            .into_par_iter()
            .map(|index| {
                let view = size.view(index);
                let inverse = Inverse::new(|light| lobe(view, light), size.rows, 4 * size.rows);
                let draw = |i: usize| {
                    let vector = i / size.samples;
                    inverse.sample(point((i % size.samples) as u32, (index * size.vectors + vector) as u32))
                };
                (0..size.vectors * size.samples).map(draw).collect()
            })
            .collect();
        Self { size, samples: vectors.concat() }
    }

    /// What it was made with.
    #[must_use]
    pub fn size(&self) -> TableSize {
        self.size
    }

    /// Bytes that it occupies.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        size_of_val(self.samples.as_slice())
    }

    /// A vector for the view nearest to `view`, a unit vector in the local frame; `vector` is taken modulo their number.
    #[inline]
    #[must_use]
    pub fn vector(&self, view: Vec3, vector: usize) -> Samples<'_> {
        let size = &self.size;
        let share = view.z.clamp(0.0, 1.0).acos() * std::f32::consts::FRAC_2_PI;
        let elevation = ((share * size.elevations as f32) as usize).min(size.elevations - 1);
        let across = view.x.hypot(view.y);
        let (mut azimuth, mut turn) = (0, Vec2::X);
        if size.azimuths > 1 {
            let around = view.y.atan2(view.x) / std::f32::consts::TAU;
            azimuth = (((around - around.floor()) * size.azimuths as f32) as usize).min(size.azimuths - 1);
        } else if across > 1e-6 {
            turn = Vec2::new(view.x, view.y) / across;
        }
        let index = (azimuth * size.elevations + elevation) * size.vectors + vector % size.vectors;
        Samples { samples: &self.samples[index * size.samples..(index + 1) * size.samples], turn }
    }
}

impl TableSize {
    /// The direction for which vectors of view `index` are made.
    fn view(&self, index: usize) -> Vec3 {
        let share = |i: usize, n: usize| (i as f32 + 0.5) / n as f32;
        let theta = share(index % self.elevations, self.elevations) * std::f32::consts::FRAC_PI_2;
        let phi = if self.azimuths > 1 {
            share(index / self.elevations, self.azimuths) * std::f32::consts::TAU
        } else {
            0.0
        };
        Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
    }
}
