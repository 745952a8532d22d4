//! Participating media: what light meets between surfaces.
//!
//! A [`Volume`] absorbs and scatters within a box, a sphere, or everywhere. Its coefficients in 1/m are σ_a and σ_s times a
//! density d(x), which is 1 or a [`DensityGrid`]; what it scatters, it does by Henyey and Greenstein's phase function. Volumes
//! that overlap add. Volumes stand still, and surfaces in them stop rays as ever.

mod grid;
mod region;

use std::sync::Arc;

use glam::Vec3;
use halflight_material::{Material, MaterialKind};

pub use grid::DensityGrid;
pub use region::Region;

/// Most volumes of a scene: rays keep the intervals of all of them in place.
pub const MOST_VOLUMES: usize = 16;

/// One medium, where it is.
#[derive(Clone, Debug)]
pub struct Volume {
    /// How the scene calls it.
    pub name: String,
    /// Where it is.
    pub region: Region,
    /// σ_a where the density is 1, 1/m.
    pub absorption: Vec3,
    /// σ_s where the density is 1, 1/m.
    pub scattering: Vec3,
    /// g, the mean cosine of scattering: −1 back, 0 all around, 1 forwards.
    pub anisotropy: f32,
    /// Density in the box of the region; `None` for 1.
    pub density: Option<Arc<DensityGrid>>,
}

impl Volume {
    /// σ_a + σ_s where the density is 1.
    #[inline]
    #[must_use]
    pub fn extinction(&self) -> Vec3 {
        self.absorption + self.scattering
    }

    /// The density at a point of the region.
    #[inline]
    #[must_use]
    pub fn density_at(&self, point: Vec3) -> f32 {
        match &self.density {
            None => 1.0,
            Some(grid) => {
                let (low, high) = self.region.bounds();
                grid.at((point - low) / (high - low))
            }
        }
    }

    /// The largest coefficient of any colour anywhere.
    #[inline]
    #[must_use]
    pub fn majorant(&self) -> f32 {
        self.extinction().max_element() * self.density.as_ref().map_or(1.0, |grid| grid.largest())
    }
}

/// All media of a scene.
#[derive(Clone, Debug)]
pub struct Media {
    volumes: Vec<Volume>,
    /// What points of a medium are made of as far as surfaces are concerned: nothing, and it does not shine.
    material: Material,
}

impl Default for Media {
    fn default() -> Self {
        Self::new(Vec::new())
    }
}

impl Media {
    /// These volumes; those that do nothing are left out.
    pub fn new(mut volumes: Vec<Volume>) -> Self {
        volumes.retain(|volume| volume.majorant() > 0.0);
        let material = Material {
            name: "medium".into(),
            kind: MaterialKind::Black,
            emission: None,
            two_sided: true,
            normal_map: None,
            opacity: None,
        };
        Self { volumes, material }
    }

    /// Whether there is nothing between surfaces.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.volumes.is_empty()
    }

    /// The volumes, at most [`MOST_VOLUMES`].
    pub fn volumes(&self) -> &[Volume] {
        &self.volumes
    }

    /// The material of a point in a medium.
    pub fn material(&self) -> &Material {
        &self.material
    }
}
