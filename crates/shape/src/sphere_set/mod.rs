//! Sphere sets: a few spheres that stand for a mesh where soft shadows are concerned.
//!
//! A set covers the surface of its mesh with as little volume outside of it as n spheres allow, so that both block
//! nearly the same directions. Spheres remember the joints of the surface they cover, and so follow a skinned
//! figure; nothing needs to be fitted again when it moves.
//!
//! | file | what it does |
//! |---|---|
//! | `fit` | the variational fit: cover, refit, teleport, grow |
//! | `start` | first spheres, on the medial axis |
//! | `cover` | which sphere covers which points, and at what cost |
//! | `refit` | the best centre for a sphere that must enclose given points |
//! | `solid` | what is inside the mesh: voxels, and the volume of a ball outside of them |
//! | `sheets` | parts of open meshes that enclose nothing |
//! | `points` | points on the surface and within |
//! | `follow` | the surface of a model at rest with its joints; posing |
//! | `measure` | outside volume and coverage of any set |
//! | `silhouette` | agreement of outlines |
//! | `tree` | a hierarchy whose nodes stand for their spheres, cut by solid angle |
//! | `store` | the `.spheres` file |
//!
//! Source: Wang, Zhou, Snyder, Liu, Bao, Peng, Guo, *Variational Sphere Set Approximation for Solid Objects* (The
//! Visual Computer 22, 2006), with voxels in place of its closed forms, so that open meshes and meshes of many parts
//! take the same road.
//!
//! ```
//! use halflight_shape::{SphereFitOptions, SphereSet, procedural::mesh};
//! let capsule = mesh::capsule([0.0, 0.0, 0.0].into(), [0.0, 2.0, 0.0].into(), 0.5, 32);
//! let (set, report) = SphereSet::fit("capsule", &capsule, &SphereFitOptions { spheres: 5, ..Default::default() })?;
//! assert_eq!(set.len(), 5);
//! assert!(report.measure.coverage.uncovered < 0.01);
//! # Ok::<(), halflight_shape::SphereFitError>(())
//! ```

mod cover;
mod error;
mod fit;
mod follow;
mod measure;
mod points;
mod refit;
mod sheets;
mod silhouette;
mod solid;
mod start;
mod store;
mod tree;

use glam::{Affine3A, Vec3};

pub use error::SphereFitError;
pub use fit::{MAX_SPHERES, SphereFitOptions, SphereFitReport};
pub use follow::RestSurface;
pub use measure::{SphereCoverage, SphereMeasure};
pub use silhouette::SilhouetteAgreement;
pub use store::SPHERES_VERSION;
pub use tree::{SphereTree, SphereTreeNode};

/// Spheres that stand for a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SphereSet {
    /// The name of the mesh or model.
    pub name: String,
    /// The content hash of the surface the set was fitted to: [`RestSurface::hash`].
    pub mesh_hash: u64,
    /// Centres, in metres, in the frame of the surface.
    pub centers: Vec<Vec3>,
    /// Radii, in metres, as many as centres.
    pub radii: Vec<f32>,
    /// What moves each sphere; empty for a set that only moves as a whole.
    pub influences: Vec<SphereInfluences>,
}

/// The joints that move a sphere: up to four, with weights that sum to 1; unused entries weigh 0.
///
/// A joint is a node of the model: see [`RestSurface`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphereInfluences {
    /// Nodes of the model.
    pub joints: [u16; 4],
    /// Their weights.
    pub weights: [f32; 4],
}

impl SphereSet {
    /// How many spheres there are.
    pub fn len(&self) -> usize {
        self.centers.len()
    }

    /// Whether there is no sphere.
    pub fn is_empty(&self) -> bool {
        self.centers.is_empty()
    }

    /// Centres with their radii.
    pub fn spheres(&self) -> impl ExactSizeIterator<Item = (Vec3, f32)> + '_ {
        self.centers.iter().copied().zip(self.radii.iter().copied())
    }

    /// Least and greatest coordinates; `None` if there is no sphere.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        self.spheres().map(|(c, r)| (c - r, c + r)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
    }

    /// The set moved by a rigid transform or one of uniform scale, with its influences. Where the scale is uneven,
    /// radii go by its mean: the third root of the determinant's magnitude.
    #[must_use]
    pub fn transformed(&self, transform: &Affine3A) -> Self {
        let scale = mean_scale(transform);
        Self {
            centers: self.centers.iter().map(|c| transform.transform_point3(*c)).collect(),
            radii: self.radii.iter().map(|r| r * scale).collect(),
            ..self.clone()
        }
    }

    /// The set moved by its joints; `matrices[j]` takes the rest pose of joint j to where it is now, as
    /// [`crate::Model::rest_to_pose`] gives them. A set without influences stays where it is.
    ///
    /// c' = Σ w_i M_i c and r' = r Σ w_i |det M_i|^⅓: the mean scale is taken of each matrix, for a blend of two
    /// rotations shrinks and the sphere should not.
    #[must_use]
    pub fn posed(&self, matrices: &[Affine3A]) -> Self {
        let mut posed = self.clone();
        self.pose_into(matrices, &mut posed.centers, &mut posed.radii);
        posed
    }

    /// As [`SphereSet::posed`], into given arrays of the same length, without allocation. A joint without a matrix
    /// and a sphere that would leave the finite numbers stay where they are.
    pub fn pose_into(&self, matrices: &[Affine3A], centers: &mut [Vec3], radii: &mut [f32]) {
        let targets = centers.iter_mut().zip(radii);
        for (i, ((center, radius), target)) in self.spheres().zip(targets).enumerate() {
            (*target.0, *target.1) = (center, radius);
            let Some(influences) = self.influences.get(i) else { continue };
            let (mut moved, mut scale) = (Vec3::ZERO, 0.0);
            for (&joint, &weight) in influences.joints.iter().zip(&influences.weights) {
                if weight != 0.0 {
                    let matrix = matrices.get(joint as usize).unwrap_or(&Affine3A::IDENTITY);
                    moved += weight * matrix.transform_point3(center);
                    scale += weight * mean_scale(matrix);
                }
            }
            if moved.is_finite() && (radius * scale).is_finite() {
                (*target.0, *target.1) = (moved, radius * scale);
            }
        }
    }
}

/// The factor by which volumes grow, per dimension.
fn mean_scale(transform: &Affine3A) -> f32 {
    transform.matrix3.determinant().abs().cbrt()
}

#[cfg(test)]
mod tests;
