//! Maps from the unit square to the shapes that lights and lenses are sampled over, and tables for discrete choices.

use glam::{Vec2, Vec3};

/// Shirley and Chiu's concentric map of the unit square to the unit disk: area keeps its share, neighbours stay
/// neighbours.
pub fn concentric_disk(u: Vec2) -> Vec2 {
    let offset = 2.0 * u - Vec2::ONE;
    if offset == Vec2::ZERO {
        return Vec2::ZERO;
    }
    let (radius, angle) = if offset.x.abs() > offset.y.abs() {
        (offset.x, std::f32::consts::FRAC_PI_4 * (offset.y / offset.x))
    } else {
        (offset.y, std::f32::consts::FRAC_PI_2 - std::f32::consts::FRAC_PI_4 * (offset.x / offset.y))
    };
    let (sin, cos) = angle.sin_cos();
    radius * Vec2::new(cos, sin)
}

/// A uniform direction on the sphere.
pub fn uniform_sphere(u: Vec2) -> Vec3 {
    let z = 1.0 - 2.0 * u.x;
    let radius = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = (std::f32::consts::TAU * u.y).sin_cos();
    Vec3::new(radius * cos, radius * sin, z)
}

/// A discrete distribution that is inverted in expected constant time and keeps the order of its entries, so that
/// stratified numbers choose stratified entries (which the alias method would not).
///
/// The cumulative weights stand in one array; a guide of equally many entries says where the search for a number
/// in [k/n, (k+1)/n) begins (Chen and Asau, 1974).
#[derive(Clone, Debug)]
pub struct Choice {
    /// `cumulative[i]` is the probability of an entry before i; one more than there are entries, the last is 1.
    cumulative: Vec<f32>,
    guide: Vec<u32>,
}

impl Choice {
    /// A distribution in proportion to `weights`, or uniform if they sum to zero or not to a finite number.
    /// `None` if there are none.
    pub fn new(weights: impl ExactSizeIterator<Item = f64>) -> Option<Self> {
        let count = weights.len();
        if count == 0 {
            return None;
        }
        let mut sums = Vec::with_capacity(count + 1);
        let mut sum = 0.0;
        sums.push(0.0);
        for weight in weights {
            sum += weight.max(0.0);
            sums.push(sum);
        }
        if !(sum > 0.0 && sum.is_finite()) {
            sums = (0..=count).map(|i| i as f64).collect();
            sum = count as f64;
        }
        let mut cumulative: Vec<f32> = sums.iter().map(|s| (s / sum) as f32).collect();
        cumulative[count] = 1.0;
        let mut guide = Vec::with_capacity(count);
        let mut entry = 0;
        for k in 0..count {
            while cumulative[entry + 1] <= k as f32 / count as f32 && entry + 1 < count {
                entry += 1;
            }
            guide.push(entry as u32);
        }
        Some(Self { cumulative, guide })
    }

    /// How many entries there are.
    pub fn len(&self) -> usize {
        self.guide.len()
    }

    /// Whether there are no entries; a choice never is empty.
    pub fn is_empty(&self) -> bool {
        self.guide.is_empty()
    }

    /// The entry that `u` in [0, 1) chooses, its probability, and a fresh number in [0, 1) made of what is left of `u`.
    #[inline]
    pub fn sample(&self, u: f32) -> (usize, f32, f32) {
        let count = self.guide.len();
        let mut entry = self.guide[((u * count as f32) as usize).min(count - 1)] as usize;
        while entry + 1 < count && self.cumulative[entry + 1] <= u {
            entry += 1;
        }
        // The guide is rounded as u · n is: step back where that went one entry too far.
        while entry > 0 && self.cumulative[entry] > u {
            entry -= 1;
        }
        let probability = self.probability(entry);
        let rest = if probability > 0.0 { (u - self.cumulative[entry]) / probability } else { 0.5 };
        (entry, probability, rest.clamp(0.0, 1.0 - f32::EPSILON))
    }

    /// The probability of an entry.
    #[inline]
    pub fn probability(&self, entry: usize) -> f32 {
        self.cumulative[entry + 1] - self.cumulative[entry]
    }

    /// Memory it takes.
    pub fn memory_bytes(&self) -> usize {
        4 * (self.cumulative.len() + self.guide.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_choice_returns_entries_in_proportion_and_in_order() {
        let weights = [0.0, 1.0, 0.0, 3.0, 4.0, 0.0];
        let choice = Choice::new(weights.into_iter()).unwrap();
        let mut counts = [0usize; 6];
        let mut last = 0;
        for i in 0..8000 {
            let (entry, probability, rest) = choice.sample((i as f32 + 0.5) / 8000.0);
            assert!(entry >= last && (0.0..1.0).contains(&rest));
            assert!((f64::from(probability) - weights[entry] / 8.0).abs() < 1e-6);
            counts[entry] += 1;
            last = entry;
        }
        assert_eq!(counts, [0, 1000, 0, 3000, 4000, 0]);
        assert!(Choice::new([0.0; 0].into_iter()).is_none());
        assert_eq!(Choice::new([0.0, 0.0].into_iter()).unwrap().probability(1), 0.5);
    }

    #[test]
    fn the_largest_number_below_one_chooses_an_entry_that_can_occur() {
        let choice = Choice::new([1.0, 1.0, 1e-12, 0.0].into_iter()).unwrap();
        for u in [0.0, 0.5, 0.999_999_94] {
            let (entry, probability, _) = choice.sample(u);
            assert!(probability > 0.0, "{u} {entry}");
        }
    }
}
