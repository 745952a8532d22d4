//! Samplers, densities and values agree.

mod common;

use glam::{Vec2, Vec3};
use halflight_material::test_kit::{ChiSquare, chi_square, chi_square_of};
use halflight_material::{Material, SurfaceInput};

/// From the normal to grazing, off every axis, and from behind.
fn views() -> [Vec3; 5] {
    [
        Vec3::Z,
        Vec3::new(0.3, -0.4, 0.866).normalize(),
        Vec3::new(-0.8, 0.3, 0.4).normalize(),
        Vec3::new(0.7, 0.7, 0.06).normalize(),
        Vec3::new(0.5, 0.2, -0.6).normalize(),
    ]
}

fn check(name: &str, material: &Material, tests: usize, failures: &mut Vec<String>) {
    let input = SurfaceInput { uv: Vec2::new(0.4, 0.3), ..SurfaceInput::default() };
    let bsdf = material.bsdf(&input);
    if bsdf.is_delta_only() {
        return;
    }
    for (index, wo) in views().into_iter().enumerate() {
        let settings = ChiSquare { tests, seed: 7 + index as u64, ..ChiSquare::default() };
        let report = chi_square(&bsdf, wo, &settings);
        if !report.passes() {
            failures.push(format!("{name} seen from {wo}: {report}"));
        }
    }
}

#[test]
fn every_analytic_sampler_follows_its_density() {
    let mut failures = Vec::new();
    let materials = common::analytic();
    for known in &materials {
        check(known.name, &known.material, 5 * materials.len(), &mut failures);
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn every_measured_sampler_follows_its_density() {
    let mut failures = Vec::new();
    for (name, material) in common::measured_materials() {
        check(name, material, 5 * common::measured_materials().len(), &mut failures);
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn every_textured_sampler_follows_its_density() {
    let mut failures = Vec::new();
    for (name, material) in common::textured() {
        check(&name, &material, 20, &mut failures);
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn every_sampler_of_a_mix_follows_its_density() {
    let mut failures = Vec::new();
    for (name, material) in common::mixed() {
        check(&name, &material, 5 * common::mixed().len(), &mut failures);
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn the_test_itself_sees_an_exponent_that_is_told_wrongly_by_a_tenth_and_a_factor_of_a_twentieth() {
    let material = |exponent: f32| Material::phong(Vec3::ZERO, Vec3::ONE, exponent);
    let (drawn, told) = (material(30.0), material(33.0));
    let input = SurfaceInput::default();
    let (drawn, told, wo) = (drawn.bsdf(&input), told.bsdf(&input), Vec3::Z);
    let sampler = |u_lobe, u| drawn.sample(wo, u_lobe, u).map(|sample| sample.wi);
    let settings = ChiSquare::default();
    assert!(chi_square_of(sampler, |wi| drawn.pdf(wo, wi), &settings).passes());
    assert!(!chi_square_of(sampler, |wi| told.pdf(wo, wi), &settings).passes());
    assert!(!chi_square_of(sampler, |wi| 0.95 * drawn.pdf(wo, wi), &settings).passes());
}
