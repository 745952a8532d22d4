//! Claims about rays, seen from outside.

mod brute;
mod common;
mod edges;
mod motion;
mod offsets;
mod packets;
mod peer;
mod surfaces;
