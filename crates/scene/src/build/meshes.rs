//! Meshes: still ones with one tracer for all frames, and models that move.

use std::sync::{Arc, OnceLock};

use glam::{Affine3A, Vec2, Vec3};
use halflight_material::{Texture, Wrap};
use halflight_shape::{Model, ModelLight, PosedMesh, TriangleMesh};
use halflight_trace::{Geometry, MeshTracer};
use rayon::prelude::*;

use super::Displacement;
use crate::spec::Shading;

/// A mesh that keeps its shape; its tracer is built when it is first needed.
#[derive(Debug)]
pub(crate) struct MeshPart {
    pub(crate) mesh: Arc<TriangleMesh>,
    tracer: OnceLock<Arc<Geometry>>,
}

impl MeshPart {
    pub(crate) fn new(mesh: Arc<TriangleMesh>) -> Self {
        Self { mesh, tracer: OnceLock::new() }
    }

    pub(crate) fn geometry(&self) -> Arc<Geometry> {
        let build = || Arc::new(Geometry::Mesh(MeshTracer::build(Arc::clone(&self.mesh))));
        Arc::clone(built_once(&self.tracer, build))
    }
}

/// What is there, or else is built. Nobody waits for another's building: a thread that did, while it helps others, could
/// come to wait for itself. At worst a thing is built twice, and one of the two is dropped.
pub(crate) fn built_once<T>(place: &OnceLock<T>, build: impl FnOnce() -> T) -> &T {
    match place.get() {
        Some(there) => there,
        None => {
            let built = build();
            place.get_or_init(|| built)
        }
    }
}

/// How a mesh is changed after it was loaded.
#[derive(Clone, Default)]
pub(crate) struct Finish {
    pub(crate) shading: Option<Shading>,
    pub(crate) displacement: Option<Arc<Displacement>>,
    /// Whether its materials need tangents.
    pub(crate) tangents: bool,
}

impl Finish {
    /// The mesh as it is shown, and what could not be done to it.
    pub(crate) fn apply(&self, mesh: &Arc<TriangleMesh>, warn: &mut dyn FnMut(String)) -> Arc<TriangleMesh> {
        let mut result = Arc::clone(mesh);
        if let Some(displacement) = &self.displacement {
            match displaced(mesh, displacement) {
                Ok(moved) => result = Arc::new(moved),
                Err(why) => warn(why),
            }
        }
        match self.shading {
            Some(Shading::Flat) if !result.normals.is_empty() => {
                let mesh = Arc::make_mut(&mut result);
                mesh.normals.clear();
                mesh.tangents.clear();
            }
            Some(Shading::Smooth) if result.normals.is_empty() => {
                Arc::make_mut(&mut result).compute_smooth_normals()
            }
            _ => {}
        }
        // Facets have the tangents of their own triangles, which the tracer finds.
        if self.tangents && result.tangents.is_empty() && !result.normals.is_empty() {
            Arc::make_mut(&mut result).compute_tangents();
        }
        result
    }

    /// The same for a mesh that deforms, whose triangles must stay the same.
    fn apply_posed(&self, mesh: &Arc<TriangleMesh>) -> Arc<TriangleMesh> {
        let kept = Self { displacement: None, ..self.clone() };
        kept.apply(mesh, &mut |_| {})
    }
}

/// The most triangles that a displaced mesh is cut into.
const MOST_DISPLACED: usize = 4_000_000;

fn displaced(mesh: &TriangleMesh, displacement: &Displacement) -> Result<TriangleMesh, String> {
    if mesh.uvs.is_empty() {
        return Err("the displacement is left out: the mesh has no texture coordinates".into());
    }
    let mut fine = mesh.clone();
    let diagonal = mesh.bounds().map_or(0.0, |(low, high)| low.distance(high));
    let edge = displacement.edge.unwrap_or(0.01 * diagonal);
    if let Err(error) = fine.subdivide_to_edge(edge, MOST_DISPLACED) {
        return Err(format!("the displacement is left out: {error}"));
    }
    let within = mesh.uvs.iter().all(|uv| uv.cmpge(Vec2::ZERO).all() && uv.cmple(Vec2::ONE).all());
    let wrap = displacement.wrap.unwrap_or(if within { Wrap::Clamp } else { Wrap::Repeat });
    let texture = Texture { wrap_u: wrap, wrap_v: wrap, ..displacement.texture.clone() };
    let heights = |uv| texture.sample(uv).x - displacement.middle;
    fine.displace(heights, displacement.scale);
    if mesh.normals.is_empty() {
        fine.normals.clear();
    }
    Ok(fine)
}

/// A model, still or moving.
pub(crate) struct ModelShape {
    model: Arc<Model>,
    finish: Finish,
    /// Time in the animation = start + speed · time.
    start: f64,
    speed: f64,
    looped: bool,
    /// One for each mesh that the model draws, in the order of its poses.
    parts: Vec<ModelPart>,
    /// The meshes that keep their shape, each once however often it is drawn.
    still: Vec<MeshPart>,
}

enum ModelPart {
    /// Keeps its shape: index into `still`.
    Still(usize),
    /// Deforms: a tracer of its shape at the start, which later ones are refitted from.
    Deforms(OnceLock<Box<MeshTracer>>),
}

/// One mesh of a model over a shutter interval.
pub(crate) struct PosedPart {
    pub(crate) geometry: Arc<Geometry>,
    pub(crate) transform: [Affine3A; 2],
}

impl ModelShape {
    pub(crate) fn new(
        model: Arc<Model>,
        finish: Finish,
        (start, speed, looped): (f64, f64, bool),
        warn: &mut dyn FnMut(String),
    ) -> Self {
        let mut still: Vec<MeshPart> = Vec::new();
        let mut known: Vec<*const TriangleMesh> = Vec::new();
        let mut deforming = false;
        let parts = model
            .pose(start as f32)
            .iter()
            .map(|posed| {
                if posed.deforms {
                    deforming = true;
                    return ModelPart::Deforms(OnceLock::new());
                }
                let identity = Arc::as_ptr(&posed.mesh);
                let index = known.iter().position(|&k| k == identity).unwrap_or_else(|| {
                    known.push(identity);
                    still.push(MeshPart::new(finish.apply(&posed.mesh, warn)));
                    still.len() - 1
                });
                ModelPart::Still(index)
            })
            .collect();
        if deforming && finish.displacement.is_some() {
            warn("the displacement is left out where the mesh deforms".into());
        }
        Self { model, finish, start, speed, looped, parts, still }
    }

    pub(crate) fn is_animated(&self) -> bool {
        self.model.is_animated() && self.speed != 0.0
    }

    /// Seconds until the motion ends or begins again.
    pub(crate) fn duration(&self) -> Option<f64> {
        let duration = f64::from(self.model.duration()?);
        (self.speed != 0.0 && duration > 0.0).then(|| duration / self.speed.abs())
    }

    pub(crate) fn model(&self) -> &Model {
        &self.model
    }

    /// The times in the animation when the shutter opens and closes. A loop that ends in between is held at its end.
    fn clock(&self, times: [f64; 2]) -> [f32; 2] {
        let [open, close] = times.map(|t| self.start + self.speed * t);
        let Some(duration) = self.model.duration().map(f64::from).filter(|&d| self.looped && d > 0.0) else {
            return [open as f32, close as f32];
        };
        let first = open.rem_euclid(duration);
        [first as f32, (first + (close - open)).clamp(0.0, duration) as f32]
    }

    /// For each node of the model the transform from its rest pose to where it is when the shutter opens.
    pub(crate) fn joints(&self, times: [f64; 2]) -> Vec<Affine3A> {
        self.model.rest_to_pose(self.clock(times)[0])
    }

    /// The lights of the file, with the transforms of their nodes when the shutter opens and when it closes.
    pub(crate) fn lights(&self, times: [f64; 2]) -> Vec<(&ModelLight, [Affine3A; 2])> {
        if self.model.lights.is_empty() {
            return Vec::new();
        }
        let [open, close] = self.clock(times).map(|time| self.model.transforms(time));
        self.model.lights.iter().map(|light| (light, [open[light.node], close[light.node]])).collect()
    }

    /// The meshes at the opening of the shutter, as they are shown.
    pub(crate) fn meshes(&self, time: f64) -> Vec<(Arc<TriangleMesh>, Affine3A)> {
        let [open, _] = self.clock([time; 2]);
        let posed = self.model.pose(open);
        let shown = |(part, posed): (&ModelPart, &PosedMesh)| match part {
            ModelPart::Still(index) => (Arc::clone(&self.still[*index].mesh), posed.transform),
            ModelPart::Deforms(_) => (Arc::clone(&posed.mesh), posed.transform),
        };
        self.parts.iter().zip(&posed).map(shown).collect()
    }

    /// Builds what all frames share, by all threads.
    pub(crate) fn prepare(&self) {
        self.still.par_iter().for_each(|part| {
            part.geometry();
        });
        let wanted = |part: &ModelPart| matches!(part, ModelPart::Deforms(rest) if rest.get().is_none());
        if self.parts.iter().any(wanted) {
            let posed = self.model.pose(self.start as f32);
            self.parts.par_iter().zip(&posed).for_each(|(part, posed)| {
                if let ModelPart::Deforms(rest) = part {
                    self.rest_tracer(rest, posed);
                }
            });
        }
    }

    fn rest_tracer<'a>(&self, rest: &'a OnceLock<Box<MeshTracer>>, at_start: &PosedMesh) -> &'a MeshTracer {
        let build = || Box::new(MeshTracer::build(self.finish.apply_posed(&at_start.mesh)));
        built_once(rest, build).as_ref()
    }

    /// The meshes over a shutter interval.
    pub(crate) fn pose(&self, times: [f64; 2]) -> Vec<PosedPart> {
        let [open, close] = self.clock(times);
        let at_open = self.model.pose(open);
        let at_close = if open == close { None } else { Some(self.model.pose(close)) };
        let part = |(index, part): (usize, &ModelPart)| {
            let before = &at_open[index];
            let after = at_close.as_ref().map_or(before, |posed| &posed[index]);
            let geometry = match part {
                ModelPart::Still(still) => self.still[*still].geometry(),
                ModelPart::Deforms(rest) => {
                    let rest = match rest.get() {
                        Some(tracer) => tracer,
                        None => self.rest_tracer(rest, &self.model.pose(self.start as f32)[index]),
                    };
                    let moved: Option<Vec<Vec3>> = at_close.as_ref().map(|_| after.mesh.positions.clone());
                    // Always from the same tree, so that a frame does not depend on those asked for before it.
                    let mut tracer = MeshTracer::clone(rest);
                    tracer.refit(self.finish.apply_posed(&before.mesh), moved);
                    Arc::new(Geometry::Mesh(tracer))
                }
            };
            PosedPart { geometry, transform: [before.transform, after.transform] }
        };
        self.parts.par_iter().enumerate().map(part).collect()
    }
}
