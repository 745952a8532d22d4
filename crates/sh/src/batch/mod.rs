//! Sixteen vectors side by side: the inner loops.
//!
//! A [`Sh<ORDER, Lanes>`] holds sixteen vectors, coefficient by coefficient, and each function here works on slices of
//! them with the vector instructions of a [`crate::Simd`] level. Call with slices of many blocks: the choice of instructions
//! costs a few nanoseconds for each call. Lanes do not influence one another, so results do not depend on how work is cut
//! into blocks.
//!
//! ```
//! use halflight_sh::{Sh, Simd, batch};
//! use halflight_sh::batch::Lanes;
//!
//! let mut f = [Sh::<4, Lanes>::zero()];
//! for lane in 0..16 {
//!     batch::set_lane(&mut f[0], lane, &Sh::constant(lane as f32));
//! }
//! let mut squares = [Sh::zero()];
//! batch::square(Simd::detect(), &f, &mut squares);
//! assert!((batch::lane(&squares[0], 3).at(glam::Vec3::X) - 9.0).abs() < 1e-5);
//! ```

mod blockers;
mod exponential;
mod kernels;
mod lanes;
mod spheres;

pub use blockers::{CapLanes, accumulate_blockers, accumulate_blockers_at_points};
pub use exponential::exponential;
pub use kernels::{basis, dot, product, rotate_zonal, square};
pub use lanes::{Lanes, WIDTH, lane, set_lane};
pub use spheres::{PointLanes, SphereBlocker, accumulate_spheres, attenuate_spheres};

use crate::Sh;
use crate::simd::Lane;

/// Lanes `part` of a block, as a vector of a level.
#[inline(always)]
fn load<const ORDER: usize, V: Lane>(block: &Sh<ORDER, Lanes>, part: usize) -> Sh<ORDER, V> {
    block.map(|lanes| V::load(&lanes.0[part * V::N..]))
}

#[inline(always)]
fn load_direction<V: Lane>(direction: &[Lanes; 3], part: usize) -> [V; 3] {
    let at = part * V::N;
    [V::load(&direction[0].0[at..]), V::load(&direction[1].0[at..]), V::load(&direction[2].0[at..])]
}

#[inline(always)]
fn store<const ORDER: usize, V: Lane>(values: &Sh<ORDER, V>, block: &mut Sh<ORDER, Lanes>, part: usize) {
    for (lanes, value) in block.coefficients_mut().iter_mut().zip(values.coefficients()) {
        value.store(&mut lanes.0[part * V::N..]);
    }
}
