//! How far the rays are apart that a path from the eye stands for: footprints of textures and normal maps at every vertex.
//!
//! The rays about a path at its pixel, lens and shutter are Gaussian; what they become over travel, mirrors, glass and lobes has a
//! covariance C of position and direction, the inverse of the spectrum's (Σ = C⁻¹/4π²). It is kept as a sum of squares,
//! C = Σ g gᵀ with g = (∂position, ∂direction): each g is a ray differential (Igehy 1999), and goes through travel, reflection and refraction
//! with the derivative of the normal as they do. A lobe adds two: directions of variance 1/(2π p), p the density of the
//! sample (a Gaussian lobe's at its middle). When there are more than eight, those of directions are joined where they have
//! the same cause. Differentials alone are the two of the pixel, and end at the first lobe.
//!
//! The i-th sample of a pixel stands for less than all of it, so that many samples go to the picture of points: deviations of pixel,
//! lens and shutter shrink by i^(−1/2), as n samples that are spread evenly share them, and those of lobes by i^(−1/3).
//! The bias of a mean of n samples is that of their variances, (ln n)/n and n^(−2/3): its square falls faster than the noise. (With i^(−1/6) for
//! both, as kernels of densities have, textures seen straight had seven times the error of points at 256 samples; lobes by i^(−1/2)
//! have a quarter more error than this.)

use glam::{Mat3, Vec2, Vec3};
use halflight_material::Footprint;
use halflight_scene::Frame;
use halflight_scene::camera::View;
use halflight_trace::{Hit, Ray, Surface};

use super::settings::Textures;
use crate::vertex::Vertex;

/// Pixel, lens, shutter, and some lobes.
const MOST: usize = 9;
/// The standard deviation of a box of one.
const BOX: f32 = 0.288_675;
/// Lobes of more variance leave nothing of how rays were bent before.
const WIDE: f32 = 0.25;
/// The most that a lobe spreads: the variance of directions over a hemisphere, about.
const HEMISPHERE: f32 = 0.4;

/// What is left of a lobe's deviation for the sample of this number.
fn of_lobe(index: u32) -> f32 {
    ((index + 1) as f32).powf(-1.0 / 3.0)
}

/// One direction of spread.
#[derive(Clone, Copy, Debug, Default)]
struct Side {
    position: Vec3,
    direction: Vec3,
}

/// All of them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spread {
    sides: [Side; MOST],
    count: usize,
    whole: bool,
}

/// What a path met, as far as its spread goes.
pub(super) struct Met {
    normal: Vec3,
    turn: Mat3,
    u: Vec3,
    v: Vec3,
}

impl Spread {
    /// Of the rays of a camera about one, which a sample of number `index` stands for.
    pub(super) fn of_camera(
        mode: Textures,
        view: &View,
        pixel: Vec2,
        lens: Vec2,
        time: f32,
        shutter: bool,
        index: u32,
    ) -> Option<(Self, u32)> {
        if mode == Textures::Points {
            return None;
        }
        let mut spread =
            Self { sides: [Side::default(); MOST], count: 0, whole: mode == Textures::Covariance };
        let n = (index + 1) as f32;
        let scale = n.powf(-0.5);
        // Central differences are exact enough: rays are smooth in all of these.
        let mut add = |a: Ray, b: Ray, size: f32| {
            let position = (a.origin - b.origin) * size;
            let direction = (a.direction - b.direction) * size;
            if position != Vec3::ZERO || direction != Vec3::ZERO {
                spread.push(Side { position, direction });
            }
        };
        for axis in [Vec2::X, Vec2::Y] {
            let step = 0.5 * axis;
            add(view.ray(pixel + step, lens, time), view.ray(pixel - step, lens, time), BOX * scale);
        }
        if mode == Textures::Covariance {
            // A disc of radius a has a deviation of a/2; the map of the square is as good as any from the middle.
            let ray = |lens: Vec2| view.ray(pixel, lens, time);
            let aperture = ray(Vec2::new(0.999, 0.5)).origin - ray(Vec2::new(0.001, 0.5)).origin;
            if aperture != Vec3::ZERO {
                for axis in [Vec2::X, Vec2::Y] {
                    let (a, b) = (ray(Vec2::splat(0.5) + 0.499 * axis), ray(Vec2::splat(0.5) - 0.499 * axis));
                    add(a, b, 0.25 * scale);
                }
            }
            if shutter {
                let (a, b) = (view.ray(pixel, lens, 1.0), view.ray(pixel, lens, 0.0));
                add(a, b, BOX * scale);
            }
        }
        Some((spread, index))
    }

    fn push(&mut self, side: Side) {
        if self.count < MOST {
            self.sides[self.count] = side;
            self.count += 1;
            return;
        }
        // Full: the square root of the sum of squares with the one most alike, which no variance is lost by.
        let along = |a: &Side| a.position.dot(side.position) + a.direction.dot(side.direction);
        let size = |a: &Side| (a.position.length_squared() + a.direction.length_squared()).sqrt();
        let alike = |a: &Side| along(a).abs() / size(a).max(1e-20);
        let best =
            (1..MOST).fold(0, |b, i| if alike(&self.sides[i]) > alike(&self.sides[b]) { i } else { b });
        let old = self.sides[best];
        let ratio = (1.0 + (size(&side) / size(&old).max(1e-20)).powi(2)).sqrt();
        self.sides[best] = Side { position: old.position * ratio, direction: old.direction * ratio };
    }

    fn sides(&mut self) -> &mut [Side] {
        &mut self.sides[..self.count]
    }

    /// Over a ray in air.
    pub(super) fn travel(&mut self, distance: f32) {
        for side in self.sides() {
            side.position += side.direction * distance;
        }
    }

    /// Along a ray to a surface: moves the spread onto it, and says its footprint on textures. `None` where the shape does not
    /// tell, or nothing is known.
    pub(super) fn arrive(
        &mut self,
        frame: &Frame,
        ray: &Ray,
        hit: &Hit,
        surface: &Surface,
        way: f32,
    ) -> (Option<Footprint>, Met) {
        self.travel(way);
        let normal = surface.geometric_normal;
        let cos = normal.dot(ray.direction);
        let cos = if cos.abs() < 0.01 { 0.01f32.copysign(cos) } else { cos };
        for side in self.sides() {
            side.position -= ray.direction * (side.position.dot(normal) / cos);
        }
        let material = frame.material(surface.instance, surface.material_slot);
        let bends = !material.is_matt();
        let nothing = Met { normal, turn: Mat3::ZERO, u: Vec3::ZERO, v: Vec3::ZERO };
        if self.count == 0 || (!bends && material.is_uniform()) {
            return (None, nothing);
        }
        let Some(found) = frame.world.gradients(hit, ray.time, surface) else { return (None, nothing) };
        let met = Met { normal, turn: found.normal, u: found.u, v: found.v };
        if material.is_uniform() {
            return (None, met);
        }
        // What moves over the surface while the shutter is open spreads on it too.
        let mut footprint = [0.0; 3];
        for side in self.sides() {
            let (u, v) = (met.u.dot(side.position), met.v.dot(side.position));
            footprint[0] += u * u;
            footprint[1] += u * v;
            footprint[2] += v * v;
        }
        (footprint.iter().all(|v| v.is_finite()).then_some(footprint), met)
    }

    /// At a vertex, from the direction of the ray that came to the one that goes on. `pdf` is the density of a lobe's sample,
    /// `None` of what is smooth; `index` is the number of the sample.
    pub(super) fn leave(
        &mut self,
        vertex: &Vertex,
        met: &Met,
        direction: Vec3,
        pdf: Option<f32>,
        index: u32,
    ) {
        let arriving = -vertex.towards_eye;
        let shading = vertex.shading_normal();
        let variance = pdf.map_or(0.0, |pdf| (1.0 / (std::f32::consts::TAU * pdf.max(1e-6))).min(HEMISPHERE));
        if !self.whole && pdf.is_some() {
            self.count = 0;
            return;
        }
        if variance > WIDE {
            for side in self.sides() {
                side.direction = Vec3::ZERO;
            }
        } else {
            let through = shading.dot(arriving) * shading.dot(direction) > 0.0;
            // The normal that mirrors or refracts the one into the other, for rough facets not the surface's.
            let eta = if through { 1.0 / vertex.bsdf.index_beyond(vertex.wo) } else { 1.0 };
            let mean = if through { eta * arriving - direction } else { arriving - direction };
            let n = mean.normalize_or(shading);
            let n = if n.dot(arriving) > 0.0 { -n } else { n };
            let side = if met.normal.dot(n) < 0.0 { -1.0 } else { 1.0 };
            let (d_n, t_n) = (arriving.dot(n), direction.dot(n));
            for s in self.sides() {
                let dn = met.turn * s.position * side;
                let change = s.direction.dot(n) + arriving.dot(dn);
                s.direction = if through {
                    // d' = η d − μ n, μ = η d·n − d'·n.
                    let mu = eta * d_n - t_n;
                    let dmu = (eta
                        - eta * eta * d_n / if t_n.abs() < 0.02 { 0.02f32.copysign(t_n) } else { t_n })
                        * change;
                    eta * s.direction - mu * dn - dmu * n
                } else {
                    s.direction - 2.0 * (d_n * dn + change * n)
                };
            }
        }
        if variance > 0.0 {
            let size = (variance.sqrt()) * of_lobe(index);
            let (x, y) = direction.any_orthonormal_pair();
            for axis in [x, y] {
                self.push(Side { position: Vec3::ZERO, direction: axis * size });
            }
        }
    }

    /// At a point of a medium.
    pub(super) fn scatter(&mut self, direction: Vec3, pdf: f32, index: u32) {
        if !self.whole {
            self.count = 0;
            return;
        }
        let variance = (1.0 / (std::f32::consts::TAU * pdf.max(1e-6))).min(HEMISPHERE);
        let size = variance.sqrt() * of_lobe(index);
        let (x, y) = direction.any_orthonormal_pair();
        for axis in [x, y] {
            self.push(Side { position: Vec3::ZERO, direction: axis * size });
        }
    }
}

#[cfg(test)]
#[path = "spread_tests.rs"]
mod tests;
