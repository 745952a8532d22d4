//! Pictures: in memory, on disk, and compared.
//!
//! | for | take |
//! |---|---|
//! | light and comparisons | [`load_rgb`]: any format, linear Rec. 709, finite |
//! | textures | [`load_texture`]: in the precision of the file, [`TextureImage::texel`] |
//! | terrain | [`load_height`]: raw numbers, voids filled, metres a pixel |
//! | layers of a rendering | [`Picture::load_exr`], [`Picture::save_exr`] |
//! | showing | [`ToneMapping`], [`save_png`], [`save_hdr`] |
//! | judging | [`metrics`], [`report`] |
//!
//! Each loader has a `decode_…` twin that takes bytes.
//!
//! ```
//! use halflight_image::{Picture, Precision, decode_rgb};
//! let mut picture = Picture::new(2, 1);
//! for (name, values) in [("R", [1.0, 0.0]), ("G", [0.5, 0.0]), ("B", [0.25, 0.0]), ("depth.Z", [3.0, 4.0])] {
//!     picture.push(name, values.to_vec());
//! }
//! let file = picture.encode_exr(Precision::Half)?;
//! let light = decode_rgb(&file, "room.exr".as_ref())?;
//! assert_eq!(light.pixels, [[1.0, 0.5, 0.25], [0.0; 3]]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

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
pub use picture::{Channel, ColorSpace, Picture, PicturePart, Plane, RgbImage, Texels, TextureImage};
pub use probe::angular_to_latlong;
pub use srgb::{srgb_decode, srgb_decode_byte, srgb_encode};
pub use tone::{ToneCurve, ToneMapping, encode_hdr, encode_png, save_hdr, save_png, to_srgb_bytes};
