//! What transfer depends on, as a number: two scenes of one number have one transfer.
//!
//! Geometry, transforms, which surfaces are glossy and which are seen from behind, and the settings. Not the light, not
//! the camera, not the picture. Of materials only the albedos at the vertices count, and only for interreflection: they
//! are hashed by themselves, as the vertices are known only afterwards.

use std::collections::HashMap;
use std::fmt;
use std::sync::Arc;

use glam::Vec3;
use halflight_scene::Frame;
use halflight_trace::Geometry;
use rayon::prelude::*;

use super::receivers::Receivers;
use super::settings::PrtSettings;
use super::transfer::{Transfer, longest_edge};

/// The version of the algorithm and of the file: one more with every change of what a cache holds.
pub(super) const VERSION: u32 = 1;

/// The number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Key([u64; 2]);

impl fmt::Display for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:016x}{:016x}", self.0[0], self.0[1])
    }
}

/// Two chains of multiplications and shifts, each after the finaliser of splitmix64 (Steele, Lea & Flood 2014): against
/// accident, not against malice.
pub(super) struct Hasher([u64; 2]);

impl Default for Hasher {
    fn default() -> Self {
        Self([0x243f_6a88_85a3_08d3, 0x1319_8a2e_0370_7344])
    }
}

fn mixed(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

impl Hasher {
    pub(super) fn add(&mut self, word: u64) {
        let [a, b] = self.0;
        self.0 = [mixed(a ^ word), mixed(b.rotate_left(23).wrapping_add(word))];
    }

    pub(super) fn bytes(&mut self, bytes: &[u8]) {
        self.add(bytes.len() as u64);
        for chunk in bytes.chunks(8) {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            self.add(u64::from_le_bytes(word));
        }
    }

    fn floats(&mut self, floats: &[f32]) {
        self.add(floats.len() as u64);
        floats.iter().for_each(|x| self.add(u64::from(x.to_bits())));
    }

    fn vectors(&mut self, vectors: &[Vec3]) {
        self.add(vectors.len() as u64);
        vectors.iter().for_each(|v| self.floats(&v.to_array()));
    }

    pub(super) fn key(&self) -> Key {
        Key(self.0)
    }
}

impl Key {
    /// Of a frame with these settings.
    pub(super) fn of(frame: &Frame, receivers: &Receivers, settings: &PrtSettings) -> Self {
        let mut hasher = Hasher::default();
        let PrtSettings { transfer, order, rays, subdivisions, tolerance, max_vertices, .. } = settings;
        for word in
            [VERSION, *transfer as u32, *order, settings.bounces(), *rays, *subdivisions, *max_vertices]
        {
            hasher.add(u64::from(word));
        }
        hasher.floats(&[*tolerance, longest_edge(frame, settings)]);
        let mut known: HashMap<*const Geometry, Key> = HashMap::new();
        for (number, instance) in frame.world.instances().iter().enumerate() {
            let geometry = &instance.geometry;
            let of_geometry = known.entry(Arc::as_ptr(geometry)).or_insert_with(|| geometry_key(geometry)).0;
            of_geometry.into_iter().for_each(|word| hasher.add(word));
            hasher.floats(&instance.transform.open.to_cols_array());
            hasher.add(receivers.said(number));
        }
        hasher.key()
    }
}

fn geometry_key(geometry: &Geometry) -> Key {
    let mut hasher = Hasher::default();
    match geometry {
        Geometry::Mesh(tracer) => {
            let mesh = tracer.mesh();
            hasher.add(0);
            hasher.vectors(&mesh.positions);
            hasher.vectors(&mesh.normals);
            hasher.add(mesh.triangles.len() as u64);
            mesh.triangles.as_flattened().iter().for_each(|&v| hasher.add(u64::from(v)));
        }
        Geometry::Spheres(tracer) => {
            hasher.add(1);
            for sphere in tracer.spheres() {
                hasher.floats(&[sphere.center.x, sphere.center.y, sphere.center.z, sphere.radius]);
            }
        }
        Geometry::HeightField(tracer) => {
            let field = tracer.field();
            hasher.add(2);
            hasher.add(field.columns as u64);
            hasher.floats(&[field.min.x, field.min.y, field.max.x, field.max.y]);
            hasher.floats(&field.heights);
        }
        Geometry::Rectangle(_) => hasher.add(3),
        Geometry::Disk(_) => hasher.add(4),
        Geometry::Custom(_) => hasher.add(5),
    }
    hasher.key()
}

/// The albedos that the transfer was worked out with; 0 where none count.
pub(super) fn albedos(
    transfer: &Transfer,
    frame: &Frame,
    receivers: &Receivers,
    settings: &PrtSettings,
) -> u64 {
    if settings.bounces() == 0 {
        return 0;
    }
    let places = transfer.tree.places(transfer.roots, transfer.normals.len());
    let albedos: Vec<Vec3> =
        places.par_iter().map(|&(root, weights)| receivers.point(frame, root, weights).albedo).collect();
    let mut hasher = Hasher::default();
    hasher.vectors(&albedos);
    hasher.key().0[0]
}
