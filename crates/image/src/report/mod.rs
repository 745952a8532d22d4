//! The comparison page: how far pictures are from a reference, in one HTML file that opens anywhere.
//!
//! A [`Comparison`] is what is known (pictures, costs, curves of error over time); [`Comparison::measure`] makes a
//! [`Report`] of it: [`Figures`] for programs ([`Report::write_json`]) and the page for people
//! ([`Report::write_html`]). The page holds its pictures as data URIs and asks nothing of any network; its own
//! content security policy forbids it to.
//!
//! Every text that goes into the page is escaped, so names and notes may hold anything.
//!
//! ```
//! use halflight_image::RgbImage;
//! use halflight_image::report::{Candidate, Comparison};
//! let reference = RgbImage::from_fn(16, 9, |x, y| [x as f32 / 16.0, y as f32 / 9.0, 0.2]);
//! let darker = RgbImage::from_fn(16, 9, |x, y| [x as f32 / 17.0, y as f32 / 10.0, 0.2]);
//! let mut comparison = Comparison::new("A ramp", "exact", reference);
//! comparison.candidates.push(Candidate { samples: Some(16.0), ..Candidate::new("darker", darker) });
//! let report = comparison.measure()?;
//! assert!(report.rows()[0].relative_mse > 0.0);
//! assert!(report.to_html().contains("A ramp"));
//! # Ok::<(), halflight_image::report::ReportError>(())
//! ```

pub mod colors;
mod encode;
mod false_color;
mod figures;
mod maps;
mod measure;
mod page;
mod plot;
mod text;

pub use false_color::FalseColor;
pub use figures::{Figures, Row};
pub use measure::{Report, ReportError};

use crate::RgbImage;

/// What is to be compared, and what is known of it.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// Heading of the page.
    pub title: String,
    /// What the reference is called.
    pub reference_name: String,
    /// What all candidates are measured against.
    pub reference: RgbImage,
    /// The relative MSE of the reference's own noise, if it is known; it is subtracted in a column of its own.
    pub reference_noise: Option<f64>,
    /// Stops by which the pictures are exposed to be shown, and for PSNR and FLIP.
    pub exposure_ev: f32,
    /// Whether to compute HDR-FLIP too, which costs as much as FLIP at each of two to twenty-six exposures.
    pub hdr_flip: bool,
    /// The pictures under test.
    pub candidates: Vec<Candidate>,
    /// Error over time, one curve for each technique.
    pub curves: Vec<Curve>,
    /// How the pictures were made: scene, command, version, machine.
    pub notes: Vec<Note>,
}

/// A picture under test.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// What it is called: the technique, or the file.
    pub name: String,
    /// The picture, of the size of the reference.
    pub image: RgbImage,
    /// How long it took, in seconds.
    pub seconds: Option<f64>,
    /// Samples per pixel.
    pub samples: Option<f64>,
    /// The most memory that the process held while making it.
    pub peak_memory_bytes: Option<u64>,
}

/// How the error of one technique fell as it was given more.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Curve {
    /// The technique.
    pub name: String,
    /// Its budgets, least first.
    pub points: Vec<CurvePoint>,
}

/// One budget of a [`Curve`].
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct CurvePoint {
    /// Seconds taken.
    pub seconds: f64,
    /// Samples per pixel taken.
    pub samples: f64,
    /// The error then.
    pub relative_mse: f64,
}

/// Something to know about the comparison.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Note {
    /// What it is: `scene`, `command`.
    pub label: String,
    /// What it says.
    pub value: String,
}

impl Comparison {
    /// A comparison with nothing yet, shown as it is (0 EV).
    pub fn new(title: impl Into<String>, reference_name: impl Into<String>, reference: RgbImage) -> Self {
        Self {
            title: title.into(),
            reference_name: reference_name.into(),
            reference,
            reference_noise: None,
            exposure_ev: 0.0,
            hdr_flip: true,
            candidates: Vec::new(),
            curves: Vec::new(),
            notes: Vec::new(),
        }
    }

    /// Adds a line to the section on how the pictures were made.
    pub fn note(&mut self, label: impl Into<String>, value: impl Into<String>) {
        self.notes.push(Note { label: label.into(), value: value.into() });
    }
}

impl Candidate {
    /// A picture of which nothing else is known.
    pub fn new(name: impl Into<String>, image: RgbImage) -> Self {
        Self { name: name.into(), image, seconds: None, samples: None, peak_memory_bytes: None }
    }
}
