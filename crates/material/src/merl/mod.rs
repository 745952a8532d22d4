//! Measured isotropic reflectance in the layout of the MERL database.
//!
//! A file is three little-endian i32 (90, 90, 180) and three planes (red, green, blue) of 1,458,000 little-endian
//! f64 each: 34,992,012 bytes. The grid stands in `grid`; a stored value times (1, 1.15, 1.66)/1500 is the
//! reflectance per steradian; negative values mark cells that were not measured and count as zero.
//!
//! Two look-ups, chosen by name ([`Lookup`]): `Nearest` takes the cell a pair falls in, exactly as the database's
//! own reader does; `Interpolated` is linear in √θ_h, θ_d and φ_d between the centres of cells.
//!
//! Source: Matusik, Pfister, Brand & McMillan 2003, "A data-driven reflectance model".
//!
//! - `load`: reading and checking a file
//! - `grid`, `coordinates`: where a pair of directions lies, by definition and quickly
//! - `lookup`: the two look-ups
//! - `sampling`: choosing directions in proportion to the lobe
//! - `write`: any material, written as such a file
//! - `info`: a description in numbers

mod coordinates;
mod grid;
mod info;
mod load;
mod lookup;
mod sampling;
mod write;

use std::path::{Path, PathBuf};

use glam::{Vec2, Vec3};

pub use info::{AlbedoAt, MeasuredInfo};
pub use lookup::Lookup;
pub use write::{merl_bytes, write_merl};

use crate::bsdf::BsdfSample;
use coordinates::Coordinates;
use lookup::Table;
use sampling::{LobeTable, View};

/// A measured isotropic BRDF, with what is needed to sample it. Takes 19 MB.
#[derive(Debug)]
pub struct MeasuredBrdf {
    name: String,
    file: Option<PathBuf>,
    table: Table,
    lobes: LobeTable,
    invalid_cells: usize,
}

impl MeasuredBrdf {
    fn build(name: String, table: Table, invalid_cells: usize) -> Self {
        let lobes = LobeTable::build(&table);
        Self { name, file: None, table, lobes, invalid_cells }
    }

    /// The name of the file without its folder.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The file it was loaded from, if it was.
    pub fn file(&self) -> Option<&Path> {
        self.file.as_deref()
    }

    /// What the table holds, cell by cell: all that the reflectance depends on, beside the look-up.
    pub fn values(&self) -> &[[f32; 3]] {
        self.table.values()
    }

    /// Which look-up it was loaded for.
    pub fn lookup(&self) -> Lookup {
        self.table.lookup()
    }

    /// The reflectance per steradian, without the cosine, for directions above the surface; see
    /// [`Bsdf`](crate::Bsdf) for the frame.
    pub fn reflectance(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        if wo.z > 0.0 && wi.z > 0.0 { self.table.at(&Coordinates::of(wo, wi), wo, wi) } else { Vec3::ZERO }
    }

    /// What a uniform light of radiance one is returned as, towards a view at `theta` (radians) from the normal.
    /// More than one where the table itself returns more light than it gets.
    pub fn directional_albedo(&self, theta: f32) -> Vec3 {
        self.lobes.directional_albedo(theta)
    }

    #[inline]
    pub(crate) fn eval(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        self.table.at(&Coordinates::of(wo, wi), wo, wi) * wi.z
    }

    #[inline]
    pub(crate) fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        self.eval_pdf_for(&View::of(wo), wo, wi)
    }

    #[inline]
    fn eval_pdf_for(&self, view: &View, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        let at = Coordinates::of(wo, wi);
        (self.table.at(&at, wo, wi) * wi.z, self.lobes.pdf(view, wi, &at))
    }

    #[inline]
    pub(crate) fn sample(&self, wo: Vec3, u_lobe: f32, u: Vec2) -> Option<BsdfSample> {
        let view = View::of(wo);
        let wi = self.lobes.sample(&view, wo, u_lobe, u)?;
        BsdfSample::scattered(wi, self.eval_pdf_for(&view, wo, wi))
    }

    pub(crate) fn albedo_straight_on(&self) -> Vec3 {
        self.directional_albedo(0.0).min(Vec3::ONE)
    }
}
