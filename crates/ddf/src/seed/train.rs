//! Training of the seed's network on a list of samples.

use glam::Vec3;
use rayon::prelude::*;

use super::layers::{Gradient, Layers, PANEL, Product, ROWS};
use super::{SeedNetwork, SeedShape};
use crate::error::DdfError;
use crate::random::Random;
use crate::samples::FieldSample;
use crate::train::adam::{Adam, Rate};

/// Which rates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SeedSchedule {
    /// As printed: 10⁻⁷ throughout, dropout ½.
    Printed,
    /// 10⁻³ falling along half a cosine to 10⁻⁵, no dropout, half of each batch from the samples that hit: most samples of
    /// the seed's scheme are misses, and the median of the targets, which |error| seeks first, would be δ.
    Ours,
}

/// How the seed's network is trained.
#[derive(Clone, Debug, PartialEq)]
pub struct SeedOptions {
    /// Hidden layers.
    pub layers: usize,
    /// Neurons of each, a multiple of 32.
    pub width: usize,
    /// Rates and dropout.
    pub schedule: SeedSchedule,
    /// δ of the clamp, in units of the unit sphere.
    pub delta: f32,
    /// Samples of a step, rounded up to a multiple of 128.
    pub batch: usize,
    /// All random numbers derive from it.
    pub seed: u64,
}

impl Default for SeedOptions {
    fn default() -> Self {
        SeedOptions { layers: 8, width: 512, schedule: SeedSchedule::Ours, delta: 2.5, batch: 1024, seed: 1 }
    }
}

/// Learns a list of samples.
#[derive(Debug)]
pub struct SeedTrainer {
    options: SeedOptions,
    samples: Vec<FieldSample>,
    /// How many of them hit; those come first.
    hits: usize,
    layers: Layers,
    moments: Vec<Adam>,
    step: u64,
}

impl SeedTrainer {
    /// Prepares to learn samples.
    ///
    /// # Errors
    /// If there are no samples, or an option is out of range.
    pub fn new(samples: Vec<FieldSample>, options: SeedOptions) -> Result<SeedTrainer, DdfError> {
        let SeedOptions { layers, width, delta, batch, .. } = options;
        SeedShape { layers, width, delta }.check().map_err(DdfError::Setting)?;
        if !(1..=1 << 20).contains(&batch) {
            return Err(DdfError::Setting(format!("batches of {batch}: expected 1 to a million samples")));
        }
        if samples.is_empty() {
            return Err(DdfError::Setting("there are no samples to learn from".into()));
        }
        // In the order that they had, hits first.
        let (mut sorted, misses): (Vec<_>, Vec<_>) =
            samples.into_iter().partition(|sample| sample.distance.is_finite());
        let hits = sorted.len();
        sorted.extend(misses);
        let network = Layers::new(layers, width, options.seed);
        let moments = network.list.iter().map(|layer| Adam::new(layer.values.len())).collect();
        Ok(SeedTrainer { options, samples: sorted, hits, layers: network, moments, step: 0 })
    }

    /// The network as it is now.
    #[must_use]
    pub fn network(&self) -> SeedNetwork {
        SeedNetwork { layers: self.layers.clone(), delta: self.options.delta }
    }

    /// Steps done.
    #[must_use]
    pub fn steps_done(&self) -> u64 {
        self.step
    }

    /// One step; the mean of |clamp(y) − clamp(ỹ)| [002 eq. 8] before it. `progress` is how much of the training is done.
    ///
    /// # Errors
    /// If the numbers went out of range.
    pub fn step(&mut self, progress: f32) -> Result<f64, DdfError> {
        self.step += 1;
        let blocks = self.options.batch.div_ceil(ROWS);
        let parts: Vec<(f64, Vec<Vec<f32>>)> = (0..blocks.min(LANES))
            .into_par_iter()
            .map(|lane| {
                let mut gradient = self.zeros();
                let mut loss = 0.0;
                for block in (lane..blocks).step_by(LANES) {
                    loss += self.learn(block, &mut gradient);
                }
                (loss, gradient)
            })
            .collect();
        let loss: f64 = parts.iter().map(|(loss, _)| loss).sum::<f64>() / (blocks * ROWS) as f64;
        if !loss.is_finite() {
            return Err(DdfError::Diverged { step: self.step });
        }
        let fall = 0.01 + 0.99 * 0.5 * (1.0 + (std::f32::consts::PI * progress.clamp(0.0, 1.0)).cos());
        let rate = match self.options.schedule {
            SeedSchedule::Printed => 1e-7,
            SeedSchedule::Ours => 1e-3 * fall,
        };
        let rate = Rate::new(rate, self.step);
        let updates = self.layers.list.par_iter_mut().zip(&mut self.moments).enumerate();
        updates.for_each(|(number, (layer, adam))| {
            let size = layer.inputs * layer.outputs;
            let mut sum = vec![0.0; size + layer.outputs];
            for (_, gradient) in &parts {
                sum.iter_mut().zip(&gradient[number]).for_each(|(to, from)| *to += from);
            }
            let mut by_values = vec![0.0; layer.values.len()];
            layer.chain(&sum[..size], &sum[size..], &mut by_values);
            for (i, g) in by_values.into_iter().enumerate() {
                rate.apply(&mut layer.values[i], &mut adam.first[i], &mut adam.second[i], g);
            }
            layer.refresh();
        });
        Ok(loss)
    }

    fn zeros(&self) -> Vec<Vec<f32>> {
        self.layers.list.iter().map(|layer| vec![0.0; (layer.inputs + 1) * layer.outputs]).collect()
    }

    /// Adds the gradient by w and bias of one block of samples; the sum of their losses.
    fn learn(&self, block: usize, gradient: &mut [Vec<f32>]) -> f64 {
        let mut random = Random::new(self.options.seed, self.step, block as u64);
        let balanced = self.options.schedule == SeedSchedule::Ours && self.hits > 0;
        let chosen: Vec<&FieldSample> = (0..ROWS)
            .map(|row| {
                let among = if balanced && row % 2 == 0 { self.hits } else { self.samples.len() };
                &self.samples[random.below(among)]
            })
            .collect();
        let rays: Vec<(Vec3, Vec3)> = chosen.iter().map(|s| (s.origin, s.direction)).collect();
        let dropout = self.options.schedule == SeedSchedule::Printed;
        let list = &self.layers.list;
        let mut values = vec![Layers::inputs(&rays)];
        for (number, layer) in list.iter().enumerate() {
            let mut above = vec![0.0; ROWS * layer.outputs];
            self.layers.product(layer, &values[number], &mut above);
            if number + 1 < list.len() {
                for v in &mut above {
                    *v = v.max(0.0);
                    // p = ½: what stays counts double.
                    if dropout {
                        *v = if random.bits() & 1 == 0 { 2.0 * *v } else { 0.0 };
                    }
                }
            }
            values.push(above);
        }
        let delta = self.options.delta;
        let mut upper = vec![0.0; ROWS * PANEL];
        let mut loss = 0.0;
        for (index, sample) in chosen.iter().enumerate() {
            let said = values[list.len()][index * PANEL];
            let error = said.clamp(-delta, delta) - sample.distance.clamp(-delta, delta);
            loss += f64::from(error.abs());
            // Beyond the clamp there is no slope: outputs that run away would stay there, so they are called back.
            upper[index * PANEL] =
                if said.abs() > delta { error.signum() } else { error / error.abs().max(1e-4) };
            if said.abs() > delta && error == 0.0 {
                upper[index * PANEL] = 0.0;
            }
        }
        for (number, layer) in list.iter().enumerate().rev() {
            let (by_w, by_bias) = gradient[number].split_at_mut(layer.inputs * layer.outputs);
            let below = &values[number];
            self.layers.arch.dispatch(Gradient {
                x: below,
                inputs: layer.inputs,
                dy: &upper,
                outputs: layer.outputs,
                g: by_w,
            });
            for row in upper.chunks_exact(layer.outputs) {
                by_bias.iter_mut().zip(row).for_each(|(to, from)| *to += from);
            }
            if number == 0 {
                break;
            }
            let mut lower = vec![0.0; ROWS * layer.inputs];
            self.layers.arch.dispatch(Product {
                x: &upper,
                inner: layer.outputs,
                stride: layer.outputs,
                panels: &layer.transposed,
                bias: None,
                y: &mut lower,
                width: layer.inputs,
            });
            let scale = if dropout { 2.0 } else { 1.0 };
            lower.iter_mut().zip(below).for_each(|(g, &y)| *g *= if y > 0.0 { scale } else { 0.0 });
            upper = lower;
        }
        loss
    }
}

/// Gradients that are held side by side; fixed, so that sums do not depend on threads.
const LANES: usize = 4;

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(count: usize) -> Vec<FieldSample> {
        let mut random = Random::new(3, 0, 0);
        (0..count)
            .map(|_| {
                let origin = Vec3::new(random.float(), random.float(), random.float()) - 0.5;
                let direction = random.direction();
                FieldSample { origin, direction, distance: 1.0 + origin.dot(direction) }
            })
            .collect()
    }

    #[test]
    fn the_gradient_of_the_network_of_002_equals_differences() {
        let options =
            SeedOptions { layers: 3, width: 64, delta: 100.0, batch: 128, ..SeedOptions::default() };
        let trainer = SeedTrainer::new(samples(500), options).expect("options that fit");
        let mut gradient = trainer.zeros();
        trainer.learn(0, &mut gradient);
        for (number, place) in [(0, 5), (0, 70), (1, 400), (2, 9), (3, 33)] {
            let layer = &trainer.layers.list[number];
            let size = layer.inputs * layer.outputs;
            let mut by_values = vec![0.0; layer.values.len()];
            layer.chain(&gradient[number][..size], &gradient[number][size..], &mut by_values);
            // One of v, and the length and bias of its neuron.
            let neuron = place / layer.inputs;
            for at in [place, size + neuron, size + layer.outputs + neuron] {
                let h = 2e-3;
                let loss = |s: f32| {
                    let mut other = SeedTrainer {
                        options: trainer.options.clone(),
                        samples: trainer.samples.clone(),
                        hits: trainer.hits,
                        layers: trainer.layers.clone(),
                        moments: Vec::new(),
                        step: trainer.step,
                    };
                    other.layers.list[number].values[at] += s;
                    other.layers.list[number].refresh();
                    other.learn(0, &mut other.zeros())
                };
                let slope = (loss(h) - loss(-h)) / f64::from(2.0 * h);
                let found = f64::from(by_values[at]);
                assert!((slope - found).abs() < 0.05 * (1.0 + slope.abs()), "{number} {at}: {slope} {found}");
            }
        }
    }

    #[test]
    fn our_schedule_learns_and_the_printed_one_stands_still() {
        let run = |schedule| {
            let options =
                SeedOptions { layers: 3, width: 64, batch: 256, schedule, ..SeedOptions::default() };
            let mut trainer = SeedTrainer::new(samples(2000), options).expect("options that fit");
            let first = trainer.step(0.0).expect("a step");
            let mut last = first;
            for i in 0..150 {
                last = trainer.step(i as f32 / 150.0).expect("a step");
            }
            (first, last)
        };
        let (first, last) = run(SeedSchedule::Ours);
        assert!(last < 0.2 * first, "{first} {last}");
        let (first, last) = run(SeedSchedule::Printed);
        assert!(last > 0.7 * first, "{first} {last}");
    }
}
