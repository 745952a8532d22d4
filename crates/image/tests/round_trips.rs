//! What is written comes back.
#![allow(clippy::unwrap_used)]

mod seeds;

use std::path::Path;

use halflight_image::{
    ColorSpace, Picture, Precision, RgbImage, Texels, ToneMapping, decode_height, decode_rgb, decode_texture,
    encode_png, load_rgb, save_hdr, save_png, srgb_decode_byte, to_srgb_bytes,
};

#[test]
fn a_float_exr_comes_back_bit_for_bit_with_its_metadata() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("layers.exr");
    let picture = seeds::layered();
    picture.save_exr(&path, Precision::Float).unwrap();
    let back = Picture::load_exr(&path).unwrap();
    assert_eq!(back.metadata, picture.metadata);
    let names: Vec<&str> = back.channels.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["A", "B", "G", "R", "depth.Z", "material.id", "normal.X", "samples"]);
    for channel in &picture.channels {
        assert_eq!(back.channel(&channel.name), Some(channel.values.as_slice()), "{}", channel.name);
    }
}

#[test]
fn the_same_picture_gives_the_same_bytes() {
    let mut picture = seeds::layered();
    for key in ["scene", "seed", "samples", "seconds", "version"] {
        picture.metadata.insert(key.into(), "1".into());
    }
    let first = picture.encode_exr(Precision::Half).unwrap();
    for _ in 0..8 {
        assert!(picture.clone().encode_exr(Precision::Half).unwrap() == first);
    }
}

#[test]
fn a_half_exr_rounds_colours_but_neither_depth_nor_numbers() {
    let mut picture = seeds::layered();
    picture.push("glow.R", vec![1e9; 35]);
    let bytes = picture.encode_exr(Precision::Half).unwrap();
    let back = Picture::decode_exr(&bytes, Path::new("half.exr")).unwrap();
    for name in ["depth.Z", "material.id", "samples"] {
        assert_eq!(back.channel(name), picture.channel(name), "{name}");
    }
    for (a, b) in back.channel("R").unwrap().iter().zip(picture.channel("R").unwrap()) {
        assert!((a - b).abs() <= b.abs() / 2048.0 && (*b == 0.0 || a != b || (b * 2048.0).fract() == 0.0));
    }
    assert_eq!(back.channel("glow.R").unwrap()[0], 65504.0, "finite light stays finite");
}

#[test]
fn an_exr_that_cannot_be_written_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("no.exr");
    let mut twice = seeds::layered();
    twice.push("R", vec![0.0; 35]);
    for (picture, expected) in [(twice, "two channels"), (Picture::new(4, 4), "nothing to write")] {
        let error = picture.save_exr(&path, Precision::Half).unwrap_err();
        assert!(error.to_string().contains(expected), "{error}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn every_compression_and_layout_of_exr_gives_the_same_pixels() {
    let named = |name: &str| {
        let seed = seeds::all().into_iter().find(|seed| seed.name == name).unwrap();
        decode_rgb(&seed.bytes, Path::new(name)).unwrap()
    };
    let lines = named("lines_rle.exr");
    assert_eq!(lines, named("tiles_piz.exr"));
    let gray = named("plain.exr");
    // B, G, R and A, Y: the second channel in either.
    assert!(gray.pixels.iter().zip(&lines.pixels).all(|(g, l)| g[0] == l[1] && g[2] == l[1]));
    let rough = named("lines_pxr24.exr");
    assert!(rough.pixels.iter().zip(&lines.pixels).all(|(p, l)| p[0] == l[2]), "PXR24 keeps halves");
}

#[test]
fn a_data_window_is_put_in_its_place_in_the_display_window() {
    let seed = seeds::all().into_iter().find(|seed| seed.name == "windows.exr").unwrap();
    let image = decode_rgb(&seed.bytes, Path::new("windows.exr")).unwrap();
    let found: Vec<f32> = image.pixels.iter().map(|p| p[0] * 8.0).collect();
    assert_eq!((image.width, image.height), (6, 4));
    assert_eq!(found[..12], [0.0, 0.0, 1.0, 2.0, 0.0, 0.0, 0.0, 3.0, 4.0, 5.0, 0.0, 0.0]);
    assert_eq!(found[12..], [0.0; 12]);
}

#[test]
fn of_several_parts_the_one_with_colour_leads_and_those_of_its_size_follow() {
    let seed = seeds::all().into_iter().find(|seed| seed.name == "parts.exr").unwrap();
    let picture = Picture::decode_exr(&seed.bytes, Path::new("parts.exr")).unwrap();
    let names: Vec<&str> = picture.channels.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["B", "G", "R", "depth.Z", "objects.id"]);
    assert_eq!(picture.channel("objects.id").unwrap()[19], 19.0);
}

#[test]
fn a_png_holds_the_bytes_of_the_tone_mapping() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tone.png");
    let image = seeds::picture(9, 7);
    let mapping = ToneMapping { exposure_ev: 0.5, ..Default::default() };
    save_png(&path, &image, &mapping).unwrap();
    let expected: Vec<f32> = to_srgb_bytes(&image, &mapping).iter().map(|&b| srgb_decode_byte(b)).collect();
    assert_eq!(load_rgb(&path).unwrap().pixels.as_flattened(), expected);
}

#[test]
fn an_hdr_file_comes_back_within_a_step() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sky.hdr");
    let image = seeds::picture(40, 10);
    save_hdr(&path, &image).unwrap();
    let back = load_rgb(&path).unwrap();
    for (a, b) in image.pixels.iter().zip(&back.pixels) {
        let step = a.iter().copied().fold(0.0, f32::max) / 255.0;
        assert!((0..3).all(|c| (a[c] - b[c]).abs() <= step));
    }
}

#[test]
fn a_picture_without_pixels_is_not_written() {
    let folder = tempfile::tempdir().unwrap();
    let empty = RgbImage::new(0, 0);
    assert!(save_png(&folder.path().join("a.png"), &empty, &ToneMapping::default()).is_err());
    assert!(save_hdr(&folder.path().join("a.hdr"), &empty).is_err());
    assert!(encode_png(&empty, &ToneMapping::default()).is_err());
}

#[test]
fn an_elevation_file_gives_metres_spacing_and_filled_voids() {
    let height = decode_height(&seeds::elevation(12, 9), Path::new("hills.tif")).unwrap();
    assert_eq!((height.filled_voids, height.metres_per_pixel), (2, Some([30.0, 30.0])));
    for (i, &h) in height.plane.values.iter().enumerate() {
        let expected = 100.0 + 3.0 * (i % 12) as f32 - 2.0 * (i / 12) as f32;
        assert!((h - expected).abs() < if i == 0 { 3.0 } else { 1e-3 }, "{i}: {h} {expected}");
    }
}

#[test]
fn sixteen_bit_heights_are_the_numbers_of_the_file() {
    let seed = seeds::all().into_iter().find(|seed| seed.name == "gray16_big.tif").unwrap();
    let height = decode_height(&seed.bytes, Path::new("gray16_big.tif")).unwrap();
    assert_eq!(height.plane.values[23], 46000.0);
    let gray = seeds::all().into_iter().find(|seed| seed.name == "gray16.png").unwrap();
    let height = decode_height(&gray.bytes, Path::new("gray16.png")).unwrap();
    // The encoder was given bytes 0, 7, 14, 21 in the order of this machine.
    assert_eq!(height.plane.values[1], f32::from(u16::from_ne_bytes([14, 21])));
}

#[test]
fn textures_keep_the_precision_they_came_in() {
    for (name, bytes) in
        [("rgb8.png", true), ("rgb.jpg", true), ("rgba16.png", false), ("layers_half.exr", false)]
    {
        let seed = seeds::all().into_iter().find(|seed| seed.name == name).unwrap();
        let texture = decode_texture(&seed.bytes, Path::new(name), ColorSpace::Srgb).unwrap();
        assert_eq!(matches!(texture.texels, Texels::Bytes(_, ColorSpace::Srgb)), bytes, "{name}");
    }
}
