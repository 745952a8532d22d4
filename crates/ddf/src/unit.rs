//! Where a mesh stands: its own space, the unit sphere in which errors are stated, and the grid.

use glam::Vec3;
use halflight_shape::TriangleMesh;
use serde::{Deserialize, Serialize};

/// From an object's own space to the unit sphere: u = (x − center) · scale. The center is that of the bounding box; the
/// farthest vertex comes to lie at distance 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct UnitSpace {
    /// What comes to lie at the origin.
    pub center: [f32; 3],
    /// Units for each length of the object's own space.
    pub scale: f32,
}

/// Half the side of the cube of cells, in units: a little more than the sphere's radius, so that no surface lies on the
/// border.
const HALF_CUBE: f32 = 1.02;

impl UnitSpace {
    /// The space of a mesh; `None` if its triangles have no extent or one that is not finite.
    #[must_use]
    pub fn of_mesh(mesh: &TriangleMesh) -> Option<UnitSpace> {
        let used =
            || mesh.triangles.iter().flatten().filter_map(|&v| mesh.positions.get(v as usize).copied());
        let (low, high) =
            used().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        let center = low + 0.5 * (high - low);
        let radius = used().map(|p| p.distance(center)).fold(0.0, f32::max);
        let scale = radius.recip();
        (center.is_finite() && radius > 0.0 && scale.is_finite() && scale > 0.0)
            .then_some(UnitSpace { center: center.to_array(), scale })
    }

    /// What is wrong with the numbers, as a sentence.
    ///
    /// # Errors
    /// If they are not finite, or so large or small that lengths of directions leave the range of single precision.
    pub fn check(&self) -> Result<(), String> {
        let center = Vec3::from(self.center);
        let radius = self.scale.recip();
        if !center.is_finite() || !(1e-15..=1e15).contains(&radius) || center.abs().max_element() > 1e15 {
            return Err(format!(
                "a sphere of radius {radius:e} about {:?} holds it, where radii from 1e-15 to 1e15 and centers up to 1e15 are \
                 possible",
                self.center
            ));
        }
        Ok(())
    }

    /// How far coordinates are rounded where the object stands, as a part of its radius: large where it is small and far
    /// from the origin.
    #[must_use]
    pub fn rounding(&self) -> f32 {
        0.5 * f32::EPSILON * (Vec3::from(self.center).abs().max_element() * self.scale + 1.0)
    }

    /// A point of the object in the unit sphere.
    #[inline]
    #[must_use]
    pub fn to_unit(&self, point: Vec3) -> Vec3 {
        (point - Vec3::from(self.center)) * self.scale
    }

    /// A point of the unit sphere in the object's own space.
    #[inline]
    #[must_use]
    pub fn from_unit(&self, point: Vec3) -> Vec3 {
        point / self.scale + Vec3::from(self.center)
    }

    /// Cells for each unit.
    pub(crate) fn cells_per_unit(resolution: u32) -> f32 {
        resolution as f32 / (2.0 * HALF_CUBE)
    }

    /// The mesh in grid space, with nothing but positions and triangles.
    pub(crate) fn mesh_to_grid(&self, mesh: &TriangleMesh, resolution: u32) -> TriangleMesh {
        TriangleMesh {
            positions: mesh.positions.iter().map(|&p| unit_to_grid(self.to_unit(p), resolution)).collect(),
            triangles: mesh.triangles.clone(),
            ..TriangleMesh::default()
        }
    }

    /// The mesh in the unit sphere, with nothing but positions and triangles.
    #[must_use]
    pub fn mesh_to_unit(&self, mesh: &TriangleMesh) -> TriangleMesh {
        TriangleMesh {
            positions: mesh.positions.iter().map(|&p| self.to_unit(p)).collect(),
            triangles: mesh.triangles.clone(),
            ..TriangleMesh::default()
        }
    }
}

/// From the unit sphere to cells.
#[inline(always)]
pub(crate) fn unit_to_grid(point: Vec3, resolution: u32) -> Vec3 {
    (point + HALF_CUBE) * UnitSpace::cells_per_unit(resolution)
}

/// From cells to the unit sphere.
#[inline(always)]
pub(crate) fn grid_to_unit(point: Vec3, resolution: u32) -> Vec3 {
    point / UnitSpace::cells_per_unit(resolution) - HALF_CUBE
}

/// FNV-1a (64 bits) of the positions and triangles of a mesh, in hexadecimal digits.
#[must_use]
pub fn mesh_hash(mesh: &TriangleMesh) -> String {
    let mut hash = 0xcbf2_9ce4_8422_2325u64;
    let mut add = |word: u32| {
        for byte in word.to_le_bytes() {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    };
    mesh.positions.iter().flat_map(|p| p.to_array()).for_each(|v| add(v.to_bits()));
    mesh.triangles.iter().flatten().for_each(|&v| add(v));
    format!("{hash:016x}")
}
