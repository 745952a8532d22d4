//! One door for pictures of any format: the first bytes tell which it is, the extension only when they do not.
//!
//! What comes out is linear Rec. 709. Numbers of limited range (8- and 16-bit PNG, JPEG, integer TIFF) are taken to
//! be sRGB-encoded, floats (EXR, HDR, float TIFF) to be linear; gamma chunks and colour profiles are not applied.
//! A value that is infinite or not a number is an error that names its pixel. Negative values are kept: filters
//! leave them in EXR files, and a comparison must see them. Who makes light of a picture calls
//! [`RgbImage::clamp_negative`].

use std::path::Path;

use halflight_file::{LoadError, extension, read};

use crate::raster::{self, Raster, Samples};
use crate::source::Source;
use crate::{ColorSpace, Picture, RgbImage, Texels, TextureImage, hdr};

/// The formats that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    Exr,
    Hdr,
    Png,
    Jpeg,
    Tiff,
}

const ASKED: &str = "picture";

/// The colours of any picture file, linear.
///
/// # Errors
/// A format that is not known, damage, no colour channels, a non-finite value.
pub fn load_rgb(path: &Path) -> Result<RgbImage, LoadError> {
    decode_rgb(&read(path, ASKED)?, path)
}

/// [`load_rgb`] from memory; `name` is for the error, and its extension for files without a signature.
///
/// # Errors
/// As [`load_rgb`].
pub fn decode_rgb(bytes: &[u8], name: &Path) -> Result<RgbImage, LoadError> {
    let (format, source) = open(bytes, name)?;
    let image = match format {
        Format::Exr => color(&Picture::decode_exr(bytes, name)?, &source)?.0,
        Format::Hdr => hdr::decode(&source)?,
        Format::Png | Format::Jpeg | Format::Tiff => {
            let raster = decode_raster(format, &source)?;
            let pixels = linear(&raster, true, &source)?.into_iter().map(|[r, g, b, _]| [r, g, b]).collect();
            RgbImage { width: raster.width, height: raster.height, pixels }
        }
    };
    check_finite(&image.pixels, image.width, &["red", "green", "blue"], &source)?;
    Ok(image)
}

/// A picture to be looked up texel by texel, in the precision it came in. `space` says what bytes and words mean;
/// floats are linear in any case.
///
/// # Errors
/// As [`load_rgb`].
pub fn load_texture(path: &Path, space: ColorSpace) -> Result<TextureImage, LoadError> {
    decode_texture(&read(path, ASKED)?, path, space)
}

/// [`load_texture`] from memory, such as a picture inside a glTF file; `name` is for the error.
///
/// # Errors
/// As [`load_rgb`].
pub fn decode_texture(bytes: &[u8], name: &Path, space: ColorSpace) -> Result<TextureImage, LoadError> {
    let (format, source) = open(bytes, name)?;
    let floats = |width, height, texels: Vec<[f32; 4]>| {
        check_finite(&texels, width, &["red", "green", "blue", "alpha"], &source)?;
        Ok(TextureImage { width, height, texels: Texels::Floats(texels) })
    };
    match format {
        Format::Exr => {
            let (rgb, alpha) = color(&Picture::decode_exr(bytes, name)?, &source)?;
            let alpha = alpha.into_iter().flatten().chain(std::iter::repeat(1.0));
            let texels = rgb.pixels.iter().zip(alpha).map(|(&[r, g, b], a)| [r, g, b, a]).collect();
            floats(rgb.width, rgb.height, texels)
        }
        Format::Hdr => {
            let rgb = hdr::decode(&source)?;
            floats(rgb.width, rgb.height, rgb.pixels.iter().map(|&[r, g, b]| [r, g, b, 1.0]).collect())
        }
        Format::Png | Format::Jpeg | Format::Tiff => {
            let raster = decode_raster(format, &source)?;
            if let Samples::Bytes(bytes) = &raster.samples {
                let texels = Texels::Bytes(raster.rgba(bytes, 255), space);
                return Ok(TextureImage { width: raster.width, height: raster.height, texels });
            }
            let texels = linear(&raster, space == ColorSpace::Srgb, &source)?;
            floats(raster.width, raster.height, texels)
        }
    }
}

/// Tells the format, and prepares the errors that name it.
pub(crate) fn open<'a>(bytes: &'a [u8], name: &'a Path) -> Result<(Format, Source<'a>), LoadError> {
    let error = |found: String| LoadError::new(ASKED, name, found);
    if bytes.is_empty() {
        return Err(error("the file is empty".into()));
    }
    let format = signature(bytes).or_else(|| match extension(name).as_str() {
        // Old Radiance pictures begin with any comment.
        "hdr" | "pic" | "rgbe" => Some(Format::Hdr),
        _ => None,
    });
    let Some(format) = format else {
        let error = error("it begins like no picture that is known".into());
        return Err(error.hint("EXR, Radiance HDR, PNG, JPEG and TIFF can be read"));
    };
    let asked = match format {
        Format::Exr => "EXR picture",
        Format::Hdr => hdr::ASKED,
        Format::Png => raster::PNG_ASKED,
        Format::Jpeg => raster::JPEG_ASKED,
        Format::Tiff => raster::TIFF_ASKED,
    };
    Ok((format, Source { bytes, name, asked }))
}

fn signature(bytes: &[u8]) -> Option<Format> {
    const SIGNATURES: [(&[u8], Format); 8] = [
        (&[0x76, 0x2f, 0x31, 0x01], Format::Exr),
        (b"#?", Format::Hdr),
        (b"\x89PNG", Format::Png),
        (&[0xff, 0xd8, 0xff], Format::Jpeg),
        (b"II*\0", Format::Tiff),
        (b"MM\0*", Format::Tiff),
        (b"II+\0", Format::Tiff),
        (b"MM\0+", Format::Tiff),
    ];
    SIGNATURES.iter().find(|(magic, _)| bytes.starts_with(magic)).map(|&(_, format)| format)
}

/// Only for the formats of whole-number rows.
fn decode_raster(format: Format, source: &Source) -> Result<Raster, LoadError> {
    match format {
        Format::Png => raster::decode_png(source),
        Format::Jpeg => raster::decode_jpeg(source),
        _ => raster::decode_tiff(source).map(|(raster, _)| raster),
    }
}

fn linear(raster: &Raster, encoded: bool, source: &Source) -> Result<Vec<[f32; 4]>, LoadError> {
    raster.linear(encoded).ok_or_else(|| {
        let error =
            source.error("its samples are measurements (signed or wide integers, or doubles), not colours");
        error.hint("use it as a height field")
    })
}

/// The colour and alpha of a picture: `R`, `G`, `B`, `A`; else those of the first layer that has them; else `Y`;
/// else its only channel, as grey.
fn color(picture: &Picture, source: &Source) -> Result<(RgbImage, Option<Vec<f32>>), LoadError> {
    let find = |name: &str| picture.channels.iter().find(|c| c.name.eq_ignore_ascii_case(name));
    let layers =
        picture.channels.iter().filter_map(|c| c.name.rsplit_once('.').map(|(layer, _)| format!("{layer}.")));
    for layer in std::iter::once(String::new()).chain(layers) {
        let [r, g, b, a] = ["R", "G", "B", "A"].map(|name| find(&format!("{layer}{name}")));
        if let (Some(r), Some(g), Some(b)) = (r, g, b) {
            let rgb = (0..r.values.len()).map(|i| [r.values[i], g.values[i], b.values[i]]).collect();
            let rgb = RgbImage { width: picture.width, height: picture.height, pixels: rgb };
            return Ok((rgb, a.map(|a| a.values.clone())));
        }
    }
    let single = if let [only] = picture.channels.as_slice() { Some(only) } else { None };
    if let Some(gray) = find("Y").or(single) {
        let pixels = gray.values.iter().map(|&v| [v; 3]).collect();
        let alpha = find("A").filter(|a| a.name != gray.name).map(|a| a.values.clone());
        return Ok((RgbImage { width: picture.width, height: picture.height, pixels }, alpha));
    }
    let names: Vec<&str> = picture.channels.iter().map(|c| c.name.as_str()).collect();
    Err(source.error(format!("no colour among its channels: {}", names.join(", "))))
}

fn check_finite<const N: usize>(
    pixels: &[[f32; N]],
    width: usize,
    names: &[&str; N],
    source: &Source,
) -> Result<(), LoadError> {
    let Some(index) = pixels.iter().position(|p| p.iter().any(|v| !v.is_finite())) else { return Ok(()) };
    let bad = pixels.iter().filter(|p| p.iter().any(|v| !v.is_finite())).count();
    let channel = pixels[index].iter().position(|v| !v.is_finite()).unwrap_or(0);
    let (value, name) = (pixels[index][channel], names[channel]);
    let (x, y) = (index % width, index / width);
    let more = if bad == 1 { String::new() } else { format!(", and {} more pixels are like it", bad - 1) };
    let found = format!("pixel ({x}, {y}), counted from the top left corner: {name} is {value}{more}");
    Err(source.error(found).hint("replace values that are not finite before using the picture"))
}
