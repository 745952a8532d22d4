//! The fast field: grids of features at the cells of the surface, and one narrow network for all of them.

pub(crate) mod encode;
pub(crate) mod field;
pub(crate) mod matmul;
pub(crate) mod network;
pub(crate) mod shape;
