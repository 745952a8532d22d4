//! The sizes of the fast field.

use serde::{Deserialize, Serialize};

/// How the fast field is built. The defaults are chosen by the experiment of `docs/techniques/ddf.md`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FastShape {
    /// Cells along each side of the bounding cube, a multiple of 4 from 4 to 512.
    pub resolution: u32,
    /// The grids that carry features, as halvings of `resolution`: `[0, 2]` is R and R/4.
    pub levels: Vec<u32>,
    /// Features at each vertex of each grid: 4 or 8.
    pub features: usize,
    /// Points along the ray's part in a cell at which features are interpolated, 2 to 8.
    pub points: usize,
    /// Neurons of a hidden layer: 32 or 64.
    pub hidden: usize,
    /// Hidden layers, 1 to 4.
    pub layers: usize,
    /// How far the ray's part in a cell is lengthened at both ends, in cells, so that what lies between two cells is
    /// seen by both.
    pub margin: f32,
    /// Roundness b of the activation (x + √(x² + b))/2; 0 is ReLU.
    pub roundness: f32,
}

impl Default for FastShape {
    fn default() -> Self {
        FastShape {
            resolution: 128,
            levels: vec![0],
            features: 8,
            points: 3,
            hidden: 32,
            layers: 2,
            margin: 0.1,
            roundness: 0.0,
        }
    }
}

/// Most grids.
pub(crate) const MOST_LEVELS: usize = 4;
/// Most points along a chord.
pub(crate) const MOST_POINTS: usize = 8;
/// Widest input of the network.
pub(crate) const MOST_INPUTS: usize = MOST_LEVELS * MOST_POINTS * 8 + 16;
/// Columns of the output layer, of which three are used: products are 16 wide.
pub(crate) const OUTPUTS: usize = 16;

impl FastShape {
    /// What is wrong with the numbers, as a sentence.
    ///
    /// # Errors
    /// If a number is out of the range that its field names.
    pub fn check(&self) -> Result<(), String> {
        let fits = |name: &str, ok: bool, expected: &str| {
            if ok { Ok(()) } else { Err(format!("`{name}` must be {expected}")) }
        };
        let r = self.resolution;
        fits("resolution", (4..=512).contains(&r) && r.is_multiple_of(4), "a multiple of 4 from 4 to 512")?;
        let levels = &self.levels;
        let rising = levels.windows(2).all(|pair| pair[0] < pair[1]);
        let within = levels.iter().all(|&shift| shift < 9 && (r >> shift) >= 1);
        fits(
            "levels",
            (1..=MOST_LEVELS).contains(&levels.len()) && rising && within,
            "1 to 4 rising halvings",
        )?;
        fits("features", matches!(self.features, 4 | 8), "4 or 8")?;
        fits("points", (2..=MOST_POINTS).contains(&self.points), "from 2 to 8")?;
        fits("hidden", matches!(self.hidden, 32 | 64), "32 or 64")?;
        fits("layers", (1..=4).contains(&self.layers), "from 1 to 4")?;
        fits("margin", (0.0..=0.5).contains(&self.margin), "from 0 to 0.5")?;
        fits("roundness", (0.0..=4.0).contains(&self.roundness), "from 0 to 4")
    }

    /// Features that the network is given: of all points of all grids, the direction, and the length.
    pub(crate) fn used_inputs(&self) -> usize {
        self.levels.len() * self.points * self.features + 4
    }

    /// The same, rounded up to what products work on.
    pub(crate) fn inputs(&self) -> usize {
        self.used_inputs().next_multiple_of(16)
    }

    /// Rows and columns of each layer's weights.
    pub(crate) fn layer_sizes(&self) -> Vec<(usize, usize)> {
        let mut sizes = vec![(self.inputs(), self.hidden)];
        sizes.extend((1..self.layers).map(|_| (self.hidden, self.hidden)));
        sizes.push((self.hidden, OUTPUTS));
        sizes
    }

    /// Numbers that the network holds: weights and biases, layer by layer.
    pub(crate) fn network_len(&self) -> usize {
        self.layer_sizes().iter().map(|(rows, columns)| (rows + 1) * columns).sum()
    }
}
