//! The default exponential, block by block.

use super::{Lanes, WIDTH, load, store};
use crate::exponential::{MOST_SQUARINGS, second_degree};
use crate::sh::SQRT_4PI;
use crate::simd::{Kernel, Lane, Simd};
use crate::{Exponential, Sh};

struct Squaring<'a, const ORDER: usize> {
    threshold: f32,
    /// k of all lanes, or by `threshold` for each lane.
    fixed: Option<u32>,
    f: &'a [Sh<ORDER, Lanes>],
    out: &'a mut [Sh<ORDER, Lanes>],
}

impl<const ORDER: usize> Kernel for Squaring<'_, ORDER> {
    type Output = ();
    #[inline(always)]
    fn run<V: Lane>(self) {
        for (f, out) in self.f.iter().zip(self.out) {
            for part in 0..WIDTH / V::N {
                let e = exp(load::<ORDER, V>(f, part), self.threshold, self.fixed);
                store(&e, out, part);
            }
        }
    }
}

/// exp(f₀/√4π) · (PS-2(f̂/2ᵏ))^(2ᵏ), k of each lane its own.
#[inline(always)]
pub(crate) fn exp<const ORDER: usize, V: Lane>(
    mut f: Sh<ORDER, V>,
    threshold: f32,
    fixed: Option<u32>,
) -> Sh<ORDER, V> {
    let scale = (f[0] * V::splat((1.0 / SQRT_4PI) as f32)).exp();
    f[0] = V::splat(0.0);
    let (mut shrink, mut squarings, mut most) = (V::splat(1.0), V::splat(0.0), 0);
    match fixed {
        Some(count) => {
            most = count;
            shrink = V::splat(0.5f32.powi(count as i32));
            squarings = V::splat(count as f32);
        }
        None => {
            let limit = V::splat(threshold);
            let mut norm = f.dot(&f).sqrt();
            while most < MOST_SQUARINGS && V::any(norm.gt(limit)) {
                let large = norm.gt(limit);
                norm = V::select(large, norm * V::splat(0.5), norm);
                shrink = V::select(large, shrink * V::splat(0.5), shrink);
                squarings = V::select(large, squarings + V::splat(1.0), squarings);
                most += 1;
            }
        }
    }
    let mut e = second_degree(&(f * shrink));
    for done in 0..most {
        let more = squarings.gt(V::splat(done as f32));
        let square = e.square_inlined();
        e = Sh::from_fn(|i| V::select(more, square[i], e[i]));
    }
    e * scale
}

/// exp f of each vector. [`Exponential::Squaring`] and [`Exponential::FixedSquaring`] are vectorised; the other forms run
/// one vector after the other. Panics where the slices differ in length.
pub fn exponential<const ORDER: usize>(
    simd: Simd,
    form: Exponential,
    f: &[Sh<ORDER, Lanes>],
    out: &mut [Sh<ORDER, Lanes>],
) {
    assert_eq!(f.len(), out.len(), "slices of blocks that belong together have the same length");
    match form {
        Exponential::Squaring { threshold } => simd.run(Squaring { threshold, fixed: None, f, out }),
        Exponential::FixedSquaring { squarings } => {
            simd.run(Squaring { threshold: 0.0, fixed: Some(squarings.min(MOST_SQUARINGS)), f, out });
        }
        other => {
            for (f, out) in f.iter().zip(out) {
                for lane in 0..WIDTH {
                    super::set_lane(out, lane, &other.apply(&super::lane(f, lane)));
                }
            }
        }
    }
}
