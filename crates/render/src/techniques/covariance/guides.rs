//! Guides: what each pixel shows at first sight, as the mean over pixel, lens and shutter.
//!
//! Where light comes from first is cheap to know: normal, colour, nearness, and whether the narrowest light reaches it, by
//! rays without paths. An edge that lens or motion blur, or that a pixel cuts, is blurred in the guides as it is in the
//! picture, so what is left of the light beside them varies as slowly as covariance says without any edges. Rays of their own,
//! for the noise of guides must not be that of the samples.
//!
//! Cost: four camera rays and shadow rays a pixel, 32 or as many as samples next to edges and where those are blurred.

use glam::Vec3;
use halflight_scene::Frame;
use halflight_trace::Hit;
use rayon::prelude::*;

use super::film_axes::FilmAxes;
use super::look::{Look, Narrow};
use crate::camera_sample::CameraSampler;
use crate::vertex::Vertex;

/// How many guides a pixel has.
pub(super) const GUIDES: usize = 8;
/// Normal (3), colour (3), 1/depth (1/m), lit; nothing where nothing is.
pub(super) type Guides = [f32; GUIDES];
/// Which of them is the nearness, whose scale is that of the place.
pub(super) const NEARNESS: usize = 6;

/// Rays of a pixel: far from edges and, at least, near them. With 4 for all the error of what is blurred is half as large again as with 16 at 8
/// samples a pixel, with 32 it is a tenth less.
const RAYS: [u32; 2] = [4, 32];
/// With more samples than that as many rays as samples, or their noise would stay; but no more than these.
const MOST: u32 = 256;
/// How near is near: pixels, and deviations of the edge's blur.
const NEAR: [f32; 2] = [2.0, 2.5];
/// What tells their seed from that of samples.
pub(super) const SEED: u64 = 0x1f83_d9ab_fb41_bd6b;

/// The guides of all pixels, rows from the top, and how many rays they took, for a picture of so many samples a pixel. `camera` has
/// a seed of its own.
pub(super) fn guides(
    frame: &Frame,
    axes: &FilmAxes,
    look: &Look,
    camera: &CameraSampler,
    samples: u32,
) -> (Vec<Guides>, u64) {
    let counts = [RAYS[0], samples.clamp(RAYS[1], MOST)];
    let width = look.width;
    let narrow = Narrow::of(frame);
    let mut all = vec![[0.0; GUIDES]; width * look.height];
    let count: u64 = all
        .par_chunks_mut(width)
        .enumerate()
        .map(|(y, row)| {
            let rays = |x: usize| {
                let near = look.edges[y * width + x].is_within(NEAR[0], NEAR[1]);
                counts[usize::from(near)]
            };
            let rays: Vec<u32> = (0..width).map(rays).collect();
            let mut packet = Vec::with_capacity(width);
            let mut hits: Vec<Option<Hit>> = vec![None; width];
            for sample in 0..counts[1] {
                let of = (0..width).filter(|&x| sample < rays[x]);
                packet.clear();
                packet.extend(of.clone().map(|x| camera.ray(x, y, sample).0));
                let hits = &mut hits[..packet.len()];
                frame.world.closest_packet(&packet, hits);
                for ((x, ray), hit) in of.zip(&packet).zip(&*hits) {
                    let Some(hit) = hit else { continue };
                    let vertex = Vertex::new(frame, ray, hit);
                    let values = shown(frame, axes, &vertex, narrow, ray.time);
                    for (sum, value) in row[x].iter_mut().zip(values) {
                        *sum += value / rays[x] as f32;
                    }
                }
            }
            rays.iter().map(|&rays| u64::from(rays)).sum::<u64>()
        })
        .sum();
    (all, count * if narrow.is_some() { 2 } else { 1 })
}

fn shown(frame: &Frame, axes: &FilmAxes, vertex: &Vertex, narrow: Option<Narrow>, time: f32) -> Guides {
    let normal = vertex.shading_normal();
    let n = if normal.dot(vertex.towards_eye) < 0.0 { -normal } else { normal };
    let lit = narrow.is_none_or(|light| light.reaches(frame, vertex).0);
    // What shines is a colour too, but no brighter than white: guides are of one size.
    let color = vertex.bsdf.albedo() + vertex.emitted().min(Vec3::ONE);
    let nearness = 1.0 / axes.view.depth(vertex.surface.position, time).max(1e-6);
    [n.x, n.y, n.z, color.x, color.y, color.z, nearness, f32::from(lit)]
}
