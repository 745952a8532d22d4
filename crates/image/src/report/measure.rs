//! From pictures to figures and to what the page shows.

use image::codecs::png::FilterType;
use rayon::prelude::*;
use serde_json::{Value, json};

use super::encode::png_uri;
use super::maps::{MapStyle, reach_of};
use super::{Comparison, Figures, Row};
use crate::metrics::{FlipMap, MetricError, flip, relative_squared_error, signed_difference};
use crate::{Plane, RgbImage, ToneCurve, ToneMapping, to_srgb_bytes};

/// A measured [`Comparison`], ready to be written.
#[derive(Clone, Debug)]
pub struct Report {
    /// All that is a number or a text.
    pub figures: Figures,
    /// The pictures and legends, as the script of the page takes them.
    pub(super) shown: Value,
}

/// Why a comparison could not be measured.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ReportError {
    /// There is nothing to compare.
    #[error("cannot compare with {reference}: no picture was given to compare with it (give at least one)")]
    NoCandidates {
        /// What the reference is called.
        reference: String,
    },
    /// A candidate does not go with the reference.
    #[error("{candidate}: {found}")]
    Metric {
        /// What the candidate is called.
        candidate: String,
        /// Why not.
        found: MetricError,
    },
    /// A picture cannot be put into the page.
    #[error("cannot put {name} into the page: {found}")]
    Picture {
        /// What it is called.
        name: String,
        /// Why not.
        found: String,
    },
}

/// The maps of one candidate.
struct Maps {
    flip: FlipMap,
    relative: Plane,
    signed: Plane,
}

impl Comparison {
    /// Measures every candidate and prepares the page.
    ///
    /// # Errors
    /// If there is no candidate, or one is not of the reference's size or holds no finite pixel.
    pub fn measure(&self) -> Result<Report, ReportError> {
        if self.candidates.is_empty() {
            return Err(ReportError::NoCandidates { reference: self.reference_name.clone() });
        }
        let (mut maps, mut rows) = (Vec::new(), Vec::new());
        for candidate in &self.candidates {
            let these = self
                .maps_of(&candidate.image)
                .map_err(|found| ReportError::Metric { candidate: candidate.name.clone(), found })?;
            rows.push(Row::measure(self, candidate, &these.flip)?);
            maps.push(these);
        }
        let shown = self.shown(&maps, &rows)?;
        let figures = Figures {
            title: self.title.clone(),
            reference: self.reference_name.clone(),
            width: self.reference.width,
            height: self.reference.height,
            exposure_ev: self.exposure_ev,
            reference_noise: self.reference_noise,
            candidates: rows,
            curves: self.curves.clone(),
            notes: self.notes.clone(),
        };
        Ok(Report { figures, shown })
    }

    fn maps_of(&self, image: &RgbImage) -> Result<Maps, MetricError> {
        Ok(Maps {
            flip: flip(image, &self.reference, self.exposure_ev)?,
            relative: relative_squared_error(image, &self.reference)?,
            signed: signed_difference(image, &self.reference)?,
        })
    }

    /// Everything the script of the page needs, pictures included.
    fn shown(&self, maps: &[Maps], rows: &[Row]) -> Result<Value, ReportError> {
        let signed: Vec<Plane> = maps.iter().map(|m| m.signed.clone()).collect();
        let styles = [MapStyle::flip(), MapStyle::relative(), MapStyle::signed(reach_of(&signed))];
        let candidates: Vec<Value> = self
            .candidates
            .par_iter()
            .zip(maps)
            .zip(rows)
            .map(|((candidate, maps), row)| {
                let planes = [&maps.flip.map, &maps.relative, &maps.signed];
                let mut shown = json!({
                    "name": candidate.name,
                    "figure": format!("relMSE {}", super::text::error(row.relative_mse)),
                    "picture": self.picture(&candidate.name, &candidate.image)?,
                });
                for ((key, style), plane) in ["flip", "relative", "signed"].iter().zip(&styles).zip(planes) {
                    let bytes = style.paint(plane, &candidate.image, &self.reference);
                    shown[key] = self.uri(&candidate.name, &bytes, FilterType::NoFilter)?.into();
                }
                Ok(shown)
            })
            .collect::<Result<_, ReportError>>()?;
        let [flip, relative, signed] = styles.map(|style| style.describe());
        Ok(json!({
            "width": self.reference.width,
            "height": self.reference.height,
            "maps": { "flip": flip, "relative": relative, "signed": signed },
            "reference": {
                "name": self.reference_name,
                "picture": self.picture(&self.reference_name, &self.reference)?,
            },
            "candidates": candidates,
        }))
    }

    /// A picture as it is shown: exposed, clamped, encoded as sRGB.
    fn picture(&self, name: &str, image: &RgbImage) -> Result<String, ReportError> {
        let mapping = ToneMapping { exposure_ev: self.exposure_ev, curve: ToneCurve::Srgb };
        self.uri(name, &to_srgb_bytes(image, &mapping), FilterType::Adaptive)
    }

    fn uri(&self, name: &str, bytes: &[u8], filter: FilterType) -> Result<String, ReportError> {
        let RgbImage { width, height, .. } = self.reference;
        png_uri(bytes, width, height, filter)
            .map_err(|found| ReportError::Picture { name: name.to_owned(), found })
    }
}
