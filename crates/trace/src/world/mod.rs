//! Instances of geometry, asked together.

mod gradients;
mod packet;
mod place;
mod query;
mod scattered;
mod surface;

pub use gradients::Gradients;
pub(crate) use query::keep;

use std::sync::Arc;

use glam::Vec3;

use crate::mesh::node::Tree;
use crate::mesh::walk::Reach;
use crate::mesh::{build, item};
use crate::{Geometry, Hit, Motion, Ray, Simd, Surface};
use place::Place;

/// A geometry somewhere in the world.
#[derive(Clone, Debug)]
pub struct Instance {
    /// What stands there; may be shared with other instances.
    pub geometry: Arc<Geometry>,
    /// From its space to the world, over the shutter interval.
    pub transform: Motion,
}

impl Instance {
    /// A geometry where its own coordinates say.
    #[must_use]
    pub fn at_origin(geometry: Geometry) -> Instance {
        Instance { geometry: Arc::new(geometry), transform: Motion::IDENTITY }
    }
}

/// Everything that rays can meet at one instant, or over one shutter interval.
#[derive(Clone, Debug)]
pub struct World {
    simd: Simd,
    instances: Vec<Instance>,
    places: Vec<Place>,
    top: Top,
    bounds: (Vec3, Vec3),
}

/// How rays find the instances.
#[derive(Clone, Debug)]
enum Top {
    /// There are none, or none that can be met.
    Nothing,
    /// There is only one: it is asked at once.
    One(u32),
    /// A tree with one instance in each leaf.
    Many(Box<Many>),
}

#[derive(Clone, Debug)]
struct Many {
    tree: Tree,
    reach: Reach,
    /// The instance of each leaf.
    instances: Vec<u32>,
}

impl World {
    /// Puts instances into a world. Those that cannot be met (of no extent in two dimensions or more, or with a
    /// transform that is singular or not finite) stay in [`World::instances`] but are passed over.
    #[must_use]
    pub fn build(instances: Vec<Instance>, simd: Simd) -> World {
        let places: Vec<Place> = instances.iter().map(Place::new).collect();
        let mut bounds = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let mut items = Vec::new();
        for (number, place) in places.iter().enumerate() {
            if let Some([open, close]) = place.bounds {
                let (low, high) = (open.0.min(close.0), open.1.max(close.1));
                items.push(item(low, high, number as u32));
                bounds = (bounds.0.min(low), bounds.1.max(high));
            }
        }
        let simd = simd.or_best();
        let top = match items.len() {
            0 => Top::Nothing,
            1 => Top::One(crate::mesh::item_number(&items[0])),
            _ => Top::Many(Box::new(Many::build(simd, items, &places, bounds))),
        };
        if matches!(top, Top::Nothing) {
            bounds = (Vec3::ZERO, Vec3::ZERO);
        }
        World { simd, instances, places, top, bounds }
    }

    /// The nearest hit with 0 < t ≤ `ray.t_max`, or none. Of hits at the same distance it is the one of the smallest
    /// instance and primitive.
    #[inline]
    #[must_use]
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        query::closest(self, ray)
    }

    /// Whether anything lies at 0 < t ≤ `ray.t_max`.
    #[inline]
    #[must_use]
    pub fn occluded(&self, ray: &Ray) -> bool {
        query::occluded(self, ray)
    }

    /// [`World::closest`] for many rays. Any number in any order is right; rays that start close together and go in
    /// nearly one direction, 64 neighbours in the slice, are much faster than one at a time.
    ///
    /// # Panics
    /// If there are fewer places for hits than rays.
    pub fn closest_packet(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        packet::closest_packet(self, rays, &mut hits[..rays.len()]);
    }

    /// [`World::occluded`] for many rays; see [`World::closest_packet`].
    ///
    /// # Panics
    /// If there are fewer places for answers than rays.
    pub fn occluded_packet(&self, rays: &[Ray], blocked: &mut [bool]) {
        packet::occluded_packet(self, rays, &mut blocked[..rays.len()]);
    }

    /// [`World::occluded`] for many rays that need not have anything in common, as those from the surfaces of a block
    /// of pixels to the lights.
    ///
    /// # Panics
    /// If there are fewer places for answers than rays.
    pub fn occluded_scattered(&self, rays: &[Ray], blocked: &mut [bool]) {
        scattered::occluded_scattered(self, rays, &mut blocked[..rays.len()]);
    }

    /// What shading needs to know of a hit that this world gave for this ray.
    #[inline]
    #[must_use]
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> Surface {
        surface::surface(self, ray, hit)
    }

    /// [`World::closest`] for up to 64 rays and one instance alone.
    pub(crate) fn closest_of(&self, instance: u32, rays: &[Ray], hits: &mut [Option<Hit>]) {
        packet::closest_of(self, instance, rays, hits);
    }

    /// From the space of an instance to the world as the shutter opens; none if the instance cannot be met.
    pub(crate) fn placed(&self, instance: u32) -> Option<glam::Affine3A> {
        let place = &self.places[instance as usize];
        place.bounds.map(|_| self.instances[instance as usize].transform.open)
    }

    /// How texture coordinates and the shading normal change along the surface at a hit of a ray of this time; `None` for
    /// shapes that do not tell.
    #[must_use]
    pub fn gradients(&self, hit: &Hit, time: f32, surface: &Surface) -> Option<Gradients> {
        gradients::gradients(self, hit, time, surface)
    }

    /// Lower and upper corner of everything, over the shutter interval; both zero for an empty world.
    #[must_use]
    pub fn bounds(&self) -> (Vec3, Vec3) {
        self.bounds
    }

    /// The instances, as they were given.
    #[must_use]
    pub fn instances(&self) -> &[Instance] {
        &self.instances
    }

    /// The level of vector instructions in use.
    #[must_use]
    pub fn simd(&self) -> Simd {
        self.simd
    }

    /// Bytes held for tracing: the world's own tree and those of its geometries, each counted once.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let mut seen = std::collections::HashSet::new();
        let own = size_of_val(self.places.as_slice())
            + match &self.top {
                Top::Many(many) => many.tree.memory_bytes() + size_of_val(many.instances.as_slice()),
                _ => 0,
            };
        let of_geometries: usize = self
            .instances
            .iter()
            .filter(|instance| seen.insert(Arc::as_ptr(&instance.geometry)))
            .map(|instance| instance.geometry.as_rays().memory_bytes())
            .sum();
        own + of_geometries
    }
}

impl Many {
    fn build(simd: Simd, items: Vec<[f32; 8]>, places: &[Place], bounds: (Vec3, Vec3)) -> Many {
        let built = build::build(simd, items, 1);
        let instances: Vec<u32> = built.leaves.iter().map(|leaf| leaf[0]).collect();
        let boxes_at = |end: usize| -> Vec<(Vec3, Vec3)> {
            instances
                .iter()
                .map(|&number| {
                    places[number as usize]
                        .bounds
                        .map_or((Vec3::INFINITY, Vec3::NEG_INFINITY), |ends| ends[end])
                })
                .collect()
        };
        let mut tree = built.tree;
        if places.iter().any(|place| place.bounds.is_some_and(|[open, close]| open != close)) {
            let rows = crate::mesh::node_rows(&tree.nodes, &boxes_at(0));
            for (node, rows) in tree.nodes.iter_mut().zip(rows) {
                node.rows = rows;
            }
            tree.close = crate::mesh::node_rows(&tree.nodes, &boxes_at(1));
        }
        Many { tree, reach: Reach::new(bounds.0, bounds.1), instances }
    }
}
