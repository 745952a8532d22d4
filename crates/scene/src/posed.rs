//! The objects of a scene as wholes: for techniques that stand something else in for their surfaces.
//!
//! A technique asks once for the surface of an object at rest ([`Scene::rest_surface`]), fits what it needs to it, and
//! follows the object from frame to frame by [`PosedObject`].

use std::ops::Range;

use glam::Affine3A;
use halflight_shape::{RestSurface, TriangleMesh};

use crate::build::Form;
use crate::scene::Scene;

/// Posts along each side of the grid of distances through which the surface of a learned field is found: a step is a
/// fortieth of the object, below what sphere sets resolve.
const FIELD_POSTS: u32 = 48;

/// Where an object of the scene is in a frame.
#[derive(Clone, Debug)]
pub struct PosedObject {
    /// Its number, see [`Scene::rest_surface`].
    pub object: usize,
    /// The instances of the frame's world that show it: the copies of its first part, then of the next.
    pub instances: Range<u32>,
    /// From the space of the rest surface to the world when the shutter opens, one for each copy.
    pub places: Vec<Affine3A>,
    /// For each node of a model the transform from its rest pose; empty for what only moves as a whole.
    pub joints: Vec<Affine3A>,
}

impl Scene {
    /// The surface of an object at rest, in its own space; `None` where there is no such object, or it is not made of
    /// triangles.
    pub fn rest_surface(&self, object: usize) -> Option<RestSurface> {
        match &self.objects.get(object)?.form {
            Form::Mesh(part) => {
                let (positions, triangles) = (part.mesh.positions.clone(), part.mesh.triangles.clone());
                let mesh = TriangleMesh { positions, triangles, ..TriangleMesh::default() };
                let name = self.objects[object].name.clone();
                Some(RestSurface { name, mesh, influences: Vec::new() })
            }
            Form::Model(model) => Some(model.model().rest_surface()),
            Form::Field(shape) => {
                let mesh = shape.tracer.field().solid(FIELD_POSTS);
                let name = self.objects[object].name.clone();
                (!mesh.triangles.is_empty()).then_some(RestSurface { name, mesh, influences: Vec::new() })
            }
            _ => None,
        }
    }

    /// How many objects there are: one for each shape of the scene file.
    pub fn object_count(&self) -> usize {
        self.objects.len()
    }

    /// The name of an object, as the scene file gives it.
    ///
    /// # Panics
    /// If there is no such object.
    pub fn object_name(&self, object: usize) -> &str {
        &self.objects[object].name
    }
}
