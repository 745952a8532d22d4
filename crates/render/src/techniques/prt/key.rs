//! What transfer depends on, as a number: two scenes of one number have one transfer.
//!
//! Geometry, transforms, which surfaces are glossy and which are seen from behind, and the settings. Not the light, not
//! the camera, not the picture. Of materials only the albedos at the vertices count, and only for interreflection: they
//! are hashed by themselves, as the vertices are known only afterwards.

use std::collections::HashMap;
use std::sync::Arc;

use glam::Vec3;
use halflight_scene::Frame;
use halflight_trace::Geometry;
use rayon::prelude::*;

use super::receivers::Receivers;
use super::settings::PrtSettings;
use super::transfer::{Transfer, longest_edge};
use crate::content::{Hasher, Key};

/// The version of the algorithm and of the file: one more with every change of what a cache holds.
pub(super) const VERSION: u32 = 1;

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
            let of_geometry =
                known.entry(Arc::as_ptr(geometry)).or_insert_with(|| geometry_key(geometry)).words();
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
        Geometry::Custom(custom) => {
            hasher.add(5);
            hasher.add(custom.identity());
        }
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
    hasher.key().words()[0]
}
