//! Which numbers a setting takes.

use std::fmt;

/// An interval of numbers. [`fmt::Display`] says it for the reference page and for errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    low: f64,
    low_open: bool,
    high: f64,
    high_open: bool,
}

/// Numbers > 0.
pub fn positive() -> Limits {
    Limits { low: 0.0, low_open: true, high: f64::INFINITY, high_open: true }
}

/// Numbers ≥ `low`.
pub fn at_least(low: f64) -> Limits {
    Limits { low, low_open: false, high: f64::INFINITY, high_open: true }
}

/// Numbers from `low` to `high`, neither included.
pub fn between(low: f64, high: f64) -> Limits {
    Limits { low, low_open: true, high, high_open: true }
}

/// Numbers from `low` to `high`, both included.
pub fn within(low: f64, high: f64) -> Limits {
    Limits { low, low_open: false, high, high_open: false }
}

/// Numbers from 0 to 1, both included.
pub fn fraction() -> Limits {
    within(0.0, 1.0)
}

impl Limits {
    /// Whether a number lies inside.
    pub fn allow(&self, x: f64) -> bool {
        let above = if self.low_open { x > self.low } else { x >= self.low };
        let below = if self.high_open { x < self.high } else { x <= self.high };
        above && below
    }
}

impl fmt::Display for Limits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.high.is_finite(), self.low_open) {
            (true, true) => write!(f, "greater than {} and less than {}", self.low, self.high),
            (true, false) => write!(f, "from {} to {}", self.low, self.high),
            (false, true) => write!(f, "greater than {}", self.low),
            (false, false) => write!(f, "at least {}", self.low),
        }
    }
}
