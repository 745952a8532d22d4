//! Rays against everything.

mod ray;

pub use ray::{Hit, Ray, Surface};
