//! The settings of techniques: from the scene, from `--set` and from the technique's own words on the command line.

use std::str::FromStr;

use halflight_render::techniques::{self, Made, TECHNIQUES};

use super::{JobError, Stage};

/// `path`, or with settings `path:max_depth=2,clamp=10`.
#[derive(Clone, Debug, PartialEq)]
pub struct TechniqueSpec {
    /// Of the table of techniques.
    pub name: String,
    /// Each `key=value`.
    pub settings: Vec<String>,
}

impl FromStr for TechniqueSpec {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, settings) = text.split_once(':').unwrap_or((text, ""));
        techniques::find(name).map_err(|e| e.to_string())?;
        let settings = settings.split(',').map(str::trim).filter(|s| !s.is_empty());
        Ok(Self { name: name.into(), settings: settings.map(Into::into).collect() })
    }
}

impl Default for TechniqueSpec {
    fn default() -> Self {
        Self { name: TECHNIQUES[0].name.into(), settings: Vec::new() }
    }
}

/// The technique with its settings.
///
/// # Errors
/// Settings that it does not have or that are out of range.
pub fn create(spec: &TechniqueSpec, stage: &Stage) -> Result<Made, JobError> {
    let mut table = stage.technique_settings(&spec.name)?;
    for setting in &spec.settings {
        table.assign(&spec.name, setting).map_err(JobError::usage)?;
    }
    techniques::find(&spec.name).map_err(JobError::usage)?.create(&table).map_err(JobError::failed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_technique_may_bring_its_settings() {
        let spec: TechniqueSpec = "path:max_depth=2, clamp=10".parse().unwrap();
        assert_eq!(
            (spec.name.as_str(), spec.settings),
            ("path", vec!["max_depth=2".into(), "clamp=10".into()])
        );
        assert!("pth".parse::<TechniqueSpec>().unwrap_err().contains("did you mean path?"));
    }
}
