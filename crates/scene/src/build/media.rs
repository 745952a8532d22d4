//! Media of scene files.

use std::sync::Arc;

use super::Builder;
use crate::media::{DensityGrid, MOST_VOLUMES, Media, Region, Volume};
use crate::schema::{At, Problem};
use crate::spec::MediumSpec;

impl Builder {
    /// Builds every `[[medium]]`.
    pub(crate) fn media(&mut self, specs: &[At<MediumSpec>]) -> Media {
        if let Some(beyond) = specs.get(MOST_VOLUMES) {
            let message = format!("a scene has at most {MOST_VOLUMES} media, and this is one more");
            self.reader.report(Problem::new(&beyond.origin, message).help("join them in one grid"));
        }
        let volumes = specs.iter().take(MOST_VOLUMES).enumerate();
        Media::new(volumes.filter_map(|(index, spec)| self.volume(index, spec)).collect())
    }

    fn volume(&mut self, index: usize, spec: &At<MediumSpec>) -> Option<Volume> {
        let region = self.region(spec)?;
        let density = match &spec.grid {
            None => None,
            Some(file) => {
                if !matches!(region, Region::Box { .. }) {
                    let problem = Problem::new(&file.origin, "a grid fills a box, and this medium has none");
                    self.reader.report(problem.help("give `min` and `max`"));
                    return None;
                }
                match DensityGrid::load(&file.path) {
                    Ok(grid) => {
                        self.note_file(&file.path);
                        Some(Arc::new(grid))
                    }
                    Err(error) => {
                        self.failed(file, &error);
                        return None;
                    }
                }
            }
        };
        let volume = Volume {
            name: spec.name.clone().unwrap_or_else(|| format!("medium {}", index + 1)),
            region,
            absorption: spec.absorption.0 * spec.density,
            scattering: spec.scattering.0 * spec.density,
            anisotropy: spec.anisotropy,
            density,
        };
        if !volume.majorant().is_finite() {
            let message = "this medium is denser than numbers can say";
            self.reader.report(Problem::new(&spec.origin, message).help("lower `density`"));
            return None;
        }
        Some(volume)
    }

    fn region(&mut self, spec: &At<MediumSpec>) -> Option<Region> {
        match (&spec.min, &spec.max, &spec.center, &spec.radius) {
            (None, None, None, None) => Some(Region::Everywhere),
            (Some(low), Some(high), None, None) => {
                if low.value.cmplt(high.value).all() {
                    return Some(Region::Box { low: low.value, high: high.value });
                }
                let message = format!("the box from {} to {} has no inside", low.value, high.value);
                self.reader
                    .report(Problem::new(&high.origin, message).help("`min` is below `max` on every axis"));
                None
            }
            (None, None, Some(center), Some(radius)) => {
                Some(Region::Sphere { center: center.value, radius: radius.value })
            }
            _ => {
                let message = "this medium is neither in a box nor in a ball";
                let help =
                    "give `min` and `max`, or `center` and `radius`, or none of them to fill the scene";
                self.reader.report(Problem::new(&spec.origin, message).help(help));
                None
            }
        }
    }
}
