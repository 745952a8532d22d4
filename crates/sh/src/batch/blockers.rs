//! Blockers looked up in the table, turned to their directions and added up.

use super::{Lanes, WIDTH, load, load_direction, store};
use crate::simd::{Kernel, Lane, Simd};
use crate::zonal::scale_bands;
use crate::{BlockerTable, Sh};

/// Sixteen blockers as sixteen points, or one point, see them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CapLanes {
    /// Unit directions (x, y, z).
    pub direction: [Lanes; 3],
    /// θ_b in radians.
    pub half_angle: Lanes,
    /// w_b; 0 for a blocker that does not count.
    pub weight: Lanes,
}

/// Weighted log-visibility of the caps of one vector.
#[inline(always)]
pub(crate) fn log_visibility<const ORDER: usize, V: Lane>(
    columns: &[f32],
    direction: [V; 3],
    half_angle: V,
    weight: V,
) -> Sh<ORDER, V> {
    let entries = columns.len() / ORDER;
    let last = V::splat((entries - 1) as f32);
    let to_place = V::splat((entries - 1) as f32 * std::f32::consts::FRAC_2_PI);
    let place = (half_angle * to_place).max(V::splat(0.0)).min(last);
    let below = (place - V::splat(0.5)).round().max(V::splat(0.0)).min(last - V::splat(1.0));
    let t = place - below;
    let mut factors = [V::splat(0.0); ORDER];
    for l in 0..ORDER {
        let column = &columns[l * entries..(l + 1) * entries];
        let (a, b) = (V::gather(column, below), V::gather(column, below + V::splat(1.0)));
        factors[l] = (b - a).mul_add(t, a) * weight;
    }
    let mut sh = Sh::<ORDER, V>::basis(direction);
    scale_bands(&mut sh, &factors);
    sh
}

#[inline(always)]
fn log_visibility_of<const ORDER: usize, V: Lane>(
    columns: &[f32],
    caps: &CapLanes,
    part: usize,
) -> Sh<ORDER, V> {
    let at = part * V::N;
    log_visibility(
        columns,
        load_direction(&caps.direction, part),
        V::load(&caps.half_angle.0[at..]),
        V::load(&caps.weight.0[at..]),
    )
}

struct ForOnePoint<'a, const ORDER: usize> {
    table: &'a BlockerTable<ORDER>,
    caps: &'a [CapLanes],
}

impl<const ORDER: usize> Kernel for ForOnePoint<'_, ORDER> {
    type Output = Sh<ORDER>;
    #[inline(always)]
    fn run<V: Lane>(self) -> Sh<ORDER> {
        let columns = self.table.columns();
        let mut sum = Sh::<ORDER, V>::zero();
        for caps in self.caps {
            for part in 0..WIDTH / V::N {
                sum += log_visibility_of(columns, caps, part);
            }
        }
        sum.map(V::sum)
    }
}

/// Σ w_b log-visibility of many blockers, sixteen in a block, for one point. Fill the last block with weights of 0.
#[must_use]
pub fn accumulate_blockers<const ORDER: usize>(
    simd: Simd,
    table: &BlockerTable<ORDER>,
    caps: &[CapLanes],
) -> Sh<ORDER> {
    simd.run(ForOnePoint { table, caps })
}

struct ForManyPoints<'a, const ORDER: usize> {
    table: &'a BlockerTable<ORDER>,
    caps: &'a [CapLanes],
    logs: &'a mut [Sh<ORDER, Lanes>],
}

impl<const ORDER: usize> Kernel for ForManyPoints<'_, ORDER> {
    type Output = ();
    #[inline(always)]
    fn run<V: Lane>(self) {
        let columns = self.table.columns();
        for (caps, log) in self.caps.iter().zip(self.logs) {
            for part in 0..WIDTH / V::N {
                let mut sum: Sh<ORDER, V> = load(log, part);
                sum += log_visibility_of(columns, caps, part);
                store(&sum, log, part);
            }
        }
    }
}

/// Adds one blocker to many points: `caps[i]` is how the sixteen points of `logs[i]` see it. Panics where the slices
/// differ in length.
pub fn accumulate_blockers_at_points<const ORDER: usize>(
    simd: Simd,
    table: &BlockerTable<ORDER>,
    caps: &[CapLanes],
    logs: &mut [Sh<ORDER, Lanes>],
) {
    assert_eq!(caps.len(), logs.len(), "slices of blocks that belong together have the same length");
    simd.run(ForManyPoints { table, caps, logs });
}
