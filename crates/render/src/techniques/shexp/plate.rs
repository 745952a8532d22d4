//! What a flat rectangle hides, such as the ground that things stand on: the field of `horizon` without heights.
//!
//! From a point at height y above the plate, the plate hides everything from straight down to the elevation of its border
//! in each azimuth, sin σ_k = −y/√(y² + b_k²). From below it is the same upside down: y_lm changes by (−1)^(l+m). Points
//! beside the plate are taken to be above or below its nearest place, which hides a little too much.

use glam::{Affine3A, Mat3, Vec2, Vec3};
use halflight_sh::{Rotation, Sh, Simd};

use super::wedge::{AZIMUTH_DIRECTIONS, AZIMUTHS, WedgeTable, border, in_harmonics};

/// A rectangle of one frame.
pub(super) struct Plate {
    /// The instance that it is; it throws no shadow on itself.
    pub(super) instance: u32,
    center: Vec3,
    /// Half the sides, along the turned x and z.
    half: Vec2,
    /// From the plate's axes (its normal +y) to the world's.
    turn: Mat3,
}

impl Plate {
    /// The square [−1, 1]² of the xy-plane where `place` puts it; `None` if it is degenerate or sheared.
    pub(super) fn new(instance: u32, place: &Affine3A) -> Option<Self> {
        let (along, across) = (Vec3::from(place.matrix3.x_axis), Vec3::from(place.matrix3.y_axis));
        let half = Vec2::new(along.length(), across.length());
        let (x, y) = (along.try_normalize()?, across.try_normalize()?);
        if x.dot(y).abs() > 1e-3 {
            return None;
        }
        let up = x.cross(y);
        Some(Self { instance, center: place.translation.into(), half, turn: Mat3::from_cols(x, up, -y) })
    }

    /// What the plate leaves visible from a point of the world, in the frame of the harmonics.
    pub(super) fn visible<const ORDER: usize>(
        &self,
        simd: Simd,
        table: &WedgeTable<ORDER>,
        point: Vec3,
    ) -> Sh<ORDER> {
        let local = self.turn.transpose() * (point - self.center);
        let height = local.y.abs();
        let middle = Vec2::new(local.x, local.z).clamp(-self.half, self.half);
        let sines: [f32; AZIMUTHS] = std::array::from_fn(|k| {
            let reach = border(-self.half, self.half, middle, AZIMUTH_DIRECTIONS[k]);
            -height / (height * height + reach * reach).sqrt().max(f32::MIN_POSITIVE)
        });
        let mut hidden = table.hidden(simd, &sines);
        if local.y < 0.0 {
            for l in 0..ORDER {
                for i in 0..2 * l + 1 {
                    // l + m is i.
                    if i % 2 == 1 {
                        hidden[l * l + i] = -hidden[l * l + i];
                    }
                }
            }
        }
        let visible = Sh::one() - hidden;
        if self.turn.abs_diff_eq(Mat3::IDENTITY, 1e-6) {
            visible
        } else {
            Rotation::from_matrix(&in_harmonics(self.turn)).apply(&visible)
        }
    }
}

#[cfg(test)]
mod tests {
    use halflight_sh::reference::sphere_quadrature;

    use super::*;
    use crate::sh_light::axes;

    #[test]
    fn a_plate_hides_what_rays_say_from_above_from_below_and_when_it_is_turned() {
        let table = WedgeTable::<4>::new();
        for turn in [Mat3::IDENTITY, Mat3::from_rotation_x(1.0) * Mat3::from_rotation_z(0.4)] {
            let place = Affine3A::from_mat3(turn * Mat3::from_cols(2.0 * Vec3::X, 1.5 * Vec3::Z, -Vec3::Y));
            let plate = Plate::new(0, &place).unwrap();
            for point in [Vec3::new(0.3, 0.5, 0.2), Vec3::new(-0.5, -0.8, 0.1)] {
                let mut truth = Sh::<4, f64>::zero();
                for (d, weight) in sphere_quadrature(96) {
                    let direction = turn * d.as_vec3();
                    let t = -point.y / d.y as f32;
                    let hit = point + d.as_vec3() * t;
                    let blocked = t > 0.0 && hit.x.abs() < 2.0 && hit.z.abs() < 1.5;
                    if !blocked {
                        truth += Sh::<4, f64>::basis(axes(direction).map(f64::from)) * weight;
                    }
                }
                let found: Sh<4, f64> = plate.visible(Simd::detect(), &table, turn * point).cast();
                let rms = (found - truth).norm() / (4.0 * std::f64::consts::PI).sqrt();
                assert!(rms < 0.02, "{point}: {rms}");
            }
        }
    }
}
