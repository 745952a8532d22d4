//! Heights from pictures: one number a pixel, as the file has it.
//!
//! | format | value |
//! |---|---|
//! | PNG, JPEG | 0…65535 or 0…255, not scaled, not decoded |
//! | TIFF, GeoTIFF | the number, of 8 to 64 bits, integer or float |
//! | EXR | channel `Y`, `R`, `height`, `displacement`, `Z`, or the only one |
//!
//! Pixels where nothing was measured (the GDAL `NODATA` value, or −32768 as SRTM writes it) are filled from their
//! neighbours and counted.

use std::path::Path;

use halflight_file::{LoadError, read};

use crate::load::{Format, open};
use crate::raster::{self, Raster};
use crate::source::Source;
use crate::{Picture, Plane, geotiff, hdr, voids};

/// A picture of heights.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightImage {
    /// The heights in the unit of the file: metres in a GeoTIFF, steps of the scale in a PNG.
    pub plane: Plane,
    /// How many pixels had no measurement and were filled from their neighbours.
    pub filled_voids: usize,
    /// The spacing of columns and of rows, if the file tells its place on Earth.
    pub metres_per_pixel: Option<[f64; 2]>,
}

const ASKED: &str = "height field";

/// SRTM's mark for pixels that the radar did not see; no land is so low.
const SRTM_VOID: f64 = -32768.0;

/// The heights in a picture file.
///
/// # Errors
/// Damage, a colour picture whose channels differ, a non-finite height that is not declared void, nothing but
/// voids.
pub fn load_height(path: &Path) -> Result<HeightImage, LoadError> {
    decode_height(&read(path, ASKED)?, path)
}

/// [`load_height`] from memory; `name` is for the error.
///
/// # Errors
/// As [`load_height`].
pub fn decode_height(bytes: &[u8], name: &Path) -> Result<HeightImage, LoadError> {
    let (format, source) = open(bytes, name)?;
    let (width, height, values, tags) = match format {
        Format::Exr => {
            let picture = Picture::decode_exr(bytes, name)?;
            let values = height_channel(&picture, &source)?.iter().map(|&v| v.into()).collect();
            (picture.width, picture.height, values, None)
        }
        Format::Hdr => {
            let image = hdr::decode(&source)?;
            let values =
                first_channel(image.pixels.as_flattened().iter().map(|&v| v.into()).collect(), 3, &source)?;
            (image.width, image.height, values, None)
        }
        Format::Png | Format::Jpeg => {
            let decode = if format == Format::Png { raster::decode_png } else { raster::decode_jpeg };
            let raster = decode(&source)?;
            (raster.width, raster.height, single(&raster, &source)?, None)
        }
        Format::Tiff => {
            let (raster, tags) = raster::decode_tiff(&source)?;
            (raster.width, raster.height, single(&raster, &source)?, Some(tags))
        }
    };
    let declared =
        tags.as_ref().and_then(|tags| tags.void.as_deref()).and_then(|text| text.trim().parse::<f64>().ok());
    let is_void = |v: f64| match declared {
        // The tag is text in decimal, the pixels may be single floats.
        Some(void) => v == void || (v as f32) == (void as f32) || (void.is_nan() && v.is_nan()),
        None => false,
    };
    let mut valid = Vec::with_capacity(values.len());
    for (index, &value) in values.iter().enumerate() {
        let void = is_void(value) || value == SRTM_VOID;
        if !void && !(value as f32).is_finite() {
            let found = format!("pixel ({}, {}): the height is {value}", index % width, index / width);
            return Err(source.error(found).hint("declare the void value in the GDAL_NODATA tag"));
        }
        valid.push(!void);
    }
    let filled_voids = valid.iter().filter(|&&v| !v).count();
    if filled_voids == values.len() {
        return Err(source.error("every pixel is void: there are no heights in it"));
    }
    let mut plane = Plane { width, height, values: values.iter().map(|&v| v as f32).collect() };
    voids::fill(&mut plane, &valid);
    let metres_per_pixel = tags.and_then(|tags| geotiff::metres_per_pixel(&tags, [width, height]));
    Ok(HeightImage { plane, filled_voids, metres_per_pixel })
}

fn height_channel<'a>(picture: &'a Picture, source: &Source) -> Result<&'a [f32], LoadError> {
    const NAMES: [&str; 6] = ["Y", "R", "height", "displacement", "Z", "depth.Z"];
    let named =
        NAMES.iter().find_map(|name| picture.channels.iter().find(|c| c.name.eq_ignore_ascii_case(name)));
    let only = if let [only] = picture.channels.as_slice() { Some(only) } else { None };
    only.or(named).map(|c| c.values.as_slice()).ok_or_else(|| {
        let names: Vec<&str> = picture.channels.iter().map(|c| c.name.as_str()).collect();
        let error = source.error(format!("no heights among its channels: {}", names.join(", ")));
        error.hint(format!("call the channel one of {}", NAMES.join(", ")))
    })
}

fn single(raster: &Raster, source: &Source) -> Result<Vec<f64>, LoadError> {
    // Alpha is none of the heights' business.
    let colors = if raster.channels.is_multiple_of(2) { raster.channels - 1 } else { raster.channels };
    let raw = raster.raw();
    if raster.channels == colors {
        return first_channel(raw, colors, source);
    }
    let without_alpha = raw.chunks_exact(raster.channels).flat_map(|p| p[..colors].iter().copied()).collect();
    first_channel(without_alpha, colors, source)
}

/// The one channel of a grey picture, or of a colour picture that is grey.
fn first_channel(values: Vec<f64>, channels: usize, source: &Source) -> Result<Vec<f64>, LoadError> {
    if channels == 1 {
        return Ok(values);
    }
    if values.chunks_exact(channels).any(|p| p.iter().any(|v| v.to_bits() != p[0].to_bits())) {
        let error = source.error("it is a colour picture; which channel holds the heights cannot be told");
        return Err(error.hint("save it as grey"));
    }
    Ok(values.chunks_exact(channels).map(|p| p[0]).collect())
}
