//! A figure of cones that walks along +x over land that rolls. Its feet are held to the ground where it is at the time.
//!
//! The gait: each foot stands for 60 % of a second and swings for the rest, the other half a second later; the hips go
//! at constant speed; the knees follow by the law of cosines.

use glam::{Quat, Vec2, Vec3};
use halflight_shape::TriangleMesh;
use halflight_shape::procedural::{SineTerm, SumOfSines};

use crate::glb::{Body, Node, Scene, Skinned, at_rest};
use crate::surface::{append, tapered};

/// Keys a second, and how many.
const RATE: f32 = 30.0;
const KEYS: usize = 61;
/// Metres a second, and where the hips are at the start.
const SPEED: f32 = 1.15;
const START: f32 = -1.15;
/// Part of each second that a foot stands.
const STANCE: f32 = 0.6;
const THIGH: f32 = 0.46;
const SHIN: f32 = 0.46;
/// Height of the ankle above the sole.
const ANKLE: f32 = 0.09;
const HIP: f32 = THIGH + SHIN + ANKLE;

/// The land: the waves that `cone-man.toml` has as well.
pub(crate) fn land(x: f32, z: f32, time: f32) -> f32 {
    let wave = |amplitude, kx, kz, phase, angular_speed| SineTerm { amplitude, kx, kz, phase, angular_speed };
    let terms = vec![
        wave(0.20, 0.9, 0.35, 0.4, 0.9),
        wave(0.13, -0.7, 1.3, 2.1, -1.1),
        wave(0.06, 2.3, -1.1, 0.9, 1.6),
        wave(0.04, 1.1, 3.1, 4.0, 1.3),
    ];
    // A field of two posts about the place: the formula itself is what the scene evaluates.
    let height = halflight_shape::procedural::ProceduralHeight::SumOfSines(SumOfSines { terms });
    let (low, high) = (Vec2::new(x, z), Vec2::new(x + 0.01, z + 0.01));
    height.evaluate(2, 2, low, high, f64::from(time)).map_or(0.0, |field| field.heights[0])
}

/// Numbers of the nodes.
const HIPS: usize = 0;
const SPINE: usize = 1;
const HEAD: usize = 2;
/// Upper arm and forearm, left and right.
const ARMS: [[usize; 2]; 2] = [[3, 4], [5, 6]];
/// Thigh, shin and foot.
const LEGS: [[usize; 3]; 2] = [[7, 8, 9], [10, 11, 12]];
const SIDES: [f32; 2] = [-1.0, 1.0];

pub(crate) fn scene() -> Scene {
    let mut nodes = skeleton();
    for key in 0..KEYS {
        pose(&mut nodes, key as f32 / RATE);
    }
    let skinned = body(&nodes);
    Scene { nodes, interval: 1.0 / RATE, body: Body::Skin(skinned) }
}

fn skeleton() -> Vec<Node> {
    let node = |name: &str, parent: Option<usize>, rest: Vec3| Node {
        name: name.into(),
        parent,
        rest,
        ..Node::default()
    };
    let mut nodes = vec![
        node("hips", None, Vec3::Y * HIP),
        node("spine", Some(HIPS), Vec3::Y * 0.08),
        node("head", Some(SPINE), Vec3::Y * 0.56),
    ];
    for side in SIDES {
        let parent = nodes.len();
        nodes.push(node("upper arm", Some(SPINE), Vec3::new(0.0, 0.44, 0.20 * side)));
        nodes.push(node("forearm", Some(parent), Vec3::NEG_Y * 0.30));
    }
    for side in SIDES {
        let parent = nodes.len();
        nodes.push(node("thigh", Some(HIPS), Vec3::Z * 0.12 * side));
        nodes.push(node("shin", Some(parent), Vec3::NEG_Y * THIGH));
        nodes.push(node("foot", Some(parent + 1), Vec3::NEG_Y * SHIN));
    }
    nodes
}

/// Where a sole is, and how much its toes point down.
fn foot(side: usize, time: f32) -> (Vec3, f32) {
    let beat = time + 0.5 * side as f32 + 0.3;
    let (step, part) = (beat.floor(), beat.fract());
    // The middle of the stance is below the hips.
    let planted = |step: f32| {
        let middle = step + 0.5 * STANCE - 0.3 - 0.5 * side as f32;
        START + SPEED * middle
    };
    let z = 0.12 * SIDES[side];
    if part < STANCE {
        let x = planted(step);
        let lift = ((part / STANCE - 0.75) / 0.25).max(0.0);
        return (Vec3::new(x, land(x, z, time) + 0.05 * lift * lift, z), 0.5 * lift * lift);
    }
    let u = (part - STANCE) / (1.0 - STANCE);
    let ease = u * u * (3.0 - 2.0 * u);
    let x = planted(step) + (planted(step + 1.0) - planted(step)) * ease;
    let lift = 0.05 * (1.0 - u).powi(2) + 0.15 * (std::f32::consts::PI * u).sin();
    (
        Vec3::new(x, land(x, z, time) + lift, z),
        0.5 * (1.0 - u).powi(2) - 0.3 * (std::f32::consts::PI * u).sin() * u,
    )
}

/// Adds the keys of a time.
fn pose(nodes: &mut [Node], time: f32) {
    let about = Quat::from_rotation_z;
    let x = START + SPEED * time;
    let ground = [-0.3, 0.0, 0.3].map(|ahead| land(x + ahead, 0.0, time)).iter().sum::<f32>() / 3.0;
    let soles = [0, 1].map(|side| foot(side, time));
    // As high as a straight walk, but never out of reach of a foot.
    let bob = 0.02 * (2.0 * std::f32::consts::TAU * time).cos();
    let reach = |sole: Vec3| {
        let across = sole.x - x;
        sole.y + ANKLE + ((0.985 * (THIGH + SHIN)).powi(2) - across * across).max(0.0).sqrt()
    };
    let y = (ground + HIP - 0.07 + bob).min(reach(soles[0].0)).min(reach(soles[1].0));
    let hips = Vec3::new(x, y, 0.0);
    nodes[HIPS].translations.push(hips);
    let swing = (std::f32::consts::TAU * (time + 0.3 - 0.5 * STANCE)).cos();
    nodes[SPINE].rotations.push(Quat::from_rotation_y(0.12 * swing) * about(-0.07));
    nodes[HEAD].rotations.push(Quat::from_rotation_y(-0.12 * swing) * about(0.05));
    for side in 0..2 {
        let forward = if side == 0 { -swing } else { swing };
        let [upper, fore] = ARMS[side];
        nodes[upper].rotations.push(Quat::from_rotation_x(-0.16 * SIDES[side]) * about(0.55 * forward));
        nodes[fore].rotations.push(about(0.45 + 0.25 * forward));
        let (sole, toes) = soles[side];
        let ankle = Vec2::new(sole.x, sole.y + ANKLE) - Vec2::new(hips.x, hips.y);
        let (thigh, shin) = knee(ankle);
        let [upper, lower, foot] = LEGS[side];
        nodes[upper].rotations.push(about(thigh));
        nodes[lower].rotations.push(about(shin));
        let slope = (land(sole.x + 0.1, sole.z, time) - land(sole.x - 0.1, sole.z, time)) / 0.2;
        nodes[foot].rotations.push(about(slope.atan() - toes - thigh - shin));
    }
}

/// Turns of thigh and shin, from straight down, that bring the ankle to a place below the hip; the knee bends forwards.
fn knee(ankle: Vec2) -> (f32, f32) {
    let distance = ankle.length().min(0.999 * (THIGH + SHIN));
    let towards = ankle.x.atan2(-ankle.y);
    let cosine = |opposite: f32, a: f32, b: f32| (a * a + b * b - opposite * opposite) / (2.0 * a * b);
    let at_hip = cosine(SHIN, THIGH, distance).clamp(-1.0, 1.0).acos();
    let at_knee = cosine(distance, THIGH, SHIN).clamp(-1.0, 1.0).acos();
    (towards + at_hip, at_knee - std::f32::consts::PI)
}

/// Cones around the bones, each moved by its own.
fn body(nodes: &[Node]) -> Skinned {
    let mut skinned = Skinned { mesh: TriangleMesh::default(), joints: Vec::new() };
    let place = |node: usize| at_rest(nodes, node);
    let mut part = |node: usize, from: Vec3, to: Vec3, radii: [f32; 2], flat: f32, around: usize| {
        let mesh = tapered(from, to, radii[0], radii[1], flat, around);
        skinned.joints.extend(std::iter::repeat_n(([node as u8; 2], 1.0), mesh.positions.len()));
        append(&mut skinned.mesh, &mesh);
    };
    let (hips, spine, head) = (place(HIPS), place(SPINE), place(HEAD));
    let up = |from: Vec3, x: f32, y: f32| from + Vec3::new(x, y, 0.0);
    // A skirt, shoulders, a face, and the cone that gives him his name.
    part(HIPS, up(hips, 0.0, -0.26), up(hips, 0.0, 0.16), [0.38, 0.19], 0.15, 32);
    part(SPINE, up(spine, 0.0, 0.02), up(spine, 0.0, 0.47), [0.23, 0.12], 0.6, 28);
    part(HEAD, up(head, 0.0, -0.08), up(head, 0.0, 0.04), [0.06, 0.05], 1.0, 14);
    part(HEAD, up(head, 0.015, 0.13), up(head, 0.015, 0.17), [0.15, 0.14], 1.0, 24);
    part(HEAD, up(head, 0.0, 0.22), up(head, -0.07, 0.64), [0.31, 0.012], 0.12, 28);
    for side in 0..2 {
        let [upper, fore] = ARMS[side].map(place);
        part(ARMS[side][0], upper, fore, [0.105, 0.055], 1.0, 16);
        part(ARMS[side][1], fore, up(fore, 0.0, -0.32), [0.08, 0.04], 1.0, 16);
        let [thigh, shin, foot] = LEGS[side].map(place);
        part(LEGS[side][0], up(thigh, 0.0, -0.06), shin, [0.12, 0.065], 1.0, 18);
        part(LEGS[side][1], shin, foot, [0.10, 0.045], 1.0, 16);
        let sole = up(foot, 0.0, 0.05 - ANKLE);
        part(LEGS[side][2], up(sole, -0.03, 0.0), up(sole, 0.18, -0.01), [0.055, 0.05], 1.0, 14);
    }
    skinned
}
