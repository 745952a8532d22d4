//! The variational fit: n spheres that cover a surface with the least volume outside of it.
//!
//! min Σ_s E(c_s, r_s) subject to every point of surface and inside lying in a sphere, E the volume of a ball outside
//! the mesh (Wang et al. 2006, §3). By turns: points are assigned ([`super::cover`]) and each sphere is fitted anew to
//! its own ([`super::refit`]), which can only lower the sum. When that stops, *teleportation* (their §4.3): the
//! sphere that is missed least is taken away and put where the worst sphere is split in two; kept if the sum
//! falls. Last, the spheres grow over all vertices and a dense set of surface points.
//!
//! The mesh is scaled to [−1, 1] first, so no constant here has a unit. Everything runs over fixed lists in fixed
//! order: the number of threads changes nothing.
//!
//! Cost on two cores and error: see `halflight spheres fit` and the table in the tests of `sphere_figures`.

use glam::Vec3;
use rayon::prelude::*;

use super::cover::{Ball, Cost, assign, costs, grow};
use super::follow::strongest;
use super::points::{self, SurfacePoint};
use super::refit::refit;
use super::solid::Solid;
use super::start;
use super::{RestSurface, SphereFitError, SphereInfluences, SphereMeasure, SphereSet};
use crate::{Model, TriangleMesh};

/// The most spheres of a fit; the time grows with their square.
pub const MAX_SPHERES: usize = 4096;
/// Surface points for each sphere, and the least and most of them.
const POINTS_PER_SPHERE: usize = 80;
const LEAST_POINTS: usize = 4000;
const MOST_POINTS: usize = 24_000;
/// One inside point for so many on the surface: they only keep spheres from settling in the skin.
const INSIDE_SHARE: usize = 4;
/// Alternations before and after teleportation, and within one trial of it.
const ROUNDS: usize = 24;
const TRIAL_ROUNDS: usize = 4;
/// Alternations with the points that were missed.
const DENSE_ROUNDS: usize = 4;
/// A round that lowers the sum by less than this share is the last.
const CONVERGED: f32 = 1e-3;
/// Trials of teleportation that may fail in a row, at least.
const PATIENCE: usize = 12;
/// Points that must be covered in the end, besides all vertices.
const DENSE_POINTS: usize = 60_000;
/// Radii are widened by the rounding of centres and distances.
const ROUNDING: f32 = 1e-5;
/// Below this share of the cells inside its bounds a mesh counts as one without interior.
const LEAST_INTERIOR: f64 = 1e-3;

/// What a fit may take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphereFitOptions {
    /// How many spheres.
    pub spheres: usize,
    /// Voxels along the longest side: parts thinner than one have no inside.
    pub resolution: usize,
    /// The most trials of teleportation; 0 leaves the first local optimum.
    pub teleports: usize,
}

impl Default for SphereFitOptions {
    fn default() -> Self {
        Self { spheres: 50, resolution: 112, teleports: 60 }
    }
}

/// How a fit went.
#[derive(Clone, Debug, PartialEq)]
pub struct SphereFitReport {
    /// Outside volume and coverage.
    pub measure: SphereMeasure,
    /// Whether the mesh has an inside. If not, spheres are as large as the pieces of surface they cover.
    pub has_interior: bool,
    /// Alternations of assigning and fitting.
    pub rounds: usize,
    /// Teleportations that were kept.
    pub teleports: usize,
    /// Points that are covered for certain: all vertices, and an even set on the surface.
    pub covered_points: usize,
    /// What a user should know, in sentences.
    pub warnings: Vec<String>,
}

impl SphereSet {
    /// Fits spheres to a mesh, closed or open, of one part or many.
    ///
    /// # Errors
    /// No spheres or too many asked for, a mesh that is not valid, or one without surface.
    pub fn fit(
        name: &str,
        mesh: &TriangleMesh,
        options: &SphereFitOptions,
    ) -> Result<(Self, SphereFitReport), SphereFitError> {
        mesh.validate().map_err(|error| SphereFitError::Mesh { name: name.into(), error })?;
        let mesh = TriangleMesh {
            positions: mesh.positions.clone(),
            triangles: mesh.triangles.clone(),
            ..TriangleMesh::default()
        };
        Self::fit_surface(&RestSurface { name: name.into(), mesh, influences: Vec::new() }, options)
    }

    /// Fits spheres to a model at rest; they follow its joints and animated nodes.
    ///
    /// # Errors
    /// As [`SphereSet::fit`].
    pub fn fit_model(
        model: &Model,
        options: &SphereFitOptions,
    ) -> Result<(Self, SphereFitReport), SphereFitError> {
        let (set, mut report) = Self::fit_surface(&model.rest_surface(), options)?;
        if model.is_animated() && model.meshes.iter().any(|m| !m.morphs.is_empty()) {
            report.warnings.push("the model has morph targets, which spheres do not follow".into());
        }
        Ok((set, report))
    }

    /// Fits spheres to a surface whose vertices know their joints.
    ///
    /// # Errors
    /// As [`SphereSet::fit`].
    pub fn fit_surface(
        surface: &RestSurface,
        options: &SphereFitOptions,
    ) -> Result<(Self, SphereFitReport), SphereFitError> {
        let RestSurface { name, mesh, influences } = surface;
        match options.spheres {
            0 => return Err(SphereFitError::NoSpheres),
            asked if asked > MAX_SPHERES => return Err(SphereFitError::TooManySpheres { asked }),
            _ => {}
        }
        mesh.validate().map_err(|error| SphereFitError::Mesh { name: name.clone(), error })?;
        let no_surface = || SphereFitError::NoSurface { name: name.clone(), triangles: mesh.triangles.len() };
        let (low, high) = mesh.bounds().ok_or_else(no_surface)?;
        let (middle, scale) = (0.5 * (low + high), 0.5 * (high - low).max_element());
        if scale.is_nan() || scale < f32::MIN_POSITIVE {
            return Err(no_surface());
        }
        let positions: Vec<Vec3> = mesh.positions.iter().map(|p| (*p - middle) / scale).collect();
        let mut fit =
            Fit::new(&positions, &mesh.triangles, (low - middle) / scale, (high - middle) / scale, options)
                .ok_or_else(no_surface)?;
        fit.run(options);
        let covered_points = fit.cover_all(&positions, &mesh.triangles);
        let set = Self {
            name: name.clone(),
            mesh_hash: surface.hash(),
            centers: fit.balls.iter().map(|b| b.center * scale + middle).collect(),
            radii: fit.balls.iter().map(|b| b.radius * (1.0 + ROUNDING) * scale + ROUNDING * scale).collect(),
            influences: if influences.is_empty() {
                Vec::new()
            } else {
                fit.influences(&mesh.triangles, influences)
            },
        };
        let mut warnings = Vec::new();
        if !fit.has_interior {
            warnings.push(format!("{name} encloses nothing: spheres are as large as the surface they cover"));
        }
        let report = SphereFitReport {
            measure: set.measure(mesh),
            has_interior: fit.has_interior,
            rounds: fit.rounds,
            teleports: fit.teleports,
            covered_points,
            warnings,
        };
        Ok((set, report))
    }
}

/// The state of a fit, in the scaled frame.
struct Fit {
    solid: Solid,
    has_interior: bool,
    surface: Vec<SurfacePoint>,
    /// Surface points, then inside points.
    points: Vec<Vec3>,
    /// The smallest radius: half the spacing of the points.
    least_radius: f32,
    /// Reach of cost tables of small spheres.
    least_reach: f32,
    balls: Vec<Ball>,
    /// Outside volume of each ball.
    values: Vec<f32>,
    /// Points of each ball, by index.
    groups: Vec<Vec<u32>>,
    rounds: usize,
    teleports: usize,
}

impl Fit {
    fn new(
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        low: Vec3,
        high: Vec3,
        options: &SphereFitOptions,
    ) -> Option<Self> {
        let count = options.spheres;
        let wanted = (POINTS_PER_SPHERE * count).clamp(LEAST_POINTS, MOST_POINTS);
        let surface = points::on_surface(positions, triangles, wanted);
        if surface.is_empty() {
            return None;
        }
        let solid = Solid::build(positions, triangles, (low, high), options.resolution.clamp(16, 512));
        let bounds = (high - low).max(Vec3::splat(solid.cell())).as_dvec3().element_product();
        let has_interior = solid.volume > LEAST_INTERIOR * bounds;
        let mut points: Vec<Vec3> = surface.iter().map(|p| p.position).collect();
        points.extend(points::within(&solid, wanted / INSIDE_SHARE));
        let spacing = (points::area(positions, triangles) / wanted as f64).sqrt() as f32;
        let balls = start::on_axis(&solid, &points, count);
        Some(Self {
            has_interior,
            surface,
            points,
            least_radius: 0.5 * spacing,
            least_reach: (1.5 / (count as f32).cbrt()).max(8.0 * spacing),
            values: vec![f32::INFINITY; balls.len()],
            groups: vec![Vec::new(); balls.len()],
            balls,
            solid,
            rounds: 0,
            teleports: 0,
        })
    }

    fn total(&self) -> f32 {
        self.values.iter().sum()
    }

    fn run(&mut self, options: &SphereFitOptions) {
        self.settle(ROUNDS, CONVERGED);
        let first = (self.total(), self.balls.clone(), self.values.clone(), self.groups.clone());
        self.balls = start::apart(&self.points, self.balls.len());
        self.values.fill(f32::INFINITY);
        self.settle(ROUNDS, CONVERGED);
        if first.0 <= self.total() {
            (_, self.balls, self.values, self.groups) = first;
        }
        // Few spheres are quick to try, and each of them matters more.
        let patience = (400 / self.balls.len()).clamp(PATIENCE, 40);
        let (mut failed, mut trial) = (0, 0);
        while trial < options.teleports && failed < patience && self.balls.len() > 1 {
            if self.teleport(failed) {
                failed = 0;
                self.teleports += 1;
            } else {
                failed += 1;
            }
            trial += 1;
        }
        self.settle(ROUNDS, CONVERGED);
    }

    /// Rounds until the sum falls by less than a share; the best state is kept. A share of −∞ takes all rounds: after a
    /// jump the sum may rise before it falls.
    fn settle(&mut self, most: usize, share: f32) {
        let mut best = (self.balls.clone(), self.values.clone(), self.groups.clone());
        let mut least = self.total();
        for _ in 0..most {
            self.round();
            let total = self.total();
            let falls = total <= (1.0 - share) * least;
            if total < least {
                best = (self.balls.clone(), self.values.clone(), self.groups.clone());
                least = total;
            }
            if !falls {
                break;
            }
        }
        (self.balls, self.values, self.groups) = best;
    }

    /// One alternation: assign all points, fit every ball whose points changed.
    fn round(&mut self) {
        self.rounds += 1;
        let before = self.balls.clone();
        let costs = costs(&self.solid, &self.balls, self.least_reach);
        let owners = assign(&self.points, &mut self.balls, &costs);
        let mut groups = vec![Vec::new(); self.balls.len()];
        for (point, &owner) in owners.iter().enumerate() {
            groups[owner as usize].push(point as u32);
        }
        self.share_with_idle(&mut groups, &costs);
        let fitted: Vec<(Ball, f32)> = (0..self.balls.len())
            .into_par_iter()
            .map(|s| {
                if groups[s] == self.groups[s] && self.values[s].is_finite() {
                    return (before[s], self.values[s]);
                }
                self.fitted(before[s], &groups[s], self.values[s].is_infinite() || self.groups[s].is_empty())
            })
            .collect();
        (self.balls, self.values) = fitted.into_iter().unzip();
        self.groups = groups;
    }

    /// A ball that got no point takes half of the points of the ball that costs most.
    fn share_with_idle(&self, groups: &mut [Vec<u32>], costs: &[Cost]) {
        let mut prices: Vec<f32> = self.balls.iter().zip(costs).map(|(b, c)| c.at(b.radius)).collect();
        for idle in 0..groups.len() {
            if !groups[idle].is_empty() {
                continue;
            }
            let worst = (0..groups.len()).filter(|&s| groups[s].len() > 1);
            let Some(worst) = worst.max_by(|&a, &b| prices[a].total_cmp(&prices[b]).then(b.cmp(&a))) else {
                return;
            };
            let [near, far] = self.halves(&groups[worst]);
            (groups[worst], groups[idle]) = (near, far);
            (prices[worst], prices[idle]) = (0.5 * prices[worst], 0.5 * prices[worst]);
        }
    }

    /// The best ball for a group; a `fresh` one may be far from its points.
    fn fitted(&self, ball: Ball, group: &[u32], fresh: bool) -> (Ball, f32) {
        if group.is_empty() {
            return (Ball { radius: self.least_radius, ..ball }, 0.0);
        }
        let points: Vec<Vec3> = group.iter().map(|&i| self.points[i as usize]).collect();
        refit(&self.solid, ball.center, &points, self.least_radius, fresh)
    }

    /// Takes away the ball that is missed least and splits the worst; `rank` tries other pairs after failures. Whether
    /// the sum fell; if not, all is as before.
    fn teleport(&mut self, rank: usize) -> bool {
        let mut losses: Vec<(f32, usize)> =
            self.losses().into_iter().enumerate().map(|(s, l)| (l, s)).collect();
        losses.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut worst: Vec<usize> = (0..self.balls.len()).collect();
        worst.sort_by(|&a, &b| self.values[b].total_cmp(&self.values[a]).then(a.cmp(&b)));
        let removed = losses[(rank % 4).min(losses.len() - 1)].1;
        let Some(&split) = worst.iter().filter(|&&s| s != removed).nth((rank / 4).min(worst.len() - 2))
        else {
            return false;
        };
        if self.groups[split].len() < 2 {
            return false;
        }
        let before = (self.balls.clone(), self.values.clone(), self.groups.clone());
        let least = self.total();
        let halves = self.halves(&self.groups[split]);
        for (ball, half) in [split, removed].into_iter().zip(&halves) {
            let center = half.iter().map(|&i| self.points[i as usize]).sum::<Vec3>() / half.len() as f32;
            let (fitted, _) = self.fitted(Ball { center, radius: 0.0 }, half, true);
            self.balls[ball] = fitted;
            self.values[ball] = f32::INFINITY;
        }
        self.settle(TRIAL_ROUNDS + (60 / self.balls.len()).min(6), f32::NEG_INFINITY);
        let better = self.total() < (1.0 - 1e-3) * least;
        if !better {
            (self.balls, self.values, self.groups) = before;
        }
        better
    }

    /// For each ball, by how much the sum would rise (or fall) if its points went to the others.
    fn losses(&self) -> Vec<f32> {
        let costs = costs(&self.solid, &self.balls, self.least_reach);
        (0..self.balls.len())
            .into_par_iter()
            .map(|s| {
                let mut radii: Vec<f32> = self.balls.iter().map(|b| b.radius).collect();
                let mut loss = -self.values[s];
                for &i in &self.groups[s] {
                    let p = self.points[i as usize];
                    let mut best = (f32::INFINITY, 0, 0.0);
                    for t in (0..radii.len()).filter(|&t| t != s) {
                        let d = p.distance(self.balls[t].center);
                        let price = if d <= radii[t] { 0.0 } else { costs[t].at(d) - costs[t].at(radii[t]) };
                        if price < best.0 {
                            best = (price, t, d);
                        }
                        if price == 0.0 {
                            break;
                        }
                    }
                    if best.0 > 0.0 && best.0.is_finite() {
                        loss += best.0;
                        radii[best.1] = best.2;
                    }
                }
                loss
            })
            .collect()
    }

    /// A group in two, each point with the nearer of two far ends (found by walking twice to the farthest point).
    fn halves(&self, group: &[u32]) -> [Vec<u32>; 2] {
        let at = |i: u32| self.points[i as usize];
        let farthest = |from: Vec3| {
            group.iter().copied().max_by(|&a, &b| {
                at(a).distance_squared(from).total_cmp(&at(b).distance_squared(from)).then(b.cmp(&a))
            })
        };
        let first = farthest(at(group[0])).map_or(at(group[0]), at);
        let second = farthest(first).map_or(first, at);
        let (near, mut far): (Vec<u32>, Vec<u32>) =
            group.iter().partition(|&&i| at(i).distance_squared(first) <= at(i).distance_squared(second));
        if far.is_empty() {
            far.push(group[0]);
        }
        [near, far]
    }

    /// Covers all vertices in use and many surface points: first with fits that know the worst of them, then by
    /// growth. How many points that is.
    fn cover_all(&mut self, positions: &[Vec3], triangles: &[[u32; 3]]) -> usize {
        let mut dense: Vec<Vec3> =
            points::on_surface(positions, triangles, DENSE_POINTS).iter().map(|p| p.position).collect();
        let mut used = vec![false; positions.len()];
        triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
        dense.extend(positions.iter().zip(used).filter(|(_, used)| *used).map(|(p, _)| *p));
        for _ in 0..2 {
            let balls = &self.balls;
            let outside = |p: &&Vec3| !balls.iter().any(|b| p.distance(b.center) <= b.radius);
            let missed: Vec<Vec3> = dense.par_iter().filter(outside).copied().collect();
            if missed.is_empty() {
                break;
            }
            let step = missed.len().div_ceil(self.points.len()).max(1);
            self.points.extend(missed.iter().step_by(step));
            self.values.fill(f32::INFINITY);
            self.settle(DENSE_ROUNDS, CONVERGED);
        }
        let costs = costs(&self.solid, &self.balls, self.least_reach);
        grow(&dense, &mut self.balls, &costs);
        dense.len()
    }

    /// The joints of each ball: those of the surface points it owns; of the nearest point if it owns none.
    fn influences(&self, triangles: &[[u32; 3]], of_vertices: &[SphereInfluences]) -> Vec<SphereInfluences> {
        let pairs = |point: &SurfacePoint| {
            let corners = triangles[point.triangle as usize].into_iter().zip(point.weights);
            let of_corner = |(vertex, share): (u32, f32)| {
                let of = of_vertices[vertex as usize];
                of.joints.into_iter().map(usize::from).zip(of.weights.map(|w| w * share))
            };
            corners.flat_map(of_corner).collect::<Vec<_>>()
        };
        let of_ball = |(ball, group): (&Ball, &Vec<u32>)| {
            let own: Vec<&SurfacePoint> =
                group.iter().filter_map(|&i| self.surface.get(i as usize)).collect();
            if own.is_empty() {
                let distance = |p: &SurfacePoint| p.position.distance_squared(ball.center);
                let nearest = self.surface.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
                return strongest(nearest.map(pairs).unwrap_or_default());
            }
            strongest(own.into_iter().flat_map(pairs))
        };
        self.balls.iter().zip(&self.groups).map(of_ball).collect()
    }
}
