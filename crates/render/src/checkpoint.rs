//! Films on disk: a render that was cut short goes on from its checkpoint, and ends with the bits that one without a
//! break would have.
//!
//! **Format.** The line `halflight checkpoint 1`, a line with the identity of the render, a line `WIDTH HEIGHT`, then
//! per pixel in the order of the film's tiles: the sums of R, G, B and of squared luminance as little-endian f64 and
//! the number of samples as little-endian u32; per tile the number of non-finite samples as u64; last an FNV-1a hash
//! of everything before it as u64.
//!
//! The identity is whatever must be the same for the samples to be the same: the caller hashes the scene, the technique
//! and its settings, the seed, the frame, the instruction set.

use std::io::Write;
use std::path::Path;

use halflight_file::{LoadError, SaveError, read, write_whole};

use crate::film::{Film, Pixel};

const ASKED: &str = "checkpoint";
const MAGIC: &str = "halflight checkpoint 1";
const PIXEL_BYTES: usize = 4 * 8 + 4;

/// Writes the film; the file is whole or absent.
///
/// # Errors
/// If the file cannot be written.
pub fn save(path: &Path, identity: &str, film: &Film) -> Result<(), SaveError> {
    let mut bytes = format!("{MAGIC}\n{identity}\n{} {}\n", film.width(), film.height()).into_bytes();
    for tile in film.tiles() {
        for pixel in &tile.pixels {
            for value in pixel.sum.iter().chain([&pixel.sum_squares]) {
                bytes.extend_from_slice(&value.to_le_bytes());
            }
            bytes.extend_from_slice(&pixel.samples.to_le_bytes());
        }
        bytes.extend_from_slice(&tile.non_finite.to_le_bytes());
    }
    bytes.extend_from_slice(&fnv1a(&bytes).to_le_bytes());
    write_whole(path, ASKED, |writer| writer.write_all(&bytes))
}

/// Reads a film of `width` × `height` pixels that was saved under the same identity.
///
/// # Errors
/// If the file cannot be read, is damaged, or belongs to another render.
pub fn load(path: &Path, identity: &str, width: usize, height: usize) -> Result<Film, LoadError> {
    load_into(path, identity, Film::new(width, height))
}

/// [`load`] into an empty film of the same size and region.
///
/// # Errors
/// As [`load`].
pub fn load_into(path: &Path, identity: &str, film: Film) -> Result<Film, LoadError> {
    decode_into(&read(path, ASKED)?, path, identity, film)
}

/// [`load`] from memory; `path` is for the error.
///
/// # Errors
/// As [`load`].
pub fn decode(
    bytes: &[u8],
    path: &Path,
    identity: &str,
    width: usize,
    height: usize,
) -> Result<Film, LoadError> {
    decode_into(bytes, path, identity, Film::new(width, height))
}

fn decode_into(bytes: &[u8], path: &Path, identity: &str, mut film: Film) -> Result<Film, LoadError> {
    let (width, height) = (film.width(), film.height());
    let error = |found: &str| LoadError::new(ASKED, path, found).hint("start again without --resume");
    let damaged = || error("the file is damaged or cut short");
    let (body, hash) = bytes.split_last_chunk::<8>().ok_or_else(damaged)?;
    let mut rest = body;
    if next_line(&mut rest) != Some(MAGIC) {
        return Err(error("this is not a checkpoint of this version"));
    }
    if fnv1a(body) != u64::from_le_bytes(*hash) {
        return Err(damaged());
    }
    if next_line(&mut rest) != Some(identity) {
        return Err(error("it belongs to another scene, frame, technique, setting, seed or instruction set"));
    }
    if next_line(&mut rest) != Some(&format!("{width} {height}")) {
        return Err(error("it belongs to a picture of another size"));
    }
    if rest.len() != film.pixel_count() * PIXEL_BYTES + film.tiles().len() * 8 {
        return Err(damaged());
    }
    for tile in film.tiles_mut() {
        for pixel in &mut tile.pixels {
            let mut value = || f64::from_le_bytes(next_bytes(&mut rest));
            *pixel = Pixel { sum: [value(), value(), value()], sum_squares: value(), samples: 0 };
            pixel.samples = u32::from_le_bytes(next_bytes(&mut rest));
        }
        tile.non_finite = u64::from_le_bytes(next_bytes(&mut rest));
    }
    Ok(film)
}

fn next_line<'a>(rest: &mut &'a [u8]) -> Option<&'a str> {
    let end = rest.iter().position(|&b| b == b'\n')?;
    let (line, tail) = rest.split_at(end);
    *rest = &tail[1..];
    std::str::from_utf8(line).ok()
}

/// The next `N` bytes; the length was checked before.
fn next_bytes<const N: usize>(rest: &mut &[u8]) -> [u8; N] {
    let (head, tail) = rest.split_first_chunk::<N>().expect("the length of a checkpoint was checked");
    *rest = tail;
    *head
}

/// Fowler–Noll–Vo 1a of 64 bits: finds damage, keeps no secrets.
pub fn fnv1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xCBF2_9CE4_8422_2325, |hash, &b| (hash ^ u64::from(b)).wrapping_mul(0x0100_0000_01B3))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn film() -> Film {
        let mut film = Film::new(19, 5);
        for tile in film.tiles_mut() {
            for (i, pixel) in tile.pixels.iter_mut().enumerate() {
                pixel.add(glam::Vec3::new(0.1 * i as f32, 0.7, 1e-20));
            }
            tile.non_finite = 3;
        }
        film
    }

    #[test]
    fn a_film_comes_back_bit_for_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("film");
        save(&path, "scene 12", &film()).unwrap();
        assert_eq!(load(&path, "scene 12", 19, 5).unwrap(), film());
    }

    #[test]
    fn the_seeds_of_the_fuzz_target_are_read_or_refused() {
        let corpus = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../fuzz/corpus/checkpoint"));
        let Ok(entries) = std::fs::read_dir(corpus) else {
            eprintln!("skipped: there is no {}", corpus.display());
            return;
        };
        let mut read = 0;
        for entry in entries.flatten() {
            let bytes = std::fs::read(entry.path()).unwrap();
            read += usize::from(decode(&bytes, Path::new("fuzz"), "fuzz", 19, 5).is_ok());
            for place in (0..bytes.len()).step_by(7) {
                let mut damaged = bytes.clone();
                damaged[place] ^= 0x41;
                assert!(decode(&damaged, Path::new("fuzz"), "fuzz", 19, 5).is_err());
            }
        }
        assert!(read > 0, "the example checkpoint_seed writes a seed that is read");
    }

    #[test]
    fn a_checkpoint_of_another_render_or_a_damaged_one_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("film");
        save(&path, "scene 12", &film()).unwrap();
        assert!(load(&path, "scene 13", 19, 5).unwrap_err().to_string().contains("another scene"));
        assert!(load(&path, "scene 12", 5, 19).unwrap_err().to_string().contains("another size"));
        let bytes = std::fs::read(&path).unwrap();
        for length in 0..bytes.len() {
            std::fs::write(&path, &bytes[..length]).unwrap();
            assert!(load(&path, "scene 12", 19, 5).is_err());
        }
        for place in (0..bytes.len()).step_by(11) {
            let mut damaged = bytes.clone();
            damaged[place] ^= 0x10;
            std::fs::write(&path, &damaged).unwrap();
            assert!(load(&path, "scene 12", 19, 5).is_err());
        }
    }
}
