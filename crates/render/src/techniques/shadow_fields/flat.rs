//! What rectangles and disks hide: no field is needed, and they may be of any size, as the ground is.
//!
//! In the frame of the plane, polar axis towards it, a flat shape hides for each azimuth φ_k the angles between two
//! distances ρ₁, ρ₂ from the foot of the point at height h, of cosines c = h/√(h² + ρ²):
//!
//! ```text
//! O_lm = Δ Σ_k [G_l|m|(c₂) − G_l|m|(c₁)] t_m(φ_k),   G_lm(c) = ∫_c^1 √(2 or 1) K_lm P_l^m(x) dx,   Δ = 2π/N
//! ```
//!
//! with t_m = cos mφ, 1, sin |m|φ; G is tabulated over c. From afar, where few azimuths meet the shape, its area is
//! summed instead: O = Σ y(d) cos/r² dA over a grid of its points. Cost: 0.5 µs a point at order 4.

use std::f32::consts::TAU;

use glam::{Affine3A, Mat3, Vec2, Vec3};
use halflight_sh::{Sh, reference};

use crate::sh_light::axes;

/// N.
const AZIMUTHS: usize = 32;
/// Entries of the tables of G over c from 0 to 1.
const ENTRIES: usize = 257;
/// Points along each side of the shape, from afar.
const SIDE: usize = 8;

/// G and the azimuths, for an order.
pub(super) struct FlatTable<const ORDER: usize> {
    /// `entries[i][j]`: Δ G of the pair (l, m ≥ 0) number l(l + 1)/2 + m at c = i/(n − 1).
    entries: Vec<Vec<f32>>,
    /// t_m(φ_k) for m from 1 − ORDER to ORDER − 1.
    waves: Vec<[f32; AZIMUTHS]>,
}

/// A rectangle or a disk where it stands in a frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flat {
    /// From the square \[−1, 1\]² or the unit disk to the world.
    place: Affine3A,
    inverse: Affine3A,
    normal: Vec3,
    is_disk: bool,
    radius: f32,
}

impl<const ORDER: usize> FlatTable<ORDER> {
    pub(super) fn new() -> Self {
        let delta = std::f64::consts::TAU / AZIMUTHS as f64;
        // At azimuth 0 the basis has the value √2 K P for m > 0, which is what t_m stands beside.
        let at = |c: f64| {
            let y = reference::basis(ORDER, glam::DVec3::new((1.0 - c * c).max(0.0).sqrt(), 0.0, c));
            (0..ORDER).flat_map(|l| (0..=l).map(move |m| (l, m))).map(|(l, m)| y[l * l + l + m]).collect()
        };
        let mut sum = vec![0.0; ORDER * (ORDER + 1) / 2];
        let mut entries = vec![Vec::new(); ENTRIES];
        entries[ENTRIES - 1] = vec![0.0; sum.len()];
        for i in (0..ENTRIES - 1).rev() {
            // √(1 − c²) is steep at c = 1: many steps of the midpoint rule.
            const STEPS: usize = 64;
            let width = 1.0 / (ENTRIES - 1) as f64 / STEPS as f64;
            for step in 0..STEPS {
                let c = i as f64 / (ENTRIES - 1) as f64 + (step as f64 + 0.5) * width;
                let values: Vec<f64> = at(c);
                sum.iter_mut().zip(values).for_each(|(s, v)| *s += v * width);
            }
            entries[i] = sum.iter().map(|s| (s * delta) as f32).collect();
        }
        let waves = (1 - ORDER as i32..ORDER as i32)
            .map(|m| {
                std::array::from_fn(|k| {
                    let angle = m as f32 * azimuth(k);
                    if m < 0 { (-angle).sin() } else { angle.cos() }
                })
            })
            .collect();
        Self { entries, waves }
    }

    /// What lies between two cosines at each azimuth, in the frame of the plane.
    fn slices(&self, cosines: &[Option<(f32, f32)>; AZIMUTHS]) -> Sh<ORDER> {
        let pairs = ORDER * (ORDER + 1) / 2;
        let mut sums = [[0.0f32; AZIMUTHS]; 36];
        for (k, between) in cosines.iter().enumerate() {
            let Some((near, far)) = between else { continue };
            for (cosine, sign) in [(far, 1.0), (near, -1.0)] {
                let place = cosine.clamp(0.0, 1.0) * (ENTRIES - 1) as f32;
                let below = (place as usize).min(ENTRIES - 2);
                let t = place - below as f32;
                let (a, b) = (&self.entries[below], &self.entries[below + 1]);
                for j in 0..pairs {
                    sums[j][k] += sign * (a[j] + (b[j] - a[j]) * t);
                }
            }
        }
        let mut sh = Sh::zero();
        for l in 0..ORDER {
            for m in 0..=l {
                let of_pair = &sums[l * (l + 1) / 2 + m];
                let along = |wave: &[f32; AZIMUTHS]| -> f32 {
                    of_pair.iter().zip(wave).map(|(value, t)| value * t).sum()
                };
                sh[l * l + l + m] = along(&self.waves[ORDER - 1 + m]);
                if m > 0 {
                    sh[l * l + l - m] = along(&self.waves[ORDER - 1 - m]);
                }
            }
        }
        sh
    }
}

fn azimuth(k: usize) -> f32 {
    TAU * (k as f32 + 0.5) / AZIMUTHS as f32
}

impl Flat {
    /// `None` for a shape without extent.
    pub(super) fn new(place: Affine3A, is_disk: bool) -> Option<Self> {
        let [u, v] = [Vec3::from(place.matrix3.x_axis), Vec3::from(place.matrix3.y_axis)];
        let normal = u.cross(v).try_normalize()?;
        let stood = Affine3A { matrix3: glam::Mat3A::from_cols(u.into(), v.into(), normal.into()), ..place };
        let inverse = stood.inverse();
        let radius =
            if is_disk { u.length().max(v.length()) } else { (u + v).length().max((u - v).length()) };
        inverse.is_finite().then_some(Self { place: stood, inverse, normal, is_disk, radius })
    }

    pub(super) fn center(&self) -> Vec3 {
        self.place.translation.into()
    }

    /// Whether it is wholly behind a tangent plane.
    pub(super) fn is_behind(&self, point: Vec3, normal: Vec3) -> bool {
        let [u, v] =
            [self.place.matrix3.x_axis, self.place.matrix3.y_axis].map(|a| normal.dot(a.into()).abs());
        let reach = if self.is_disk { u.hypot(v) } else { u + v };
        normal.dot(self.center() - point) + reach <= 1e-4 * self.radius
    }

    /// Signed distance of a point from its plane.
    pub(super) fn height(&self, point: Vec3) -> f32 {
        self.normal.dot(point - self.center())
    }

    /// What it hides from a point, on either of its sides.
    pub(super) fn hidden<const ORDER: usize>(&self, table: &FlatTable<ORDER>, point: Vec3) -> Sh<ORDER> {
        if point.distance_squared(self.center()) > 4.0 * self.radius * self.radius {
            return self.hidden_from_afar(point);
        }
        let height = self.height(point);
        let polar = if height < 0.0 { self.normal } else { -self.normal };
        let height = height.abs().max(1e-6 * self.radius);
        let x = polar.any_orthonormal_vector();
        let y = polar.cross(x);
        let foot = self.inverse.transform_point3(point).truncate();
        let cosine = |distance: f32| height / (height * height + distance * distance).sqrt();
        let cosines = std::array::from_fn(|k| {
            let (sin, cos) = azimuth(k).sin_cos();
            let step = self.inverse.transform_vector3(x * cos + y * sin).truncate();
            let (near, far) =
                if self.is_disk { through_disk(foot, step) } else { through_square(foot, step) }?;
            Some((cosine(near), cosine(far)))
        });
        let [x, y, polar] = [x, y, polar].map(|axis| Vec3::from_array(axes(axis)));
        table.slices(&cosines).rotated(&Mat3::from_cols(x, y, polar))
    }

    fn hidden_from_afar<const ORDER: usize>(&self, point: Vec3) -> Sh<ORDER> {
        let [u, v] = [self.place.matrix3.x_axis, self.place.matrix3.y_axis].map(Vec3::from);
        let area = u.cross(v).length() * (2.0 / SIDE as f32).powi(2);
        let mut sum = Sh::zero();
        for i in 0..SIDE * SIDE {
            let step = |i: usize| (2 * i + 1) as f32 / SIDE as f32 - 1.0;
            let mut local = Vec2::new(step(i % SIDE), step(i / SIDE));
            let mut weight = area;
            if self.is_disk {
                // The elliptical map of the square onto the disk, with its density.
                let (a, b) = (local.x * local.x, local.y * local.y);
                let (p, q) = ((1.0 - 0.5 * b).sqrt(), (1.0 - 0.5 * a).sqrt());
                weight *= p * q - 0.25 * a * b / (p * q);
                local *= Vec2::new(p, q);
            }
            let to = self.center() + u * local.x + v * local.y - point;
            let squared = to.length_squared();
            let direction = to / squared.sqrt();
            weight *= self.normal.dot(direction).abs() / squared;
            sum += Sh::basis(axes(direction)) * weight;
        }
        sum
    }
}

/// Where a ray in the plane is within the square, if it is at all.
fn through_square(foot: Vec2, step: Vec2) -> Option<(f32, f32)> {
    let (mut near, mut far) = (0.0f32, f32::INFINITY);
    for (at, step) in [(foot.x, step.x), (foot.y, step.y)] {
        if step.abs() < 1e-20 {
            if at.abs() > 1.0 {
                return None;
            }
            continue;
        }
        let (a, b) = ((-1.0 - at) / step, (1.0 - at) / step);
        near = near.max(a.min(b));
        far = far.min(a.max(b));
    }
    (near < far).then_some((near, far))
}

/// The same for the unit disk.
fn through_disk(foot: Vec2, step: Vec2) -> Option<(f32, f32)> {
    let (a, b) = (step.length_squared(), foot.dot(step));
    let root = (b * b - a * (foot.length_squared() - 1.0)).max(0.0).sqrt();
    let (near, far) = (((-b - root) / a).max(0.0), (-b + root) / a);
    (near < far).then_some((near, far))
}
