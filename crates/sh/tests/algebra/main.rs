//! The identities that the crate rests on, each against a slow and obvious form.

mod basis;
mod batch;
mod common;
mod log_exp;
mod product;
mod rotation;
mod zonal;
