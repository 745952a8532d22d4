//! A whale, ten metres long, that leaps along +x: out of the sea, over it, and in again, its tail beating.

use glam::{Quat, Vec3};
use halflight_shape::TriangleMesh;

use crate::glb::{Body, Node, Scene, Skinned};
use crate::surface::{Section, append, loft};

const RATE: f32 = 30.0;
const KEYS: usize = 73;
/// Seconds of the leap.
const LEAP: f32 = (KEYS - 1) as f32 / RATE;
/// From head to tail: places of the joints along the body; the first, a third from the head, carries the rest.
const JOINTS: [f32; 8] = [1.2, 3.2, -0.4, -1.6, -2.7, -3.6, -4.3, -4.8];

pub(crate) fn scene() -> Scene {
    let mut nodes: Vec<Node> = (0..JOINTS.len())
        .map(|i| {
            let parent = match i {
                0 => None,
                1 | 2 => Some(0),
                _ => Some(i - 1),
            };
            let at = |i: usize| Vec3::X * JOINTS[i];
            let rest = at(i) - parent.map_or(Vec3::ZERO, at);
            Node { name: format!("spine {i}"), parent, rest, ..Node::default() }
        })
        .collect();
    // The pectoral fins.
    for side in [-1.0f32, 1.0] {
        nodes.push(Node {
            name: "fin".into(),
            parent: Some(0),
            rest: Vec3::new(1.4, -0.50, 0.75 * side),
            ..Node::default()
        });
    }
    for key in 0..KEYS {
        pose(&mut nodes, key as f32 / RATE);
    }
    Scene { nodes, interval: 1.0 / RATE, body: Body::Skin(body()) }
}

fn pose(nodes: &mut [Node], time: f32) {
    let u = time / LEAP - 0.5;
    // A parabola, nose along it.
    let (reach, height) = (7.0, 2.8);
    let place = Vec3::new(reach * u, 2.9 - 4.0 * height * u * u, 0.0);
    let pitch = (-8.0 * height * u / reach).atan();
    nodes[0].translations.push(place + Vec3::X * JOINTS[0]);
    nodes[0]
        .rotations
        .push(Quat::from_rotation_z(0.9 * pitch) * Quat::from_rotation_x(0.25 * (2.0 * u).sin()));
    for (i, node) in nodes.iter_mut().enumerate().take(JOINTS.len()).skip(1) {
        if i == 1 {
            node.rotations.push(Quat::from_rotation_z(-0.10 - 0.15 * u));
            continue;
        }
        // The body hangs behind the nose, and a wave runs down to the flukes.
        let behind = i as f32 - 1.0;
        let wave = 0.035 * behind * (std::f32::consts::TAU * (time / 1.2) - 0.55 * behind).sin();
        node.rotations.push(Quat::from_rotation_z(0.11 + wave));
    }
    for (node, side) in nodes[JOINTS.len()..].iter_mut().zip([-1.0f32, 1.0]) {
        let beat = 0.35 + 0.25 * (std::f32::consts::TAU * time / 2.4).sin();
        node.rotations.push(Quat::from_rotation_x(beat * side) * Quat::from_rotation_y(-0.3 * side));
    }
}

/// Half width, half height and height of the middle of the body at a place from nose (5) to tail (−5).
fn profile(x: f32) -> [f32; 3] {
    /// x, half width, half height, middle.
    const TABLE: [[f32; 4]; 13] = [
        [5.0, 0.05, 0.05, -0.10],
        [4.9, 0.36, 0.34, -0.10],
        [4.5, 0.62, 0.60, -0.08],
        [3.6, 0.86, 0.88, -0.04],
        [2.4, 1.00, 1.06, 0.0],
        [1.0, 1.02, 1.08, 0.0],
        [-0.4, 0.88, 0.94, 0.02],
        [-1.6, 0.65, 0.72, 0.06],
        [-2.7, 0.42, 0.50, 0.10],
        [-3.6, 0.26, 0.34, 0.12],
        [-4.3, 0.18, 0.23, 0.13],
        [-4.8, 0.14, 0.14, 0.13],
        [-5.0, 0.02, 0.02, 0.13],
    ];
    let after = TABLE.iter().position(|row| row[0] <= x).unwrap_or(TABLE.len() - 1).max(1);
    let (a, b) = (TABLE[after - 1], TABLE[after]);
    let t = ((a[0] - x) / (a[0] - b[0])).clamp(0.0, 1.0);
    [1, 2, 3].map(|i| a[i] + (b[i] - a[i]) * t)
}

fn body() -> Skinned {
    let mut skinned = Skinned { mesh: TriangleMesh::default(), joints: Vec::new() };
    let sections: Vec<Section> = (0..=64)
        .map(|i| {
            // Closer together at the round nose.
            let t = i as f32 / 64.0;
            let x = 5.0 - 10.0 * (0.35 * t * t + 0.65 * t);
            let smooth = [-0.12, 0.0, 0.12].map(|d| profile((x + d).clamp(-5.0, 5.0)));
            let [width, height, middle] = [0, 1, 2].map(|c| smooth.iter().map(|p| p[c]).sum::<f32>() / 3.0);
            let end = if i == 0 || i == 64 { 0.2 } else { 1.0 };
            Section {
                middle: Vec3::new(x, middle, 0.0),
                across: Vec3::Y * (height * end),
                up: Vec3::Z * (width * end),
            }
        })
        .collect();
    add(&mut skinned, &forward(&sections), 36, along_spine);
    for side in [-1.0f32, 1.0] {
        let tail = JOINTS.len() as u8 - 1;
        let flukes = wing(Vec3::new(-4.7, 0.13, 0.0), Vec3::new(-0.9, 0.10, 2.1 * side), 1.25, 0.16);
        add(&mut skinned, &flukes, 16, |_| ([tail; 2], 1.0));
        let fin = (JOINTS.len() + usize::from(side > 0.0)) as u8;
        let pectoral =
            wing(Vec3::new(1.4, -0.50, 0.70 * side), Vec3::new(-1.5, -0.45, 2.1 * side), 0.95, 0.18);
        add(&mut skinned, &pectoral, 16, |_| ([fin; 2], 1.0));
    }
    let dorsal = wing(Vec3::new(-1.6, 0.55, 0.0), Vec3::new(-0.7, 0.75, 0.0), 1.0, 0.16);
    add(&mut skinned, &dorsal, 14, along_spine);
    skinned
}

/// From head to tail `across` × `up` = y × z points along +x, so the sections must run from tail to head.
fn forward(sections: &[Section]) -> Vec<Section> {
    sections.iter().rev().copied().collect()
}

/// A fin: thin ellipses from a root along a span, swept and tapering.
fn wing(root: Vec3, span: Vec3, chord: f32, thickness: f32) -> Vec<Section> {
    let along = span.normalize();
    let chordwise = (Vec3::X - along * along.x).normalize();
    let thick = along.cross(chordwise);
    (0..=16)
        .map(|i| {
            let t = i as f32 / 16.0;
            // Round at both ends, widest after a fifth.
            let taper = (1.0 - t.powi(3)).max(0.0).sqrt() * (0.55 + 0.45 * (1.0 - t)).min(1.0);
            let taper = if i == 0 {
                0.3
            } else if i == 16 {
                0.05
            } else {
                taper
            };
            let swept = Vec3::X * (-0.25 * chord * t * t);
            Section {
                middle: root + span * t + swept,
                across: chordwise * (0.5 * chord * taper),
                up: thick * (0.5 * thickness * (0.4 + 0.6 * taper)),
            }
        })
        .collect()
}

/// The two joints that a place along the body lies between.
fn along_spine(place: Vec3) -> ([u8; 2], f32) {
    // Joints by falling x: 1, 0, 2, 3 …
    let order: Vec<usize> = [1, 0].into_iter().chain(2..JOINTS.len()).collect();
    let x = place.x;
    for pair in order.windows(2) {
        let (a, b) = (JOINTS[pair[0]], JOINTS[pair[1]]);
        if x >= b {
            let weight = ((x - b) / (a - b)).clamp(0.0, 1.0);
            // A joint moves what lies behind it; the blend is smooth.
            let weight = weight * weight * (3.0 - 2.0 * weight);
            return ([pair[0] as u8, pair[1] as u8], weight);
        }
    }
    ([order[order.len() - 1] as u8; 2], 1.0)
}

fn add(skinned: &mut Skinned, sections: &[Section], around: usize, joint: impl Fn(Vec3) -> ([u8; 2], f32)) {
    let mesh = loft(sections, around);
    skinned.joints.extend(mesh.positions.iter().map(|&p| joint(p)));
    append(&mut skinned.mesh, &mesh);
}
