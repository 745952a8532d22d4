//! Measured reflectance in the layout of the MERL database.

/// A measured isotropic BRDF.
#[derive(Debug)]
pub struct MeasuredBrdf {
    pub(crate) albedo: glam::Vec3,
}
