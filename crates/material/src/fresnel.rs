//! How much a flat border of two media reflects.
//!
//! Exact for dielectrics and for metals (unpolarised light: the mean of both polarisations), and Schlick's
//! approximation F = F₀ + (1 − F₀)(1 − cos θ)⁵ where a scene gives a colour only.

use glam::Vec3;

/// Fresnel reflectance of a border of two dielectrics, and the cosine on the far side.
///
/// `cos_i` ≥ 0 is the cosine on the near side, `eta` the far side's index over the near side's. With total
/// reflection the cosine is zero.
pub(crate) fn dielectric(cos_i: f32, eta: f32) -> (f32, f32) {
    let sin2_t = (1.0 - cos_i * cos_i).max(0.0) / (eta * eta);
    if sin2_t >= 1.0 {
        return (1.0, 0.0);
    }
    let cos_t = (1.0 - sin2_t).sqrt();
    let parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    let perpendicular = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    let reflectance = 0.5 * (parallel * parallel + perpendicular * perpendicular);
    (reflectance.clamp(0.0, 1.0), cos_t)
}

/// Fresnel reflectance of a metal with index η + ik, seen from air.
pub(crate) fn conductor(cos_i: f32, eta: Vec3, k: Vec3) -> Vec3 {
    let cos2 = cos_i * cos_i;
    let sin2 = (1.0 - cos2).max(0.0);
    let t0 = eta * eta - k * k - Vec3::splat(sin2);
    let a2_b2 = sqrt(t0 * t0 + 4.0 * eta * eta * k * k);
    let a = sqrt(0.5 * (a2_b2 + t0));
    let t1 = a2_b2 + Vec3::splat(cos2);
    let t2 = 2.0 * cos_i * a;
    // Where a metal without extinction has the index of air, both are zero at grazing.
    let least = Vec3::splat(f32::MIN_POSITIVE);
    let perpendicular = (t1 - t2) / (t1 + t2).max(least);
    let t3 = cos2 * a2_b2 + Vec3::splat(sin2 * sin2);
    let t4 = t2 * sin2;
    let parallel = perpendicular * (t3 - t4) / (t3 + t4).max(least);
    (0.5 * (parallel + perpendicular)).clamp(Vec3::ZERO, Vec3::ONE)
}

/// Schlick 1994, from the reflectance at normal incidence.
pub(crate) fn schlick(cos_i: f32, normal: Vec3) -> Vec3 {
    let x = (1.0 - cos_i).clamp(0.0, 1.0);
    let x2 = x * x;
    normal + (Vec3::ONE - normal) * (x2 * x2 * x)
}

fn sqrt(v: Vec3) -> Vec3 {
    let v = v.max(Vec3::ZERO);
    Vec3::new(v.x.sqrt(), v.y.sqrt(), v.z.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_metal_without_extinction_is_a_dielectric() {
        for i in 0..=50 {
            let cos = i as f32 / 50.0;
            let metal = conductor(cos, Vec3::splat(1.5), Vec3::ZERO).x;
            assert!((metal - dielectric(cos, 1.5).0).abs() < 1e-5, "cos {cos}");
        }
    }

    #[test]
    fn glass_reflects_four_percent_straight_on_and_everything_at_grazing_and_beyond_the_critical_angle() {
        assert!((dielectric(1.0, 1.5).0 - 0.04).abs() < 1e-6);
        assert_eq!(dielectric(0.0, 1.5).0, 1.0);
        assert_eq!(dielectric(0.5, 1.0 / 1.5), (1.0, 0.0));
        assert!(dielectric(0.3, 1.0).0 < 1e-12);
    }
}
