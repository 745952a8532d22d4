//! A path's covariance step by step, for people who ask why a pixel was sampled as it was.

use std::fmt;

use super::matrix::Covariance;

/// One event, with what matters of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Event<const N: usize> {
    /// What happened, in words.
    pub name: String,
    /// The matrix after it.
    pub covariance: Covariance<N>,
}

/// The events of a path in the order in which light meets them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Steps<const N: usize> {
    /// What happened so far.
    pub events: Vec<Event<N>>,
}

impl<const N: usize> Steps<N> {
    /// Notes an event; the name is made only by those who remember.
    pub fn note(&mut self, name: impl Into<String>, covariance: &Covariance<N>) {
        self.events.push(Event { name: name.into(), covariance: *covariance });
    }
}

/// Names of the dimensions.
fn axes<const N: usize>() -> &'static [&'static str] {
    match N {
        2 => &["x", "u"],
        3 => &["x", "u", "t"],
        4 => &["x", "y", "u", "v"],
        _ => &["x", "y", "u", "v", "t"],
    }
}

impl<const N: usize> fmt::Display for Steps<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for event in &self.events {
            writeln!(f, "{}", event.name)?;
            for (i, row) in event.covariance.rows.iter().enumerate() {
                write!(f, "    {:>2}", axes::<N>().get(i).copied().unwrap_or("?"))?;
                for value in row {
                    write!(f, " {value:>12.4e}")?;
                }
                writeln!(f)?;
            }
        }
        Ok(())
    }
}
