//! Rays against everything: one query interface, one module for each form of geometry.
//!
//! A [`World`] holds [`Instance`]s of [`Geometry`] and answers three questions: what does a ray meet first
//! ([`World::closest`]), does it meet anything ([`World::occluded`]), and what does shading need to know of the
//! point it met ([`World::surface`]). Many rays may be asked at once ([`World::closest_packet`]); the answers are
//! the same to the last bit, only sooner.
//!
//! ```
//! use std::sync::Arc;
//! use glam::Vec3;
//! use halflight_shape::TriangleMesh;
//! use halflight_trace::{Geometry, Instance, MeshTracer, Motion, Ray, Simd, World};
//!
//! let triangle = TriangleMesh {
//!     positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
//!     triangles: vec![[0, 1, 2]],
//!     ..TriangleMesh::default()
//! };
//! let geometry = Arc::new(Geometry::Mesh(MeshTracer::build(Arc::new(triangle))));
//! let world = World::build(vec![Instance { geometry, transform: Motion::IDENTITY }], Simd::detect());
//! let ray = Ray::new(Vec3::new(0.25, 0.25, 2.0), Vec3::NEG_Z);
//! let hit = world.closest(&ray).expect("the ray points at the triangle");
//! assert_eq!(hit.t, 2.0);
//! assert_eq!(world.surface(&ray, &hit).geometric_normal, Vec3::Z);
//! ```

pub mod bench;
mod distance;
mod flat;
mod geometry;
mod grid;
mod height_field;
mod mesh;
mod motion;
mod ray;
mod simd;
mod spheres;
mod world;

pub use distance::DistanceGrid;
pub use flat::{Disk, Rectangle};
pub use geometry::{FallbackCounts, Geometry, LocalHit, LocalSurface, RayGeometry};
pub use grid::{GridPoints, GridRows, GridTracer, RayGrid};
pub use height_field::HeightFieldTracer;
pub use mesh::MeshTracer;
pub use motion::Motion;
pub use ray::{Hit, Ray, Surface};
pub use simd::{Kernel, Simd, UnknownSimd};
pub use spheres::{Sphere, SphereTracer};
pub use world::{Gradients, Instance, World};
