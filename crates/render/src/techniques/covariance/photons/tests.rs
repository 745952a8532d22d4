#![allow(clippy::unwrap_used)]

use glam::Vec3;

use super::super::tests::{frame, relative_mse};
use super::super::{Covariance, CovarianceSettings, Kernel, Method as Methods};
use super::flight::Landed;
use super::kernel::{Photon, Rule};
use super::tree::Tree;
use crate::film::Film;
use crate::technique::{Budget, Quiet, Technique};
use crate::techniques::path::Path;

/// A glass ball that gathers the light of a lamp and of the sky on a table, a mirror that throws some on it.
const CAUSTIC: &str = r#"
[camera]
origin = [0, 1.4, 2.2]
target = [0, 0.1, 0]
vertical_fov_degrees = 40
[environment]
type = "constant"
color = [0.2, 0.25, 0.3]
[[light]]
type = "sphere"
position = [-1.2, 1.6, -0.6]
radius = 0.45
radiance = [9, 8, 6]
[[light]]
type = "rectangle"
position = [1.6, 1.6, 1]
target = [0, 0, 0]
size = [0.8, 0.8]
radiance = 6
[material.glass]
type = "dielectric"
ior = 1.5
[material.mirror]
type = "mirror"
[[shape]]
type = "plane"
half_extent = 3
[[shape]]
type = "sphere"
center = [-0.2, 0.35, 0]
radius = 0.35
material = "glass"
[[shape]]
type = "box"
material = "mirror"
transform = { scale = [0.1, 0.8, 0.8], translate = [0.7, 0.4, 0] }
"#;

/// A lamp in two media that overlap, with a wall that throws a shadow and reflects.
const FOG: &str = r#"
[camera]
origin = [0.2, 0.8, 3]
target = [0, 0.6, 0]
vertical_fov_degrees = 40
[environment]
type = "constant"
color = [0.05, 0.1, 0.2]
[[light]]
type = "sphere"
position = [-0.5, 1, -0.2]
radius = 0.25
radiance = [20, 15, 10]
[[medium]]
min = [-1.5, 0, -1.5]
max = [1.5, 2, 1.5]
scattering = [0.3, 0.4, 0.5]
absorption = 0.1
anisotropy = 0.4
[[medium]]
center = [0.5, 0.6, 0.2]
radius = 0.4
scattering = 1.5
anisotropy = -0.2
[[shape]]
type = "plane"
half_extent = 3
[[shape]]
type = "box"
transform = { scale = [0.1, 1, 0.8], translate = [0.1, 0.5, 0] }
[material.glass]
type = "dielectric"
ior = 1.4
[[shape]]
type = "sphere"
center = [0.6, 0.3, 0.9]
radius = 0.25
material = "glass"
"#;

const SIZE: [usize; 2] = [48, 32];

fn settings(kernel: Kernel) -> CovarianceSettings {
    CovarianceSettings {
        method: Methods::Photons,
        photons: 8192,
        kernel,
        radius: Some(0.12),
        ..CovarianceSettings::default()
    }
}

fn picture(technique: &dyn Technique, text: &str, samples: u32, seed: u64) -> Film {
    let mut film = Film::new(SIZE[0], SIZE[1]);
    let budget = Budget { samples: Some(samples), seed, ..Budget::default() };
    technique.render(&frame(text), &mut film, &budget, &Quiet).unwrap();
    film
}

fn mean(film: &Film) -> [f64; 3] {
    let pixels = film.image().pixels;
    std::array::from_fn(|c| pixels.iter().map(|p| f64::from(p[c])).sum::<f64>() / pixels.len() as f64)
}

fn goes_to_the_truth(text: &str, samples: u32) {
    let truth = picture(&Path::default(), text, samples, 99);
    for kernel in [Kernel::Covariance, Kernel::Fixed] {
        let technique = Covariance::new(settings(kernel));
        let (few, many) = (picture(&technique, text, 4, 1), picture(&technique, text, 64, 1));
        let (before, after) = (relative_mse(&few, &truth), relative_mse(&many, &truth));
        println!("{kernel:?}: relMSE {before:.5} with 4 passes, {after:.5} with 64");
        assert!(after < 0.25 * before, "{kernel:?} {before} {after}");
        for (a, b) in mean(&many).into_iter().zip(mean(&truth)) {
            assert!((a / b - 1.0).abs() < 0.015, "{kernel:?}: {:?} {:?}", mean(&many), mean(&truth));
        }
        let layer = &many.layers["photon-radius"];
        assert!(layer.iter().all(|r| r.is_finite()) && layer.iter().any(|r| *r > 0.0));
    }
}

#[test]
fn caustics_by_photons_go_to_those_of_paths() {
    goes_to_the_truth(CAUSTIC, 2048);
}

#[test]
fn fog_by_photons_goes_to_that_of_paths() {
    goes_to_the_truth(FOG, 640);
}

#[test]
fn photons_do_not_depend_on_threads() {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let technique = Covariance::new(settings(Kernel::Covariance));
    for text in [CAUSTIC, FOG] {
        let alone = one.install(|| picture(&technique, text, 2, 3));
        assert_eq!(alone, picture(&technique, text, 2, 3));
    }
}

/// Numbers in [0, 1) that look random.
fn random(state: &mut u64) -> f32 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 40) as f32 / (1u64 << 24) as f32
}

/// Without a floor of pixels.
fn covariance(pass: f32) -> Rule {
    Rule::Covariance { pass, eye: Vec3::ZERO, pixel: 0.0 }
}

fn some_photons(count: u32, in_medium: bool) -> Vec<Landed> {
    let mut state = 7;
    let mut three = || Vec3::from_array(std::array::from_fn(|_| random(&mut state)));
    (0..count)
        .map(|number| {
            let towards = (three() - 0.5).normalize_or(Vec3::Y);
            let flat = three();
            let (x, y) = towards.any_orthonormal_pair();
            let p = three() * 4e3 + 20.0;
            Landed {
                position: if in_medium { flat } else { Vec3::new(flat.x, 0.02 * flat.y, flat.z) },
                towards: if in_medium || towards.y > 0.0 { towards } else { -towards },
                power: Vec3::ONE,
                normal: if in_medium { Vec3::ZERO } else { Vec3::Y },
                anisotropy: 0.0,
                depth: 1,
                number,
                axes: [x, y],
                precision: [p.x, 0.3 * (p.x * p.y).sqrt(), p.y],
                along: p.z,
            }
        })
        .collect()
}

#[test]
fn the_tree_finds_the_photons_that_trying_all_of_them_finds() {
    let mut state = 3;
    for rule in [covariance(2.0), Rule::Fixed(0.05)] {
        for in_medium in [false, true] {
            let tree = Tree::new(some_photons(3000, in_medium), rule, None);
            let all: Vec<Photon> = tree.photons.clone();
            assert_eq!(all.len(), 3000);
            let mut hits = 0;
            for _ in 0..300 {
                let mut three = || Vec3::from_array(std::array::from_fn(|_| random(&mut state)));
                let (point, direction) = (three() * Vec3::new(1.0, 0.02, 1.0), three() - 0.5);
                let direction = direction.normalize_or(Vec3::X);
                let (mut found, mut tried) = (Vec::new(), Vec::new());
                if in_medium {
                    let origin = point - 2.0 * direction;
                    let within = [[0.2, 1.9], [2.0, 2.3]];
                    tree.beside(origin, direction, &within, |photon, amount, _| {
                        found.push((photon.number, amount));
                    });
                    tried.extend(all.iter().filter_map(|photon| {
                        let (amount, _) = photon.along(origin, direction, &within)?;
                        Some((photon.number, amount))
                    }));
                } else {
                    tree.about(point, |photon| found.push((photon.number, photon.at(point))));
                    let near = all.iter().map(|photon| (photon.number, photon.at(point)));
                    tried.extend(near.filter(|(_, amount)| *amount > 0.0));
                }
                hits += tried.len();
                assert_eq!(found, tried, "{rule:?} {in_medium}");
            }
            assert!(hits > 1000, "{hits}");
        }
    }
}

#[test]
fn a_kernel_spreads_one_photon_over_the_plane_and_over_lines_through_space() {
    for rule in [covariance(1.0), Rule::Fixed(0.05)] {
        for in_medium in [false, true] {
            let tree = Tree::new(some_photons(200, in_medium), rule, None);
            let photon = &tree.photons[17];
            let n = 400;
            let half = 1.5 * photon.extent.max_element();
            let cell = 2.0 * half / n as f32;
            let (x, y) = if in_medium { photon.towards.any_orthonormal_pair() } else { (Vec3::X, Vec3::Z) };
            let mut sum = 0.0;
            for i in 0..n * n {
                let at = |k: usize| (k as f32 + 0.5) * cell - half;
                let point = photon.position + x * at(i % n) + y * at(i / n);
                let value = if in_medium {
                    photon
                        .along(point - photon.towards, photon.towards, &[[-1e9, 1e9]])
                        .map_or(0.0, |found| found.0)
                } else {
                    photon.at(point)
                };
                sum += f64::from(value * cell * cell);
            }
            assert!((sum - 1.0).abs() < 2e-3, "{rule:?} {in_medium}: {sum}");
        }
    }
}

/// A medium of three colours in a box on the ground, lit from far away.
const HAZE: &str = r#"
[camera]
origin = [0, 1.5, 3]
target = [0, 0.1, 0]
vertical_fov_degrees = 35
[environment]
type = "constant"
color = 0.05
[[light]]
type = "directional"
direction = [0.5, -1, -0.3]
irradiance = 3
[[medium]]
min = [-2, 0, -2]
max = [2, 1.2, 2]
scattering = [0.1, 0.2, 0.4]
absorption = 0.05
[[shape]]
type = "plane"
half_extent = 4
"#;

#[test]
fn a_medium_is_as_bright_by_few_photons_as_by_paths_in_every_colour_up_to_its_borders() {
    let truth = mean(&picture(&Path::default(), HAZE, 1024, 99));
    for kernel in [Kernel::Covariance, Kernel::Fixed] {
        let technique = Covariance::new(CovarianceSettings { photons: 32768, ..settings(kernel) });
        let found = mean(&picture(&technique, HAZE, 16, 1));
        println!("{kernel:?}: {found:?} for {truth:?}");
        for (a, b) in found.into_iter().zip(truth) {
            assert!((a / b - 1.0).abs() < 0.01, "{kernel:?}: {found:?} for {truth:?}");
        }
    }
}

/// Light of a point, which smooth things gather without any blur.
fn points() -> String {
    let (head, tail) = CAUSTIC.split_once("[[light]]").unwrap();
    let (_, rest) = tail.split_once("[material.glass]").unwrap();
    format!(
        "{head}[[light]]\ntype = \"point\"\nposition = [-1.2, 2.5, 0.5]\nintensity = 8\n[material.glass]{rest}"
    )
}

#[test]
fn where_light_of_a_point_focuses_kernels_stay_wide_enough_for_their_photons() {
    let text = points();
    let fixed = |radius: f32, photons: u32, passes: u32, seed: u64| {
        let settings = CovarianceSettings { radius: Some(radius), photons, ..settings(Kernel::Fixed) };
        picture(&Covariance::new(settings), &text, passes, seed)
    };
    let truth = fixed(0.03, 262_144, 48, 9);
    // The fixed radius that is taken unless another is given: four pixels.
    let settings = |kernel| CovarianceSettings { photons: 32768, radius: None, ..settings(kernel) };
    let [by_covariance, by_fixed] = [Kernel::Covariance, Kernel::Fixed]
        .map(|kernel| picture(&Covariance::new(settings(kernel)), &text, 16, 1));
    let brightest = |film: &Film| film.image().pixels.iter().flatten().copied().fold(0.0f32, f32::max);
    let errors = [&by_covariance, &by_fixed].map(|film| relative_mse(film, &truth));
    println!("{errors:?}, brightest {} of {}", brightest(&by_covariance), brightest(&truth));
    assert!(errors[0] < errors[1], "{errors:?}");
    assert!(brightest(&by_covariance) < 1.5 * brightest(&truth));
}
