//! `shexp` on three moving scenes: its cost, its error, and how the cost grows.
//!
//! Everything that changes from frame to frame is in the time: posing, skinning, heights, the trees that answer rays, and
//! the picture at one sample a pixel. What is prepared once (the fit of the spheres, tables) is not.

mod errors;
mod growth;
mod scenes;

pub(super) use errors::measure as errors;
pub(super) use growth::measure as growth;
pub(super) use scenes::measure as scenes;
