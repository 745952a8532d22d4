//! Covariance matrices: operators against transforms of light fields, and chains of them.

mod chains;
mod operators;
mod support;
