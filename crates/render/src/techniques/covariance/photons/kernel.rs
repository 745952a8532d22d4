//! How wide a photon's kernel is: where its light varies slowly, wide; as wide as it may be for how many photons there are.
//!
//! Light about a photon is taken for a Gaussian of covariance C, what carrying covariance tells of its irradiance. The mean squared
//! error of a kernel estimate of n photons of a Gaussian is least for kernels of covariance H = C n^(−1/3) in two dimensions
//! (Silverman 1986, §4.3.2: (4/((d + 2) n))^(2/(d + 4))), with the bias it makes and the noise it leaves in one balance. n is the photons
//! in as much light as the Gaussian holds, ρ 4π √det C, ρ the density measured among a photon's neighbours; in pass i it is i times
//! that of one. So kernels shrink with i^(−1/3), which is the schedule of Knaus & Zwicker (2011, eq. 20) with α = 2/3, and
//! bias and noise both go to zero. A photon of a volume has the third axis along its way.
//!
//! K(q) = 2 (1 − q)/(π s₁ s₂) on surfaces, and (15/8π) (1 − q)/(s₁ s₂ s₃) in media, q = dᵀ M d ≤ 1, axes s = 2.4 √H.

use std::f32::consts::PI;

use glam::Vec3;

use super::borders::Borders;
use super::flight::Landed;

/// Semi-axes of a kernel per deviation of the Gaussian that it is to be as good as: √6 in two dimensions.
const WIDE: f32 = 2.4;
/// A kernel of the first pass expects at least so many photons, one of pass i then i^(2/3) as many in all passes so far: where light
/// focuses, noise goes to zero as well.
const LEAST: f32 = 6.0;
/// Half the shortest axis of a kernel of the first pass is at least so many pixels where the eye sees it straight.
const PIXELS: f32 = 1.5;
/// The longest axis per shortest.
const SLIM: f32 = 8.0;

/// How the radius of kernels is found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Rule {
    /// From covariance.
    Covariance {
        /// From 1.
        pass: f32,
        /// Where the eye is, and the width of a pixel at a distance of 1.
        eye: Vec3,
        pixel: f32,
    },
    /// The same for all, metres.
    Fixed(f32),
}

/// A photon with its kernel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Photon {
    pub(super) position: Vec3,
    pub(super) towards: Vec3,
    pub(super) power: Vec3,
    /// Zero in a medium.
    pub(super) normal: Vec3,
    pub(super) anisotropy: f32,
    pub(super) depth: u32,
    pub(super) number: u32,
    /// M, in 1/m²: xx, yy, zz, xy, xz, yz.
    form: [f32; 6],
    /// What 1 − q, or (1 − q)^(3/2), is multiplied by.
    norm: f32,
    /// Geometric mean of the axes across its way.
    pub(super) radius: f32,
    /// Half the sides of the box about it.
    pub(super) extent: Vec3,
}

impl Photon {
    /// With `density` photons per square or cubic metre about it, between borders where there are any.
    pub(super) fn new(landed: &Landed, density: f32, rule: Rule, borders: Option<&Borders>) -> Self {
        let in_medium = landed.normal == Vec3::ZERO;
        let (axes, sides) = match (rule, in_medium) {
            (Rule::Fixed(r), true) => (cross(landed.towards), [r; 3]),
            (Rule::Fixed(r), false) => (cross(landed.normal), [r, r, 0.5 * r]),
            (Rule::Covariance { pass, eye, pixel }, _) => {
                let (axes, sides) =
                    if in_medium { in_air(landed, density, pass) } else { on_surface(landed, density, pass) };
                let least = PIXELS * pixel * eye.distance(landed.position) * pass.powf(-1.0 / 6.0);
                (axes, sides.map(|s| s.max(least)))
            }
        };
        let sides = sides.map(|s| if s.is_finite() { s.clamp(1e-6, 1e6) } else { 1e-6 });
        let share = match borders {
            Some(borders) if in_medium => borders.share(landed.position, axes, sides),
            _ => 1.0,
        };
        let mut form = [0.0; 6];
        let mut extent = Vec3::ZERO;
        for (e, s) in axes.into_iter().zip(sides) {
            let p = 1.0 / (s * s);
            let products = [e.x * e.x, e.y * e.y, e.z * e.z, e.x * e.y, e.x * e.z, e.y * e.z];
            for (sum, product) in form.iter_mut().zip(products) {
                *sum += p * product;
            }
            extent += e * e * (s * s);
        }
        let [a, b, c] = sides;
        // The line through a ball of 1 − q holds 4/3 (1 − q₀)^(3/2).
        let norm =
            if in_medium { 15.0 / (8.0 * PI * a * b * c * share) * (4.0 / 3.0) } else { 2.0 / (PI * a * b) };
        Self {
            position: landed.position,
            towards: landed.towards,
            power: landed.power,
            normal: landed.normal,
            anisotropy: landed.anisotropy,
            depth: landed.depth,
            number: landed.number,
            form,
            norm,
            radius: (a * b).sqrt(),
            extent: Vec3::new(extent.x.sqrt(), extent.y.sqrt(), extent.z.sqrt()) * 1.0001,
        }
    }

    #[inline]
    fn product(&self, a: Vec3, b: Vec3) -> f32 {
        let [xx, yy, zz, xy, xz, yz] = self.form;
        xx * a.x * b.x
            + yy * a.y * b.y
            + zz * a.z * b.z
            + xy * (a.x * b.y + a.y * b.x)
            + xz * (a.x * b.z + a.z * b.x)
            + yz * (a.y * b.z + a.z * b.y)
    }

    /// The kernel at a point, per square metre; 0 beyond it.
    #[inline]
    pub(super) fn at(&self, point: Vec3) -> f32 {
        let d = point - self.position;
        self.norm * (1.0 - self.product(d, d)).max(0.0)
    }

    /// The kernel's integral along the parts of a line that are within, per square metre, and two places on it whose mean stands for
    /// what varies along it; `None` beside it. (Of 1 − s² the points ±1/√5 have the first three moments.)
    #[inline]
    pub(super) fn along(
        &self,
        origin: Vec3,
        direction: Vec3,
        within: &[[f32; 2]],
    ) -> Option<(f32, [f32; 2])> {
        let o = origin - self.position;
        // From the nearest point, or distant origins round it away.
        let near = -o.dot(direction);
        let o = o + direction * near;
        let (a, b, c) = (self.product(direction, direction), self.product(direction, o), self.product(o, o));
        let left = 1.0 - (c - b * b / a);
        if left <= 0.0 {
            return None;
        }
        let (middle, half) = (near - b / a, (left / a).sqrt());
        // 1 − s² from −1 to s.
        let upto = |t: f32| {
            let s = ((t - middle) / half).clamp(-1.0, 1.0);
            0.5 + s * (0.75 - 0.25 * s * s)
        };
        let (mut share, mut place, mut apart) = (0.0, 0.0, 0.0);
        for [enter, leave] in within {
            let part = upto(*leave) - upto(*enter);
            if part > 0.0 {
                let (first, last) = (enter.max(middle - half), leave.min(middle + half));
                share += part;
                place += part * 0.5 * (first + last);
                apart += part * 0.223_606_8 * (last - first);
            }
        }
        let (place, apart) = (place / share, apart / share);
        (share > 0.0)
            .then(|| (self.norm * left * left.sqrt() / a.sqrt() * share, [place - apart, place + apart]))
    }
}

/// Three axes, the last of which is this one.
fn cross(normal: Vec3) -> [Vec3; 3] {
    let (x, y) = normal.any_orthonormal_pair();
    [x, y, normal]
}

/// Axis and eigenvalues of a symmetric matrix, the larger first.
fn principal([xx, xy, yy]: [f32; 3]) -> ((f32, f32), [f32; 2]) {
    let (mean, half) = (0.5 * (xx + yy), (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt());
    let (sin, cos) = (0.5 * (2.0 * xy).atan2(xx - yy)).sin_cos();
    ((cos, sin), [mean + half, (mean - half).max(1e-12)])
}

/// Deviations of the light to those of kernels, given how many photons of a pass are in so much of it.
fn shrunk<const N: usize>(deviations: [f32; N], pass: f32, held: impl Fn([f32; N]) -> f32) -> [f32; N] {
    let scale = (pass * held(deviations)).max(1e-6).powf(-1.0 / 6.0);
    let kernel = deviations.map(|s| s * scale);
    let (expected, least) = (held(kernel), LEAST * pass.powf(-1.0 / 3.0));
    let more = if expected < least { (least / expected.max(1e-9)).powf(1.0 / N as f32) } else { 1.0 };
    kernel.map(|s| WIDE * s * more)
}

fn on_surface(landed: &Landed, density: f32, pass: f32) -> ([Vec3; 3], [f32; 3]) {
    let [t, b, n] = cross(landed.normal);
    let [x, y] = landed.axes;
    let [xx, xy, yy] = landed.precision;
    // Across the way, as the surface's own axes see it.
    let on = |p: Vec3, q: Vec3| {
        xx * p.dot(x) * q.dot(x) + xy * (p.dot(x) * q.dot(y) + p.dot(y) * q.dot(x)) + yy * p.dot(y) * q.dot(y)
    };
    let ((cos, sin), [first, second]) = principal([on(t, t), on(t, b), on(b, b)]);
    let second = second.max(first / (SLIM * SLIM));
    let light = [first, second].map(|p| 1.0 / p.sqrt());
    let held = |[a, b]: [f32; 2]| density * 4.0 * PI * a * b;
    let [a, b_side] = shrunk(light, pass, held);
    let axes = [t * cos + b * sin, b * cos - t * sin, n];
    (axes, [a, b_side, 0.5 * (a * b_side).sqrt()])
}

fn in_air(landed: &Landed, density: f32, pass: f32) -> ([Vec3; 3], [f32; 3]) {
    let [x, y] = landed.axes;
    let ((cos, sin), [first, second]) = principal(landed.precision);
    let light = [first, second, landed.along].map(|p| 1.0 / p.max(1e-12).sqrt());
    let held = |[a, b, c]: [f32; 3]| density * (4.0 * PI).powf(1.5) * a * b * c;
    let axes = [x * cos + y * sin, y * cos - x * sin, landed.towards];
    (axes, shrunk(light, pass, held))
}
