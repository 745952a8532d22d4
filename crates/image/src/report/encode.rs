//! Pictures as text: PNG in base64 in a data URI.

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};

/// Eight-bit sRGB bytes, three per pixel, as `data:image/png;base64,…`.
///
/// # Errors
/// The encoder's words, if it refuses (a picture too large for PNG).
pub(super) fn png_uri(
    bytes: &[u8],
    width: usize,
    height: usize,
    filter: FilterType,
) -> Result<String, String> {
    let too_large = |_| format!("{width}×{height} pixels are too many for PNG");
    let columns = u32::try_from(width).map_err(too_large)?;
    let rows = u32::try_from(height).map_err(too_large)?;
    let mut png = Vec::new();
    PngEncoder::new_with_quality(&mut png, CompressionType::Default, filter)
        .write_image(bytes, columns, rows, ExtendedColorType::Rgb8)
        .map_err(|error| error.to_string())?;
    let mut uri = String::from("data:image/png;base64,");
    push_base64(&png, &mut uri);
    Ok(uri)
}

/// Appends the bytes in base64 (RFC 4648 §4, padded).
fn push_base64(bytes: &[u8], out: &mut String) {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    out.reserve(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let [a, b, c] = [0, 1, 2].map(|i| u32::from(group.get(i).copied().unwrap_or(0)));
        let bits = a << 16 | b << 8 | c;
        for digit in 0..4 {
            let index = (bits >> (18 - 6 * digit) & 63) as usize;
            out.push(if digit <= group.len() { char::from(DIGITS[index]) } else { '=' });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_that_of_the_standard() {
        // The test vectors of RFC 4648 §10.
        for (plain, coded) in
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")]
        {
            let mut out = String::new();
            push_base64(plain.as_bytes(), &mut out);
            assert_eq!(out, coded);
        }
    }
}
