//! Log-visibility of spherical blockers, by half-angle θ_b = asin(r/d).
//!
//! The table (\[004\]) holds the zonal coefficients of log(1 − cap(θ_b)) with eigenvalues floored at 0.02, uniformly in θ_b
//! over [0, 90°], interpolated linearly: 128 entries are within 2e-4 rms (64 entries 1.3e-3). The closed form (\[000\]) is
//! log ε · cap(θ_b); it gives no ε, a fixed one cannot serve small and large blockers alike, and the best fixed one is
//! 0.2 to 0.3. With log ε by half-angle it comes near the table.

use std::f64::consts::FRAC_PI_2;

use crate::attenuation::Cap;
use crate::sh::zonal_factor;
use crate::zonal::scale_bands;
use crate::{Sh, Zh};

/// Log-ZH of the visibility of a cap by its half-angle.
#[derive(Clone, Debug, PartialEq)]
pub struct BlockerTable<const ORDER: usize> {
    /// Entry e holds z_l √(4π/(2l+1)) at e/(entries − 1) · 90°, coefficients together.
    scaled: Vec<[f32; ORDER]>,
    /// The same by coefficient: `columns[l · entries + e]`.
    columns: Vec<f32>,
    series: Series<ORDER>,
}

/// The coefficients of small half-angles as polynomials in q = sin² θ_b, in which they are analytic up to where the first
/// eigenvalue meets its floor: a few multiplications instead of scattered reads.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Series<const ORDER: usize> {
    /// Up to which q it holds; negative if nowhere.
    pub(crate) end: f32,
    /// `terms[l][n]`: what qⁿ is multiplied with.
    pub(crate) terms: [[f32; Series::<1>::TERMS]; ORDER],
}

impl<const ORDER: usize> Series<ORDER> {
    /// Terms of each polynomial.
    pub(crate) const TERMS: usize = 7;
    /// How far it may be from the function, where the greatest coefficients are about 3: as near as the table is.
    const TOLERANCE: f64 = 5e-4;

    /// The widest of some ranges on which polynomials are near enough.
    fn fit(scaled: &impl Fn(f64) -> [f64; ORDER]) -> Self {
        let ends = [0.81, 0.7, 0.6, 0.5, 0.4, 0.3, 0.25, 0.2, 0.15, 0.1, 0.07, 0.05, 0.03, 0.02, 0.01];
        let nowhere = Self { end: -1.0, terms: [[0.0; Series::<1>::TERMS]; ORDER] };
        ends.into_iter().find_map(|end| Self::fit_up_to(end, scaled)).unwrap_or(nowhere)
    }

    /// Interpolation at Chebyshev's nodes, if it is near enough between them.
    fn fit_up_to(end: f64, scaled: &impl Fn(f64) -> [f64; ORDER]) -> Option<Self> {
        const TERMS: usize = Series::<1>::TERMS;
        let at = |q: f64| scaled(q.sqrt().asin());
        let node = |j: usize| (std::f64::consts::PI * (j as f64 + 0.5) / TERMS as f64).cos();
        let nodes: [f64; TERMS] = std::array::from_fn(|j| 0.5 * end * (1.0 + node(j)));
        let values = nodes.map(at);
        let mut terms = [[0.0; TERMS]; ORDER];
        for l in 0..ORDER {
            // Newton's divided differences, then powers of q.
            let mut differences: [f64; TERMS] = std::array::from_fn(|j| values[j][l]);
            for level in 1..TERMS {
                for j in (level..TERMS).rev() {
                    differences[j] = (differences[j] - differences[j - 1]) / (nodes[j] - nodes[j - level]);
                }
            }
            for j in (0..TERMS).rev() {
                for n in (1..TERMS).rev() {
                    terms[l][n] = terms[l][n - 1] - nodes[j] * terms[l][n];
                }
                terms[l][0] = differences[j] - nodes[j] * terms[l][0];
            }
        }
        let near = (0..=128).all(|i| {
            let q = end * f64::from(i) / 128.0;
            at(q).iter().zip(&terms).all(|(value, terms)| {
                let sum = terms.iter().rev().fold(0.0, |sum, term| sum * q + term);
                (sum - value).abs() <= Self::TOLERANCE
            })
        });
        near.then(|| Self { end: end as f32, terms: terms.map(|terms| terms.map(|term| term as f32)) })
    }
}

/// How a closed form chooses log ε.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ClosedForm {
    /// One ε for all; 0.2 to 0.3 is best.
    Fixed {
        /// ε.
        epsilon: f64,
    },
    /// The best log ε of each half-angle, measured at order 4.
    ByAngle,
}

/// (degrees, best log ε at order 4). The first is the limit: exp(log ε cap) ≈ 1 + log ε cap must be 1 − cap.
const BEST_LOG_EPSILON: [(f64, f64); 15] = [
    (0.0, -1.0),
    (1.0, -1.0),
    (10.0, -1.04),
    (15.0, -1.09),
    (20.0, -1.16),
    (25.0, -1.27),
    (30.0, -1.43),
    (35.0, -1.67),
    (40.0, -2.01),
    (45.0, -2.11),
    (50.0, -1.94),
    (60.0, -1.74),
    (70.0, -1.81),
    (80.0, -2.19),
    (90.0, -2.46),
];

impl ClosedForm {
    /// log ε at a half-angle in radians.
    #[must_use]
    pub fn log_epsilon(&self, half_angle: f64) -> f64 {
        match *self {
            ClosedForm::Fixed { epsilon } => epsilon.max(f64::MIN_POSITIVE).ln(),
            ClosedForm::ByAngle => {
                let degrees = half_angle.to_degrees().clamp(0.0, 90.0);
                let above = BEST_LOG_EPSILON.partition_point(|entry| entry.0 < degrees).clamp(1, 14);
                let ((d0, e0), (d1, e1)) = (BEST_LOG_EPSILON[above - 1], BEST_LOG_EPSILON[above]);
                e0 + (e1 - e0) * (degrees - d0) / (d1 - d0)
            }
        }
    }
}

impl<const ORDER: usize> Default for BlockerTable<ORDER> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const ORDER: usize> BlockerTable<ORDER> {
    /// Entries of [`BlockerTable::new`].
    pub const ENTRIES: usize = 128;
    /// Eigenvalue floor of [`BlockerTable::new`].
    pub const FLOOR: f64 = 0.02;

    /// The table with the recommended floor and number of entries. Takes some milliseconds.
    #[must_use]
    pub fn new() -> Self {
        Self::with(Self::ENTRIES, Self::FLOOR)
    }

    /// A table with a number of entries (at least 2) and an eigenvalue floor.
    #[must_use]
    pub fn with(entries: usize, floor: f64) -> Self {
        Self::of(entries, |angle| exact_log_visibility(angle, floor))
    }

    /// The closed form as a table, so that it runs through the same code.
    #[must_use]
    pub fn closed_form(form: ClosedForm) -> Self {
        Self::of(Self::ENTRIES, |angle| closed_form(form, angle))
    }

    fn of(entries: usize, zh: impl Fn(f64) -> Zh<ORDER, f64>) -> Self {
        let entries = entries.max(2);
        let exact = |angle: f64| -> [f64; ORDER] {
            let z = zh(angle);
            std::array::from_fn(|l| z.0[l] * zonal_factor(l))
        };
        let scaled: Vec<[f32; ORDER]> = (0..entries)
            .map(|entry| exact(entry as f64 / (entries - 1) as f64 * FRAC_PI_2).map(|z| z as f32))
            .collect();
        let columns = (0..ORDER).flat_map(|l| scaled.iter().map(move |entry| entry[l])).collect();
        BlockerTable { scaled, columns, series: Series::fit(&exact) }
    }

    /// Number of entries.
    #[must_use]
    pub fn entries(&self) -> usize {
        self.scaled.len()
    }

    /// z_l √(4π/(2l+1)) by coefficient, each `entries` long.
    pub(crate) fn columns(&self) -> &[f32] {
        &self.columns
    }

    pub(crate) fn series(&self) -> &Series<ORDER> {
        &self.series
    }

    #[inline]
    fn lookup_scaled(&self, half_angle: f32) -> [f32; ORDER] {
        let last = self.scaled.len() - 1;
        let place = (half_angle * (last as f32 * std::f32::consts::FRAC_2_PI)).clamp(0.0, last as f32);
        let below = (place as usize).min(last - 1);
        let t = place - below as f32;
        let (mut scaled, next) = (self.scaled[below], &self.scaled[below + 1]);
        for l in 0..ORDER {
            scaled[l] += (next[l] - scaled[l]) * t;
        }
        scaled
    }

    /// Log-ZH of the visibility of a cap; half-angles are clamped to [0, π/2].
    #[must_use]
    pub fn lookup(&self, half_angle: f32) -> Zh<ORDER> {
        let scaled = self.lookup_scaled(half_angle);
        Zh(std::array::from_fn(|l| scaled[l] * (1.0 / zonal_factor(l)) as f32))
    }

    /// Log-visibility of a cap, turned to its direction.
    #[inline]
    #[must_use]
    pub fn log_visibility(&self, cap: &Cap) -> Sh<ORDER> {
        let mut sh = Sh::basis(cap.direction);
        scale_bands(&mut sh, &self.lookup_scaled(cap.half_angle));
        sh
    }
}

/// The entry of the table at an angle, without interpolation: zonal log(1 − cap(θ)).
#[must_use]
pub fn exact_log_visibility<const ORDER: usize>(half_angle: f64, floor: f64) -> Zh<ORDER, f64> {
    (Zh::one() - Zh::cap(half_angle)).log(floor)
}

/// log ε · cap(θ_b) (\[000\]).
#[must_use]
pub fn closed_form<const ORDER: usize>(form: ClosedForm, half_angle: f64) -> Zh<ORDER, f64> {
    Zh::cap(half_angle) * form.log_epsilon(half_angle)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_series_of_small_spheres_is_as_near_as_the_table() {
        fn check<const ORDER: usize>(table: &BlockerTable<ORDER>, least_end: f32) {
            let series = table.series();
            assert!(series.end >= least_end, "order {ORDER}: up to {}", series.end);
            for i in 0..=1000 {
                let q = series.end * i as f32 / 1000.0;
                let looked_up = table.lookup_scaled(q.sqrt().asin());
                for (terms, looked_up) in series.terms.iter().zip(looked_up) {
                    let sum = terms.iter().rev().fold(0.0, |sum, term| sum * q + term);
                    // The table's own error is the greater part.
                    assert!((sum - looked_up).abs() < 4e-3, "order {ORDER}, q = {q}: {sum} {looked_up}");
                }
            }
        }
        check(&BlockerTable::<3>::new(), 0.1);
        check(&BlockerTable::<4>::new(), 0.1);
        check(&BlockerTable::<6>::new(), 0.05);
        check(&BlockerTable::<4>::closed_form(ClosedForm::Fixed { epsilon: 0.1 }), 0.5);
    }
}
