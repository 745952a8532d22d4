//! Surface scattering: what a surface does with light, evaluated, sampled and with densities.
//!
//! A [`Material`] is what a scene describes; at a point of a surface it gives a [`Bsdf`], a small value with its
//! textures looked up, which answers three questions: how much light goes from one direction to another
//! ([`Bsdf::eval`]), where to look for light ([`Bsdf::sample`]), and how densely it looks there ([`Bsdf::pdf`]).
//!
//! # Conventions
//! - Directions stand in the **local frame**: +z is the shading normal, x the tangent. Both `wo` (to the viewer)
//!   and `wi` (to the light) have unit length and point **away from** the surface.
//! - [`Bsdf::eval`] is the scattering function **times |cos θ| of `wi`**; densities are per solid angle.
//! - Colours are linear Rec. 709.
//! - **Roughness**: the width of a microfacet distribution is α = roughness², for every material here.
//! - **Two-sided** unless told otherwise: an opaque surface seen from behind scatters as from the front.
//!   Dielectrics read `wo.z < 0` as "from inside".
//! - **Opacity** below one lets that part of the light go straight through: a delta function beside the others, which
//!   only sampling the material finds.
//! - **Refraction scales radiance**: what goes through the border of two media is multiplied by
//!   (n of the viewer's side / n of the light's side)², as the conservation of radiance / n² demands.
//!
//! ```
//! use glam::{Vec2, Vec3};
//! use halflight_material::{Material, SurfaceInput};
//! let clay = Material::diffuse(Vec3::new(0.8, 0.4, 0.3));
//! let bsdf = clay.bsdf(&SurfaceInput::default());
//! let sample = bsdf.sample(Vec3::Z, 0.5, Vec2::new(0.3, 0.6)).expect("a diffuse surface always scatters");
//! assert!((sample.weight - Vec3::new(0.8, 0.4, 0.3)).length() < 1e-6);
//! ```

mod bsdf;
mod conductor;
mod dielectric;
mod diffuse;
mod footprint;
mod fresnel;
mod input;
mod low_frequency;
mod material;
mod merl;
mod metallic_roughness;
mod metals;
mod microfacet;
mod mix;
mod phase;
mod phong;
mod sampling;
pub mod test_kit;
mod texture;

pub use bsdf::{Bsdf, BsdfSample};
pub use footprint::{Footprint, Levels};
pub use input::{ColorInput, NormalMap, Opacity, ScalarInput, SurfaceInput};
pub use low_frequency::LowFrequency;
pub use material::{ConductorColor, Material, MaterialKind};
pub use merl::{AlbedoAt, Lookup, MeasuredBrdf, MeasuredInfo, merl_bytes, write_merl};
pub use metals::{metal, metal_names};
pub use sampling::concentric_disk;
pub use texture::{Texture, UvTransform, Wrap};
