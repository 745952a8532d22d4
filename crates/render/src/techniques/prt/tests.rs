//! Transfer against what it should be: closed forms, dense quadrature, the path tracer.

use std::f32::consts::{FRAC_1_PI, TAU};
use std::path::Path as FsPath;
use std::sync::Arc;

use glam::{Vec2, Vec3};
use halflight_image::RgbImage;
use halflight_scene::lights::{Environment, EnvironmentMap, Lights};
use halflight_scene::schema::FilePath;
use halflight_scene::{Frame, LoadOptions, Scene};
use halflight_sh::Sh;
use halflight_sh::project::lat_long_direction;

use super::directions::{Directions, MOST};
use super::{Prt, PrtSettings, TransferKind};
use crate::film::{Film, Region};
use crate::gbuffer::{GBuffer, Pixel, Room, Visible, VisiblePoint};
use crate::sh_light::axes;
use crate::technique::{Budget, Quiet, RenderReport, Technique};
use crate::techniques::path::{Path, PathSettings};

/// Columns of the map of light; half as many rows.
const COLUMNS: usize = 256;

/// Light of four bands, nowhere negative.
fn radiance(direction: Vec3) -> Vec3 {
    let lobe = |axis: Vec3| (0.5 + 0.5 * direction.dot(axis.normalize())).powi(3);
    0.2 * Vec3::ONE
        + Vec3::new(3.0, 2.4, 1.6) * lobe(Vec3::new(0.6, 0.7, 0.4))
        + Vec3::new(0.2, 0.5, 1.2) * lobe(Vec3::new(-0.8, 0.3, -0.2))
}

/// The light turned by so many columns of its map.
fn lights(turned: usize) -> Lights {
    let image = RgbImage::from_fn(COLUMNS, COLUMNS / 2, |x, y| {
        let x = (x + COLUMNS - turned) % COLUMNS;
        radiance(lat_long_direction(COLUMNS, COLUMNS / 2, x, y).as_vec3()).to_array()
    });
    let map = Arc::new(EnvironmentMap::new(image));
    Lights::new(Some(Environment { map, rotation: 0.0, intensity: Vec3::ONE }), Vec::new(), Vec::new(), 1.0)
}

fn scene(text: &str) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    let text = format!("[environment]\ntype = \"constant\"\ncolor = 1\n{text}");
    std::fs::write(&path, text).unwrap();
    Scene::load(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn lit(mut frame: Frame, lights: Lights) -> Frame {
    frame.lights = lights;
    frame
}

fn frame(text: &str) -> Frame {
    lit(scene(text).at(0.0).unwrap(), lights(0))
}

const SETTINGS: PrtSettings = PrtSettings {
    transfer: TransferKind::Shadowed,
    order: 4,
    bounces: 1,
    rays: 256,
    max_edge: None,
    subdivisions: 3,
    tolerance: 0.02,
    max_vertices: 200_000,
    cache: None,
};

fn render(technique: &dyn Technique, frame: &Frame, size: usize, samples: u32) -> (Vec<Vec3>, RenderReport) {
    let mut film = Film::new(size, size);
    let budget = Budget { samples: Some(samples), ..Budget::default() };
    let report = technique.render(frame, &mut film, &budget, &Quiet).unwrap();
    (film.image().pixels.iter().map(|&p| Vec3::from(p)).collect(), report)
}

fn picture(settings: &PrtSettings, frame: &Frame, size: usize) -> Vec<Vec3> {
    render(&Prt::new(settings.clone()), frame, size, 1).0
}

fn path_traced(frame: &Frame, size: usize, max_depth: u32, samples: u32) -> Vec<Vec3> {
    let settings = PathSettings { max_depth, roulette_depth: 100, ..PathSettings::default() };
    render(&Path::new(settings), frame, size, samples).0
}

/// Mean and greatest relative error of pixels, of those that are not nearly black.
fn errors(found: &[Vec3], truth: &[Vec3]) -> (f32, f32) {
    let mean_truth = truth.iter().map(|t| t.element_sum()).sum::<f32>() / truth.len() as f32;
    let relative = found
        .iter()
        .zip(truth)
        .map(|(f, t)| (*f - *t).abs().element_sum() / t.element_sum().max(0.1 * mean_truth));
    (relative.clone().sum::<f32>() / truth.len() as f32, relative.fold(0.0, f32::max))
}

/// The pixels through their middles, each surface with what a function says.
fn exact(frame: &Frame, size: usize, shade: impl Fn(&VisiblePoint) -> Vec3) -> Vec<Vec3> {
    let view = GBuffer::look(frame, [size; 2], Region::whole(size, size), Vec2::splat(0.5), &Room::default());
    let shade = |place: usize| match view.at(place) {
        Visible::Nothing(direction) => frame.lights.escaped(direction),
        Visible::Point(point) => shade(&point),
    };
    (0..view.pixels.len()).map(shade).collect()
}

/// ∫ L f over many directions.
fn quadrature(f: impl Fn(Vec3) -> f32) -> Vec3 {
    let directions = Directions::new(40_000, 1, 0.3);
    directions.vectors.iter().map(|&d| radiance(d) * f(d) * directions.weight).sum()
}

const BALL: &str = r#"
[camera]
origin = [0, 1.2, 4]
target = [0, 0.7, 0]
vertical_fov_degrees = 40
[[shape]]
type = "spheres"
spheres = [[0, 0.9, 0, 0.5]]
material = { type = "diffuse", albedo = [0.8, 0.5, 0.3] }
"#;

const FLOOR: &str = r#"
[[shape]]
type = "rectangle"
size = [4, 4]
transform = { rotate_degrees = [-90, 0, 0] }
material = { type = "diffuse", albedo = [0.5, 0.5, 0.5] }
"#;

#[test]
fn unshadowed_transfer_gives_the_irradiance_of_the_light_in_closed_form() {
    let frame = frame(BALL);
    let settings = PrtSettings { transfer: TransferKind::Unshadowed, ..SETTINGS };
    let albedo = Vec3::new(0.8, 0.5, 0.3);
    let truth = exact(&frame, 24, |point| albedo * FRAC_1_PI * quadrature(|d| d.dot(point.normal).max(0.0)));
    let (mean, most) = errors(&picture(&settings, &frame, 24), &truth);
    println!("unshadowed ball: mean {mean:.5}, greatest {most:.5}");
    assert!(mean < 1e-3 && most < 5e-3, "{mean} {most}");
}

#[test]
fn a_ball_throws_the_shadow_of_its_exact_visibility_on_a_floor() {
    let frame = frame(&format!("{BALL}{FLOOR}"));
    let (center, radius) = (Vec3::new(0.0, 0.9, 0.0), 0.5f32);
    let truth = exact(&frame, 32, |point| {
        let on_floor = point.position.y.abs() < 1e-3;
        let albedo = if on_floor { Vec3::splat(0.5) } else { Vec3::new(0.8, 0.5, 0.3) };
        let to_center = center - point.position;
        let reach = (1.0 - (radius / to_center.length()).powi(2)).max(0.0).sqrt();
        let visible = |d: Vec3| {
            if on_floor {
                d.dot(to_center.normalize()) < reach
            } else {
                // The floor is a square.
                let at = point.position - d * (point.position.y / d.y);
                d.y >= 0.0 || at.x.abs() > 2.0 || at.z.abs() > 2.0
            }
        };
        albedo * FRAC_1_PI * quadrature(|d| if visible(d) { d.dot(point.normal).max(0.0) } else { 0.0 })
    });
    let found = picture(&SETTINGS, &frame, 32);
    let (mean, most) = errors(&found, &truth);
    println!("ball over a floor: mean {mean:.4}, greatest {most:.4}");
    assert!(mean < 0.006 && most < 0.05, "{mean} {most}");
}

/// A room without a lid, seen from above.
const ROOM: &str = r#"
[camera]
origin = [0.3, 4.5, 2.5]
target = [0, 0.4, 0]
vertical_fov_degrees = 35
[[shape]]
type = "rectangle"
size = [2, 2]
transform = { rotate_degrees = [-90, 0, 0] }
material = { type = "diffuse", albedo = [0.7, 0.7, 0.7] }
[[shape]]
type = "rectangle"
size = [2, 1]
transform = { rotate_degrees = [0, 90, 0], translate = [-1, 0.5, 0] }
material = { type = "diffuse", albedo = [0.8, 0.2, 0.2] }
[[shape]]
type = "rectangle"
size = [2, 1]
transform = { rotate_degrees = [0, -90, 0], translate = [1, 0.5, 0] }
material = { type = "diffuse", albedo = [0.2, 0.8, 0.2] }
[[shape]]
type = "rectangle"
size = [2, 1]
transform = { translate = [0, 0.5, -1] }
material = { type = "diffuse", albedo = [0.7, 0.7, 0.7] }
[[shape]]
type = "rectangle"
size = [2, 1]
transform = { rotate_degrees = [0, 180, 0], translate = [0, 0.5, 1] }
material = { type = "diffuse", albedo = [0.7, 0.7, 0.7] }
"#;

#[test]
fn light_given_back_in_an_open_room_is_that_of_the_path_tracer() {
    let frame = frame(ROOM);
    for bounces in [1, 3] {
        let settings = PrtSettings { transfer: TransferKind::Interreflected, bounces, ..SETTINGS };
        let settings = PrtSettings { max_edge: Some(0.2), ..settings };
        let truth = path_traced(&frame, 32, bounces + 1, 256);
        let found = render(&Prt::new(settings), &frame, 32, 16).0;
        let (mean, _) = errors(&found, &truth);
        let sum = |all: &[Vec3]| all.iter().copied().sum::<Vec3>();
        let whole = (sum(&found) / sum(&truth) - Vec3::ONE).abs().max_element();
        println!("open room, {bounces} bounces: mean {mean:.4}, of the whole {whole:.4}");
        assert!(mean < 0.015 && whole < 0.006, "{mean} {whole}");
    }
}

#[test]
fn a_phong_floor_reflects_what_the_path_tracer_says() {
    let floor = FLOOR.replace(
        r#"{ type = "diffuse", albedo = [0.5, 0.5, 0.5] }"#,
        r#"{ type = "phong", diffuse = [0.2, 0.2, 0.2], specular = [0.6, 0.6, 0.6], exponent = 8 }"#,
    );
    let frame = frame(&format!("{BALL}{floor}"));
    let truth = path_traced(&frame, 32, 1, 256);
    let found = render(&Prt::new(SETTINGS), &frame, 32, 16).0;
    let (mean, _) = errors(&found, &truth);
    println!("ball over a Phong floor: mean {mean:.4}");
    assert!(mean < 0.03, "{mean}");
}

#[test]
fn a_light_that_turns_costs_no_precomputation_and_lights_as_one_that_was_turned() {
    let frame = frame(&format!("{BALL}{FLOOR}"));
    let prt = Prt::new(SETTINGS);
    render(&prt, &frame, 24, 1);
    let before = Arc::as_ptr(&prt.prepared.lock().unwrap().as_ref().unwrap().transfer);
    let columns = 40;
    let mut turned = frame.clone();
    let environment = turned.lights.environment().unwrap().clone();
    let rotation = environment.rotation - columns as f32 / COLUMNS as f32 * TAU;
    turned.lights = Lights::new(Some(Environment { rotation, ..environment }), vec![], vec![], 1.0);
    let surface_only = |frame: &Frame| {
        let found = render(&prt, frame, 24, 1).0;
        let view = GBuffer::look(frame, [24; 2], Region::whole(24, 24), Vec2::splat(0.5), &Room::default());
        let on = |i: &usize| view.seen[*i];
        (0..found.len()).filter(on).map(|i| found[i]).collect::<Vec<_>>()
    };
    let found = surface_only(&turned);
    let baked = lit(frame.clone(), lights(columns));
    let (mean, most) = errors(&found, &surface_only(&baked));
    assert!(most < 1e-3, "{mean} {most}");
    let (_, unlike) = errors(&found, &surface_only(&frame));
    assert!(unlike > 0.1, "the light does turn");
    let after = Arc::as_ptr(&prt.prepared.lock().unwrap().as_ref().unwrap().transfer);
    assert_eq!(before, after);
}

#[test]
fn a_scene_that_moved_is_worked_out_anew_and_the_report_says_so() {
    let moving = BALL.replace(
        "spheres = [[0, 0.9, 0, 0.5]]",
        "spheres = [[0, 0.9, 0, 0.5]]\nkeyframes = [{ time = 0 }, { time = 1, translate = [0.8, 0, 0] }]",
    );
    let text = format!("{moving}{FLOOR}");
    let scene = scene(&text);
    let [first, second] = [0.0, 1.0].map(|time| lit(scene.at(time).unwrap(), lights(0)));
    let mut prt = Prt::new(SETTINGS);
    prt.prepare(&scene, &Quiet).unwrap();
    let (_, report) = render(&prt, &first, 16, 1);
    assert!(!report.notes.iter().any(|n| n.contains("moved")), "{:?}", report.notes);
    let (moved, report) = render(&prt, &second, 16, 1);
    assert!(report.notes.iter().any(|n| n.contains("moved")), "{:?}", report.notes);
    assert_eq!(moved, picture(&SETTINGS, &second, 16));
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let frame = frame(&format!("{BALL}{FLOOR}"));
    let settings = PrtSettings { transfer: TransferKind::Interreflected, rays: 64, ..SETTINGS };
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| picture(&settings, &frame, 24))
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn every_form_of_surface_is_lit_on_every_visible_side() {
    let text = r#"
[camera]
origin = [0, 3, 6]
target = [0, 0, 0]
vertical_fov_degrees = 60
[[shape]]
name = "disk"
type = "disk"
radius = 0.8
transform = { rotate_degrees = [100, 0, 0], translate = [-2, 0, 0] }
material = { type = "diffuse", albedo = [0.5, 0.5, 0.5] }
[[shape]]
name = "heights"
type = "height-field"
extent = [1, 1]
posts = [9, 7]
heights.type = "sum-of-sines"
heights.waves = [{ amplitude = 0.001, kx = 1, kz = 1, phase = 0 }]
material = { type = "diffuse", albedo = [0.5, 0.5, 0.5] }
[[shape]]
name = "balls"
type = "spheres"
spheres = [[2, 0, 0, 0.5], [2, 0, -2, 0.2]]
material = { type = "diffuse", albedo = [0.5, 0.5, 0.5] }
"#;
    let frame = frame(text);
    let truth = path_traced(&frame, 32, 1, 64);
    let found = render(&Prt::new(SETTINGS), &frame, 32, 16).0;
    let (mean, _) = errors(&found, &truth);
    println!("disk from below, heights, spheres: mean {mean:.4}");
    assert!(mean < 0.02, "{mean}");
    let view = GBuffer::look(&frame, [32; 2], Region::whole(32, 32), Vec2::splat(0.5), &Room::default());
    let seen = |name: &str| {
        let is = |p: &&Pixel| matches!(p, Pixel::Point(p) if frame.shape_name(p.hit.instance) == name);
        view.pixels.iter().filter(is).count()
    };
    assert!(["disk", "heights", "balls"].iter().all(|name| seen(name) > 5));
}

#[test]
fn a_scene_without_an_environment_is_refused_with_a_way_out() {
    let mut frame = frame(BALL);
    frame.lights = Lights::default();
    let mut film = Film::new(4, 4);
    let error = Prt::new(SETTINGS).render(&frame, &mut film, &Budget::default(), &Quiet).unwrap_err();
    assert!(error.to_string().contains("environment"), "{error}");
}

#[test]
fn too_few_vertices_are_said_and_still_give_a_picture() {
    let frame = frame(&format!("{BALL}{FLOOR}"));
    let settings = PrtSettings { max_vertices: 40, ..SETTINGS };
    let (picture, report) = render(&Prt::new(settings), &frame, 16, 1);
    assert!(report.notes.iter().any(|n| n.contains("max_vertices")), "{:?}", report.notes);
    assert!(picture.iter().all(|p| p.is_finite()));
}

fn notes_of(settings: &PrtSettings, frame: &Frame) -> (Vec<Vec3>, String) {
    let (picture, report) = render(&Prt::new(settings.clone()), frame, 8, 1);
    (picture, report.notes.join("\n"))
}

fn with_cache(path: &FsPath) -> PrtSettings {
    let cache = Some(FilePath::direct(path));
    PrtSettings { cache, rays: 16, subdivisions: 0, max_edge: Some(1.0), ..SETTINGS }
}

#[test]
fn a_cache_gives_the_same_picture_and_a_stale_one_is_made_anew() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("transfer.safetensors");
    let mut settings = with_cache(&path);
    settings.transfer = TransferKind::Interreflected;
    let text =
        format!("{BALL}{}", FLOOR.replace("diffuse\", albedo = [0.5, 0.5, 0.5]", "phong\", exponent = 4"));
    let scene = frame(&text);
    let (first, notes) = notes_of(&settings, &scene);
    assert!(notes.contains("is kept in"), "{notes}");
    let (second, notes) = notes_of(&settings, &scene);
    assert!(notes.contains("transfer is from"), "{notes}");
    assert_eq!(first, second);
    // Another light is no reason.
    let turned = lit(scene, lights(9));
    assert!(notes_of(&settings, &turned).1.contains("transfer is from"));
    // Other settings, other places, other albedos are.
    let other = PrtSettings { rays: 17, ..settings.clone() };
    assert!(notes_of(&other, &turned).1.contains("another scene or other settings"));
    let moved = frame(&text.replace("0.9, 0, 0.5", "0.9, 0, 0.4"));
    assert!(notes_of(&other, &moved).1.contains("another scene or other settings"));
    let painted = frame(&text.replace("[0.8, 0.5, 0.3]", "[0.8, 0.5, 0.2]"));
    notes_of(&settings, &frame(&text));
    assert!(notes_of(&settings, &painted).1.contains("other materials"));
    // And then it is the cache of the new one.
    assert!(notes_of(&settings, &painted).1.contains("transfer is from"));
}

#[test]
fn a_damaged_cache_or_one_of_another_version_is_made_anew_with_the_same_picture() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("transfer.safetensors");
    let settings = with_cache(&path);
    let frame = frame(FLOOR);
    let (truth, _) = notes_of(&settings, &frame);
    let whole = std::fs::read(&path).unwrap();
    let mut checked = 0;
    let mut refuse = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        let (picture, notes) = notes_of(&settings, &frame);
        assert!(notes.contains("made anew"), "{notes}");
        assert_eq!(picture, truth);
        assert!(std::fs::read(&path).unwrap() == whole, "it is a sound cache again");
        checked += 1;
        notes
    };
    for length in (0..whole.len()).step_by(whole.len() / 30) {
        refuse(&whole[..length]);
    }
    for at in (0..whole.len()).step_by(whole.len() / 60) {
        let mut bytes = whole.clone();
        bytes[at] ^= 1 << (at % 8);
        refuse(&bytes);
    }
    refuse(&[&whole[..], b"more"].concat());
    refuse(&[&u64::MAX.to_le_bytes()[..], &whole[8..]].concat());
    let text = String::from_utf8_lossy(&whole[8..1000]).into_owned();
    let header = text.split("}}").next().unwrap();
    assert!(header.contains("\"version\":\"1\""), "{header}");
    let at = whole.windows(13).position(|w| w == b"\"version\":\"1\"").unwrap();
    let mut bytes = whole.clone();
    bytes[at + 11] = b'7';
    assert!(refuse(&bytes).contains("of version 7, not 1"));
    assert!(checked > 90);
}

#[test]
fn sizes_that_no_file_has_are_refused_without_room_for_them() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("transfer.safetensors");
    let settings = with_cache(&path);
    let frame = frame(FLOOR);
    notes_of(&settings, &frame);
    let whole = std::fs::read(&path).unwrap();
    let length = u64::from_le_bytes(whole[..8].try_into().unwrap()) as usize;
    let header = String::from_utf8(whole[8..8 + length].to_vec()).unwrap();
    for (name, huge) in [("vertices", usize::MAX), ("nodes", 1 << 40), ("n", 1 << 33), ("channels", 1 << 62)]
    {
        let start = header.find(&format!("\"{name}\":\"")).unwrap() + name.len() + 4;
        let end = start + header[start..].find('"').unwrap();
        let text = format!("{}{huge}{}", &header[..start], &header[end..]);
        let bytes = [&(text.len() as u64).to_le_bytes()[..], text.as_bytes(), &whole[8 + length..]].concat();
        std::fs::write(&path, bytes).unwrap();
        assert!(notes_of(&settings, &frame).1.contains("made anew"), "{name}");
    }
}

#[test]
fn a_cache_that_is_a_folder_keeps_one_file_for_each_scene() {
    let folder = tempfile::tempdir().unwrap();
    let settings = with_cache(folder.path());
    for text in [FLOOR, BALL] {
        notes_of(&settings, &frame(text));
        assert!(notes_of(&settings, &frame(text)).1.contains("transfer is from"));
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
}

#[test]
fn light_of_more_bands_than_the_order_is_cut_and_not_folded() {
    // The harmonics of the first bands are those of any order.
    let direction = Vec3::new(0.2, -0.6, 0.7).normalize();
    let (few, many) = (Sh::<4>::basis(axes(direction)), Sh::<MOST>::basis(axes(direction)));
    assert!(few.coefficients().iter().zip(many.coefficients()).all(|(a, b)| (a - b).abs() < 1e-6));
}

#[test]
fn the_cone_man_of_the_reference_pictures_is_close_to_the_reference() {
    let root = FsPath::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    let scene = root.join("tests/reference/hf25_coneman.toml");
    let reference = root.join("../shared/reference/hf25_coneman.direct.exr");
    if !reference.exists() {
        eprintln!("skipped: {} is not there", reference.display());
        return;
    }
    let frame = Scene::load(&scene, &LoadOptions::default()).unwrap().at(0.0).unwrap();
    let whole = halflight_image::load_rgb(&reference).unwrap();
    // Of a quarter of the size: a pixel is the mean of four by four.
    let (width, height) = (whole.width / 4, whole.height / 4);
    let truth: Vec<Vec3> = (0..width * height)
        .map(|i| {
            let (x, y) = (i % width * 4, i / width * 4);
            let inside = (0..16).map(|k| Vec3::from(whole.pixels[(y + k / 4) * whole.width + x + k % 4]));
            inside.sum::<Vec3>() / 16.0
        })
        .collect();
    let mut film = Film::new(width, height);
    let budget = Budget { samples: Some(16), ..Budget::default() };
    let settings = PrtSettings { rays: 128, order: 6, ..SETTINGS };
    let report = Prt::new(settings).render(&frame, &mut film, &budget, &Quiet).unwrap();
    let found: Vec<Vec3> = film.image().pixels.iter().map(|&p| Vec3::from(p)).collect();
    let (mean, most) = errors(&found, &truth);
    println!("cone man: mean {mean:.4}, greatest {most:.3}; {}", report.notes.join("; "));
    assert!(mean < 0.01, "{mean}");
}
