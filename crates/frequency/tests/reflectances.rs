//! Tables of ρ against lobes whose bandwidth is known.

use glam::Vec3;
use halflight_frequency::bandwidth::lobe;
use halflight_frequency::reflectance::{BytesError, ReflectanceBandwidth, Slices};

fn phong(alpha: f32) -> impl Fn(Vec3, Vec3) -> f32 + Sync {
    move |wi, wo| Vec3::new(-wi.x, -wi.y, wi.z).dot(wo).max(0.0).powf(alpha)
}

fn direction(theta: f32, phi: f32) -> Vec3 {
    Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
}

#[test]
fn cosine_lobes_have_their_bandwidth_at_the_peak() {
    for alpha in [1.0, 4.0, 16.0, 64.0, 256.0, 1024.0, 10_000.0] {
        let table = ReflectanceBandwidth::new(phong(alpha), &Slices::ISOTROPIC);
        for theta in [0.15, 0.4, 0.8] {
            for phi in [0.0, 2.0] {
                let ratio = table.at(direction(theta, phi), direction(theta, phi + std::f32::consts::PI))
                    / lobe::phong(alpha);
                eprintln!("alpha {alpha} theta {theta}: {ratio}");
                let most = if alpha < 2.0 {
                    7.0
                } else if alpha < 16.0 {
                    2.5
                } else {
                    1.95
                };
                assert!(ratio > 0.7 && ratio < most, "alpha {alpha}, theta {theta}: {ratio}");
            }
        }
    }
}

#[test]
fn a_peak_narrower_than_the_finest_texel_is_found_in_the_mirror_direction() {
    let table = ReflectanceBandwidth::new(phong(1e8), &Slices { finest: 256, ..Slices::ISOTROPIC });
    for row in 0..16 {
        let wi = direction((row as f32 + 0.5) / 16.0 * std::f32::consts::FRAC_PI_2, 0.0);
        assert!(table.at(wi, Vec3::new(-wi.x, 0.0, wi.z)) > 30.0);
    }
}

#[test]
fn a_diffuse_reflectance_and_a_black_one_do_not_vary() {
    for value in [0.3, 0.0, -1.0, f32::NAN, f32::INFINITY] {
        let table = ReflectanceBandwidth::new(|_, _| value, &Slices::ISOTROPIC);
        assert_eq!(table.largest(), 0.0, "{value}");
    }
}

#[test]
fn without_the_saving_the_table_says_the_same() {
    let slices = Slices { coarsest: 64, finest: 64, ..Slices::ANISOTROPIC };
    let full = ReflectanceBandwidth::new(phong(16.0), &slices);
    let saved = ReflectanceBandwidth::new(phong(16.0), &Slices { isotropic: true, ..slices });
    assert!(!full.is_isotropic() && full.values().len() == 16 * saved.values().len());
    for k in 0..200 {
        let wi = direction(0.1 + 0.006 * k as f32, 2.4 * k as f32);
        let mirror = Vec3::new(-wi.x, -wi.y, wi.z);
        let ratio = full.at(wi, mirror) / saved.at(wi, mirror);
        assert!((0.3..3.0).contains(&ratio), "{k}: {wi} {} {}", full.at(wi, mirror), saved.at(wi, mirror));
    }
}

#[test]
fn bytes_come_back_as_they_were_and_nothing_else_is_taken() -> Result<(), BytesError> {
    let table =
        ReflectanceBandwidth::new(phong(8.0), &Slices { coarsest: 64, finest: 64, ..Slices::ISOTROPIC });
    let bytes = table.to_bytes();
    assert_eq!(ReflectanceBandwidth::from_bytes(&bytes)?, table);
    for length in (0..bytes.len()).step_by(7) {
        assert!(ReflectanceBandwidth::from_bytes(&bytes[..length]).is_err());
    }
    for at in 0..16 {
        let mut bad = bytes.clone();
        bad[at] ^= 0x55;
        assert!(ReflectanceBandwidth::from_bytes(&bad).is_err());
    }
    for value in [f32::NAN, -1.0, f32::INFINITY] {
        let mut bad = bytes.clone();
        bad[16..20].copy_from_slice(&value.to_le_bytes());
        assert_eq!(ReflectanceBandwidth::from_bytes(&bad), Err(BytesError::Value { index: 0 }));
    }
    let longer = [bytes.as_slice(), &[0]].concat();
    assert!(matches!(ReflectanceBandwidth::from_bytes(&longer), Err(BytesError::Length { .. })));
    Ok(())
}

#[test]
fn constants_are_found_in_every_direction() {
    let table = ReflectanceBandwidth::constant(2.5);
    for wi in [Vec3::Z, Vec3::X, Vec3::NEG_Z, Vec3::NAN] {
        assert_eq!(table.at(wi, Vec3::Y), 2.5);
    }
}
