//! Damaged, truncated, lying and non-finite files: each gives an error, at once, and nothing panics.
#![allow(clippy::unwrap_used)]

mod seeds;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use halflight_image::{
    ColorSpace, Picture, Precision, decode_height, decode_rgb, decode_texture, encode_hdr, load_rgb,
};
use seeds::{FORMATS, Random, drive};

/// Mutations of the seeds of each format; `HALFLIGHT_MUTATIONS=100000` makes it a night's work.
fn mutations() -> usize {
    std::env::var("HALFLIGHT_MUTATIONS").ok().and_then(|text| text.parse().ok()).unwrap_or(400)
}

fn error(bytes: &[u8], name: &str) -> String {
    let start = Instant::now();
    let error = decode_rgb(bytes, Path::new(name)).expect_err(name).to_string();
    assert!(start.elapsed() < Duration::from_secs(1), "{name} took {:?}", start.elapsed());
    assert!(error.contains(name), "{error}");
    error
}

#[test]
fn every_seed_is_a_valid_file() {
    for seed in seeds::all() {
        let (bytes, name) = (&seed.bytes, Path::new(seed.name));
        assert!(decode_rgb(bytes, name).is_ok() || decode_height(bytes, name).is_ok(), "{}", seed.name);
    }
}

#[test]
fn a_file_cut_short_anywhere_is_an_error_or_complete_but_never_a_panic() {
    for seed in seeds::all() {
        let step = (seed.bytes.len() / 400).max(1);
        for length in (0..seed.bytes.len()).step_by(step) {
            drive(&seed.bytes[..length]);
        }
        // Half of the file cannot be all of the picture.
        let half = &seed.bytes[..seed.bytes.len() / 2];
        assert!(decode_rgb(half, Path::new(seed.name)).is_err(), "{}", seed.name);
    }
}

#[test]
fn a_tiff_or_exr_that_was_cut_short_is_said_to_be_cut_short() {
    let mut seen = 0;
    for seed in seeds::all().into_iter().filter(|s| s.name.ends_with("exr") || s.name.contains("tif")) {
        // A directory or pixels go missing; a part that is not asked for may.
        let cut = &seed.bytes[..seed.bytes.len() - 20];
        let Err(error) = decode_rgb(cut, Path::new(seed.name)) else { continue };
        assert!(error.to_string().contains("cut short"), "{error}");
        seen += 1;
    }
    assert!(seen >= 4, "{seen}");
}

#[test]
fn a_flipped_byte_anywhere_never_panics() {
    for seed in seeds::all() {
        let step = (seed.bytes.len() / 300).max(1);
        for place in (0..seed.bytes.len()).step_by(step) {
            for flip in [0xff, 0x80, 0x01] {
                let mut bytes = seed.bytes.clone();
                bytes[place] ^= flip;
                drive(&bytes);
            }
        }
    }
    // The seeds are a kilobyte each: whatever a flipped byte makes of their headers, a small picture is the most
    // that is believed.
    assert!(peak_mebibytes().is_none_or(|peak| peak < 600), "{:?} MiB", peak_mebibytes());
}

#[test]
fn large_pictures_of_nothing_are_refused_before_they_are_unpacked() {
    // 81 million pixels, as well packed as deflate can.
    let size = 9000;
    let mut bytes = Vec::new();
    let kind = image::ExtendedColorType::L8;
    let (best, plain) = (image::codecs::png::CompressionType::Best, image::codecs::png::FilterType::NoFilter);
    let encoder = image::codecs::png::PngEncoder::new_with_quality(&mut bytes, best, plain);
    image::ImageEncoder::write_image(encoder, &vec![0; size * size], size as u32, size as u32, kind).unwrap();
    assert!(bytes.len() < size * size / 200, "{}", bytes.len());
    let message = error(&bytes, "nothing.png");
    assert!(message.contains("9000 × 9000 pixels in only"), "{message}");
    let message = error(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 30000 +X 30000\n", "vast.hdr");
    assert!(message.contains("the limit is 2^28"), "{message}");
}

/// Linux tells the most memory a process ever held; elsewhere there is nothing to ask.
fn peak_mebibytes() -> Option<usize> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(peak.split_whitespace().next()?.parse::<usize>().ok()? / 1024)
}

#[test]
fn seeded_mutations_of_every_format_never_panic() {
    for (k, format) in FORMATS.iter().enumerate() {
        let pool: Vec<Vec<u8>> =
            seeds::all().into_iter().filter(|s| s.target == *format).map(|s| s.bytes).collect();
        let mut random = Random(k as u64);
        for _ in 0..mutations() {
            let mut bytes = pool[random.below(pool.len())].clone();
            mutate(&mut bytes, &mut random, &pool);
            drive(&bytes);
        }
    }
}

/// A few of the things that fuzzers do: flips, extreme numbers, pieces cut, doubled and borrowed.
fn mutate(bytes: &mut Vec<u8>, random: &mut Random, pool: &[Vec<u8>]) {
    for _ in 0..1 + random.below(4) {
        if bytes.is_empty() {
            return;
        }
        let at = random.below(bytes.len());
        match random.below(6) {
            0 => bytes[at] = random.below(256) as u8,
            1 => bytes[at] ^= 1 << random.below(8),
            2 => {
                let extreme = [0_u32, 1, 0x7fff_ffff, 0x8000_0000, 0xffff_ffff, 0x0001_0000][random.below(6)];
                let value = if random.below(2) == 0 { extreme.to_le_bytes() } else { extreme.to_be_bytes() };
                for (byte, new) in bytes[at..].iter_mut().zip(value) {
                    *byte = new;
                }
            }
            3 => {
                let end = (at + 1 + random.below(16)).min(bytes.len());
                bytes.drain(at..end);
            }
            4 => {
                let end = (at + 1 + random.below(16)).min(bytes.len());
                let piece = bytes[at..end].to_vec();
                bytes.splice(at..at, piece);
            }
            _ => {
                let other = &pool[random.below(pool.len())];
                let from = random.below(other.len());
                bytes.truncate(at);
                bytes.extend(&other[from..]);
            }
        }
    }
}

fn corpus() -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../fuzz/corpus")).to_path_buf()
}

#[test]
fn the_corpus_of_the_fuzzers_never_panics() {
    for format in FORMATS {
        let Ok(entries) = std::fs::read_dir(corpus().join(format)) else {
            eprintln!("skipped: there is no corpus for {format}");
            continue;
        };
        for entry in entries {
            drive(&std::fs::read(entry.unwrap().path()).unwrap());
        }
    }
}

#[test]
fn every_seed_has_its_file_among_those_of_the_fuzzers() {
    if !corpus().is_dir() {
        eprintln!("skipped: there is no {}", corpus().display());
        return;
    }
    for seed in seeds::all() {
        let file = corpus().join(seed.target).join(seed.name);
        assert!(file.is_file(), "{} is missing; the example fuzz_seeds writes it", file.display());
    }
}

#[test]
fn an_empty_file_is_said_to_be_empty() {
    for name in ["a.exr", "a.hdr", "a.png", "a.jpg", "a.tif"] {
        assert!(error(&[], name).contains("empty"));
    }
}

#[test]
fn text_under_a_pictures_name_is_not_a_picture() {
    assert!(error(b"ply\nformat ascii 1.0\n", "a.exr").contains("like no picture"));
    assert!(error(b"hello\n", "a.hdr").contains("header"));
}

#[test]
fn headers_that_claim_a_huge_picture_are_refused_at_once() {
    assert!(error(b"#?RADIANCE\n\n-Y 100000 +X 100000\n\x02\x02\x00\x00", "huge.hdr").contains("100000"));

    let png = [
        b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR".as_slice(),
        &[0, 1, 134, 160, 0, 1, 134, 160, 8, 6, 0, 0, 0],
        &[203, 37, 232, 154],
        b"\0\0\0\0IDAT\x35\xaf\x06\x1e",
    ];
    error(&png.concat(), "huge.png");

    let seed = |name| seeds::all().into_iter().find(|seed| seed.name == name).unwrap().bytes;
    let jpeg = patched(seed("rgb.jpg"), &[0xff, 0xc0, 0, 17, 8], 5, &[0xff, 0xff, 0xff, 0xff]);
    error(&jpeg, "huge.jpg");

    // The data and display windows of an EXR: xMax and yMax.
    let huge = [99_999_i32.to_le_bytes(), 99_999_i32.to_le_bytes()].concat();
    for name in ["layers_float.exr", "tiles_piz.exr", "plain.exr"] {
        let both = patched(
            patched(seed(name), b"dataWindow\0box2i\0", 29, &huge),
            b"displayWindow\0box2i\0",
            32,
            &huge,
        );
        error(&both, name);
        error(&patched(seed(name), b"dataWindow\0box2i\0", 29, &huge), name);
        error(&patched(seed(name), b"displayWindow\0box2i\0", 32, &huge), name);
    }

    // The first two entries of a TIFF's directory are its width and height, in either order.
    for name in ["float_lzw.tif", "rgb8_deflate.tif"] {
        let mut bytes = seed(name);
        let directory = u32::from_le_bytes(bytes[4..8].try_into().unwrap()) as usize + 2;
        for entry in 0..12 {
            let at = directory + entry * 12;
            if matches!(bytes[at..at + 2], [0, 1] | [1, 1]) {
                bytes[at + 2..at + 12].copy_from_slice(&[4, 0, 1, 0, 0, 0, 160, 134, 1, 0]);
            }
        }
        error(&bytes, name);
    }
}

/// The file with bytes replaced at an offset from the start of a mark in it.
fn patched(mut bytes: Vec<u8>, mark: &[u8], offset: usize, new: &[u8]) -> Vec<u8> {
    let start = bytes.windows(mark.len()).position(|w| w == mark).unwrap() + offset;
    bytes[start..start + new.len()].copy_from_slice(new);
    bytes
}

#[test]
fn a_pixel_that_is_not_finite_is_named() {
    for (value, word) in [(f32::NAN, "NaN"), (f32::INFINITY, "inf"), (f32::NEG_INFINITY, "-inf")] {
        let mut picture = Picture::new(5, 4);
        let mut green = vec![0.5; 20];
        green[13] = value;
        for (name, values) in [("R", vec![0.5; 20]), ("G", green.clone()), ("B", vec![0.5; 20])] {
            picture.push(name, values);
        }
        let bytes = picture.encode_exr(Precision::Half).unwrap();
        let found = error(&bytes, "light.exr");
        assert!(found.contains("pixel (3, 2)") && found.contains(&format!("green is {word}")), "{found}");
        assert!(decode_texture(&bytes, Path::new("light.exr"), ColorSpace::Linear).is_err());
        assert!(
            Picture::decode_exr(&bytes, Path::new("light.exr")).is_ok(),
            "layers may hold infinite depth"
        );

        let tiff = seeds::tiff_floats(&green, 5, 4);
        assert!(error(&tiff, "light.tif").contains("pixel (3, 2)"));
        let height = decode_height(&tiff, Path::new("hills.tif")).unwrap_err().to_string();
        assert!(height.contains("pixel (3, 2)") && height.contains("NODATA"), "{height}");
    }
}

#[test]
fn a_picture_full_of_nan_says_how_many() {
    let tiff = seeds::tiff_floats(&[f32::NAN; 20], 5, 4);
    assert!(error(&tiff, "nan.tif").contains("19 more pixels"));
}

#[test]
fn heights_need_one_channel_and_a_measurement() {
    let color = encode_hdr(&seeds::picture(9, 5));
    let found = decode_height(&color, Path::new("a.hdr")).unwrap_err().to_string();
    assert!(found.contains("colour picture"), "{found}");
    let voids =
        decode_height(&seeds::tiff_floats(&[-32768.0; 6], 3, 2), Path::new("a.tif")).unwrap_err().to_string();
    assert!(voids.contains("every pixel is void"), "{voids}");
}

#[test]
fn signed_samples_are_heights_and_not_colours() {
    assert!(error(&seeds::elevation(6, 4), "hills.tif").contains("height field"));
}

#[test]
fn an_exr_without_colour_lists_what_it_has() {
    let mut picture = Picture::new(2, 2);
    picture.push("depth.Z", vec![1.0; 4]);
    picture.push("normal.X", vec![1.0; 4]);
    let bytes = picture.encode_exr(Precision::Float).unwrap();
    assert!(error(&bytes, "layers.exr").contains("depth.Z, normal.X"));
}

#[test]
fn a_folder_and_a_missing_file_are_errors_that_help() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("meadow.hdr"), b"").unwrap();
    assert!(load_rgb(folder.path()).unwrap_err().to_string().contains("folder"));
    assert!(load_rgb(&folder.path().join("medow.hdr")).unwrap_err().to_string().contains("did you mean"));
}
