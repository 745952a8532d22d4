//! Pictures: in memory, on disk, and compared.

mod exr;
mod geotiff;
mod hdr;
mod height;
mod load;
pub mod metrics;
mod picture;
mod probe;
mod raster;
pub mod report;
mod resize;
mod source;
mod srgb;
mod texel;
mod tone;
mod voids;

pub use crate::exr::Precision;
pub use height::{HeightImage, decode_height, load_height};
pub use load::{decode_rgb, decode_texture, load_rgb, load_texture};
pub use picture::{Channel, ColorSpace, Picture, Plane, RgbImage, Texels, TextureImage};
pub use probe::angular_to_latlong;
pub use srgb::{srgb_decode, srgb_decode_byte, srgb_encode};
pub use tone::{ToneCurve, ToneMapping, encode_hdr, encode_png, save_hdr, save_png, to_srgb_bytes};
