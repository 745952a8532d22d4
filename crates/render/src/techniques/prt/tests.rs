//! Transfer against what it should be.
