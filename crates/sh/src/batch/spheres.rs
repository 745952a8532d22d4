//! Spheres as blockers of many points: from centres and radii to weighted log-visibility, sixteen points at a time.
//!
//! A point sees a sphere at distance d of radius r under θ = asin(r/d). The rules for points on, in and near spheres:
//! a sphere that the point is inside of counts as r = 0.9 d, or not at all if the two have one owner; a sphere wholly
//! below the horizon of the point's normal, d_b · n ≤ −sin θ, does not count (see [`crate::attenuation`]).

use std::f32::consts::{FRAC_PI_2, PI};

use super::blockers::log_visibility;
use super::{Lanes, WIDTH, load, load_direction, store};
use crate::blocker::Series;
use crate::simd::{Kernel, Lane, Simd};
use crate::zonal::scale_bands;
use crate::{BlockerTable, Sh};

/// r/d of a sphere that the point is inside of.
const INSIDE: f32 = 0.9;
/// r/d from which a point counts as inside, so that rounding does not matter on the surface itself.
const ON_SURFACE: f32 = 0.999;

/// Sixteen points with their horizons.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PointLanes {
    /// Positions (x, y, z), in the frame of the harmonics.
    pub position: [Lanes; 3],
    /// Unit normals.
    pub normal: [Lanes; 3],
    /// Number of the body that a point belongs to, below 2²⁴; negative for none.
    pub owner: Lanes,
}

/// A sphere that blocks light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphereBlocker {
    /// Centre, in the frame of the harmonics.
    pub center: [f32; 3],
    /// Radius.
    pub radius: f32,
    /// w_b of its log-visibility.
    pub weight: f32,
    /// Number of the body it belongs to, as in [`PointLanes::owner`].
    pub owner: f32,
}

/// asin for x from 0 to 1 (Abramowitz and Stegun 4.4.46, the first four terms: error below 7e-5 radians, a twentieth of
/// the table's step).
#[inline(always)]
fn asin<V: Lane>(x: V) -> V {
    let mut p = V::splat(-0.018_729_3);
    for coefficient in [0.074_261_0, -0.212_114_4, 1.570_728_8] {
        p = p.mul_add(x, V::splat(coefficient));
    }
    V::splat(FRAC_PI_2) - (V::splat(1.0) - x).max(V::splat(0.0)).sqrt() * p
}

/// Weighted log-visibility of spheres that are small enough for the series.
#[inline(always)]
fn small_log_visibility<const ORDER: usize, V: Lane>(
    series: &Series<ORDER>,
    direction: [V; 3],
    squared_sine: V,
    weight: V,
) -> Sh<ORDER, V> {
    let mut factors = [V::splat(0.0); ORDER];
    for l in 0..ORDER {
        let terms = &series.terms[l];
        let mut factor = V::splat(terms[terms.len() - 1]);
        for term in terms[..terms.len() - 1].iter().rev() {
            factor = factor.mul_add(squared_sine, V::splat(*term));
        }
        factors[l] = factor * weight;
    }
    let mut sh = Sh::<ORDER, V>::basis(direction);
    scale_bands(&mut sh, &factors);
    sh
}

struct Spheres<'a, const ORDER: usize> {
    table: &'a BlockerTable<ORDER>,
    points: &'a [PointLanes],
    spheres: &'a [SphereBlocker],
    logs: &'a mut [Sh<ORDER, Lanes>],
}

impl<const ORDER: usize> Kernel for Spheres<'_, ORDER> {
    type Output = ();
    #[inline(always)]
    fn run<V: Lane>(self) {
        let (columns, series) = (self.table.columns(), self.table.series());
        for (points, log) in self.points.iter().zip(self.logs) {
            let around = Around::of::<V>(points);
            for spheres in self.spheres.chunks(CHOSEN) {
                // Which of them any of the sixteen points may see above its horizon.
                let (mut chosen, mut count) = ([0u8; CHOSEN], 0);
                for (i, sphere) in spheres.iter().enumerate() {
                    chosen[count] = i as u8;
                    count += usize::from(around.may_see(sphere));
                }
                for part in 0..WIDTH / V::N {
                    let position: [V; 3] = load_direction(&points.position, part);
                    let normal: [V; 3] = load_direction(&points.normal, part);
                    let owner = V::load(&points.owner.0[part * V::N..]);
                    let mut sum: Sh<ORDER, V> = load(log, part);
                    for &i in &chosen[..count] {
                        let sphere = &spheres[i as usize];
                        let (nothing, radius) = (V::splat(0.0), V::splat(sphere.radius));
                        let to = [
                            V::splat(sphere.center[0]) - position[0],
                            V::splat(sphere.center[1]) - position[1],
                            V::splat(sphere.center[2]) - position[2],
                        ];
                        // Above the horizon if d_b · n > −sin θ; asked before anything is divided.
                        let height = to[0].mul_add(normal[0], to[1].mul_add(normal[1], to[2] * normal[2]));
                        let above = (height + radius).gt(nothing);
                        if !V::any(above) {
                            continue;
                        }
                        let squared = to[0].mul_add(to[0], to[1].mul_add(to[1], to[2] * to[2]));
                        let inverse = V::splat(1.0).over(squared.max(V::splat(1e-30)).sqrt());
                        let direction = [to[0] * inverse, to[1] * inverse, to[2] * inverse];
                        let sine = radius * inverse;
                        // In its own body: equal owners differ by less than a half.
                        let apart = owner - V::splat(sphere.owner);
                        let own = V::select((apart * apart).gt(V::splat(0.25)), nothing, V::splat(1.0));
                        let inside = V::select(sine.gt(V::splat(ON_SURFACE)), V::splat(1.0), nothing);
                        let weight = V::select(above, V::splat(sphere.weight), nothing);
                        let weight = weight * (V::splat(1.0) - own * inside);
                        if !V::any((weight * weight).gt(nothing)) {
                            continue;
                        }
                        let squared_sine = sine * sine;
                        if V::any(squared_sine.gt(V::splat(series.end))) {
                            let angle = asin(sine.min(V::splat(INSIDE)));
                            sum += log_visibility(columns, direction, angle, weight);
                        } else {
                            sum += small_log_visibility(series, direction, squared_sine, weight);
                        }
                    }
                    store(&sum, log, part);
                }
            }
        }
    }
}

/// Spheres of which those above the horizon are chosen at once.
const CHOSEN: usize = 128;

/// Where sixteen points are: within a ball, with normals within a distance of their mean.
struct Around {
    middle: [f32; 3],
    radius: f32,
    normal: [f32; 3],
    squared_spread: f32,
}

#[inline(always)]
fn mean<V: Lane>(lanes: &[Lanes; 3]) -> [f32; 3] {
    let mut mean = [0.0; 3];
    for axis in 0..3 {
        for part in 0..WIDTH / V::N {
            mean[axis] += V::load(&lanes[axis].0[part * V::N..]).sum();
        }
        mean[axis] /= WIDTH as f32;
    }
    mean
}

/// The square of the greatest distance.
#[inline(always)]
fn farthest<V: Lane>(lanes: &[Lanes; 3], from: [f32; 3]) -> f32 {
    let mut squares = Lanes::default();
    for part in 0..WIDTH / V::N {
        let at: [V; 3] = load_direction(lanes, part);
        let to = [at[0] - V::splat(from[0]), at[1] - V::splat(from[1]), at[2] - V::splat(from[2])];
        let squared = to[0].mul_add(to[0], to[1].mul_add(to[1], to[2] * to[2]));
        squared.store(&mut squares.0[part * V::N..]);
    }
    let mut most = 0.0;
    for square in squares.0 {
        most = if square > most { square } else { most };
    }
    most
}

impl Around {
    #[inline(always)]
    fn of<V: Lane>(points: &PointLanes) -> Self {
        let (middle, normal) = (mean::<V>(&points.position), mean::<V>(&points.normal));
        let radius = farthest::<V>(&points.position, middle).sqrt();
        Self { middle, radius, normal, squared_spread: farthest::<V>(&points.normal, normal) }
    }

    /// False only where a sphere is below the horizon of each point: with w from the middle to it, N the mean normal and n
    /// that of a point, (w + middle − p) · n ≤ w · N + |w| |n − N| + |middle − p|.
    #[inline(always)]
    fn may_see(&self, sphere: &SphereBlocker) -> bool {
        let (c, m, n) = (&sphere.center, &self.middle, &self.normal);
        let w = [c[0] - m[0], c[1] - m[1], c[2] - m[2]];
        let squared = w[0] * w[0] + w[1] * w[1] + w[2] * w[2];
        let height = w[0] * n[0] + w[1] * n[1] + w[2] * n[2] + self.radius + sphere.radius;
        // A little more than the distance, for roundings.
        !((height < 0.0) & (height * height > 1.01 * self.squared_spread * squared + 1e-6 * squared))
    }
}

/// Adds Σ w_b log-visibility of spheres to sixteen points in each block. Panics where `points` and `logs` differ in length.
pub fn accumulate_spheres<const ORDER: usize>(
    simd: Simd,
    table: &BlockerTable<ORDER>,
    points: &[PointLanes],
    spheres: &[SphereBlocker],
    logs: &mut [Sh<ORDER, Lanes>],
) {
    assert_eq!(points.len(), logs.len(), "slices of blocks that belong together have the same length");
    simd.run(Spheres { table, points, spheres, logs });
}

struct Weights<'a, const ORDER: usize> {
    point: [f32; 3],
    spheres: &'a mut [SphereBlocker],
    multiplicities: &'a [f32],
    terms: &'a mut Vec<Sh<ORDER, Lanes>>,
}

impl<const ORDER: usize> Kernel for Weights<'_, ORDER> {
    type Output = ();
    #[inline(always)]
    fn run<V: Lane>(self) {
        let blocks = self.spheres.len().div_ceil(WIDTH);
        self.terms.clear();
        self.terms.resize(blocks, Sh::zero());
        let mut density = Sh::<ORDER, V>::zero();
        for (spheres, term) in self.spheres.chunks(WIDTH).zip(self.terms.iter_mut()) {
            let mut columns = [Lanes::default(); 4];
            for (lane, sphere) in spheres.iter().enumerate() {
                for axis in 0..3 {
                    columns[axis].0[lane] = sphere.center[axis] - self.point[axis];
                }
                columns[3].0[lane] = sphere.radius;
            }
            for part in 0..WIDTH / V::N {
                let at = part * V::N;
                let (x, y) = (V::load(&columns[0].0[at..]), V::load(&columns[1].0[at..]));
                let (z, radius) = (V::load(&columns[2].0[at..]), V::load(&columns[3].0[at..]));
                let squared = x.mul_add(x, y.mul_add(y, z * z)).max(V::splat(1e-30));
                let inverse = V::splat(1.0).over(squared.sqrt());
                let sine = (radius * inverse).min(V::splat(INSIDE));
                let cosine = (V::splat(1.0) - sine * sine).sqrt();
                let mut sh = Sh::<ORDER, V>::basis([x * inverse, y * inverse, z * inverse]);
                scale_bands(&mut sh, &cap_bands(cosine));
                density += sh;
                store(&sh, term, part);
            }
        }
        // In all lanes what all lanes together hold.
        for coefficient in density.coefficients_mut() {
            *coefficient = V::splat(coefficient.sum());
        }
        for ((spheres, term), multiplicities) in
            self.spheres.chunks_mut(WIDTH).zip(self.terms.iter()).zip(self.multiplicities.chunks(WIDTH))
        {
            let mut found = Lanes::default();
            for part in 0..WIDTH / V::N {
                let term: Sh<ORDER, V> = load(term, part);
                let expressed = term.dot(&density) - term.dot(&term);
                // Ω_b is √4π times the term's first coefficient.
                let solid_angle = term[0] * V::of(crate::sh::SQRT_4PI);
                let expressed = expressed.over(solid_angle.max(V::splat(1e-20))).max(V::splat(0.0));
                expressed.store(&mut found.0[part * V::N..]);
            }
            for ((sphere, &multiplicity), expressed) in spheres.iter_mut().zip(multiplicities).zip(found.0) {
                sphere.weight = ((1.0 + expressed) / multiplicity.max(1.0)).min(1.0);
            }
        }
    }
}

/// z_l √(4π/(2l+1)) of the cap of a half-angle with this cosine: 2π ∫_c^1 P_l = 2π (P_{l−1} − P_{l+1})/(2l + 1).
#[inline(always)]
fn cap_bands<const ORDER: usize, V: Lane>(c: V) -> [V; ORDER] {
    let mut bands = [V::splat(2.0 * PI) * (V::splat(1.0) - c); ORDER];
    let (mut before, mut here) = (V::splat(1.0), c);
    for (l, band) in bands.iter_mut().enumerate().skip(1) {
        let degree = l as f32;
        let next = (V::splat(2.0 * degree + 1.0) * c * here - V::splat(degree) * before)
            * V::splat(1.0 / (degree + 1.0));
        *band = (before - next) * V::splat(2.0 * PI / (2.0 * degree + 1.0));
        (before, here) = (here, next);
    }
    bands
}

/// Sets w_b of each sphere as `point` sees them all: ratio attenuation with multiplicities known beforehand, as many as
/// spheres. `terms` is room to work in.
pub fn attenuate_spheres<const ORDER: usize>(
    simd: Simd,
    point: [f32; 3],
    spheres: &mut [SphereBlocker],
    multiplicities: &[f32],
    terms: &mut Vec<Sh<ORDER, Lanes>>,
) {
    assert_eq!(spheres.len(), multiplicities.len(), "each sphere has a multiplicity");
    simd.run(Weights { point, spheres, multiplicities, terms });
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::attenuation::{self, Cap};
    use crate::batch::lane;
    use crate::study::body;

    fn blockers() -> Vec<SphereBlocker> {
        let sphere = |(center, radius): (Vec3, f32)| SphereBlocker {
            center: (center + Vec3::Z * 3.0).into(),
            radius,
            weight: 1.0,
            owner: -1.0,
        };
        body(37, 3).into_iter().map(sphere).collect()
    }

    fn caps(spheres: &[SphereBlocker], from: Vec3) -> Vec<Cap> {
        spheres.iter().map(|s| Cap::of_sphere(Vec3::from(s.center) - from, s.radius).unwrap()).collect()
    }

    #[test]
    fn sixteen_points_see_spheres_as_one_point_does() {
        let table = BlockerTable::<4>::new();
        let mut spheres = blockers();
        let from = |i: usize| Vec3::new(0.3 * i as f32 - 2.0, 0.2, -0.1 * i as f32);
        let mut points = PointLanes { owner: Lanes::splat(-2.0), ..PointLanes::default() };
        for i in 0..WIDTH {
            for axis in 0..3 {
                points.position[axis].0[i] = from(i)[axis];
                points.normal[axis].0[i] = Vec3::Y[axis];
            }
        }
        let m = attenuation::multiplicities(&caps(&spheres, from(0)));
        for simd in [Simd::Baseline, Simd::detect()] {
            attenuate_spheres::<4>(simd, from(0).into(), &mut spheres, &m, &mut Vec::new());
            let expected = attenuation::weights::<4>(&caps(&spheres, from(0)), &m);
            for (sphere, expected) in spheres.iter().zip(&expected) {
                assert!((sphere.weight - expected).abs() < 1e-4, "{} {expected}", sphere.weight);
            }
            let mut logs = [Sh::zero()];
            accumulate_spheres(simd, &table, &[points], &spheres, &mut logs);
            for i in 0..WIDTH {
                let plain: Sh<4> = caps(&spheres, from(i))
                    .iter()
                    .zip(&expected)
                    .filter(|(cap, _)| cap.above_horizon(Vec3::Y))
                    .map(|(cap, &weight)| table.log_visibility(cap) * weight)
                    .sum();
                assert!((lane(&logs[0], i) - plain).norm() < 2e-3 * (1.0 + plain.norm()), "point {i}");
            }
        }
    }

    #[test]
    fn spheres_that_points_do_not_choose_are_below_the_horizon_of_each() {
        let mut chosen = [0, 0];
        for turn in 0..64 {
            let mut points = PointLanes::default();
            let spread = 0.1 * (turn % 8) as f32;
            for i in 0..WIDTH {
                let at = |step: f32| ((i + 16 * turn) as f32 * step).fract() - 0.5;
                let normal = Vec3::new(at(0.618), at(0.414), at(0.732)) * spread * 2.0
                    + Vec3::new((turn as f32).cos(), 0.4, (turn as f32).sin());
                for axis in 0..3 {
                    points.position[axis].0[i] = spread * at([0.317, 0.553, 0.291][axis]);
                    points.normal[axis].0[i] = normal.normalize()[axis];
                }
            }
            let around = Around::of::<crate::simd::Plain>(&points);
            for k in 0..200 {
                let at = |step: f32| 6.0 * ((k as f32 * step).fract() - 0.5);
                let center = Vec3::new(at(0.618), at(0.414), at(0.732));
                let sphere = SphereBlocker { center: center.into(), radius: 0.2, weight: 1.0, owner: -1.0 };
                let above = (0..WIDTH).any(|i| {
                    let of = |lanes: &[Lanes; 3]| Vec3::new(lanes[0].0[i], lanes[1].0[i], lanes[2].0[i]);
                    (center - of(&points.position)).dot(of(&points.normal)) > -0.2
                });
                chosen[usize::from(around.may_see(&sphere))] += 1;
                assert!(around.may_see(&sphere) || !above, "{turn} {k}");
            }
        }
        assert!(chosen[0] > 2000, "{chosen:?}");
    }

    #[test]
    fn the_body_that_a_point_is_on_casts_no_shadow_on_it_from_within() {
        let table = BlockerTable::<4>::new();
        let sphere = SphereBlocker { center: [0.0; 3], radius: 1.0, weight: 1.0, owner: 7.0 };
        let mut points = PointLanes { owner: Lanes::splat(7.0), ..PointLanes::default() };
        points.position[2] = Lanes::splat(0.5);
        points.normal[2] = Lanes::splat(-1.0);
        let mut logs = [Sh::zero()];
        accumulate_spheres(Simd::detect(), &table, &[points], &[sphere], &mut logs);
        assert_eq!(lane(&logs[0], 5), Sh::zero());
        points.owner = Lanes::splat(8.0);
        accumulate_spheres(Simd::detect(), &table, &[points], &[sphere], &mut logs);
        assert!(lane(&logs[0], 5).norm() > 1.0);
    }
}
