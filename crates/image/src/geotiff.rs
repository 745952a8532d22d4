//! How far apart the pixels of a GeoTIFF lie.
//!
//! Source: OGC 19-008r4, "GeoTIFF Standard". A projected model gives the spacing in metres (or feet); a geographic
//! one gives degrees, whose length depends on the latitude φ of the picture's centre. On an ellipsoid of semi-axis a and
//! squared eccentricity e² (WGS 84) it is, in metres a radian,
//!
//! ```text
//! east = a cos φ / √w,   north = a (1 − e²) / w^(3/2),   w = 1 − e² sin² φ
//! ```

use crate::raster::GeoTags;

/// Of WGS 84, in metres.
const SEMI_AXIS: f64 = 6_378_137.0;
/// Of WGS 84.
const ECCENTRICITY_2: f64 = 0.006_694_379_990_14;

const MODEL_TYPE_KEY: u64 = 1024;
const LINEAR_UNITS_KEY: u64 = 3076;

/// The spacing of columns and rows in metres, if the tags tell it.
pub(crate) fn metres_per_pixel(tags: &GeoTags, size: [usize; 2]) -> Option<[f64; 2]> {
    let [x, y] = spacing(tags)?;
    let metres = match key(tags, MODEL_TYPE_KEY)? {
        // Projected: in the unit of the projection.
        1 => {
            let unit = unit_metres(key(tags, LINEAR_UNITS_KEY))?;
            [x * unit, y * unit]
        }
        // Geographic: in degrees.
        2 => {
            let (sin, cos) = centre_y(tags, size)?.to_radians().sin_cos();
            let w = 1.0 - ECCENTRICITY_2 * sin * sin;
            let east = SEMI_AXIS * cos / w.sqrt();
            let north = SEMI_AXIS * (1.0 - ECCENTRICITY_2) / w.powf(1.5);
            [x.to_radians() * east, y.to_radians() * north]
        }
        _ => return None,
    };
    metres.iter().all(|m| m.is_finite() && *m > 0.0).then_some(metres)
}

/// Model units per pixel along columns and rows.
fn spacing(tags: &GeoTags) -> Option<[f64; 2]> {
    if let [x, y, ..] = tags.pixel_scale[..] {
        return Some([x.abs(), y.abs()]);
    }
    // The first two columns of the matrix are a pixel's steps.
    let m: &[f64; 16] = tags.transformation.first_chunk()?;
    Some([m[0].hypot(m[4]), m[1].hypot(m[5])])
}

/// The model's y (a latitude) at the centre of the picture.
fn centre_y(tags: &GeoTags, [width, height]: [usize; 2]) -> Option<f64> {
    let (x, y) = (width as f64 / 2.0, height as f64 / 2.0);
    let latitude = match (&tags.tiepoint[..], &tags.pixel_scale[..]) {
        // Rows go down while latitude goes up.
        (&[_, row, _, _, north, ..], &[_, scale, ..]) => north - (y - row) * scale,
        _ => {
            let m: &[f64; 16] = tags.transformation.first_chunk()?;
            m[4] * x + m[5] * y + m[7]
        }
    };
    (latitude.abs() <= 90.0).then_some(latitude)
}

/// A key whose value stands in the directory itself: (id, 0, 1, value).
fn key(tags: &GeoTags, wanted: u64) -> Option<u64> {
    tags.keys
        .as_chunks::<4>()
        .0
        .iter()
        .skip(1)
        .find(|entry| entry[0] == wanted && entry[1] == 0)
        .map(|entry| entry[3])
}

fn unit_metres(unit: Option<u64>) -> Option<f64> {
    match unit {
        // EPSG 9001 metre, 9002 foot, 9003 US survey foot; files that leave it out mean metres.
        None | Some(9001) => Some(1.0),
        Some(9002) => Some(0.3048),
        Some(9003) => Some(1200.0 / 3937.0),
        Some(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tags(model: u64, scale: f64) -> GeoTags {
        GeoTags {
            void: None,
            pixel_scale: vec![scale, scale, 0.0],
            tiepoint: vec![0.0, 0.0, 0.0, -122.0, 47.0, 0.0],
            transformation: vec![],
            keys: vec![1, 1, 0, 1, 1024, 0, 1, model],
        }
    }

    #[test]
    fn three_arc_seconds_are_ninety_metres_northward_and_less_eastward() {
        let [east, north] = metres_per_pixel(&tags(2, 1.0 / 1200.0), [1200, 1200]).expect("geographic");
        // At 46.5° the usual series, 111132.954 − 559.822 cos 2φ + … and 111412.84 cos φ − …, give these.
        assert!((north - 92.6342).abs() < 1e-3 && (east - 63.9688).abs() < 1e-3, "{east} {north}");
    }

    #[test]
    fn projected_feet_become_metres() {
        let mut feet = tags(1, 10.0);
        assert_eq!(metres_per_pixel(&feet, [8, 8]), Some([10.0, 10.0]));
        feet.keys.extend([3076, 0, 1, 9002]);
        let [x, _] = metres_per_pixel(&feet, [8, 8]).expect("feet");
        assert!((x - 3.048).abs() < 1e-12);
    }

    #[test]
    fn a_file_without_a_model_has_no_spacing() {
        assert_eq!(metres_per_pixel(&tags(7, 1.0), [8, 8]), None);
        assert_eq!(metres_per_pixel(&GeoTags::default(), [8, 8]), None);
    }
}
