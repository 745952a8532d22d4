//! The techniques, one folder each, and their table: a new one is a folder and a line in [`TECHNIQUES`].

pub mod bandwidth;
pub mod covariance;
pub mod explain;
pub mod path;
pub mod prt;
pub mod shadow_fields;
pub mod shexp;

use std::fmt::Debug;

use halflight_file::nearest_name;
use halflight_scene::schema::{self, Docs, FieldDoc, Problems, Record, Table};

use crate::technique::Technique;

/// All techniques by the names that scene files and `-t` use; the first is the default.
pub const TECHNIQUES: &[Entry] = &[
    Entry { name: "path", make: |table| make(table, path::Path::new), settings: keys::<path::PathSettings> },
    Entry {
        name: "bandwidth",
        make: |table| make(table, bandwidth::BandwidthTechnique::new),
        settings: keys::<bandwidth::BandwidthSettings>,
    },
    Entry {
        name: "covariance",
        make: |table| make(table, covariance::Covariance::new),
        settings: keys::<covariance::CovarianceSettings>,
    },
    Entry { name: "prt", make: |table| make(table, prt::Prt::new), settings: keys::<prt::PrtSettings> },
    Entry {
        name: "shadow-fields",
        make: |table| make(table, shadow_fields::ShadowFields::new),
        settings: keys::<shadow_fields::ShadowFieldsSettings>,
    },
    Entry {
        name: "shexp",
        make: |table| make(table, shexp::Shexp::new),
        settings: keys::<shexp::ShexpSettings>,
    },
];

/// A line of the table.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// The name, also of the folder and of `[technique.NAME]`.
    pub name: &'static str,
    make: fn(&Table) -> Result<Made, Problems>,
    settings: fn() -> Vec<FieldDoc>,
}

/// A technique that is ready to work.
pub struct Made {
    /// The technique.
    pub technique: Box<dyn Technique>,
    /// Its name and all its settings, defaults included: what its samples depend on.
    pub identity: String,
}

/// There is no technique of that name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no technique {name:?} ({hint})")]
pub struct UnknownTechnique {
    /// What was asked for.
    pub name: String,
    /// What was probably meant, or what there is.
    pub hint: String,
}

/// The keys of a record with their documentation.
fn keys<S: Record>() -> Vec<FieldDoc> {
    S::describe_keys(&mut Docs::new())
}

impl Entry {
    /// Its settings, each with its documentation.
    pub fn settings(&self) -> Vec<FieldDoc> {
        (self.settings)()
    }

    /// The technique with the settings of a table, as a scene or a command line gives them.
    ///
    /// # Errors
    /// Settings that it does not have or that are out of range.
    pub fn create(&self, settings: &Table) -> Result<Made, Problems> {
        let mut made = (self.make)(settings)?;
        made.identity = format!("{} {}", self.name, made.identity);
        Ok(made)
    }
}

/// The technique of that name.
///
/// ```
/// use halflight_render::techniques;
/// assert_eq!(techniques::find("path").unwrap().name, "path");
/// assert!(techniques::find("pth").unwrap_err().to_string().contains("did you mean path?"));
/// ```
///
/// # Errors
/// If there is none.
pub fn find(name: &str) -> Result<&'static Entry, UnknownTechnique> {
    TECHNIQUES.iter().find(|entry| entry.name == name).ok_or_else(|| {
        let names = || TECHNIQUES.iter().map(|entry| entry.name);
        let hint = match nearest_name(name, names()) {
            Some(near) => format!("did you mean {near}?"),
            None => format!("there is {}", names().collect::<Vec<_>>().join(", ")),
        };
        UnknownTechnique { name: name.into(), hint }
    })
}

/// From settings to a technique, for the table.
fn make<S: Record + Debug, T: Technique + 'static>(table: &Table, new: fn(S) -> T) -> Result<Made, Problems> {
    let settings: S = schema::read(table)?;
    let identity = format!("{settings:?}");
    Ok(Made { technique: Box::new(new(settings)), identity })
}

#[cfg(test)]
mod tests {
    use super::*;
    use halflight_scene::schema::Source;

    #[test]
    fn names_are_told_apart_and_none_is_the_beginning_of_another_with_a_dot() {
        for (i, a) in TECHNIQUES.iter().enumerate() {
            assert!(!a.name.is_empty() && !a.name.contains(['.', ':', ',', ' ']));
            assert!(TECHNIQUES[i + 1..].iter().all(|b| b.name != a.name));
        }
    }

    #[test]
    fn every_technique_works_with_its_defaults_and_refuses_settings_that_it_does_not_have() {
        let strange = Table::parse(&Source::option("test", "no_such_setting = 1")).unwrap();
        for entry in TECHNIQUES {
            let made = entry.create(&Table::empty()).unwrap();
            assert!(made.identity.starts_with(entry.name));
            assert!(entry.create(&strange).is_err());
        }
    }
}
