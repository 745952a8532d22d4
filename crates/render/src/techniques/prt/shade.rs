//! From transfer and light to radiance.
//!
//! Once for each light: the irradiance of every vertex, L·T, and at glossy ones the light that arrives, L M. Then for each
//! pixel they are interpolated: diffuse (ρ/π)(Σ w_k E_k + v (E₀(n) − Σ w_k E₀(n_k))), with E₀ the unshadowed irradiance on
//! a normal, so that a pixel's own normal counts; Phong ρ_s (n + 2)/(n + 1) times the dot product of the lobe about the
//! mirror direction with Σ w_k (L M)_k. Cost: one multiplication for each coefficient of each vertex; a hundred or two
//! for each pixel.
//!
//! Forms without roots, as learned fields, have their transfer worked out at each pixel that sees them, 64 together, by the
//! same sums over rays; nothing of it is kept, and light that surfaces give back is left out there.

use glam::Vec3;
use halflight_scene::Frame;
use halflight_sh::{Sh, Zh};
use halflight_trace::{Hit, Ray};
use rayon::prelude::*;

use super::cast::{Caster, GROUP as POINTS};
use super::directions::{Cosine, MOST};
use super::receivers::{Point, Receivers};
use super::transfer::{NO_MATRIX, Transfer};
use crate::gbuffer::{GBuffer, Pixel, Visible, VisiblePoint};
use crate::sh_light::axes;

/// Vertices that are lit together.
const GROUP: usize = 1024;

/// Light in as many coefficients as transfer has; those above are zero.
pub(super) type Light = [Sh<MOST>; 3];

/// A frame whose vertices are lit.
pub(super) struct Lit<'a> {
    frame: &'a Frame,
    receivers: &'a Receivers,
    transfer: &'a Transfer,
    light: &'a Light,
    cosine: Cosine,
    /// What looks from the pixels that see forms without roots.
    caster: &'a Caster<'a>,
    /// Irradiance at each vertex, and what it would be without shadows.
    irradiance: Vec<[Vec3; 2]>,
    /// For each matrix three times `n` coefficients of what arrives.
    arriving: Vec<f32>,
}

fn dot(a: &[f32], b: &[f32]) -> f32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl<'a> Lit<'a> {
    /// Lights all vertices.
    pub(super) fn new(
        frame: &'a Frame,
        receivers: &'a Receivers,
        transfer: &'a Transfer,
        light: &'a Light,
        caster: &'a Caster<'a>,
    ) -> Self {
        let (n, channels) = (transfer.n, transfer.channels);
        let cosine = Cosine::new();
        let irradiance = transfer
            .diffuse
            .par_chunks_exact(channels * n)
            .with_min_len(GROUP)
            .zip(&transfer.normals)
            .map(|(diffuse, &normal)| {
                let lit = [0, 1, 2].map(|c| {
                    let of_color = c.min(channels - 1) * n;
                    dot(&diffuse[of_color..of_color + n], light[c].coefficients())
                });
                [Vec3::from_array(lit), open(&cosine, light, normal)]
            })
            .collect();
        let mut arriving = vec![0.0; transfer.glossy.len() / (channels * n).max(1) / n.max(1) * 3 * n];
        arriving
            .par_chunks_exact_mut(3 * n)
            .zip(transfer.glossy.par_chunks_exact(channels * n * n))
            .for_each(|(arriving, matrices)| {
                for (c, arriving) in arriving.chunks_exact_mut(n).enumerate() {
                    let matrix = &matrices[c.min(channels - 1) * n * n..][..n * n];
                    for (row, &light) in matrix.chunks_exact(n).zip(light[c].coefficients()) {
                        arriving.iter_mut().zip(row).for_each(|(sum, &m)| *sum = m.mul_add(light, *sum));
                    }
                }
            });
        Self { frame, receivers, transfer, light, cosine, caster, irradiance, arriving }
    }

    /// The radiance of every pixel, how many see what no transfer is known of, and how many had it worked out.
    pub(super) fn picture(&self, view: &GBuffer) -> (Vec<Vec3>, usize, usize) {
        let mut picture = vec![Vec3::ZERO; view.pixels.len()];
        let unknown: Vec<usize> = picture
            .par_chunks_mut(view.width)
            .enumerate()
            .map(|(y, row)| {
                let mut unknown = 0;
                for (x, radiance) in row.iter_mut().enumerate() {
                    *radiance = match view.at(y * view.width + x) {
                        Visible::Nothing(direction) => self.frame.lights.escaped(direction),
                        Visible::Point(point) => self.radiance(&point).unwrap_or_else(|| {
                            unknown += usize::from(!self.is_strange(point.hit));
                            point.emitted
                        }),
                    };
                }
                unknown
            })
            .collect();
        let strange: Vec<(usize, VisiblePoint)> = view
            .pixels
            .iter()
            .enumerate()
            .filter_map(|(index, pixel)| match pixel {
                Pixel::Point(point) if self.is_strange(point.hit) => Some((index, view.point(point))),
                _ => None,
            })
            .collect();
        let lit: Vec<Vec<Vec3>> =
            strange.par_chunks(POINTS).map(|points| self.strange_radiance(points)).collect();
        for (&(index, _), radiance) in strange.iter().zip(lit.into_iter().flatten()) {
            picture[index] = radiance;
        }
        (picture, unknown.into_iter().sum(), strange.len())
    }

    fn is_strange(&self, hit: Hit) -> bool {
        Receivers::is_strange(self.frame, hit.instance)
    }

    /// Radiance towards the eye from points whose transfer is worked out now.
    fn strange_radiance(&self, points: &[(usize, VisiblePoint)]) -> Vec<Vec3> {
        let n = self.caster.n;
        let looking: Vec<Point> = points
            .iter()
            .map(|(_, point)| {
                let ray = Ray::new(point.position + point.towards_eye * point.hit.t, -point.towards_eye);
                let mut surface = self.frame.world.surface(&ray, &point.hit);
                surface.position = point.position;
                surface.geometric_normal = point.geometric_normal;
                surface.shading_normal = point.normal;
                let is_glossy = point.material.specular != Vec3::ZERO;
                Point { surface, albedo: Vec3::ZERO, is_glossy }
            })
            .collect();
        let seen = self.caster.cast_group(&looking);
        let mut matrices = seen.matrices.chunks_exact((n * n).max(1));
        let mut arriving = vec![0.0f32; n];
        points
            .iter()
            .zip(seen.transfer.chunks_exact(n))
            .map(|((_, point), transfer)| {
                let material = &point.material;
                let irradiance =
                    Vec3::from_array([0, 1, 2].map(|c| dot(transfer, self.light[c].coefficients())));
                let mut radiance = point.emitted
                    + material.diffuse * std::f32::consts::FRAC_1_PI * irradiance.max(Vec3::ZERO);
                if material.specular != Vec3::ZERO
                    && let Some(matrix) = matrices.next()
                {
                    let lobe = mirrored_lobe(point);
                    let colors = [0, 1, 2].map(|c| {
                        arriving.fill(0.0);
                        for (row, &light) in matrix.chunks_exact(n).zip(self.light[c].coefficients()) {
                            arriving.iter_mut().zip(row).for_each(|(sum, &m)| *sum = m.mul_add(light, *sum));
                        }
                        dot(&arriving, lobe.coefficients())
                    });
                    radiance +=
                        material.specular * Vec3::from_array(colors).max(Vec3::ZERO) * strength(point);
                }
                radiance
            })
            .collect()
    }

    /// Radiance towards the eye; `None` where no transfer is known.
    fn radiance(&self, point: &VisiblePoint) -> Option<Vec3> {
        let material = &point.material;
        if material.diffuse == Vec3::ZERO && material.specular == Vec3::ZERO {
            return Some(point.emitted);
        }
        let (position, side) = (point.position, point.geometric_normal);
        let (root, weights) = self.receivers.locate(self.frame, &point.hit, position, side)?;
        let (corners, weights) = self.transfer.locate(root, weights);
        let mut radiance = point.emitted;
        if material.diffuse != Vec3::ZERO {
            let (mut irradiance, mut unshadowed, mut visible) = (Vec3::ZERO, Vec3::ZERO, 0.0);
            for (corner, weight) in corners.into_iter().zip(weights) {
                let [shadowed, open] = self.irradiance[corner as usize];
                irradiance += weight * shadowed;
                unshadowed += weight * open;
                visible += weight * self.transfer.visible[corner as usize];
            }
            irradiance += visible * (open(&self.cosine, self.light, point.normal) - unshadowed);
            radiance += material.diffuse * std::f32::consts::FRAC_1_PI * irradiance.max(Vec3::ZERO);
        }
        if material.specular != Vec3::ZERO {
            radiance += material.specular * self.lobe(point, corners, weights);
        }
        Some(radiance)
    }

    /// What a Phong lobe of albedo 1 sends to the eye.
    fn lobe(&self, point: &VisiblePoint, corners: [u32; 3], weights: [f32; 3]) -> Vec3 {
        let n = self.transfer.n;
        let lobe = mirrored_lobe(point);
        let mut sum = Vec3::ZERO;
        for (corner, weight) in corners.into_iter().zip(weights) {
            let matrix = self.transfer.matrix_of[corner as usize];
            if matrix == NO_MATRIX {
                continue;
            }
            let arriving = &self.arriving[matrix as usize * 3 * n..(matrix as usize + 1) * 3 * n];
            let colors = [0, 1, 2].map(|c| dot(&arriving[c * n..(c + 1) * n], lobe.coefficients()));
            sum += weight * Vec3::from_array(colors);
        }
        sum.max(Vec3::ZERO) * strength(point)
    }
}

/// The Phong lobe of a point about the mirror direction of the eye.
fn mirrored_lobe(point: &VisiblePoint) -> Sh<MOST> {
    let mirrored = 2.0 * point.normal.dot(point.towards_eye) * point.normal - point.towards_eye;
    Zh::<MOST>::phong(f64::from(point.material.exponent)).to_direction(axes(mirrored))
}

/// What a normalised lobe is multiplied by so that its albedo is 1.
fn strength(point: &VisiblePoint) -> f32 {
    let exponent = point.material.exponent;
    (exponent + 2.0) / (exponent + 1.0)
}

/// Unshadowed irradiance on a normal.
#[inline]
fn open(cosine: &Cosine, light: &Light, normal: Vec3) -> Vec3 {
    let cosine = cosine.about(normal);
    Vec3::from_array([0, 1, 2].map(|c| light[c].dot(&cosine)))
}
