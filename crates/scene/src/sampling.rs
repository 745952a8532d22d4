//! Maps from the unit square to the shapes that lights and lenses are sampled over, and tables for discrete choices.

use glam::{Vec2, Vec3};
pub use halflight_material::concentric_disk;

/// A uniform direction on the sphere.
pub fn uniform_sphere(u: Vec2) -> Vec3 {
    let z = 1.0 - 2.0 * u.x;
    let radius = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = (std::f32::consts::TAU * u.y).sin_cos();
    Vec3::new(radius * cos, radius * sin, z)
}

/// Fills `cumulative` (one longer than the weights, from 0 to 1) in proportion to `weights`, or evenly if they sum to
/// zero or not to a finite number, and `guide` (as long as the weights) with the places where [`choose`] begins
/// to search: for a number in [k/n, (k+1)/n) at `guide[k]` (Chen and Asau, 1974).
pub(crate) fn cumulative(weights: &[f64], cumulative: &mut [f32], guide: &mut [u32]) {
    let count = weights.len();
    let sum: f64 = weights.iter().map(|w| w.max(0.0)).sum();
    let usable = sum > 0.0 && sum.is_finite();
    let mut running = 0.0;
    cumulative[0] = 0.0;
    for (i, weight) in weights.iter().enumerate() {
        running += weight.max(0.0);
        cumulative[i + 1] = if usable { running / sum } else { (i + 1) as f64 / count as f64 } as f32;
    }
    // Entries after the last one that can occur must not be reached by rounding.
    let last = weights.iter().rposition(|&w| w > 0.0).filter(|_| usable).unwrap_or(count - 1);
    cumulative[last + 1..].fill(1.0);
    let mut entry = 0;
    for (k, guide) in guide.iter_mut().enumerate() {
        while entry + 1 < count && cumulative[entry + 1] <= k as f32 / count as f32 {
            entry += 1;
        }
        *guide = entry as u32;
    }
}

/// The entry that `u` in [0, 1) chooses, and a fresh number in [0, 1) made of what is left of `u`. Expected constant
/// time. It keeps the order of the entries, so that stratified numbers choose stratified entries (which the alias
/// method would not).
#[inline]
pub(crate) fn choose(cumulative: &[f32], guide: &[u32], u: f32) -> (usize, f32) {
    let count = guide.len();
    let mut entry = guide[((u * count as f32) as usize).min(count - 1)] as usize;
    while entry + 1 < count && cumulative[entry + 1] <= u {
        entry += 1;
    }
    // u · n is rounded: step back where that began one entry too late.
    while entry > 0 && cumulative[entry] > u {
        entry -= 1;
    }
    let probability = cumulative[entry + 1] - cumulative[entry];
    let rest = if probability > 0.0 { (u - cumulative[entry]) / probability } else { 0.5 };
    (entry, rest.clamp(0.0, 1.0 - f32::EPSILON))
}

/// A discrete distribution over a few things.
#[derive(Clone, Debug)]
pub struct Choice {
    cumulative: Vec<f32>,
    guide: Vec<u32>,
}

impl Choice {
    /// In proportion to `weights`, or even if they sum to zero or not to a finite number. `None` if there are none.
    pub fn new(weights: &[f64]) -> Option<Self> {
        if weights.is_empty() {
            return None;
        }
        let mut choice = Self { cumulative: vec![0.0; weights.len() + 1], guide: vec![0; weights.len()] };
        cumulative(weights, &mut choice.cumulative, &mut choice.guide);
        Some(choice)
    }

    /// The entry that `u` in [0, 1) chooses, and its probability.
    #[inline]
    pub fn sample(&self, u: f32) -> (usize, f32) {
        let (entry, _) = choose(&self.cumulative, &self.guide, u);
        (entry, self.probability(entry))
    }

    /// The probability of an entry.
    #[inline]
    pub fn probability(&self, entry: usize) -> f32 {
        self.cumulative[entry + 1] - self.cumulative[entry]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_choice_returns_entries_in_proportion_and_in_order() {
        let weights = [0.0, 1.0, 0.0, 3.0, 4.0, 0.0];
        let choice = Choice::new(&weights).unwrap();
        let mut counts = [0usize; 6];
        let mut last = 0;
        for i in 0..8000 {
            let (entry, probability) = choice.sample((i as f32 + 0.5) / 8000.0);
            assert!(entry >= last);
            assert!((f64::from(probability) - weights[entry] / 8.0).abs() < 1e-6);
            counts[entry] += 1;
            last = entry;
        }
        assert_eq!(counts, [0, 1000, 0, 3000, 4000, 0]);
        assert!(Choice::new(&[]).is_none());
        assert_eq!(Choice::new(&[0.0, 0.0]).unwrap().probability(1), 0.5);
    }

    #[test]
    fn the_largest_number_below_one_chooses_an_entry_that_can_occur() {
        let choice = Choice::new(&[1.0, 1.0, 1e-12, 0.0]).unwrap();
        for u in [0.0, 0.5, 0.999_999_94] {
            let (entry, probability) = choice.sample(u);
            assert!(probability > 0.0, "{u} {entry}");
        }
    }
}
