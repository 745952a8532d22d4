//! The scattering of one place of a surface.

use glam::{Vec2, Vec3};

use crate::diffuse::Diffuse;

/// A direction chosen by [`Bsdf::sample`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfSample {
    /// The direction to the light, local, unit length, away from the surface.
    pub wi: Vec3,
    /// [`Bsdf::eval`] / density: what the light from there is multiplied by.
    pub weight: Vec3,
    /// The density of `wi` per solid angle over all lobes that are not delta functions, [`Bsdf::pdf`]; of a delta
    /// function the probability that it was chosen.
    pub pdf: f32,
    /// Whether the direction is the only one (a mirror's, a window's): no light sampled otherwise can add to it.
    pub delta: bool,
    /// Whether light goes through the surface.
    pub transmitted: bool,
}

/// How one place of a surface scatters: small, copied freely, with the textures looked up.
#[derive(Clone, Copy, Debug)]
pub struct Bsdf<'a> {
    lobe: Lobe,
    two_sided: bool,
    material: std::marker::PhantomData<&'a ()>,
}

#[derive(Clone, Copy, Debug)]
enum Lobe {
    Black,
    Diffuse(Diffuse),
}

impl Bsdf<'_> {
    pub(crate) fn black() -> Self {
        Self { lobe: Lobe::Black, two_sided: true, material: std::marker::PhantomData }
    }

    pub(crate) fn diffuse(diffuse: Diffuse, two_sided: bool) -> Self {
        Self { lobe: Lobe::Diffuse(diffuse), two_sided, material: std::marker::PhantomData }
    }

    /// The sign that turns `wo` to the front; `None` where nothing scatters.
    fn side(&self, wo: Vec3) -> Option<f32> {
        if wo.z > 0.0 {
            Some(1.0)
        } else if wo.z < 0.0 && self.two_sided {
            Some(-1.0)
        } else {
            None
        }
    }

    /// The scattering function times |cos θ| of `wi`; zero for delta lobes.
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        self.eval_pdf(wo, wi).0
    }

    /// The density with which [`sample`](Self::sample) chooses `wi`, per solid angle; delta lobes left out.
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.eval_pdf(wo, wi).1
    }

    /// [`eval`](Self::eval) and [`pdf`](Self::pdf) together, for little more than one of them.
    pub fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        let Some(side) = self.side(wo) else { return (Vec3::ZERO, 0.0) };
        let wi = Vec3::new(wi.x, wi.y, wi.z * side);
        match &self.lobe {
            Lobe::Diffuse(diffuse) if wi.z > 0.0 => diffuse.eval_pdf(wi),
            _ => (Vec3::ZERO, 0.0),
        }
    }

    /// Chooses a direction to look for light in. `u_lobe` chooses among lobes, `u` within; all in [0, 1).
    /// `None` where nothing is scattered.
    pub fn sample(&self, wo: Vec3, u_lobe: f32, u: Vec2) -> Option<BsdfSample> {
        let _ = u_lobe;
        let side = self.side(wo)?;
        let mut sample = match &self.lobe {
            Lobe::Black => None,
            Lobe::Diffuse(diffuse) => diffuse.sample(u),
        }?;
        sample.wi.z *= side;
        Some(sample)
    }

    /// Whether all of it are delta functions: sampling lights is then of no use.
    pub fn is_delta_only(&self) -> bool {
        matches!(self.lobe, Lobe::Black)
    }

    /// A colour that stands for the surface in the `albedo` layer of a picture.
    pub fn albedo(&self) -> Vec3 {
        match &self.lobe {
            Lobe::Black => Vec3::ZERO,
            Lobe::Diffuse(diffuse) => diffuse.albedo,
        }
    }

    /// Whether light can go through.
    pub fn transmits(&self) -> bool {
        false
    }
}
