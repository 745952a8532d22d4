//! Fully connected layers: weights v and lengths g with w = g v/|v| for each neuron (Salimans and Kingma 2016), products
//! over panels of 32 columns that stay in the cache.

use glam::Vec3;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use crate::random::Random;

/// Columns of a panel.
pub(super) const PANEL: usize = 32;
/// Samples that go through the layers together: their activations of one layer fill half of a second-level cache.
pub(super) const ROWS: usize = 128;
/// Numbers of the input: position and direction, with zeros up to a multiple of 8.
pub(super) const INPUTS: usize = 8;

/// One layer; columns are neurons.
#[derive(Clone, Debug)]
pub(super) struct Layer {
    pub(super) inputs: usize,
    /// A multiple of [`PANEL`].
    pub(super) outputs: usize,
    /// v, g and bias, one after the other; v neuron by neuron.
    pub(super) values: Vec<f32>,
    /// w in panels: for each 32 neurons, input by input.
    pub(super) panels: Vec<f32>,
    /// The transpose in panels of 32 inputs, neuron by neuron.
    pub(super) transposed: Vec<f32>,
}

impl Layer {
    fn new(inputs: usize, outputs: usize, random: &mut Random) -> Layer {
        let deviation = (2.0 / inputs as f32).sqrt();
        let mut values: Vec<f32> = (0..inputs * outputs).map(|_| deviation * random.normal()).collect();
        let lengths: Vec<f32> =
            values.chunks(inputs).map(|v| v.iter().map(|x| x * x).sum::<f32>().sqrt()).collect();
        values.extend(lengths);
        values.extend(std::iter::repeat_n(0.0, outputs));
        let mut layer = Layer { inputs, outputs, values, panels: Vec::new(), transposed: Vec::new() };
        layer.refresh();
        layer
    }

    pub(super) fn bias(&self) -> &[f32] {
        &self.values[(self.inputs + 1) * self.outputs..]
    }

    /// w from v and g.
    pub(super) fn refresh(&mut self) {
        let (inputs, outputs) = (self.inputs, self.outputs);
        self.panels.resize(inputs * outputs, 0.0);
        let wide = inputs.next_multiple_of(PANEL);
        self.transposed.resize(wide * outputs, 0.0);
        let (v, rest) = self.values.split_at(inputs * outputs);
        for neuron in 0..outputs {
            let v = &v[neuron * inputs..][..inputs];
            let length = v.iter().map(|x| x * x).sum::<f32>().sqrt().max(1e-20);
            let scale = rest[neuron] / length;
            let (panel, column) = (neuron / PANEL, neuron % PANEL);
            for (i, x) in v.iter().enumerate() {
                self.panels[(panel * inputs + i) * PANEL + column] = x * scale;
                self.transposed[(i / PANEL * outputs + neuron) * PANEL + i % PANEL] = x * scale;
            }
        }
    }

    /// The gradient by v, g and bias from that by w (neuron by neuron) and bias.
    pub(super) fn chain(&self, by_w: &[f32], by_bias: &[f32], to: &mut [f32]) {
        let (inputs, outputs) = (self.inputs, self.outputs);
        let (v, rest) = self.values.split_at(inputs * outputs);
        for neuron in 0..outputs {
            let v = &v[neuron * inputs..][..inputs];
            let g = rest[neuron];
            let length = v.iter().map(|x| x * x).sum::<f32>().sqrt().max(1e-20);
            let w = &by_w[neuron * inputs..][..inputs];
            let along: f32 = w.iter().zip(v).map(|(a, b)| a * b).sum::<f32>() / length;
            to[inputs * outputs + neuron] += along;
            for i in 0..inputs {
                to[neuron * inputs + i] += g / length * (w[i] - along * v[i] / length);
            }
            to[(inputs + 1) * outputs + neuron] += by_bias[neuron];
        }
    }
}

/// y[rows × 32·panels] = x[rows × inner] · panels (+ bias).
pub(super) struct Product<'a> {
    pub(super) x: &'a [f32],
    pub(super) inner: usize,
    pub(super) stride: usize,
    pub(super) panels: &'a [f32],
    pub(super) bias: Option<&'a [f32]>,
    pub(super) y: &'a mut [f32],
    pub(super) width: usize,
}

impl WithSimd for Product<'_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Product { x, inner, stride, panels, bias, y, width } = self;
        let rows = y.len() / width;
        for (number, panel) in panels.chunks_exact(inner * PANEL).enumerate() {
            let panel = S::as_simd_f32s(panel).0;
            let per = PANEL / S::F32_LANES;
            for row in (0..rows).step_by(8) {
                let x: [&[f32]; 8] = std::array::from_fn(|r| &x[(row + r) * stride..][..inner]);
                let mut column = 0;
                while column < per {
                    let take = (per - column).min(2);
                    let at = number * PANEL + column * S::F32_LANES;
                    let zero = simd.splat_f32s(0.0);
                    let start: [S::f32s; 2] = match bias {
                        Some(bias) => {
                            let bias = S::as_simd_f32s(&bias[at..at + take * S::F32_LANES]).0;
                            [bias[0], bias[take - 1]]
                        }
                        None => [zero; 2],
                    };
                    let mut sums = [start; 8];
                    for (i, line) in panel.chunks_exact(per).enumerate() {
                        let (a, b) = (line[column], line[column + take - 1]);
                        for r in 0..8 {
                            let v = simd.splat_f32s(x[r][i]);
                            sums[r][0] = simd.mul_add_e_f32s(v, a, sums[r][0]);
                            sums[r][1] = simd.mul_add_e_f32s(v, b, sums[r][1]);
                        }
                    }
                    for r in 0..8 {
                        let to = &mut y[(row + r) * width + at..][..take * S::F32_LANES];
                        S::as_mut_simd_f32s(to).0.copy_from_slice(&sums[r][..take]);
                    }
                    column += take;
                }
            }
        }
    }
}

/// g[outputs × inputs] += dyᵀ x: neuron by neuron.
pub(super) struct Gradient<'a> {
    pub(super) x: &'a [f32],
    pub(super) inputs: usize,
    pub(super) dy: &'a [f32],
    pub(super) outputs: usize,
    pub(super) g: &'a mut [f32],
}

impl WithSimd for Gradient<'_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Gradient { x, inputs, dy, outputs, g } = self;
        // The rows of the result are neurons, its columns inputs: the gradient by w of `matmul`, the two exchanged.
        if inputs % S::F32_LANES == 0 {
            crate::fast::matmul::weight_gradient(simd, (dy, outputs, outputs), x, inputs, g);
            return;
        }
        for (x, dy) in x.chunks_exact(inputs).zip(dy.chunks_exact(outputs)) {
            for (g, &d) in g.chunks_exact_mut(inputs).zip(dy) {
                g.iter_mut().zip(x).for_each(|(g, x)| *g += d * x);
            }
        }
    }
}

/// All layers.
#[derive(Clone, Debug)]
pub(super) struct Layers {
    pub(super) list: Vec<Layer>,
    pub(super) arch: Arch,
}

impl Layers {
    pub(super) fn new(hidden: usize, width: usize, seed: u64) -> Layers {
        let mut random = Random::new(seed, 31, 0);
        let mut list = vec![Layer::new(INPUTS, width, &mut random)];
        list.extend((1..hidden).map(|_| Layer::new(width, width, &mut random)));
        list.push(Layer::new(width, PANEL, &mut random));
        Layers { list, arch: Arch::new() }
    }

    pub(super) fn parameters(&self) -> usize {
        let last = self.list.len() - 1;
        let of = |(number, layer): (usize, &Layer)| {
            let inputs = if number == 0 { 6 } else { layer.inputs };
            (inputs + 2) * if number == last { 1 } else { layer.outputs }
        };
        self.list.iter().enumerate().map(of).sum()
    }

    pub(super) fn inputs(rays: &[(Vec3, Vec3)]) -> Vec<f32> {
        let mut inputs = vec![0.0; ROWS * INPUTS];
        for (to, (x, omega)) in inputs.chunks_exact_mut(INPUTS).zip(rays) {
            to[..3].copy_from_slice(&x.to_array());
            to[3..6].copy_from_slice(&omega.to_array());
        }
        inputs
    }

    /// The output for many rays.
    pub(super) fn run(&self, rays: &[(Vec3, Vec3)]) -> Vec<f32> {
        let parts: Vec<Vec<f32>> = rays
            .par_chunks(ROWS)
            .map(|rays| {
                let mut below = Layers::inputs(rays);
                for (number, layer) in self.list.iter().enumerate() {
                    let mut above = vec![0.0; ROWS * layer.outputs];
                    self.product(layer, &below, &mut above);
                    if number + 1 < self.list.len() {
                        above.iter_mut().for_each(|v| *v = v.max(0.0));
                    }
                    below = above;
                }
                below.chunks_exact(PANEL).take(rays.len()).map(|row| row[0]).collect()
            })
            .collect();
        parts.concat()
    }

    pub(super) fn product(&self, layer: &Layer, x: &[f32], y: &mut [f32]) {
        self.arch.dispatch(Product {
            x,
            inner: layer.inputs,
            stride: layer.inputs,
            panels: &layer.panels,
            bias: Some(layer.bias()),
            y,
            width: layer.outputs,
        });
    }
}
