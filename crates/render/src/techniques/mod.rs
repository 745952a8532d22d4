//! The techniques, one folder each.

pub mod path;
