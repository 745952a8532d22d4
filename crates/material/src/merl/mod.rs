//! Measured reflectance in the layout of the MERL database.

/// A measured isotropic BRDF.
#[derive(Debug)]
pub struct MeasuredBrdf {
    pub(crate) albedo: glam::Vec3,
}

impl MeasuredBrdf {
    pub(crate) fn eval_pdf(&self, _wo: glam::Vec3, wi: glam::Vec3) -> (glam::Vec3, f32) {
        crate::diffuse::Diffuse { albedo: self.albedo }.eval_pdf(wi)
    }
    pub(crate) fn sample(&self, _wo: glam::Vec3, _u_lobe: f32, u: glam::Vec2) -> Option<crate::BsdfSample> {
        crate::diffuse::Diffuse { albedo: self.albedo }.sample(u)
    }
    pub(crate) fn albedo_straight_on(&self) -> glam::Vec3 {
        self.albedo
    }
}
