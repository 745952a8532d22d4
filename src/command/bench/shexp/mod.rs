//! `shexp` on the three scenes of its seeds, and how its cost grows.
//!
//! Everything that changes from frame to frame is in the time: posing, skinning, heights, the trees that answer rays, and
//! the picture at one sample a pixel. What is prepared once (the fit of the spheres, tables) is not.

mod growth;
mod scenes;

pub(super) use growth::measure as growth;
pub(super) use scenes::measure as scenes;
