//! The spheres that block light: those that are in the scene, and those that stand for its meshes.

use std::ops::Range;

use glam::{Affine3A, Vec3};
use halflight_scene::{Frame, Scene};
use halflight_sh::attenuation::Cap;
use halflight_sh::batch::SphereBlocker;
use halflight_shape::{SphereFitOptions, SphereSet};
use halflight_trace::{Geometry, Hit};
use rayon::prelude::*;

use crate::sh_light::axes;
use crate::technique::Progress;

/// Meshes thinner than this part of their extent are taken for flat: they receive shadows and throw none.
const FLAT: f32 = 1e-3;

/// ε of the closed form log ε · cap for the spheres of a body. Weights 1/m_b make the sum of the caps about 1 where the
/// body is, so ε is what is left visible through it. Measured on balls filled with 20 to 100 spheres and on chains,
/// from 1.05 to 2.5 radii: mean error of the irradiance 0.4 to 10 %; the log table of single spheres, which knows
/// nothing of neighbours, 1.2 to 14 %; ε = 0.2 0.4 to 13 %; ε = 0.05 1 to 8 %, but too dark from afar.
pub(super) const BODY_EPSILON: f64 = 0.1;

/// Spheres of one object whose overlap is learned anew in every frame, as they may move one by one: some milliseconds.
/// Of larger objects it is that of the first frame.
const MOST_LIVE: usize = 1024;

/// What stands for an object of the scene.
struct Body {
    object: usize,
    set: SphereSet,
    multiplicities: Vec<f32>,
}

/// What outlives a frame: the fitted sets, and how much the spheres of each object overlap.
#[derive(Default)]
pub(super) struct Bodies {
    bodies: Vec<Body>,
    /// Of the objects that are spheres already: object and multiplicities.
    spheres: Vec<(usize, Vec<f32>)>,
    /// Names of objects that throw no shadow, and why.
    pub(super) without: Vec<String>,
}

/// The blockers of one frame.
pub(super) struct Blockers {
    /// Spheres that fill bodies, each of weight 1/m_b: together they are one solid thing, so what they hide is
    /// taken for a union (see [`BODY_EPSILON`]).
    pub(super) bodies: Vec<SphereBlocker>,
    /// Spheres of the scene itself, whose overlap is in part by chance: weighed at each point.
    pub(super) scattered: Vec<SphereBlocker>,
    /// m_b of the scattered ones.
    pub(super) multiplicities: Vec<f32>,
    /// The scattered ones of each object.
    pub(super) groups: Vec<Range<usize>>,
    /// For each instance of the world the owner of its first primitive, and whether primitives are counted on.
    owners: Vec<(f32, bool)>,
}

impl Bodies {
    /// Fits a set of `count` spheres to each mesh of a scene.
    pub(super) fn fit(scene: &Scene, count: usize, progress: &dyn Progress) -> Self {
        let mut bodies = Self::default();
        let total = scene.object_count() as u64;
        for object in 0..scene.object_count() {
            progress.report("spheres fitted to meshes", object as u64, total);
            let Some(surface) = scene.rest_surface(object) else { continue };
            let name = scene.object_name(object);
            if count == 0 {
                continue;
            }
            let (low, high) = bounds(&surface.mesh.positions);
            let extent = high - low;
            if extent.min_element() <= FLAT * extent.max_element() {
                bodies.without.push(format!("{name} is flat and throws no shadow"));
                continue;
            }
            let options = SphereFitOptions { spheres: count, ..SphereFitOptions::default() };
            match SphereSet::fit_surface(&surface, &options) {
                Ok((set, _)) => {
                    let multiplicities = multiplicities(&set.spheres().collect::<Vec<_>>(), Overlap::Any);
                    bodies.bodies.push(Body { object, set, multiplicities });
                }
                Err(error) => bodies.without.push(format!("{name} throws no shadow: {error}")),
            }
        }
        bodies
    }

    /// Learns how the spheres of a frame overlap.
    pub(super) fn look_at(&mut self, frame: &Frame) {
        for posed in &frame.objects {
            if let Some(Geometry::Spheres(tracer)) = frame
                .world
                .instances()
                .get(posed.instances.start as usize)
                .map(|instance| instance.geometry.as_ref())
            {
                let spheres: Vec<(Vec3, f32)> =
                    tracer.spheres().iter().map(|s| (s.center, s.radius)).collect();
                self.spheres.push((posed.object, multiplicities(&spheres, Overlap::Crossing)));
            }
        }
    }

    /// All blockers where they are in a frame.
    pub(super) fn pose(&self, frame: &Frame, attenuation: bool) -> Blockers {
        let mut blockers = Blockers {
            bodies: Vec::new(),
            scattered: Vec::new(),
            multiplicities: Vec::new(),
            groups: Vec::new(),
            owners: vec![(-1.0, false); frame.world.instances().len()],
        };
        let mut owner = 0.0;
        for posed in &frame.objects {
            if let Some(body) = self.bodies.iter().find(|body| body.object == posed.object) {
                let set = body.set.posed(&posed.joints);
                for place in &posed.places {
                    for (sphere, multiplicity) in set.spheres().zip(&body.multiplicities) {
                        let weight = if attenuation { 1.0 / multiplicity } else { 1.0 };
                        blockers.bodies.push(blocker(place, sphere, owner, weight));
                    }
                }
                // Copies share an owner: a point inside a sphere of another copy is as good as inside its own.
                for instance in posed.instances.clone() {
                    blockers.owners[instance as usize] = (owner, false);
                }
                owner += 1.0;
            } else if let Some((_, multiplicities)) =
                self.spheres.iter().find(|(object, _)| *object == posed.object)
            {
                for instance in posed.instances.clone() {
                    let shown = &frame.world.instances()[instance as usize];
                    let Geometry::Spheres(tracer) = shown.geometry.as_ref() else { continue };
                    blockers.owners[instance as usize] = (owner, true);
                    let first = blockers.scattered.len();
                    let spheres: Vec<(Vec3, f32)> =
                        tracer.spheres().iter().map(|s| (s.center, s.radius)).collect();
                    for &sphere in &spheres {
                        blockers.scattered.push(blocker(&shown.transform.open, sphere, owner, 1.0));
                        owner += 1.0;
                    }
                    blockers.groups.push(first..blockers.scattered.len());
                    if spheres.len() <= MOST_LIVE {
                        blockers.multiplicities.extend(self::multiplicities(&spheres, Overlap::Crossing));
                    } else {
                        blockers.multiplicities.extend(multiplicities);
                    }
                }
            }
        }
        blockers
    }
}

fn blocker(place: &Affine3A, (center, radius): (Vec3, f32), owner: f32, weight: f32) -> SphereBlocker {
    let scale = place.matrix3.determinant().abs().cbrt();
    SphereBlocker { center: axes(place.transform_point3(center)), radius: radius * scale, weight, owner }
}

impl Blockers {
    /// How many spheres there are.
    pub(super) fn len(&self) -> usize {
        self.bodies.len() + self.scattered.len()
    }

    /// The body that a hit belongs to; negative for none.
    #[inline]
    pub(super) fn owner(&self, hit: &Hit) -> f32 {
        let (owner, by_primitive) = self.owners[hit.instance as usize];
        if by_primitive { owner + hit.primitive as f32 } else { owner }
    }
}

fn bounds(positions: &[Vec3]) -> (Vec3, Vec3) {
    positions.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), &p| (low.min(p), high.max(p)))
}

/// Which overlaps count as structure and not as chance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Overlap {
    /// Of all spheres: they fill one body.
    Any,
    /// Of spheres that cross in space. One behind another that it does not touch is hidden by chance, which the sum of
    /// logarithms allows for.
    Crossing,
}

impl Overlap {
    fn counts(self, a: (Vec3, f32), b: (Vec3, f32)) -> bool {
        /// Spheres that barely touch cross nowhere that matters.
        const CROSSING: f32 = 0.95;
        self == Overlap::Any || a.0.distance(b.0) < CROSSING * (a.1 + b.1)
    }
}

/// m_b of each sphere: the mean over six directions and three distances around them all, which the seen one is near.
fn multiplicities(spheres: &[(Vec3, f32)], overlap: Overlap) -> Vec<f32> {
    /// Distances from the middle, in bounding radii.
    const DISTANCES: [f32; 3] = [1.2, 2.0, 4.0];
    if spheres.is_empty() {
        return Vec::new();
    }
    let low = spheres.iter().map(|(c, r)| *c - *r).fold(Vec3::INFINITY, Vec3::min);
    let high = spheres.iter().map(|(c, r)| *c + *r).fold(Vec3::NEG_INFINITY, Vec3::max);
    let (middle, radius) = (0.5 * (low + high), 0.5 * (high - low).length());
    let views: Vec<Vec<Cap>> = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z]
        .iter()
        .flat_map(|&axis| DISTANCES.map(|d| middle + axis * (d * radius)))
        .map(|from| {
            // A cap without a direction cannot be: the points are outside of all spheres.
            let cap = |(center, r): &(Vec3, f32)| {
                Cap::of_sphere(*center - from, *r).unwrap_or(Cap { direction: Vec3::X, half_angle: 0.0 })
            };
            spheres.iter().map(cap).collect()
        })
        .collect();
    (0..spheres.len())
        .into_par_iter()
        .map(|b| {
            let near: Vec<usize> =
                (0..spheres.len()).filter(|&j| overlap.counts(spheres[b], spheres[j])).collect();
            let seen = views.iter().map(|caps| {
                let cap = caps[b];
                let others = near.iter().map(|&j| &caps[j]).filter(|other| touches(&cap, other));
                let shared: f32 = others.map(|other| cap.overlap(other)).sum();
                (shared / cap.solid_angle().max(f32::MIN_POSITIVE)).max(1.0)
            });
            seen.sum::<f32>() / views.len() as f32
        })
        .collect()
}

/// Whether two caps may overlap at all; cheaper than how much.
fn touches(a: &Cap, b: &Cap) -> bool {
    a.direction.distance_squared(b.direction) < (a.half_angle + b.half_angle).powi(2)
}
