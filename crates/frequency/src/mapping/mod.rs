//! From cycles per texel to cycles per radian or metre, by the Jacobian of what the texels are laid upon.
//!
//! | | |
//! |---|---|
//! | [`EnvironmentBandwidth`] | latitude–longitude maps: cycles per radian in every direction |
//! | [`angular_map`] | light probes: the same |
//! | [`TextureBandwidth`] | textures on surfaces: cycles per metre, given the derivatives of position by uv |
//! | [`LightBandwidth`] | planar lights, plain or textured: cycles per metre |
//! | [`MaxPyramid`] | the largest value within any box, which errs on the safe side |
//!
//! Source: `[001]` §2.3. The seed divides by the largest eigenvalue of "the Jacobian of spherical coordinates onto the
//! image plane", which is in texels per radian and has to multiply; here all scales are units per texel and divide.

mod environment;
mod light;
mod max_pyramid;
mod texture;

pub use environment::{EnvironmentBandwidth, angular_map};
pub use light::LightBandwidth;
pub use max_pyramid::MaxPyramid;
pub use texture::TextureBandwidth;
