//! The techniques by name, and their settings from the scene, from `--set` and from the technique's own words.

use std::str::FromStr;

use halflight_file::nearest_name;
use halflight_render::Technique;
use halflight_render::techniques::path::{Path, PathSettings};
use halflight_scene::schema;

use super::failure::Failure;
use super::stage::Stage;

/// The names that `-t` takes.
pub(crate) const NAMES: &[&str] = &["path"];

/// `path`, or with settings `path:max_depth=2,clamp=10`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TechniqueSpec {
    pub(crate) name: String,
    /// Each `key=value`.
    pub(crate) settings: Vec<String>,
}

impl FromStr for TechniqueSpec {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, settings) = text.split_once(':').unwrap_or((text, ""));
        check_name(name)?;
        let settings = settings.split(',').map(str::trim).filter(|s| !s.is_empty());
        Ok(Self { name: name.into(), settings: settings.map(Into::into).collect() })
    }
}

/// Whether there is such a technique; if not, which one was probably meant.
pub(crate) fn check_name(name: &str) -> Result<(), String> {
    if NAMES.contains(&name) {
        return Ok(());
    }
    let hint = match nearest_name(name, NAMES.iter().copied()) {
        Some(near) => format!("did you mean {near}?"),
        None => format!("there is {}", NAMES.join(", ")),
    };
    Err(format!("there is no technique {name:?} ({hint})"))
}

/// The technique with its settings, and all of them as text: what the samples depend on.
pub(crate) fn create(spec: &TechniqueSpec, stage: &Stage) -> Result<(Box<dyn Technique>, String), Failure> {
    let mut table = stage.technique_settings(&spec.name)?;
    for setting in &spec.settings {
        table.assign(&spec.name, setting).map_err(Failure::usage)?;
    }
    match spec.name.as_str() {
        "path" => {
            let settings: PathSettings = schema::read(&table).map_err(Failure::failed)?;
            Ok((Box::new(Path::new(settings)), format!("path {settings:?}")))
        }
        other => Err(Failure::usage(format!("there is no technique {other:?}"))),
    }
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
