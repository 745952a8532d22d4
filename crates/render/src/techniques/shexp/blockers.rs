//! The spheres that block light: those that are in the scene, and those that stand for its meshes.

use std::path::PathBuf;

use glam::{Affine3A, Vec3};
use halflight_scene::{Frame, Scene};
use halflight_sh::attenuation::Cap;
use halflight_sh::batch::SphereBlocker;
use halflight_shape::{SphereFitOptions, SphereSet, SphereTree};
use halflight_trace::Geometry;
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

/// Squares of stretches that differ by more than this part of their sum are uneven.
const UNEVEN: f32 = 0.02;

/// So few spheres are not worth a walk through their tree.
const FEW: usize = 64;
/// The owner of a sphere that stands for several, which no point has.
const NOBODY: f32 = -4.0;

/// The sphere sets that are stored beside the files of a scene, under their names. One that is damaged is as good as none:
/// it is fitted anew.
fn stored_beside(scene: &Scene, notes: &mut Vec<String>) -> Vec<(PathBuf, SphereSet)> {
    let beside = scene.files().iter().map(|file| file.with_extension("spheres"));
    let mut sets = Vec::new();
    for path in beside.filter(|path| path.is_file()) {
        match SphereSet::load(&path) {
            Ok(set) => sets.push((path, set)),
            Err(error) => notes.push(format!("spheres are fitted anew: {error}")),
        }
    }
    sets
}

/// What stands for an object of the scene.
struct Body {
    object: usize,
    set: SphereSet,
    multiplicities: Vec<f32>,
    /// From where the spheres were fitted, which is stretched as the object was, to the object's own space.
    unstretched: Option<Affine3A>,
}

/// An object that is spheres already.
struct Scattered {
    object: usize,
    multiplicities: Vec<f32>,
    /// Over the spheres where they were at first; posed anew in every frame.
    tree: SphereTree,
}

/// What outlives a frame: the fitted sets, and how much the spheres of each object overlap.
#[derive(Default)]
pub(super) struct Bodies {
    bodies: Vec<Body>,
    /// Of the objects that are spheres already.
    spheres: Vec<Scattered>,
    /// Names of objects that throw no shadow, and why; and where spheres are from that were not fitted here.
    pub(super) notes: Vec<String>,
}

/// The blockers of one frame.
pub(super) struct Blockers {
    /// Spheres that fill bodies, each of weight 1/m_b: together they are one solid thing, so what they hide is
    /// taken for a union (see [`BODY_EPSILON`]).
    pub(super) bodies: Vec<SphereBlocker>,
    /// Spheres of the scene itself, whose overlap is in part by chance: weighed at each point.
    pub(super) groups: Vec<Group>,
    /// For each instance of the world the owner of its first primitive, and whether primitives are counted on.
    owners: Vec<(f32, bool)>,
}

/// The scattered spheres of an object.
pub(super) struct Group {
    spheres: Vec<SphereBlocker>,
    /// m_b of each.
    multiplicities: Vec<f32>,
    /// In the frame of the harmonics.
    tree: SphereTree,
}

impl Group {
    /// Adds the spheres, or single ones for groups of them that are seen from everywhere in a ball under a sine of at most
    /// `cut`; and how much each overlaps with others.
    pub(super) fn choose(
        &self,
        (middle, around): (Vec3, f32),
        cut: f32,
        spheres: &mut Vec<SphereBlocker>,
        multiplicities: &mut Vec<f32>,
    ) {
        if cut <= 0.0 || self.spheres.len() <= FEW {
            spheres.extend_from_slice(&self.spheres);
            multiplicities.extend_from_slice(&self.multiplicities);
            return;
        }
        self.tree.cut_around(axes(middle).into(), around, cut, |node| match node.sphere {
            Some(sphere) => {
                spheres.push(self.spheres[sphere as usize]);
                multiplicities.push(self.multiplicities[sphere as usize]);
            }
            None => {
                // The overlap within is in its radius already.
                spheres.push(SphereBlocker {
                    center: node.center.into(),
                    radius: node.radius,
                    weight: 1.0,
                    owner: NOBODY,
                });
                multiplicities.push(1.0);
            }
        });
    }
}

impl Bodies {
    /// Fits a set of `count` spheres to each mesh of a scene.
    pub(super) fn fit(scene: &Scene, frame: &Frame, count: usize, progress: &dyn Progress) -> Self {
        let mut bodies = Self::default();
        let stored = stored_beside(scene, &mut bodies.notes);
        let total = scene.object_count() as u64;
        for object in 0..scene.object_count() {
            progress.report("spheres fitted to meshes", object as u64, total);
            let name = scene.object_name(object);
            let posed = frame.objects.iter().find(|posed| posed.object == object);
            let Some(mut surface) = scene.rest_surface(object) else {
                bodies.notes.extend(posed.and_then(|posed| throws_none(frame, posed.instances.start, name)));
                continue;
            };
            if count == 0 {
                continue;
            }
            let (low, high) = bounds(&surface.mesh.positions);
            let extent = high - low;
            if extent.min_element() <= FLAT * extent.max_element() {
                bodies.notes.push(format!("{name} is flat and throws no shadow"));
                continue;
            }
            // Stored spheres are of the mesh as it is, and do not fit one that is stretched.
            let place = posed.and_then(|posed| posed.places.first());
            let mut unstretched = None;
            if let Some(place) = place.filter(|place| is_uneven(place)) {
                if surface.influences.is_empty() {
                    let stretch = Affine3A::from_mat3(place.matrix3.into());
                    surface.mesh.positions.iter_mut().for_each(|p| *p = stretch.transform_point3(*p));
                    unstretched = Some(stretch.inverse());
                } else {
                    bodies
                        .notes
                        .push(format!("{name} is stretched unevenly; the spheres that stand for it are not"));
                }
            }
            if let Some((path, set)) = stored.iter().find(|(_, set)| set.mesh_hash == surface.hash()) {
                if set.len() == count {
                    bodies.notes.push(format!("the spheres of {name} are from {}", path.display()));
                    bodies.add(object, set.clone(), unstretched);
                    continue;
                }
                bodies.notes.push(format!(
                    "{} has {} spheres for {name}, not {count}: they are fitted anew (shexp.spheres = {} takes them)",
                    path.display(),
                    set.len(),
                    set.len()
                ));
            }
            let options = SphereFitOptions { spheres: count, ..SphereFitOptions::default() };
            match SphereSet::fit_surface(&surface, &options) {
                Ok((set, _)) => bodies.add(object, set, unstretched),
                Err(error) => bodies.notes.push(format!("{name} throws no shadow: {error}")),
            }
        }
        bodies
    }

    fn add(&mut self, object: usize, set: SphereSet, unstretched: Option<Affine3A>) {
        let multiplicities = multiplicities(&set.spheres().collect::<Vec<_>>(), Overlap::Any);
        self.bodies.push(Body { object, set, multiplicities, unstretched });
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
                let (centers, radii) = spheres.iter().copied().unzip();
                let set = SphereSet { centers, radii, ..SphereSet::default() };
                self.spheres.push(Scattered {
                    object: posed.object,
                    multiplicities: multiplicities(&spheres, Overlap::Crossing),
                    tree: SphereTree::build(&set),
                });
            }
        }
    }

    /// All blockers where they are in a frame.
    pub(super) fn pose(&self, frame: &Frame, attenuation: bool) -> Blockers {
        let mut blockers = Blockers {
            bodies: Vec::new(),
            groups: Vec::new(),
            owners: vec![(-1.0, false); frame.world.instances().len()],
        };
        let mut owner = 0.0;
        for posed in &frame.objects {
            if let Some(body) = self.bodies.iter().find(|body| body.object == posed.object) {
                let set = body.set.posed(&posed.joints);
                for place in &posed.places {
                    let place = &body.unstretched.map_or(*place, |back| *place * back);
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
            } else if let Some(known) = self.spheres.iter().find(|known| known.object == posed.object) {
                for instance in posed.instances.clone() {
                    let shown = &frame.world.instances()[instance as usize];
                    let Geometry::Spheres(tracer) = shown.geometry.as_ref() else { continue };
                    blockers.owners[instance as usize] = (owner, true);
                    let spheres: Vec<(Vec3, f32)> =
                        tracer.spheres().iter().map(|s| (s.center, s.radius)).collect();
                    let mut group = Group {
                        spheres: Vec::with_capacity(spheres.len()),
                        multiplicities: if spheres.len() <= MOST_LIVE {
                            multiplicities(&spheres, Overlap::Crossing)
                        } else {
                            known.multiplicities.clone()
                        },
                        tree: known.tree.clone(),
                    };
                    for &sphere in &spheres {
                        group.spheres.push(blocker(&shown.transform.open, sphere, owner, 1.0));
                        owner += 1.0;
                    }
                    let centers: Vec<Vec3> = group.spheres.iter().map(|s| s.center.into()).collect();
                    let radii: Vec<f32> = group.spheres.iter().map(|s| s.radius).collect();
                    group.tree.pose(&centers, &radii);
                    blockers.groups.push(group);
                }
            }
        }
        blockers
    }
}

/// Why an object that is no mesh throws no shadow, if it does not.
fn throws_none(frame: &Frame, instance: u32, name: &str) -> Option<String> {
    let instance = frame.world.instances().get(instance as usize)?;
    match instance.geometry.as_ref() {
        Geometry::Spheres(_) if is_uneven(&instance.transform.open) => {
            Some(format!("{name} is stretched unevenly; as a blocker it is spheres of the mean size"))
        }
        Geometry::Spheres(_) | Geometry::HeightField(_) | Geometry::Rectangle(_) => None,
        _ => Some(format!("{name} is neither mesh nor spheres nor height field, and throws no shadow")),
    }
}

/// Whether a transform makes ellipsoids of spheres.
fn is_uneven(place: &Affine3A) -> bool {
    let squares = place.matrix3.transpose() * place.matrix3;
    let (size, mut apart) = (squares.x_axis.x + squares.y_axis.y + squares.z_axis.z, 0.0f32);
    for (i, column) in [squares.x_axis, squares.y_axis, squares.z_axis].into_iter().enumerate() {
        for j in 0..3 {
            apart = apart.max((column[j] - if i == j { size / 3.0 } else { 0.0 }).abs());
        }
    }
    apart > UNEVEN * size
}

fn blocker(place: &Affine3A, (center, radius): (Vec3, f32), owner: f32, weight: f32) -> SphereBlocker {
    let scale = place.matrix3.determinant().abs().cbrt();
    SphereBlocker { center: axes(place.transform_point3(center)), radius: radius * scale, weight, owner }
}

impl Blockers {
    /// How many spheres there are.
    pub(super) fn len(&self) -> usize {
        self.bodies.len() + self.groups.iter().map(|group| group.spheres.len()).sum::<usize>()
    }

    /// The body that a primitive of an instance belongs to; negative for none.
    #[inline]
    pub(super) fn owner(&self, instance: u32, primitive: u32) -> f32 {
        let (owner, by_primitive) = self.owners[instance as usize];
        if by_primitive { owner + primitive as f32 } else { owner }
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

#[cfg(test)]
mod tests {
    use halflight_sh::batch::{self, Lanes, PointLanes};
    use halflight_sh::{BlockerTable, ClosedForm, Exponential, Sh, Simd, Zh};

    use super::*;

    /// A body of overlapping balls.
    fn filled() -> Vec<(Vec3, f32)> {
        let mut spheres = Vec::new();
        for i in 0..5 * 5 * 5 {
            let center = 0.3 * (Vec3::new((i % 5) as f32, (i / 5 % 5) as f32, (i / 25) as f32) - 2.0);
            if center.length() < 0.61 {
                spheres.push((center, 0.4));
            }
        }
        spheres
    }

    /// The same by many directions.
    fn open_by_rays(spheres: &[(Vec3, f32)], from: Vec3) -> f32 {
        let (count, normal) = (20_000, -from.normalize());
        let (mut all, mut open) = (0.0f32, 0.0f32);
        for i in 0..count {
            let y = 1.0 - (2 * i + 1) as f32 / count as f32;
            let (sin, cos) = (i as f32 * 2.399_963_2).sin_cos();
            let direction = Vec3::new(cos, 0.0, sin) * (1.0 - y * y).sqrt() + Vec3::Y * y;
            let cosine = direction.dot(normal).max(0.0);
            let meets = |&(center, radius): &(Vec3, f32)| {
                let to = center - from;
                to.dot(direction) > 0.0 && to.cross(direction).length() < radius
            };
            all += cosine;
            open += if spheres.iter().any(meets) { 0.0 } else { cosine };
        }
        open / all
    }

    /// The part of the irradiance from a white sky that gets past blockers to a point that faces them.
    fn open(table: &BlockerTable<4>, blockers: &[SphereBlocker], from: Vec3) -> f32 {
        let mut point = PointLanes::default();
        for axis in 0..3 {
            point.position[axis] = Lanes::splat(axes(from)[axis]);
            point.normal[axis] = Lanes::splat(axes(-from.normalize())[axis]);
        }
        point.owner = Lanes::splat(-1.0);
        let zero = Sh::<4>::zero().map(Lanes::splat);
        let (mut log, mut visible) = ([zero], [zero]);
        batch::accumulate_spheres(Simd::Baseline, table, &[point], blockers, &mut log);
        batch::exponential(Simd::Baseline, Exponential::default(), &log, &mut visible);
        let cosine: Zh<4> = Zh::clamped_cosine();
        batch::lane(&visible[0], 0).dot(&cosine.to_direction(axes(-from.normalize()))) / std::f32::consts::PI
    }

    #[test]
    fn spheres_that_fill_one_body_hide_what_their_union_hides() {
        let spheres = filled();
        let body = BlockerTable::closed_form(ClosedForm::Fixed { epsilon: BODY_EPSILON });
        let multiplicities = multiplicities(&spheres, Overlap::Any);
        let blockers = |weight: &dyn Fn(usize) -> f32| -> Vec<SphereBlocker> {
            let blocker = |(i, &(center, radius)): (usize, &(Vec3, f32))| SphereBlocker {
                center: axes(center),
                radius,
                weight: weight(i),
                owner: 0.0,
            };
            spheres.iter().enumerate().map(blocker).collect()
        };
        for distance in [1.5f32, 2.0, 4.0] {
            let from = Vec3::new(0.6, 0.64, 0.48) * distance;
            let exact = open_by_rays(&spheres, from);
            let found = open(&body, &blockers(&|i| 1.0 / multiplicities[i]), from);
            let single = open(&BlockerTable::new(), &blockers(&|i| 1.0 / multiplicities[i]), from);
            println!(
                "{distance}: {exact:.3}, with ε of a body {found:.3}, with the table of single spheres {single:.3}"
            );
            assert!((found - exact).abs() < 0.12, "{distance}: {found} {exact}");
            assert!((found - exact).abs() < (single - exact).abs(), "{distance}: {found} {single} {exact}");
        }
    }

    #[test]
    fn only_stretches_that_differ_are_uneven() {
        let turned = Affine3A::from_rotation_y(0.7) * Affine3A::from_scale(Vec3::splat(3.0));
        assert!(!is_uneven(&turned) && !is_uneven(&Affine3A::IDENTITY));
        assert!(is_uneven(&(turned * Affine3A::from_scale(Vec3::new(1.0, 1.1, 1.0)))));
        assert!(is_uneven(&Affine3A::from_mat3(glam::Mat3::from_cols(
            Vec3::X,
            Vec3::new(0.4, 1.0, 0.0),
            Vec3::Z
        ))));
    }
}
