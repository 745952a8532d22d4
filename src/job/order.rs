//! One picture, or a share of it: what is to be done, and doing it.

use std::time::Instant;

use halflight_image::Picture;
use halflight_render::techniques::Made;
use halflight_render::{Budget, Film, Progress, Region, RenderReport, Technique, features};
use halflight_scene::Frame;

use super::{JobError, Share, Size, Stage};

/// Rays a pixel for the layers of an interrupted picture: seconds at any size.
const INTERRUPTED_LAYER_RAYS: u32 = 16;

/// What is to be rendered. Of a technique that keeps work from frame to frame, [`prepare`](Technique::prepare) is to be
/// called before.
#[derive(Clone)]
pub struct Order<'a> {
    /// The scene.
    pub stage: &'a Stage,
    /// The technique.
    pub technique: &'a dyn Technique,
    /// Its name with all its settings.
    pub technique_text: &'a str,
    /// Columns and rows of the whole picture.
    pub size: Size,
    /// When to stop, and the seed.
    pub budget: Budget,
    /// Names of [`features::FEATURE_LAYERS`].
    pub layers: Vec<&'static str>,
    /// The part of the picture to render; all of it without.
    pub share: Option<Share>,
}

/// What a render took, for the metadata of its picture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Facts {
    /// Samples a pixel, on the average.
    pub samples: f64,
    /// Seconds of wall time.
    pub seconds: f64,
    /// Whether it was told to stop before it was done.
    pub interrupted: bool,
}

/// A picture with what is known of its making.
pub struct ShotPicture {
    /// Radiance, layers and metadata; of a share, only its region.
    pub picture: Picture,
    /// What the technique said.
    pub report: RenderReport,
    /// Samples a pixel, on the average.
    pub samples: f64,
    /// Seconds of posing the scene and building what answers rays.
    pub build_seconds: f64,
}

impl<'a> Order<'a> {
    /// The whole picture, of the scene's size, with the technique's own budget and without layers.
    pub fn new(stage: &'a Stage, made: &'a Made) -> Self {
        Self {
            stage,
            technique: made.technique.as_ref(),
            technique_text: &made.identity,
            size: stage.size(),
            budget: Budget::default(),
            layers: Vec::new(),
            share: None,
        }
    }

    /// Refuses a share of a picture whose samples are not known before: machines would stop at different ones.
    ///
    /// # Errors
    /// That, or a picture that cannot be divided into so many.
    pub fn check(&self) -> Result<(), JobError> {
        let Some(share) = self.share else { return Ok(()) };
        share.region(self.size.width, self.size.height).map_err(JobError::usage)?;
        if self.budget.seconds.is_some() || self.budget.error.is_some() {
            return Err(JobError::usage(
                "tiles of one picture need the same samples: a limit of seconds or of the error would stop each of them \
                 elsewhere (say how many samples, with --spp N)",
            ));
        }
        Ok(())
    }

    /// The pixels to render.
    ///
    /// # Errors
    /// If the picture cannot be divided into so many shares.
    pub fn region(&self) -> Result<Region, JobError> {
        let Size { width, height } = self.size;
        match self.share {
            None => Ok(Region::whole(width, height)),
            Some(share) => share.region(width, height).map_err(JobError::usage),
        }
    }

    /// An empty film for it.
    ///
    /// # Errors
    /// As [`region`](Self::region).
    pub fn film(&self) -> Result<Film, JobError> {
        Ok(Film::part(self.size.width, self.size.height, self.region()?))
    }

    /// Renders frame number `frame` of the scene, which is at `time` seconds.
    ///
    /// # Errors
    /// If the scene cannot be posed there, or the technique cannot show it.
    pub fn shoot(&self, frame: f64, time: f64, progress: &dyn Progress) -> Result<ShotPicture, JobError> {
        self.check()?;
        let start = Instant::now();
        let posed = self.stage.frame(time)?;
        let build_seconds = start.elapsed().as_secs_f64();
        let mut film = self.film()?;
        let report = self.technique.render(&posed, &mut film, &self.budget, progress)?;
        let facts = Facts {
            samples: film.mean_samples(),
            seconds: report.elapsed.as_secs_f64(),
            interrupted: report.interrupted,
        };
        let picture = self.picture(&posed, &mut film, (frame, time), &facts);
        Ok(ShotPicture { picture, report, samples: facts.samples, build_seconds })
    }

    /// The picture of a film that has been rendered, with layers and metadata.
    pub fn picture(
        &self,
        posed: &Frame,
        film: &mut Film,
        (frame, time): (f64, f64),
        facts: &Facts,
    ) -> Picture {
        // Who interrupts does not want to wait for smooth edges.
        let layer_rays = if facts.interrupted { INTERRUPTED_LAYER_RAYS } else { features::MAX_RAYS };
        features::add_layers(posed, film, self.budget.seed, &self.layers, layer_rays);
        let mut picture = film.take_picture();
        if self.share.is_some() {
            picture = cut(picture, film.region());
        }
        let entries = [
            ("version", format!("halflight {}", env!("CARGO_PKG_VERSION"))),
            ("scene", self.stage.name().to_string()),
            ("scene_hash", self.stage.hash().to_string()),
            ("technique", self.technique_text.to_string()),
            ("seed", self.budget.seed.to_string()),
            ("frame", frame.to_string()),
            ("time_seconds", time.to_string()),
            ("samples", facts.samples.to_string()),
            ("seconds", format!("{:.3}", facts.seconds)),
            ("simd", self.stage.simd_name().to_string()),
        ];
        picture.metadata.extend(entries.map(|(key, value)| (key.to_string(), value)));
        if facts.interrupted {
            picture.metadata.insert("interrupted".into(), "yes".into());
        }
        picture
    }

    /// Everything that must be the same for the samples to be the same.
    pub fn identity(&self, time: f64) -> String {
        let share = self.share.map(|share| format!(" tile {share}")).unwrap_or_default();
        format!(
            "halflight {} scene {} time {time} technique {} seed {} size {}x{} simd {}{share}",
            env!("CARGO_PKG_VERSION"),
            self.stage.hash(),
            self.technique_text,
            self.budget.seed,
            self.size.width,
            self.size.height,
            self.stage.simd_name(),
        )
    }
}

/// A region of a picture.
fn cut(mut picture: Picture, region: Region) -> Picture {
    for channel in &mut picture.channels {
        channel.values = region.cut(&channel.values, picture.width);
    }
    (picture.width, picture.height) = (region.width, region.height);
    picture
}
