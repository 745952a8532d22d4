//! Layers of what the eye sees first: alpha, depth, normal, position, albedo, material.
//!
//! A pixel's value is the mean over four stratified camera rays that hit something (all of them for alpha); the
//! material's index is that of the first. Where nothing is hit depth is infinite and the others are zero.

use glam::Vec3;
use halflight_scene::Frame;
use rayon::prelude::*;

use crate::camera_sample::CameraSampler;
use crate::film::Film;
use crate::vertex::Vertex;

/// Rays per pixel: enough for a smooth alpha edge.
const SAMPLES: u32 = 4;

/// The layers that can be asked for, with their channels.
pub const FEATURE_LAYERS: &[(&str, &[&str])] = &[
    ("alpha", &["A"]),
    ("depth", &["depth.Z"]),
    ("normal", &["normal.X", "normal.Y", "normal.Z"]),
    ("position", &["position.X", "position.Y", "position.Z"]),
    ("albedo", &["albedo.R", "albedo.G", "albedo.B"]),
    ("material", &["material.id"]),
    ("samples", &["samples"]),
    ("variance", &["variance"]),
];

#[derive(Clone, Copy, Default)]
struct Features {
    alpha: f32,
    depth: f32,
    normal: Vec3,
    position: Vec3,
    albedo: Vec3,
    material: f32,
}

/// Adds the wanted layers (names of [`FEATURE_LAYERS`], others are left alone) to the film of a finished render.
pub fn add_layers(frame: &Frame, film: &mut Film, seed: u64, wanted: &[&str]) {
    let (width, height) = (film.width(), film.height());
    let camera = CameraSampler::new(frame, width, height, seed);
    let from_rays = |name: &&&str| !matches!(**name, "samples" | "variance");
    let features: Vec<Features> = if wanted.iter().any(|name| from_rays(&name)) {
        (0..width * height).into_par_iter().map(|i| pixel(frame, &camera, i % width, i / width)).collect()
    } else {
        Vec::new()
    };
    for (name, channels) in FEATURE_LAYERS.iter().filter(|(name, _)| wanted.contains(name)) {
        for (index, channel) in channels.iter().enumerate() {
            let values = match *name {
                "samples" => film.map(|p| p.samples as f32),
                "variance" => film.map(|p| p.variance_of_mean().unwrap_or(0.0) as f32),
                _ => features.iter().map(|f| value(f, name, index)).collect(),
            };
            film.layers.insert((*channel).to_string(), values);
        }
    }
}

fn value(features: &Features, layer: &str, index: usize) -> f32 {
    match layer {
        "alpha" => features.alpha,
        "depth" => features.depth,
        "normal" => features.normal[index],
        "position" => features.position[index],
        "albedo" => features.albedo[index],
        _ => features.material,
    }
}

fn pixel(frame: &Frame, camera: &CameraSampler, x: usize, y: usize) -> Features {
    let mut sum = Features { material: -1.0, ..Features::default() };
    let mut hits = 0.0f32;
    for sample in 0..SAMPLES {
        let (ray, _) = camera.ray(x, y, sample);
        let Some(hit) = frame.world.closest(&ray) else { continue };
        let vertex = Vertex::new(frame, &ray, &hit);
        if hits == 0.0 {
            sum.material = frame.material_index(vertex.surface.instance, vertex.surface.material_slot) as f32;
        }
        hits += 1.0;
        sum.depth += camera.view().depth(vertex.surface.position, ray.time);
        sum.normal +=
            vertex.shading_normal() * vertex.surface.geometric_normal.dot(vertex.towards_eye).signum();
        sum.position += vertex.surface.position;
        sum.albedo += vertex.bsdf.albedo();
    }
    if hits == 0.0 {
        return Features { depth: f32::INFINITY, ..sum };
    }
    Features {
        alpha: hits / SAMPLES as f32,
        depth: sum.depth / hits,
        normal: sum.normal.normalize_or_zero(),
        position: sum.position / hits,
        albedo: sum.albedo / hits,
        material: sum.material,
    }
}
