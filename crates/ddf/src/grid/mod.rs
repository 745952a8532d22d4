//! The cells that the surface passes through, and the vertices of several grids that carry what is learned.
//!
//! The mesh, scaled into the unit sphere, lies in a cube of R³ cells; *grid space* counts in cells. A ray is marched
//! from one occupied cell to the next ([`Cells::walk`]); empty blocks of 4³ cells are passed over in one step. Features
//! live at the vertices of occupied cells only ([`Level`]): a bit for each vertex of a block of 4³, and the number of
//! vertices before the block, so that the place of a vertex is one addition and one count of bits.

mod cells;
mod level;

pub(crate) use cells::{Cells, Chord};
pub(crate) use level::Level;
