//! Queries of the seed's network as a field, in the unit sphere.
//!
//! The network knows points in and around the unit sphere: a ray from outside starts where it enters the sphere of radius
//! ρ = 1.02, and a hit beyond that sphere is none. ξ follows from φ: visible is φ < 0.95 δ. With e the point of entry and
//! t_e the distance to it, φ = t_e + f(e, ω) and ∇ₓφ = ∇f + (1 + ω · ∇f) ∇ₓt_e, ∇ₓt_e = −e/(e · ω).
//!
//! A ray costs all 1.8 million products: about a millisecond when asked alone, an eighth of that among many.

use std::cell::RefCell;

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::SeedNetwork;
use super::layers::{INPUTS, Layers, PANEL, Product};

/// The sizes of the seed's network.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SeedShape {
    /// Hidden layers.
    pub layers: usize,
    /// Neurons of each, a multiple of 32.
    pub width: usize,
    /// δ of the clamp, in units of the unit sphere.
    pub delta: f32,
}

impl SeedShape {
    /// What is wrong with the numbers, as a sentence.
    ///
    /// # Errors
    /// If a number is out of the range that its field names.
    pub fn check(&self) -> Result<(), String> {
        let SeedShape { layers, width, delta } = *self;
        let fits = (1..=16).contains(&layers)
            && (PANEL..=2048).contains(&width)
            && width.is_multiple_of(PANEL)
            && delta > 0.0
            && delta.is_finite();
        if fits {
            return Ok(());
        }
        Err(format!(
            "{layers} layers of {width} with δ = {delta}: expected 1 to 16 layers, a width that is a multiple of 32 up \
             to 2048, and a positive δ"
        ))
    }
}

/// Radius of the sphere in which the network is asked.
pub(crate) const BOUND: f32 = 1.02;
/// Part of δ beyond which nothing is seen.
const SEEN: f32 = 0.95;
/// What turns the distance to that part into a logit: a twentieth of δ, as far as a miss lies, is 6, where doubt ends.
const CERTAINTY: f32 = 120.0;
/// Rows of the products when one ray is asked.
const ROWS: usize = 8;

/// A hit in the unit sphere.
#[derive(Clone, Copy, Debug)]
pub(crate) struct UnitHit {
    pub(crate) t: f32,
    /// Where the network was asked.
    pub(crate) start: f32,
    pub(crate) logit: f32,
}

thread_local! {
    /// Activations of all layers for one ray.
    static TRAIL: RefCell<Vec<Vec<f32>>> = const { RefCell::new(Vec::new()) };
}

/// Where a ray of unit direction enters and leaves the bound; nothing if it passes by or lies behind.
fn crossing(x: Vec3, omega: Vec3) -> Option<(f32, f32)> {
    let b = x.dot(omega);
    // The distance of the line, without the difference of two large squares.
    let aside = (x - b * omega).length_squared();
    let half = BOUND * BOUND - aside;
    let half = if half > 0.0 { half.sqrt() } else { return None };
    (half > b).then_some(((-b - half).max(0.0), half - b))
}

impl SeedNetwork {
    /// The sizes.
    #[must_use]
    pub fn shape(&self) -> SeedShape {
        let hidden = &self.layers.list[..self.layers.list.len() - 1];
        SeedShape { layers: hidden.len(), width: hidden[0].outputs, delta: self.delta }
    }

    fn judge(&self, said: f32, (start, end): (f32, f32), t_max: f32) -> (Option<UnitHit>, f32) {
        let said = said.clamp(-self.delta, self.delta);
        let logit = CERTAINTY * (SEEN - said / self.delta);
        let t = start + said.max(0.0);
        let seen = logit > 0.0 && t > 0.0 && t <= end.min(t_max);
        (seen.then_some(UnitHit { t, start, logit }), logit)
    }

    /// The hit of one ray, and the logit.
    pub(crate) fn one(&self, x: Vec3, omega: Vec3, t_max: f32) -> (Option<UnitHit>, f32) {
        let Some(span) = crossing(x, omega).filter(|span| span.0 < t_max) else {
            return (None, f32::INFINITY);
        };
        let said = TRAIL.with_borrow_mut(|trail| {
            self.layers.trail(x + span.0 * omega, omega, trail);
            trail[self.layers.list.len()][0]
        });
        self.judge(said, span, t_max)
    }

    /// The hits of many rays, which are asked together.
    pub(crate) fn many(&self, rays: &[(Vec3, Vec3)]) -> Vec<(Option<UnitHit>, f32)> {
        let spans: Vec<_> = rays.iter().map(|&(x, omega)| crossing(x, omega)).collect();
        let asked: Vec<(Vec3, Vec3)> = rays
            .iter()
            .zip(&spans)
            .filter_map(|(&(x, omega), span)| Some((x + (*span)?.0 * omega, omega)))
            .collect();
        let mut said = self.layers.run(&asked).into_iter();
        spans
            .into_iter()
            .map(|span| match span.and_then(|span| Some((span, said.next()?))) {
                Some((span, said)) => self.judge(said, span, f32::INFINITY),
                None => (None, f32::INFINITY),
            })
            .collect()
    }

    /// ∇ₓφ of a ray that was asked from `start`, by exact differentiation of all layers.
    pub(crate) fn gradient(&self, x: Vec3, omega: Vec3, start: f32) -> Vec3 {
        let e = x + start * omega;
        let of_network = TRAIL.with_borrow_mut(|trail| {
            self.layers.trail(e, omega, trail);
            self.layers.by_position(trail)
        });
        let along = e.dot(omega);
        if start > 0.0 && along.abs() > 1e-6 {
            of_network - (1.0 + omega.dot(of_network)) / along * e
        } else {
            of_network
        }
    }

    /// Bytes held.
    pub(crate) fn memory_bytes(&self) -> usize {
        let of = |values: &Vec<f32>| size_of_val(values.as_slice());
        self.layers
            .list
            .iter()
            .map(|layer| of(&layer.values) + of(&layer.panels) + of(&layer.transposed))
            .sum()
    }

    /// v, g and bias of each layer.
    pub(crate) fn values(&self) -> impl Iterator<Item = &[f32]> {
        self.layers.list.iter().map(|layer| layer.values.as_slice())
    }

    /// How many numbers each layer has.
    pub(crate) fn lengths(shape: &SeedShape) -> Vec<usize> {
        let mut sizes = vec![(INPUTS, shape.width)];
        sizes.extend((1..shape.layers).map(|_| (shape.width, shape.width)));
        sizes.push((shape.width, PANEL));
        sizes.into_iter().map(|(inputs, outputs)| (inputs + 2) * outputs).collect()
    }

    /// From what [`SeedNetwork::values`] gave; each of its length.
    pub(crate) fn from_values(shape: &SeedShape, values: Vec<Vec<f32>>) -> SeedNetwork {
        let mut layers = Layers::new(shape.layers, shape.width, 0);
        for (layer, values) in layers.list.iter_mut().zip(values) {
            layer.values = values;
            layer.refresh();
        }
        SeedNetwork { layers, delta: shape.delta }
    }
}

impl Layers {
    /// One ray through all layers; the activations of each, of which the first row counts.
    fn trail(&self, x: Vec3, omega: Vec3, trail: &mut Vec<Vec<f32>>) {
        trail.resize(self.list.len() + 1, Vec::new());
        trail[0].clear();
        trail[0].resize(ROWS * INPUTS, 0.0);
        trail[0][..3].copy_from_slice(&x.to_array());
        trail[0][3..6].copy_from_slice(&omega.to_array());
        for (number, layer) in self.list.iter().enumerate() {
            let (below, above) = trail.split_at_mut(number + 1);
            above[0].resize(ROWS * layer.outputs, 0.0);
            self.product(layer, &below[number], &mut above[0]);
            if number + 1 < self.list.len() {
                above[0].iter_mut().for_each(|v| *v = v.max(0.0));
            }
        }
    }

    /// The derivative of the output by the position, given the activations.
    fn by_position(&self, trail: &[Vec<f32>]) -> Vec3 {
        let mut upper = vec![0.0; ROWS * PANEL];
        upper[0] = 1.0;
        for (number, layer) in self.list.iter().enumerate().rev() {
            let wide = layer.inputs.next_multiple_of(PANEL);
            let mut lower = vec![0.0; ROWS * wide];
            self.arch.dispatch(Product {
                x: &upper,
                inner: layer.outputs,
                stride: layer.outputs,
                panels: &layer.transposed,
                bias: None,
                y: &mut lower,
                width: wide,
            });
            if number > 0 {
                let below = &trail[number];
                lower.iter_mut().zip(below).for_each(|(g, &y)| *g *= f32::from(u8::from(y > 0.0)));
            }
            upper = lower;
        }
        Vec3::new(upper[0], upper[1], upper[2])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    fn network() -> SeedNetwork {
        let shape = SeedShape { layers: 3, width: 64, delta: 2.5 };
        let layers = Layers::new(3, 64, 5);
        let values: Vec<Vec<f32>> = layers.list.iter().map(|layer| layer.values.clone()).collect();
        assert_eq!(values.iter().map(Vec::len).collect::<Vec<_>>(), SeedNetwork::lengths(&shape));
        SeedNetwork::from_values(&shape, values)
    }

    fn rays(count: usize) -> Vec<(Vec3, Vec3)> {
        let mut random = Random::new(6, 0, 0);
        let mut ray = || {
            let x = 1.5 * random.direction();
            (x, (0.8 * random.float() * random.direction() - x).normalize())
        };
        (0..count).map(|_| ray()).collect()
    }

    #[test]
    fn a_ray_asked_alone_is_answered_as_among_many() {
        let network = network();
        let rays = rays(300);
        for (&(x, omega), (many, logit)) in rays.iter().zip(network.many(&rays)) {
            let (one, alone) = network.one(x, omega, f32::INFINITY);
            assert!((logit - alone).abs() < 1e-2 && one.is_some() == many.is_some());
            if let (Some(a), Some(b)) = (one, many) {
                assert!((a.t - b.t).abs() < 1e-4 && a.start == b.start);
            }
        }
        let away = network.one(Vec3::new(0.0, 3.0, 0.0), Vec3::Y, f32::INFINITY);
        assert!(away.0.is_none() && away.1.is_infinite());
    }

    #[test]
    fn the_gradient_by_position_equals_differences() {
        let network = network();
        let (mut good, mut all) = (0, 0);
        for (x, omega) in rays(200) {
            for x in [x, 0.3 * x] {
                let Some((start, _)) = crossing(x, omega) else { continue };
                let gradient = network.gradient(x, omega, start);
                let phi = |x: Vec3| {
                    let (start, _) = crossing(x, omega)?;
                    Some(start + network.distances(&[(x + start * omega, omega)])[0])
                };
                for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
                    let h = 2e-3;
                    let (Some(a), Some(b)) = (phi(x + h * axis), phi(x - h * axis)) else { continue };
                    let slope = (a - b) / (2.0 * h);
                    all += 1;
                    good +=
                        usize::from((slope - gradient.dot(axis)).abs() < 0.02 * (1.0 + gradient.length()));
                }
            }
        }
        assert!(all > 1000 && good * 100 > all * 96, "{good} of {all}");
    }
}
