//! The narrow network of the fast field: hidden layers, a logit of visibility, a distance in cells, a logit of the side
//! that is seen.
//!
//! `Tile` runs and differentiates many parts at once for training; `answer` runs one for a query.

use super::encode::{
    Corners, Move, Part, Table, corners, encode, encode_gradient, encode_move, encode_move_gradient,
};
use pulp::Simd;

use super::matmul::{forward, row, weight_gradient};
use super::shape::{FastShape, MOST_INPUTS, OUTPUTS};
use crate::grid::Level;

/// What the network says of a part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Answer {
    /// Positive where the part meets the surface more likely than not.
    pub(crate) logit: f32,
    /// From the start of the part, in cells; meaningless where nothing is met.
    pub(crate) distance: f32,
    /// Positive where the side that is seen is the front by the mesh's winding; meaningless where nothing is met, or
    /// where sides were not learned.
    pub(crate) side: f32,
}

/// (x + √(x² + b))/2, or max(x, 0).
#[inline(always)]
fn activate(x: f32, roundness: f32) -> f32 {
    if roundness == 0.0 { x.max(0.0) } else { 0.5 * (x + (x * x + roundness).sqrt()) }
}

/// The slope of the activation where its value is y: y²/(y² + b/4).
#[inline(always)]
fn slope(y: f32, roundness: f32) -> f32 {
    if roundness == 0.0 { f32::from(u8::from(y > 0.0)) } else { y * y / (y * y + 0.25 * roundness) }
}

/// Everything that is learned, at full precision.
#[derive(Clone, Debug)]
pub(crate) struct Parameters {
    /// Features of each grid, vertex by vertex.
    pub(crate) tables: Vec<Vec<f32>>,
    /// Weights (rows × columns) and biases, layer by layer.
    pub(crate) network: Vec<f32>,
}

impl Parameters {
    pub(crate) fn zeros(shape: &FastShape, levels: &[Level]) -> Parameters {
        Parameters {
            tables: levels.iter().map(|level| vec![0.0; level.count() * shape.features]).collect(),
            network: vec![0.0; shape.network_len()],
        }
    }
}

/// One sample of training: a part of a ray in a cell, and what is true of it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocalSample {
    pub(crate) part: Part,
    /// Distance from the start in cells; negative for a miss.
    pub(crate) hit: f32,
    /// Weight of the error of distance.
    pub(crate) weight: f32,
    /// A move of the part, and how the distance changes with it.
    pub(crate) slope: Slope,
    /// 1 where the front is met, −1 where the back is, 0 where that is not known.
    pub(crate) side: f32,
}

/// How the distance changes as a part is moved, where the normal is known: with n that of the surface and v the move of
/// the start, n · (v + dφ ω) = 0 gives dφ = −(n · v)/(n · ω) [002 eq. 3].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Slope {
    pub(crate) by: Move,
    pub(crate) change: f32,
    /// Weight of the error; 0 where nothing is known.
    pub(crate) weight: f32,
}

/// Samples that are run together: a layer's activations of so many stay in the first cache.
pub(crate) const TILE: usize = 64;

/// Working memory for training on a tile.
#[derive(Clone, Debug)]
pub(crate) struct Tile {
    inputs: Vec<f32>,
    hidden: Vec<Vec<f32>>,
    outputs: Vec<f32>,
    upper: Vec<f32>,
    lower: Vec<f32>,
    corners: Vec<Corners>,
    /// Derivatives of inputs and hidden layers along the moves.
    inputs_moved: Vec<f32>,
    hidden_moved: Vec<Vec<f32>>,
}

/// Sums over samples.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Loss {
    pub(crate) samples: f64,
    pub(crate) visibility: f64,
    pub(crate) wrong: f64,
    pub(crate) hits: f64,
    pub(crate) distance: f64,
    pub(crate) slopes: f64,
    pub(crate) slope: f64,
    pub(crate) side: f64,
}

impl std::ops::AddAssign for Loss {
    fn add_assign(&mut self, other: Loss) {
        self.samples += other.samples;
        self.visibility += other.visibility;
        self.wrong += other.wrong;
        self.hits += other.hits;
        self.distance += other.distance;
        self.slopes += other.slopes;
        self.slope += other.slope;
        self.side += other.side;
    }
}

impl Tile {
    pub(crate) fn new(shape: &FastShape) -> Tile {
        let widest = shape.inputs().max(shape.hidden).max(OUTPUTS);
        Tile {
            inputs: vec![0.0; TILE * shape.inputs()],
            hidden: vec![vec![0.0; TILE * shape.hidden]; shape.layers],
            outputs: vec![0.0; TILE * OUTPUTS],
            upper: vec![0.0; TILE * widest],
            lower: vec![0.0; TILE * widest],
            corners: vec![[[0; 8]; super::shape::MOST_LEVELS]; TILE],
            inputs_moved: vec![0.0; TILE * shape.inputs()],
            hidden_moved: vec![vec![0.0; TILE * shape.hidden]; shape.layers],
        }
    }

    #[inline(always)]
    fn run<S: Simd, const FUSED: bool, const F: usize>(
        &mut self,
        simd: S,
        shape: &FastShape,
        levels: &[Level],
        parameters: &Parameters,
        samples: &[LocalSample],
    ) {
        let tables: Vec<&[f32]> = parameters.tables.iter().map(Vec::as_slice).collect();
        let scales = [1.0; super::shape::MOST_LEVELS];
        let width = shape.inputs();
        for (index, sample) in samples.iter().enumerate() {
            let corners = corners(levels, sample.part.cell);
            self.corners[index] = corners;
            let to = &mut self.inputs[index * width..][..width];
            encode::<FUSED, F, [f32]>(shape, levels, &tables, &scales, &corners, &sample.part, to);
        }
        self.inputs[samples.len() * width..].fill(0.0);
        let mut at = 0;
        let (mut below, mut below_width): (&[f32], usize) = (&self.inputs, width);
        for layer in &mut self.hidden {
            let (w, bias) = layer_at(&parameters.network, &mut at, below_width, shape.hidden);
            forward(simd, (below, below_width, below_width), w, Some(bias), shape.hidden, layer);
            let b = shape.roundness;
            layer.iter_mut().for_each(|v| *v = activate(*v, b));
            (below, below_width) = (layer, shape.hidden);
        }
        let (w, bias) = layer_at(&parameters.network, &mut at, below_width, OUTPUTS);
        forward(simd, (below, below_width, below_width), w, Some(bias), OUTPUTS, &mut self.outputs);
    }

    /// Adds the gradient of the loss of at most [`TILE`] samples.
    ///
    /// Visibility: binary cross-entropy. Side, where there is a hit: the same, times `SIDE` and the weight. Distance, where there is a hit: |error| · weight, rounded below `BEND`. Slope of the
    /// distance along a move, where the normal is known: the same, rounded below `SLOPE_BEND`. `weights` are those of
    /// distance and slope.
    #[inline(always)]
    pub(crate) fn learn<S: Simd, const FUSED: bool, const F: usize>(
        &mut self,
        simd: S,
        shape: &FastShape,
        levels: &[Level],
        parameters: &Parameters,
        transposed: &[f32],
        samples: &[LocalSample],
        [distance_weight, slope_weight]: [f32; 2],
        gradient: &mut Parameters,
    ) -> Loss {
        self.run::<S, FUSED, F>(simd, shape, levels, parameters, samples);
        let mut loss = Loss::default();
        self.upper[..TILE * OUTPUTS].fill(0.0);
        for (index, sample) in samples.iter().enumerate() {
            let (logit, distance) = (self.outputs[index * OUTPUTS], self.outputs[index * OUTPUTS + 1]);
            let is_hit = sample.hit >= 0.0;
            let chance = 1.0 / (1.0 + (-logit).exp());
            let target = f32::from(u8::from(is_hit));
            self.upper[index * OUTPUTS] = chance - target;
            let of_truth = if is_hit { chance } else { 1.0 - chance };
            loss.samples += 1.0;
            loss.visibility -= f64::from(of_truth.max(1e-9).ln());
            loss.wrong += f64::from(u8::from(is_hit != (logit > 0.0)));
            if is_hit {
                let error = distance - sample.hit;
                let slope = (error / BEND).clamp(-1.0, 1.0);
                self.upper[index * OUTPUTS + 1] = distance_weight * sample.weight * slope;
                loss.hits += 1.0;
                loss.distance += f64::from(error.abs() * sample.weight);
                if sample.side != 0.0 {
                    let wrong = 1.0 / (1.0 + (sample.side * self.outputs[index * OUTPUTS + 2]).exp());
                    self.upper[index * OUTPUTS + 2] = -SIDE * sample.weight * sample.side * wrong;
                    loss.side -= f64::from(sample.weight * (1.0 - wrong).max(1e-9).ln());
                }
            }
        }
        self.backward(simd, shape, transposed, &mut gradient.network);
        let width = shape.inputs();
        for (index, sample) in samples.iter().enumerate() {
            let of_inputs = &self.upper[index * width..][..width];
            let corners = &self.corners[index];
            let tables = &mut gradient.tables;
            encode_gradient::<FUSED, F>(shape, levels, corners, &sample.part, of_inputs, tables);
        }
        if slope_weight > 0.0 && shape.roundness == 0.0 {
            self.learn_slopes::<S, FUSED, F>(
                simd,
                shape,
                levels,
                parameters,
                transposed,
                samples,
                slope_weight,
                gradient,
                &mut loss,
            );
        }
        loss
    }

    /// The same for slopes. With ReLU the network is linear where it is: the derivative along a move goes through the same
    /// weights, without biases, and only where the neurons are on; and what it depends on is differentiated likewise.
    #[inline(always)]
    fn learn_slopes<S: Simd, const FUSED: bool, const F: usize>(
        &mut self,
        simd: S,
        shape: &FastShape,
        levels: &[Level],
        parameters: &Parameters,
        transposed: &[f32],
        samples: &[LocalSample],
        slope_weight: f32,
        gradient: &mut Parameters,
        loss: &mut Loss,
    ) {
        let tables: Vec<&[f32]> = parameters.tables.iter().map(Vec::as_slice).collect();
        let width = shape.inputs();
        for (index, sample) in samples.iter().enumerate() {
            let to = &mut self.inputs_moved[index * width..][..width];
            if sample.slope.weight > 0.0 {
                let corners = &self.corners[index];
                let (part, by) = (&sample.part, &sample.slope.by);
                encode_move::<FUSED, F>(shape, levels, &tables, corners, part, by, to);
            } else {
                to.fill(0.0);
            }
        }
        self.inputs_moved[samples.len() * width..].fill(0.0);
        let mut at = 0;
        let (mut below, mut below_width): (&[f32], usize) = (&self.inputs_moved, width);
        for (layer, on) in self.hidden_moved.iter_mut().zip(&self.hidden) {
            let (w, _) = layer_at(&parameters.network, &mut at, below_width, shape.hidden);
            forward(simd, (below, below_width, below_width), w, None, shape.hidden, layer);
            layer.iter_mut().zip(on).for_each(|(v, &on)| *v *= slope(on, 0.0));
            (below, below_width) = (layer, shape.hidden);
        }
        let (w, _) = layer_at(&parameters.network, &mut at, below_width, OUTPUTS);
        forward(simd, (below, below_width, below_width), w, None, OUTPUTS, &mut self.outputs);
        self.upper[..TILE * OUTPUTS].fill(0.0);
        for (index, sample) in samples.iter().enumerate() {
            let Slope { change, weight, .. } = sample.slope;
            if weight > 0.0 {
                let error = self.outputs[index * OUTPUTS + 1] - change;
                let slope = (error / SLOPE_BEND).clamp(-1.0, 1.0);
                self.upper[index * OUTPUTS + 1] = slope_weight * weight * slope;
                loss.slopes += 1.0;
                loss.slope += f64::from(error.abs() * weight);
            }
        }
        let sizes = shape.layer_sizes();
        let mut end = gradient.network.len();
        let mut transposed_end = transposed.len();
        for (number, &(rows, columns)) in sizes.iter().enumerate().rev() {
            let start = end - (rows + 1) * columns;
            let w = &mut gradient.network[start..start + rows * columns];
            let below: &[f32] = if number == 0 { &self.inputs_moved } else { &self.hidden_moved[number - 1] };
            let upper = &self.upper[..TILE * columns];
            weight_gradient(simd, (below, rows, rows), upper, columns, w);
            let wt = &transposed[transposed_end - rows * columns..transposed_end];
            forward(simd, (upper, columns, columns), wt, None, rows, &mut self.lower[..TILE * rows]);
            if number > 0 {
                let on = &self.hidden[number - 1];
                self.lower.iter_mut().zip(on).for_each(|(g, &y)| *g *= slope(y, 0.0));
            }
            std::mem::swap(&mut self.upper, &mut self.lower);
            end = start;
            transposed_end -= rows * columns;
        }
        for (index, sample) in samples.iter().enumerate() {
            if sample.slope.weight > 0.0 {
                let by_moved = &self.upper[index * width..][..width];
                encode_move_gradient::<FUSED, F>(
                    shape,
                    levels,
                    &self.corners[index],
                    &sample.part,
                    &sample.slope.by,
                    by_moved,
                    &mut gradient.tables,
                );
            }
        }
    }

    /// From the gradient by the outputs in `upper` to that by the inputs, in `upper` again.
    #[inline(always)]
    fn backward<S: Simd>(&mut self, simd: S, shape: &FastShape, transposed: &[f32], network: &mut [f32]) {
        let sizes = shape.layer_sizes();
        let mut end = network.len();
        let mut transposed_end = transposed.len();
        for (number, &(rows, columns)) in sizes.iter().enumerate().rev() {
            let start = end - (rows + 1) * columns;
            let (w, bias) = network[start..end].split_at_mut(rows * columns);
            let below: &[f32] = if number == 0 { &self.inputs } else { &self.hidden[number - 1] };
            let upper = &self.upper[..TILE * columns];
            weight_gradient(simd, (below, rows, rows), upper, columns, w);
            for line in upper.chunks_exact(columns) {
                bias.iter_mut().zip(line).for_each(|(to, from)| *to += from);
            }
            let wt = &transposed[transposed_end - rows * columns..transposed_end];
            forward(simd, (upper, columns, columns), wt, None, rows, &mut self.lower[..TILE * rows]);
            if number > 0 {
                let b = shape.roundness;
                self.lower.iter_mut().zip(below).for_each(|(g, &y)| *g *= slope(y, b));
            }
            std::mem::swap(&mut self.upper, &mut self.lower);
            end = start;
            transposed_end -= rows * columns;
        }
    }
}

/// Below this error, in cells, the loss of distance is quadratic: far finer than what a cell's features resolve.
const BEND: f32 = 0.01;
/// The same of slopes: about three degrees.
const SLOPE_BEND: f32 = 0.05;
/// Weight of the side's cross-entropy against that of visibility.
const SIDE: f32 = 0.5;

#[inline(always)]
fn layer_at<'a>(network: &'a [f32], at: &mut usize, rows: usize, columns: usize) -> (&'a [f32], &'a [f32]) {
    let start = *at;
    *at += (rows + 1) * columns;
    network[start..*at].split_at(rows * columns)
}

/// The weights of each layer, transposed, without biases.
pub(crate) fn transpose(shape: &FastShape, network: &[f32], to: &mut Vec<f32>) {
    to.clear();
    let mut at = 0;
    for (rows, columns) in shape.layer_sizes() {
        let (w, _) = layer_at(network, &mut at, rows, columns);
        for column in 0..columns {
            to.extend((0..rows).map(|row| w[row * columns + column]));
        }
    }
}

/// Activations of one part on its way through the network.
pub(crate) struct Trail {
    pub(crate) inputs: [f32; MOST_INPUTS],
    pub(crate) hidden: [[f32; 64]; 4],
}

/// One part through the network.
#[inline(always)]
pub(crate) fn answer<S: Simd, const FUSED: bool, const F: usize, T: Table + ?Sized>(
    simd: S,
    shape: &FastShape,
    levels: &[Level],
    tables: &[&T],
    scales: &[f32],
    network: &[f32],
    part: &Part,
) -> Answer {
    let mut inputs = [0.0; MOST_INPUTS];
    let width = shape.inputs();
    let corners = corners(levels, part.cell);
    encode::<FUSED, F, T>(shape, levels, tables, scales, &corners, part, &mut inputs[..width]);
    layers(simd, shape, network, &inputs[..width], &mut |_, _| {})
}

#[inline(always)]
fn layers<S: Simd>(
    simd: S,
    shape: &FastShape,
    network: &[f32],
    inputs: &[f32],
    keep: &mut impl FnMut(usize, &[f32]),
) -> Answer {
    let mut at = 0;
    let width = shape.hidden;
    let (mut below, mut above) = ([0.0f32; 64], [0.0f32; 64]);
    for number in 0..shape.layers {
        let (rows, x) = if number == 0 {
            (inputs.len(), &inputs[..shape.used_inputs()])
        } else {
            (width, &below[..width])
        };
        let (w, bias) = layer_at(network, &mut at, rows, width);
        row(simd, x, w, bias, width, &mut above[..width]);
        above[..width].iter_mut().for_each(|v| *v = activate(*v, shape.roundness));
        keep(number, &above[..width]);
        std::mem::swap(&mut below, &mut above);
    }
    let (w, bias) = layer_at(network, &mut at, width, OUTPUTS);
    let mut out = [0.0; OUTPUTS];
    row(simd, &below[..width], w, bias, OUTPUTS, &mut out);
    Answer { logit: out[0], distance: out[1], side: out[2] }
}

/// The answer, and the derivative of the distance by the inputs.
pub(crate) fn answer_with_gradient<const F: usize, T: Table + ?Sized>(
    shape: &FastShape,
    levels: &[Level],
    tables: &[&T],
    scales: &[f32],
    network: &[f32],
    part: &Part,
    by_inputs: &mut [f32; MOST_INPUTS],
) -> (Answer, Corners) {
    let width = shape.inputs();
    let corners = corners(levels, part.cell);
    let mut trail = Trail { inputs: [0.0; MOST_INPUTS], hidden: [[0.0; 64]; 4] };
    encode::<false, F, T>(shape, levels, tables, scales, &corners, part, &mut trail.inputs[..width]);
    let inputs = &trail.inputs[..width];
    let hidden = &mut trail.hidden;
    let keep = &mut |number: usize, layer: &[f32]| hidden[number][..layer.len()].copy_from_slice(layer);
    let answer = layers(pulp::Scalar::new(), shape, network, inputs, keep);
    // Backwards, from the column of the distance.
    let sizes = shape.layer_sizes();
    let mut end = network.len();
    let mut upper = [0.0f32; MOST_INPUTS];
    upper[1] = 1.0;
    for (number, &(rows, columns)) in sizes.iter().enumerate().rev() {
        let start = end - (rows + 1) * columns;
        let mut lower = [0.0f32; MOST_INPUTS];
        for r in 0..rows {
            let line = &network[start + r * columns..][..columns];
            lower[r] = line.iter().zip(&upper).map(|(w, g)| w * g).sum();
            if number > 0 {
                lower[r] *= slope(trail.hidden[number - 1][r], shape.roundness);
            }
        }
        upper = lower;
        end = start;
    }
    *by_inputs = upper;
    (answer, corners)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Cells;
    use crate::random::Random;
    use glam::{UVec3, Vec3};
    use halflight_shape::procedural::mesh::ico_sphere;

    fn setting(roundness: f32) -> (FastShape, Vec<Level>, Parameters, Vec<LocalSample>) {
        let shape =
            FastShape { resolution: 8, levels: vec![0, 1], layers: 3, roundness, ..FastShape::default() };
        let mut mesh = ico_sphere(3.0, 2);
        mesh.positions.iter_mut().for_each(|p| *p += Vec3::splat(4.0));
        let cells = Cells::of_mesh(&mesh, 8);
        let levels: Vec<Level> = shape.levels.iter().map(|&shift| Level::new(&cells, shift)).collect();
        let mut parameters = Parameters::zeros(&shape, &levels);
        let mut random = Random::new(8, 0, 0);
        let all = parameters.tables.iter_mut().flatten().chain(&mut parameters.network);
        all.for_each(|v| *v = 0.3 * random.normal());
        let mut occupied: Vec<UVec3> = Vec::new();
        cells.for_each(|cell| occupied.push(cell));
        let samples = (0..50)
            .map(|i| {
                let cell = occupied[random.below(occupied.len())];
                let within = Vec3::new(random.float(), random.float(), random.float());
                let part = Part {
                    cell,
                    start: cell.as_vec3() + within,
                    direction: random.direction(),
                    length: random.float(),
                };
                let hit = if i % 3 == 0 { -1.0 } else { random.float() };
                let mut other = Random::new(9, 0, i);
                let by = Move { start: other.direction(), length: other.float() };
                let weight = if i % 2 == 0 { 0.8 } else { 0.0 };
                let slope = Slope { by, change: other.float(), weight };
                LocalSample { part, hit, weight: 0.7, slope, side: (i % 3) as f32 - 1.0 }
            })
            .collect();
        (shape, levels, parameters, samples)
    }

    struct Once<'a> {
        shape: &'a FastShape,
        levels: &'a [Level],
        parameters: &'a Parameters,
        samples: &'a [LocalSample],
        slope_weight: f32,
    }

    impl pulp::WithSimd for Once<'_> {
        type Output = (Loss, Parameters);
        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
            let mut gradient = Parameters::zeros(self.shape, self.levels);
            let mut transposed = Vec::new();
            transpose(self.shape, &self.parameters.network, &mut transposed);
            let mut tile = Tile::new(self.shape);
            let loss = tile.learn::<S, false, 8>(
                simd,
                self.shape,
                self.levels,
                self.parameters,
                &transposed,
                self.samples,
                [2.0, self.slope_weight],
                &mut gradient,
            );
            (loss, gradient)
        }
    }

    #[test]
    fn the_gradient_of_the_loss_equals_differences_for_features_weights_and_biases() {
        // Slopes jump where a neuron turns on or off, and with them the loss: differences there say nothing.
        for (roundness, slope_weight, least) in [(0.0, 0.0, 0.96), (0.5, 0.0, 0.96), (0.0, 0.6, 0.82)] {
            let (shape, levels, parameters, samples) = setting(roundness);
            let run = |parameters: &Parameters| {
                let once =
                    Once { shape: &shape, levels: &levels, parameters, samples: &samples, slope_weight };
                pulp::Arch::new().dispatch(once)
            };
            let total = |parameters: &Parameters| {
                let loss = run(parameters).0;
                loss.visibility
                    + 2.0 * loss.distance
                    + f64::from(SIDE) * loss.side
                    + f64::from(slope_weight) * loss.slope
            };
            let gradient = run(&parameters).1;
            let (mut good, mut all) = (0, 0);
            let mut check = |found: f32, change: &dyn Fn(&mut Parameters, f32)| {
                let h = 2e-3;
                let at = |s: f32| {
                    let mut other = parameters.clone();
                    change(&mut other, s);
                    total(&other)
                };
                let slope = (at(h) - at(-h)) / f64::from(2.0 * h);
                all += 1;
                good += usize::from((slope - f64::from(found)).abs() < 0.03 * (1.0 + slope.abs()));
            };
            for (number, table) in gradient.tables.iter().enumerate() {
                for index in (0..table.len()).step_by(97) {
                    check(table[index], &|p, s| p.tables[number][index] += s);
                }
            }
            for index in (0..gradient.network.len()).step_by(53) {
                check(gradient.network[index], &|p, s| p.network[index] += s);
            }
            // A difference across a corner of ReLU or of the rounded error is no slope.
            assert!(all > 60 && good as f64 > least * all as f64, "{good} of {all}, {slope_weight}");
        }
    }

    #[test]
    fn one_part_is_answered_as_many_are() {
        let (shape, levels, parameters, samples) = setting(0.0);
        struct Both<'a>(&'a FastShape, &'a [Level], &'a Parameters, &'a [LocalSample]);
        impl pulp::WithSimd for Both<'_> {
            type Output = ();
            #[inline(always)]
            fn with_simd<S: Simd>(self, simd: S) {
                let Both(shape, levels, parameters, samples) = self;
                let mut tile = Tile::new(shape);
                tile.run::<S, false, 8>(simd, shape, levels, parameters, samples);
                let tables: Vec<&[f32]> = parameters.tables.iter().map(Vec::as_slice).collect();
                for (index, sample) in samples.iter().enumerate() {
                    let one = answer::<S, false, 8, [f32]>(
                        simd,
                        shape,
                        levels,
                        &tables,
                        &[1.0; 4],
                        &parameters.network,
                        &sample.part,
                    );
                    assert!((one.logit - tile.outputs[index * OUTPUTS]).abs() < 1e-3);
                    assert!((one.distance - tile.outputs[index * OUTPUTS + 1]).abs() < 1e-3);
                    assert!((one.side - tile.outputs[index * OUTPUTS + 2]).abs() < 1e-3);
                }
            }
        }
        for arch in [pulp::Arch::Scalar, pulp::Arch::new()] {
            arch.dispatch(Both(&shape, &levels, &parameters, &samples));
        }
    }
}
