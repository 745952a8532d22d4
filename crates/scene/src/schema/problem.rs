//! What is wrong with a setting, and where.

use std::fmt;

use halflight_file::LoadError;

use super::source::Origin;

/// One thing that is wrong: where it stands, what was found, what was expected, and what to try.
#[derive(Clone, Debug, PartialEq)]
pub struct Problem {
    /// Where.
    pub origin: Origin,
    /// What was found, as a sentence without a full stop.
    pub message: String,
    /// What was expected, or what to try; may be empty.
    pub help: Vec<String>,
}

impl Problem {
    /// A problem at a place.
    pub fn new(origin: &Origin, message: impl Into<String>) -> Self {
        Self { origin: origin.clone(), message: message.into(), help: Vec::new() }
    }

    /// The same problem with a line of help.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help.push(help.into());
        self
    }

    /// The same problem with the nearest of several names offered, or all of them if none is near.
    #[must_use]
    pub fn offer<'a>(self, found: &str, names: impl IntoIterator<Item = &'a str>) -> Self {
        /// More names than this are not listed.
        const MANY: usize = 24;
        let names: Vec<&str> = names.into_iter().collect();
        match halflight_file::nearest_name(found, names.iter().copied()) {
            Some(name) => self.help(format!("did you mean `{name}`?")),
            None if names.is_empty() => self,
            None => {
                let listed: Vec<String> = names.iter().take(MANY).map(|n| format!("`{n}`")).collect();
                let more = if names.len() > MANY { ", …" } else { "" };
                self.help(format!("expected one of {}{more}", listed.join(", ")))
            }
        }
    }

    /// A file that a setting names and that could not be loaded.
    pub fn load(origin: &Origin, error: &LoadError) -> Self {
        let mut bare = error.clone();
        let hint = bare.hint.take();
        let problem = Self::new(origin, bare.to_string());
        match hint {
            Some(hint) => problem.help(hint),
            None => problem,
        }
    }

    /// Line and column, both counted from one.
    pub fn line_column(&self) -> (usize, usize) {
        self.origin.line_column()
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.message)?;
        f.write_str(&self.origin.excerpt())?;
        for help in &self.help {
            writeln!(f, "  = {help}")?;
        }
        Ok(())
    }
}

/// Everything that is wrong with a text, in the order it stands there; at least one problem.
///
/// Displays as compilers do:
/// ```text
/// `exponnent` is not a key of a phong material
///  --> still-life.toml:12:1
///    |
/// 12 | exponnent = 40
///    | ^^^^^^^^^
///   = did you mean `exponent`?
/// ```
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub struct Problems(pub Vec<Problem>);

impl Problems {
    /// The first of them.
    pub fn first(&self) -> Option<&Problem> {
        self.0.first()
    }
}

impl From<Problem> for Problems {
    fn from(problem: Problem) -> Self {
        Self(vec![problem])
    }
}

impl fmt::Display for Problems {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        /// Past this many the reader has enough to do.
        const SHOWN: usize = 20;
        for (index, problem) in self.0.iter().take(SHOWN).enumerate() {
            if index > 0 {
                f.write_str("\nerror: ")?;
            }
            problem.fmt(f)?;
        }
        if self.0.len() > SHOWN {
            writeln!(f, "\n… and {} more", self.0.len() - SHOWN)?;
        }
        Ok(())
    }
}
