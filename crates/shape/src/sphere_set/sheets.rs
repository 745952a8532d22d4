//! Surfaces that enclose nothing, told from those that do.
//!
//! The vector area ∮ n dA of a closed surface is nought, that of a flat sheet its area. Rays alone cannot tell: below a
//! hill most of them meet the terrain. So where the vector area of a whole mesh is a large share of its area, the
//! connected parts of which that is true are left out when the inside is sought. A car whose panels close it only
//! together, and a scan with a hole, stay whole.

use std::borrow::Cow;
use std::collections::HashMap;

use glam::{DVec3, Vec3};

/// A mesh with a smaller share is taken as one that encloses something: an open box has 0.2, half a sphere 0.5.
const OPEN_MESH: f64 = 0.3;
/// Parts of an open mesh with a larger share are sheets.
const OPEN_PART: f64 = 0.45;

/// The triangles that may enclose something.
pub(super) fn without_sheets<'a>(positions: &[Vec3], triangles: &'a [[u32; 3]]) -> Cow<'a, [[u32; 3]]> {
    let areas: Vec<DVec3> = triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| positions[v as usize].as_dvec3());
            0.5 * (b - a).cross(c - a)
        })
        .collect();
    let open = |vector: DVec3, area: f64, share: f64| vector.length() > share * area;
    let total = areas.iter().map(|a| a.length()).sum();
    if !open(areas.iter().sum(), total, OPEN_MESH) {
        return Cow::Borrowed(triangles);
    }
    let parts = parts(positions, triangles);
    let mut sums = vec![(DVec3::ZERO, 0.0); positions.len()];
    for (part, area) in parts.iter().zip(&areas) {
        sums[*part].0 += *area;
        sums[*part].1 += area.length();
    }
    let keep = |part: usize| !open(sums[part].0, sums[part].1, OPEN_PART);
    Cow::Owned(triangles.iter().zip(&parts).filter(|(_, p)| keep(**p)).map(|(t, _)| *t).collect())
}

/// For each triangle the connected part it belongs to, named by one of its vertices; vertices at the same place connect.
fn parts(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<usize> {
    let mut first = HashMap::new();
    // Adding 0 makes −0 into 0.
    let key = |p: &Vec3| (*p + 0.0).to_array().map(f32::to_bits);
    let mut parent: Vec<usize> =
        positions.iter().enumerate().map(|(i, p)| *first.entry(key(p)).or_insert(i)).collect();
    for triangle in triangles {
        let [a, b, c] = triangle.map(|v| root(&mut parent, v as usize));
        let least = a.min(b).min(c);
        [a, b, c].into_iter().for_each(|v| parent[v] = least);
    }
    triangles.iter().map(|t| root(&mut parent, t[0] as usize)).collect()
}

/// The root of a vertex; the path to it is halved on the way.
fn root(parent: &mut [usize], mut vertex: usize) -> usize {
    while parent[vertex] != vertex {
        parent[vertex] = parent[parent[vertex]];
        vertex = parent[vertex];
    }
    vertex
}
