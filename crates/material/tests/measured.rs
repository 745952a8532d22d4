//! Measured tables: read, looked up, written, and refused when damaged.

mod common;

use std::f64::consts::{FRAC_PI_2, PI};
use std::path::Path;
use std::time::Instant;

use glam::{DMat3, DVec3, Vec3};
use halflight_material::test_kit::Random;
use halflight_material::{Lookup, Material, MeasuredBrdf, SurfaceInput, merl_bytes, write_merl};

const CELLS: usize = 90 * 90 * 180;

/// A file whose cell i has the stored value i + 1 in red, so that a look-up tells which cell it took.
fn numbered() -> MeasuredBrdf {
    let mut bytes: Vec<u8> = [90i32, 90, 180].iter().flat_map(|n| n.to_le_bytes()).collect();
    for i in 0..3 * CELLS {
        bytes.extend_from_slice(&((i % CELLS) as f64 + 1.0).to_le_bytes());
    }
    MeasuredBrdf::decode(&bytes, Path::new("numbered.binary"), Lookup::Nearest).expect("a whole file")
}

/// The database's reader, written from its description: angles, two rotations, three floors.
fn reader(wo: Vec3, wi: Vec3) -> usize {
    let unit = |v: Vec3| v.as_dvec3().normalize();
    let (wo, wi) = (unit(wo), unit(wi));
    let h = (wi + wo).normalize();
    let (theta_h, phi_h) = (h.z.clamp(-1.0, 1.0).acos(), h.y.atan2(h.x));
    let d: DVec3 = DMat3::from_rotation_y(-theta_h) * (DMat3::from_rotation_z(-phi_h) * wi);
    let (theta_d, mut phi_d) = (d.z.clamp(-1.0, 1.0).acos(), d.y.atan2(d.x));
    if phi_d < 0.0 {
        phi_d += PI;
    }
    let i = ((theta_h / FRAC_PI_2 * 90.0 * 90.0).sqrt() as usize).min(89);
    let j = ((theta_d / FRAC_PI_2 * 90.0) as usize).min(89);
    let k = ((phi_d / PI * 180.0) as usize).min(179);
    k + 180 * (j + 90 * i)
}

fn upper(random: &mut Random) -> Vec3 {
    let v = random.direction();
    Vec3::new(v.x, v.y, v.z.abs().max(1e-3)).normalize()
}

#[test]
fn the_nearest_look_up_takes_the_cell_that_the_databases_reader_takes() {
    let brdf = numbered();
    let mut random = Random::new(23);
    let (mut differ, pairs) = (0, 1_000_000);
    for pair in 0..pairs {
        let wo = upper(&mut random);
        let wi = match pair % 3 {
            0 => upper(&mut random),
            // Near the mirror direction, where cells are smallest, and near the view, where φ_d is least certain.
            1 => (Vec3::new(-wo.x, -wo.y, wo.z) + random.direction() * 0.01 * random.unit()).normalize(),
            _ => (wo + random.direction() * 0.05 * random.unit()).normalize(),
        };
        if wi.z <= 0.0 {
            continue;
        }
        let found = f64::from(brdf.reflectance(wo, wi).x) * 1500.0 - 1.0;
        differ += usize::from((found - reader(wo, wi) as f64).abs() > 0.5);
    }
    // The reader's own acos(z) is good to 1e-8 near the normal only, and a border is a border.
    assert!(differ <= 5, "{differ} of {pairs} look-ups take another cell");
}

#[test]
fn what_is_written_is_read_back_within_the_grids_resolution() {
    let sources =
        [(Material::diffuse(Vec3::new(0.7, 0.5, 0.2)), 1e-6), (common::metal("gold", 0.5, 0.0), 0.01)];
    for (source, allowed) in sources {
        let bsdf = source.bsdf(&SurfaceInput::default());
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("made.binary");
        write_merl(&bsdf, &path).expect("written");
        let back = MeasuredBrdf::load(&path, Lookup::Interpolated).expect("read back");
        let mut random = Random::new(2);
        let (mut error, mut sum) = (0.0f64, 0.0f64);
        for _ in 0..100_000 {
            let (wo, wi) = (upper(&mut random), upper(&mut random));
            // Beside the horizon cells are cut.
            if wo.z < 0.15 || wi.z < 0.15 {
                continue;
            }
            let exact = bsdf.eval(wo, wi) / wi.z;
            error += f64::from((back.reflectance(wo, wi) - exact).abs().element_sum());
            sum += f64::from(exact.element_sum());
        }
        assert!(error < allowed * sum, "{}: a mean error of {} of the mean", source.name, error / sum);
    }
}

#[test]
fn the_nearest_look_up_returns_what_was_written_a_degree_or_two_away() {
    let f = |wo: Vec3, wi: Vec3| Vec3::new(1.0, 2.0, 3.0) * (0.1 + wo.z * wi.z);
    let bytes = merl_bytes(f);
    let back = MeasuredBrdf::decode(&bytes, Path::new("x"), Lookup::Nearest).expect("whole");
    let mut random = Random::new(9);
    let mut worst = 0f32;
    for _ in 0..10_000 {
        let (wo, wi) = (upper(&mut random), upper(&mut random));
        if wo.z > 0.5 && wi.z > 0.5 {
            worst = worst
                .max((back.reflectance(wo, wi) - f(wo, wi)).abs().max_element() / f(wo, wi).max_element());
        }
    }
    // A cell is at most 1° by 1° by 1° in difference angles and 2° in the half angle.
    assert!(worst < 0.12, "{worst}");
    // The centres of a quarter of the cells lie below the horizon.
    assert!((back.describe().invalid_fraction - 0.248).abs() < 0.001, "{}", back.describe().invalid_fraction);
}

#[test]
fn a_mirror_cannot_be_written_as_a_table() {
    let folder = tempfile::tempdir().expect("a folder");
    let error =
        write_merl(&Material::mirror().bsdf(&SurfaceInput::default()), &folder.path().join("m.binary"));
    assert!(error.expect_err("refused").to_string().contains("roughness"));
}

#[test]
fn damaged_files_are_refused_at_once_and_say_what_is_wrong() {
    let whole = merl_bytes(|_, _| Vec3::splat(0.1));
    let refuse = |bytes: &[u8], expected: &str| {
        let start = Instant::now();
        let error =
            MeasuredBrdf::decode(bytes, Path::new("bad.binary"), Lookup::Nearest).expect_err(expected);
        assert!(error.to_string().contains(expected), "{error}");
        assert!(start.elapsed().as_secs_f64() < 1.0, "{expected} took {:?}", start.elapsed());
    };
    for length in (0..12).chain([12, 13, 20, 1000, whole.len() / 2, whole.len() - 1]) {
        refuse(&whole[..length], if length < 12 { "header" } else { "cut short" });
    }
    let mut longer = whole.clone();
    longer.push(0);
    refuse(&longer, "too long");
    let header = |dimensions: [i32; 3]| {
        let mut bytes = whole.clone();
        for (place, n) in dimensions.iter().enumerate() {
            bytes[4 * place..4 * place + 4].copy_from_slice(&n.to_le_bytes());
        }
        bytes
    };
    refuse(&header([90, 90, 360]), "half that reciprocity leaves");
    refuse(&header([i32::MAX, i32::MAX, i32::MAX]), "expected 90 × 90 × 180");
    refuse(&header([-1, 0, 180]), "expected 90 × 90 × 180");
    refuse(&header([90, 90, 180].map(i32::swap_bytes)), "big-endian");
    for (value, place) in
        [(f64::NAN, 0), (f64::INFINITY, CELLS + 7), (f64::NEG_INFINITY, 3 * CELLS - 1), (1e300, 5)]
    {
        let mut bytes = whole.clone();
        bytes[12 + 8 * place..][..8].copy_from_slice(&value.to_le_bytes());
        refuse(&bytes, &format!("byte {}", 12 + 8 * place));
    }
    let mut empty = whole.clone();
    empty[12..].chunks_exact_mut(8).for_each(|v| v.copy_from_slice(&(-1f64).to_le_bytes()));
    refuse(&empty, "every cell is marked");
    let folder = tempfile::tempdir().expect("a folder");
    assert!(
        MeasuredBrdf::load(folder.path(), Lookup::Nearest)
            .expect_err("a folder")
            .to_string()
            .contains("folder")
    );
}

#[test]
fn flipped_bytes_give_a_table_or_an_error_and_never_a_number_that_is_none() {
    let mut bytes = merl_bytes(|wo, wi| Vec3::splat(0.1 + wo.z * wi.z));
    let mut random = Random::new(31);
    for round in 0..12 {
        let places: Vec<usize> = (0..4).map(|_| random.bits() as usize % bytes.len()).collect();
        let kept: Vec<u8> = places.iter().map(|&place| bytes[place]).collect();
        for &place in &places {
            bytes[if round == 0 { place % 12 } else { place }] ^= 1 << (random.bits() % 8);
        }
        if let Ok(brdf) = MeasuredBrdf::decode(&bytes, Path::new("flipped"), Lookup::Interpolated) {
            for _ in 0..1000 {
                let value = brdf.reflectance(upper(&mut random), upper(&mut random));
                assert!(value.is_finite() && value.min_element() >= 0.0);
            }
        }
        bytes[..12].copy_from_slice(&[90, 0, 0, 0, 90, 0, 0, 0, 180, 0, 0, 0]);
        places.iter().zip(kept).for_each(|(&place, byte)| bytes[place] = byte);
        bytes[..12].copy_from_slice(&[90, 0, 0, 0, 90, 0, 0, 0, 180, 0, 0, 0]);
    }
}

#[test]
fn a_packed_file_of_the_shared_data_loads_and_describes_itself() {
    let Some(path) = common::shared("brdf/blue-rubber.nbrdf.binary.xz") else { return };
    let brdf = MeasuredBrdf::load(&path, Lookup::Nearest).expect("a published table");
    let info = brdf.describe();
    println!("{info}");
    assert!((info.invalid_fraction - 0.238).abs() < 0.001);
    // The rough figure of the data's own notes: 0.045 / 0.084 / 0.165 at 10 degrees.
    let albedo = brdf.directional_albedo(10f32.to_radians());
    assert!((albedo - Vec3::new(0.045, 0.084, 0.165)).abs().max_element() < 0.005, "{albedo}");
}
