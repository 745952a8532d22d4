//! The environment: loaded, converted to latitude–longitude, or built in.

use std::path::Path;
use std::sync::Arc;

use glam::Vec3;
use halflight_file::LoadError;
use halflight_image::RgbImage;

use super::Builder;
use crate::lights::{Environment, EnvironmentMap, Sky, studio as studio_map};
use crate::schema::FilePath;
use crate::spec::{EnvironmentKind, EnvironmentSpec, MapLayout};

/// The environment that a scene file asks for; `None` for a black one.
pub(crate) fn environment(spec: &EnvironmentSpec, builder: &mut Builder) -> Option<Environment> {
    let map = match &spec.0.kind {
        EnvironmentKind::Black(_) => return None,
        EnvironmentKind::Studio(_) => Arc::new(EnvironmentMap::new(studio_map())),
        EnvironmentKind::Sky(sky) => {
            let sky = Sky {
                sun_elevation: sky.sun_elevation_degrees.to_radians(),
                sun_azimuth: sky.sun_azimuth_degrees.to_radians(),
                turbidity: sky.turbidity,
                ground_albedo: sky.ground_albedo,
            };
            Arc::new(EnvironmentMap::new(sky.bake()))
        }
        EnvironmentKind::Constant(constant) => {
            Arc::new(EnvironmentMap::new(RgbImage::from_fn(1, 1, |_, _| constant.color.0.to_array())))
        }
        EnvironmentKind::Image(image) => map(&image.file, image.layout, builder)?,
    };
    let common = &spec.0.common;
    // The reader has checked the number of bands.
    let limited = common.bands.and_then(|bands| map.band_limited(bands).ok());
    let map = limited.map_or(map, Arc::new);
    let rotation = (common.rotation_degrees % 360.0).to_radians();
    Some(Environment { map, rotation, intensity: common.intensity.0 })
}

/// The built-in studio.
pub(crate) fn studio() -> Environment {
    Environment { map: Arc::new(EnvironmentMap::new(studio_map())), rotation: 0.0, intensity: Vec3::ONE }
}

/// The built-in sky with its sun at a place, in degrees.
pub(crate) fn sky_of(elevation: f32, azimuth: f32) -> Environment {
    let sky =
        Sky { sun_elevation: elevation.to_radians(), sun_azimuth: azimuth.to_radians(), ..Sky::default() };
    Environment { map: Arc::new(EnvironmentMap::new(sky.bake())), rotation: 0.0, intensity: Vec3::ONE }
}

/// A picture that the program itself names.
pub(crate) fn environment_image(path: &Path, builder: &mut Builder) -> Result<Environment, LoadError> {
    let image = halflight_image::load_rgb(path)?;
    builder.note_file(path);
    let map = checked(image, path, &mut builder.warnings)?;
    Ok(Environment { map, rotation: 0.0, intensity: Vec3::ONE })
}

/// The map of a picture, if it has pixels; negative radiance is taken as none.
fn checked(
    mut image: RgbImage,
    path: &Path,
    warnings: &mut Vec<String>,
) -> Result<Arc<EnvironmentMap>, LoadError> {
    if image.width == 0 || image.height == 0 {
        return Err(LoadError::new("environment map", path, "a picture without pixels"));
    }
    if image.pixels.iter().flatten().any(|&x| x < 0.0) {
        warnings.push(format!("{}: negative radiance is taken as 0", path.display()));
        image.pixels.iter_mut().flatten().for_each(|x| *x = x.max(0.0));
    }
    Ok(Arc::new(EnvironmentMap::new(image)))
}

fn map(file: &FilePath, layout: MapLayout, builder: &mut Builder) -> Option<Arc<EnvironmentMap>> {
    let key = (file.path.clone(), layout == MapLayout::Angular);
    if let Some(known) = builder.maps.get(&key) {
        return Some(Arc::clone(known));
    }
    let loaded = halflight_image::load_rgb(&file.path).and_then(|image| {
        let size = image.width.min(image.height).max(1);
        let image = match layout {
            MapLayout::LatLong => image,
            // The circle around the middle holds all meridians: twice the side keeps the resolution there.
            MapLayout::Angular => halflight_image::angular_to_latlong(&image, 2 * size, size),
        };
        checked(image, &file.path, &mut builder.warnings)
    });
    match loaded {
        Ok(map) => {
            builder.note_file(&file.path);
            builder.maps.insert(key, Arc::clone(&map));
            Some(map)
        }
        Err(error) => {
            builder.failed(file, &error);
            None
        }
    }
}
