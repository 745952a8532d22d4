//! `shexp` beside the path-traced truth under the same light, and beside itself.

#![allow(clippy::unwrap_used)]

use halflight_render::techniques::path::{Path, PathSettings};
use halflight_render::techniques::shexp::{
    BlockerLog, Composition, ExponentialKind, GlossyForm, Shexp, ShexpSettings,
};
use halflight_render::{Budget, Film, Quiet, RenderReport, Technique};
use halflight_scene::{LoadOptions, Scene};
use halflight_shape::{SphereFitOptions, SphereSet};

/// Hills with two balls and a box over them, under a sky of four bands.
const SCENE: &str = r#"
[image]
size = [120, 80]
[camera]
origin = [0, 2.2, 5]
target = [0, 0.4, 0]
vertical_fov_degrees = 38
[environment]
type = "sky"
sun_elevation_degrees = 50
bands = 4
[material.ground]
type = "diffuse"
albedo = [0.6, 0.6, 0.6]
[material.thing]
type = "phong"
diffuse = [0.5, 0.3, 0.2]
specular = [0.2, 0.2, 0.2]
exponent = 3
[[shape]]
name = "hills"
type = "height-field"
extent = [10, 10]
posts = [129, 129]
material = "ground"
heights.type = "sum-of-sines"
heights.waves = [{ amplitude = 0.2, kx = 0.9, kz = 0.5, phase = 0.4 }, { amplitude = 0.1, kx = -1.3, kz = 1.7, phase = 2 }]
[[shape]]
name = "balls"
type = "spheres"
spheres = [[-0.9, 0.9, 0.3, 0.5], [0.1, 0.8, 0.9, 0.25]]
material = "thing"
[[shape]]
name = "box"
type = "box"
material = "thing"
transform = { scale = 0.6, translate = [1, 0.8, -0.2] }
"#;

/// Fitting is most of the time of a test, and a box needs no more.
const FEW_SPHERES: ShexpSettings = ShexpSettings { spheres: 8, ..ShexpSettings::DEFAULT };

fn scene(text: &str) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).unwrap();
    Scene::load(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn render(scene: &Scene, mut technique: impl Technique, samples: u32) -> (Film, RenderReport) {
    technique.prepare(scene, &Quiet).unwrap();
    let [width, height] = scene.image().size;
    let mut film = Film::new(width as usize, height as usize);
    let budget = Budget { samples: Some(samples), ..Budget::default() };
    let report = technique.render(&scene.at(0.0).unwrap(), &mut film, &budget, &Quiet).unwrap();
    (film, report)
}

fn pixels(film: &Film) -> Vec<f64> {
    film.image().pixels.iter().map(|p| f64::from(p[0] + p[1] + p[2]) / 3.0).collect()
}

#[test]
fn pixels_are_within_four_percent_of_path_tracing_in_the_mean_under_the_same_four_bands() {
    let scene = scene(SCENE);
    let truth = PathSettings { max_depth: 1, ..PathSettings::default() };
    let truth = pixels(&render(&scene, Path::new(truth), 128).0);
    let (film, report) = render(&scene, Shexp::new(ShexpSettings { spheres: 30, ..FEW_SPHERES }), 16);
    let found = pixels(&film);
    let relative = |(a, b): (&f64, &f64)| (a - b).abs() / b.max(1e-3);
    let mean = found.iter().zip(&truth).map(relative).sum::<f64>() / truth.len() as f64;
    println!("mean relative error {:.2} %", 100.0 * mean);
    assert!(mean < 0.04, "{mean}");
    assert!(report.notes.iter().any(|note| note.contains("4 bands")), "{:?}", report.notes);
    assert!(!report.stages.is_empty() && report.non_finite == 0);
}

#[test]
fn shading_between_the_points_of_a_lattice_changes_less_than_one_step_of_a_screen() {
    let scene = scene(SCENE);
    let with_stride = |stride| Shexp::new(ShexpSettings { stride, ..FEW_SPHERES });
    let every = pixels(&render(&scene, with_stride(1), 1).0);
    let white = every.iter().fold(0.0f64, |a, &b| a.max(b));
    // The larger the cells, the more may hide between their corners in a picture as small as this.
    for (stride, most) in [(2, 8.0), (4, 9.0), (8, 20.0)] {
        let between = pixels(&render(&scene, with_stride(stride), 1).0);
        let changed =
            every.iter().zip(&between).map(|(a, b)| (a - b).abs()).sum::<f64>() / every.len() as f64;
        println!("stride {stride}: {:.2} steps", 255.0 * changed / white);
        assert!(changed < white / 255.0, "stride {stride}: {changed} of {white}");
        let worst = every.iter().zip(&between).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        println!("stride {stride}: at worst {:.1} steps", 255.0 * worst / white);
        assert!(worst < most * white / 255.0, "stride {stride}: at worst {worst} of {white}");
    }
}

/// Mean difference of two pictures, in parts of the mean of the first.
fn difference(a: &[f64], b: &[f64]) -> f64 {
    let sum = a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f64>();
    sum / a.iter().sum::<f64>()
}

#[test]
fn the_ways_to_work_out_the_same_picture_agree() {
    let scene = scene(SCENE);
    let with = |settings: ShexpSettings| pixels(&render(&scene, Shexp::new(settings), 1).0);
    let default = with(FEW_SPHERES);
    let ways = [
        // The lobes of the scene have the exponent 3: logarithms are added unless told otherwise.
        ("triple product", 0.01, ShexpSettings { glossy: GlossyForm::TripleProduct, ..FEW_SPHERES }),
        ("sum of logarithms", 0.06, ShexpSettings { composition: Composition::Logarithms, ..FEW_SPHERES }),
        ("closed form", 0.03, ShexpSettings { blocker: BlockerLog::ClosedForm, ..FEW_SPHERES }),
        (
            "closed form by angle",
            0.02,
            ShexpSettings { blocker: BlockerLog::ClosedFormByAngle, ..FEW_SPHERES },
        ),
        ("exact exponential", 0.02, ShexpSettings { exponential: ExponentialKind::Exact, ..FEW_SPHERES }),
        ("hybrid exponential", 0.02, ShexpSettings { exponential: ExponentialKind::Hybrid, ..FEW_SPHERES }),
        ("unclamped", 1e-3, ShexpSettings { clamp: false, ..FEW_SPHERES }),
    ];
    for (name, most, settings) in ways {
        let changed = difference(&default, &with(settings));
        println!("{name}: {:.2} %", 100.0 * changed);
        assert!(changed < most, "{name}: {changed}");
    }
}

#[test]
fn groups_of_spheres_seen_from_afar_may_stand_for_them() {
    let mut balls = String::new();
    for i in 0..600 {
        let at = |step: f32| (i as f32 * step).fract();
        balls +=
            &format!("[{}, {}, {}, 0.03],", 4.0 * at(0.618) - 2.0, 0.3 + at(0.414), 4.0 * at(0.732) - 2.0);
    }
    let text = SCENE.replace("[[-0.9, 0.9, 0.3, 0.5], [0.1, 0.8, 0.9, 0.25]]", &format!("[{balls}]"));
    let scene = scene(&text);
    let with_cut =
        |cut_degrees| pixels(&render(&scene, Shexp::new(ShexpSettings { cut_degrees, ..FEW_SPHERES }), 1).0);
    let all = with_cut(0.0);
    for (cut, most) in [(2.0, 0.002), (8.0, 0.01)] {
        let changed = difference(&all, &with_cut(cut));
        println!("{cut} degrees: {:.3} %", 100.0 * changed);
        assert!(changed < most, "{cut} degrees: {changed}");
    }
}

#[test]
fn spheres_that_are_stored_beside_a_mesh_are_taken_and_foreign_ones_are_not() {
    let folder = tempfile::tempdir().unwrap();
    let box_of = |height: f32| {
        let corner = |i: u32| {
            let at = |bit: u32| (i >> bit & 1) as f32;
            format!("v {} {} {}\n", at(0), at(1) * height, at(2))
        };
        let faces = ["1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6"];
        (0..8).map(corner).chain(faces.iter().map(|face| format!("f {face}\n"))).collect::<String>()
    };
    let load = || {
        let text = "
            environment = \"studio\"
            [image]
            size = [24, 16]
            [camera]
            origin = [3, 3, 5]
            target = [0.5, 0.5, 0.5]
            [[shape]]
            name = \"crate\"
            type = \"mesh\"
            file = \"crate.obj\"
        ";
        std::fs::write(folder.path().join("scene.toml"), text).unwrap();
        Scene::load(&folder.path().join("scene.toml"), &LoadOptions::default()).unwrap()
    };
    let notes = |scene: &Scene| render(scene, Shexp::new(FEW_SPHERES), 1).1.notes.join("\n");
    std::fs::write(folder.path().join("crate.obj"), box_of(1.0)).unwrap();
    let scene = load();
    let fitted = render(&scene, Shexp::new(FEW_SPHERES), 1).0.image();
    let options = SphereFitOptions { spheres: FEW_SPHERES.spheres as usize, ..SphereFitOptions::default() };
    let (set, _) = SphereSet::fit_surface(&scene.rest_surface(0).unwrap(), &options).unwrap();
    set.save(&folder.path().join("crate.spheres")).unwrap();
    assert!(notes(&scene).contains("the spheres of crate are from"), "{}", notes(&scene));
    assert_eq!(render(&scene, Shexp::new(FEW_SPHERES), 1).0.image(), fitted);
    let more = ShexpSettings { spheres: 5, ..FEW_SPHERES };
    assert!(render(&scene, Shexp::new(more), 1).1.notes.join(" ").contains("fitted anew"));
    // Spheres of another mesh, and a damaged file, which is said, are as good as none.
    std::fs::write(folder.path().join("crate.obj"), box_of(2.0)).unwrap();
    assert!(!notes(&load()).contains("crate.spheres"));
    std::fs::write(folder.path().join("crate.spheres"), "{").unwrap();
    assert!(notes(&load()).contains("spheres are fitted anew"), "{}", notes(&load()));
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let scene = scene(SCENE);
    let with_threads = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| render(&scene, Shexp::new(FEW_SPHERES), 2).0.image().pixels)
    };
    assert_eq!(with_threads(1), with_threads(3));
}

#[test]
fn a_scene_without_an_environment_is_refused_with_advice_and_one_without_shapes_is_its_sky() {
    let dark =
        scene("environment = \"black\"\n[[light]]\ntype = \"point\"\nposition = [0, 2, 0]\nintensity = 3\n");
    let mut technique = Shexp::new(ShexpSettings::default());
    technique.prepare(&dark, &Quiet).unwrap();
    let refusal = technique
        .render(&dark.at(0.0).unwrap(), &mut Film::new(8, 8), &Budget::default(), &Quiet)
        .unwrap_err()
        .to_string();
    assert!(refusal.contains("path"), "{refusal}");
    let empty = scene("[image]\nsize = [16, 16]\n[environment]\ntype = \"constant\"\ncolor = 0.5\n");
    let (film, _) = render(&empty, Shexp::new(ShexpSettings { order: 6, ..ShexpSettings::default() }), 1);
    assert!(pixels(&film).iter().all(|p| (p - 0.5).abs() < 1e-3));
}
