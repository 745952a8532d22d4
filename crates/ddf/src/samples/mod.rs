//! Samples of a field as data: (x, ω; φ), as [002 §V-B] collects them, and the files they are kept in.
//!
//! *Surface* sampling draws s_fc points on each face [002 eq. 9], s_dr directions from each [002 eq. 10], and s_p points
//! along each of these rays [002 eq. 11–13]; *random* sampling draws rays from the bounding sphere; *point-of-view*
//! sampling takes the pixels of cameras around the mesh. Two mistakes of the seed are mended: the barycentric weights are
//! folded, and the directions are uniform on the sphere; see `docs/errata.md`.

mod file;
mod inside;
mod scheme;

pub use file::SAMPLES_VERSION;
pub use inside::Inside;
pub use scheme::{SampleScheme, draw_samples};

use glam::Vec3;

/// One sample, in the unit sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldSample {
    /// x.
    pub origin: Vec3,
    /// ω, of unit length.
    pub direction: Vec3,
    /// φ(x, ω), infinite where nothing is seen.
    pub distance: f32,
}
