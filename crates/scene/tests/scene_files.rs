//! Scene files: what they mean, and what is said of mistakes in them.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{Vec2, Vec3};
use halflight_scene::{LoadOptions, Scene, SceneError};
use halflight_trace::Ray;

fn load_text(text: &str) -> Result<Scene, SceneError> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).expect("the scene is written");
    Scene::load(&path, &LoadOptions::default())
}

fn mistake(text: &str) -> String {
    load_text(text).map(|scene| panic!("{scene:?} has a mistake")).unwrap_err().to_string()
}

fn root(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path)
}

/// A file of the shared data, if it is there.
fn shared(path: &str) -> Option<PathBuf> {
    let path = root("../shared").join(path);
    if !path.exists() {
        eprintln!("skipped: {} is not there", path.display());
        return None;
    }
    Some(path)
}

#[test]
fn a_mistake_is_told_with_its_line_its_column_and_the_nearest_name() {
    for (text, parts) in [
        ("[camera]\nvertical_fov = 3", &["scene.toml:2:1", "vertical_fov_degrees", "^^^"] as &[_]),
        ("[camera]\nvertical_fov_degrees = 200", &["scene.toml:2:24", "less than 180", "200"]),
        ("[camera]\norigin = [1, 2]", &["scene.toml:2:10", "three numbers", "a list of 2"]),
        ("[material.a]\ntype = \"difuse\"", &["scene.toml:2:8", "`diffuse`"]),
        (
            "[[shape]]\ntype = \"sphere\"\nmaterial = \"redd\"\n[material.red]\ntype = \"diffuse\"",
            &[":3:12", "`red`"],
        ),
        ("[[shape]]\ntype = \"mesh\"\nfile = \"absent.ply\"", &[":3:8", "there is no such file"]),
        ("[[shape]]\ntype = \"sphere\"\nradius = 0", &[":3:10", "greater than 0"]),
        ("[camera]\norigin = [1, 2, 3]\ntarget = [1, 2, 3]", &[":3:10", "looks at the same point"]),
        ("[[shape]]\ntype = \"box\"\nsize = [1, 0.5, 2]\nrounding = 0.3", &[":4:12", "at most 0.25"]),
        (
            "[[shape]]\nname = \"a\"\ntype = \"sphere\"\n[[shape]]\nname = \"a\"\ntype = \"disk\"",
            &[":5:8", "line 2"],
        ),
        ("environment = \"studo\"", &[":1:15", "`studio`"]),
        ("[image]\nsize = [0, 10]", &[":2:8", "from 1 to 65536"]),
        ("[camera]\nshutter = [1, 0]", &[":2:11", "close before"]),
        ("[camera]\norigin = [inf, 0, 0]", &[":2:11", "a number", "inf"]),
        ("a = 1\na = 2", &[":2:1", "duplicate"]),
        ("[technique]\npath = 3", &[":2:8", "[technique.path]"]),
        ("[material.m]\ntype = \"conductor\"\nmetal = \"golld\"", &[":3:9", "`gold`"]),
        ("[[shape]]\ntype = \"triangles\"\npositions = [[0,0,0]]\ntriangles = [[0,0,7]]", &[":4:13"]),
        ("[[shape]]\ntype = \"disk\"\nkeyframes = [{ time = 1 }, { time = 0 }]", &[":3:28", "must rise"]),
        ("[[shape]]\ntype = \"disk\"\ntransform = { scale = 0 }", &[":3:23", "scale"]),
    ] {
        let told = mistake(text);
        for part in parts {
            assert!(told.contains(part), "{text}\n…should say {part:?}:\n{told}");
        }
    }
}

#[test]
fn several_mistakes_are_told_at_once() {
    let told = mistake("[camera]\nup = 3\n[image]\nsize = 4\n[[shape]]\ntype = \"spere\"");
    for part in [":2:6", ":4:8", ":6:8"] {
        assert!(told.contains(part), "{told}");
    }
}

#[test]
fn an_empty_scene_is_a_scene() {
    let frame = load_text("").and_then(|scene| scene.at(0.0)).expect("nothing is wrong with it");
    assert!(frame.world.instances().is_empty());
    assert!(frame.lights.environment().is_some(), "the studio lights what has no light");
    assert_eq!(frame.bounds, (Vec3::ZERO, Vec3::ZERO));
}

#[test]
fn settings_of_the_command_take_the_place_of_those_of_the_file() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("scene.toml");
    let text = "[[shape]]\nname = \"ball\"\ntype = \"sphere\"\n[material.red]\ntype = \"diffuse\"\n[technique.path]\nmax_depth = 3";
    std::fs::write(&path, text).expect("the scene is written");
    let options = LoadOptions {
        set: vec!["shape.ball.radius=3".into(), "shape.ball.material=red".into(), "image.size=[8, 4]".into()],
        environment: Some("sky".into()),
        material: Some("red=gold roughness=0.1".into()),
        ..LoadOptions::default()
    };
    let scene = Scene::load(&path, &options).expect("the settings are right");
    let frame = scene.at(0.0).expect("the scene can be posed");
    assert_eq!(frame.bounds.1, Vec3::splat(3.0));
    assert_eq!(scene.image().size, [8, 4]);
    assert!(matches!(frame.material(0, 0).kind, halflight_material::MaterialKind::Conductor { .. }));
    assert!(scene.technique("path").is_some());
    let bad = LoadOptions { set: vec!["shape.bell.radius=3".into()], ..LoadOptions::default() };
    let told = Scene::load(&path, &bad).unwrap_err().to_string();
    assert!(told.contains("--set:1:7") && told.contains("`ball`"), "{told}");
}

#[test]
fn a_moving_shape_moves_within_the_shutter_and_stays_the_same_geometry() {
    let text = "[camera]\nshutter = [0, 0.5]\n[[shape]]\ntype = \"box\"\nkeyframes = [{ time = 0 }, { time = 2, translate = [4, 0, 0] }]\n[[shape]]\ntype = \"sphere\"";
    let scene = load_text(text).expect("nothing is wrong with it");
    let (first, second) = (scene.at(0.0).expect("a frame"), scene.at(1.0).expect("a frame"));
    let x = |frame: &halflight_scene::Frame| {
        let motion = frame.world.instances()[0].transform;
        (motion.open.translation.x, motion.close.translation.x)
    };
    assert_eq!((x(&first), x(&second)), ((0.0, 1.0), (2.0, 3.0)));
    for instance in 0..2 {
        let of = |frame: &halflight_scene::Frame| Arc::clone(&frame.world.instances()[instance].geometry);
        assert!(Arc::ptr_eq(&of(&first), &of(&second)));
    }
    assert!(scene.is_animated() && first.shutter_is_open());
    assert_eq!(scene.duration(), Some(2.0));
}

#[test]
fn light_comes_from_shapes_that_shine() {
    let text = "[material.lamp]\ntype = \"emissive\"\nradiance = 3\n[[shape]]\ntype = \"spheres\"\nspheres = [[0,0,0,1],[3,0,0,1]]\nmaterial = \"lamp\"\n[[light]]\ntype = \"rectangle\"\nposition = [0, 4, 0]\ntarget = [0, 0, 0]\nradiance = [1, 2, 3]\n[[light]]\ntype = \"point\"\nposition = [1, 1, 1]\nintensity = 2";
    let frame = load_text(text).and_then(|scene| scene.at(0.0)).expect("nothing is wrong with it");
    assert!(frame.lights.environment().is_none(), "a scene with lights of its own needs no studio");
    assert_eq!((frame.lights.emitters().len(), frame.lights.deltas().len()), (3, 1));
    let ray = Ray { origin: Vec3::new(0.1, 2.0, 0.1), direction: Vec3::Y, t_max: f32::INFINITY, time: 0.0 };
    let hit = frame.world.closest(&ray).expect("the lamp hangs there");
    let surface = frame.world.surface(&ray, &hit);
    assert!(surface.geometric_normal.distance(Vec3::NEG_Y) < 1e-6, "it shines downwards");
    assert!(frame.lights.emitter_of(hit.instance, hit.primitive).is_some());
}

#[test]
fn every_reference_scene_and_every_demo_loads() {
    if shared("reference").is_none() {
        return;
    }
    let folders = [root("tests/reference"), root("scenes")];
    let mut count = 0;
    for entry in folders.iter().flat_map(|folder| std::fs::read_dir(folder).into_iter().flatten().flatten()) {
        let path = entry.path();
        if path.extension().is_none_or(|extension| extension != "toml") {
            continue;
        }
        let scene =
            Scene::load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let frame = scene.at(0.0).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        assert!(!frame.lights.is_empty() && !frame.world.instances().is_empty(), "{}", path.display());
        let [width, height] = scene.image().size.map(|n| n as usize);
        let view = frame.camera.view(width, height);
        let ray = view.ray(Vec2::new(0.5 * width as f32, 0.55 * height as f32), Vec2::splat(0.5), 0.0);
        assert!(
            frame.world.closest(&ray).is_some(),
            "{}: nothing in the middle of the picture",
            path.display()
        );
        count += 1;
    }
    assert!(count >= 6, "{count}");
}

#[test]
fn a_bare_asset_is_a_scene_that_looks_the_same_at_any_scale() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut seen: Vec<Vec<bool>> = Vec::new();
    for scale in [1e-3_f32, 1.0, 1e3] {
        let path = folder.path().join(format!("wedge{scale}.obj"));
        let s = scale;
        let text = format!("v 0 0 0\nv {s} 0 0\nv 0 {s} 0\nv 0 0 {s}\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
        std::fs::write(&path, text).expect("the mesh is written");
        let frame = Scene::load(&path, &LoadOptions::default()).and_then(|s| s.at(0.0)).expect("a scene");
        let view = frame.camera.view(32, 18);
        let asset = |x: usize, y: usize| {
            let ray = view.ray(Vec2::new(x as f32 + 0.5, y as f32 + 0.5), Vec2::splat(0.5), 0.0);
            frame.world.closest(&ray).is_some_and(|hit| hit.instance == 0)
        };
        seen.push((0..32 * 18).map(|i| asset(i % 32, i / 32)).collect());
        assert!((frame.bounds.0.y / scale).abs() < 1e-3, "the ground is at the lowest point");
    }
    let shown = seen[1].iter().filter(|&&s| s).count();
    assert!(shown > 32 * 18 / 10, "the asset fills the picture: {shown}");
    assert!(seen[0] == seen[1] && seen[1] == seen[2]);
}

#[test]
fn a_flat_sheet_lies_on_the_ground_of_a_bare_scene_and_not_in_it() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (size, y) in [(1.0_f32, 0.0_f32), (1e-3, 0.0), (1e3, -20.0), (1.0, 1e5)] {
        let path = folder.path().join("sheet.obj");
        let text = format!("v 0 {y} 0\nv {size} {y} 0\nv {size} {y} {size}\nv 0 {y} {size}\nf 4 3 2 1\n");
        std::fs::write(&path, text).expect("the mesh is written");
        let frame = Scene::load(&path, &LoadOptions::default()).and_then(|s| s.at(0.0)).expect("a scene");
        for i in 0..400 {
            let [x, z] = [(i % 20) as f32, (i / 20) as f32].map(|k| size * (0.013 + 0.05 * k));
            let ray = Ray::new(Vec3::new(x, y + 3.0 * size, z), Vec3::new(0.1, -1.0, 0.07).normalize());
            let hit = frame.world.closest(&ray).expect("a sheet, or the ground beside it");
            let sheet = (x + 0.3 * size).max(z + 0.21 * size) < 0.999 * size;
            assert!(!sheet || hit.instance == 0, "size {size} at {y}: the ground shows at {x}, {z}");
        }
        assert!(frame.bounds.0.y < y, "size {size} at {y}: {}", frame.bounds.0.y);
    }
}

#[test]
fn bare_assets_of_every_kind_make_scenes() {
    for path in [
        "data/meshes/suzanne.obj",
        "data/animated/CesiumMan.glb",
        "data/animated/AnimatedMorphCube.glb",
        "data/heightfields/mt_st_helens_30m_m.png",
        "data/heightfields/srtm_bigtujunga30m_utm11.tif",
        "data/envmaps/pisa_256.hdr",
    ] {
        let Some(path) = shared(path) else { return };
        let scene = Scene::load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        let frame = scene.at(0.3).unwrap_or_else(|e| panic!("{e}"));
        let view = frame.camera.view(64, 36);
        let ray = view.ray(Vec2::new(32.0, 18.0), Vec2::splat(0.5), 0.0);
        assert!(frame.world.closest(&ray).is_some(), "{}", path.display());
        assert!(scene.describe().contains("materials"));
    }
}

#[test]
fn a_frame_of_a_walking_figure_does_not_depend_on_the_frames_before_it() {
    let Some(path) = shared("data/animated/CesiumMan.glb") else { return };
    let options = LoadOptions { set: vec!["camera.shutter=[0, 0.02]".into()], ..LoadOptions::default() };
    let load = || Scene::load(&path, &options).unwrap_or_else(|e| panic!("{e}"));
    let hits = |scene: &Scene, time: f64| {
        let frame = scene.at(time).unwrap_or_else(|e| panic!("{e}"));
        let view = frame.camera.view(48, 48);
        let ray = |i: usize| view.ray(Vec2::new((i % 48) as f32, (i / 48) as f32), Vec2::splat(0.5), 0.5);
        (0..48 * 48).map(|i| frame.world.closest(&ray(i)).map(|hit| hit.t.to_bits())).collect::<Vec<_>>()
    };
    let (first, second) = (load(), load());
    let later = hits(&first, 0.8);
    assert_ne!(hits(&second, 0.1), later, "the figure moves");
    assert_eq!(hits(&second, 0.8), later);
}

#[test]
fn the_hash_of_a_scene_changes_with_its_text_and_with_its_files() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (scene, mesh) = (folder.path().join("scene.toml"), folder.path().join("mesh.obj"));
    let write = |path: &Path, text: &str| std::fs::write(path, text).expect("written");
    let hash = || Scene::load(&scene, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}")).hash();
    write(&mesh, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    write(&scene, "[[shape]]\ntype = \"mesh\"\nfile = \"mesh.obj\"\n");
    let before = hash();
    assert_eq!(before, hash());
    // Neither how large the picture is nor what computes it belongs to the scene.
    let simd = halflight_trace::Simd::Baseline;
    let small = LoadOptions { size: Some([8, 6]), simd, ..LoadOptions::default() };
    assert_eq!(before, Scene::load(&scene, &small).unwrap_or_else(|e| panic!("{e}")).hash());
    write(&mesh, "v 0 0 0\nv 1 0 0\nv 0 2 0\nf 1 2 3\n");
    let after = hash();
    assert_ne!(before, after);
    write(&scene, "[[shape]]\ntype = \"mesh\"\nfile = \"mesh.obj\"\nshading = \"smooth\"\n");
    assert_ne!(after, hash());
}
