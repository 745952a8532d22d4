//! What model files bring beside their meshes: lights, cut-outs, and exposures of bare ones.

use glam::{Vec2, Vec3};
use halflight_scene::lights::Arrival;
use halflight_scene::{Frame, LoadOptions, Scene, Up};

/// Three lights, each at a node of its own, and a triangle.
const LIGHTS: &str = r#"{
 "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1, 2, 3]}],
 "extensionsUsed": ["KHR_lights_punctual"],
 "extensions": {"KHR_lights_punctual": {"lights": [
   {"type": "point", "intensity": 8, "color": [1, 0.5, 0.25]},
   {"type": "spot", "intensity": 8, "spot": {"innerConeAngle": 0.2, "outerConeAngle": 0.6}},
   {"type": "directional", "intensity": 3}]}},
 "nodes": [{"mesh": 0},
   {"translation": [0, 2, 0], "extensions": {"KHR_lights_punctual": {"light": 0}}},
   {"translation": [50, 2, 0], "rotation": [-0.70710678, 0, 0, 0.70710678], "extensions": {"KHR_lights_punctual": {"light": 1}}},
   {"rotation": [-0.70710678, 0, 0, 0.70710678], "extensions": {"KHR_lights_punctual": {"light": 2}}}],
 "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
 "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0,0,0], "max": [1,1,0]}],
 "bufferViews": [{"buffer": 0, "byteLength": 36}],
 "buffers": [{"byteLength": 36, "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]
}"#;

fn load(transform: &str) -> Scene {
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("lamps.gltf"), LIGHTS).expect("written");
    let path = folder.path().join("scene.toml");
    let text = format!("[[shape]]\ntype = \"mesh\"\nfile = \"lamps.gltf\"\n{transform}\n");
    std::fs::write(&path, text).expect("written");
    Scene::load(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// Light that arrives at a point, unobstructed, on a surface that faces every light.
fn arriving(frame: &Frame, at: Vec3) -> Vec3 {
    let count = 4096;
    let mut sum = Vec3::ZERO;
    for i in 0..count {
        let u = (i as f32 + 0.5) / count as f32;
        if let Some(sample) = frame.lights.sample(at, u, Vec2::splat(0.5), 0.0)
            && let Arrival::From { radiance, .. } = sample.arrival
        {
            sum += radiance / sample.pdf;
        }
    }
    sum / count as f32
}

#[test]
fn lights_of_a_model_file_light_the_scene_that_names_it() {
    let scene = load("");
    let frame = scene.at(0.0).expect("a frame");
    assert!(frame.lights.environment().is_none(), "a scene with lights needs no studio");
    assert_eq!(frame.lights.deltas().len(), 3);
    let sun = Vec3::splat(3.0);
    // Two metres under the point: 8 / 4, and nothing of the spot.
    let found = arriving(&frame, Vec3::ZERO);
    assert!((found - sun - Vec3::new(2.0, 1.0, 0.5)).abs().max_element() < 0.02, "{found}");
    // Under the spot, within its cone, at its edge (where it has the square of the share of the cosines), and beyond.
    let far = 8.0 / 2504.0;
    let spot = |aside: f32| (arriving(&frame, Vec3::new(50.0, 0.0, aside)) - sun).y;
    assert!((spot(0.0) - 2.0 - 0.5 * far).abs() < 0.02, "{}", spot(0.0));
    let aside = 2.0 * 0.4f32.tan();
    let share = (0.4f32.cos() - 0.6f32.cos()) / (0.2f32.cos() - 0.6f32.cos());
    let expected = 8.0 / (4.0 + aside * aside) * share * share;
    assert!((spot(aside) - expected).abs() < 0.02, "{} {expected}", spot(aside));
    assert!(spot(2.0).abs() < 0.02, "{}", spot(2.0));
    assert!(scene.describe().contains("light"), "{}", scene.describe());
}

#[test]
fn lights_of_a_model_file_move_with_the_shape() {
    let frame = load("transform = { translate = [0, 1, 0], scale = 2 }").at(0.0).expect("a frame");
    // The point now stands at height 5; scales do not change how strongly it shines.
    let found = arriving(&frame, Vec3::new(0.0, 1.0, 0.0)).x - 3.0;
    assert!((found - 8.0 / 16.0).abs() < 0.01, "{found}");
}

#[test]
fn a_bare_model_with_lights_says_that_the_studio_takes_their_place() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("lamps.gltf");
    std::fs::write(&path, LIGHTS).expect("written");
    let scene = Scene::load(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    assert!(scene.warnings().iter().any(|w| w.contains("studio")), "{:?}", scene.warnings());
    assert!(scene.at(0.0).expect("a frame").lights.deltas().is_empty());
    assert_eq!(
        scene.image().exposure_ev,
        -(0.62f32 / 0.48).log2(),
        "clay, as nothing is said of its material"
    );
}

#[test]
fn bright_bare_models_are_exposed_below_white() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("a.obj");
    std::fs::write(folder.path().join("a.mtl"), "newmtl white\nKd 0.96 0.96 0.96\n").expect("written");
    std::fs::write(&path, "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl white\nf 1 2 3\n")
        .expect("written");
    let load = |set: &[&str]| {
        let set = set.iter().map(ToString::to_string).collect();
        let options = LoadOptions { set, ..LoadOptions::default() };
        Scene::load(&path, &options).unwrap_or_else(|error| panic!("{error}")).image().exposure_ev
    };
    assert!((load(&[]) + 1.0).abs() < 1e-5, "{}", load(&[]));
    assert_eq!(load(&["image.exposure_ev=0.5"]), 0.5, "what is asked for counts");
}

#[test]
fn a_bare_model_whose_z_points_up_is_stood_up() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("a.obj");
    // A triangle in x and z, three high and one wide.
    std::fs::write(&path, "v 0 0 0\nv 1 0 0\nv 0 0 3\nf 1 2 3\n").expect("written");
    for (up, height) in [(Up::Y, 0.0), (Up::Z, 3.0)] {
        let options = LoadOptions { up, ..LoadOptions::default() };
        let scene = Scene::load(&path, &options).unwrap_or_else(|error| panic!("{error}"));
        let (low, high) = scene.at(0.0).expect("a frame").bounds;
        assert!((high.y - low.y - height).abs() < 1e-3, "{up:?}: {low} to {high}");
    }
}
