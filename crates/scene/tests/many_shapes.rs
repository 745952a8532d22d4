//! Scenes of many meshes: their trees are built side by side, and are the same for any number of threads.

use std::fmt::Write;

use glam::Vec3;
use halflight_scene::{LoadOptions, Scene};
use halflight_trace::Ray;

/// A ball of facets, as OBJ.
fn ball(rows: usize) -> String {
    let mut text = String::new();
    for j in 0..=rows {
        for i in 0..2 * rows {
            let (theta, phi) = (j as f32 / rows as f32, i as f32 / rows as f32);
            let (sin, cos) = (theta * std::f32::consts::PI).sin_cos();
            let (x, z) = (phi * std::f32::consts::PI).sin_cos();
            let _ = writeln!(text, "v {} {} {}", sin * x, cos, sin * z);
        }
    }
    let post = |i: usize, j: usize| 1 + j * 2 * rows + i % (2 * rows);
    for (i, j) in (0..rows).flat_map(|j| (0..2 * rows).map(move |i| (i, j))) {
        let _ =
            writeln!(text, "f {} {} {} {}", post(i, j), post(i, j + 1), post(i + 1, j + 1), post(i + 1, j));
    }
    text
}

fn load(balls: usize) -> Scene {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut text = String::new();
    for number in 0..balls {
        let file = format!("{number}.obj");
        std::fs::write(folder.path().join(&file), ball(16 + number % 5)).expect("the mesh is written");
        let (x, z) = ((number % 8) as f32 * 2.5, (number / 8) as f32 * 2.5);
        let _ = writeln!(
            text,
            "[[shape]]\nname = \"{number}\"\ntype = \"mesh\"\nfile = \"{file}\"\ntransform = {{ translate = [{x}, 0, {z}] }}"
        );
    }
    text += "[[shape]]\nname = \"marble\"\ntype = \"sphere\"\nradius = 0.5\n";
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).expect("the scene is written");
    Scene::load(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn a_frame_of_many_meshes_is_the_same_for_any_number_of_threads() {
    let hits = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let frame = pool.install(|| load(40).at(0.0)).expect("a frame");
        let rays = (0..400).map(|i| {
            let target = Vec3::new((i % 20) as f32, 0.3, (i / 20) as f32 * 0.7);
            Ray::new(Vec3::new(7.0, 9.0, -5.0), (target - Vec3::new(7.0, 9.0, -5.0)).normalize())
        });
        let found: Vec<_> = rays
            .map(|ray| {
                frame.world.closest(&ray).map(|hit| (hit.t, hit.instance, hit.primitive, hit.u, hit.v))
            })
            .collect();
        (found, frame.world.memory_bytes())
    };
    let one = hits(1);
    assert!(one.0.iter().flatten().count() > 100, "{} rays meet a ball", one.0.iter().flatten().count());
    assert_eq!(one, hits(4));
}
