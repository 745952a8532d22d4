//! Sheets of pictures, as the figures of [002]: a field beside its mesh (Fig. 3), from several angles (Fig. 4), and cut
//! through (Fig. 7).

use std::f32::consts::{PI, TAU};
use std::path::PathBuf;
use std::sync::Arc;

use clap::ValueEnum;
use glam::Vec3;
use halflight_ddf::{DirectedField, FieldTracer};
use halflight_image::{Picture, ToneCurve};
use halflight_trace::{MeshTracer, Ray, RayGeometry};
use rayon::prelude::*;

use super::super::console::Console;
use super::super::failure::Failure;
use super::super::output::{self, Encoding};
use super::render::{Range, Seen, Show, by_field, by_mesh, color, index_of, view_rays};

/// What a sheet shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Sheet {
    /// Each row a shape: true and predicted distance, true and predicted normal
    Beside,
    /// Distance, normal and path-traced light of the field, from five angles
    Angles,
    /// The field over a vertical plane, for directions of five polar angles; above of the mesh, below of the field
    Sections,
}

/// Panels of a row of angles.
const ANGLES: usize = 5;
/// Paths of a pixel, and how often each may be turned.
const PATHS: u32 = 64;
const BOUNCES: u32 = 4;
/// How much farther away than for a picture the eye is, so that all sides of an object fit.
const AWAY: f32 = 1.25;
/// What a surface gives back of the light.
const ALBEDO: Vec3 = Vec3::new(0.75, 0.72, 0.66);

/// Panels in rows, each square.
struct Panels {
    side: usize,
    columns: usize,
    list: Vec<Vec<[f32; 3]>>,
}

/// A field and its mesh.
struct Pair {
    field: FieldTracer,
    mesh: Arc<MeshTracer>,
}

pub(super) fn save(
    sheet: Sheet,
    pairs: &[(PathBuf, PathBuf)],
    (path, side): (&PathBuf, u32),
    console: Console,
) -> Result<(), Failure> {
    let mut panels = Panels { side: side as usize, columns: ANGLES, list: Vec::new() };
    let mut loaded = Vec::new();
    for (field, mesh) in pairs {
        let (learned, known) = (DirectedField::load(field)?, super::load_mesh(mesh, console)?);
        super::warn_of_other_mesh((field, &learned), (mesh, &known), console);
        loaded.push(Pair {
            field: FieldTracer::new(Arc::new(learned)),
            mesh: Arc::new(MeshTracer::build(Arc::new(known))),
        });
    }
    for pair in &loaded {
        match sheet {
            Sheet::Beside => panels.beside(pair),
            Sheet::Angles => panels.angles(pair),
            Sheet::Sections => panels.sections(pair),
        }
    }
    if sheet == Sheet::Beside {
        panels.columns = 4;
    }
    let rows = panels.list.len().div_ceil(panels.columns);
    let (width, height) = (panels.columns * panels.side, rows * panels.side);
    let at = |i: usize| {
        let (x, y) = (i % width, i / width);
        let panel = y / panels.side * panels.columns + x / panels.side;
        panels.list[panel][y % panels.side * panels.side + x % panels.side]
    };
    let mut picture = Picture::new(width, height);
    for (channel, name) in ["R", "G", "B"].into_iter().enumerate() {
        picture.push(name, (0..width * height).map(|i| at(i)[channel]).collect::<Vec<f32>>());
    }
    output::save(path, &picture, &Encoding { exposure_ev: 0.0, tone: ToneCurve::Srgb, half: false })
}

impl Panels {
    /// A panel of what rays of a view saw.
    fn push(&mut self, f: impl Fn(usize) -> [f32; 3]) {
        let side = self.side as u32;
        self.list.push((0..side * side).map(|i| f(index_of(i % side, i / side, side))).collect());
    }

    fn beside(&mut self, pair: &Pair) {
        let rays = view_rays(pair.field.bounds(), self.side as u32, (0.0, AWAY));
        let truth: Vec<Seen> = rays.par_iter().map(|ray| by_mesh(&pair.mesh, ray)).collect();
        let said: Vec<Seen> = rays.par_iter().map(|ray| by_field(&pair.field, ray)).collect();
        let range = Range::of(&[&truth]);
        for show in [Show::Distance, Show::Normal] {
            for seen in [&truth, &said] {
                self.push(|i| color(show, &range, seen[i], None));
            }
        }
    }

    fn angles(&mut self, pair: &Pair) {
        let views: Vec<Vec<Ray>> = (0..ANGLES)
            .map(|k| {
                let azimuth = 360.0 * k as f32 / ANGLES as f32;
                view_rays(pair.field.bounds(), self.side as u32, (azimuth, AWAY))
            })
            .collect();
        let seen: Vec<Vec<Seen>> = views
            .iter()
            .map(|rays| rays.par_iter().map(|ray| by_field(&pair.field, ray)).collect())
            .collect();
        for show in [Show::Distance, Show::Normal] {
            for seen in &seen {
                let range = Range::of(&[seen]);
                self.push(|i| color(show, &range, seen[i], None));
            }
        }
        for rays in &views {
            let light: Vec<Vec3> = rays
                .par_iter()
                .enumerate()
                .map(|(index, ray)| {
                    let sum: Vec3 =
                        (0..PATHS).map(|path| radiance(&pair.field, ray, index as u32, path)).sum();
                    sum / PATHS as f32
                })
                .collect();
            self.push(|i| light[i].to_array());
        }
    }

    fn sections(&mut self, pair: &Pair) {
        let (low, high) = pair.mesh.bounds();
        let (middle, half) = (0.5 * (low + high), 0.55 * (high - low).max_element());
        let side = self.side;
        let far = 2.0 * half;
        let forms: [&dyn RayGeometry; 2] = [pair.mesh.as_ref(), &pair.field];
        for form in forms {
            for k in 0..ANGLES {
                let theta = PI * k as f32 / (ANGLES - 1) as f32;
                let omega = Vec3::new(theta.sin(), theta.cos(), 0.0);
                let value = |i: usize| -> [f32; 3] {
                    let at = |n: usize| ((n as f32 + 0.5) / side as f32 * 2.0 - 1.0) * half;
                    let x = middle + Vec3::new(at(i % side), -at(i / side), 0.0);
                    match form.closest(&Ray::new(x, omega)) {
                        // Black at the surface, and where nothing is seen a colour that no distance has.
                        Some(hit) => [(hit.t / far).min(1.0).powi(2); 3],
                        None => [0.10, 0.16, 0.30],
                    }
                };
                self.list.push((0..side * side).into_par_iter().map(value).collect());
            }
        }
    }
}

/// Numbers in [0, 1) that depend on nothing but what they are for (PCG, O'Neill 2014).
fn number(pixel: u32, path: u32, dimension: u32) -> f32 {
    let mut state = pixel
        .wrapping_mul(0x9e37_79b9)
        .wrapping_add(path.wrapping_mul(0x85eb_ca6b))
        .wrapping_add(dimension.wrapping_mul(0xc2b2_ae35));
    for _ in 0..2 {
        state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
        state = (word >> 22) ^ word;
    }
    (state >> 8) as f32 / 16_777_216.0
}

/// A light sky, brighter about one direction above.
fn sky(direction: Vec3) -> Vec3 {
    let base = Vec3::new(0.55, 0.65, 0.85).lerp(Vec3::splat(0.95), 0.5 + 0.5 * direction.y);
    let cap = direction.dot(Vec3::new(0.45, 0.8, 0.4).normalize());
    base * 0.5 + Vec3::new(1.0, 0.93, 0.8) * 1.5 * ((cap - 0.6) * 2.5).clamp(0.0, 1.0)
}

/// Light along a ray: diffuse bounces off one form of geometry until the sky is met.
pub(crate) fn radiance(form: &dyn RayGeometry, ray: &Ray, pixel: u32, path: u32) -> Vec3 {
    let (mut ray, mut throughput) = (*ray, Vec3::ONE);
    for bounce in 0..=BOUNCES {
        let Some(hit) = form.closest(&ray) else {
            return throughput * sky(ray.direction.normalize_or_zero());
        };
        let surface = form.surface(&ray, &hit);
        let facing = -surface.geometric_normal.dot(ray.direction).signum();
        let normal = surface.geometric_normal * facing;
        let (u, v) = (number(pixel, path, 2 * bounce), number(pixel, path, 2 * bounce + 1));
        let (z, phi) = (1.0 - 2.0 * u, TAU * v);
        let radius = (1.0 - z * z).max(0.0).sqrt();
        // The normal plus a uniform direction is cosine-distributed.
        let direction = (normal + Vec3::new(radius * phi.cos(), radius * phi.sin(), z)).normalize_or(normal);
        throughput *= ALBEDO;
        ray = Ray::new(surface.position + normal * surface.position_error, direction);
    }
    Vec3::ZERO
}
