//! Fields that are known exactly: the ground truth that learned ones are held against.
//!
//! φ(x, ω) = the least t > 0 with x + tω on the surface, ξ(x, ω) = whether there is one, in f64. With n the unit normal
//! towards the ray's origin and ω of unit length [002 §III]:
//!
//! * ω · ∇ₓφ = −1 (directed eikonal), |∇ₓφ| = 1/|n · ω|, n = ∇ₓφ/|∇ₓφ| [002 eq. 3];
//! * ∇_ω φ = φ (I − ωωᵀ) ∇ₓφ (gradient consistency);
//! * the unsigned distance is min over ω of φ [002 eq. 5].
//!
//! ```
//! use glam::DVec3;
//! use halflight_ddf::AnalyticField;
//! let ball = AnalyticField::Sphere { center: DVec3::ZERO, radius: 1.0 };
//! let found = ball.query(DVec3::new(0.0, 0.0, 3.0), DVec3::NEG_Z).expect("the ray points at the ball");
//! assert_eq!((found.distance, found.normal), (2.0, DVec3::Z));
//! ```

use glam::DVec3;

/// A shape whose field is a formula.
#[derive(Clone, Debug)]
pub enum AnalyticField {
    /// A sphere's surface.
    Sphere {
        /// Its middle.
        center: DVec3,
        /// Its radius.
        radius: f64,
    },
    /// The surface of a box along the axes.
    Box {
        /// Its middle.
        center: DVec3,
        /// Half of its sizes.
        half: DVec3,
    },
    /// A torus about the y axis.
    Torus {
        /// Its middle.
        center: DVec3,
        /// From the axis to the middle of the tube.
        radius: f64,
        /// Radius of the tube.
        tube: f64,
    },
    /// A plane, met from both sides.
    Plane {
        /// A point of it.
        point: DVec3,
        /// Its unit normal.
        normal: DVec3,
    },
    /// All of them together: the nearest counts.
    Union(Vec<AnalyticField>),
}

/// What an exact field answers where a surface is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnalyticHit {
    /// φ: the distance in lengths of the direction.
    pub distance: f64,
    /// Unit normal, towards the ray's origin.
    pub normal: DVec3,
}

/// Roots nearer than this count as the surface that the ray starts on.
const LEAST_DISTANCE: f64 = 1e-9;

impl AnalyticField {
    /// φ and the normal, or none where nothing is seen. A direction that is zero or not finite sees nothing.
    #[must_use]
    pub fn query(&self, x: DVec3, omega: DVec3) -> Option<AnalyticHit> {
        if !(x.is_finite() && omega.is_finite()) || omega == DVec3::ZERO {
            return None;
        }
        let (distance, normal) = self.meet(x, omega)?;
        let normal = if normal.dot(omega) > 0.0 { -normal } else { normal };
        Some(AnalyticHit { distance, normal })
    }

    /// ξ: whether anything is seen.
    #[must_use]
    pub fn is_visible(&self, x: DVec3, omega: DVec3) -> bool {
        self.query(x, omega).is_some()
    }

    /// ∇ₓφ = −n/(n · ω).
    #[must_use]
    pub fn gradient(&self, x: DVec3, omega: DVec3) -> Option<DVec3> {
        let hit = self.query(x, omega)?;
        Some(-hit.normal / hit.normal.dot(omega))
    }

    /// Distance to the nearest point of the surface, whatever the direction; exact but for unions that overlap, where
    /// it is a lower bound.
    #[must_use]
    pub fn unsigned_distance(&self, x: DVec3) -> f64 {
        match self {
            Self::Sphere { center, radius } => (x.distance(*center) - radius).abs(),
            Self::Box { center, half } => {
                let q = (x - *center).abs() - *half;
                let outside = q.max(DVec3::ZERO).length();
                if outside > 0.0 { outside } else { -q.max_element() }
            }
            Self::Torus { center, radius, tube } => {
                let p = x - *center;
                (p.x.hypot(p.z) - radius).hypot(p.y) - tube
            }
            .abs(),
            Self::Plane { point, normal } => (x - *point).dot(*normal).abs(),
            Self::Union(parts) => {
                parts.iter().map(|part| part.unsigned_distance(x)).fold(f64::INFINITY, f64::min)
            }
        }
    }

    fn meet(&self, x: DVec3, omega: DVec3) -> Option<(f64, DVec3)> {
        match self {
            Self::Sphere { center, radius } => {
                let f = x - *center;
                let a = omega.length_squared();
                let nearest = -f.dot(omega) / a;
                let aside = f + nearest * omega;
                let left = radius * radius - aside.length_squared();
                if left < 0.0 {
                    return None;
                }
                let half_chord = (left / a).sqrt();
                let t =
                    [nearest - half_chord, nearest + half_chord].into_iter().find(|&t| t > LEAST_DISTANCE)?;
                Some((t, (f + t * omega) / *radius))
            }
            Self::Box { center, half } => {
                let p = x - *center;
                let (mut enter, mut leave) = ((f64::NEG_INFINITY, 0), (f64::INFINITY, 0));
                for axis in 0..3 {
                    if omega[axis] == 0.0 {
                        if p[axis].abs() > half[axis] {
                            return None;
                        }
                        continue;
                    }
                    let towards = half[axis].copysign(omega[axis]);
                    let near = (-towards - p[axis]) / omega[axis];
                    let far = (towards - p[axis]) / omega[axis];
                    enter = if near > enter.0 { (near, axis) } else { enter };
                    leave = if far < leave.0 { (far, axis) } else { leave };
                }
                if enter.0 > leave.0 {
                    return None;
                }
                let (t, axis) = [enter, leave].into_iter().find(|&(t, _)| t > LEAST_DISTANCE)?;
                let mut normal = DVec3::ZERO;
                normal[axis] = 1.0;
                Some((t, normal))
            }
            Self::Torus { center, radius, tube } => torus(x - *center, omega, *radius, *tube),
            Self::Plane { point, normal } => {
                let across = omega.dot(*normal);
                let t = (*point - x).dot(*normal) / across;
                (across != 0.0 && t > LEAST_DISTANCE).then_some((t, *normal))
            }
            Self::Union(parts) => {
                parts.iter().filter_map(|part| part.meet(x, omega)).min_by(|a, b| a.0.total_cmp(&b.0))
            }
        }
    }
}

/// The first root of f(t) = (|p|² + R² − r²)² − 4R²(p_x² + p_z²) along p = x + tω: f is a quartic, so between the roots
/// of its derivatives it is monotone, and each such stretch is halved until it is sharp. Slow and certain.
fn torus(x: DVec3, omega: DVec3, radius: f64, tube: f64) -> Option<(f64, DVec3)> {
    let length = omega.length();
    let d = omega / length;
    // The root is looked for near the torus, where the numbers are of its size.
    let shift = -x.dot(d);
    let o = x + shift * d;
    let reach = radius + tube;
    let left = reach * reach - o.length_squared();
    if left < 0.0 {
        return None;
    }
    let (r2, k) = (radius * radius, o.length_squared() + radius * radius - tube * tube);
    // (s² + k)² − 4R²(c0 + c1 s + c2 s²), as o · d = 0.
    let (c0, c1, c2) = (o.x * o.x + o.z * o.z, 2.0 * (o.x * d.x + o.z * d.z), d.x * d.x + d.z * d.z);
    let quartic = [k * k - 4.0 * r2 * c0, -4.0 * r2 * c1, 2.0 * k - 4.0 * r2 * c2, 0.0, 1.0];
    let end = left.sqrt();
    let start = (LEAST_DISTANCE * length - shift).max(-end);
    let s = first_root(&quartic, start, end)?;
    let p = o + s * d;
    let ring = DVec3::new(p.x, 0.0, p.z).normalize_or_zero() * radius;
    Some(((s + shift) / length, (p - ring) / tube))
}

fn value(polynomial: &[f64], s: f64) -> f64 {
    polynomial.iter().rev().fold(0.0, |sum, c| sum * s + c)
}

/// All roots of odd order within an interval, in order.
fn roots(polynomial: &[f64], start: f64, end: f64) -> Vec<f64> {
    if polynomial.len() < 2 || start >= end {
        return Vec::new();
    }
    let derivative: Vec<f64> =
        polynomial.iter().enumerate().skip(1).map(|(power, c)| c * power as f64).collect();
    let mut marks = vec![start];
    marks.extend(roots(&derivative, start, end));
    marks.push(end);
    let mut found = Vec::new();
    for pair in marks.windows(2) {
        let (mut a, mut b) = (pair[0], pair[1]);
        let (at_a, at_b) = (value(polynomial, a), value(polynomial, b));
        if at_a == 0.0 || (at_a > 0.0) == (at_b > 0.0) {
            continue;
        }
        for _ in 0..200 {
            let middle = 0.5 * (a + b);
            if middle <= a || middle >= b {
                break;
            }
            if (value(polynomial, middle) > 0.0) == (at_a > 0.0) { a = middle } else { b = middle }
        }
        found.push(0.5 * (a + b));
    }
    found
}

fn first_root(polynomial: &[f64], start: f64, end: f64) -> Option<f64> {
    roots(polynomial, start, end).first().copied()
}
