//! Pixels between four points where light is known, sixteen pixels side by side.
//!
//! A corner counts for a pixel as far as it is near it (bilinear) and on the same surface: the same body, a similar normal,
//! close to the tangent plane. A pixel is shaded if the corners that count carry enough weight, and if the irradiances
//! that they give *for the pixel's own normal* differ by no more than the tolerance; otherwise it stays open.

use std::f32::consts::PI;

use glam::Vec3;
use halflight_sh::batch::{Lanes, WIDTH};
use halflight_sh::{Kernel, Lane, Sh, Simd, Zh, batch};

use super::shade::Kernels;
use super::solve::LogLight;
use crate::gbuffer::{GBuffer, Look, PixelPoint};
use crate::sh_light::{Colors, axes};

/// Distance of a corner from the tangent plane at most, in parts of its distance.
const OFF_PLANE: f32 = 0.35;
/// Cosine between the normals of a pixel and a corner at least.
const TURNED: f32 = 0.8;
/// What the corners that count must weigh together: with less, light would be carried past the last of them, which shows
/// at contacts.
const ENOUGH: f32 = 0.9;

/// A point where light is known.
#[derive(Clone, Copy)]
pub(super) struct Corner<'a, const ORDER: usize> {
    pub(super) point: &'a PixelPoint,
    pub(super) light: &'a Colors<ORDER>,
    /// The same in two parts, where lobes may be added as logarithms.
    pub(super) apart: Option<&'a LogLight<ORDER>>,
}

/// Four corners (upper left, upper right, lower left, lower right) and pixels between them that wait to be shaded.
pub(super) struct Cell<'a, const ORDER: usize> {
    simd: Simd,
    kernels: &'a Kernels<ORDER>,
    corners: [Option<Corner<'a, ORDER>>; 4],
    tolerance: f32,
    count: usize,
    places: [usize; WIDTH],
    /// What each pixel shows, and the cosine between its normal and the direction to the eye if that has a lobe.
    looks: [Option<(&'a Look, f32)>; WIDTH],
    lanes: PixelLanes,
}

/// What the kernel needs of sixteen pixels.
#[derive(Default)]
struct PixelLanes {
    position: [Lanes; 3],
    geometric_normal: [Lanes; 3],
    /// In the frame of the harmonics.
    normal: [Lanes; 3],
    mirrored: [Lanes; 3],
    instance: Lanes,
    /// Where in the cell, from 0 to 1.
    fraction: [Lanes; 2],
}

/// What comes out: integrals of the light with the cosine, and with lobe and cosine, negative weight where corners do not
/// tell.
#[derive(Default)]
struct Found {
    weight: Lanes,
    irradiance: [Lanes; 3],
    gathered: [Lanes; 3],
}

/// For lobes that are added as logarithms: the sum of them all, and the light.
struct Added<const ORDER: usize> {
    log: Sh<ORDER, Lanes>,
    lit: [Sh<ORDER, Lanes>; 3],
}

/// What is to be integrated besides the cosine.
enum Lobe<const ORDER: usize> {
    Nothing,
    /// A lobe, whose product with the cosine it is.
    Product(Zh<ORDER>),
    /// The logarithms of a lobe and of the cosine.
    Logarithms([Zh<ORDER>; 2]),
}

impl<'a, const ORDER: usize> Cell<'a, ORDER> {
    pub(super) fn new(
        simd: Simd,
        kernels: &'a Kernels<ORDER>,
        corners: [Option<Corner<'a, ORDER>>; 4],
        tolerance: f32,
    ) -> Self {
        Self {
            simd,
            kernels,
            corners,
            tolerance,
            count: 0,
            places: [0; WIDTH],
            looks: [None; WIDTH],
            lanes: PixelLanes::default(),
        }
    }

    /// Adds a pixel; true if the cell has to be shaded before the next one.
    pub(super) fn push(
        &mut self,
        view: &'a GBuffer,
        point: &PixelPoint,
        place: usize,
        fraction: [f32; 2],
    ) -> bool {
        let (i, lanes, look) = (self.count, &mut self.lanes, view.look_of(point));
        let mut facing = 1.0;
        let normal = axes(point.normal);
        for axis in 0..3 {
            lanes.position[axis].0[i] = point.position[axis];
            lanes.geometric_normal[axis].0[i] = point.geometric_normal[axis];
            lanes.normal[axis].0[i] = normal[axis];
        }
        if look.material.specular != Vec3::ZERO {
            let towards_eye = view.towards_eye(point);
            facing = point.normal.dot(towards_eye);
            let mirrored = axes(mirrored(point.normal, towards_eye));
            for axis in 0..3 {
                lanes.mirrored[axis].0[i] = mirrored[axis];
            }
        }
        lanes.instance.0[i] = point.hit.instance as f32;
        lanes.fraction[0].0[i] = fraction[0];
        lanes.fraction[1].0[i] = fraction[1];
        (self.places[i], self.looks[i]) = (place, Some((look, facing)));
        self.count += 1;
        self.count == WIDTH
    }

    /// Shades the pixels that were added; gives the place and the radiance of each that the corners tell enough of.
    pub(super) fn shade(&mut self, mut take: impl FnMut(usize, Vec3)) {
        let looks = &self.looks[..self.count];
        let mut done = [false; WIDTH];
        let mut diffuse_too = false;
        // One exponent at a time: mostly there is only one, or none.
        for first in 0..looks.len() {
            let Some(exponent) = glossy(looks[first]).filter(|_| !done[first]) else { continue };
            let found = self.run(looks[first]);
            for i in first..looks.len() {
                if glossy(looks[i]) == Some(exponent) {
                    done[i] = true;
                    self.give(i, &found, &mut take);
                }
            }
        }
        for (i, look) in looks.iter().enumerate() {
            diffuse_too |= look.is_some() && !done[i];
        }
        if diffuse_too {
            let found = self.run(None);
            for i in (0..looks.len()).filter(|&i| !done[i]) {
                self.give(i, &found, &mut take);
            }
        }
        self.count = 0;
    }

    fn run(&self, first: Option<(&Look, f32)>) -> Found {
        let mut found = Found::default();
        let lobe = match first.map(|(look, _)| &look.material) {
            None => Lobe::Nothing,
            Some(material) if self.kernels.by_logarithms(material) => {
                Lobe::Logarithms(self.kernels.log_lobe(material.exponent))
            }
            Some(material) => Lobe::Product(self.kernels.lobe(material.exponent)),
        };
        if let Lobe::Logarithms(_) = lobe {
            let zero = Sh::constant(0.0).map(Lanes::splat);
            let mut added = Added { log: zero, lit: [zero; 3] };
            self.simd.run(Between { cell: self, lobe: &lobe, found: &mut found, added: Some(&mut added) });
            let mut joined = [zero];
            batch::exponential(self.simd, self.kernels.exponential, &[added.log], &mut joined);
            for (gathered, lit) in found.gathered.iter_mut().zip(&added.lit) {
                let mut integral = [Lanes::default()];
                batch::dot(self.simd, &joined, std::slice::from_ref(lit), &mut integral);
                *gathered = integral[0];
            }
            for (i, look) in self.looks[..self.count].iter().enumerate() {
                let energy =
                    |(look, facing): &(&Look, f32)| self.kernels.energy(look.material.exponent, *facing);
                let energy = PI * look.as_ref().map_or(0.0, energy);
                found.gathered.iter_mut().for_each(|gathered| gathered.0[i] *= energy);
            }
        } else {
            self.simd.run(Between { cell: self, lobe: &lobe, found: &mut found, added: None });
        }
        found
    }

    fn give(&self, i: usize, found: &Found, take: &mut impl FnMut(usize, Vec3)) {
        let Some((look, _)) = self.looks[i].filter(|_| found.weight.0[i] > 0.0) else { return };
        let of = |lanes: &[Lanes; 3]| Vec3::new(lanes[0].0[i], lanes[1].0[i], lanes[2].0[i]);
        take(self.places[i], self.kernels.radiance(look, of(&found.irradiance), of(&found.gathered)));
    }
}

/// The exponent of a pixel's lobe, if it has one.
fn glossy(look: Option<(&Look, f32)>) -> Option<f32> {
    let material = &look?.0.material;
    (material.specular != Vec3::ZERO).then_some(material.exponent)
}

/// The direction of a perfect mirror.
pub(super) fn mirrored(normal: Vec3, towards_eye: Vec3) -> Vec3 {
    2.0 * normal.dot(towards_eye) * normal - towards_eye
}

struct Between<'a, 'b, const ORDER: usize> {
    cell: &'b Cell<'a, ORDER>,
    lobe: &'b Lobe<ORDER>,
    found: &'b mut Found,
    added: Option<&'b mut Added<ORDER>>,
}

impl<const ORDER: usize> Kernel for Between<'_, '_, ORDER> {
    type Output = ();
    #[inline(always)]
    fn run<V: Lane>(mut self) {
        let (lanes, kernels) = (&self.cell.lanes, self.cell.kernels);
        let (zero, one) = (V::splat(0.0), V::splat(1.0));
        for part in (0..WIDTH).step_by(V::N) {
            let (position, normal) = (load::<V>(&lanes.position, part), load::<V>(&lanes.normal, part));
            let facing = load::<V>(&lanes.geometric_normal, part);
            let instance = V::load(&lanes.instance.0[part..]);
            let (x, y) = (V::load(&lanes.fraction[0].0[part..]), V::load(&lanes.fraction[1].0[part..]));
            let cosine = turned::<ORDER, V>(&kernels.cosine, normal);
            let lobe = match self.lobe {
                Lobe::Product(lobe) => {
                    turned::<ORDER, V>(lobe, load::<V>(&lanes.mirrored, part)).product_inlined(&cosine)
                }
                _ => Sh::zero(),
            };
            let mut weights = zero;
            let (mut sum, mut gathered) = ([zero; 3], [zero; 3]);
            let mut shares = [zero; 4];
            let (mut least, mut most) = ([V::splat(f32::MAX); 3], [V::splat(-f32::MAX); 3]);
            for (number, corner) in self.cell.corners.iter().enumerate() {
                let Some(corner) = corner else { continue };
                let across = if number & 1 == 1 { x } else { one - x };
                let share = across * if number & 2 == 2 { y } else { one - y };
                let weight = alike(corner.point, &position, &facing, instance, share);
                let counts = weight.gt(zero);
                for color in 0..3 {
                    let irradiance = integral(&corner.light[color], &cosine);
                    sum[color] = weight.mul_add(irradiance, sum[color]);
                    least[color] = V::select(counts, least[color].min(irradiance), least[color]);
                    most[color] = V::select(counts, most[color].max(irradiance), most[color]);
                }
                if let Lobe::Product(_) = self.lobe {
                    for color in 0..3 {
                        gathered[color] =
                            weight.mul_add(integral(&corner.light[color], &lobe), gathered[color]);
                    }
                }
                weights = weights + weight;
                shares[number] = weight;
            }
            let spread = (most[0] - least[0]) + (most[1] - least[1]) + (most[2] - least[2]);
            let enough = V::select(weights.gt(V::splat(ENOUGH)), one, V::splat(-1.0));
            let rough = spread.gt(V::splat(3.0 * self.cell.tolerance));
            V::select(rough, V::splat(-1.0), enough).store(&mut self.found.weight.0[part..]);
            let scale = one.over(weights.max(V::splat(f32::MIN_POSITIVE)));
            for color in 0..3 {
                (sum[color] * scale).store(&mut self.found.irradiance[color].0[part..]);
                (gathered[color] * scale).store(&mut self.found.gathered[color].0[part..]);
            }
            if let (Lobe::Logarithms([lobe, cosine]), Some(added)) = (self.lobe, &mut self.added) {
                let mut log = turned::<ORDER, V>(lobe, load::<V>(&lanes.mirrored, part));
                log += turned::<ORDER, V>(cosine, normal);
                let mut lit = [Sh::<ORDER, V>::zero(); 3];
                for (corner, share) in self.cell.corners.iter().zip(shares) {
                    let Some(apart) = corner.and_then(|corner| corner.apart) else { continue };
                    let share = share * scale;
                    add(&mut log, share, &apart.log);
                    for color in 0..3 {
                        add(&mut lit[color], share, &apart.lit[color]);
                    }
                }
                store(&log, &mut added.log, part);
                for color in 0..3 {
                    store(&lit[color], &mut added.lit[color], part);
                }
            }
        }
    }
}

/// Adds shares of one vector.
#[inline(always)]
fn add<const ORDER: usize, V: Lane>(sum: &mut Sh<ORDER, V>, share: V, sh: &Sh<ORDER>) {
    for (sum, value) in sum.coefficients_mut().iter_mut().zip(sh.coefficients()) {
        *sum = share.mul_add(V::splat(*value), *sum);
    }
}

#[inline(always)]
fn store<const ORDER: usize, V: Lane>(sh: &Sh<ORDER, V>, to: &mut Sh<ORDER, Lanes>, part: usize) {
    for (value, lanes) in sh.coefficients().iter().zip(to.coefficients_mut()) {
        value.store(&mut lanes.0[part..]);
    }
}

/// `share` where light at a corner may stand for light at pixels, 0 elsewhere.
#[inline(always)]
fn alike<V: Lane>(corner: &PixelPoint, position: &[V; 3], facing: &[V; 3], instance: V, share: V) -> V {
    let (at, normal) = (corner.position.to_array(), corner.geometric_normal.to_array());
    let mut off = V::splat(0.0);
    let (mut apart, mut aligned) = (off, off);
    for axis in 0..3 {
        let between = V::splat(at[axis]) - position[axis];
        off = between.mul_add(facing[axis], off);
        apart = between.mul_add(between, apart);
        aligned = facing[axis].mul_add(V::splat(normal[axis]), aligned);
    }
    let zero = V::splat(0.0);
    let other = instance - V::splat(corner.hit.instance as f32);
    let share = V::select((other * other).gt(V::splat(0.25)), zero, share);
    let share = V::select(aligned.gt(V::splat(TURNED)), share, zero);
    V::select((off * off).gt(apart * V::splat(OFF_PLANE * OFF_PLANE)), zero, share)
}

#[inline(always)]
fn load<V: Lane>(lanes: &[Lanes; 3], part: usize) -> [V; 3] {
    [V::load(&lanes[0].0[part..]), V::load(&lanes[1].0[part..]), V::load(&lanes[2].0[part..])]
}

/// A zonal function turned to many directions.
#[inline(always)]
fn turned<const ORDER: usize, V: Lane>(zonal: &Zh<ORDER>, directions: [V; 3]) -> Sh<ORDER, V> {
    let mut wide = Zh([V::splat(0.0); ORDER]);
    for l in 0..ORDER {
        wide.0[l] = V::splat(zonal.0[l]);
    }
    wide.to_direction(directions)
}

/// ∫ of one light with many kernels.
#[inline(always)]
fn integral<const ORDER: usize, V: Lane>(light: &Sh<ORDER>, kernel: &Sh<ORDER, V>) -> V {
    let mut sums = [V::splat(0.0); 2];
    for (i, (light, kernel)) in light.coefficients().iter().zip(kernel.coefficients()).enumerate() {
        sums[i % 2] = kernel.mul_add(V::splat(*light), sums[i % 2]);
    }
    sums[0] + sums[1]
}
