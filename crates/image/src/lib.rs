//! Pictures: in memory, on disk, and compared.

mod picture;

pub use picture::{Channel, ColorSpace, Picture, Plane, RgbImage, Texels, TextureImage};
