//! Layers of what the eye sees first: alpha, depth, normal, position, albedo, material, and where a learned field asked
//! its mesh.
//!
//! A pixel's value is the mean over the camera rays of the picture's own samples, the first [`MAX_RAYS`] of them: the same
//! points of the pixel and of the lens and the same times, so that edges, blur of motion and blur of the lens lie where
//! the radiance has them. Alpha is the share of the rays that hit something, its error below 1/n for the stratified edge
//! of a surface; depth, normal, position and albedo are means over those that do, the material's index is that of the
//! first. Fallback is the share of the hits that were found by the whole mesh; there is no such layer where no shape of the scene
//! has a mesh to fall back to. Where nothing is hit depth is infinite and the others are zero. Cost: one camera ray a sample, traced in packets.

use glam::Vec3;
use halflight_scene::Frame;
use halflight_trace::Hit;
use rayon::prelude::*;

use crate::camera_sample::CameraSampler;
use crate::film::{Film, Tile};
use crate::vertex::Vertex;

/// Most rays a pixel: as many steps of alpha as eight bits tell apart, and few beside the paths of so many samples.
pub const MAX_RAYS: u32 = 256;
/// Fewest rays a pixel, for the edges of quick previews.
const MIN_RAYS: u32 = 4;
/// Columns and rows of the block of pixels whose rays are traced together.
const BLOCK: usize = 8;

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
    ("fallback", &["fallback"]),
];

/// Sums over the rays of a pixel that hit something.
#[derive(Clone, Copy, Default)]
struct Features {
    hits: u32,
    depth: f32,
    normal: Vec3,
    position: Vec3,
    albedo: Vec3,
    material: f32,
    fell_back: u32,
}

/// Adds the wanted layers (names of [`FEATURE_LAYERS`], others are left alone) to the film of a finished render, whose
/// seed this is. Layers of what the eye sees take as many rays a pixel as the film has samples, but no more than
/// `max_rays` and never fewer than four.
pub fn add_layers(frame: &Frame, film: &mut Film, seed: u64, wanted: &[&str], max_rays: u32) {
    let rays = film.min_samples().min(max_rays).max(MIN_RAYS);
    let camera = CameraSampler::new(frame, film.width(), film.height(), seed);
    let from_rays = |name: &&&str| !matches!(**name, "samples" | "variance");
    let features: Vec<Features> = if wanted.iter().any(|name| from_rays(&name)) {
        gather(frame, &camera, film, rays)
    } else {
        Vec::new()
    };
    let can_fall_back =
        frame.world.instances().iter().any(|instance| instance.geometry.as_rays().fallback().is_some());
    let shown = |name: &str| wanted.contains(&name) && (name != "fallback" || can_fall_back);
    for (name, channels) in FEATURE_LAYERS.iter().filter(|(name, _)| shown(name)) {
        for (index, channel) in channels.iter().enumerate() {
            let values = match *name {
                "samples" => film.map(|p| p.samples as f32),
                "variance" => film.map(|p| p.variance_of_mean().unwrap_or(0.0) as f32),
                _ => features.iter().map(|f| f.value(name, index, rays)).collect(),
            };
            film.layers.insert((*channel).to_string(), values);
        }
    }
}

/// The features of all pixels, rows from the top.
fn gather(frame: &Frame, camera: &CameraSampler, film: &Film, rays: u32) -> Vec<Features> {
    let tiles: Vec<Vec<Features>> =
        film.tiles().par_iter().map(|tile| of_tile(frame, camera, tile, rays)).collect();
    let mut all = vec![Features::default(); film.width() * film.height()];
    for (tile, features) in film.tiles().iter().zip(tiles) {
        for (row, values) in features.chunks(tile.width).enumerate() {
            let start = (tile.y + row) * film.width() + tile.x;
            all[start..start + tile.width].copy_from_slice(values);
        }
    }
    all
}

fn of_tile(frame: &Frame, camera: &CameraSampler, tile: &Tile, rays: u32) -> Vec<Features> {
    let mut features = vec![Features::default(); tile.pixels.len()];
    for top in (0..tile.height).step_by(BLOCK) {
        for left in (0..tile.width).step_by(BLOCK) {
            let (columns, rows) = (BLOCK.min(tile.width - left), BLOCK.min(tile.height - top));
            let count = columns * rows;
            let place = |i: usize| (left + i % columns, top + i / columns);
            let mut packet = [camera.ray(0, 0, 0).0; BLOCK * BLOCK];
            let mut hits: [Option<Hit>; BLOCK * BLOCK] = [None; BLOCK * BLOCK];
            for sample in 0..rays {
                for (i, ray) in packet[..count].iter_mut().enumerate() {
                    let (x, y) = place(i);
                    *ray = camera.ray(tile.x + x, tile.y + y, sample).0;
                }
                frame.world.closest_packet(&packet[..count], &mut hits[..count]);
                for (i, hit) in hits[..count].iter().enumerate() {
                    let Some(hit) = hit else { continue };
                    let (x, y) = place(i);
                    let vertex = Vertex::new(frame, &packet[i], hit);
                    let depth = camera.view().depth(vertex.surface.position, packet[i].time);
                    let feature = &mut features[y * tile.width + x];
                    feature.add(frame, &vertex, depth);
                    let geometry = &frame.world.instances()[hit.instance as usize].geometry;
                    feature.fell_back += u32::from(geometry.as_rays().fell_back(hit.primitive));
                }
            }
        }
    }
    features
}

impl Features {
    fn add(&mut self, frame: &Frame, vertex: &Vertex, depth: f32) {
        if self.hits == 0 {
            self.material =
                frame.material_index(vertex.surface.instance, vertex.surface.material_slot) as f32;
        }
        self.hits += 1;
        self.depth += depth;
        self.normal +=
            vertex.shading_normal() * vertex.surface.geometric_normal.dot(vertex.towards_eye).signum();
        self.position += vertex.surface.position;
        self.albedo += vertex.bsdf.albedo();
    }

    /// The value of a channel, of `rays` rays of which some hit.
    fn value(&self, layer: &str, channel: usize, rays: u32) -> f32 {
        let hits = self.hits as f32;
        match (layer, self.hits) {
            ("alpha", _) => hits / rays as f32,
            ("depth", 0) => f32::INFINITY,
            ("depth", _) => self.depth / hits,
            ("material", 0) => -1.0,
            ("material", _) => self.material,
            (_, 0) => 0.0,
            ("fallback", _) => self.fell_back as f32 / hits,
            ("normal", _) => self.normal.normalize_or_zero()[channel],
            ("position", _) => self.position[channel] / hits,
            _ => self.albedo[channel] / hits,
        }
    }
}

#[cfg(test)]
mod tests {
    use halflight_scene::{LoadOptions, Scene};

    use super::*;
    use crate::technique::{Budget, Quiet, Technique};
    use crate::techniques::path::{Path, PathSettings};

    /// A ball of radiance 1 in the dark that crosses a quarter of the picture while the shutter is open.
    const MOVING_BALL: &str = "
        environment = \"black\"
        [image]
        size = [21, 19]
        [camera]
        origin = [0, 0, 5]
        target = [0, 0, 0]
        shutter = [0, 1]
        [[shape]]
        type = \"sphere\"
        radius = 0.6
        material = { type = \"diffuse\", albedo = 0, emission = 1 }
        keyframes = [{ time = 0, translate = [-0.5, 0, 0] }, { time = 1, translate = [0.5, 0, 0] }]
    ";

    fn rendered(samples: u32) -> Film {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("ball.toml");
        std::fs::write(&path, MOVING_BALL).unwrap();
        let frame = Scene::load(&path, &LoadOptions::default()).unwrap().at(0.0).unwrap();
        let mut film = Film::new(21, 19);
        let path = Path::new(PathSettings { max_depth: 0, ..PathSettings::default() });
        let budget = Budget { samples: Some(samples), seed: 3, ..Budget::default() };
        path.render(&frame, &mut film, &budget, &Quiet).unwrap();
        add_layers(&frame, &mut film, 3, &["alpha", "depth", "material"], MAX_RAYS);
        film
    }

    #[test]
    fn alpha_is_the_share_of_the_pictures_own_samples_that_see_something() {
        for samples in [4, 16, 100] {
            let film = rendered(samples);
            let radiance = film.image();
            for (alpha, pixel) in film.layers["A"].iter().zip(&radiance.pixels) {
                assert!((alpha - pixel[0]).abs() < 1e-5, "{samples} samples: {alpha} {}", pixel[0]);
            }
        }
    }

    #[test]
    fn alpha_of_a_blurred_ball_converges_as_the_samples_grow() {
        let alpha = |samples: u32| rendered(samples).layers["A"].clone();
        let truth = rendered(4096).image();
        let error = |samples: u32| {
            let squares: f32 =
                alpha(samples).iter().zip(&truth.pixels).map(|(a, p)| (a - p[0]) * (a - p[0])).sum();
            (squares / truth.pixels.len() as f32).sqrt()
        };
        let (few, many) = (error(4), error(256));
        assert!(many < 0.008 && few > 6.0 * many, "{few} {many}");
    }

    #[test]
    fn where_nothing_is_hit_depth_is_infinite_and_there_is_no_material() {
        let film = rendered(8);
        assert_eq!((film.layers["A"][0], film.layers["depth.Z"][0]), (0.0, f32::INFINITY));
        assert_eq!(film.layers["material.id"][0], -1.0);
        let center = 9 * 21 + 10;
        assert!((film.layers["depth.Z"][center] - 4.4).abs() < 0.1 && film.layers["A"][center] > 0.9);
    }
}
