//! Techniques that know light by spherical harmonics, with a learned field in the scene.

#![allow(clippy::unwrap_used)]

use std::path::Path;

use halflight_ddf::{FastShape, FastTrainer, TrainOptions};
use halflight_render::techniques::prt::{Prt, PrtSettings};
use halflight_render::techniques::shexp::{Shexp, ShexpSettings};
use halflight_render::{Budget, Film, Quiet, Technique};
use halflight_scene::{LoadOptions, Scene};
use halflight_shape::procedural::mesh::ico_sphere;

/// A floor under an even sky, and above it what `shape` says.
fn scene(folder: &Path, shape: &str) -> Scene {
    let text = format!(
        r#"
[image]
size = [48, 32]
[camera]
origin = [0, 3, 5]
target = [0, 0, 0]
vertical_fov_degrees = 40
[environment]
type = "constant"
color = [1, 1, 1]
[material.grey]
type = "diffuse"
albedo = [0.6, 0.6, 0.6]
[[shape]]
name = "floor"
type = "rectangle"
size = [8, 8]
material = "grey"
transform = {{ rotate_degrees = [-90, 0, 0] }}
{shape}
"#
    );
    let path = folder.join("scene.toml");
    std::fs::write(&path, text).unwrap();
    Scene::load(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// Brightness of the floor just in front of what stands above it, and of the front of that.
fn seen(scene: &Scene, mut technique: impl Technique) -> [f32; 2] {
    technique.prepare(scene, &Quiet).unwrap();
    let mut film = Film::new(48, 32);
    let budget = Budget { samples: Some(4), ..Budget::default() };
    technique.render(&scene.at(0.0).unwrap(), &mut film, &budget, &Quiet).unwrap();
    let image = film.image();
    [22..25, 10..13].map(|rows| {
        let pixels = rows.flat_map(|y| (20..28).map(move |x| y * 48 + x));
        pixels.map(|i| image.pixels[i][1] / 24.0).sum()
    })
}

fn floor(scene: &Scene, technique: impl Technique) -> f32 {
    seen(scene, technique)[0]
}

#[test]
fn a_field_hides_light_from_the_floor_below_it_as_its_mesh_does() {
    let folder = tempfile::tempdir().unwrap();
    let ball = ico_sphere(1.0, 4);
    let shape = FastShape { resolution: 24, ..FastShape::default() };
    let options = TrainOptions { shape, lines_per_step: 512, ..TrainOptions::default() };
    let mut trainer = FastTrainer::new(&ball, options).unwrap();
    for step in 0..400 {
        trainer.step(step as f32 / 400.0).unwrap();
    }
    let mut field = trainer.field();
    field.error = halflight_ddf::evaluate(&field, trainer.unit_mesh(), 2000, 1).measured();
    field.save(&folder.path().join("ball.ddf")).unwrap();
    halflight_shape::write_ply(&folder.path().join("ball.ply"), &ball).unwrap();
    let lifted = "material = \"grey\"\ntransform = { translate = [0, 1.15, 0] }";
    let of_field = format!("[[shape]]\nname = \"ball\"\ntype = \"field\"\nfile = \"ball.ddf\"\n{lifted}");
    let of_mesh = format!("[[shape]]\nname = \"ball\"\ntype = \"mesh\"\nfile = \"ball.ply\"\n{lifted}");
    let all = |technique: &dyn Fn(&Scene) -> f32| {
        [&of_field, &of_mesh, ""].map(|shape| technique(&scene(folder.path(), shape)))
    };
    let prt = PrtSettings { rays: 128, subdivisions: 2, ..PrtSettings::default() };
    let [field, mesh, none] = all(&|scene| floor(scene, Prt::new(prt.clone())));
    assert!(mesh < 0.85 * none && (field - mesh).abs() < 0.03 * none, "prt: {field} {mesh} {none}");
    // The field itself, whose transfer is worked out at the pixels that see it, diffuse and in a lobe.
    let shining = "[material.shining]\ntype = \"phong\"\ndiffuse = [0.3, 0.3, 0.3]\nspecular = [0.4, 0.4, 0.4]\nexponent = 8\n";
    for (name, more) in [("grey", ""), ("shining", shining)] {
        let [field, mesh] = [&of_field, &of_mesh].map(|shape| {
            let shape = shape.replace("grey", name);
            let [_, front] = seen(&scene(folder.path(), &format!("{more}{shape}")), Prt::new(prt.clone()));
            front
        });
        assert!(mesh > 0.1 && (field / mesh - 1.0).abs() < 0.04, "{name}: {field} {mesh}");
    }
    let shexp = ShexpSettings { spheres: 8, ..ShexpSettings::DEFAULT };
    let [field, mesh, none] = all(&|scene| floor(scene, Shexp::new(shexp)));
    assert!(mesh < 0.85 * none && (field - mesh).abs() < 0.05 * none, "shexp: {field} {mesh} {none}");
}
