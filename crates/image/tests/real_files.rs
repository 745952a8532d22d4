//! Files that other programs wrote.
#![allow(clippy::unwrap_used)]

mod seeds;

use halflight_image::{Picture, RgbImage, load_height, load_rgb};
use seeds::shared;

/// Mean radiance over the sphere of a latitude–longitude map.
fn mean_over_sphere(image: &RgbImage) -> f64 {
    let (mut sum, mut weights) = (0.0, 0.0);
    for (i, pixel) in image.pixels.iter().enumerate() {
        let theta = std::f64::consts::PI * ((i / image.width) as f64 + 0.5) / image.height as f64;
        sum += theta.sin() * pixel.iter().map(|&v| f64::from(v)).sum::<f64>() / 3.0;
        weights += theta.sin();
    }
    sum / weights
}

#[test]
fn every_environment_map_has_its_size_and_some_light() {
    let maps = [
        ("KernerEnvLatLong.exr", 1024, 512),
        ("grace_latlong.exr", 1024, 512),
        ("uffizi.hdr", 1200, 600),
        ("noon_grass_1k.hdr", 1024, 512),
        ("spiaggia_di_mondello_1k.hdr", 1024, 512),
        ("leadenhall_market_1k.hdr", 1024, 512),
        ("ennis_256.hdr", 256, 128),
        ("grace_256.hdr", 256, 128),
        ("pisa_256.hdr", 256, 128),
        ("wells_256.hdr", 256, 128),
    ];
    for (name, width, height) in maps {
        let Some(path) = shared(&format!("envmaps/{name}")) else { return };
        let image = load_rgb(&path).unwrap();
        assert_eq!((image.width, image.height), (width, height), "{name}");
        let mean = mean_over_sphere(&image);
        assert!(mean > 0.005 && mean < 100.0, "{name}: {mean}");
        assert!(image.pixels.as_flattened().iter().all(|&v| v >= 0.0), "{name}");
    }
}

#[test]
fn the_strong_sun_is_there() {
    let Some(path) = shared("envmaps/noon_grass_1k.hdr") else { return };
    let image = load_rgb(&path).unwrap();
    // The notes of the data, checked with a decoder of a dozen lines in another language: peak over mean 1.1e5,
    // and 60 % of the flux in 0.1 % of the sphere. The sun stands near the zenith, so weights matter.
    let ratio = image.pixels.iter().map(|p| f64::from(p[1])).fold(0.0, f64::max) / mean_over_sphere(&image);
    assert!((1.0e5..1.3e5).contains(&ratio), "{ratio}");
    let mut texels: Vec<(f64, f64)> = Vec::new();
    for (i, &[r, g, b]) in image.pixels.iter().enumerate() {
        let theta = std::f64::consts::PI * ((i / image.width) as f64 + 0.5) / image.height as f64;
        let luminance = 0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b);
        texels.push((luminance, theta.sin()));
    }
    texels.sort_by(|a, b| b.0.total_cmp(&a.0));
    let (sphere, flux) = texels.iter().fold((0.0, 0.0), |(s, f), (l, w)| (s + w, f + l * w));
    let (mut area, mut bright) = (0.0, 0.0);
    for (luminance, weight) in texels {
        area += weight;
        bright += luminance * weight;
        if area > 1e-3 * sphere {
            break;
        }
    }
    assert!((bright / flux - 0.603).abs() < 0.005, "{}", bright / flux);
}

#[test]
fn the_tiled_mip_mapped_map_is_read_at_its_largest_level() {
    let Some(path) = shared("envmaps/KernerEnvLatLong.exr") else { return };
    let picture = Picture::load_exr(&path).unwrap();
    assert_eq!((picture.width, picture.height), (1024, 512));
    let names: Vec<&str> = picture.channels.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["A", "B", "G", "R"]);
    // No tile is missing: a row and a column of each tile have light in them.
    let red = picture.channel("R").unwrap();
    for tile in 0..16 * 8 {
        let (x, y) = (tile % 16 * 64, tile / 16 * 64);
        assert!((0..64).any(|i| red[(y + i) * 1024 + x + i] > 0.0), "tile at ({x}, {y})");
    }
}

#[test]
fn a_piz_map_is_read() {
    let Some(path) = shared("scenes/mitsuba-matpreview/envmap.exr") else { return };
    let image = load_rgb(&path).unwrap();
    assert_eq!((image.width, image.height), (512, 256));
    assert!(mean_over_sphere(&image) > 0.01);
}

#[test]
fn the_reference_renderings_agree_as_their_notes_say() {
    let paths =
        ["TungstenRender.exr", "mitsuba/scene_v3.exr"].map(|n| shared(&format!("scenes/cornell-box/{n}")));
    let [Some(a), Some(b)] = paths else { return };
    let mean = |image: RgbImage| image.pixels.as_flattened().iter().map(|&v| f64::from(v)).sum::<f64>();
    let (a, b) = (mean(load_rgb(&a).unwrap()), mean(load_rgb(&b).unwrap()));
    assert!((a / b - 1.0).abs() < 0.002, "{a} {b}");
}

#[test]
fn mount_rainier_has_its_voids_filled_and_its_heights_kept() {
    let Some(path) = shared("heightfields/mt_rainier_90m.tif") else { return };
    let height = load_height(&path).unwrap();
    let plane = &height.plane;
    assert_eq!((plane.width, plane.height, height.filled_voids), (1201, 1201, 9033));
    let (low, high) = plane.values.iter().fold((f32::MAX, f32::MIN), |(l, h), &v| (l.min(v), h.max(v)));
    assert_eq!((low, high), (263.0, 4371.0), "no filled pixel leaves the range of the measured ones");
    // The same picture with voids filled by another program agrees wherever there was a measurement, and the
    // fillings are close: both are stretched between the same rims.
    let Some(other) = shared("heightfields/mt_rainier_90m_m.png") else { return };
    let other = load_height(&other).unwrap().plane;
    let differ: Vec<f32> =
        plane.values.iter().zip(&other.values).map(|(a, b)| (a - b).abs()).filter(|&d| d > 0.0).collect();
    assert!(differ.len() <= 9033, "{}", differ.len());
    let mean = differ.iter().sum::<f32>() / differ.len().max(1) as f32;
    assert!(mean < 60.0, "{mean}");
    if let Some([x, y]) = height.metres_per_pixel {
        assert!((y - 92.6).abs() < 0.2 && (x - 64.0).abs() < 1.0, "{x} {y}");
    }
}

#[test]
fn big_tujunga_is_projected_at_thirty_metres() {
    let Some(path) = shared("heightfields/srtm_bigtujunga30m_utm11.tif") else { return };
    let height = load_height(&path).unwrap();
    assert_eq!((height.plane.width, height.plane.height, height.filled_voids), (1197, 643, 0));
    let (low, high) =
        height.plane.values.iter().fold((f32::MAX, f32::MIN), |(l, h), &v| (l.min(v), h.max(v)));
    assert_eq!((low, high), (315.0, 2295.0));
    let [x, y] = height.metres_per_pixel.unwrap();
    assert!((x - 30.0).abs() < 0.1 && (y - 30.0).abs() < 0.1, "{x} {y}");
}

#[test]
fn a_sixteen_bit_png_gives_metres() {
    let Some(path) = shared("heightfields/mt_st_helens_30m_m.png") else { return };
    let height = load_height(&path).unwrap();
    let (low, high) =
        height.plane.values.iter().fold((f32::MAX, f32::MIN), |(l, h), &v| (l.min(v), h.max(v)));
    assert_eq!((height.plane.width, height.plane.height, low, high), (327, 460, 694.0, 2543.0));
}
