//! The frame of the texture on every kind of shape: what normal maps and stretched highlights stand in.

use glam::{Vec2, Vec3};
use halflight_scene::{Frame, LoadOptions, Scene};
use halflight_trace::{Ray, Surface};

/// A shape, upright or in a transform that mirrors, of a material that needs tangents.
fn frame_of(shape: &str, transform: &str) -> Frame {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("scene.toml");
    let text = format!(
        "[[shape]]\n{shape}\ntransform = {transform}\nmaterial = {{ type = \"conductor\", anisotropy = 0.5 }}\n"
    );
    std::fs::write(&path, text).expect("the scene is written");
    Scene::load(&path, &LoadOptions::default()).expect("a scene").at(0.0).expect("a frame")
}

fn seen(frame: &Frame, origin: Vec3, direction: Vec3) -> Option<Surface> {
    let ray = Ray::new(origin, direction);
    frame.world.closest(&ray).map(|hit| frame.world.surface(&ray, &hit))
}

/// How far the texture goes from a surface to the place `step` beside it.
fn beside(frame: &Frame, surface: &Surface, step: Vec3) -> Option<Vec2> {
    let lift = 10.0 * step.length() * surface.geometric_normal;
    let there = seen(frame, surface.position + step + lift, -surface.geometric_normal)?;
    let same = there.geometric_normal.dot(surface.geometric_normal) > 0.999;
    let moved = there.uv - surface.uv;
    // Not over a seam or an edge.
    (same && moved.length() < 0.2).then_some(moved)
}

const QUAD: &str = "type = \"triangles\"\npositions = [[-1,-1,0],[1,-1,0],[1,1,0],[-1,1,0]]\n\
    uvs = [[0,1],[1,1],[1,0],[0,0]]\ntriangles = [[0,1,2],[0,2,3]]";

#[test]
fn on_every_shape_the_tangent_goes_right_and_the_bitangent_up_in_the_picture() {
    let shapes = [
        ("rectangle", "type = \"rectangle\"\nsize = [2, 2]"),
        ("disk", "type = \"disk\""),
        ("plane", "type = \"plane\"\nhalf_extent = 1"),
        ("triangles", QUAD),
        ("sphere", "type = \"sphere\""),
        ("spheres", "type = \"spheres\"\nspheres = [[0, 0, 0, 1]]"),
        ("box", "type = \"box\"\nsize = [1.3, 1.2, 1.1]"),
        (
            "height field",
            "type = \"height-field\"\nextent = [2, 2]\nposts = [64, 64]\n\
             heights = { type = \"sum-of-sines\", waves = [{ amplitude = 0.02, kx = 2, kz = 3 }] }",
        ),
        ("torus", "type = \"generated\"\nmesh = \"torus\""),
        ("flat torus", "type = \"generated\"\nmesh = \"torus\"\nshading = \"flat\""),
    ];
    let transforms =
        [("upright", "{ scale = 1 }"), ("mirrored", "{ scale = [-1, 1, 1], rotate_degrees = [20, 30, 40] }")];
    for (name, shape) in shapes {
        for (way, transform) in transforms {
            let frame = frame_of(shape, transform);
            let (low, high) = frame.bounds;
            let (center, radius) = (0.5 * (low + high), 0.5 * low.distance(high));
            let mut checked = 0;
            for k in 0..2000 {
                let turn = |factor: f32| (k as f32 * factor).fract() * 2.0 - 1.0;
                let aim =
                    center + 0.5 * (high - low) * Vec3::new(turn(0.618_034), turn(0.754_878), turn(0.569_84));
                let from = Vec3::new(turn(0.414_21), turn(0.732_05), turn(0.236_07)).normalize_or(Vec3::Z);
                let Some(surface) = seen(
                    &frame,
                    center + 3.0 * radius * from,
                    (aim - center - 3.0 * radius * from).normalize(),
                ) else {
                    continue;
                };
                let step = 2e-3 * radius;
                let up = surface.handedness * surface.shading_normal.cross(surface.tangent);
                let (Some(right), Some(up)) =
                    (beside(&frame, &surface, step * surface.tangent), beside(&frame, &surface, step * up))
                else {
                    continue;
                };
                // Near a pole the picture turns within a step.
                if right.length() > 0.05 {
                    continue;
                }
                checked += 1;
                assert!(right.x > 0.0 && right.y.abs() < 0.2 * right.x, "{name}, {way}: right is {right}");
                assert!(up.y < 0.0 && up.x.abs() < -0.5 * up.y, "{name}, {way}: up is {up}");
            }
            assert!(checked > 200, "{name}, {way}: {checked} places");
        }
    }
}

#[test]
fn pictures_on_solids_are_not_mirrored_and_stand_upright_on_walls() {
    for (name, shape) in [
        ("sphere", "type = \"sphere\""),
        ("box", "type = \"box\""),
        ("cylinder", "type = \"generated\"\nmesh = \"cylinder\""),
        ("vase", "type = \"generated\"\nmesh = \"vase\""),
        ("ball", "type = \"generated\"\nmesh = \"ico-sphere\""),
    ] {
        let frame = frame_of(shape, "{ scale = 1 }");
        let middle = 0.5 * (frame.bounds.0 + frame.bounds.1);
        for turn in 0..8 {
            let towards = Vec3::new((turn as f32 + 0.3).sin(), 0.0, (turn as f32 + 0.3).cos());
            let surface = seen(&frame, middle + 9.0 * towards, -towards).expect("it is there");
            let up = surface.handedness * surface.shading_normal.cross(surface.tangent);
            assert_eq!(surface.handedness, 1.0, "{name}");
            assert!(up.y > 0.8, "{name}: up is {up}");
        }
    }
}

/// Of a shape whose material is displaced by a picture that is white throughout.
fn raised(shape: &str) -> Scene {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let white = halflight_image::RgbImage::from_fn(2, 2, |_, _| [1.0; 3]);
    halflight_image::save_hdr(&folder.path().join("white.hdr"), &white).expect("written");
    let path = folder.path().join("scene.toml");
    let material =
        "{ type = \"diffuse\", displacement = { file = \"white.hdr\", scale = 0.25, edge = 0.2 } }";
    std::fs::write(&path, format!("[[shape]]\n{shape}\nmaterial = {material}\n")).expect("written");
    Scene::load(&path, &LoadOptions::default()).expect("a scene")
}

#[test]
fn exact_shapes_are_displaced_as_meshes_or_say_that_they_are_not() {
    for (shape, direction) in [
        ("type = \"rectangle\"\nsize = [2, 2]", Vec3::Z),
        ("type = \"disk\"", Vec3::Z),
        ("type = \"plane\"\nhalf_extent = 1\ny = 0.5", Vec3::Y),
        ("type = \"sphere\"\nradius = 0.5\ncenter = [0, 1, 0]", Vec3::Z),
    ] {
        let scene = raised(shape);
        assert!(scene.warnings().is_empty(), "{shape}: {:?}", scene.warnings());
        let frame = scene.at(0.0).expect("a frame");
        let base = if shape.contains("sphere") { Vec3::Y } else { Vec3::ZERO };
        let surface = seen(&frame, base + 5.0 * direction + 0.01, -direction).expect("it is there");
        let height = (surface.position - base).dot(direction);
        let flat = if direction == Vec3::Y || shape.contains("sphere") { 0.5 } else { 0.0 };
        assert!((height - flat - 0.25).abs() < 2e-3, "{shape}: {height}");
        assert!(surface.shading_normal.dot(direction) > 0.99);
    }
    let scene = raised("type = \"spheres\"\nspheres = [[0, 0, 0, 1]]");
    assert!(scene.warnings()[0].contains("displacement is left out"), "{:?}", scene.warnings());
}

/// The heights at the left edge, in the middle and at the right edge of a sheet with a ramp from 0.5 / 8 to 7.5 / 8
/// across the texture coordinates from 0 to `tiles`.
fn ramp(tiles: f32, wrap: &str) -> [f32; 3] {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let picture = halflight_image::RgbImage::from_fn(8, 8, |x, _| [(x as f32 + 0.5) / 8.0; 3]);
    halflight_image::save_hdr(&folder.path().join("ramp.hdr"), &picture).expect("written");
    let shape = if tiles == 1.0 {
        "type = \"rectangle\"\nsize = [2, 2]".into()
    } else {
        QUAD.replace("[[0,1],[1,1],[1,0],[0,0]]", &format!("[[0,1],[{tiles},1],[{tiles},0],[0,0]]"))
    };
    let displacement = format!("{{ file = \"ramp.hdr\", scale = 1, edge = 0.05{wrap} }}");
    let path = folder.path().join("scene.toml");
    let material = format!("{{ type = \"diffuse\", displacement = {displacement} }}");
    std::fs::write(&path, format!("[[shape]]\n{shape}\nmaterial = {material}\n")).expect("written");
    let frame = Scene::load(&path, &LoadOptions::default()).and_then(|s| s.at(0.0)).expect("a frame");
    [-0.999, 0.003, 0.999]
        .map(|x| seen(&frame, Vec3::new(x, 0.01, 5.0), Vec3::NEG_Z).expect("it is there").position.z)
}

#[test]
fn displacement_does_not_curl_at_the_border_of_a_surface_unless_the_picture_repeats() {
    // Half a texel of the ramp is 1 / 16.
    for wrap in ["", ", wrap = \"clamp\"", ", wrap = \"mirror\""] {
        for (height, at) in ramp(1.0, wrap).into_iter().zip([0.0, 0.5, 1.0]) {
            assert!((height - at).abs() < 1.0 / 16.0 + 5e-3, "{wrap}: {height} at {at}");
        }
    }
    for (height, at) in ramp(1.0, ", wrap = \"repeat\"").into_iter().zip([0.5; 3]) {
        assert!((height - at).abs() < 2e-2, "{height} at {at}");
    }
    // Texture coordinates beyond the picture ask for it again and again: at 1.5 it stands in its middle.
    let [.., right] = ramp(1.5, "");
    assert!((right - 0.5).abs() < 2e-2, "{right}");
    let [.., right] = ramp(1.5, ", wrap = \"clamp\"");
    assert!((right - 15.0 / 16.0).abs() < 1e-2, "{right}");
}

#[test]
fn a_large_shining_height_field_says_that_it_is_found_by_chance() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("scene.toml");
    for (posts, warned) in [(512, true), (300, false)] {
        let text = format!(
            "[[shape]]\ntype = \"height-field\"\nheights = {{ type = \"fractal\" }}\nposts = [{posts}, {posts}]\n\
             material = {{ type = \"emissive\" }}\n"
        );
        std::fs::write(&path, text).expect("written");
        let scene = Scene::load(&path, &LoadOptions::default()).expect("a scene");
        assert_eq!(
            scene.warnings().iter().any(|w| w.contains("by chance")),
            warned,
            "{:?}",
            scene.warnings()
        );
    }
}
