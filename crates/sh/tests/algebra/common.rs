//! Random vectors, directions and rotations.

use glam::{DMat3, DQuat, DVec3};
use halflight_sh::Sh;

/// Numbers in [0, 1), the same every time.
pub(crate) struct Numbers(pub u64);

impl Numbers {
    pub(crate) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let x = self.0 ^ (self.0 >> 33);
        (x.wrapping_mul(0xff51_afd7_ed55_8ccd) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(crate) fn signed(&mut self) -> f64 {
        2.0 * self.next() - 1.0
    }

    pub(crate) fn direction(&mut self) -> DVec3 {
        loop {
            let v = DVec3::new(self.signed(), self.signed(), self.signed());
            if v.length() < 1.0 && v.length() > 0.1 {
                return v.normalize();
            }
        }
    }

    pub(crate) fn rotation(&mut self) -> DMat3 {
        DMat3::from_quat(DQuat::from_axis_angle(self.direction(), 7.0 * self.next()))
    }

    pub(crate) fn sh<const N: usize>(&mut self) -> Sh<N, f64> {
        Sh::from_fn(|_| self.signed())
    }
}

pub(crate) fn largest_difference<const N: usize>(a: &Sh<N, f64>, b: &Sh<N, f64>) -> f64 {
    a.coefficients().iter().zip(b.coefficients()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Root of the mean square over the sphere of a difference.
pub(crate) fn rms<const N: usize>(a: &Sh<N, f64>, b: &Sh<N, f64>) -> f64 {
    (*a - *b).norm() / (4.0 * std::f64::consts::PI).sqrt()
}
