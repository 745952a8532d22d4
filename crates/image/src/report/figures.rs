//! The figures of a comparison, as programs read them.

use super::{Candidate, Comparison, Curve, Note, ReportError};
use crate::metrics::{Difference, FlipMap, NonFinite, hdr_flip, without_noise};

/// All figures of a comparison. Serialised field by field; what is not known or not finite is `null`.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Figures {
    /// Heading.
    pub title: String,
    /// What the reference is called.
    pub reference: String,
    /// Columns of every picture.
    pub width: usize,
    /// Rows of every picture.
    pub height: usize,
    /// Stops by which the pictures are exposed for PSNR and FLIP.
    pub exposure_ev: f32,
    /// The relative MSE of the reference's own noise, if it is known.
    pub reference_noise: Option<f64>,
    /// One row for each candidate, in their order.
    pub candidates: Vec<Row>,
    /// Error over time.
    pub curves: Vec<Curve>,
    /// How the pictures were made.
    pub notes: Vec<Note>,
}

/// The figures of one candidate.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Row {
    /// What it is called.
    pub name: String,
    /// mean((x − r)² / (r² + 0.01)).
    pub relative_mse: f64,
    /// The same less the known noise of the reference; may be a little below zero.
    pub relative_mse_without_noise: Option<f64>,
    /// mean((x − r)²).
    pub mse: f64,
    /// Of the pictures as shown, in decibels; `None` if they look the same.
    pub psnr_db: Option<f64>,
    /// Mean FLIP of the pictures as shown.
    pub flip: f64,
    /// Mean HDR-FLIP, if it was asked for.
    pub hdr_flip: Option<f64>,
    /// The largest |x − r|.
    pub max_error: f64,
    /// Column and row of the largest error.
    pub max_error_at: (usize, usize),
    /// Mean of the picture, per channel.
    pub mean: [f64; 3],
    /// Mean of the reference over the same pixels, per channel.
    pub reference_mean: [f64; 3],
    /// Mean over all channels against that of the reference, less one; `None` if the reference is black.
    pub brightness_error: Option<f64>,
    /// Pixels left out, since they hold no value.
    pub non_finite: NonFinite,
    /// Seconds taken.
    pub seconds: Option<f64>,
    /// Samples per pixel.
    pub samples: Option<f64>,
    /// Peak memory in MiB.
    pub peak_memory_mib: Option<f64>,
}

impl Row {
    /// The names that [`Row::figure`] knows.
    pub const FIGURES: [&str; 6] = ["relmse", "mse", "psnr", "flip", "hdr-flip", "max-error"];

    /// A figure of error by its short name, one of [`Row::FIGURES`]; PSNR is infinite for pictures that look the same.
    /// `None` for other names, and for HDR-FLIP that was not asked for.
    pub fn figure(&self, name: &str) -> Option<f64> {
        match name {
            "relmse" => Some(self.relative_mse),
            "mse" => Some(self.mse),
            "psnr" => Some(self.psnr_db.unwrap_or(f64::INFINITY)),
            "flip" => Some(self.flip),
            "hdr-flip" => self.hdr_flip,
            "max-error" => Some(self.max_error),
            _ => None,
        }
    }

    pub(super) fn measure(
        comparison: &Comparison,
        candidate: &Candidate,
        flip: &FlipMap,
    ) -> Result<Self, ReportError> {
        let error = |found| ReportError::Metric { candidate: candidate.name.clone(), found };
        let reference = &comparison.reference;
        let d = Difference::measure(&candidate.image, reference, comparison.exposure_ev).map_err(error)?;
        let hdr_flip = match comparison.hdr_flip {
            true => Some(hdr_flip(&candidate.image, reference).map_err(error)?.mean),
            false => None,
        };
        let (sum, reference_sum): (f64, f64) = (d.mean.iter().sum(), d.reference_mean.iter().sum());
        Ok(Self {
            name: candidate.name.clone(),
            relative_mse: d.relative_mse,
            relative_mse_without_noise: comparison.reference_noise.map(|n| without_noise(d.relative_mse, n)),
            mse: d.mse,
            psnr_db: d.psnr_db.is_finite().then_some(d.psnr_db),
            flip: flip.mean,
            hdr_flip,
            max_error: d.max_error,
            max_error_at: d.max_error_at,
            mean: d.mean,
            reference_mean: d.reference_mean,
            brightness_error: (reference_sum != 0.0).then(|| sum / reference_sum - 1.0),
            non_finite: d.non_finite,
            seconds: candidate.seconds,
            samples: candidate.samples,
            peak_memory_mib: candidate.peak_memory_bytes.map(|bytes| bytes as f64 / f64::from(1 << 20)),
        })
    }
}
