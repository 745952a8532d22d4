//! Radiance HDR (RGBE): three mantissas of eight bits that share an exponent, `value = m · 2^(e − 136)`.
//!
//! Source: Ward, "Real Pixels", Graphics Gems II, 1991, and the file formats page of Radiance. The relative error
//! of the largest channel is at most 2⁻⁸ (half a step of a mantissa in 128…255); of the others it is as large as
//! they are small beside it.
//!
//! The `image` crate reads only the standard orientation and stops at header lines it does not know; this reader
//! takes all eight orientations, both run-length schemes, flat pixels, `XYZE`, and header lines of any kind.
//! `EXPOSURE` and `COLORCORR` are left alone, as the other renderers do: the pixels are taken as they stand.

mod read;
mod write;

pub(crate) use read::decode;
pub(crate) use write::encode;

pub(crate) const ASKED: &str = "Radiance HDR picture";

type Rgbe = [u8; 4];
